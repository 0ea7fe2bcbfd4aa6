#include "codec/encoder/tracked/tracked_frame.h"

#include <algorithm>
#include <cmath>

#include "codec/encoder/lattice_motion.h"
#include "codec/encoder/tracked/captured_surface.h"
#include "codec/encoder/tracked/node_motion.h"
#include "codec/tracked/presence.h"
#include "core/parallel.h"
#include "core/stage_clock.h"
#include "surface/limb_starts.h"

namespace htvm::internal {
namespace {

std::vector<HandlePair> pairs_of(const NodeReference& reference) {
    std::vector<HandlePair> out;
    for (const auto& pair : reference.nodes.neighbours) {
        const auto a = point_of(reference.graph.pivots[pair.first]), b = point_of(reference.graph.pivots[pair.second]);
        HandlePair handles;
        handles.first = pair.first;
        handles.second = pair.second;
        handles.point = {(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (a[2] + b[2]) / 2.0};
        out.push_back(handles);
    }
    return out;
}

std::vector<QuantisedTransform> quantised(std::span<const RigidMotion> motion, std::span<const LatticePoint> pivots) {
    std::vector<QuantisedTransform> out;
    for (std::size_t i = 0; i < motion.size(); ++i) out.push_back(quantise_motion(motion[i], pivots[i]));
    return out;
}

// For shifts, half the step of the displacement; for turns steps that shrink somewhat faster than that step does:
// docs/experiments/node_motion.md has measurements.
NodeMotionSteps motion_steps(LatticeUnits geometry_step, const Scale& scale) {
    constexpr double sixteenths = 16;  // of a millimetre on an adult, in which the step counts for turns
    const auto exponent = [](double step, double slope, double more, int most) {
        return std::clamp(static_cast<int>(std::lround(slope * std::log2(std::max(step, 1.0)) + more)), 0, most);
    };
    const double on_adult = sixteenths * (geometry_step / scale.adult_millimetre);
    return {.rotation_exponent = exponent(on_adult, 1.25, 1.4, NodeMotionSteps::most_rotation),
            .shift_exponent = exponent(geometry_step.value, 1, -1, NodeMotionSteps::most_shift)};
}

// A bit of node motion is worth 0.3 of what a bit of the displacement is worth to each sample that a node moves: most
// of what a node leaves the displacement takes up in a few differences.
double price_of_motion(const DeformationForm& form, const TrackedFrameOptions& options) {
    constexpr double share = 0.3;
    const double samples = form.weight / static_cast<double>(std::max<std::size_t>(form.diagonal.size(), 1));
    const double step = options.geometry_step.value;
    return share * options.lambda * step * step * samples;
}

// What was taken off, as long as the values can be coded without it.
void subtract(std::vector<std::int32_t>& values, const std::vector<std::int32_t>& noise) {
    for (std::size_t i = 0; i < noise.size(); ++i)
        values[i] = std::clamp(values[i] - noise[i], -field_limit, field_limit);
}

}  // namespace

TrackedRuns write_tracked_runs(TrackedHead& head, const KnownOfHead& known, const TrackedDecisions& decisions,
                               const PresenceToWrite* presence, std::size_t least_run) {
    TrackedRuns out;
    std::vector<std::uint8_t> colour_run;
    if (decisions.colour) colour_run = decisions.colour->run();
    if (colour_run.size() < least_run) colour_run.clear();
    head.colour_run = static_cast<std::uint32_t>(colour_run.size());
    RangeEncoder run;
    write_tracked_head(run, head, known);
    TrackedRunEnds ends;
    ends.head = run.position();
    if (presence) {
        write_presence(run, presence->around, presence->before, presence->presence);
        ends.presence = run.position();
    }
    decisions.motion.write(run);
    ends.motion = run.position();
    decisions.displacement.write(run);
    ends.displacement = run.position();
    if (decisions.colour && colour_run.empty()) decisions.colour->write(run);
    ends.colour = run.position();
    out.payload = run.finish();
    // The four bytes that are read ahead of the head must not be the colours'.
    if (!colour_run.empty()) out.payload.resize(std::max(out.payload.size(), std::max(ends.head, ends.presence) + 4));
    out.payload.insert(out.payload.end(), colour_run.begin(), colour_run.end());
    out.shares = layer_shares(ends, out.payload.size(), colour_run.size());
    return out;
}

namespace {

// What the handles weigh in the middle between two vertices.
VertexWeights mean_weights(const VertexWeights& a, const VertexWeights& b) {
    struct Share {
        std::uint16_t handle = 0;
        int twice = 0;
    };
    std::vector<Share> shares;
    for (const auto* of : {&a, &b})
        for (std::size_t k = 0; k < handles_per_vertex && of->weight[k] > 0; ++k) {
            const auto same = std::find_if(shares.begin(), shares.end(),
                                           [&](const Share& share) { return share.handle == of->handle[k]; });
            if (same != shares.end())
                same->twice += of->weight[k];
            else
                shares.push_back({of->handle[k], of->weight[k]});
        }
    std::sort(shares.begin(), shares.end(), [](const Share& x, const Share& y) {
        return x.twice != y.twice ? x.twice > y.twice : x.handle < y.handle;
    });
    if (shares.size() > handles_per_vertex) shares.resize(handles_per_vertex);
    int all = 0;
    for (const auto& share : shares) all += share.twice;
    VertexWeights out;
    int left = 1 << weight_bits;
    for (std::size_t k = shares.size(); k-- > 1;) {
        const int weight = (shares[k].twice << weight_bits) / all;
        if (weight == 0) continue;
        out.handle[k] = shares[k].handle;
        out.weight[k] = static_cast<std::uint16_t>(weight);
        left -= weight;
    }
    if (!shares.empty()) out.handle[0] = shares[0].handle, out.weight[0] = static_cast<std::uint16_t>(left);
    return out;
}

}  // namespace

DeformableMesh make_tracked_deformable(const NodeReference& reference, const SurfaceDetail& detail,
                                       const DeformationOptions& options, std::span<const Colour> colours) {
    std::vector<Eigen::Vector3d> handles;
    for (const auto pivot : reference.graph.pivots) handles.emplace_back(pivot.x, pivot.y, pivot.z);
    const auto& mesh = reference.mesh;
    auto positions = mesh.positions;
    auto weights = reference.nodes.weights;
    std::vector<Colour> seen(mesh.colours);
    if (!colours.empty()) seen.assign(colours.begin(), colours.end());
    const auto levels = levels_to_sample(detail, positions.size());
    if (levels > 0) {
        add_detail(detail, levels, mesh.triangles, positions);
        if (!seen.empty()) add_detail(detail, levels, seen);
        for (std::size_t k = 0; k < levels; ++k)
            for (const auto& stencil : detail.levels[k].stencils)
                weights.push_back(mean_weights(weights[stencil.a], weights[stencil.b]));
    }
    return make_deformable(points_of(positions), levels > 0 ? detail.triangles(levels) : mesh.triangles,
                           std::move(weights), handles, pairs_of(reference), options, seen);
}

namespace {

using NodeMotions = std::vector<RigidMotion>;

std::vector<NodeMotions> motions_of(const NodeStarts& starts, const DeformableMesh& deformable) {
    std::vector<NodeMotions> out;
    if (starts.last.empty())
        out.emplace_back(deformable.handles.size());
    else
        out.emplace_back(starts.last.begin(), starts.last.end());
    if (!starts.before_last.empty()) out.push_back(moved_on(deformable, starts.before_last, starts.last));
    if (!starts.gone_on.empty()) out.emplace_back(starts.gone_on.begin(), starts.gone_on.end());
    if (!starts.skeletal.empty()) out.emplace_back(starts.skeletal.begin(), starts.skeletal.end());
    if (!starts.carried.empty()) out.emplace_back(starts.carried.begin(), starts.carried.end());
    if (!starts.shared.empty()) out.emplace_back(starts.shared.begin(), starts.shared.end());
    return out;
}

std::size_t nearest_of(const std::vector<NodeMotions>& starts, const DeformableMesh& deformable,
                       const SurfaceIndex& surface, const DeformationOptions& options) {
    if (starts.size() < 2) return 0;
    std::vector<double> error(starts.size());
    parallel_for(starts.size(), options.threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) error[i] = deformation_error(deformable, surface, starts[i], options);
    });
    return static_cast<std::size_t>(std::min_element(error.begin(), error.end()) - error.begin());
}

}  // namespace

