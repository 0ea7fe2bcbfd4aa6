#include "codec/tracked/tracked_frame.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include "codec/reference/transforms.h"
#include "codec/tracked/presence.h"
#include "core/bytes.h"
#include "core/parallel.h"

namespace htvm::internal {

std::vector<LatticePoint> moved_by_nodes(const NodeReference& reference, std::span<const QuantisedTransform> transforms,
                                         Threads threads) {
    const auto moves = point_moves(transforms, reference.graph.pivots);
    std::vector<LatticePoint> out(reference.mesh.positions.size());
    parallel_for(out.size(), threads, 8192, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            out[v] = blended_move(reference.mesh.positions[v], reference.nodes.weights[v], moves);
    });
    return out;
}

std::vector<LatticePoint> displaced(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                    std::span<const std::int32_t> displacement) {
    // Rounded down by cutting off: a field's values are far below 2^31, and normals no longer than one.
    const auto along = [](std::int32_t own, double normal, double distance) {
        const double moved = normal * distance + 0.5;
        const auto whole = static_cast<std::int32_t>(moved);
        return within_lattice(std::int64_t{own} + whole - (moved < whole));
    };
    std::vector<LatticePoint> out;
    out.reserve(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const double d = displacement[v];
        out.push_back({along(positions[v].x, normals[v][0], d), along(positions[v].y, normals[v][1], d),
                       along(positions[v].z, normals[v][2], d)});
    }
    return out;
}

std::vector<Colour> recoloured(std::span<const Colour> colours, std::span<const std::int32_t> residuals) {
    std::vector<Colour> out(colours.size());
    for (std::size_t v = 0; v < out.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c)
            out[v][c] = static_cast<std::uint8_t>(std::clamp(colours[v][c] + residuals[3 * v + c], 0, 255));
    return out;
}

std::vector<QuantisedNormal> quantised_normals(std::span<const Vector3d> normals) {
    const auto quantised = [](double c) { return static_cast<std::int32_t>(std::floor(c * 127 + 0.5)); };
    std::vector<QuantisedNormal> out;
    out.reserve(normals.size());
    for (const auto& n : normals) out.push_back({quantised(n[0]), quantised(n[1]), quantised(n[2])});
    return out;
}

namespace {

using Transforms = std::span<const QuantisedTransform>;

// How the layers are read, and what predicts them.
struct LayerSources {
    TrackedHead head;
    NodeMotionSyntax syntax = NodeMotionSyntax::surface;
    RangeDecoder *motion = nullptr, *displacement = nullptr, *colour = nullptr;  // the same for all, or one for each
    Transforms motion_before;
    const FieldHistory *displacement_before = nullptr, *colour_before = nullptr;
};

// Returns where each layer ends in its run. Two runs are read side by side; while one thread reads a run of all layers,
// in turn, the other makes the surface.
Result<TrackedRunEnds> decode_layers(const LayerSources& from, const NodeReference& reference, Threads threads,
                                     DecodedTrackedFrame& out) {
    const auto& mesh = reference.mesh;
    TrackedRunEnds ends;
    out.state.head = from.head;
    auto transforms =
        decode_node_motion(*from.motion, from.head.motion, reference.graph, from.motion_before, from.syntax);
    if (!transforms) return tl::unexpected(transforms.error());
    ends.motion = from.motion->position();
    out.state.transforms = std::move(*transforms);

    Result<DecodedField> displacement, colours;
    std::vector<LatticePoint> moved;
    std::vector<Vector3d> normals;
    const auto read_displacement = [&] {
        displacement =
            decode_field(*from.displacement, from.head.displacement, reference.hierarchy, 1, from.displacement_before);
        ends.displacement = from.displacement->position();
    };
    const auto read_colours = [&] {
        if (!mesh.colours.empty())
            colours = decode_field(*from.colour, from.head.colour, reference.hierarchy, 3, from.colour_before);
        ends.colour = from.colour->position();
    };
    const auto move_nodes = [&] {
        moved = moved_by_nodes(reference, out.state.transforms, {});
        normals = vertex_normals(moved, mesh.triangles);
    };
    const auto displace = [&] {
        if (!displacement) return;
        {
            const auto from_nodes = std::move(moved);
            const auto across = std::move(normals);
            out.positions = displaced(from_nodes, across, displacement->values);
        }
        if (!mesh.normals.empty()) out.normals = quantised_normals(vertex_normals(out.positions, mesh.triangles));
    };
    if (from.colour != from.displacement) {
        parallel_invoke(threads, read_colours, [&] { read_displacement(), move_nodes(), displace(); });
    } else {
        parallel_invoke(threads, read_displacement, move_nodes);
        if (displacement) parallel_invoke(threads, read_colours, displace);
    }
    if (!displacement) return tl::unexpected(displacement.error());
    if (!colours) return tl::unexpected(colours.error());
    out.state.displacement = std::move(displacement->history);
    if (!mesh.colours.empty()) {
        out.colours = recoloured(mesh.colours, colours->values);
        out.state.colour = std::move(colours->history);
    }
    return ends;
}

// ---- Versions 1 and 2: what each layer says before its run ----------------------------------------------------------

constexpr std::uint8_t history_flag = 1, turned_flag = 1, field_history_flag = 2, surface_flag = 2;

struct MotionPrefix {
    NodeMotionSteps steps;
    bool history = false, surface = false;
};

// What is read is cut off the layer.
Result<MotionPrefix> read_motion_prefix(std::span<const std::uint8_t>& layer) {
    if (layer.size() < 3 || layer[0] > (history_flag | surface_flag) || layer[1] > NodeMotionSteps::most_rotation ||
        layer[2] > NodeMotionSteps::most_shift)
        return fail(ErrorKind::corrupt_stream, "node motion layer: its flags or steps are out of range");
    const MotionPrefix out{{layer[1], layer[2]}, (layer[0] & history_flag) != 0, (layer[0] & surface_flag) != 0};
    layer = layer.subspan(3);
    return out;
}

struct FieldPrefix {
    FieldSteps steps;
    bool history = false;
};

Result<FieldPrefix> read_field_prefix(std::span<const std::uint8_t>& layer, std::size_t components) {
    ByteReader reader(layer);
    const std::uint8_t flags = reader.u8();
    FieldPrefix out;
    out.steps.turned = (flags & turned_flag) != 0;
    out.history = (flags & field_history_flag) != 0;
    bool valid = flags < 4 && (!out.steps.turned || components == 3);
    for (std::size_t c = 0; c < components; ++c) {
        const std::uint64_t step = reader.varint();
        valid = valid && step <= FieldSteps::most;
        out.steps.step[c] = static_cast<std::uint32_t>(std::min<std::uint64_t>(step, FieldSteps::most));
    }
    if (!reader.ok()) return fail(ErrorKind::corrupt_stream, "vertex field: the layer ends within its header");
    if (!valid) return fail(ErrorKind::corrupt_stream, "vertex field: the layer's header is not one of a field");
    layer = reader.bytes(reader.remaining());
    return out;
}

tl::unexpected<Error> no_frame_before(const char* layer) {
    return fail(ErrorKind::corrupt_stream, std::string(layer) + ": the frame that it refers to is not there");
}

}  // namespace

