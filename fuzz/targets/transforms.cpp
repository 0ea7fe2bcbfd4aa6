// Transforms of bones, the pose of an I-frame, and the motion of nodes: layers come back; damaged ones give values in
// range.
#include "codec/reference/transforms.h"

#include "codec/encoder/tracked/node_motion.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

QuantisedRotation any_rotation(fuzz::FuzzInput& input) {
    QuantisedRotation out;
    out.largest = input.u8() % 4;
    for (auto& c : out.others) c = static_cast<std::int16_t>(input.number(1 << rotation_bits));
    return out;
}

QuantisedTransform any_transform(fuzz::FuzzInput& input) {
    if (!input.flag()) return {};
    const auto rotation = any_rotation(input);
    const auto coordinate = [&] { return input.number(2 * lattice_limit); };
    return {rotation, {coordinate(), coordinate(), coordinate()}};
}

void check_transforms(const std::vector<QuantisedTransform>& wanted, fuzz::FuzzInput& input) {
    const auto bytes = encode_transforms(wanted);
    const auto again = decode_transforms(bytes, wanted.size());
    require(again && *again == wanted, "transforms come back as they were encoded");
    const auto bad = decode_transforms(fuzz::damaged(bytes, input), wanted.size());
    if (!bad) return;
    const auto rest = encode_transforms(*bad);
    const auto bad_again = decode_transforms(rest, wanted.size());
    require(bad_again && *bad_again == *bad, "what any bytes decode to can be encoded");
    for (const auto& transform : *bad) {
        const auto matrix = rotation_matrix(transform.rotation);
        rotate(matrix, fuzz::any_point(input));
    }
}

void check_pose(fuzz::FuzzInput& input) {
    CodedPose pose;
    for (std::uint32_t n = input.below(20); n > 0; --n) pose.joints.push_back(fuzz::any_point(input));
    for (std::uint32_t n = input.below(20); n > 0; --n) pose.orientations.push_back(any_rotation(input));
    const auto bytes = encode_pose(pose);
    const auto again = decode_pose(bytes, pose.joints.size(), pose.orientations.size());
    require(again && again->joints == pose.joints && again->orientations == pose.orientations, "a pose comes back");
    const auto bad = decode_pose(fuzz::damaged(bytes, input), pose.joints.size(), pose.orientations.size());
    if (bad) require(fuzz::all_on_lattice(bad->joints), "joints are on the lattice");
}

void check_node_motion(const std::vector<QuantisedTransform>& wanted, fuzz::FuzzInput& input) {
    NodeGraph graph;
    std::vector<QuantisedTransform> before;
    const bool temporal = input.flag();
    for (std::uint32_t n = 0; n < wanted.size(); ++n) {
        auto& lower = graph.lower.emplace_back();
        for (std::uint32_t other = 0; other < n; ++other)
            if (input.below(4) == 0) lower.push_back(other);
        graph.pivots.push_back(fuzz::any_point(input));
        constexpr std::array<Vector3d, 4> normals = {{{0, 0, 0}, {0, 0, 1}, {0.6, 0, -0.8}, {-0.48, 0.6, 0.64}}};
        graph.normals.push_back(normals[input.below(normals.size())]);
        if (temporal) before.push_back(any_transform(input));
    }
    NodeMotionOptions options;
    options.steps.rotation_exponent = static_cast<int>(input.below(11));
    options.steps.shift_exponent = static_cast<int>(input.below(21));
    DeformationForm form;
    form.diagonal.assign(input.flag() ? wanted.size() : 0, Matrix6::Identity() * input.below(1000));
    for (std::uint16_t node = 1; node < form.diagonal.size(); ++node)
        form.above.push_back({static_cast<std::uint16_t>(node - 1), node, Matrix6::Constant(input.below(100))});
    options.form = &form;
    options.price = input.below(100000);
    const auto encoded = encode_node_motion(wanted, graph, before, options);
    const auto decoded_from = [&](std::span<const std::uint8_t> run, NodeMotionSyntax syntax) {
        RangeDecoder decoder(run);
        return decode_node_motion(decoder, options.steps, graph, before, syntax);
    };
    const auto run = encoded.decisions.run();
    const auto again = decoded_from(run, NodeMotionSyntax::surface);
    require(again && *again == encoded.transforms, "the motion that the encoder promised");
    const auto syntax = input.flag() ? NodeMotionSyntax::surface : NodeMotionSyntax::axes_of_space;
    const auto bad = decoded_from(fuzz::damaged(run, input), syntax);
    if (!bad) return;
    for (const auto& transform : *bad) {
        for (const auto c : transform.rotation.others)
            require(std::abs(c) <= 1 << rotation_bits, "a rotation in range");
        for (const auto c : {transform.shift.x, transform.shift.y, transform.shift.z})
            require(std::abs(c) <= 2 * lattice_limit, "a shift in range");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const std::uint8_t what = input.u8() % 4;
    std::vector<QuantisedTransform> wanted;
    if (what == 0) {
        const std::size_t bones = input.u8();
        const auto decoded = decode_transforms(input.rest(), bones);
        if (decoded) wanted = *decoded;
    } else {
        for (std::uint32_t n = input.below(24); n > 0; --n) wanted.push_back(any_transform(input));
    }
    if (what < 2) check_transforms(wanted, input);
    if (what == 2) check_pose(input);
    if (what == 3) check_node_motion(wanted, input);
    return 0;
}
