// What both sides derive from an I-frame: skinning, smooth weights, nodes of a deformation graph, nearest vertices.
#include <numeric>

#include "codec/reference/deformation_nodes.h"
#include "codec/reference/skinning.h"
#include "codec/tracked/tracked_frame.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

void check_weights(const HandleWeights& weights, std::size_t vertices, std::size_t handles) {
    require(weights.size() == vertices, "weights of every vertex");
    for (const auto& w : weights) {
        require(std::accumulate(w.weight.begin(), w.weight.end(), 0) == 1 << weight_bits, "weights sum to one");
        for (std::size_t i = 0; i < handles_per_vertex; ++i)
            require(w.handle[i] < handles, "weights of handles that are there");
    }
}

void check_nodes(const fuzz::SmallMesh& mesh, fuzz::FuzzInput& input) {
    DeformationNodeOptions options;
    options.spacing = 1 + std::abs(input.number(lattice_limit));
    options.link_reach = std::abs(input.number(lattice_limit));
    options.most_nodes = 1 + input.below(most_deformation_nodes);
    const auto nodes = choose_deformation_nodes(mesh.positions, mesh.triangles, options);
    require(nodes.vertex.size() <= options.most_nodes, "no more nodes than wanted");
    require(mesh.positions.empty() == nodes.vertex.empty(), "nodes for every mesh with vertices");
    check_weights(nodes.weights, mesh.positions.size(), nodes.vertex.size());
    for (const auto& pair : nodes.neighbours)
        require(pair.first < pair.second && pair.second < nodes.vertex.size(), "neighbours are nodes");
    // A patch leaves the first so many vertices, and makes what it likes of the others.
    std::vector<std::uint32_t> stays(input.below(static_cast<std::uint32_t>(mesh.positions.size() + 1)));
    std::iota(stays.begin(), stays.end(), 0u);
    const auto other = fuzz::small_mesh(input);
    if (other.positions.size() < stays.size()) return;
    const auto renewed = choose_deformation_nodes(other.positions, other.triangles, options, keep_nodes(nodes, stays));
    require(renewed.vertex.size() <= options.most_nodes, "no more nodes than wanted, patched or not");
    check_weights(renewed.weights, other.positions.size(), renewed.vertex.size());
}

void check_reference(const fuzz::SmallMesh& mesh, fuzz::FuzzInput& input) {
    std::vector<LatticePoint> joints;
    std::vector<Bone> bones;
    std::vector<std::int32_t> radii;
    for (std::uint32_t n = 2 + input.below(6); n > 0; --n) joints.push_back(fuzz::any_point(input));
    const auto any_joint = [&] {
        return static_cast<std::uint16_t>(input.below(static_cast<std::uint32_t>(joints.size())));
    };
    for (std::uint32_t n = 1 + input.below(6); n > 0; --n) {
        bones.push_back({any_joint(), any_joint()});
        radii.push_back(std::abs(input.number(lattice_limit)));
    }
    LatticeMesh lattice_mesh;
    lattice_mesh.positions = mesh.positions;
    lattice_mesh.triangles = mesh.triangles;
    lattice_mesh.normals.assign(mesh.positions.size(), {100, -20, 70});
    const auto reference = make_reference(lattice_mesh, bones, joints, std::vector<QuantisedRotation>(bones.size()),
                                          radii, std::abs(input.number(lattice_limit)), 0, {});
    if (!reference.weights.empty()) check_weights(reference.weights, mesh.positions.size(), bones.size());
    std::vector<QuantisedTransform> transforms(bones.size());
    for (auto& transform : transforms) {
        transform.rotation.largest = input.u8() % 4;
        for (auto& c : transform.rotation.others) c = static_cast<std::int16_t>(input.number(1 << rotation_bits));
        transform.shift = {input.number(2 * lattice_limit), input.number(2 * lattice_limit), input.number(99)};
    }
    const auto moved = predict_positions(reference, transforms, {});
    require(moved.size() == mesh.positions.size() && fuzz::all_on_lattice(moved), "predictions are on the lattice");
    (void)predict_normals(reference, transforms);
}

void check_tracked(const fuzz::SmallMesh& mesh, fuzz::FuzzInput& input) {
    LatticeMesh lattice_mesh;
    lattice_mesh.positions = mesh.positions;
    lattice_mesh.triangles = mesh.triangles;
    const auto reference = make_node_reference(lattice_mesh, 1 + std::abs(input.number(lattice_limit)),
                                               1 + std::abs(input.number(1 << 24)));
    if (!reference) return;
    require(fuzz::all_on_lattice(reference->mesh.positions), "smoothed vertices are on the lattice");
    std::vector<QuantisedTransform> transforms(reference->graph.pivots.size());
    for (auto& transform : transforms) {
        for (auto& c : transform.rotation.others) c = static_cast<std::int16_t>(input.number(1 << rotation_bits));
        transform.shift.x = input.number(2 * lattice_limit);
    }
    const auto moved = moved_by_nodes(*reference, transforms, {});
    require(fuzz::all_on_lattice(moved), "moved vertices are on the lattice");
    const auto normals = vertex_normals(moved, mesh.triangles);
    std::vector<std::int32_t> displacement;
    for (std::size_t k = 0; k < moved.size(); ++k) displacement.push_back(input.number(4 * field_limit));
    require(fuzz::all_on_lattice(displaced(moved, normals, displacement)), "displaced vertices are on the lattice");
    (void)quantised_normals(normals);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const std::uint8_t what = input.u8() % 3;
    const auto mesh = fuzz::small_mesh(input);
    if (what == 0) check_nodes(mesh, input);
    if (what == 1) check_reference(mesh, input);
    if (what == 2) check_tracked(mesh, input);
    return 0;
}