Result<void> decode_tracked_frame(std::span<const std::uint8_t> payload, const NodeReference& reference,
                                  const TrackedState* before, Threads threads, DecodedTrackedFrame& out) {
    RangeDecoder run(payload);
    auto head =
        read_tracked_head(run, {before ? &before->head : nullptr, reference.captured, !reference.mesh.colours.empty(),
                                reference.projection ? &*reference.projection : nullptr});
    if (!head) return tl::unexpected(head.error());
    if (!run.end_at(payload.size() - std::min<std::size_t>(head->colour_run, payload.size())))
        return fail(ErrorKind::corrupt_stream, "tracked frame: the colours' run is longer than the payload");
    RangeDecoder colour_run(payload.last(head->colour_run));
    LayerSources from;
    from.head = *head;
    from.motion = from.displacement = &run;
    from.colour = head->colour_run > 0 ? &colour_run : &run;
    if (before) {
        from.motion_before = before->transforms;
        from.displacement_before = &before->displacement;
        from.colour_before = &before->colour;
    }
    const auto head_end = run.position();
    out.state.presence.clear();
    if (reference.has_presence)
        out.state.presence = read_presence(run, reference.around, before ? before->presence : reference.presence);
    const auto presence_end = reference.has_presence ? run.position() : 0;
    auto ends = decode_layers(from, reference, threads, out);
    if (!ends) return tl::unexpected(ends.error());
    ends->head = head_end;
    ends->presence = presence_end;
    out.shares = layer_shares(*ends, payload.size(), head->colour_run);
    return {};
}

Result<void> decode_tracked_layers(const FramePayloadView& payload, const NodeReference& reference,
                                   const TrackedState* before, Threads threads, DecodedTrackedFrame& out) {
    const auto& mesh = reference.mesh;
    const auto& header = payload.header;
    if (header.vertices != mesh.positions.size() || header.triangles != mesh.triangles.size())
        return fail(ErrorKind::corrupt_stream, "tracked frame: it has other counts than its I-frame");
    auto motion = payload.of(Layer::transforms), displacement = payload.of(Layer::geometry),
         colour = payload.of(Layer::colour);
    LayerSources from;
    from.head.captured = {header.source_vertices, header.source_triangles};

    const auto of_motion = read_motion_prefix(motion);
    if (!of_motion) return tl::unexpected(of_motion.error());
    from.head.motion = of_motion->steps;
    if (!of_motion->surface) from.syntax = NodeMotionSyntax::axes_of_space;
    if (of_motion->history && !before && !reference.graph.pivots.empty()) return no_frame_before("node motion layer");
    if (of_motion->history && before) from.motion_before = before->transforms;

    const auto of_displacement = read_field_prefix(displacement, 1);
    if (!of_displacement) return tl::unexpected(of_displacement.error());
    from.head.displacement = of_displacement->steps;
    if (of_displacement->history && !before) return no_frame_before("displacement layer");
    if (of_displacement->history) from.displacement_before = &before->displacement;

    if (!mesh.colours.empty()) {
        const auto of_colour = read_field_prefix(colour, 3);
        if (!of_colour) return tl::unexpected(of_colour.error());
        from.head.colour = of_colour->steps;
        if (of_colour->history && !before) return no_frame_before("colour layer");
        if (of_colour->history) from.colour_before = &before->colour;
    }
    RangeDecoder motion_run(motion), displacement_run(displacement), colour_run(colour);
    from.motion = &motion_run;
    from.displacement = &displacement_run;
    from.colour = &colour_run;
    if (const auto ends = decode_layers(from, reference, threads, out); !ends) return tl::unexpected(ends.error());
    out.shares = {};
    for (const auto layer : {Layer::transforms, Layer::geometry, Layer::colour})
        out.shares[layer] = payload.of(layer).size();
    return {};
}

}  // namespace htvm::internal
