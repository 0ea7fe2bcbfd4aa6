// A stream's packets as samples of the tracks of an .mp4 (docs/mp4.md): meshes, pictures, sound.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "htvm/audio.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/packet.hpp"
#include "htvm/running_time.hpp"
#include "htvm/texture.hpp"

namespace htvm {

enum class SampleTrack : std::uint8_t { meshes, pictures, sound };
inline constexpr std::size_t sample_tracks = 3;
// Ticks a second of the tracks' clocks.
inline constexpr std::array<std::uint32_t, sample_tracks> track_clocks = {1000000, 1000000, audio_samples_per_second};

// A packet whose bytes are in part samples of another track: what stands for it in the track of meshes.
inline constexpr std::size_t parted_header_bytes = 48;
inline constexpr std::array<std::uint8_t, 4> parted_sync = {'H', 'T', 'V', 'X'};

struct TrackSample {
    std::int64_t time = 0;       // from the first frame, in ticks of the track's clock
    std::uint32_t duration = 0;  // of sound: as Opus has it. Others last until the next
    std::uint16_t entry = 0;     // which of the track's sample entries it has
    bool sync = false;
    bool needs_others = false;  // although decoding can start there
    std::vector<std::uint8_t> bytes;
};

// A frame, and what comes with it up to the next frame.
struct StreamSample {
    std::uint32_t number = 1;                                    // of the sample in the track of meshes
    std::array<std::vector<TrackSample>, sample_tracks> tracks;  // of meshes exactly one
    // Where decoding can start (the mesh is a sync sample): the numbers of the samples before it whose packets it, or
    // what comes after it, needs, ascending; and these packets, the sequence header first.
    std::vector<std::uint32_t> needs;
    std::vector<std::uint8_t> needed_packets;
    const TrackSample& mesh() const { return tracks[0][0]; }
};

struct MeshEntry {
    std::vector<std::uint8_t> header;  // the packet of the sequence header in force
    std::uint16_t version = 0;         // of the stream
    bool operator==(const MeshEntry&) const = default;
};
struct PictureEntry {
    PictureCoder coder = PictureCoder::av1;
    std::uint32_t width = 0, height = 0;
    ColourMatrix matrix = ColourMatrix::bt709;
    bool full_range = false;
    std::vector<std::uint8_t> configuration;  // inside av1C or vpcC
    bool operator==(const PictureEntry&) const = default;
};
struct SoundEntry {
    std::uint8_t channels = 1;
    std::int16_t gain = 0;
    std::uint32_t skip = 0;  // samples that are not heard at its beginning
    bool operator==(const SoundEntry& other) const { return channels == other.channels && gain == other.gain; }
};
struct TrackEntries {
    std::vector<MeshEntry> meshes;
    std::vector<PictureEntry> pictures;
    std::vector<SoundEntry> sound;
};

// Timestamps may be anything: later times than this, which is 35 years, are this one.
inline constexpr std::uint64_t longest_us = std::uint64_t{1} << 50;

class StreamSampler {
public:
    // Takes every packet of a stream, in order. Gives out the frame before, when the next one begins. The index in
    // front is not part of any sample.
    std::optional<StreamSample> push(Packet packet);
    // The last one.
    std::optional<StreamSample> finish();
    const TrackEntries& entries() const { return entries_; }
    // The frame that is not complete, or nothing.
    const std::optional<StreamSample>& incomplete() const { return sample_; }
    // From here on pictures and sound become samples of their tracks if these entries fit them, and stay whole packets
    // in the track of meshes otherwise: the tables of what follows are written already. By track; of meshes all do.
    using EntryNumbers = std::array<std::vector<std::uint16_t>, sample_tracks>;
    void use_only(EntryNumbers entries) { usable_ = std::move(entries); }
    // Bytes of what it holds: the frame that is not complete, and what later ones may need.
    std::size_t held_bytes() const;
    std::uint64_t total_us() const { return std::min(time_.total_us(), longest_us); }

private:
    struct Stored {
        std::uint32_t sample;
        std::vector<std::uint8_t> bytes;
    };
    std::optional<StreamSample> complete();
    void add_frame(const Packet& packet);
    bool add_picture(const Packet& packet, std::span<const std::uint8_t> whole);
    bool add_sound(const Packet& packet, std::span<const std::uint8_t> whole);
    void find_needs(StreamSample& sample);
    bool is_usable(SampleTrack track, std::uint16_t entry) const;

    TrackEntries entries_;
    FrameNumbers numbers_;
    RunningTime time_;
    std::uint64_t places_ = 0;                // packets pushed
    std::map<std::uint64_t, Stored> stored_;  // that later frames may need, by their places
    std::size_t stored_bytes_ = 0;
    std::optional<EntryNumbers> usable_;  // nothing: all
    std::optional<StreamSample> sample_;  // that is not complete
    std::uint64_t begin_place_ = 0;       // of its first packet
    std::uint32_t samples_ = 0;
    bool has_frame_ = false;
    std::vector<std::uint64_t> closure_;  // of its frame, where decoding can start
    std::int64_t frame_timestamp_us_ = 0;
    std::optional<std::uint16_t> mesh_entry_, picture_entry_;
    std::optional<std::int64_t> sound_end_;
};

}  // namespace htvm
