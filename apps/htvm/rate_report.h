// What became of a bitrate or a target error, for the summary of htvm encode and its JSON; and the receiver's buffer,
// seen from the packets alone: what a stream needs to play without a pause over a line of constant rate.
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

// A leaky bucket: a frame's packets add their bits at once, at the frame's timestamp, and the line takes
// bits_per_second away; it must never hold more than bits_per_second * buffer_seconds. Every byte counts, packet
// headers as well; the index behind the last frame, of use in files only, does not.
class BufferModel {
public:
    // Both > 0.
    BufferModel(double bits_per_second, double buffer_seconds);
    // Packets in the order of the stream.
    void add(const Packet& packet);
    double capacity_bits() const { return capacity_; }
    double peak_percent() const { return 100 * peak_ / capacity_; }  // of the capacity
    std::uint32_t peak_frame() const { return peak_frame_; }         // number of the frame that filled it so far
    bool overflows() const { return overflows_; }
    std::uint32_t first_overflow() const { return first_overflow_; }  // number of the frame, where it overflows
    // Seconds of buffer that the stream needs at this rate.
    double seconds_needed() const { return peak_ / bits_per_second_; }

private:
    double bits_per_second_, capacity_;
    double held_ = 0, peak_ = 0;
    std::optional<std::int64_t> last_us_;
    bool overflows_ = false;
    std::uint32_t peak_frame_ = 0, first_overflow_ = 0;
};

// ---- What became of a bitrate or a target error ---------------------------------------------------------------------

struct RateReport {
    explicit RateReport(const EncoderOptions& options);
    bool rate_controlled() const { return bits_per_second > 0; }
    bool controlled() const { return bits_per_second > 0 || target_error > 0; }

    double bits_per_second = 0, buffer_seconds = 0, target_error = 0;  // as asked for; 0: not
    BufferModel buffer;
    std::vector<FrameCost> costs;      // one per frame of the capture, of 0 bits where it was dropped
    std::vector<std::size_t> dropped;  // frames of the capture
};

void add_coded(RateReport& report, const FrameCost& cost);
void add_dropped(RateReport& report);

struct QualityRange {
    double lowest = 0, mean = 0, highest = 0;
};
// Over the frames whose bits depend on it, that is all but P-frames and dropped ones.
QualityRange quality_range(const RateReport& report);

// bytes: of the stream; seconds: of the capture, dropped frames among them.
std::string rate_summary(const RateReport& report, std::uint64_t bytes, double seconds);
nlohmann::json rate_json(const RateReport& report, std::uint64_t bytes, double seconds);

}  // namespace htvm::app
