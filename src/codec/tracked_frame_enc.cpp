#include "codec/tracked_frame_enc.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "codec/motion_enc.h"
#include "codec/stage_clock_enc.h"
#include "core/parallel.h"

namespace htvm {
namespace {

std::vector<HandlePair> pairs_of(const TrackedReference& reference) {
    std::vector<HandlePair> out;
    for (const auto& pair : reference.nodes.neighbours) {
        const auto a = point_of(reference.pivots[pair.first]), b = point_of(reference.pivots[pair.second]);
        HandlePair handles;
        handles.first = pair.first;
        handles.second = pair.second;
        handles.point = {(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (a[2] + b[2]) / 2.0};
        out.push_back(handles);
    }
    return out;
}

// The start whose surface lies nearest: where the last frame was, one step on, or where the skeleton says.
std::vector<RigidMotion> best_start(const TrackedGroup& group, const TargetSurface& target,
                                    std::span<const RigidMotion> skeletal, const DeformationOptions& options) {
    std::vector<std::vector<RigidMotion>> starts;
    starts.push_back(group.last.empty() ? std::vector<RigidMotion>(group.reference.pivots.size()) : group.last);
    if (!group.before_last.empty()) starts.push_back(moved_on(group.deformable, group.before_last, group.last));
    if (!skeletal.empty()) starts.emplace_back(skeletal.begin(), skeletal.end());
    if (starts.size() == 1) return std::move(starts[0]);
    std::size_t best = 0;
    double least = 0;
    for (std::size_t i = 0; i < starts.size(); ++i) {
        const double error = deformation_error(group.deformable, target, starts[i], options);
        if (i > 0 && error >= least) continue;
        best = i;
        least = error;
    }
    return std::move(starts[best]);
}

std::vector<QuantisedTransform> quantised(const std::vector<RigidMotion>& motion,
                                          std::span<const LatticePoint> pivots) {
    std::vector<QuantisedTransform> out;
    for (std::size_t i = 0; i < motion.size(); ++i) out.push_back(quantise_motion(motion[i], pivots[i]));
    return out;
}

// Half the displacement's step for shifts; turns so coarse that most stay as predicted: measured, see
// docs/algorithm.md.
NodeMotionOptions motion_options(double geometry_step) {
    NodeMotionOptions out;
    out.shift_exponent = std::clamp(static_cast<int>(std::lround(std::log2(std::max(geometry_step, 1.0)))) - 1, 0, 8);
    out.rotation_exponent = std::clamp(out.shift_exponent + 4, 0, 10);
    return out;
}

// Values where a vertex has no target: the mean of its neighbours', from the rim inwards; in the end nothing.
void fill_gaps(std::vector<std::int32_t>& values, std::size_t components, std::vector<bool> known,
               std::span<const Triangle> triangles) {
    constexpr int rounds = 24;
    if (std::find(known.begin(), known.end(), false) == known.end()) return;
    std::vector<Triangle> open;
    for (const auto& t : triangles)
        if (!known[t[0]] || !known[t[1]] || !known[t[2]]) open.push_back(t);
    std::vector<std::int64_t> sum(values.size(), 0);
    std::vector<std::uint32_t> count(known.size(), 0);
    for (int round = 0; round < rounds; ++round) {
        for (const auto& t : open)
            for (const auto to : t) {
                if (known[to]) continue;
                for (const auto from : t) {
                    if (!known[from]) continue;
                    for (std::size_t c = 0; c < components; ++c)
                        sum[to * components + c] += values[from * components + c];
                    ++count[to];
                }
            }
        bool any = false;
        for (const auto& t : open)
            for (const auto v : t) {
                if (known[v] || count[v] == 0) continue;
                for (std::size_t c = 0; c < components; ++c)
                    values[v * components + c] = static_cast<std::int32_t>(sum[v * components + c] / count[v]);
                known[v] = any = true;
            }
        if (!any) break;
        std::erase_if(open, [&](const Triangle& t) { return known[t[0]] && known[t[1]] && known[t[2]]; });
    }
}

// How far along its normal each moved vertex is from the target's surface, lattice units.
std::vector<std::int32_t> displacements(std::span<const LatticePoint> moved, std::span<const ExactNormal> normals,
                                        const std::vector<SurfaceTarget>& targets,
                                        std::span<const Triangle> triangles) {
    std::vector<std::int32_t> out(moved.size(), 0);
    std::vector<bool> known(moved.size(), false);
    for (std::size_t v = 0; v < moved.size(); ++v) {
        if (!targets[v].valid) continue;
        const auto& p = targets[v].point;
        const double d = (static_cast<double>(p[0]) - moved[v].x) * normals[v].x +
                         (static_cast<double>(p[1]) - moved[v].y) * normals[v].y +
                         (static_cast<double>(p[2]) - moved[v].z) * normals[v].z;
        out[v] = static_cast<std::int32_t>(std::lround(d));
        known[v] = true;
    }
    fill_gaps(out, 1, std::move(known), triangles);
    return out;
}

std::array<double, 3> barycentric(const Point3f& p, const Point3f& a, const Point3f& b, const Point3f& c) {
    const auto vector = [](const Point3f& from, const Point3f& to) {
        return Eigen::Vector3d(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    };
    const auto u = vector(a, b), v = vector(a, c), w = vector(a, p);
    const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v);
    const double area = uu * vv - uv * uv;
    if (!(area > 0)) return {1, 0, 0};
    const double s = std::clamp((vv * wu - uv * wv) / area, 0.0, 1.0);
    const double t = std::clamp((uu * wv - uv * wu) / area, 0.0, 1.0 - s);
    return {1 - s - t, s, t};
}

// What the target shows where each vertex ended, less the reference's colour.
std::vector<std::int32_t> colour_changes(const LatticeMesh& captured, const std::vector<Point3f>& captured_points,
                                         const TrackedReference& reference, const std::vector<SurfaceTarget>& targets) {
    std::vector<std::int32_t> out(3 * targets.size(), 0);
    std::vector<bool> known(targets.size(), false);
    for (std::size_t v = 0; v < targets.size(); ++v) {
        if (!targets[v].valid) continue;
        const auto& t = captured.triangles[targets[v].triangle];
        const auto share =
            barycentric(targets[v].point, captured_points[t[0]], captured_points[t[1]], captured_points[t[2]]);
        for (std::size_t c = 0; c < 3; ++c) {
            double level = 0;
            for (std::size_t i = 0; i < 3; ++i) level += share[i] * captured.colours[t[i]][c];
            out[3 * v + c] = static_cast<std::int32_t>(std::lround(level)) - reference.mesh.colours[v][c];
        }
        known[v] = true;
    }
    fill_gaps(out, 3, std::move(known), reference.mesh.triangles);
    return out;
}

// About the mean length of a mesh's sides, from some of them; 0 without triangles.
double about_edge(const LatticeMesh& mesh) {
    constexpr std::size_t every = 8;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += every) {
        const auto& t = mesh.triangles[i];
        sum +=
            std::sqrt(static_cast<double>(squared_distance(mesh.positions[t[i % 3]], mesh.positions[t[(i + 1) % 3]])));
        ++count;
    }
    return count > 0 ? sum / static_cast<double>(count) : 0;
}

// From samples of one surface to the other.
TrackedFit one_way_fit(const TargetSurface& from, const TargetSurface& to, double stray, unsigned threads) {
    std::vector<Point3f> points, normals;
    for (const auto v : from.samples) {
        points.push_back(from.positions[v]);
        normals.push_back(from.normals[v]);
    }
    SurfaceTargetOptions options;
    options.reach = static_cast<float>(stray);
    options.agreement = 0;
    options.threads = threads;
    const auto found = surface_targets(points, normals, to, options);
    double squares = 0;
    std::size_t near = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (!found[i].valid) {
            squares += stray * stray;
            continue;
        }
        ++near;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double d = static_cast<double>(found[i].point[axis]) - points[i][axis];
            squares += d * d;
        }
    }
    if (found.empty()) return {};
    return {std::sqrt(squares / static_cast<double>(found.size())),
            static_cast<double>(found.size() - near) / static_cast<double>(found.size())};
}

}  // namespace

