// The outcome of a bitrate or a target error, for the summary of htvm encode and its JSON; and the receiver's buffer,
// computed from the packets alone: what a stream needs to play without a pause over a line of constant rate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "htvm/encoder.hpp"
#include "htvm/packet.hpp"

namespace htvm::app {

// A leaky bucket: the packets of a frame add their bits at once, at the frame's timestamp, and the line removes
// bits_per_second; it must never hold more than bits_per_second * buffer_seconds. Every byte counts, including packet
// headers. Only the index after the last frame, which is used in files only, does not.
class BufferModel {
public:
    // Both must be > 0.
    BufferModel(double bits_per_second, double buffer_seconds);
    // Packets in the order of the stream.
    void add(const Packet& packet);
    double peak_percent() const { return 100 * peak_ / capacity_; }  // percent of the capacity
    std::uint32_t peak_frame() const {
        return peak_frame_;
    }  // number of the frame at which the buffer was
       // fullest so far
    bool overflows() const { return overflows_; }
    std::uint32_t first_overflow() const {
        return first_overflow_;
    }  // number of the first frame that overflows it, if
       // any
    // The seconds of buffer that the stream needs at this rate.
    double seconds_needed() const { return peak_ / bits_per_second_; }

private:
    double bits_per_second_, capacity_;
    double held_ = 0, peak_ = 0;
    std::optional<std::int64_t> last_us_;
    bool overflows_ = false;
    std::uint32_t peak_frame_ = 0, first_overflow_ = 0;
};

// ---- The outcome of a bitrate or a target error ---------------------------------------------------------------------

struct RateReport {
    explicit RateReport(const EncoderOptions& options);
    bool rate_controlled() const { return bits_per_second > 0; }
    bool controlled() const { return bits_per_second > 0 || target_error > 0; }

    double bits_per_second = 0, buffer_seconds = 0, target_error = 0;  // as asked for; 0: not asked for
    BufferModel buffer;
    std::vector<FrameCost> costs;      // one per frame of the capture, with 0 bits if it was dropped
    std::vector<std::size_t> dropped;  // indices of frames of the capture
    bool line_was_slower = false;      // so that less was made than asked for
    bool is_shared = false;            // meshes and pictures share it over several passes, so that it is to be met
    bool is_finest = false;            // then: both are as fine as they get
    bool moved_by_choice = false;      // P-frames are chosen where they fit, not only where nothing else does
};

void add_coded(RateReport& report, const FrameCost& cost);
void add_dropped(RateReport& report);

struct QualityRange {
    double lowest = 0, mean = 0, highest = 0;
};
// Over the frames whose size depends on quality: all except P-frames and dropped ones.
QualityRange quality_range(const RateReport& report);

// What the rate does to the frames, beyond a lower quality.
struct RateStrain {
    std::size_t lowest_quality = 0;  // frames at the lowest quality there is
    std::size_t moved_alone = 0;     // frames for which the motion alone is sent: P-frames, T-frames without the rest
    std::size_t dropped = 0;
    bool any() const { return lowest_quality + moved_alone + dropped > 0; }
};
RateStrain rate_strain(const RateReport& report);
// A sentence with the numbers and what helps; empty if there is no strain.
std::string rate_warning(const RateReport& report);
// Why the rate counts as missed: all bits are more than a third above it, as of a short capture, whose first frame the
// buffer takes, or of one that does not get smaller; where it is shared, more than rate_tolerance above it or, unless
// all is at its finest, below. Empty: it is not missed.
std::string missed_rate(const RateReport& report, std::uint64_t bytes, double seconds);

// bytes: of the stream; seconds: of the capture, including dropped frames.
std::string rate_summary(const RateReport& report, std::uint64_t bytes, double seconds);
nlohmann::json rate_json(const RateReport& report, std::uint64_t bytes, double seconds);

}  // namespace htvm::app
