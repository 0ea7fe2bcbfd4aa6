#include "synth/truth.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "core/parallel.h"
#include "synth/body.h"
#include "synth/choreography.h"
#include "synth/extract.h"
#include "synth/posture.h"
#include "synth/random.h"

namespace htvm {

using namespace internal;
namespace {

using namespace synth;
using Eigen::Vector3d;

Vector3d to_eigen(const htvm::Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector3f to_float(const Vector3d& p) {
    return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

PosedScene scene_at(const SynthOptions& options, int frame) {
    return pose_scene(options.motion, options.people, options.seed, std::max(0, frame) / options.fps);
}

// Moves a point onto the surface, in the direction of steepest descent; gives the gradient there.
Vector3d drop_onto_surface(const PosedScene& scene, PartSet candidates, Vector3d& position) {
    Vector3d gradient = Vector3d::Zero();
    for (int round = 0; round < 5; ++round) {
        gradient = surface_gradient(scene, candidates, position);
        const double distance = evaluate_surface(scene, candidates, position).distance;
        if (std::abs(distance) < 0.01) break;
        position -= distance * gradient / std::max(gradient.squaredNorm(), 0.25);
    }
    return gradient;
}

// ---- Marks ----------------------------------------------------------------------------------------------------------

// Marks all over the parts of a set as they are at rest, about 20 mm apart.
std::vector<SurfaceMark> marks_of(PartSet parts) {
    PosedScene scene = rest_scene();
    scene.present = parts;
    if (!(parts & person_parts))  // things are at the origin
        scene.landmarks = {{-200, 0, -300}, {200, 900, 200}};
    Grid grid;
    grid.cell = 20;
    std::vector<SurfaceMark> marks;
    for (Vector3d position : extract_surface(scene, grid, {}).positions) {
        drop_onto_surface(scene, parts, position);
        const SurfacePoint point = evaluate_surface(scene, parts, position);
        if (std::abs(point.distance) < 0.1) marks.push_back({point.part, {position.x(), position.y(), position.z()}});
    }
    return marks;
}

const std::vector<SurfaceMark>& person_marks() {
    static const std::vector<SurfaceMark> marks = marks_of(person_parts);
    return marks;
}

bool has_second_person(const SynthOptions& options) {
    return options.people > 1 || options.motion == SynthMotion::everyday;
}

// ---- Where they are -------------------------------------------------------------------------------------------------

struct Located {
    Vector3d position, normal;  // normal: zero if the mark is not on the surface
};

// Where the skin of several parts flows together at a joint, a mark is where the mixture of their coordinates is its
// own, and the surface passes.
Located locate(const PosedScene& scene, const SurfaceMark& mark) {
    const Vector3d rest = to_eigen(mark.rest);
    if (!(scene.present & part_bit(mark.part))) return {Vector3d::Zero(), Vector3d::Zero()};
    const PartFrame& frame = scene.parts[mark.part];
    const PartSet own = scene.present & joined_parts(mark.part);
    Vector3d position = carry(frame, rest), looked_at = position;
    double nearest = std::numeric_limits<double>::max();  // in folds the steps may lead ever farther away
    for (int round = 0; round < 17 && nearest >= 0.02; ++round) {
        const Vector3d away = evaluate_surface(scene, own, looked_at).rest - rest;
        if (away.norm() < nearest) nearest = away.norm(), position = looked_at;
        looked_at -= 0.7 * (frame.rotation * away);
    }
    constexpr double farthest = 10, slack = 6;  // mm
    if (std::abs(evaluate_surface(scene, scene.present, position).distance) > farthest)
        return {position, Vector3d::Zero()};
    Vector3d dropped = position;
    const Vector3d gradient = drop_onto_surface(scene, scene.present, dropped);
    const SurfacePoint there = evaluate_surface(scene, scene.present, dropped);
    const bool mine = (joined_parts(mark.part) & part_bit(there.part)) != 0 && (there.rest - rest).norm() < slack &&
                      std::abs(there.distance) < 0.5;
    if (!mine) return {position, Vector3d::Zero()};
    return {dropped, gradient.normalized()};
}

// ---- Limbs ----------------------------------------------------------------------------------------------------------

constexpr std::array<Part, 4> limbs = {Part::left_hand, Part::right_hand, Part::left_foot, Part::right_foot};

const std::vector<Vector3d>& marks_on(std::size_t part) {
    static const std::array<std::vector<Vector3d>, part_count> by_part = [] {
        std::array<std::vector<Vector3d>, part_count> out;
        for (const SurfaceMark& mark : person_marks()) out[mark.part].push_back(to_eigen(mark.rest));
        return out;
    }();
    return by_part[part % part_count];
}

Vector3d to_rest(const PartFrame& frame, const Vector3d& world) {
    return frame.rotation.transpose() * (world - frame.pivot) + frame.rest_pivot;
}

struct Gap {
    double distance = std::numeric_limits<double>::max();
    std::size_t part = 0;
};

// The smallest distance of marks on a part of a person from the parts of a set.
Gap nearest_part(const PosedScene& scene, std::size_t part, PartSet others) {
    Gap gap;
    for (const Vector3d& rest : marks_on(part)) {
        const Vector3d world = carry(scene.parts[part], rest);
        for (std::size_t other = 0; other < scene_part_count; ++other) {
            if (!(others & part_bit(other))) continue;
            const double distance = part_distance(other, to_rest(scene.parts[other], world));
            if (distance < gap.distance) gap = {distance, other};
        }
    }
    return gap;
}

LimbState limb_state(const PosedScene& scene, std::size_t part) {
    LimbState state;
    state.part = part;
    const auto& marks = marks_on(part);
    Vector3d sum = Vector3d::Zero();
    std::size_t seen = 0;
    for (const Vector3d& rest : marks) {
        const Vector3d world = carry(scene.parts[part], rest);
        sum += world;
        if (evaluate_surface(scene, scene.present, world).distance > -8) ++seen;
    }
    const Vector3d centre = sum / static_cast<double>(std::max<std::size_t>(marks.size(), 1));
    state.centre = {centre.x(), centre.y(), centre.z()};
    state.seen = static_cast<double>(seen) / static_cast<double>(std::max<std::size_t>(marks.size(), 1));
    const Gap gap = nearest_part(scene, part, scene.present & ~joined_parts(part));
    state.gap = gap.distance;
    state.nearest = gap.part;
    return state;
}

}  // namespace

std::vector<SurfaceMark> surface_marks(const SynthOptions& options, std::size_t count) {
    std::vector<SurfaceMark> all = person_marks();
    const std::size_t of_person = all.size();
    if (has_second_person(options))
        for (std::size_t i = 0; i < of_person; ++i) all.push_back({all[i].part + second_person, all[i].rest});
    if (options.motion == SynthMotion::everyday)
        for (const PartSet thing : {part_bit(chair_seat) | part_bit(chair_frame), part_bit(ball_part)}) {
            const auto marks = marks_of(thing);
            all.insert(all.end(), marks.begin(), marks.end());
        }
    const RandomKey key = derive_key({mix_bits(options.seed)}, 0x6d61726b);
    count = std::min(count, all.size());
    for (std::size_t i = 0; i < count; ++i) std::swap(all[i], all[i + random_bits(key, i) % (all.size() - i)]);
    all.resize(count);
    return all;
}

std::string figure_name(std::size_t part) {
    switch (figure_of(part)) {
        case Figure::person:
            return "person";
        case Figure::other_person:
            return "other person";
        case Figure::chair:
            return "chair";
        case Figure::ball:
            return "ball";
    }
    return {};
}

std::string part_name(std::size_t part) {
    static constexpr std::array<const char*, part_count> names = {
        "pelvis",       "chest",         "neck",      "head",       "left upper arm", "right upper arm",
        "left forearm", "right forearm", "left hand", "right hand", "left thigh",     "right thigh",
        "left shin",    "right shin",    "left foot", "right foot"};
    if (part < 2 * part_count) return names[part % part_count];
    return part == left_pocket ? "left pocket" : part == right_pocket ? "right pocket" : figure_name(part);
}

std::string event_name(LimbEventKind kind) {
    switch (kind) {
        case LimbEventKind::fast:
            return "fast";
        case LimbEventKind::touch:
            return "touch";
        case LimbEventKind::release:
            return "release";
        case LimbEventKind::occluded:
            return "occluded";
    }
    return {};
}

TrueFrame true_frame(const SynthOptions& options, std::span<const SurfaceMark> marks, int frame, Threads threads) {
    const PosedScene scene = scene_at(options, frame);
    TrueFrame out;
    out.positions.resize(marks.size());
    out.normals.resize(marks.size());
    parallel_for(marks.size(), threads, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Located located = locate(scene, marks[i]);
            out.positions[i] = to_float(located.position);
            out.normals[i] = to_float(located.normal);
        }
    });
    for (const std::size_t person : {std::size_t{0}, second_person})
        for (const Part limb : limbs)
            if (scene.present & part_bit(person + index_of(limb)))
                out.limbs.push_back(limb_state(scene, person + index_of(limb)));
    return out;
}

std::vector<LimbEvent> limb_events(std::span<const std::vector<LimbState>> frames, int first_frame, double fps) {
    std::vector<LimbEvent> events;
    // The event of each kind and limb that goes on.
    std::map<std::pair<LimbEventKind, std::size_t>, LimbEvent> open;
    const auto note = [&](LimbEventKind kind, const LimbState& limb, int frame, bool holds, std::size_t other,
                          double step) {
        const auto key = std::pair(kind, limb.part);
        const auto found = open.find(key);
        const bool goes_on = found != open.end() && holds && found->second.other == other;
        if (goes_on) {
            found->second.last = frame;
            found->second.largest_step = std::max(found->second.largest_step, step);
            return;
        }
        if (found != open.end()) {
            events.push_back(found->second);
            if (kind == LimbEventKind::touch)
                events.push_back(
                    {LimbEventKind::release, limb.part, found->second.other, found->second.last, frame, 0});
            open.erase(found);
        }
        if (holds) open[key] = {kind, limb.part, other, frame, frame, step};
    };
    for (std::size_t i = 0; i < frames.size(); ++i)
        for (const LimbState& limb : frames[i]) {
            const int frame = first_frame + static_cast<int>(i);
            const LimbState* before = nullptr;
            if (i > 0)
                for (const LimbState& other : frames[i - 1])
                    if (other.part == limb.part) before = &other;
            const double step = before ? (to_eigen(limb.centre) - to_eigen(before->centre)).norm() : 0.0;
            note(LimbEventKind::fast, limb, frame, step * fps >= fast_speed, 0, step);
            note(LimbEventKind::touch, limb, frame, limb.gap < touch_gap, limb.gap < touch_gap ? limb.nearest : 0, 0);
            note(LimbEventKind::occluded, limb, frame, limb.seen < 0.5, 0, 0);
        }
    for (const auto& [key, event] : open) events.push_back(event);
    std::ranges::stable_sort(events, {}, &LimbEvent::first);
    return events;
}

}  // namespace htvm