TrackedFit measure_tracked_fit(const LatticeMesh& captured, const LatticeMesh& decoded, double stray,
                               unsigned threads) {
    constexpr std::size_t samples = 4000;
    const auto surface_of = [&](const LatticeMesh& mesh) {
        return make_target_surface(points_of(mesh.positions), mesh.triangles,
                                   static_cast<float>(std::max({2 * about_edge(mesh), stray / 24, 2.0})), samples, 1);
    };
    std::optional<TargetSurface> a, b;
    parallel_invoke(
        threads, [&] { a = surface_of(captured); }, [&] { b = surface_of(decoded); });
    const auto forth = one_way_fit(*a, *b, stray, threads), back = one_way_fit(*b, *a, stray, threads);
    return {std::max(forth.rms, back.rms), std::max(forth.stray_share, back.stray_share)};
}

TrackedGroup make_tracked_group(TrackedReference reference, const DeformationOptions& options) {
    TrackedGroup out;
    const auto points = points_of(reference.mesh.positions);
    std::vector<Eigen::Vector3d> handles;
    for (const auto pivot : reference.pivots) handles.emplace_back(pivot.x, pivot.y, pivot.z);
    out.deformable = make_deformable(points, reference.mesh.triangles, reference.nodes.weights, handles,
                                     pairs_of(reference), options);
    out.reference = std::move(reference);
    return out;
}

