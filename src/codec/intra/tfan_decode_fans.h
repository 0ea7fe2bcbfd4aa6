// The decoder's traversal, shared by TFAN and M-TFAN.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "codec/intra/tfan_syntax.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// Decodes triangle_count triangles, in visiting numbers; false where the stream is corrupt. The Discovery says what is
// coded besides the fans:
//     static constexpr bool visits_isolated   whether vertices without triangles are visited as seeds
//     bool seed()                             a seed takes the next visiting number; false where no vertex is left
//     FanHints hints(const FanState&)         contexts for the fan's next step
//     bool discover(const FanState&)          a vertex met by the fan takes it; false where it cannot
template <class Discovery>
bool decode_fans(RangeDecoder& decoder, std::uint32_t triangle_count, Discovery& discovery,
                 std::vector<Triangle>& triangles) {
    FanReader coder{decoder};
    const auto models_owner = std::make_unique<FanModels>();
    FanModels& models = *models_owner;
    OpenEdges edges;
    const auto discover = [&](const FanState& fan) {
        edges.add_vertex();
        return discovery.discover(fan);
    };
    const auto decode_fan = [&](FanState& fan) {
        code_start(coder, models, edges, fan, OpenEdges::none);
        if (fan.start == OpenEdges::none) {
            fan.start = edges.vertex_count();
            if (!discover(fan)) return false;
        }
        if (fan.start >= edges.vertex_count()) return false;
        fan.current = fan.start;
        find_ends(edges, fan);
        while (triangles.size() < triangle_count) {
            look_around(edges, fan);
            CodedStep step = code_step(coder, models, edges, fan, discovery.hints(fan), {});
            if (step.step == Step::stop) return true;
            if (step.step == Step::new_vertex) {
                step.vertex = edges.vertex_count();
                if (!discover(fan)) return false;
            }
            if (step.vertex >= edges.vertex_count() || decoder.exhausted()) return false;
            triangles.push_back({fan.focus, fan.current, step.vertex});
            edges.add_triangle(fan.focus, fan.current, step.vertex);
            advance(fan, step);
            if (step.step == Step::close) return true;
        }
        return true;
    };
    for (std::uint32_t focus = 0; triangles.size() < triangle_count; ++focus) {
        bool implied = false;
        if (focus == edges.vertex_count()) {
            if (!discovery.seed() || decoder.exhausted()) return false;
            edges.add_vertex();
            implied = !Discovery::visits_isolated;
        }
        for (; triangles.size() < triangle_count; implied = false) {
            if (!implied && !code_more_fans(coder, models, edges, focus, false)) break;
            FanState fan;
            fan.focus = focus;
            if (!decode_fan(fan)) return false;
        }
    }
    return true;
}

}  // namespace htvm::internal
