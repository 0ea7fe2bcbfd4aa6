// A run of an encoder over frames of a capture, with what becomes of those that are bad, missing or dropped.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "command_line/layer_table.h"
#include "deadline.h"
#include "effort_log.h"
#include "encode_plan.h"
#include "htvm/encoder.hpp"
#include "picture_track.h"
#include "rate_report.h"
#include "surface/open_border.h"

namespace htvm::app {

// A frame as --json lists it at the end. As JSON from the start, which is all names, hours of frames would not fit.
struct ListedFrame {
    FrameInfo info;
    std::optional<double> quality;  // under rate control
};

struct Summary {
    TotalsByType totals;
    double encode_seconds = 0;
    std::size_t without_triangles = 0;
    // The first mesh that has triangles.
    internal::Openness first_surface = internal::Openness::closed;
    // The capture's frames, coded or not: how many, and the times of the first and the last.
    std::size_t frames = 0;
    std::int64_t first_us = 0, last_us = 0;
    // Frames that are not as captured.
    std::size_t left_out = 0, repeated = 0;  // bad ones
    std::size_t missing = 0, filled = 0;     // by the numbers of the files
    std::optional<SpaceBounds> bounds;       // of the decoded meshes
    PictureTotals pictures;
    std::vector<ListedFrame> list;  // with --json
};
// Adds the frames behind those summed up so far; their own numbers begin with 0.
void add(Summary& summary, Summary behind);

// Warnings of single frames, from any thread: of hundreds of a kind the first few tell enough.
class FrameWarnings {
public:
    enum Kind : std::uint8_t { bad, missing, dropped, slower_line, large };
    void tell(Kind kind, const std::string& line);

private:
    std::mutex mutex_;
    std::array<std::size_t, 5> told_{};
};

struct Pass {
    const EncodePlan& plan;
    Capture& capture;
    Encoder& encoder;
    std::function<Result<void>(Packet)> write;     // empty: the packets go nowhere, as of a first pass of several
    std::function<void(const std::string&)> step;  // after each frame, with what can be said of it
    std::function<bool()> is_stopped;              // asked before each frame
    FrameWarnings* warnings;                       // null: what is wrong with the capture was said before
    Summary& summary;
    RateReport& rate;
    std::function<bool()> wants_key_frame = {};  // asked before each frame: whether it should be an I-frame
    // Asked before each frame: whether decoding should be able to start there.
    std::function<bool(std::int64_t timestamp_us)> wants_access = {};
    std::function<std::optional<double>()> bitrate = {};  // asked after each frame: bits per second, where it changes
    std::function<double()> held_back = [] { return 0.0; };  // milliseconds so far that packets waited until due
    Deadline* deadline = nullptr;  // how much is searched for each frame, and how long that takes; null: not counted
    std::vector<LoggedFrame> efforts = {};    // of each frame, in place of what the deadline says; empty: as that says
    EffortLogWriter* effort_log = nullptr;    // takes what was decided of each frame; null: nobody asked for it
    PictureTrack* pictures = nullptr;         // of the frames; null: none go into the stream
    std::optional<FilmFraming> framing = {};  // of one camera's film, once the first frame has come
    double slower_line = 0;      // the bitrate that the line carries at present, where it is below the one asked for
    bool saw_triangles = false;  // in a frame so far, or of those before
    bool may_go_on = true;  // false: what went wrong is of no single frame, and those behind it would fare no better
    // The frame that stands in for others, where one may have to: the last one coded, or the one before the first.
    std::optional<Mesh> last = {};
    std::optional<Pose> last_pose = {};
    std::shared_ptr<const TexturedMesh> last_textured = {};
};

// The pictures of a capture that keeps them, as the plan says; nothing for others. quality: in place of the plan's, or
// of what a bitrate leaves them.
Result<std::optional<PictureTrack>> picture_track(const EncodePlan& plan, const Capture& capture,
                                                  const EncoderOptions& settings,
                                                  std::optional<double> quality = std::nullopt);

// A pass whose packets go to the hub asks it for key frames, and follows its line.
void follow_hub(Pass& pass, Publishing& hub);

// bad_input where nothing was coded, or nothing but frames without vertices; of a whole capture.
Result<void> check_something_was_coded(const EncodePlan& plan, const Summary& summary);

// Ends with an error of any kind where it is stopped.
Result<void> encode_frames(Pass& pass);
// Several passes over the same capture, which is read once: each frame goes into the first one first.
Result<void> encode_frames(std::span<Pass* const> passes);
// The end of the stream, also of one that ended early.
Result<void> finish(Pass& pass);

}  // namespace htvm::app
