#include "synth/body.h"

#include <algorithm>
#include <array>
#include <bit>
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
using Shapes = std::array<Shape, scene_part_count>;

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

Primitive rod(const Vector3d& start, const Vector3d& end, double radius) { return tapered(start, end, radius, radius); }

// A chair that faces +z, with the middle of its seat over the origin: rods, as far from thin as a coarse grid needs.
void build_chair(Shape& seat, Shape& frame) {
    seat.blend = frame.blend = 6;
    constexpr double top = chair_seat_height - 22, half = 190;
    for (int slat = -5; slat <= 5; ++slat)
        seat.primitives.push_back(rod({slat * 38.0, top, -half}, {slat * 38.0, top, half}, 22));
    for (const double x : {-half, half}) {
        frame.primitives.push_back(rod({x, 24, half}, {x, top, half - 10}, 24));
        frame.primitives.push_back(rod({x, 24, -half - 30}, {x, top, -half - 10}, 24));
        frame.primitives.push_back(rod({x, top, -half - 10}, {x, 880, -half - 60}, 22));
    }
    for (const double y : {660.0, 750.0, 850.0})
        frame.primitives.push_back(
            rod({-half, y, -half - 10 - (y - top) * 0.11}, {half, y, -half - 10 - (y - top) * 0.11}, 24));
}

// The cloth over a hand in a pocket: in front of the hip, flat.
void build_pockets(Shape& left, Shape& right) {
    left.primitives = {tapered({158, 905, 30}, {160, 770, 36}, 52, 40, {0.62, 1, 1})};
    right.primitives = {tapered({-158, 905, 30}, {-160, 770, 36}, 52, 40, {0.62, 1, 1})};
}

const Shapes& rest_shapes() {
    static const Shapes shapes = [] {
        Body body;
        build_trunk(body);
        build_head(body);
        build_limbs(body);
        Shapes built;
        std::ranges::copy(body, built.begin());
        std::ranges::copy(body, built.begin() + second_person);
        build_pockets(built[left_pocket], built[right_pocket]);
        build_chair(built[chair_seat], built[chair_frame]);
        built[ball_part].primitives = {rod(Vector3d::Zero(), Vector3d::Zero(), ball_radius)};
        return built;
    }();
    return shapes;
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

// Calls visit(part) for every part of a set, in ascending order.
template <class Visit>
void for_each_part(PartSet parts, const Visit& visit) {
    for (; parts != 0; parts &= parts - 1) visit(static_cast<std::size_t>(std::countr_zero(parts)));
}

std::array<PartSet, scene_part_count> joined_sets() {
    std::array<PartSet, scene_part_count> sets{};
    const auto join = [&](std::size_t a, std::size_t b) {
        sets[a] |= part_bit(b);
        sets[b] |= part_bit(a);
    };
    for (std::size_t i = 0; i < scene_part_count; ++i) sets[i] |= part_bit(i);
    for (const std::size_t person : {std::size_t{0}, second_person}) {
        const auto of = [&](Part part, std::size_t side = 0) { return person + static_cast<std::size_t>(part) + side; };
        join(of(Part::pelvis), of(Part::chest));
        join(of(Part::chest), of(Part::neck));
        join(of(Part::neck), of(Part::head));
        for (std::size_t side = 0; side < 2; ++side) {
            join(of(Part::chest), of(Part::left_upper_arm, side));
            join(of(Part::left_upper_arm, side), of(Part::left_forearm, side));
            join(of(Part::left_forearm, side), of(Part::left_hand, side));
            join(of(Part::pelvis), of(Part::left_thigh, side));
            join(of(Part::left_thigh, side), of(Part::left_shin, side));
            join(of(Part::left_shin, side), of(Part::left_foot, side));
        }
    }
    for (std::size_t side = 0; side < 2; ++side) {
        join(left_pocket + side, static_cast<std::size_t>(Part::pelvis));
        join(left_pocket + side, static_cast<std::size_t>(Part::left_thigh) + side);
    }
    join(chair_seat, chair_frame);
    return sets;
}

struct PartDistances {
    std::array<double, scene_part_count> distance;
    std::array<Vector3d, scene_part_count> rest;
    std::size_t nearest = 0;
    double blended = 0;  // over all parts, without relief
};

PartDistances part_distances(const PosedScene& scene, PartSet candidates, const Vector3d& world) {
    const Shapes& shapes = rest_shapes();
    PartDistances result;
    double nearest = std::numeric_limits<double>::max();
    for_each_part(candidates, [&](std::size_t i) {
        result.rest[i] = to_rest(scene.parts[i], world);
        result.distance[i] = shape_distance(shapes[i], result.rest[i]);
        if (result.distance[i] < nearest) {
            nearest = result.distance[i];
            result.nearest = i;
        }
    });
    double sum = 0;
    for_each_part(candidates, [&](std::size_t i) { sum += fading_weight(result.distance[i] - nearest, part_blend); });
    result.blended = sum > 1.0 ? nearest - part_blend * std::log(sum) : nearest;
    return result;
}

}  // namespace

PartSet joined_parts(std::size_t part) {
    static const std::array<PartSet, scene_part_count> joined = joined_sets();
    return joined[part];
}

double part_distance(std::size_t part, const Vector3d& rest) { return shape_distance(rest_shapes()[part], rest); }

SurfacePoint evaluate_surface(const PosedScene& scene, PartSet candidates, const Vector3d& world) {
    const PartDistances parts = part_distances(scene, candidates, world);
    SurfacePoint point;
    point.part = parts.nearest;
    point.rest.setZero();
    double sum = 0;
    for_each_part(candidates & joined_parts(parts.nearest), [&](std::size_t i) {
        const double weight = fading_weight(parts.distance[i] - parts.distance[parts.nearest], part_blend);
        if (weight <= 0) return;
        sum += weight;
        point.rest += weight * parts.rest[i];
    });
    point.rest /= sum;
    point.distance = parts.blended;
    // Far from the surface the relief cannot change the sign, so it is not computed there.
    if (std::abs(parts.blended) < 2 * relief_bound)
        point.distance -= surface_relief(figure_of(parts.nearest), point.rest);
    point.distance = std::max(point.distance, world.x() - scene.border);
    return point;
}

Vector3d surface_gradient(const PosedScene& scene, PartSet candidates, const Vector3d& world) {
    const double distance = evaluate_surface(scene, candidates, world).distance, width = 0.5;
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis)
        gradient[axis] =
            (evaluate_surface(scene, candidates, world + width * Vector3d::Unit(axis)).distance - distance) / width;
    return gradient;
}

BallBounds bound_surface(const PosedScene& scene, PartSet candidates, const Vector3d& centre, double radius) {
    const PartDistances parts = part_distances(scene, candidates, centre);
    BallBounds bounds;
    const double change = steepness * radius;
    bounds.crosses = std::abs(std::max(parts.blended, centre.x() - scene.border)) <= change + relief_bound;
    const double limit = parts.distance[parts.nearest] + 2 * change + reach * part_blend;
    for_each_part(candidates, [&](std::size_t i) {
        if (parts.distance[i] <= limit) bounds.candidates |= part_bit(i);
    });
    return bounds;
}

}  // namespace htvm::synth
