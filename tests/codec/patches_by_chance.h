// Patches that no encoder would make, and streams of TP-frames with them: anything goes, and what comes is any
// triangles of vertices on the open border and of new ones.
#pragma once

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "codec/reference/quantiser_cells.h"
#include "codec/tracked/surface_patch.h"
#include "codec/tracked_sequences.h"

namespace htvm::test {

enum class Removal : std::uint8_t { nothing, all, some, region };
inline constexpr Removal removals[] = {Removal::nothing, Removal::all, Removal::some, Removal::region};

inline std::vector<bool> removed_by_chance(Removal what, std::span<const LatticePoint> positions,
                                           std::mt19937& random) {
    std::vector<bool> out(positions.size(), what == Removal::all);
    if (out.empty()) return out;
    if (what == Removal::some)
        for (std::size_t v = 0; v < out.size(); ++v) out[v] = below(random, 4) == 0;
    if (what == Removal::region) {
        std::vector<std::pair<std::int64_t, std::size_t>> by_distance;
        const auto centre = positions[below(random, static_cast<std::uint32_t>(out.size()))];
        for (std::size_t v = 0; v < out.size(); ++v)
            by_distance.emplace_back(squared_distance(positions[v], centre), v);
        std::sort(by_distance.begin(), by_distance.end());
        for (std::size_t i = 0; i < 1 + out.size() / 8; ++i) out[by_distance[i].second] = true;
    }
    return out;
}

// Triangles of any kind: degenerate, doubled, non-manifold. The new vertices lie at different places, multiples of
// `step` in each coordinate.
inline SurfacePatch patch_by_chance(const TrackedSurface& tracked, Removal what, std::uint32_t triangles,
                                    std::int32_t step, std::mt19937& random) {
    SurfacePatch out;
    out.removed = removed_by_chance(what, tracked.positions, random);
    auto vertices = open_border(tracked.triangles, out.removed);
    const auto anchor = tracked.positions.empty() ? LatticePoint{} : tracked.positions[0];
    for (std::uint32_t n = below(random, 1 + triangles); n > 0; --n) {
        vertices.push_back(static_cast<std::uint32_t>(out.removed.size() + out.positions.size()));
        const auto k = static_cast<std::int32_t>(out.positions.size());
        const auto near = [&](std::int32_t c) {
            return std::clamp(c / step + between(random, -20, 20), -lattice_limit / step, lattice_limit / step) * step;
        };
        out.positions.push_back({(1000 + k) % (lattice_limit / step) * step, near(anchor.y), near(anchor.z)});
        if (!tracked.colours.empty())
            out.colours.push_back({static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(k), 100});
    }
    if (vertices.empty()) return out;
    const auto any = [&] { return vertices[below(random, static_cast<std::uint32_t>(vertices.size()))]; };
    for (std::uint32_t i = 0; i < triangles; ++i) {
        // Mostly one that goes on from the one before.
        Triangle t{any(), any(), any()};
        if (!out.triangles.empty() && below(random, 4) > 0)
            t = {out.triangles.back()[2], out.triangles.back()[1], any()};
        if (below(random, 16) == 0 && !out.triangles.empty()) t = out.triangles[below(random, i)];
        out.triangles.push_back(t);
    }
    return out;
}

// A stream of I-frames with more after each: a T-frame; a TP-frame; a T-frame from that and one from the frame before;
// a TP-frame from the first TP-frame; a T-frame from that. Texture coordinates there must be none.
inline std::vector<Packet> with_patched_frames(const std::vector<Packet>& intra, std::int32_t node_spacing,
                                               const ChanceMotion& motion, unsigned seed) {
    std::mt19937 random(seed);
    StreamByChance out;
    for (const auto& packet : intra) {
        if (packet.kind == PacketKind::sequence) out.add_header(packet, node_spacing);
        if (packet.kind != PacketKind::intra) continue;
        const auto coded = *read_frame_payload(packet.payload);
        std::uint32_t number = out.frame;
        CapturedCounts captured{coded.header.source_vertices, coded.header.source_triangles};
        auto mesh = out.add_intra(packet, coded);
        KeptNodes kept;
        for (int patches = 0;; ++patches) {
            auto reference = *make_node_reference(mesh, node_spacing, 1, {}, kept);
            reference.captured = captured;
            TrackedState before;
            for (int t = 0; t < 1 + patches % 2; ++t) {
                Packet next = packet;
                next.kind = PacketKind::tracked;
                next.payload = tracked_by_chance(reference, t > 0 ? &before : nullptr, motion, random);
                DecodedTrackedFrame decoded;
                if (!decode_tracked_frame(next.payload, reference, t > 0 ? &before : nullptr, {}, decoded)) break;
                before = std::move(decoded.state);
                out.add(std::move(next), t > 0 ? out.frame - 1 : number);
            }
            if (patches == 2) break;
            FramePayload payload;
            payload.set(Layer::pose, {coded.of(Layer::pose).begin(), coded.of(Layer::pose).end()});
            payload.set(Layer::tracked, tracked_by_chance(reference, nullptr, motion, random));
            DecodedTrackedFrame tracked;
            if (!decode_tracked_frame(payload.of(Layer::tracked), reference, nullptr, {}, tracked)) break;
            const TrackedSurface surface{tracked.positions, reference.mesh.triangles, tracked.colours};
            const PatchSteps steps{between(random, 1, 40), between(random, 1, 40)};
            const auto patch =
                patch_by_chance(surface, removals[below(random, 4)], below(random, 30), steps.geometry, random);
            auto patched = *encode_patch(surface, reference.hierarchy, patch, steps, payload);
            kept = keep_nodes(reference.nodes, patched.stays);
            captured = {below(random, 70000), below(random, 140000)};
            payload.header.source_vertices = captured.vertices;
            payload.header.source_triangles = captured.triangles;
            mesh = std::move(patched.mesh);
            mesh.positions = smoothed_within_cells(
                mesh.positions, mesh.triangles,
                {.step = steps.geometry, .settled = static_cast<std::uint32_t>(patched.stays.size())});
            if (!reference.mesh.normals.empty())
                mesh.normals = quantised_normals(vertex_normals(mesh.positions, mesh.triangles));
            Packet next = packet;
            next.kind = PacketKind::patched;
            next.payload = write_frame_payload(payload);
            out.add(std::move(next), std::exchange(number, out.frame));
        }
    }
    return std::move(out.packets);
}

}  // namespace htvm::test
