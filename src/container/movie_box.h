// What an .mp4 says of its tracks: the boxes ftyp and moov (docs/mp4.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/box.h"
#include "container/stream_samples.h"

namespace htvm {

inline constexpr std::uint32_t mesh_sample_entry = four("htvm");
// Tools want pictures to have a size, also where there are none.
inline constexpr std::uint32_t mesh_track_side = 16;
inline constexpr std::uint32_t mesh_configuration = four("htvC");
inline constexpr std::uint32_t access_point_grouping = four("htva");

// Where the samples of a track lie that is not in fragments.
struct SampleTable {
    std::vector<std::uint32_t> sizes;
    std::vector<std::int64_t> times;
    std::vector<std::uint32_t> sync;  // numbers of the sync samples, from 1; those of sound all are
    struct Chunk {
        std::uint64_t offset = 0;  // from the beginning of the file
        std::uint32_t samples = 0;
        std::uint16_t entry = 0;
    };
    std::vector<Chunk> chunks;
    std::uint32_t last_duration = 0;
    // Which samples of meshes an access point needs (StreamSample::needs), one for each number in `sync`.
    std::vector<std::vector<std::uint32_t>> needs;
};

struct Movie {
    TrackEntries entries;
    // Tracks whose samples are in fragments have none of a table.
    std::array<SampleTable, sample_tracks> tables;
    bool fragmented = false;
    std::uint64_t total_us = 0;  // 0: not known
    // In the record of the configuration: the packet of the index in front, and what is needed before the first sample
    // (StreamSample::needed_packets; empty: the sequence header alone).
    std::vector<std::uint8_t> index, needed_packets;
    std::int64_t first_sound_time = 0, first_picture_time = 0;  // ticks of their clocks
    bool has(SampleTrack track) const {
        return track == SampleTrack::meshes ||
               (track == SampleTrack::pictures ? !entries.pictures.empty() : !entries.sound.empty());
    }
    // By how much decode times of sound in fragments are later than its times: they must not be below 0.
    std::int64_t sound_shift() const { return first_sound_time < 0 ? -first_sound_time : 0; }
};

std::vector<std::uint8_t> write_movie(const Movie& movie);

// The groups of access points by what they need, as boxes sgpd and sbgp: of a track, or of a fragment. groups: for each
// sample the numbers of those that it needs; nothing where decoding cannot start.
void write_access_groups(BoxWriter& out, std::span<const std::optional<std::vector<std::uint32_t>>> groups,
                         bool in_fragment);

}  // namespace htvm
