// A stream as a folder of segments and a playlist (HLS), which any web server and cache can hand out.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "container/fragment.h"
#include "container/playlist.h"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

bool is_playlist_name(const std::string& path);

struct SegmentOptions {
    double seconds = 2;         // that a segment lasts at least: it ends where players can start
    bool on_grid = false;       // or at the first such place behind a multiple of that: in all rungs of a ladder alike
    bool is_live = false;       // the playlist is written anew with every segment
    double window_seconds = 0;  // of a live stream, that are kept; 0: all
};

// Files are written whole or not at all; the playlist names a segment once it is there.
class SegmentFolder {
public:
    // The playlist's name; its folder must be there.
    SegmentFolder(std::filesystem::path playlist, const SegmentOptions& options);
    // Takes every packet of a stream, in order.
    Result<void> write(Packet packet);
    // The end of the stream: nothing follows, and what is there stays.
    Result<void> finish();
    std::uint64_t bytes() const { return bytes_; }  // of all segments and maps
    std::size_t segments() const { return written_; }

private:
    Result<void> add(const StreamSegment& segment);
    void drop_old();
    Result<void> write_list();
    std::filesystem::path path_;
    SegmentOptions options_;
    StreamSegmenter segmenter_;
    Playlist list_;
    std::deque<PlaylistSegment> leaving_;  // no longer listed, but who has the last playlist may still ask for them
    std::set<std::string> maps_;           // that are there
    std::uint64_t bytes_ = 0;
    std::size_t written_ = 0;
};

}  // namespace htvm::app