Result<EncodedTrackedFrame> encode_tracked_frame(const LatticeMesh& mesh, const TrackedGroup& group, bool refer_to_last,
                                                 std::span<const RigidMotion> skeletal,
                                                 const TrackedFrameOptions& options, std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const auto& reference = group.reference;
    const auto& triangles = reference.mesh.triangles;
    const auto captured_points = points_of(mesh.positions);
    // Cells no finer than the search can go through: of captures with tiny triangles, or none.
    const double edge =
        std::max({about_edge(mesh), options.deformation.far_reach * options.deformation.millimetre / 48, 1.0});
    const auto target = make_target_surface(captured_points, mesh.triangles, static_cast<float>(2 * edge),
                                            options.deformation.back_samples, options.threads);
    clock.done("search structures");
    EncodedTrackedFrame out;
    out.motion = register_deformation(group.deformable, target,
                                      best_start(group, target, skeletal, options.deformation), options.deformation);
    clock.done("registration");

    const std::span<const QuantisedTransform> before = refer_to_last
                                                           ? std::span<const QuantisedTransform>(group.state.transforms)
                                                           : std::span<const QuantisedTransform>{};
    auto motion = encode_node_motion(quantised(out.motion, reference.pivots), reference.parents, reference.pivots,
                                     before, motion_options(options.geometry_step));
    const auto moved = moved_by_nodes(reference, motion.transforms, options.threads);
    const auto normals = exact_normals(moved, triangles);
    const auto moved_points = points_of(moved);
    std::vector<Point3f> normal_points;
    normal_points.reserve(normals.size());
    for (const auto& n : normals)
        normal_points.push_back({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    SurfaceTargetOptions search;
    search.reach = static_cast<float>(30 * options.deformation.millimetre);
    search.threads = options.threads;
    const auto targets = surface_targets(moved_points, normal_points, target, search);
    clock.done("targets");

    FieldOptions geometry;
    geometry.step = {options.geometry_step, options.geometry_step, options.geometry_step};
    geometry.lambda = options.lambda;
    FieldOptions colour;
    colour.step = {options.colour_step, options.colour_step, options.colour_step};
    colour.lambda = options.lambda;
    colour.turned = true;
    Result<EncodedField> displacement, colours;
    parallel_invoke(
        options.threads,
        [&] {
            displacement = encode_field(reference.hierarchy, displacements(moved, normals, targets, triangles), 1,
                                        geometry, refer_to_last ? &group.state.displacement : nullptr);
        },
        [&] {
            if (!reference.mesh.colours.empty())
                colours = encode_field(reference.hierarchy, colour_changes(mesh, captured_points, reference, targets),
                                       3, colour, refer_to_last ? &group.state.colour : nullptr);
        });
    if (!displacement) return tl::unexpected(displacement.error());
    if (!reference.mesh.colours.empty() && !colours) return tl::unexpected(colours.error());
    clock.done("fields");

    out.mesh.triangles = triangles;
    out.mesh.texcoords = reference.mesh.texcoords;
    out.mesh.positions = displaced(moved, normals, displacement->values);
    if (!reference.mesh.normals.empty())
        out.mesh.normals = quantised_normals(exact_normals(out.mesh.positions, triangles));
    out.state.transforms = std::move(motion.transforms);
    out.state.displacement = std::move(displacement->history);
    auto& header = out.payload.header;
    header.source_vertices = static_cast<std::uint32_t>(mesh.positions.size());
    header.source_triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    header.vertices = static_cast<std::uint32_t>(reference.mesh.positions.size());
    header.triangles = static_cast<std::uint32_t>(triangles.size());
    out.payload.set(Layer::transforms, std::move(motion.bytes));
    out.payload.set(Layer::geometry, std::move(displacement->bytes));
    if (!reference.mesh.colours.empty()) {
        out.mesh.colours = recoloured(reference.mesh.colours, colours->values);
        out.state.colour = std::move(colours->history);
        out.payload.set(Layer::colour, std::move(colours->bytes));
    }
    clock.done("reconstruction");
    return out;
}

}  // namespace htvm
