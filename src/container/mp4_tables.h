// Where the samples of an .mp4 lie: its tables and fragments, of a file that may be anything. Only the tracks that a
// stream can have are looked at. Of a file that is cut short there is what is whole.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "container/stream_samples.h"
#include "htvm/result.hpp"

namespace htvm {

// A file, or bytes in memory, read at any place.
struct FileBytes {
    std::uint64_t size = 0;
    // Fills all of `to` with what begins at the offset; false if it cannot.
    std::function<bool(std::uint64_t offset, std::span<std::uint8_t> to)> read;
};
// Bytes that outlive the source.
FileBytes source_of(std::span<const std::uint8_t> bytes);

struct Mp4Sample {
    std::uint64_t offset = 0, time = 0;  // time: when it is decoded, in ticks of its track
    std::uint32_t size = 0;
    std::uint32_t entry = 0;  // of the track's sample entries, from 0
    bool sync = true;
};

struct Mp4Track {
    SampleTrack kind = SampleTrack::meshes;
    std::uint32_t clock = 1;  // ticks a second
    // A track of meshes has the packets in the record of the configuration, for each sample entry.
    std::vector<std::vector<std::uint8_t>> configurations;
    std::vector<Mp4Sample> samples;  // each within the file
    bool is_cut = false;  // the end of the file takes the rest of its samples, or a part of the first of those
};

struct Mp4Tables {
    std::vector<Mp4Track> tracks;
    std::uint64_t missing_bytes = 0;  // that its last box has behind the end of the file: the file is cut short
};

inline constexpr std::size_t most_mp4_samples = std::size_t{1} << 24;  // of all tracks

// Whether a file that begins with these bytes may be an .mp4 or a piece of one; eight bytes tell.
bool looks_like_mp4(std::span<const std::uint8_t> beginning);

// The tracks of meshes, of AV1 or VP9, and of Opus. corrupt_stream if tables contradict themselves or the file, which
// includes what is missing of one that is cut short, or samples lie over each other; bad_input if there is no track of
// meshes; limit if there are more samples or larger tables than a stream has. All work and memory is in proportion to
// the file's bytes.
Result<Mp4Tables> read_mp4_tables(const FileBytes& file);

}  // namespace htvm
