// Samples as a fragment of an .mp4 (boxes moof and mdat), and streams as segments for HTTP: each begins where decoding
// can start and comes with the initialisation that it needs. docs/mp4.md.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/movie_box.h"
#include "container/stream_samples.h"

namespace htvm {

// Consecutive frames, the first of which is one where decoding can start.
struct SampleRange {
    std::vector<StreamSample> samples;
    std::int64_t end_us = 0;  // when the last one's time ends
};

// Cuts a stream where decoding can start.
class RangeCutter {
public:
    // A range ends at the first such place that is at least so long behind its beginning.
    // on_grid: or at the first one at or behind a multiple of so long, so that streams of the same frames, in which
    // decoding can start there, are cut alike.
    explicit RangeCutter(double seconds, bool on_grid = false)
        : least_us_(static_cast<std::int64_t>(seconds * 1e6)), on_grid_(on_grid) {}
    // Gives out the range before, when the next one begins.
    std::optional<SampleRange> push(StreamSample sample);
    std::optional<SampleRange> finish(std::uint64_t total_us);

private:
    std::int64_t least_us_;
    bool on_grid_;
    SampleRange range_;
};

// The boxes moof and mdat. sequence: counts fragments, from 1. with_groups: says what access points need by numbers of
// samples, as in a file that has them all. limit if they are 2 GiB or more.
Result<std::vector<std::uint8_t>> write_fragment(const SampleRange& range, std::uint32_t sequence,
                                                 std::int64_t sound_shift, bool with_groups);

// A piece of a stream for HTTP.
struct StreamSegment {
    std::int64_t begin_us = 0, end_us = 0;  // from the stream's first frame
    std::vector<std::uint8_t> map;          // ftyp and moov, with all that the first frame needs; many have the same
    std::vector<std::uint8_t> media;        // styp, moof, mdat
};

class StreamSegmenter {
public:
    explicit StreamSegmenter(double seconds, bool on_grid = false) : cutter_(seconds, on_grid) {}
    // Takes every packet, in order. An index in front goes into the first map.
    Result<std::optional<StreamSegment>> push(Packet packet);
    // The rest: one segment, or two.
    Result<std::vector<StreamSegment>> finish();

private:
    Result<std::optional<StreamSegment>> segment_of(std::optional<SampleRange> range);
    StreamSampler sampler_;
    RangeCutter cutter_;
    std::vector<std::uint8_t> index_;
    bool begun_ = false;
    std::uint32_t sequence_ = 0;
    std::optional<std::int64_t> first_sound_time_;
    bool has_pictures_ = false, has_sound_ = false;  // any came so far
};

}  // namespace htvm
