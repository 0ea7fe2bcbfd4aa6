#include "core/orientation.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

// Makes v a unit vector; false if it has no direction: shorter than a millionth of a millimetre, or not finite.
bool normalise(Vector3d& v) {
    const double size = length(v);
    if (!(size > 1e-6) || !std::isfinite(size)) return false;
    v = v * (1 / size);
    return true;
}

Vector3d column(const Rotation& r, std::size_t c) { return {r[c], r[3 + c], r[6 + c]}; }

// The unit vector nearest to the hint among those perpendicular to the unit vector v.
Vector3d perpendicular(const Vector3d& v, const Vector3d& hint) {
    Vector3d p = hint - v * dot(hint, v);
    if (std::isfinite(dot(p, p)) && dot(p, p) > 1e-6 && normalise(p)) return p;
    std::size_t smallest = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(v[i]) < std::abs(v[smallest])) smallest = i;
    Vector3d axis = {0, 0, 0};
    axis[smallest] = 1;
    p = axis - v * dot(axis, v);
    normalise(p);
    return p;
}

// The rotation about a unit axis, by an angle given as its cosine and sine.
Rotation axis_rotation(const Vector3d& axis, double cosine, double sine) {
    Rotation r;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) r[3 * i + j] = axis[i] * axis[j] * (1 - cosine) + (i == j ? cosine : 0.0);
    const Vector3d s = axis * sine;
    r[1] -= s[2], r[2] += s[1];
    r[3] += s[2], r[5] -= s[0];
    r[6] -= s[1], r[7] += s[0];
    return r;
}

bool has_joints(const Bone& bone, const Pose& pose) {
    return bone.first < pose.joints.size() && bone.second < pose.joints.size();
}

Vector3d direction(const Bone& bone, const Pose& pose) { return pose.joints[bone.second] - pose.joints[bone.first]; }

Rotation reference_orientation(const Skeleton& skeleton, std::size_t b, const Pose& reference) {
    if (reference.orientations.size() == skeleton.bones.size()) return reference.orientations[b];
    const Bone& bone = skeleton.bones[b];
    return bone_orientation(reference.joints[bone.first], reference.joints[bone.second], nullptr);
}

// The minimal rotation from the bone in the reference to the bone in this pose.
Rotation swing(const Bone& bone, const Pose& pose, const Pose& reference, const Rotation& orientation) {
    Vector3d from = direction(bone, reference);
    if (!normalise(from)) from = column(orientation, 0);
    return minimal_rotation(from, direction(bone, pose), column(orientation, 1));
}

// The body's rotation, followed by the minimal rotation from the bone turned by it to the bone in this pose.
Rotation swing_after(const Rotation& body, const Bone& bone, const Pose& pose, const Pose& reference,
                     const Rotation& orientation) {
    Vector3d from = direction(bone, reference);
    if (!normalise(from)) from = column(orientation, 0);
    const Vector3d hint = rotate(body, column(orientation, 1));
    return multiply(minimal_rotation(rotate(body, from), direction(bone, pose), hint), body);
}

// The eigenvector of the largest eigenvalue of a symmetric 4x4 matrix, by Jacobi rotations.
std::array<double, 4> largest_eigenvector(std::array<std::array<double, 4>, 4> m) {
    std::array<std::array<double, 4>, 4> vectors{};  // columns
    for (std::size_t i = 0; i < 4; ++i) vectors[i][i] = 1;
    for (int sweep = 0; sweep < 20; ++sweep)
        for (std::size_t p = 0; p < 3; ++p)
            for (std::size_t q = p + 1; q < 4; ++q) {
                if (m[p][q] == 0) continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (std::size_t k = 0; k < 4; ++k) {
                    const double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b, m[k][q] = s * a + c * b;
                }
                for (std::size_t k = 0; k < 4; ++k) {
                    const double a = m[p][k], b = m[q][k];
                    m[p][k] = c * a - s * b, m[q][k] = s * a + c * b;
                }
                for (auto& row : vectors) {
                    const double a = row[p], b = row[q];
                    row[p] = c * a - s * b, row[q] = s * a + c * b;
                }
            }
    std::size_t largest = 0;
    for (std::size_t i = 1; i < 4; ++i)
        if (m[i][i] > m[largest][largest]) largest = i;
    return {vectors[0][largest], vectors[1][largest], vectors[2][largest], vectors[3][largest]};
}

