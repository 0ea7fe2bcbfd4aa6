#include "codec/reference/transforms.h"

#include <algorithm>
#include <cmath>

#include "entropy/range_coder.h"

namespace htvm::internal {

RotationMatrix rotation_matrix(const QuantisedRotation& rotation) {
    std::array<std::int64_t, 4> q{};
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        q[i] = i == rotation.largest ? std::int64_t{1} << rotation_bits : rotation.others[other++];
    const std::int64_t w = q[0], x = q[1], y = q[2], z = q[3];
    const std::int64_t norm = w * w + x * x + y * y + z * z;
    const std::array<std::int64_t, 9> scaled = {
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z),           2 * (x * z + w * y),
        2 * (x * y + w * z),           w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y),           2 * (y * z + w * x),           w * w - x * x - y * y + z * z};
    RotationMatrix matrix{};
    for (std::size_t i = 0; i < 9; ++i) matrix[i] = divide_rounded(scaled[i] * (std::int64_t{1} << matrix_bits), norm);
    return matrix;
}

LatticePoint rotate(const RotationMatrix& m, LatticePoint v) {
    constexpr std::int64_t half = std::int64_t{1} << (matrix_bits - 1);
    auto row = [&](std::size_t i) {
        return static_cast<std::int32_t>((m[i] * v.x + m[i + 1] * v.y + m[i + 2] * v.z + half) >> matrix_bits);
    };
    return {row(0), row(3), row(6)};
}

QuantisedRotation quantise_rotation(const std::array<double, 4>& quaternion) {
    QuantisedRotation out;
    for (std::uint8_t i = 1; i < 4; ++i)
        if (std::abs(quaternion[i]) > std::abs(quaternion[out.largest])) out.largest = i;
    const double scale = static_cast<double>(1 << rotation_bits) / quaternion[out.largest];
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        if (i != out.largest) out.others[other++] = static_cast<std::int16_t>(std::lround(quaternion[i] * scale));
    return out;
}

namespace {

// A sum of weighted vectors, in 2^-(matrix_bits + weight_bits) lattice units. The weights sum to 2^12, so sums of
// turned vectors stay below sqrt(3) * 2^25 * 2^36. A transform's offset is below 5 * 2^48, and a point that a matrix
// turns below 2 * 2^48, so that those of moved points stay below 7 * 2^60.
using WeightedSum = std::array<std::int64_t, 3>;

void add_turned(WeightedSum& sum, std::int64_t weight, const RotationMatrix& m, LatticePoint v) {
    for (std::size_t i = 0; i < 3; ++i) sum[i] += weight * (m[3 * i] * v.x + m[3 * i + 1] * v.y + m[3 * i + 2] * v.z);
}

std::int64_t rounded(std::int64_t sum) {
    constexpr int bits = matrix_bits + weight_bits;
    return (sum + (std::int64_t{1} << (bits - 1))) >> bits;
}

}  // namespace

std::vector<RotationMatrix> rotation_matrices(std::span<const QuantisedTransform> transforms) {
    std::vector<RotationMatrix> out;
    out.reserve(transforms.size());
    for (const auto& t : transforms) out.push_back(rotation_matrix(t.rotation));
    return out;
}

LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift) {
    const LatticePoint turned = rotate(matrix, point - pivot);
    return {within_lattice(std::int64_t{turned.x} + pivot.x + shift.x),
            within_lattice(std::int64_t{turned.y} + pivot.y + shift.y),
            within_lattice(std::int64_t{turned.z} + pivot.z + shift.z)};
}

std::vector<PointMove> point_moves(std::span<const QuantisedTransform> transforms,
                                   std::span<const LatticePoint> pivots) {
    std::vector<PointMove> out;
    out.reserve(transforms.size());
    for (std::size_t i = 0; i < transforms.size(); ++i) {
        const auto m = rotation_matrix(transforms[i].rotation);
        const LatticePoint pivot = pivots[i], to = pivot + transforms[i].shift;
        const auto offset = [&](std::size_t row, std::int32_t moved) {
            return (std::int64_t{moved} << matrix_bits) -
                   (m[row] * pivot.x + m[row + 1] * pivot.y + m[row + 2] * pivot.z);
        };
        auto& move = out.emplace_back(PointMove{{}, {offset(0, to.x), offset(3, to.y), offset(6, to.z)}});
        for (std::size_t k = 0; k < m.size(); ++k) move.rotation[k] = static_cast<double>(m[k]);
    }
    return out;
}

