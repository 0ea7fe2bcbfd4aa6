// When a capture's frames were taken: times as people and rigs write them, and files that list them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

struct FrameRate {
    std::uint32_t numerator = 0, denominator = 1;  // numerator 0: not known
    double per_second() const { return static_cast<double>(numerator) / denominator; }
};

// "25", "29.97" (as written, in thousandths), "30000/1001". Above 0 and below 4e6.
Result<FrameRate> parse_frame_rate(std::string_view text);

// Microseconds of a time written in one of these ways:
//   1.25  1.25s      seconds (also 1.25 s)
//   1250ms  1250000us  (also with a space)
//   00:01:02.5       hours, minutes, seconds
//   00:01:02:12      timecode: the last number is the frame within the second, at the frame rate
//   00:01:02;12      drop-frame timecode: two numbers are left out of every minute but each tenth (four at 60)
// Timecode needs a frame rate; its seconds have as many frames as the rate rounds to.
Result<std::int64_t> parse_time(std::string_view text, const FrameRate& rate);

// "1.25", exact to the microsecond; parse_time() reads it back.
std::string time_text(std::int64_t microseconds);

struct FrameTimes {
    std::vector<std::uint64_t> numbers;  // of the frames, where the file gives them; else empty: in order
    std::vector<std::int64_t> microseconds;
};

// A file of times, one per frame, ascending:
//   CSV, with commas or tabs: a line per frame, with the time alone or "number,time". A first line may name the
//   columns: frame for the
//        number; timestamp, time, seconds or timecode, as parse_time() reads them, timestamp_us or timestamp_ms for the
//        time; others are passed over. Lines that begin with # are comments.
//   JSON: a list of times (numbers are seconds), or of objects with "timestamp" or "timestamp_us" and, where they give
//        it, "frame"; or an object with such a list as "timestamps", "timestamps_us" (numbers are microseconds) or
//        "frames", as `htvm info --json` prints them.
// Errors (bad_input) name the file and the line or entry.
Result<FrameTimes> read_frame_times(const std::filesystem::path& path, const FrameRate& rate);

// "frame,timestamp_us" and a line per frame, as read_frame_times() reads them.
std::string frame_times_csv(const FrameTimes& times);

}  // namespace htvm
