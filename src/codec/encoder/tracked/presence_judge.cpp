#include "codec/encoder/tracked/presence_judge.h"

#include <algorithm>
#include <limits>

#include "core/disjoint_sets.h"
#include "surface/open_border.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

constexpr float at_first = 0.7F;  // score of what was captured once

// How much of a vertex's surroundings is seen: two rounds of averaging with the neighbours.
std::vector<float> seen_around(std::span<const std::uint8_t> seen, const VerticesAround& around) {
    constexpr int rounds = 2;
    std::vector<float> now(seen.size()), next(seen.size());
    for (std::size_t v = 0; v < seen.size(); ++v) now[v] = seen[v] == 1 ? 1.0F : 0.0F;
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t v = 0; v < now.size(); ++v) {
            float sum = now[v];
            const auto beside = around.of(v);
            for (const auto u : beside) sum += now[u];
            next[v] = sum / static_cast<float>(1 + beside.size());
        }
        now.swap(next);
    }
    return now;
}

PresenceHistory first_history(const TrackedPlace& tracked) {
    const std::size_t vertices = tracked.positions.size();
    PresenceHistory out;
    out.score.assign(vertices, at_first);
    out.unseen.assign(vertices, 0);
    out.shown.assign(vertices, 1);
    for (std::size_t v = 0; v < vertices && !tracked.of_reference.empty(); ++v)
        if (tracked.of_reference[v] == 0) out.score[v] = 0, out.shown[v] = 0;
    return out;
}

// Keeps what has just vanished within what is shown: a hole whose rim is all shown, and which nothing else was missing
// from, nor is seen elsewhere. At the border of all that is known there is no telling.
void fill_new_holes(std::span<const std::uint8_t> seen, const TrackedPlace& tracked, const PresenceHistory& before,
                    const PresenceOptions& options, PresenceHistory& now) {
    const std::size_t vertices = now.shown.size();
    bool any = false;
    for (std::size_t v = 0; v < vertices && !any; ++v) any = now.shown[v] == 0 && before.shown[v] != 0;
    if (!any) return;
    const auto from_border = edges_from_border(points_of(tracked.positions), tracked.triangles);
    DisjointSets holes(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v)
        if (now.shown[v] == 0)
            for (const auto u : tracked.around.of(v))
                if (now.shown[u] == 0) holes.join(v, u);
    std::vector<std::uint8_t> stays(vertices, 0);
    for (std::uint32_t v = 0; v < vertices; ++v) {
        const bool known = before.shown[v] != 0 && seen[v] == 0 && now.unseen[v] <= options.hold;
        if (now.shown[v] == 0 && (!known || from_border[v] == 0)) stays[holes.of(v)] = 1;
    }
    for (std::uint32_t v = 0; v < vertices; ++v)
        if (now.shown[v] == 0 && stays[holes.of(v)] == 0) now.shown[v] = 1;
}

void hide_specks(const TrackedPlace& tracked, const PresenceOptions& options, Presence& shown) {
    DisjointSets parts(shown.size());
    std::vector<double> area(shown.size(), 0);
    std::vector<const Triangle*> there;
    for (const auto& t : tracked.triangles)
        if (shown[t[0]] != 0 && shown[t[1]] != 0 && shown[t[2]] != 0) there.push_back(&t);
    for (const auto* t : there) parts.join((*t)[0], (*t)[1]), parts.join((*t)[1], (*t)[2]);
    for (const auto* t : there) area[parts.of((*t)[0])] += length(area_vector(tracked.positions, *t)) / 2;
    const double least = options.speck.value * options.speck.value;
    for (std::uint32_t v = 0; v < shown.size(); ++v)
        if (area[parts.of(v)] < least) shown[v] = 0;
}

}  // namespace

PresenceHistory judge_presence(std::span<const std::uint8_t> seen, const TrackedPlace& tracked,
                               const PresenceHistory& before, const PresenceOptions& options) {
    constexpr float gain = 0.6F, comes_from = 0.45F, goes_below = 0.3F;
    constexpr auto most_unseen = std::numeric_limits<std::uint16_t>::max();
    const auto was = before.score.empty() ? first_history(tracked) : before;
    const auto share = seen_around(seen, tracked.around);
    PresenceHistory out = was;
    for (std::size_t v = 0; v < seen.size(); ++v) {
        // Half by itself, so that a rim that has curled away goes though all around it is seen.
        const float now = (share[v] + (seen[v] == 1 ? 1.0F : 0.0F)) / 2;
        out.score[v] += gain * (now - out.score[v]);
        out.unseen[v] =
            seen[v] == 1 ? std::uint16_t{0} : static_cast<std::uint16_t>(std::min<int>(was.unseen[v] + 1, most_unseen));
        out.shown[v] = out.score[v] > (was.shown[v] != 0 ? goes_below : comes_from) ? 1 : 0;
    }
    if (options.fill) fill_new_holes(seen, tracked, was, options, out);
    if (options.leave_out_specks) hide_specks(tracked, options, out.shown);
    return out;
}

PresenceHistory on_new_reference(const PresenceHistory& before, std::span<const std::uint32_t> kept,
                                 std::size_t vertices) {
    PresenceHistory out;
    if (before.score.empty()) return out;
    out.score.assign(vertices, at_first);
    out.unseen.assign(vertices, 0);
    out.shown.assign(vertices, 1);
    for (std::size_t v = 0; v < kept.size(); ++v) {
        out.score[v] = before.score[kept[v]];
        out.unseen[v] = before.unseen[kept[v]];
        out.shown[v] = before.shown[kept[v]];
    }
    return out;
}

}  // namespace htvm::internal