// The handles' matrices and offsets are blended first, which takes fewer products than to blend the places.
LatticePoint blended_move(LatticePoint point, const VertexWeights& weights, std::span<const PointMove> moves) {
    std::array<double, 10> rotation{};  // whole numbers below 2^37
    WeightedSum offset{};
    for (std::size_t i = 0; i < handles_per_vertex && weights.weight[i] > 0; ++i) {
        const std::int64_t weight = weights.weight[i];
        const double share = weights.weight[i];
        const PointMove& move = moves[weights.handle[i]];
        for (std::size_t k = 0; k < rotation.size(); ++k) rotation[k] += share * move.rotation[k];
        for (std::size_t c = 0; c < offset.size(); ++c) offset[c] += weight * move.offset[c];
    }
    RotationMatrix m;
    for (std::size_t k = 0; k < m.size(); ++k) m[k] = static_cast<std::int64_t>(rotation[k]);
    const auto along = [&](std::size_t row, std::int64_t start) {
        return within_lattice(rounded(start + m[row] * point.x + m[row + 1] * point.y + m[row + 2] * point.z));
    };
    return {along(0, offset[0]), along(3, offset[1]), along(6, offset[2])};
}

LatticePoint blended_turn(LatticePoint vector, const VertexWeights& weights, std::span<const RotationMatrix> rotation) {
    WeightedSum sum{};
    for (std::size_t i = 0; i < handles_per_vertex && weights.weight[i] > 0; ++i)
        add_turned(sum, weights.weight[i], rotation[weights.handle[i]], vector);
    return {static_cast<std::int32_t>(rounded(sum[0])), static_cast<std::int32_t>(rounded(sum[1])),
            static_cast<std::int32_t>(rounded(sum[2]))};
}

namespace {

// Written once for both directions (entropy/models.h): the value passed in is written, or is set to what is read.

// Clamped to twice the lattice, so that sums of a few of them cannot overflow.
template <class Coder>
void code_point(Coder& coder, SignedModel& model, LatticePoint& p) {
    for (std::int32_t* c : {&p.x, &p.y, &p.z}) *c = coder.signed_number(model, *c) % (2 * lattice_limit + 1);
}

// False if a component is out of range, which happens only in a corrupt stream.
template <class Coder>
bool code_rotation(Coder& coder, SignedModel& model, QuantisedRotation& rotation) {
    rotation.largest = static_cast<std::uint8_t>(coder.raw(rotation.largest, 2));
    for (auto& c : rotation.others) {
        const std::int32_t v = coder.signed_number(model, c);
        if (v > (1 << rotation_bits) || v < -(1 << rotation_bits)) return false;
        c = static_cast<std::int16_t>(v);
    }
    return true;
}

template <class Coder>
bool code_transforms(Coder coder, std::span<QuantisedTransform> transforms) {
    BinaryModel still;
    SignedModel rotation, shift;
    for (auto& transform : transforms) {
        if (coder.bit(still, transform == QuantisedTransform{})) continue;
        if (!code_rotation(coder, rotation, transform.rotation)) return false;
        code_point(coder, shift, transform.shift);
    }
    return true;
}

}  // namespace

std::vector<std::uint8_t> encode_transforms(std::span<const QuantisedTransform> transforms) {
    std::vector<QuantisedTransform> coded(transforms.begin(), transforms.end());
    RangeEncoder encoder;
    code_transforms(WritingCoder<RangeEncoder>{encoder}, std::span(coded));
    return encoder.finish();
}

Result<std::vector<QuantisedTransform>> decode_transforms(std::span<const std::uint8_t> bytes, std::size_t bones) {
    RangeDecoder decoder(bytes);
    std::vector<QuantisedTransform> out(bones);
    if (!code_transforms(ReadingCoder<RangeDecoder>{decoder}, std::span(out)))
        return fail(ErrorKind::corrupt_stream, "transforms layer: a rotation is out of range");
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "transforms layer: it ends too early");
    return out;
}

std::vector<std::uint8_t> encode_pose(const CodedPose& pose) {
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    SignedModel rotation, position;
    LatticePoint previous;
    for (const auto joint : pose.joints) {
        LatticePoint step = joint - previous;
        code_point(coder, position, step);
        previous = joint;
    }
    for (QuantisedRotation orientation : pose.orientations) code_rotation(coder, rotation, orientation);
    return encoder.finish();
}

Result<CodedPose> decode_pose(std::span<const std::uint8_t> bytes, std::size_t joints, std::size_t bones) {
    RangeDecoder decoder(bytes);
    ReadingCoder<RangeDecoder> coder{decoder};
    SignedModel rotation, position;
    CodedPose out;
    LatticePoint previous;
    for (std::size_t k = 0; k < joints; ++k) {
        LatticePoint step;
        code_point(coder, position, step);
        previous = previous + step;
        if (!on_lattice(previous) || decoder.exhausted())
            return fail(ErrorKind::corrupt_stream, "pose layer: a joint is out of range or missing");
        out.joints.push_back(previous);
    }
    out.orientations.resize(bones);
    for (auto& orientation : out.orientations)
        if (!code_rotation(coder, rotation, orientation))
            return fail(ErrorKind::corrupt_stream, "pose layer: an orientation is out of range");
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "pose layer: it ends too early");
    return out;
}

}  // namespace htvm::internal