NodeRegistration register_nodes(const DeformableMesh& deformable, const SurfaceIndex& surface, const NodeStarts& starts,
                                const DeformationOptions& options) {
    const auto from = motions_of(starts, deformable);
    NodeRegistration out;
    out.start = nearest_of(from, deformable, surface, options);
    auto rounds = options;
    if (!starts.shared.empty() && out.start + 1 == from.size()) {
        rounds.coarse_rounds = 0;
        rounds.middle_reach = options.near_reach;
    }
    out.motion = register_deformation(deformable, surface, from[out.start], rounds, &out.form);
    out.carried.assign(starts.carried.begin(), starts.carried.end());
    return out;
}

bool follow_lost_limbs(const DeformableMesh& deformable, const SurfaceIndex& surface, const NodeStarts& starts,
                       const DeformationOptions& options, NodeRegistration& registered) {
    const auto from = motions_of(starts, deformable);
    // To tell where a limb comes to lie, rounds that settle it are not needed; what is taken is settled afterwards.
    auto roughly = options;
    roughly.fine_rounds = std::min(options.fine_rounds, 2);
    roughly.colour_rounds = roughly.surface_rounds = 0;
    std::vector<NodeMotions> others(from.size());
    parallel_for(from.size(), options.threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (i != registered.start)
                others[i] = register_deformation(deformable, surface, from[i], roughly, nullptr, registered.motion);
    });
    bool any = false;
    for (std::size_t i = 0; i < others.size(); ++i)
        if (i != registered.start &&
            follow_nearer_limbs(deformable, surface, others[i], options, registered.motion, &registered.form))
            any = true;
    // Where surface comes and goes the next frame goes on from what was found, and looks further if that is not all.
    if (any && options.open) return true;
    const auto reached =
        reached_for_extremities(deformable, surface, registered.motion, starts.last, {.scale = options.scale});
    if (reached.empty()) return any;
    auto near = options.open ? roughly : options;  // the body is where it should be already
    near.coarse_rounds = 0;
    const auto other = register_deformation(deformable, surface, reached, near);
    return follow_nearer_limbs(deformable, surface, other, options, registered.motion, &registered.form) || any;
}

