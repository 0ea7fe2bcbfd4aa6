#include "codec/tracked/surface_patch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <optional>

#include "codec/intra/colours.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/neighbours.h"
#include "codec/intra/positions.h"
#include "codec/intra/tfan.h"
#include "codec/reference/quantiser_cells.h"
#include "codec/tracked/tracked_frame.h"
#include "core/geometry.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

tl::unexpected<Error> corrupt(const char* what) { return fail(ErrorKind::corrupt_stream, what); }

// ---- What goes ------------------------------------------------------------------------------------------------------

// What happens to a vertex, or to the vertices below a node of the hierarchy.
enum class Share : std::uint8_t { stays, goes, mixed };

// By node, level by level: [0] the vertices, [1 + k] level k of the hierarchy.
using Shares = std::vector<std::vector<Share>>;

Shares shares_of(const VertexHierarchy& hierarchy, const std::vector<bool>& removed) {
    Shares out(1);
    for (const bool goes : removed) out[0].push_back(goes ? Share::goes : Share::stays);
    for (const auto& level : hierarchy.levels) {
        const auto& below = out.back();
        std::vector<Share> shares;
        for (std::size_t p = 0; p < level.size(); ++p) {
            const auto first = below[level.first[p]];
            const bool same = level.second[p] == no_node || below[level.second[p]] == first;
            shares.push_back(same ? first : Share::mixed);
        }
        out.push_back(std::move(shares));
    }
    return out;
}

// Contexts: how many vertices are below the node, and what its twin is, if that came before it.
struct ShareModels {
    static constexpr std::size_t sizes = 17, twins = 4;
    std::array<std::array<BinaryModel, twins>, sizes> mixed, goes;
};

template <class Coder>
Share code_share(Coder& coder, ShareModels& models, std::uint32_t vertices, std::optional<Share> twin, Share wanted) {
    const auto size = std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(vertices)), ShareModels::sizes - 1);
    const std::size_t context = twin ? 1 + static_cast<std::size_t>(*twin) : 0;
    if (vertices > 1 && coder.bit(models.mixed[size][context], wanted == Share::mixed)) return Share::mixed;
    // A node whose halves both go, or both stay, is not mixed: beside a half that stays, the other goes.
    if (twin == Share::stays) return Share::goes;
    if (twin == Share::goes) return Share::stays;
    return coder.bit(models.goes[size][context], wanted == Share::goes) ? Share::goes : Share::stays;
}

// From the root down; below a node that is not mixed, nothing is coded. Returns the vertices'. wanted: as many levels
// as the hierarchy has and one, or none where they are read.
template <class Coder>
std::vector<Share> code_shares(Coder& coder, const VertexHierarchy& hierarchy, const Shares& wanted) {
    const auto wanted_of = [&](std::size_t level, std::size_t node) {
        return wanted.empty() ? Share::stays : wanted[level][node];
    };
    ShareModels models;
    const std::size_t top = hierarchy.levels.size();
    std::vector<Share> nodes;
    if (hierarchy.vertex_count > 0)
        nodes.push_back(code_share(coder, models, static_cast<std::uint32_t>(hierarchy.vertex_count), std::nullopt,
                                   wanted_of(top, 0)));
    for (std::size_t k = top; k-- > 0;) {
        const auto& level = hierarchy.levels[k];
        const auto* below = k > 0 ? &hierarchy.levels[k - 1] : nullptr;
        const auto vertices = [&](std::uint32_t node) { return below ? below->vertices[node] : 1u; };
        std::vector<Share> next(below ? below->size() : hierarchy.vertex_count);
        for (std::size_t p = 0; p < level.size(); ++p) {
            const auto first = level.first[p], second = level.second[p];
            if (nodes[p] != Share::mixed || second == no_node) {
                next[first] = nodes[p];
                if (second != no_node) next[second] = nodes[p];
                continue;
            }
            next[first] = code_share(coder, models, vertices(first), std::nullopt, wanted_of(k, first));
            next[second] = code_share(coder, models, vertices(second), next[first], wanted_of(k, second));
        }
        nodes = std::move(next);
    }
    return nodes;
}

// ---- The piece's border ---------------------------------------------------------------------------------------------

