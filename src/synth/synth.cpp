#include "synth/synth.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/parallel.h"
#include "synth/appearance.h"
#include "synth/body.h"
#include "synth/choreography.h"
#include "synth/extract.h"
#include "synth/motion.h"
#include "synth/random.h"
#include "synth/remesh.h"

namespace htvm {

using namespace internal;
namespace {

using namespace synth;
using Eigen::Vector3d;

constexpr int fewest_vertices = 150, most_vertices = 2000000;

// The streams of random numbers that a frame uses.
enum Stream : std::uint64_t { grid_stream, count_stream, jitter_stream, surface_stream, joint_stream };

RandomKey frame_key(const SynthOptions& options, int frame) {
    return derive_key(RandomKey{mix_bits(options.seed)}, static_cast<std::uint64_t>(static_cast<std::uint32_t>(frame)));
}

// An extraction has about this many vertices times the squared cell size, in mm^2: 4.5 per squared cell times the
// body's surface.
constexpr double vertices_times_cell2 = 8.6e6;

// The cells are small enough for one and a half times as many vertices as are kept. Then the shortest edges are
// collapsed, which leaves no trace of the grid. Cells coarser than 26 mm would lose the limbs.
Grid free_grid(RandomKey key, double vertices) {
    Grid grid;
    grid.cell = std::min(26.0, std::sqrt(vertices_times_cell2 / (1.6 * vertices)));
    const Eigen::Quaterniond turn(random_gaussian(key, 0), random_gaussian(key, 1), random_gaussian(key, 2),
                                  random_gaussian(key, 3));
    grid.rotation = turn.normalized().toRotationMatrix();
    for (int axis = 0; axis < 3; ++axis) grid.origin[axis] = grid.cell * random_uniform(key, 100 + axis);
    return grid;
}

// Moves a point towards the surface by its distance, in the direction of steepest descent of the distance.
void descend(Vector3d& position, const PosedScene& scene, const BrickMap& bricks, double longest_step) {
    const PartSet candidates = bricks.at(position);
    const double distance = evaluate_surface(scene, candidates, position).distance;
    const Vector3d gradient = surface_gradient(scene, candidates, position);
    const double steepness2 = std::max(gradient.squaredNorm(), 0.25);
    const double step = std::clamp(distance / std::sqrt(steepness2), -longest_step, longest_step);
    position -= step * gradient / std::sqrt(steepness2);
}

// Moves every vertex onto the surface: along its normal, or, if the normal of a crumpled neighbourhood does not lead
// there, along the gradient of the distance.
void project(HalfEdgeMesh& mesh, const PosedScene& scene, const BrickMap& bricks, int rounds, Threads threads) {
    const auto normals = vertex_normals(mesh, threads);
    const double longest_step = 0.5 * bricks.grid.cell;
    constexpr double near_enough = 0.5;  // mm
    constexpr int most_descents = 4;
    parallel_for(normals.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Vector3d start = mesh.positions[v];
            Vector3d position = start;
            const auto distance_here = [&] { return evaluate_surface(scene, bricks.at(position), position).distance; };
            double distance = distance_here(), before = distance;
            for (int round = 0; round < rounds; ++round) {
                position -= std::clamp(distance, -longest_step, longest_step) * normals[v];
                before = distance;
                distance = distance_here();
                if (std::abs(distance) > 0.7 * std::abs(before)) break;
            }
            if (std::abs(distance) > near_enough && std::abs(distance) > 0.7 * std::abs(before)) {
                position = start;
                for (int round = 0; round < most_descents; ++round) descend(position, scene, bricks, longest_step);
            }
            mesh.positions[v] = position;
        }
    });
}