namespace {

// What a frame is coded from, as encode_tracked_frame() is told.
struct FrameSource {
    const LatticeMesh& captured;
    const SurfaceIndex& surface;
    const NodeReference& reference;
    const NodeRegistration& registered;
    const TrackedState* before;
    const TrackedFrameOptions& options;
};

// The reference, moved by its nodes as they were coded.
struct MovedSurface {
    std::vector<LatticePoint> positions;
    std::vector<Vector3d> normals;
};

EncodedNodeMotion code_nodes(const FrameSource& source, const NodeMotionSteps& steps) {
    const auto& [captured, surface, reference, registered, before, options] = source;
    return encode_node_motion(
        quantised(registered.motion, reference.graph.pivots), reference.graph,
        before ? std::span<const QuantisedTransform>(before->transforms) : std::span<const QuantisedTransform>{},
        {.steps = steps, .form = &registered.form, .price = price_of_motion(registered.form, options)});
}

// Zero where nothing but the motion is coded.
TrackedTargets targets_of(const FrameSource& source, const MovedSurface& moved) {
    const auto& [captured, surface, reference, registered, before, options] = source;
    if (options.motion_alone) {
        TrackedTargets none;
        none.displacement.resize(moved.positions.size());
        if (!reference.mesh.colours.empty()) none.colours.resize(3 * moved.positions.size());
        return none;
    }
    return find_tracked_targets(
        {moved.positions, moved.normals, reference.mesh.triangles, reference.mesh.colours, options.detail}, captured,
        surface,
        {.reach = options.reach,
         .far = options.scale.on_lattice(tracking_numbers.far_from_seen),
         .samples = options.target_samples,
         .threads = options.threads},
        options.near.empty() ? registered.form.matches
                             : std::vector<std::uint32_t>(options.near.begin(), options.near.end()));
}

// Filters the targets; sets what the frame leaves of it, and what was taken off if that is to be told.
void denoise(const TargetFilterOptions& how, const FrameSource& source, const TargetHistory& history,
             TrackedTargets& targets, EncodedTrackedFrame& out) {
    const auto& options = source.options;
    if (options.keeps_noise) out.noise.targets = targets;
    if (options.motion_alone)
        out.targets = history;
    else
        out.targets = filter_targets(targets, source.reference.mesh.triangles, history, how);
    if (!options.keeps_noise) return;
    subtract(out.noise.targets.displacement, targets.displacement);
    subtract(out.noise.targets.colours, targets.colours);
}

// What is there; where motion alone is coded, what was before.
void judge(const FrameSource& source, const MovedSurface& moved, EncodedTrackedFrame& out) {
    const auto& [captured, surface, reference, registered, before, options] = source;
    if (!reference.has_presence) return;
    const std::size_t vertices = moved.positions.size();
    if (!options.presence.empty()) {
        out.state.presence.assign(options.presence.begin(), options.presence.end());
        return;
    }
    const PresenceHistory none;
    const auto& history = options.presence_before ? *options.presence_before : none;
    if (out.seen.empty()) {
        out.presence = history;
        out.state.presence = history.shown.empty() ? reference.presence : history.shown;
        out.state.presence.resize(vertices, 1);
        out.seen = out.state.presence;
        return;
    }
    out.presence =
        judge_presence(out.seen, {moved.positions, reference.mesh.triangles, reference.around, reference.presence},
                       history, options.presence_options);
    out.state.presence = out.presence.shown;
}

// Tells of each vertex whether it matters where it lies: what is not shown costs nothing, nor what fills a hole. None:
// of all.
std::vector<std::uint8_t> what_counts(const EncodedTrackedFrame& frame) {
    auto out = frame.state.presence;
    for (std::size_t v = 0; v < std::min(out.size(), frame.seen.size()); ++v)
        if (frame.seen[v] == 0) out[v] = 0;
    return out;
}

struct CodedFields {
    EncodedField displacement;
    std::optional<EncodedField> colours;  // none where the reference has no colours
    std::vector<LatticePoint> positions;  // as the decoder will have them
};

// price: by how much less a bit of the displacement should cost.
Result<CodedFields> code_fields(const FrameSource& source, const MovedSurface& moved, const TrackedTargets& targets,
                                std::span<const std::uint8_t> counts, LatticeUnits geometry_step, double price) {
    const auto& reference = source.reference;
    const auto& options = source.options;
    const TrackedState* before = source.before;
    const double step = geometry_step.value, colour_step = options.motion_alone ? field_limit : options.colour_step;
    const FieldOptions geometry{.step = {step, step, step}, .lambda = options.lambda * price, .counts = counts};
    const FieldOptions colour{
        .step = {colour_step, colour_step, colour_step}, .lambda = options.lambda, .turned = true, .counts = counts};
    CodedFields out;
    Result<EncodedField> displacement, colours;
    const auto code_displacement = [&] {
        displacement = encode_field(reference.hierarchy, targets.displacement, 1, geometry,
                                    before ? &before->displacement : nullptr);
        if (displacement) out.positions = displaced(moved.positions, moved.normals, displacement->values);
    };
    if (reference.mesh.colours.empty()) {
        code_displacement();
    } else {
        colours = encode_field(reference.hierarchy, targets.colours, 3, colour, before ? &before->colour : nullptr,
                               options.threads, code_displacement);
        if (!colours) return tl::unexpected(colours.error());
        out.colours = std::move(*colours);
    }
    if (!displacement) return tl::unexpected(displacement.error());
    out.displacement = std::move(*displacement);
    return out;
}

// The mesh that the decoder will have, what the next frame refers to, and the payload.
void finish(const FrameSource& source, const NodeMotionSteps& steps, EncodedNodeMotion motion, CodedFields fields,
            EncodedTrackedFrame& out) {
    // A run takes four bytes beside its decisions: from here on less than a hundredth.
    constexpr std::size_t least_run = 400;
    const auto& [captured, surface, reference, registered, before, options] = source;
    out.mesh.positions = std::move(fields.positions);
    out.mesh.triangles = reference.mesh.triangles;
    out.mesh.texcoords = reference.mesh.texcoords;
    if (!reference.mesh.normals.empty())
        out.mesh.normals = quantised_normals(vertex_normals(out.mesh.positions, out.mesh.triangles));
    out.state.transforms = std::move(motion.transforms);
    out.state.displacement = std::move(fields.displacement.history);
    auto& head = out.state.head;
    head.captured = {static_cast<std::uint32_t>(captured.positions.size()),
                     static_cast<std::uint32_t>(captured.triangles.size())};
    head.motion = steps;
    head.displacement = fields.displacement.steps;
    if (reference.projection) head.projection = options.projection.value_or(*reference.projection);
    if (fields.colours) {
        out.mesh.colours = recoloured(reference.mesh.colours, fields.colours->values);
        out.state.colour = std::move(fields.colours->history);
        head.colour = fields.colours->steps;
    }
    const PresenceToWrite presence{reference.around, before ? before->presence : reference.presence,
                                   out.state.presence};
    out.runs = write_tracked_runs(
        head,
        {before ? &before->head : nullptr, reference.captured, fields.colours.has_value(),
         reference.projection ? &*reference.projection : nullptr},
        {motion.decisions, fields.displacement.decisions, fields.colours ? &fields.colours->decisions : nullptr},
        reference.has_presence ? &presence : nullptr, least_run);
}

}  // namespace

