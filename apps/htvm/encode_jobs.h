// A capture in groups of frames that are encoded without knowing of each other, by several encoders at a time or by
// several machines. All begin with what follows from the capture's first frame, so that they write the same sequence
// header, and each with an I-frame. So the stream depends neither on how many are encoded at a time nor on how they are
// shared out: parts that are joined (StreamJoin) are the whole, byte by byte. Groups go from one I-frame to the next,
// or are chunks, so many of the capture.
#pragma once

#include <cstddef>
#include <vector>

#include "encode_pass.h"
#include "stream_file.h"

namespace htvm::app {

// Frames of a group: as many as from one I-frame to the next, but at least ten, as a sequence header comes with each,
// and at most sixty, so that a short capture makes work for several cores.
constexpr std::size_t least_of_group = 10, most_of_group = 60;
std::size_t frames_of_group(int key_interval);

struct Range {
    std::size_t begin = 0, end = 0;
    std::size_t count() const { return end - begin; }
};
// The frames of each group that so many make: of a job's groups alone, where there is one.
std::vector<Range> groups_of(const EncodePlan& plan, int key_interval, std::size_t frames);

// Encodes groups, several at a time, and writes them in their order. Where one fails, the others stop.
Result<void> encode_groups(const EncodePlan& plan, const EncoderOptions& settings, Capture& capture,
                           std::vector<Range> groups, StreamOutput& output, Summary& summary, RateReport& rate);

}  // namespace htvm::app