double mean_edge_length(const HalfEdgeMesh& mesh) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t e = 0; e < mesh.origin.size(); ++e) {
        if (mesh.origin[e] == dead_half_edge) continue;
        sum += (mesh.positions[mesh.origin[e]] - mesh.positions[mesh.origin[mesh.twin[e]]]).norm();
        ++count;
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

// Moves every vertex along the surface at random, by about `share` of the spacing in each direction, unless this would
// fold the surface.
void jitter(HalfEdgeMesh& mesh, double share, RandomKey key) {
    const auto normals = vertex_normals(mesh, {});
    const double size = share * mean_edge_length(mesh);
    for (std::size_t v = 0; v < normals.size(); ++v) {
        if (mesh.outgoing[v] == dead_half_edge) continue;
        const Vector3d step(random_gaussian(key, 3 * v), random_gaussian(key, 3 * v + 1),
                            random_gaussian(key, 3 * v + 2));
        const double length = std::min(step.norm(), 2.5);
        const Vector3d bounded = step.normalized() * length;
        const Vector3d place = mesh.positions[v] + size * (bounded - bounded.dot(normals[v]) * normals[v]);
        if (!would_fold(mesh, static_cast<std::uint32_t>(v), place)) mesh.positions[v] = place;
    }
}

// The wanted number of vertices, spread evenly but randomly over the surface.
void remesh(HalfEdgeMesh& mesh, const PosedScene& scene, const BrickMap& bricks, std::size_t vertices, RandomKey key,
            Threads threads) {
    // Which edges are collapsed depends on their lengths. Once the vertices have moved, these no longer depend on the
    // grid.
    jitter(mesh, 0.3, derive_key(key, 0));
    collapse_to(mesh, vertices);
    compact(mesh);
    flip_to_delaunay(mesh);
    jitter(mesh, 0.2, derive_key(key, 1));
    flip_to_delaunay(mesh);
    relax(mesh, 0.7, threads);
    project(mesh, scene, bricks, 1, threads);
    flip_to_delaunay(mesh);
    relax(mesh, 0.5, threads);
    jitter(mesh, 0.1, derive_key(key, 2));
    project(mesh, scene, bricks, 2, threads);
    flip_to_delaunay(mesh);
    project(mesh, scene, bricks, 1, threads);
}

void scale_to_power(std::vector<double>& values, double power) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    const double factor = sum > 0 ? std::sqrt(power * static_cast<double>(values.size()) / sum) : 0.0;
    for (double& value : values) value *= factor;
}

// Moves every value halfway towards the mean of its neighbours.
std::vector<double> smoothed(const HalfEdgeMesh& mesh, const std::vector<double>& values) {
    std::vector<double> sums(values.size(), 0.0);
    for (std::size_t e = 0; e < mesh.origin.size(); ++e) sums[mesh.origin[e]] += values[mesh.origin[mesh.twin[e]]];
    for (std::size_t v = 0; v < values.size(); ++v)
        sums[v] = 0.5 * values[v] + 0.5 * sums[v] / std::max(mesh.valence[v], 1u);
    return sums;
}

// Noise with a mean square of `power` and the spectrum of a reconstruction: two thirds is correlated with the next
// vertex, a third over several. One value per vertex, mm.
std::vector<double> reconstruction_noise(const HalfEdgeMesh& mesh, double power, RandomKey key) {
    std::vector<double> fine(mesh.positions.size()), coarse(mesh.positions.size());
    for (std::size_t v = 0; v < fine.size(); ++v) {
        fine[v] = random_gaussian(key, 2 * v);
        coarse[v] = random_gaussian(key, 2 * v + 1);
    }
    fine = smoothed(mesh, fine);
    for (int round = 0; round < 8; ++round) coarse = smoothed(mesh, coarse);
    scale_to_power(fine, 2.0 / 3.0);
    scale_to_power(coarse, 1.0 / 3.0);
    for (std::size_t v = 0; v < fine.size(); ++v) fine[v] += coarse[v];
    scale_to_power(fine, power);
    return fine;
}

void add_noise_along_normals(HalfEdgeMesh& mesh, const std::vector<double>& noise, Threads threads) {
    const auto normals = vertex_normals(mesh, threads);
    for (std::size_t v = 0; v < normals.size(); ++v) mesh.positions[v] += noise[v] * normals[v];
}

// Moves lattice vertices along their edges so that their distance to the surface changes by the noise, but never past
// the ends of the edge.
void add_noise_along_edges(HalfEdgeMesh& mesh, const std::vector<EdgePlace>& places, const std::vector<double>& noise,
                           Threads threads) {
    const auto normals = vertex_normals(mesh, threads);
    for (std::size_t v = 0; v < normals.size(); ++v) {
        const double rise = places[v].edge.dot(normals[v]);  // change of the distance over the whole edge
        const double steep = std::max(std::abs(rise), 0.2 * places[v].edge.norm());
        const double share = places[v].share + std::copysign(noise[v] / steep, noise[v] * rise);
        mesh.positions[v] += (std::clamp(share, 0.02, 0.98) - places[v].share) * places[v].edge;
    }
}

Vector3f to_float(const Vector3d& p) {
    return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

std::vector<Colour> sample_colours(const HalfEdgeMesh& mesh, const PosedScene& scene, const BrickMap& bricks,
                                   Threads threads) {
    std::vector<Colour> colours(mesh.positions.size());
    parallel_for(colours.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Vector3d& position = mesh.positions[v];
            const SurfacePoint point = evaluate_surface(scene, bricks.at(position), position);
            colours[v] = surface_colour(figure_of(point.part), point.rest);
        }
    });
    return colours;
}

