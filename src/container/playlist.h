// Playlists of HLS (RFC 8216) for a stream's segments (fragment.h): what players and caches read.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

// A part of a segment, which can be fetched before the segment is whole.
struct PlaylistPart {
    std::string uri;
    double seconds = 0;
    bool independent = false;  // decoding can start with it
};

struct PlaylistSegment {
    std::string uri;      // relative to the playlist
    std::string map_uri;  // of what is needed before its first frame
    double seconds = 0;
    bool discontinuity = false;         // its times begin anew: another session
    std::vector<PlaylistPart> parts{};  // of a segment that is new enough
    // When its first frame came, milliseconds since 1970; 0: not told.
    std::int64_t unix_ms = 0;
};

enum class PlaylistKind : std::uint8_t {
    whole,   // of a stream that is over: it does not change
    event,   // of a live stream, from its beginning: segments are added
    window,  // of a live stream: segments are added, and the oldest taken away
};

struct Playlist {
    PlaylistKind kind = PlaylistKind::whole;
    std::uint64_t first_number = 0;  // of the first segment that is listed
    double target_seconds = 1;       // that no segment is longer than, when rounded
    std::vector<PlaylistSegment> segments;
    bool has_end = true;  // no segment follows

    // Written, and passed over when read:
    std::uint64_t first_discontinuity = 0;  // how many there were before the first segment that is listed
    bool waits = false;                     // who asks for what comes next has the answer once it is there
    double part_seconds = 0;                // that no part is longer than; 0: there are none
    PlaylistSegment next{};                 // the segment that is not whole: its map and the parts that are there
    std::string hint{};                     // the part that comes next
};

std::string write_playlist(const Playlist& playlist);
// corrupt_stream if it is no playlist of segments with maps, or a number in it is none. unsupported: a tag asks for
// what is not done here: encryption, parts of files, or a list of playlists.
Result<Playlist> read_playlist(std::string_view text);

// One of several qualities of the same stream, in a list of playlists (a "master playlist").
struct PlaylistVariant {
    std::string uri;
    std::uint64_t bits_per_second = 0;    // of the segment that takes most
    std::uint64_t average = 0;            // of all
    std::uint32_t width = 0, height = 0;  // of its pictures; 0: there are none
    std::string codecs;                   // of its tracks, with commas between
    double frames_per_second = 0;         // 0: not told
};
std::string write_variants(const std::vector<PlaylistVariant>& variants);
// Those that a text lists, with what is told of them; none where it is no list of playlists.
std::vector<PlaylistVariant> read_variants(std::string_view text);

// The codecs of the tracks that a map has (the boxes ftyp and moov), as a list of playlists names them; empty if it has
// none.
std::string codecs_of(std::span<const std::uint8_t> map);

// The size of its pictures; 0 where it has none.
struct PictureSize {
    std::uint32_t width = 0, height = 0;
};
PictureSize picture_size_of(std::span<const std::uint8_t> map);

// Whether an URI of a playlist names a file beside it, or in a folder below: nothing else of a file system is to be
// read because a playlist says so.
bool is_name_below(std::string_view uri);

// A name for these bytes alone, of 24 letters: other bytes have another, but for one chance in 2^64.
std::string name_by_content(std::span<const std::uint8_t> bytes);

}  // namespace htvm
