#include "codec/tracked/presence.h"

#include <algorithm>
#include <array>

#include "entropy/models.h"

namespace htvm::internal {
namespace {

// ---- Contexts -------------------------------------------------------------------------------------------------------

// How far the border was before: a vertex at it, one beside that, any other.
enum Nearness : std::uint8_t { at_border, beside_border, off_border, nearnesses };
// What became of the neighbours that are coded already.
enum Neighbours : std::uint8_t { none_coded, all_there, mixed, none_there, neighbour_classes };
enum Changes : std::uint8_t { unchanged, some_came, some_left, change_classes };

// The models begin where they mostly end, since there are few vertices to learn from: most vertices are what they were,
// at the border less often, and follow neighbours that changed.
struct PresenceModels {
    static constexpr std::size_t befores = 3;
    std::array<BinaryModel, befores * nearnesses * neighbour_classes * change_classes> is_there;

    PresenceModels() {
        constexpr std::array<int, nearnesses> stays = {60000, 64500, 65450};  // of 65536
        constexpr std::uint16_t begun = 6;                                    // decisions that this counts for
        for (int before = 0; before < static_cast<int>(befores); ++before)
            for (int near = 0; near < nearnesses; ++near)
                for (int beside = 0; beside < neighbour_classes; ++beside)
                    for (int changes = 0; changes < change_classes; ++changes) {
                        int one = before == 0   ? 65536 - stays[static_cast<std::size_t>(near)]
                                  : before == 1 ? stays[static_cast<std::size_t>(near)]
                                                : 32768;
                        if (beside == none_there || changes == some_left) one -= one / 4;
                        if (beside == none_there && changes == some_left) one /= 4;
                        if (beside == all_there || changes == some_came) one += (65536 - one) / 4;
                        if (beside == all_there && changes == some_came) one = 65536 - (65536 - one) / 4;
                        auto& model = of(before, near, beside, changes);
                        model.one = static_cast<std::uint16_t>(std::clamp(one, 64, 65472));
                        model.seen = begun;
                    }
    }
    BinaryModel& of(int before, int near, int beside, int changes) {
        const int index = ((before * nearnesses + near) * neighbour_classes + beside) * change_classes + changes;
        return is_there[static_cast<std::size_t>(index)];
    }
};

std::vector<std::uint8_t> nearness_of(const VerticesAround& around, std::span<const std::uint8_t> before) {
    const std::size_t vertices = before.size();
    std::vector<std::uint8_t> out(vertices, off_border);
    for (std::size_t v = 0; v < vertices; ++v)
        for (const auto u : around.of(v))
            if (before[u] != before[v]) out[v] = at_border;
    for (std::size_t v = 0; v < vertices; ++v)
        if (out[v] == at_border)
            for (const auto u : around.of(v))
                if (out[u] == off_border) out[u] = beside_border;
    return out;
}

// ---- The walk -------------------------------------------------------------------------------------------------------

template <class Coder>
Presence code_presence(Coder& coder, const VerticesAround& around, std::span<const std::uint8_t> before,
                       std::span<const std::uint8_t> wanted) {
    const auto vertices = static_cast<std::uint32_t>(before.size());
    const auto nearness = nearness_of(around, before);
    PresenceModels models;
    Presence out(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v) {
        unsigned there = 0, missing = 0, came = 0, left = 0;
        for (const auto u : around.of(v)) {
            if (u >= v) continue;
            ++(out[u] != 0 ? there : missing);
            if (out[u] != 0 && before[u] == 0) ++came;
            if (out[u] == 0 && before[u] == 1) ++left;
        }
        const auto beside = there + missing == 0 ? none_coded
                            : missing == 0       ? all_there
                            : there == 0         ? none_there
                                                 : mixed;
        const auto changes = came == left ? unchanged : came > left ? some_came : some_left;
        auto& model = models.of(before[v], nearness[v], beside, changes);
        out[v] = coder.bit(model, !wanted.empty() && wanted[v] != 0) ? 1 : 0;
    }
    return out;
}

// One bit says that everything is as it was.
bool is_as_before(std::span<const std::uint8_t> before, std::span<const std::uint8_t> presence) {
    return std::equal(before.begin(), before.end(), presence.begin(), presence.end(),
                      [](auto was, auto is) { return (was != 0) == (is != 0); });
}

Presence as_before(std::span<const std::uint8_t> before) {
    Presence out(before.begin(), before.end());
    for (auto& is : out) is = is != 0 ? 1 : 0;
    return out;
}

std::size_t vertices_of(const VerticesAround& around) { return around.first.empty() ? 0 : around.first.size() - 1; }

Presence known(const VerticesAround& around, std::span<const std::uint8_t> before) {
    if (before.empty()) return Presence(vertices_of(around), 1);
    return {before.begin(), before.end()};
}

}  // namespace

void write_presence(RangeEncoder& encoder, const VerticesAround& around, std::span<const std::uint8_t> before,
                    std::span<const std::uint8_t> presence) {
    const auto was = known(around, before);
    WritingCoder<RangeEncoder> coder{encoder};
    const bool same = is_as_before(was, presence);
    coder.raw(same ? 1 : 0, 1);
    if (!same) code_presence(coder, around, was, presence);
}

Presence read_presence(RangeDecoder& decoder, const VerticesAround& around, std::span<const std::uint8_t> before) {
    const auto was = known(around, before);
    ReadingCoder<RangeDecoder> coder{decoder};
    if (coder.raw(0, 1) != 0) return as_before(was);
    return code_presence(coder, around, was, {});
}

std::vector<std::uint8_t> write_presence_layer(std::span<const Triangle> triangles,
                                               std::span<const std::uint8_t> presence) {
    RangeEncoder encoder;
    write_presence(encoder, vertices_around(presence.size(), triangles), {}, presence);
    return encoder.finish();
}

Result<Presence> read_presence_layer(std::span<const std::uint8_t> layer, std::size_t vertices,
                                     std::span<const Triangle> triangles) {
    RangeDecoder decoder(layer);
    auto out = read_presence(decoder, vertices_around(vertices, triangles), {});
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "presence: its run ends too early");
    return out;
}

Presence presence_between(std::span<const std::uint8_t> earlier, std::span<const std::uint8_t> later) {
    Presence out(later.begin(), later.end());
    for (std::size_t v = 0; v < out.size(); ++v) {
        const bool was = earlier.empty() || earlier[v] != 0;
        if (was != (out[v] != 0)) out[v] = doubtful_presence;
    }
    return out;
}

Presence presence_of_patched(std::span<const std::uint8_t> presence, std::span<const std::uint32_t> stays,
                             std::size_t vertices) {
    Presence out(vertices, 1);
    for (std::size_t v = 0; v < stays.size() && !presence.empty(); ++v) out[v] = presence[stays[v]];
    return out;
}

bool anything_absent(std::span<const std::uint8_t> presence) {
    return std::find(presence.begin(), presence.end(), 0) != presence.end();
}

void triangles_shown(std::span<const Triangle> triangles, std::span<const std::uint8_t> presence,
                     std::vector<Triangle>& out) {
    out.clear();
    for (const auto& t : triangles)
        if (presence.empty() || (presence[t[0]] != 0 && presence[t[1]] != 0 && presence[t[2]] != 0)) out.push_back(t);
}

}  // namespace htvm::internal