void make_surface(SynthFrame& frame, const SynthOptions& options, const PosedScene& scene, RandomKey key,
                  Threads threads) {
    const double vertices = std::clamp(options.vertices, fewest_vertices, most_vertices);
    const double wanted = vertices * (0.97 + 0.06 * random_uniform(derive_key(key, count_stream), 0));
    Grid grid;
    if (options.lattice)
        grid.cell = synth_lattice_cell(options);
    else
        grid = free_grid(derive_key(key, grid_stream), wanted);
    const Extraction extraction = extract_surface(scene, grid, threads);
    // A reconstruction drops specks; in lattice mode every vertex stays on its edge.
    const std::size_t fewest = options.lattice ? 0 : extraction.triangles.size() / 100;
    HalfEdgeMesh surface = build_half_edges(extraction.positions, extraction.triangles, fewest);
    if (!options.lattice)
        remesh(surface, scene, extraction.bricks, static_cast<std::size_t>(wanted), derive_key(key, jitter_stream),
               threads);

    Mesh& mesh = frame.mesh;
    mesh.triangles = triangles_of(surface);
    if (options.colours) mesh.colours = sample_colours(surface, scene, extraction.bricks, threads);
    for (const auto& position : surface.positions) frame.true_positions.push_back(to_float(position));
    const auto noise =
        reconstruction_noise(surface, std::max(0.0, options.surface_noise_power), derive_key(key, surface_stream));
    if (options.lattice)
        add_noise_along_edges(surface, extraction.places, noise, threads);
    else
        add_noise_along_normals(surface, noise, threads);
    for (const auto& position : surface.positions) mesh.positions.push_back(to_float(position));
    if (options.normals)
        for (const auto& normal : vertex_normals(surface, threads)) mesh.normals.push_back(to_float(normal));
}

}  // namespace

Skeleton synth_skeleton() {
    Skeleton skeleton;
    skeleton.joint_names = {"head",  "neck", "torso", "lshoulder", "lelbow", "lhand", "rshoulder", "relbow",
                            "rhand", "lhip", "lknee", "lfoot",     "rhip",   "rknee", "rfoot"};
    skeleton.bones = {{1, 0}, {1, 3}, {3, 4},  {4, 5},   {1, 6},  {6, 7},   {7, 8},
                      {2, 1}, {2, 9}, {9, 10}, {10, 11}, {2, 12}, {12, 13}, {13, 14}};
    return skeleton;
}

double synth_lattice_cell(const SynthOptions& options) {
    return std::min(90.0,
                    std::sqrt(vertices_times_cell2 / std::clamp(options.vertices, fewest_vertices, most_vertices)));
}

Result<void> check_synth_options(const SynthOptions& options) {
    if (options.vertices < fewest_vertices || options.vertices > most_vertices)
        return fail(ErrorKind::bad_input, "a synthetic frame can have " + std::to_string(fewest_vertices) + " to " +
                                              std::to_string(most_vertices) + " vertices, not " +
                                              std::to_string(options.vertices));
    if (!(options.fps >= 0.1 && options.fps <= 10000))
        return fail(ErrorKind::bad_input, "the frame rate must be between 0.1 and 10000 frames per second");
    if (!(options.surface_noise_power >= 0 && options.surface_noise_power <= 100))
        return fail(ErrorKind::bad_input, "the surface noise power must be between 0 and 100 mm^2");
    if (!(options.joint_noise_power >= 0 && options.joint_noise_power <= 1e6))
        return fail(ErrorKind::bad_input, "the joint noise power must be between 0 and 1000000 mm^2");
    if (options.people < 1 || options.people > 2)
        return fail(ErrorKind::bad_input,
                    "a synthetic capture can have 1 or 2 people, not " + std::to_string(options.people));
    if (options.people == 2 && options.motion == SynthMotion::tour)
        return fail(ErrorKind::bad_input, "the tour has one person; choose another motion for two");
    return {};
}

SynthFrame synth_frame(const SynthOptions& options, int frame, Threads threads) {
    const double fps = options.fps >= 0.1 ? std::min(options.fps, 10000.0) : 0.1;
    const PosedScene scene = pose_scene(options.motion, options.people, options.seed, std::max(0, frame) / fps);
    const RandomKey key = frame_key(options, frame);
    SynthFrame result;
    for (const auto& joint : scene.joints) result.true_pose.joints.push_back({joint.x(), joint.y(), joint.z()});
    result.pose = result.true_pose;
    const RandomKey joint_key = derive_key(key, joint_stream);
    const double deviation = std::sqrt(std::max(0.0, options.joint_noise_power));
    for (std::size_t j = 0; j < result.pose.joints.size(); ++j)
        for (std::size_t axis = 0; axis < 3; ++axis)
            result.pose.joints[j][axis] += deviation * random_gaussian(joint_key, 3 * j + axis);
    make_surface(result, options, scene, key, threads);
    return result;
}

}  // namespace htvm