// For each vertex of the piece, in the order of its fans, its place on the open border, or `none` for a new vertex.
//
// The place of a vertex is predicted from the last of its neighbours that lie on the border too: mostly it is the next
// one along it. A corrupt place leads off the border and gives nothing.
template <class Coder>
std::optional<std::vector<std::uint32_t>> code_places(Coder& coder, std::span<const Triangle> triangles,
                                                      std::size_t vertices, std::size_t border,
                                                      std::span<const std::uint32_t> wanted) {
    std::array<std::array<BinaryModel, 3>, 3> on_border;  // by known neighbours on the border, and off it
    std::array<SignedModel, 2> step;                      // from the vertex before, from a neighbour
    const auto around = triangles_around(vertices, triangles);
    std::vector<std::uint32_t> place(vertices, none);
    std::uint32_t last = 0;
    for (std::uint32_t v = 0; v < vertices; ++v) {
        std::array<std::size_t, 2> known{};  // off, on the border; a neighbour counts for each triangle
        std::uint32_t neighbour = none;
        for (const auto t : around.of(v))
            for (const auto u : triangles[t]) {
                if (u >= v) continue;
                ++known[place[u] != none];
                if (place[u] != none && (neighbour == none || u > neighbour)) neighbour = u;
            }
        auto& model = on_border[std::min<std::size_t>(known[1], 2)][std::min<std::size_t>(known[0], 2)];
        const bool wanted_on = !wanted.empty() && wanted[v] != none;
        if (!coder.bit(model, wanted_on)) continue;
        const std::int64_t from = neighbour != none ? place[neighbour] : last;
        const auto difference = coder.signed_number(
            step[neighbour != none], wanted_on ? static_cast<std::int32_t>(std::int64_t{wanted[v]} - from) : 0);
        const std::int64_t at = from + difference;
        if (at < 0 || at >= static_cast<std::int64_t>(border)) return std::nullopt;
        place[v] = last = static_cast<std::uint32_t>(at);
    }
    return place;
}

// ---- The piece's vertices -------------------------------------------------------------------------------------------

// Which of the piece's vertices both sides know, and what they know: positions in steps, colours as they are.
struct KnownVertices {
    std::vector<std::uint8_t> known;
    std::vector<LatticePoint> positions;
    std::vector<Colour> colours;
};

KnownVertices known_vertices(std::span<const std::uint32_t> place, std::span<const std::uint32_t> border,
                             const TrackedSurface& tracked, std::int32_t step) {
    KnownVertices out;
    for (const auto at : place) {
        out.known.push_back(at != none);
        out.positions.push_back(at != none ? to_grid(tracked.positions[border[at]], step) : LatticePoint{});
        if (!tracked.colours.empty()) out.colours.push_back(at != none ? tracked.colours[border[at]] : Colour{});
    }
    return out;
}

// What stays, and the piece behind it.
PatchedSurface joined(const TrackedSurface& tracked, const std::vector<bool>& removed,
                      std::span<const std::uint32_t> border, std::span<const std::uint32_t> place,
                      std::span<const Triangle> triangles, std::span<const LatticePoint> positions,
                      std::span<const Colour> colours) {
    PatchedSurface out;
    auto& mesh = out.mesh;
    const std::size_t most = tracked.positions.size() + place.size();
    out.stays.reserve(tracked.positions.size());
    mesh.positions.reserve(most);
    if (!tracked.colours.empty()) mesh.colours.reserve(most);
    mesh.triangles.reserve(tracked.triangles.size() + triangles.size());
    std::vector<std::uint32_t> number(tracked.positions.size(), none);
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (removed[v]) continue;
        number[v] = static_cast<std::uint32_t>(out.stays.size());
        out.stays.push_back(static_cast<std::uint32_t>(v));
        mesh.positions.push_back(tracked.positions[v]);
        if (!tracked.colours.empty()) mesh.colours.push_back(tracked.colours[v]);
    }
    std::vector<std::uint32_t> of_piece;
    for (std::size_t v = 0; v < place.size(); ++v) {
        if (place[v] != none) {
            of_piece.push_back(number[border[place[v]]]);
            continue;
        }
        of_piece.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
        mesh.positions.push_back(positions[v]);
        if (!tracked.colours.empty()) mesh.colours.push_back(colours[v]);
    }
    for (const auto& t : tracked.triangles)
        if (const Triangle own{number[t[0]], number[t[1]], number[t[2]]};
            own[0] != none && own[1] != none && own[2] != none)
            mesh.triangles.push_back(own);
    for (const auto& t : triangles) mesh.triangles.push_back({of_piece[t[0]], of_piece[t[1]], of_piece[t[2]]});
    return out;
}

}  // namespace