Vector3d centre(const Pose& pose) {
    Vector3d sum{};
    for (const Vector3d& joint : pose.joints) sum = sum + joint;
    return sum * (1 / static_cast<double>(pose.joints.size()));
}

// The rotation that brings the joints of the reference closest to those of this pose, as one rigid body (least squares;
// Horn 1987, "Closed-form solution of absolute orientation using unit quaternions").
Rotation body_rotation(const Pose& pose, const Pose& reference) {
    const Vector3d from = centre(reference), to = centre(pose);
    double h[3][3] = {};
    double size = 0;
    for (std::size_t j = 0; j < pose.joints.size(); ++j) {
        const Vector3d a = reference.joints[j] - from, b = pose.joints[j] - to;
        size += length(a) * length(b);
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) h[r][c] += a[r] * b[c];
    }
    if (!(size > 1e-6) || !std::isfinite(size)) return identity_rotation;
    for (auto& row : h)
        for (double& element : row) element /= size;
    for (std::size_t i = 0; i < 3; ++i) h[i][i] += 1e-6;  // for joints in one line: turn no more than needed
    const auto q = largest_eigenvector({{
        {h[0][0] + h[1][1] + h[2][2], h[1][2] - h[2][1], h[2][0] - h[0][2], h[0][1] - h[1][0]},
        {h[1][2] - h[2][1], h[0][0] - h[1][1] - h[2][2], h[0][1] + h[1][0], h[2][0] + h[0][2]},
        {h[2][0] - h[0][2], h[0][1] + h[1][0], h[1][1] - h[0][0] - h[2][2], h[1][2] + h[2][1]},
        {h[0][1] - h[1][0], h[2][0] + h[0][2], h[1][2] + h[2][1], h[2][2] - h[0][0] - h[1][1]},
    }});
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    return orthonormalised({1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
                            1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
                            1 - 2 * (x * x + y * y)});
}

// For each joint, the number of bones between it and the nearer end of bone b; a large number if it is not connected.
std::vector<int> bones_away(const Skeleton& skeleton, const std::vector<std::vector<std::size_t>>& neighbours,
                            std::size_t b, std::size_t joint_count) {
    constexpr int unreachable = 1000;
    std::vector<int> away(joint_count, unreachable);
    std::vector<std::size_t> queue = {skeleton.bones[b].first, skeleton.bones[b].second};
    for (const std::size_t joint : queue) away[joint] = 0;
    for (std::size_t next = 0; next < queue.size(); ++next) {
        const std::size_t from = queue[next];
        for (const std::size_t to : neighbours[from]) {
            if (away[to] <= away[from] + 1) continue;
            away[to] = away[from] + 1;
            queue.push_back(to);
        }
    }
    return away;
}

// The rotation about the bone that brings the joints around it, after the swing, closest to those of this pose (least
// squares; the weight falls to 1/4 with each bone further away). Closed form, since only the components perpendicular
// to the bone matter.
Rotation twist(const Bone& bone, const Pose& pose, const Pose& reference, const Rotation& swung,
               const std::vector<int>& away) {
    Vector3d axis = direction(bone, pose);
    if (!normalise(axis)) return identity_rotation;
    constexpr int furthest = 8;
    double cosine = 0, sine = 0, size = 0;
    for (std::size_t j = 0; j < away.size(); ++j) {
        if (away[j] == 0 || away[j] > furthest) continue;
        double weight = 1;
        for (int hop = 0; hop < away[j]; ++hop) weight *= 0.25;
        const Vector3d a = rotate(swung, reference.joints[j] - reference.joints[bone.first]);
        const Vector3d b = pose.joints[j] - pose.joints[bone.first];
        cosine += weight * (dot(a, b) - dot(a, axis) * dot(b, axis));
        sine += weight * dot(cross(a, b), axis);
        size += weight * length(a) * length(b);
    }
    // If the joints around lie close to the bone's line, or disagree, prefer no twist. With a smaller value the legs of
    // a real dancer twisted by half turns from frame to frame.
    const double enough = 0.4 * size;
    double known = std::sqrt(cosine * cosine + sine * sine);
    if (known < enough) cosine += enough - known;
    known = std::sqrt(cosine * cosine + sine * sine);
    if (!(known > 0) || !std::isfinite(known)) return identity_rotation;
    return axis_rotation(axis, cosine / known, sine / known);
}

}  // namespace

