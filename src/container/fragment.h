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

// Consecutive frames, the first of which is one where decoding can start, or a part of such a range.
struct SampleRange {
    std::vector<StreamSample> samples;
    std::int64_t end_us = 0;  // when the last one's time ends
    bool begins = true;       // false: goes on with the range before, as its next part
    bool ends = true;         // false: the next one goes on with it
};

// Where a stream is cut.
struct SegmentCuts {
    double seconds = 2;       // a range ends at the first place where decoding can start that is so long behind its
                              // beginning; > 0
    double part_seconds = 0;  // it comes in parts that last no longer, unless a single frame does; 0: whole
    bool on_grid = false;  // it ends at the first such place at or behind a multiple of `seconds`, so that streams of
                           // the same frames, in which decoding can start there, are cut alike
    std::int64_t grid_us = 0;  // with on_grid: one of these multiples, from the stream's first frame; not behind it
};

// Cuts a stream where decoding can start.
class RangeCutter {
public:
    explicit RangeCutter(const SegmentCuts& cuts)
        : least_us_(static_cast<std::int64_t>(cuts.seconds * 1e6)),
          part_us_(static_cast<std::int64_t>(cuts.part_seconds * 1e6)),
          on_grid_(cuts.on_grid),
          grid_us_(cuts.grid_us) {}
    // Gives out the range before, when the next one begins.
    std::optional<SampleRange> push(StreamSample sample);
    std::optional<SampleRange> finish(std::uint64_t total_us);
    // What is not given out yet.
    const SampleRange& waiting() const { return range_; }

private:
    std::optional<SampleRange> cut(std::int64_t end_us, bool next_begins);
    bool is_long(std::int64_t time) const {
        return on_grid_ ? (time - grid_us_) / least_us_ > (begin_us_ - grid_us_) / least_us_
                        : time - begin_us_ >= least_us_;
    }
    std::int64_t least_us_, part_us_;
    bool on_grid_;
    std::int64_t grid_us_;
    std::int64_t begin_us_ = 0;  // of the whole range
    std::uint16_t entry_ = 0;    // likewise
    SampleRange range_;
};

// The boxes moof and mdat. sequence: counts fragments, from 1. with_groups: says what access points need by numbers of
// samples, as in a file that has them all. limit if they are 2 GiB or more.
Result<std::vector<std::uint8_t>> write_fragment(const SampleRange& range, std::uint32_t sequence,
                                                 std::int64_t sound_shift, bool with_groups);

// A piece of a stream for HTTP, or a part of one.
struct StreamSegment {
    bool begins = true;                     // false: a part that goes on with the one before
    bool ends = true;                       // false: a part with which the next one goes on
    std::int64_t begin_us = 0, end_us = 0;  // from the stream's first frame
    std::vector<std::uint8_t> map;          // ftyp and moov, with all that the first frame needs; many have the same;
                                            // empty where it does not begin
    std::vector<std::uint8_t> media;        // styp, moof, mdat; moof, mdat where it does not begin
};

class StreamSegmenter {
public:
    // With parts, one after another is the segment. What a part's tables cannot say, as its map was written before,
    // such as a picture of another size, is in whole packets until the next segment.
    explicit StreamSegmenter(const SegmentCuts& cuts) : cutter_(cuts), in_parts_(cuts.part_seconds > 0) {}
    // Takes every packet, in order. An index in front goes into the first map.
    Result<std::optional<StreamSegment>> push(Packet packet);
    // The rest: one segment, or two.
    Result<std::vector<StreamSegment>> finish();
    // Bytes of what it holds of the stream: what is not given out yet, and what later frames may need.
    std::size_t held_bytes() const;
    // How many kinds of tables it remembers, which only grow.
    std::size_t entries() const;

private:
    Result<std::optional<StreamSegment>> segment_of(std::optional<SampleRange> range);
    std::vector<std::uint8_t> map_of(const SampleRange& range);
    void choose_entries(const SampleRange& range);
    StreamSampler sampler_;
    RangeCutter cutter_;
    std::vector<std::uint8_t> index_;
    bool begun_ = false;
    std::uint32_t sequence_ = 0;
    std::optional<std::int64_t> first_sound_time_;
    bool has_pictures_ = false, has_sound_ = false;  // any came so far
    StreamSampler::EntryNumbers map_entries_;        // of the sampler's entries those that the map has, in its order
    bool in_parts_ = false;
};

}  // namespace htvm
