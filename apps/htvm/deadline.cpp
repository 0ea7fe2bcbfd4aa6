#include "deadline.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command_line/terminal.h"
#include "io/mesh_file.h"
#include "io/number_text.h"
#include "metrics/percentile.h"

namespace htvm::app {
namespace {

// How long a frame takes at each effort, against the usual one: docs/performance.md. Roughly is enough, since what is
// learned of each frame corrects it.
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
    return for_long ? std::min(1, most_) : 0;
}

bool Deadline::may_repair(double so_far) const {
    if (!(milliseconds_ > 0) || unrepaired_ >= most_left_lost) return true;
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
    if (frame.left_lost) ++unrepaired_;
    if (frame.repaired > 0) {
        unrepaired_ = 0;
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

std::string deadline_warning(const Deadline& deadline, bool may_drop) {
    const auto frames = deadline.frames().size(), late = deadline.late();
    if (late == 0 || 2 * late < frames) return {};
    return fmt::format(
        "{} of {} late: this machine is too slow for the deadline{}; a larger --deadline helps, a lower "
        "-q{}, meshes of fewer vertices{}",
        late, counted(frames, "frame") + (frames == 1 ? " was" : " were"),
        may_drop ? ", or the meshes came faster than a camera's, as from a file" : "",
        deadline.most() > 1 ? " or --effort" : "", may_drop ? ", or --drop-late, which leaves frames out" : "");
}

Result<void> write_effort_log(OutputFile& file, const std::vector<TimedFrame>& frames) {
    std::string text = "frame,effort,waited_ms,took_ms,repaired\n";
    for (std::size_t i = 0; i < frames.size(); ++i)
        text += fmt::format("{},{},{:.3f},{:.3f},{}\n", i, frames[i].effort, frames[i].waited, frames[i].took,
                            frames[i].left_lost ? 0 : 1);
    if (auto written = file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}); !written)
        return written;
    return file.finish();
}

Result<std::vector<LoggedFrame>> read_effort_log(const std::filesystem::path& path) {
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string text(bytes->begin(), bytes->end());
    std::vector<LoggedFrame> out;
    const auto wrong = [&](std::size_t line, const char* what) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}, line {}: {} (an effort log, as --effort-log writes it, has a "
                                "line \"frame,effort,...\", then one per frame)",
                                path.string(), line, what));
    };
    std::size_t line = 0;
    std::ptrdiff_t columns = 0;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        const auto row = text.substr(at, end - at);
        at = end + 1;
        if (++line == 1) {
            if (row.rfind("frame,effort", 0) != 0) return wrong(line, "this is no effort log");
            columns = std::count(row.begin(), row.end(), ',');
            continue;
        }
        if (row.empty()) continue;
        const auto comma = row.find(',');
        const auto second = comma == std::string::npos ? comma : row.find(',', comma + 1);
        if (comma == std::string::npos) return wrong(line, "there is no effort");
        const double frame = parse_number(row.substr(0, comma)).value_or(-1);
        const double effort = parse_number(row.substr(comma + 1, second - comma - 1)).value_or(-1);
        if (frame != static_cast<double>(out.size())) return wrong(line, "frames are not numbered from 0 on");
        if (!(effort >= 0 && effort <= 9) || effort != static_cast<int>(effort))
            return wrong(line, "an effort is 0 to 9");
        const auto repaired = columns < 4 ? "1" : row.substr(row.rfind(',') + 1);
        if (std::count(row.begin(), row.end(), ',') != columns)
            return wrong(line, "a column is missing, or one too many");
        if (repaired != "0" && repaired != "1") return wrong(line, "whether it was repaired is 0 or 1");
        out.push_back({static_cast<int>(effort), repaired == "1"});
    }
    if (out.empty()) return wrong(line + 1, "there is no frame");
    return out;
}

std::string too_few_efforts(const std::string& path, std::size_t efforts, const std::string& frames) {
    return fmt::format(
        "{} has the efforts of {}, but there are {}: repeat the run that wrote it, with the same frames "
        "and options, or give --frames {}",
        path, counted(efforts, "frame"), frames, efforts);
}

}  // namespace htvm::app
