#include "synth/body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "synth/appearance.h"

namespace htvm::synth {
namespace {

using Eigen::Vector3d;

// A segment from `start` whose radius changes linearly along it, in space scaled by `scale` about its start, which
// gives elliptic cross-sections.
struct Primitive {
    Vector3d start, axis, inverse_scale;  // axis: to the end, in scaled space
    double inverse_length2 = 0, radius = 0, radius_change = 0;
};

struct Shape {
    std::vector<Primitive> primitives;
    double blend = 10;       // mm over which the primitives blend
    bool flat_sole = false;  // cut off at the ground of the T-pose
};

using Body = std::array<Shape, part_count>;

Primitive tapered(const Vector3d& start, const Vector3d& end, double start_radius, double end_radius,
                  const Vector3d& scale = Vector3d::Ones()) {
    Primitive p;
    p.start = start;
    p.inverse_scale = scale.cwiseInverse();
    p.axis = (end - start).cwiseProduct(p.inverse_scale);
    const double length2 = p.axis.squaredNorm();
    p.inverse_length2 = length2 > 0 ? 1.0 / length2 : 0.0;
    p.radius = start_radius;
    p.radius_change = end_radius - start_radius;
    return p;
}

Primitive ellipsoid(const Vector3d& centre, const Vector3d& radii) { return tapered(centre, centre, 1, 1, radii); }

// A pair of primitives, left and right.
void add_pair(Shape& shape, Vector3d start, Vector3d end, double start_radius, double end_radius,
              const Vector3d& scale = Vector3d::Ones()) {
    shape.primitives.push_back(tapered(start, end, start_radius, end_radius, scale));
    start.x() = -start.x();
    end.x() = -end.x();
    shape.primitives.push_back(tapered(start, end, start_radius, end_radius, scale));
}

// Puts a primitive into the left shape and its mirror image into the right one.
void add_mirrored(Body& body, Part left, Vector3d start, Vector3d end, double start_radius, double end_radius,
                  const Vector3d& scale = Vector3d::Ones()) {
    const auto index = static_cast<std::size_t>(left);
    body[index].primitives.push_back(tapered(start, end, start_radius, end_radius, scale));
    start.x() = -start.x();
    end.x() = -end.x();
    body[index + 1].primitives.push_back(tapered(start, end, start_radius, end_radius, scale));
}

void build_trunk(Body& body) {
    Shape& pelvis = body[static_cast<std::size_t>(Part::pelvis)];
    pelvis.blend = 16;
    pelvis.primitives = {tapered({-68, 918, -6}, {68, 918, -6}, 92, 92),
                         tapered({-58, 1015, 2}, {58, 1015, 2}, 90, 90)};
    add_pair(pelvis, {64, 890, -42}, {66, 930, -36}, 78, 76);
    Shape& chest = body[static_cast<std::size_t>(Part::chest)];
    chest.blend = 18;
    chest.primitives = {tapered({-58, 1110, 2}, {58, 1110, 2}, 91, 91), tapered({-66, 1200, 0}, {66, 1200, 0}, 97, 97),
                        tapered({-74, 1300, -4}, {74, 1300, -4}, 96, 96),
                        tapered({-92, 1385, -12}, {92, 1385, -12}, 62, 62)};
    add_pair(chest, {64, 1312, 44}, {70, 1325, 42}, 58, 54);    // pectorals
    add_pair(chest, {158, 1392, -6}, {182, 1392, -4}, 55, 54);  // shoulders
    add_pair(chest, {26, 1466, -20}, {135, 1414, -14}, 40, 42);
    Shape& neck = body[static_cast<std::size_t>(Part::neck)];
    neck.blend = 10;
    neck.primitives = {tapered({0, 1440, -16}, {0, 1570, 0}, 60, 55)};
}

void build_head(Body& body) {
    Shape& head = body[static_cast<std::size_t>(Part::head)];
    head.blend = 7;
    head.primitives = {ellipsoid({0, 1650, 0}, {75, 90, 95}), tapered({0, 1606, 26}, {0, 1560, 56}, 60, 29),
                       tapered({0, 1598, -2}, {0, 1568, 14}, 60, 50), tapered({0, 1650, 88}, {0, 1619, 101}, 7, 10),
                       tapered({-8, 1614, 95}, {8, 1614, 95}, 7.5, 7.5)};
    add_pair(head, {77, 1652, -6}, {74, 1622, -2}, 20, 13, {0.45, 1, 1});  // ears
}

void build_limbs(Body& body) {
    for (Part hand : {Part::left_hand, Part::right_hand}) body[static_cast<std::size_t>(hand)].blend = 4;
    add_mirrored(body, Part::left_upper_arm, {180, 1394, -4}, {462, 1395, -2}, 55, 42);
    add_mirrored(body, Part::left_upper_arm, {290, 1395, 8}, {350, 1395, 6}, 47, 45);
    add_mirrored(body, Part::left_forearm, {462, 1395, -2}, {710, 1395, 0}, 41, 27);
    add_mirrored(body, Part::left_forearm, {505, 1395, 6}, {560, 1395, 4}, 42, 39);
    add_mirrored(body, Part::left_hand, {712, 1395, 0}, {742, 1395, 0}, 27, 34, {1, 0.62, 1});
    add_mirrored(body, Part::left_hand, {745, 1395, 2}, {790, 1394, 2}, 38, 41, {1, 0.42, 1});
    add_mirrored(body, Part::left_hand, {795, 1394, 34}, {862, 1388, 40}, 11, 9);
    add_mirrored(body, Part::left_hand, {800, 1394, 12}, {878, 1387, 13}, 11, 9);
    add_mirrored(body, Part::left_hand, {798, 1394, -10}, {870, 1387, -13}, 11, 9);
    add_mirrored(body, Part::left_hand, {790, 1394, -31}, {846, 1388, -37}, 10, 8);
    add_mirrored(body, Part::left_hand, {738, 1391, 26}, {802, 1382, 66}, 15, 10);
    add_mirrored(body, Part::left_thigh, {90, 880, 0}, {98, 500, 4}, 86, 58);
    add_mirrored(body, Part::left_thigh, {100, 740, 16}, {99, 620, 14}, 66, 58);
    add_mirrored(body, Part::left_shin, {98, 500, 4}, {100, 105, -14}, 57, 45);
    add_mirrored(body, Part::left_shin, {101, 405, -22}, {101, 330, -22}, 46, 42);
    add_mirrored(body, Part::left_foot, {100, 105, -14}, {100, 60, -20}, 42, 40);
    add_mirrored(body, Part::left_foot, {100, 36, -42}, {101, 40, 10}, 40, 42);
    add_mirrored(body, Part::left_foot, {101, 60, 0}, {106, 22, 112}, 40, 38, {1, 0.75, 1});
    add_mirrored(body, Part::left_foot, {112, 22, 70}, {104, 20, 140}, 42, 30, {1, 0.8, 1});
    for (Part foot : {Part::left_foot, Part::right_foot}) body[static_cast<std::size_t>(foot)].flat_sole = true;
}

const Body& rest_body() {
    static const Body body = [] {
        Body built;
        build_trunk(built);
        build_head(built);
        build_limbs(built);
        return built;
    }();
    return body;
}

// A weight that falls from 1 at 0 to exactly 0 at reach * blend, with the slope of exp(-difference / blend) at 0. What
// is further away has no effect at all, so leaving it out gives the same bits.
constexpr double reach = 4.0;
double fading_weight(double difference, double blend) {
    const double u = 1.0 - difference / (reach * blend);
    return u > 0 ? u * u * u * u : 0.0;
}

double primitive_distance(const Primitive& p, const Vector3d& rest) {
    const Vector3d q = (rest - p.start).cwiseProduct(p.inverse_scale);
    const double along = std::clamp(q.dot(p.axis) * p.inverse_length2, 0.0, 1.0);
    const Vector3d away = q - along * p.axis;
    const double length = away.norm() + 1e-9;
    // The distance in scaled space divided by the length of its gradient in real space: correct to first order at the
    // surface.
    const double slope = away.cwiseProduct(p.inverse_scale).norm() / length + 1e-9;
    return (length - (p.radius + p.radius_change * along)) / std::max(slope, 1e-3);
}

constexpr std::size_t most_primitives = 16;

double shape_distance(const Shape& shape, const Vector3d& rest) {
    std::array<double, most_primitives> distances;
    double nearest = std::numeric_limits<double>::max();
    const std::size_t count = std::min(shape.primitives.size(), most_primitives);
    for (std::size_t i = 0; i < count; ++i) {
        distances[i] = primitive_distance(shape.primitives[i], rest);
        nearest = std::min(nearest, distances[i]);
    }
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += fading_weight(distances[i] - nearest, shape.blend);
    const double blended = sum > 1.0 ? nearest - shape.blend * std::log(sum) : nearest;
    return shape.flat_sole ? std::max(blended, -rest.y()) : blended;
}

Vector3d to_rest(const PartFrame& frame, const Vector3d& world) {
    return frame.rotation.transpose() * (world - frame.pivot) + frame.rest_pivot;
}

constexpr double part_blend = 9.0;

PartSet bit(std::size_t part) { return PartSet{1} << part; }

// The parts whose rest coordinates may be mixed with those of a part: itself and its ancestors. Where a hand touches a
// leg, each keeps its own.
PartSet joined_parts(std::size_t part) {
    static const std::array<PartSet, part_count> joined = [] {
        std::array<PartSet, part_count> sets{};
        const auto join = [&](Part a, Part b) {
            sets[static_cast<std::size_t>(a)] |= bit(static_cast<std::size_t>(b));
            sets[static_cast<std::size_t>(b)] |= bit(static_cast<std::size_t>(a));
        };
        for (std::size_t i = 0; i < part_count; ++i) sets[i] |= bit(i);
        join(Part::pelvis, Part::chest);
        join(Part::chest, Part::neck);
        join(Part::neck, Part::head);
        for (std::size_t side = 0; side < 2; ++side) {
            const auto of = [&](Part left) { return static_cast<Part>(static_cast<std::size_t>(left) + side); };
            join(Part::chest, of(Part::left_upper_arm));
            join(of(Part::left_upper_arm), of(Part::left_forearm));
            join(of(Part::left_forearm), of(Part::left_hand));
            join(Part::pelvis, of(Part::left_thigh));
            join(of(Part::left_thigh), of(Part::left_shin));
            join(of(Part::left_shin), of(Part::left_foot));
        }
        return sets;
    }();
    return joined[part];
}

struct PartDistances {
    std::array<double, part_count> distance;
    std::array<Vector3d, part_count> rest;
    std::size_t nearest = 0;
    double blended = 0;  // over all parts, without relief
};

PartDistances part_distances(const PosedBody& body, PartSet candidates, const Vector3d& world) {
    const Body& shapes = rest_body();
    PartDistances result;
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < part_count; ++i) {
        if (!(candidates & bit(i))) continue;
        result.rest[i] = to_rest(body.parts[i], world);
        result.distance[i] = shape_distance(shapes[i], result.rest[i]);
        if (result.distance[i] < nearest) {
            nearest = result.distance[i];
            result.nearest = i;
        }
    }
    double sum = 0;
    for (std::size_t i = 0; i < part_count; ++i)
        if (candidates & bit(i)) sum += fading_weight(result.distance[i] - nearest, part_blend);
    result.blended = sum > 1.0 ? nearest - part_blend * std::log(sum) : nearest;
    return result;
}

}  // namespace

