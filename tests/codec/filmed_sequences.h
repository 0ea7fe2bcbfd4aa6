// Sequences as one camera captures them: what faces it, with the places in its film as texture coordinates.
#pragma once

#include <array>
#include <vector>

#include "codec/patched_sequences.h"

namespace htvm::test {

// Looks along -z from 1.5 m before the origin, and so far to the right.
struct FilmCamera {
    double right = 0;
    std::array<double, 2> place(double x, double y, double z) const {
        const double depth = 1500 - z;
        return {0.5 + 0.9 * (x - right) / depth, 0.5 + 1.2 * y / depth};
    }
};

inline Mesh filmed(const Mesh& whole, const FilmCamera& camera) {
    constexpr std::uint32_t none = 0xFFFFFFFF;
    std::vector<std::uint32_t> number(whole.positions.size(), none);
    Mesh out;
    for (const auto& t : whole.triangles) {
        const auto &a = whole.positions[t[0]], &b = whole.positions[t[1]], &c = whole.positions[t[2]];
        if ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0) continue;
        Triangle seen{};
        for (std::size_t k = 0; k < 3; ++k) {
            auto& as = number[t[k]];
            if (as == none) {
                as = static_cast<std::uint32_t>(out.positions.size());
                const auto& p = whole.positions[t[k]];
                const auto [u, v] =
                    camera.place(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
                out.positions.push_back(p);
                out.colours.push_back(whole.colours[t[k]]);
                out.texcoords.push_back({static_cast<float>(u), static_cast<float>(v)});
            }
            seen[k] = as;
        }
        out.triangles.push_back(seen);
    }
    return out;
}

// step: by which the camera goes to the right from frame to frame, mm.
inline TestSequence filmed(TestSequence sequence, double step = 0) {
    FilmCamera camera;
    for (auto& frame : sequence.frames) {
        frame.mesh = filmed(frame.mesh, camera);
        camera.right += step;
    }
    return sequence;
}

inline EncoderOptions filmed_options() {
    auto out = patched_options();
    out.texture = {TextureLayout::projection, 512, 256};
    return out;
}

}  // namespace htvm::test
