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
//   1250ms  1250000us  1250000000ns  (also with a space)
//   1700000000123    a number too large for seconds of this age is milliseconds, microseconds or nanoseconds since 1970
//   00:01:02.5       hours, minutes, seconds
//   00:01:02:12      timecode: the last number is the frame within the second, at the frame rate
//   00:01:02;12      drop-frame timecode: two numbers are left out of every minute but each tenth (four at 60)
//   2024-01-31T12:05:01.123Z   date and time (also with a space for the T, without dashes and colons, with an offset
//                    such as +01:00), as microseconds since 1970; without Z or offset as if it were UTC
// Timecode needs a frame rate; its seconds have as many frames as the rate rounds to.
Result<std::int64_t> parse_time(std::string_view text, const FrameRate& rate);

// "1.25", exact to the microsecond; parse_time() reads it back.
std::string time_text(std::int64_t microseconds);

struct FrameTimes {
    std::vector<std::uint64_t> numbers;  // of the frames, where the file gives them; else empty: in order
    std::vector<std::int64_t> microseconds;
};

// Times, one per frame, ascending:
//   CSV, with tabs, semicolons or commas: a line per frame, with the time alone or "number,time" (between two plain
//        numbers a space will do). A first line may name the columns, in any case: frame, number or index for the
//        number; timestamp, time, seconds, timecode or date for the time, as parse_time() reads them, or with a unit
//        such as timestamp_us, time_ms, "Time [s]" or nanoseconds; others are passed over. Lines that begin with # are
//        comments. Cells may be in quotes; with tabs or semicolons decimal commas are points.
//   JSON: a list of times (numbers are seconds), or of objects with "timestamp" or "timestamp_us", "_ms" or "_ns" and,
//        where they give it, "frame"; or an object with such a list as "timestamps", "timestamps_us" (numbers are
//        microseconds; also _ms, _ns) or "frames", as `htvm info --json` prints them.
// A byte order mark is passed over. Errors (bad_input) name the line or entry.
Result<FrameTimes> parse_frame_times(std::string_view text, const FrameRate& rate);

// The same of a file; errors begin with its name.
Result<FrameTimes> read_frame_times(const std::filesystem::path& path, const FrameRate& rate);

// "frame,timestamp_us" and a line per frame, as read_frame_times() reads them.
std::string frame_times_csv(const FrameTimes& times);

}  // namespace htvm
