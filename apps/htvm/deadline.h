// How much may be searched for each frame of a live capture, so that none is late.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace htvm::app {

// One frame, as decided and as it went.
struct TimedFrame {
    int effort = 5;          // see Encoder::set_effort()
    double waited = 0;       // milliseconds from when the mesh was there to when it was taken
    double took = 0;         // milliseconds that it then took
    bool intra = false;      // an I-frame, for which the same is sent at any effort
    bool left_lost = false;  // tracking was lost, and there was no time to repair it
    double repaired = 0;     // milliseconds that repairing it took; 0: there was nothing to repair
    std::int64_t timestamp_us = 0;
    double latency() const { return waited + took; }
    bool motion_alone() const { return effort == 0 && !intra; }
};

// Takes the highest effort with which a frame will probably be out in time. Times are forecast from the last frames':
// how long each effort takes against the others is known, how fast the machine is and how hard the capture is not.
class Deadline {
public:
    // milliseconds: from when a mesh is there; 0: there is no deadline. most: the effort that was asked for.
    Deadline(double milliseconds, int most) : milliseconds_(milliseconds), most_(most) {}
    // For a frame that has waited for so long. 0, motion alone, at most so many times in a row, and not while tracking
    // is known to be lost, as motion alone is repaired only where the picture falls apart.
    static constexpr std::size_t most_alone = 10;
    int effort(double waited) const;
    // Whether a frame in which tracking is lost may be repaired, so long after its mesh was there. Not so where it
    // would be late, but a person stays lost for so long at most: a picture that falls apart is worse than a late
    // frame.
    static constexpr std::int64_t longest_lost_us = 300'000;
    bool may_repair(double so_far, std::int64_t timestamp_us) const;
    void took(const TimedFrame& frame);

    double milliseconds() const { return milliseconds_; }
    const std::vector<TimedFrame>& frames() const { return frames_; }
    std::size_t late() const;       // frames that were
    std::size_t lowered() const;    // frames that got less than was asked for
    std::size_t alone() const;      // of these, those whose motion alone was coded
    std::size_t left_lost() const;  // frames that were not repaired for want of time

private:
    double usual() const;  // what seven of nine of them do not exceed; 0: not known yet

    double milliseconds_;
    int most_;
    std::vector<double> usual_;    // milliseconds that each of the last frames would have taken at the usual effort
    std::vector<double> repairs_;  // milliseconds that the last repairs took
    std::optional<std::int64_t> lost_since_us_;  // the first of the last frames that were left lost
    std::vector<TimedFrame> frames_;
};

// Median, 99th percentile and longest of the latencies, milliseconds; 0 without frames.
struct Latency {
    double median = 0, p99 = 0, longest = 0;
};
Latency latency_of(const std::vector<TimedFrame>& frames);

// "latency 21 ms in the median, ...", and where there is a deadline, how many frames were late or got less effort.
std::string deadline_summary(const Deadline& deadline);
nlohmann::json deadline_json(const Deadline& deadline);

// Where late meshes come from.
struct LateMeshes {
    bool piped = false;    // from standard input, where they may come faster than a camera's
    bool dropped = false;  // some are dropped already
};
// What helps where half of the frames were late or a tenth was not repaired, or more of them; empty if there is no
// need.
std::string deadline_warning(const Deadline& deadline, const LateMeshes& meshes);

}  // namespace htvm::app
