#include "limb_events.h"

#include <algorithm>

#include "metrics/triangle_index.h"

namespace htvm::lab {
namespace {

bool is_on_surface(const TrueFrame& truth, std::size_t mark) {
    const Point3 normal = to_point(truth.normals[mark]);
    return dot(normal, normal) > 0.25;
}

struct LimbMarks {
    std::size_t shown = 0, near = 0, renewed = 0;
    std::vector<std::uint32_t> triangles;  // of the decoded mesh, on which they lie
};

double share_of(std::size_t part, std::size_t whole) {
    return whole == 0 ? 1 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

Result<FrameOfLimbs> LimbMeter::add(const SyntheticFrame& frame) {
    FrameOfLimbs out{frame.number, frame.type, frame.renewal, {}};
    std::map<std::size_t, LimbMarks> by_limb;
    for (const LimbState& limb : frame.truth.limbs) by_limb[limb.part] = {};
    const auto captured = TriangleIndex::build(frame.surface), decoded = TriangleIndex::build(frame.decoded);
    if (!captured) return tl::unexpected(captured.error());
    if (!decoded) return tl::unexpected(decoded.error());
    const double near2 = rule_.near_mm * rule_.near_mm, shown2 = rule_.shown_mm * rule_.shown_mm;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
        const auto limb = by_limb.find(marks_[i].part);
        if (limb == by_limb.end() || !is_on_surface(frame.truth, i)) continue;
        const Point3 place = to_point(frame.truth.positions[i]);
        if (captured->closest(place).squared_distance > shown2) continue;
        const auto closest = decoded->closest(place);
        auto& marks = limb->second;
        ++marks.shown;
        if (closest.squared_distance > near2) continue;
        ++marks.near;
        if (closest.triangle >= frame.kept_triangles) ++marks.renewed;
        marks.triangles.push_back(closest.triangle);
    }
    if (frame.topology != topology_) {
        topology_ = frame.topology;
        vertices_.clear();
        for (const auto& [part, marks] : by_limb) {
            auto& vertices = vertices_[part];
            for (const auto triangle : marks.triangles)
                for (const auto v : frame.decoded.triangles[triangle]) vertices.push_back(v);
            std::ranges::sort(vertices);
            vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        }
    }
    for (const auto& [part, marks] : by_limb) {
        const auto& vertices = vertices_[part];
        const auto near = static_cast<std::size_t>(std::ranges::count_if(vertices, [&](std::uint32_t v) {
            return captured->closest(to_point(frame.decoded.positions[v])).squared_distance <= near2;
        }));
        LimbInFrame limb{part, marks.shown < rule_.fewest_marks, 1, 0};
        if (!limb.hidden) {
            limb.right = std::min(share_of(marks.near, marks.shown), share_of(near, vertices.size()));
            if (frame.type == FrameType::patched) limb.renewed = share_of(marks.renewed, marks.shown);
        }
        out.limbs.push_back(limb);
    }
    return out;
}

std::vector<JudgedEvent> judge_events(std::span<const LimbEvent> events, std::span<const FrameOfLimbs> frames,
                                      const LimbRule& rule) {
    std::vector<JudgedEvent> out;
    for (const LimbEvent& event : events) {
        JudgedEvent judged{event, LimbOutcome::followed, 1, event.first};
        bool seen = false, wrong = false, patched = false, intra = false;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const FrameOfLimbs& frame = frames[i];
            if (frame.number < event.first || frame.number > event.last + rule.frames_after) continue;
            const auto limb = std::ranges::find(frame.limbs, event.part, &LimbInFrame::part);
            if (limb == frame.limbs.end()) continue;
            const bool stands_alone = frame.type == FrameType::intra || frame.type == FrameType::enhanced;
            const bool anew = i > 0 && stands_alone && !frame.renewal;
            const bool mended = frame.type == FrameType::patched && limb->renewed >= rule.least_patched;
            intra = intra || anew;
            patched = patched || mended;
            if (anew || mended) wrong = false;  // what was wrong before is made good, if the limb is right from here on
            if (limb->hidden) continue;
            seen = true;
            wrong = wrong || limb->right < rule.least_share;
            if (limb->right >= judged.least_right) continue;
            judged.least_right = limb->right;
            judged.worst_frame = frame.number;
        }
        judged.outcome = wrong     ? LimbOutcome::lost
                         : intra   ? LimbOutcome::intra
                         : patched ? LimbOutcome::patched
                         : seen    ? LimbOutcome::followed
                                   : LimbOutcome::hidden;
        out.push_back(judged);
    }
    return out;
}

std::size_t OutcomeCounts::counted() const {
    std::size_t sum = 0;
    for (const auto count : of) sum += count;
    return sum - (*this)[LimbOutcome::hidden];
}

double OutcomeCounts::followed_share() const { return share_of((*this)[LimbOutcome::followed], counted()); }

void add(OutcomeCounts& counts, const JudgedEvent& event) { ++counts.of[static_cast<std::size_t>(event.outcome)]; }

}  // namespace htvm::lab
