// A playlist's segments, one after another, as the packets of their stream: files beside each other, or what a web
// server has (http, https), which may be a live stream. A segment that is gone or cut short is left out, and what comes
// behind it begins with what its map has, as far as that did not come before.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "container/mp4_packets.h"
#include "container/playlist.h"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "publishing.h"

namespace htvm::app {

// What is at a name that a playlist has.
struct FetchedFile {
    std::vector<std::uint8_t> bytes{};
    std::string trouble{};  // not empty: it is not there, for this reason, which goes on after "names X, which"
    std::string place{};    // where it is, for names that it has itself
};

struct SegmentSource {
    // A file that one at `base` names; base: empty for the playlist that was asked for.
    std::function<FetchedFile(const std::string& base, const std::string& name, std::size_t most_bytes)> fetch;
    bool waits = false;  // for what is not there yet
};

class SegmentInput {
public:
    // A playlist, or a list of playlists, of which the finest is read. A file's name, or an address. Larger packets
    // are left out.
    static Result<SegmentInput> open(const std::string& place, std::uint64_t max_packet_bytes, const HubTrust& trust);
    // Packets of the next frame, for a PacketReader; nothing at the end, or where the program is interrupted. A live
    // stream begins with the oldest segment that its list has, and is waited for.
    std::optional<std::vector<std::uint8_t>> next();
    bool is_live() const { return source_.waits && !began_with_end_; }
    std::uint64_t damaged_bytes() const { return damaged_ + (packets_ ? packets_->damaged_bytes() : 0); }
    // Segments that are left out, all or in part; and of the first what is wrong with it.
    std::uint64_t lost_segments() const { return lost_; }
    const std::string& first_loss() const { return first_loss_; }
    // Why nothing more comes, if it is not the end.
    const std::optional<Error>& refusal() const { return refusal_; }

private:
    bool open_next();
    bool wait_for_more();
    bool begin(const PlaylistSegment& segment);
    void lose(const std::string& name, const std::string& what);
    void end_segment();
    std::vector<std::uint8_t> without_repeats(std::vector<std::uint8_t> bytes);
    bool is_known(const Packet& packet);
    Result<void> read_list(const FetchedFile& file);

    SegmentSource source_;
    std::string shown_, list_name_, list_place_;  // of the playlist: for people; as it was asked for; where it is
    std::uint64_t max_packet_bytes_ = 0;
    Playlist list_;
    std::uint64_t next_number_ = 0;
    bool began_with_end_ = false;
    int failures_ = 0;           // of reading the list anew, in a row
    double waited_ = 0;          // seconds, since there was a new segment
    std::string segment_, map_;  // names
    std::vector<std::uint8_t> map_bytes_;
    std::shared_ptr<std::vector<std::uint8_t>> bytes_;  // which packets_ reads
    std::optional<Mp4Packets> packets_;                 // of the segment that is being read
    bool anew_ = true;                                  // the next segment begins with what its map has
    bool filters_ = false;                              // packets that came before are left out of what comes next
    std::uint64_t damaged_ = 0, lost_ = 0;
    std::string first_loss_;
    std::optional<Error> refusal_;
    std::unordered_set<std::uint64_t> known_, known_before_;  // packets that others may need, since the last two
                                                              // I-frames
};

}  // namespace htvm::app