Rotation multiply(const Rotation& a, const Rotation& b) {
    Rotation product;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            product[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    return product;
}

Vector3d rotate(const Rotation& r, const Vector3d& v) {
    return {r[0] * v[0] + r[1] * v[1] + r[2] * v[2], r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
            r[6] * v[0] + r[7] * v[1] + r[8] * v[2]};
}

Rotation orthonormalised(const Rotation& r) {
    Vector3d x = {r[0], r[1], r[2]}, y = {r[3], r[4], r[5]};
    if (!normalise(x)) return identity_rotation;
    y = y - x * dot(x, y);
    if (!normalise(y)) return identity_rotation;
    const Vector3d z = cross(x, y);
    return {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
}

Rotation minimal_rotation(const Vector3d& from, const Vector3d& to, const Vector3d& hint) {
    Vector3d a = from, b = to;
    if (!normalise(a) || !normalise(b)) return identity_rotation;
    const Vector3d sum = a + b;
    const double one_plus_cosine = dot(sum, sum) / 2;  // not 1 + a.b, which suffers cancellation where a is nearly -b
    if (one_plus_cosine < 1e-14) return axis_rotation(perpendicular(a, hint), -1, 0);
    const Vector3d v = cross(a, b);
    const double cosine = one_plus_cosine - 1;
    Rotation r;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) r[3 * i + j] = v[i] * v[j] / one_plus_cosine + (i == j ? cosine : 0.0);
    r[1] -= v[2], r[2] += v[1];
    r[3] += v[2], r[5] -= v[0];
    r[6] -= v[1], r[7] += v[0];
    return orthonormalised(r);
}

Rotation bone_orientation(const Vector3d& first, const Vector3d& second, const Rotation* previous) {
    const Rotation& rest = previous ? *previous : identity_rotation;
    Vector3d along = second - first;
    if (!normalise(along)) return rest;
    return orthonormalised(multiply(minimal_rotation(column(rest, 0), along, column(rest, 1)), rest));
}

std::vector<Rotation> derive_orientations(const Skeleton& skeleton, const Pose& pose, const Pose* reference) {
    std::vector<Rotation> result(skeleton.bones.size(), identity_rotation);
    for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
        const Bone& bone = skeleton.bones[b];
        if (!has_joints(bone, pose)) continue;
        if (reference && has_joints(bone, *reference)) {
            const Rotation orientation = reference_orientation(skeleton, b, *reference);
            result[b] = multiply(swing(bone, pose, *reference, orientation), orientation);
        } else {
            result[b] = bone_orientation(pose.joints[bone.first], pose.joints[bone.second], nullptr);
        }
    }
    return result;
}

std::vector<Rotation> derive_turning_orientations(const Skeleton& skeleton, const Pose& pose, const Pose& reference) {
    const std::size_t joint_count = pose.joints.size();
    for (const Bone& bone : skeleton.bones)
        if (!has_joints(bone, pose) || reference.joints.size() != joint_count)
            return derive_orientations(skeleton, pose, &reference);
    std::vector<std::vector<std::size_t>> neighbours(joint_count);
    for (const Bone& bone : skeleton.bones) {
        neighbours[bone.first].push_back(bone.second);
        neighbours[bone.second].push_back(bone.first);
    }
    const Rotation body = body_rotation(pose, reference);
    std::vector<Rotation> result(skeleton.bones.size());
    for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
        const Bone& bone = skeleton.bones[b];
        const Rotation orientation = reference_orientation(skeleton, b, reference);
        const Rotation swung = swing_after(body, bone, pose, reference, orientation);
        const std::vector<int> away = bones_away(skeleton, neighbours, b, joint_count);
        const Rotation twisted = twist(bone, pose, reference, swung, away);
        result[b] = orthonormalised(multiply(twisted, multiply(swung, orientation)));
    }
    return result;
}

}  // namespace htvm::internal