SurfacePoint evaluate_body(const PosedBody& body, PartSet candidates, const Vector3d& world) {
    const PartDistances parts = part_distances(body, candidates, world);
    const PartSet mixed = candidates & joined_parts(parts.nearest);
    SurfacePoint point;
    point.rest.setZero();
    double sum = 0;
    for (std::size_t i = 0; i < part_count; ++i) {
        if (!(mixed & bit(i))) continue;
        const double weight = fading_weight(parts.distance[i] - parts.distance[parts.nearest], part_blend);
        if (weight <= 0) continue;
        sum += weight;
        point.rest += weight * parts.rest[i];
    }
    point.rest /= sum;
    point.distance = parts.blended;
    // Far from the surface the relief cannot change the sign, so it is not computed there.
    if (std::abs(parts.blended) < 2 * relief_bound) point.distance -= surface_relief(point.rest);
    return point;
}

BallBounds bound_body(const PosedBody& body, PartSet candidates, const Vector3d& centre, double radius) {
    const PartDistances parts = part_distances(body, candidates, centre);
    BallBounds bounds;
    const double change = steepness * radius;
    bounds.crosses = std::abs(parts.blended) <= change + relief_bound;
    const double limit = parts.distance[parts.nearest] + 2 * change + reach * part_blend;
    for (std::size_t i = 0; i < part_count; ++i)
        if ((candidates & bit(i)) && parts.distance[i] <= limit) bounds.candidates |= bit(i);
    return bounds;
}

}  // namespace htvm::synth