std::vector<std::uint32_t> open_border(std::span<const Triangle> triangles, const std::vector<bool>& removed) {
    enum : std::uint8_t { has_staying = 1, has_going = 2, listed = 4 };
    const std::vector<std::uint8_t> goes(removed.begin(), removed.end());  // bytes are faster to read than bits
    std::vector<std::uint8_t> is(removed.size(), 0);
    std::vector<std::uint32_t> next(removed.size(), none);  // along the border, the lowest if it branches
    for (const auto& t : triangles) {
        const auto gone = goes[t[0]] + goes[t[1]] + goes[t[2]];
        for (std::size_t i = 0; i < 3; ++i) {
            is[t[i]] |= gone > 0 ? has_going : has_staying;
            // The edge that faces the only vertex that goes.
            if (gone == 1 && goes[t[i]]) next[t[(i + 1) % 3]] = std::min(next[t[(i + 1) % 3]], t[(i + 2) % 3]);
        }
    }
    const auto opens = [&](std::uint32_t v) { return !removed[v] && is[v] == (has_staying | has_going); };
    std::vector<std::uint32_t> out;
    for (std::uint32_t start = 0; start < removed.size(); ++start)
        for (auto v = start; v != none && opens(v); v = next[v]) {
            out.push_back(v);
            is[v] |= listed;
        }
    return out;
}

Result<PatchedSurface> encode_patch(const TrackedSurface& tracked, const VertexHierarchy& hierarchy,
                                    const SurfacePatch& patch, const PatchSteps& steps, FramePayload& payload) {
    const std::size_t old = tracked.positions.size();
    if (patch.removed.size() != old || hierarchy.vertex_count != old ||
        (!tracked.colours.empty() && patch.colours.size() != patch.positions.size()))
        return fail(ErrorKind::bad_input, "patch: its sizes are not those of the tracked mesh");
    RangeEncoder removed;
    WritingCoder<RangeEncoder> removed_coder{removed};
    code_shares(removed_coder, hierarchy, shares_of(hierarchy, patch.removed));
    payload.set(Layer::removed, removed.finish());

    const auto border = open_border(tracked.triangles, patch.removed);
    std::vector<std::uint32_t> place_of(old, none);
    for (std::uint32_t i = 0; i < border.size(); ++i) place_of[border[i]] = i;
    // The piece's own numbers, in the order in which its triangles name them.
    std::vector<std::uint32_t> number(old + patch.positions.size(), none), vertices;
    std::vector<Triangle> piece;
    for (const auto& t : patch.triangles) {
        Triangle own{};
        for (std::size_t i = 0; i < 3; ++i) {
            if (t[i] >= number.size() || (t[i] < old && place_of[t[i]] == none))
                return fail(ErrorKind::bad_input, "patch: a triangle names a vertex that is not on the open border");
            if (number[t[i]] == none) {
                number[t[i]] = static_cast<std::uint32_t>(vertices.size());
                vertices.push_back(t[i]);
            }
            own[i] = number[t[i]];
        }
        piece.push_back(own);
    }
    auto fans = encode_tfan(static_cast<std::uint32_t>(vertices.size()), piece);
    std::vector<std::uint32_t> place;
    for (const auto v : fans.order) place.push_back(vertices[v] < old ? place_of[vertices[v]] : none);
    RangeEncoder places;
    WritingCoder<RangeEncoder> place_coder{places};
    code_places(place_coder, fans.triangles, place.size(), border.size(), place);
    payload.set(Layer::border, places.finish());
    payload.set(Layer::fans, std::move(fans.bytes));

    auto known = known_vertices(place, border, tracked, steps.geometry);
    for (std::size_t v = 0; v < place.size(); ++v) {
        if (place[v] != none) continue;
        const auto own = vertices[fans.order[v]] - old;
        known.positions[v] = to_grid(patch.positions[own], steps.geometry);
        if (!tracked.colours.empty()) known.colours[v] = patch.colours[own];
    }
    const auto neighbours = find_neighbours(fans.triangles, place.size(), known.known);
    if (!neighbours) return tl::unexpected(neighbours.error());
    payload.set(Layer::geometry, encode_intra_positions(known.positions, *neighbours, known.known));
    auto positions = std::move(known.positions);
    auto colours = std::move(known.colours);
    if (!tracked.colours.empty()) {
        auto coded = encode_intra_colours(colours, positions, *neighbours, steps.colour, known.known);
        payload.set(Layer::colour, std::move(coded.bytes));
        colours = std::move(coded.decoded);
    }
    auto& header = payload.header;
    header.vertices = static_cast<std::uint32_t>(place.size());
    header.triangles = static_cast<std::uint32_t>(fans.triangles.size());
    header.geometry_step = static_cast<std::uint32_t>(steps.geometry);
    header.colour_step = static_cast<std::uint32_t>(steps.colour);
    for (auto& p : positions) p = from_grid(p, steps.geometry);
    return joined(tracked, patch.removed, border, place, fans.triangles, positions, colours);
}

