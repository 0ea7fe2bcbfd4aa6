#include "deadline.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "command_line/terminal.h"
#include "metrics/percentile.h"

namespace htvm::app {
namespace {

// How long a frame takes at each effort, against the usual one: docs/experiments/efforts.md. Roughly is enough, since
// what is learned of each frame corrects it.
constexpr std::array<double, 10> shares = {0.45, 0.88, 0.94, 0.98, 0.99, 1, 1.6, 1.7, 1.8, 2.6};

double share_of(int effort) { return shares[static_cast<std::size_t>(std::clamp(effort, 0, 9))]; }

}  // namespace

int Deadline::effort(double waited) const {
    constexpr double room = 0.9;  // of the deadline, as forecasts are off
    if (!(milliseconds_ > 0)) return most_;
    const double usually = usual();
    for (int effort = most_; effort > 0; --effort)
        if (waited + usually * share_of(effort) <= room * milliseconds_) return effort;
    // Motion alone loses track sooner or later, which nobody mends. Where the machine never has time for more, a few
    // late frames are better than a picture that falls apart.
    const auto alone = [](const TimedFrame& frame) { return frame.motion_alone(); };
    const bool for_long = frames_.size() >= most_alone &&
                          std::all_of(frames_.end() - static_cast<std::ptrdiff_t>(most_alone), frames_.end(), alone);
    return for_long || lost_since_us_ ? std::min(1, most_) : 0;
}

bool Deadline::may_repair(double so_far, std::int64_t timestamp_us) const {
    if (!(milliseconds_ > 0)) return true;
    if (lost_since_us_ && timestamp_us - *lost_since_us_ >= longest_lost_us) return true;
    if (repairs_.empty()) return so_far < milliseconds_;  // the first tells how long they take
    auto ascending = repairs_;
    std::sort(ascending.begin(), ascending.end());
    return so_far + percentile(ascending, 50) <= milliseconds_;
}

double Deadline::usual() const {
    if (usual_.empty()) return 0;
    auto ascending = usual_;
    std::sort(ascending.begin(), ascending.end());
    return percentile(ascending, 70);
}

void Deadline::took(const TimedFrame& frame) {
    // Two of nine take longer than what counts: a frame that takes several times as long, as one with a patch does,
    // says nothing of the next, nor does an I-frame; what frames commonly take is followed within a few. Motion alone
    // takes longer where tracking is lost, and then a frame with more effort is what is needed: it only tells that
    // there is more time.
    constexpr std::size_t last = 9;
    frames_.push_back(frame);
    if (!frame.left_lost && !frame.motion_alone())
        lost_since_us_.reset();
    else if (frame.left_lost && !lost_since_us_)
        lost_since_us_ = frame.timestamp_us;
    if (frame.repaired > 0) {
        if (repairs_.size() == last) repairs_.erase(repairs_.begin());
        repairs_.push_back(frame.repaired);
    }
    const double would_have = frame.took / share_of(frame.effort);
    if (frame.intra || frames_.size() == 1 || (frame.motion_alone() && would_have > usual())) return;
    if (usual_.size() == last) usual_.erase(usual_.begin());
    usual_.push_back(would_have);
}

std::size_t Deadline::late() const {
    if (!(milliseconds_ > 0)) return 0;
    return static_cast<std::size_t>(std::count_if(
        frames_.begin(), frames_.end(), [&](const TimedFrame& frame) { return frame.latency() > milliseconds_; }));
}

std::size_t Deadline::lowered() const {
    return static_cast<std::size_t>(std::count_if(
        frames_.begin(), frames_.end(), [&](const TimedFrame& frame) { return frame.effort < most_ && !frame.intra; }));
}

std::size_t Deadline::alone() const {
    return static_cast<std::size_t>(
        std::count_if(frames_.begin(), frames_.end(), [](const TimedFrame& frame) { return frame.motion_alone(); }));
}

std::size_t Deadline::left_lost() const {
    return static_cast<std::size_t>(
        std::count_if(frames_.begin(), frames_.end(), [](const TimedFrame& frame) { return frame.left_lost; }));
}

Latency latency_of(const std::vector<TimedFrame>& frames) {
    std::vector<double> all;
    for (const auto& frame : frames) all.push_back(frame.latency());
    if (all.empty()) return {};
    std::sort(all.begin(), all.end());
    return {percentile(all, 50), percentile(all, 99), all.back()};
}

std::string deadline_summary(const Deadline& deadline) {
    const auto latency = latency_of(deadline.frames());
    auto out =
        fmt::format("latency of a frame {:.1f} ms in the median, {:.1f} ms in the 99th percentile, {:.1f} ms at most",
                    latency.median, latency.p99, latency.longest);
    if (!(deadline.milliseconds() > 0)) return out;
    return out +
           fmt::format("; deadline {:g} ms: {} late, {} with less effort, {} of them as motion alone, {} not repaired",
                       deadline.milliseconds(), counted(deadline.late(), "frame"), counted(deadline.lowered(), "frame"),
                       deadline.alone(), deadline.left_lost());
}

nlohmann::json deadline_json(const Deadline& deadline) {
    const auto latency = latency_of(deadline.frames());
    nlohmann::json out = {{"latency_ms", {{"p50", latency.median}, {"p99", latency.p99}, {"max", latency.longest}}}};
    if (!(deadline.milliseconds() > 0)) return out;
    std::array<std::size_t, 10> by_effort{};
    std::size_t intra = 0;
    for (const auto& frame : deadline.frames())
        ++(frame.intra ? intra : by_effort[static_cast<std::size_t>(frame.effort)]);
    out["deadline_ms"] = deadline.milliseconds();
    out["late_frames"] = deadline.late();
    out["lowered_frames"] = deadline.lowered();
    out["intra_frames"] = intra;
    out["unrepaired_frames"] = deadline.left_lost();
    out["frames_by_effort"] = by_effort;  // the others
    return out;
}

std::string deadline_warning(const Deadline& deadline, const LateMeshes& meshes) {
    const auto frames = deadline.frames().size(), late = deadline.late(), lost = deadline.left_lost();
    const bool is_late = late > 0 && 2 * late >= frames;
    std::string what;
    if (is_late)
        what = fmt::format("{} of {} late: this machine is too slow for the deadline{}", late,
                           counted(frames, "frame") + (frames == 1 ? " was" : " were"),
                           meshes.piped ? ", or the meshes came faster than a camera's, as from a file" : "");
    else if (lost > 0 && 10 * lost >= frames)
        what = fmt::format("{} of {} show what tracking lost in them, as repairing it takes longer than the deadline",
                           lost, counted(frames, "frame"));
    else
        return {};
    std::vector<std::string> helps = {"a larger --deadline", "a lower -q", "meshes of fewer vertices"};
    if (is_late && meshes.piped && !meshes.dropped) helps.emplace_back("--drop-late, which leaves frames out");
    const auto last = std::move(helps.back());
    helps.pop_back();
    return fmt::format("{}; what helps is {} or {}", what, fmt::join(helps, ", "), last);
}

}  // namespace htvm::app