Result<EncodedTrackedFrame> encode_tracked_frame(const LatticeMesh& mesh, const SurfaceIndex& surface,
                                                 const NodeReference& reference, const NodeRegistration& registered,
                                                 const TrackedState* before, const TargetHistory& targets_before,
                                                 const TrackedFrameOptions& options, std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const FrameSource source{mesh, surface, reference, registered, before, options};
    EncodedTrackedFrame out;
    const auto steps = options.motion.value_or(motion_steps(options.geometry_step, options.scale));
    auto motion = code_nodes(source, steps);
    MovedSurface moved{moved_by_nodes(reference, motion.transforms, options.threads), {}};
    moved.normals = vertex_normals(moved.positions, reference.mesh.triangles);
    auto targets = targets_of(source, moved);
    out.near = std::move(targets.near);
    out.seen = std::move(targets.seen);
    clock.done("targets");
    judge(source, moved, out);
    if (options.denoise) {
        denoise(*options.denoise, source, targets_before, targets, out);
        clock.done("denoising");
    } else if (options.noise) {
        subtract(targets.displacement, options.noise->targets.displacement);
        subtract(targets.colours, options.noise->targets.colours);
    }
    // With motion alone, a step so large that every difference from the prediction becomes zero.
    const auto step = options.motion_alone ? LatticeUnits(field_limit) : options.geometry_step;
    const double price = options.noise ? options.noise->price : price_of_bits(out.targets, step);
    if (options.keeps_noise) out.noise.price = price;
    auto fields = code_fields(source, moved, targets, what_counts(out), step, price);
    if (!fields) return tl::unexpected(fields.error());
    clock.done("fields");
    finish(source, steps, std::move(motion), std::move(*fields), out);
    clock.done("reconstruction");
    return out;
}

}  // namespace htvm::internal