Result<PatchedSurface> decode_patch(const FramePayloadView& payload, const TrackedSurface& tracked,
                                    const VertexHierarchy& hierarchy) {
    const auto& header = payload.header;
    const auto step = static_cast<std::int32_t>(header.geometry_step);
    RangeDecoder removed_run(payload.of(Layer::removed));
    ReadingCoder<RangeDecoder> removed_coder{removed_run};
    std::vector<bool> removed;
    for (const auto share : code_shares(removed_coder, hierarchy, {})) removed.push_back(share == Share::goes);
    if (removed_run.exhausted()) return corrupt("patch: the layer of what goes ends too early");

    const auto border = open_border(tracked.triangles, removed);
    const auto triangles = decode_tfan(payload.of(Layer::fans), header.vertices, header.triangles);
    if (!triangles) return tl::unexpected(triangles.error());
    RangeDecoder place_run(payload.of(Layer::border));
    ReadingCoder<RangeDecoder> place_coder{place_run};
    const auto place = code_places(place_coder, *triangles, header.vertices, border.size(), {});
    if (!place) return corrupt("patch: a vertex lies off the border");
    if (place_run.exhausted()) return corrupt("patch: the border's layer ends too early");

    const auto known = known_vertices(*place, border, tracked, step);
    const auto neighbours = find_neighbours(*triangles, header.vertices, known.known);
    if (!neighbours) return fail(ErrorKind::corrupt_stream, "patch: " + neighbours.error().message);
    auto positions = decode_intra_positions(payload.of(Layer::geometry), *neighbours, {known.known, known.positions});
    if (!positions) return tl::unexpected(positions.error());
    std::vector<Colour> colours;
    if (!tracked.colours.empty()) {
        auto decoded =
            decode_intra_colours(payload.of(Layer::colour), *positions, *neighbours,
                                 static_cast<std::int32_t>(header.colour_step), {known.known, known.colours});
        if (!decoded) return tl::unexpected(decoded.error());
        colours = std::move(*decoded);
    }
    const std::int32_t limit = lattice_limit / step;
    const auto inside = [&](std::int32_t c) { return c >= -limit && c <= limit; };
    for (std::size_t v = 0; v < positions->size(); ++v) {
        auto& p = (*positions)[v];
        if (known.known[v] == 0 && (!inside(p.x) || !inside(p.y) || !inside(p.z)))
            return corrupt("patch: a vertex lies off the lattice");
        p = from_grid(p, step);
    }
    return joined(tracked, removed, border, *place, *triangles, *positions, colours);
}

void smooth_what_is_new(PatchedSurface& patched, std::int32_t step, bool with_normals) {
    auto& mesh = patched.mesh;
    mesh.positions = smoothed_within_cells(mesh.positions, mesh.triangles,
                                           {.step = step, .settled = static_cast<std::uint32_t>(patched.stays.size())});
    if (with_normals) mesh.normals = quantised_normals(vertex_normals(mesh.positions, mesh.triangles));
}

}  // namespace htvm::internal
