// Streams as the commands read and write them: packets in a file, on standard input and output, or from and to a hub;
// an .mp4 is turned into packets and back here, so that no command knows of it.
// Also the options that limit what the commands accept as a stream.
#pragma once

#include <cstdint>
#include <deque>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "audio_track.h"
#include "container/mp4_file.h"
#include "htvm/decoder.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/stream_index.hpp"
#include "htvm/watcher.hpp"
#include "io/output_file.h"
#include "pacing.h"
#include "publishing.h"
#include "segment_folder.h"

namespace CLI {
class App;
}

namespace htvm {
class Mp4Packets;
}
namespace htvm::app {
class SegmentInput;
}

namespace htvm::app {

// Whether a file of that name is a stream, not a capture: .htvm, .mp4, or a playlist, .m3u8.
bool is_stream_name(const std::string& path);

class StreamInput {
public:
    // "-" is standard input, ws:// and wss:// a live stream, which ends where the program is interrupted, http:// and
    // https:// a playlist, of a live stream or a whole one. Larger packets are skipped.
    static Result<StreamInput> open(const std::string& path, std::uint64_t max_packet_bytes,
                                    const HubTrust& trust = {});
    // The next packet; nothing at the end.
    std::optional<Packet> next();
    // Why a hub does not show a live stream.
    const std::optional<Error>& refusal() const { return refusal_; }
    bool is_live() const;
    std::uint64_t damaged_bytes() const;
    std::uint64_t oversized_packets() const { return reader_.oversized_packets(); }
    // Bytes that a file which is cut short tells of and has not.
    std::uint64_t missing_bytes() const;
    // Among the damaged ones, those of pictures and sound whose other part lies there.
    std::uint64_t cut_off_bytes() const;
    // A playlist's segments that are gone or cut short, and what is wrong with the first of them, as a sentence
    // without its end.
    std::uint64_t lost_segments() const;
    std::string first_loss() const;
    // At the end: bytes of a truncated packet.
    std::size_t cut_short_bytes() const { return at_end_ ? reader_.pending_bytes() : 0; }
    // Bytes behind the last whole packet, at the end: what a program left that was killed while it wrote, or a machine
    // that lost its power.
    std::uint64_t torn_bytes() const {
        return at_end_ ? damaged_bytes() - damaged_before_ + reader_.pending_bytes() : 0;
    }
    // From now on these packets come first, then those of the file from this place on.
    void go_on_with(std::vector<Packet> first, std::uint64_t offset);

private:
    bool read_some();
    bool begin_standard();
    std::shared_ptr<std::ifstream> file_ = std::make_shared<std::ifstream>();
    std::optional<Watcher> watcher_;
    std::uint64_t max_packet_bytes_ = 0;
    std::optional<Error> refusal_;
    std::shared_ptr<Mp4Packets> mp4_;
    std::shared_ptr<SegmentInput> segments_;
    bool standard_ = false, at_end_ = false, begun_ = false;
    PacketReader reader_;
    std::uint64_t damaged_before_ = 0;  // when the last packet was read
    std::deque<Packet> first_;
};

// An error if the input, as far as it was read, was not whole. advice: the end of its sentence.
Result<void> check_whole(const StreamInput& input, const std::string& path,
                         const std::string& advice = "'htvm verify' tells more");

// Whether all is whole but for the end, which is torn or missing: the next function lets such a stream pass.
bool is_whole_but_for_end(const StreamInput& input);

// For commands that write the stream anew: likewise, but an end that is torn is left out, which a warning says.
Result<void> check_whole_but_for_end(const StreamInput& input, const std::string& path);

// A file is there once it is finished: until then its packets are in a file beside it, and what was there before stays.
// It then begins with an index; those at the end of streams are left out of it. An .mp4, or segments and their
// playlist, are made of these packets at the end. To a hub, packets go at once.
class StreamOutput {
public:
    // "-" is standard output, ws:// and wss:// a hub. Fails (bad_input) for a file whose ending is known to be another
    // kind's, or is none that streams have: .htvm, .mp4, .m3u8 or no ending at all.
    static Result<StreamOutput> open(const std::string& path, const PublishingOptions& publishing = {});
    // In the place of a stream that is there, whatever it is called.
    static Result<StreamOutput> replace(const std::string& path);
    // To a hub: frames wait until they are due by their timestamps, as those of files have to.
    void pace() { pacing_.emplace(); }
    // How long they have waited for that, milliseconds.
    double held_back() const { return held_back_; }
    // The hub, if there is one.
    Publishing* publishing() { return publishing_ ? &*publishing_ : nullptr; }
    // How an .mp4 is written, if it is one.
    void set(const Mp4Options& options) { mp4_options_ = options; }
    // How segments are cut, if it becomes some.
    void set(const SegmentOptions& options) { segment_options_ = options; }
    // Lays sound between the frames of the stream, in the place of its own. Before anything is written.
    void lay(AudioTrack audio) { audio_.emplace(std::move(audio)); }
    Result<void> write(const Packet& packet);
    // The bounds of the last frame, or of several, for the index.
    void add_bounds(const SpaceBounds& bounds) { indexer_.add(bounds); }
    // Those of all frames of a stream that goes into this one, if this packet of it is an index that tells them.
    void add_bounds_of(const Packet& packet);
    // Where there is no room for the index, the stream is complete without it, which a warning says.
    Result<void> finish();
    // Once it is finished: whether it begins with an index.
    bool has_index() const { return has_index_; }
    bool has_bounds() const { return indexer_.bounds().has_value(); }
    // A stream that ends early: what is left of it beside its place, cut where its last whole packet ends, as a full
    // disk may have taken a part of one. Without a name where it went to a pipe, or no frame is whole.
    struct Kept {
        std::string name;
        std::size_t frames = 0;
    };
    Kept keep();
    std::uint64_t bytes() const { return bytes_; }

private:
    static Result<StreamOutput> open_file(const std::string& path);
    bool is_indexed() const { return file_ && file_->is_file(); }
    Result<void> write_all(const std::vector<Packet>& packets);
    Result<void> write_one(const Packet& packet);
    Result<void> finish_mp4(const StreamIndex& index);
    Result<void> finish_segments(const StreamIndex& index);
    std::string playlist_;           // of the segments that file_ becomes; empty: it becomes none
    std::optional<OutputFile> mp4_;  // where file_ becomes one
    Mp4Options mp4_options_;
    SegmentOptions segment_options_;
    std::optional<OutputFile> file_;  // none: standard output, or a hub
    std::optional<Publishing> publishing_;
    std::optional<Pacing> pacing_;
    double held_back_ = 0;
    std::optional<AudioTrack> audio_;
    StreamIndexer indexer_;
    std::uint64_t bytes_ = 0;
    struct Written {
        std::uint64_t end = 0;
        bool is_frame = false;
    };
    std::vector<Written> written_;  // packets of a file, in order
    std::optional<Error> failed_;   // of the first write that did
    bool has_index_ = false;
};

// ---- What the commands accept as a stream ---------------------------------------------------------------------------

// Adds -M/--max-memory, --max-vertices, --max-triangles, --max-bones, --max-packet, which set the limits in the
// options.
void add_decoder_limits(CLI::App& command, DecoderOptions& limits);
// For commands that do not decode frames: --max-bones and --max-packet only.
void add_packet_limits(CLI::App& command, DecoderOptions& limits);

}  // namespace htvm::app
