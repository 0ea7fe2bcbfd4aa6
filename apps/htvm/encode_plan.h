// What `htvm encode` was asked for, and the plan that follows. The command line is parsed once, into a request of
// numbers and enumerators; what contradicts itself is refused in one place; everything behind takes the plan, which is
// decided to the end and constant, and asks neither the parser nor a text again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "audio_track.h"
#include "command_line/capture.h"
#include "command_line/choice.h"
#include "encoder_options.h"
#include "htvm/encoder.hpp"
#include "htvm/result.hpp"
#include "picture_track.h"
#include "publishing.h"

namespace htvm::app {

// ---- What was asked for ---------------------------------------------------------------------------------------------

// What becomes of a frame that cannot be read or coded.
enum class BadFrames : std::uint8_t {
    stop,    // the run ends with its error
    skip,    // it is left out
    repeat,  // the frame before stands in
};
inline constexpr std::array bad_frame_uses = {
    Choice<BadFrames>{"stop", BadFrames::stop},
    Choice<BadFrames>{"skip", BadFrames::skip},
    Choice<BadFrames>{"repeat", BadFrames::repeat},
};

// One of several jobs that together encode a capture (encode_jobs.h).
struct Job {
    std::size_t number = 0, of = 0;  // 1 of 8 to 8 of 8; of 0: all of the capture
};

struct EncodeRequest {
    CaptureOptions capture;
    EncodingOptions encoding;
    std::string output;            // a file, - for standard output, or a hub's address
    PublishingOptions publishing;  // where the output is a hub
    AudioOptions audio;
    TexturePictureOptions pictures;  // where the capture's images go into the stream
    bool drop_late = false;      // of standard input: drops the oldest of frames that come faster than they are encoded
    double deadline = 0;         // milliseconds from a mesh's arrival to its packet; 0: none
    std::string effort_log;      // file: writes what was decided of each frame; empty: nowhere
    std::string repeat_efforts;  // file: takes the efforts of frames from there; empty: they are decided
    BadFrames bad_frames = BadFrames::stop;
    bool fill = false;         // repeats the frame before in the place of missing ones
    bool json = false;         // tells what was made as JSON on standard output
    bool keep_partial = true;  // of an encoding that ends early
    std::size_t chunks = 1;    // that the capture is cut into; 0: one per core
    std::size_t jobs = 0;      // groups, from one I-frame to the next, at a time; 0: not in such groups
    Job job;
    // Several qualities of the same capture, side by side (encode_ladder.h): web, or rates or qualities with commas
    // between; empty: one.
    std::string ladder;
    double segment_seconds = 2;  // where the output is a playlist: that a segment lasts at least
};

// Why the request cannot be carried out, whatever the capture is: a sentence that begins with the option. Empty if
// nothing contradicts. Options that the parser takes only with or without another one (CLI11's needs and excludes,
// which the help names) are not looked at again.
std::string contradiction_in(const EncodeRequest& request);

// ---- What follows from it -------------------------------------------------------------------------------------------

// Height of the floor on the axis that is up.
struct Floor {
    bool is_lowest = false;        // where the first frame's lowest vertex is
    std::optional<double> metres;  // if not, there; nothing: it is not known
};

struct EncodePlan {
    CaptureOptions capture;  // texture_as: what was asked for, until the capture is open and decides it
    bool is_piped = false;   // the capture comes on standard input
    Destination output;
    PublishingOptions publishing;  // where the output is a hub
    AudioOptions audio;
    TexturePictureOptions pictures;  // where the capture's images go into the stream
    std::optional<int> speed_ahead;  // of pictures coded by those that follow (PictureTrack), where nobody waits

    std::optional<FilmWindow> film = {};  // where the texture is one camera's film, once the capture is open: what of
                                          // it goes into the stream at first

    EncoderOptions encoder;  // all but what the capture says: its rate, unit, axes, skeleton, radii, texture
    int access_interval_with_pictures = 0;  // frames, in place of the encoder's, where pictures are drawn anew
    Floor floor;
    std::optional<double> front;  // degrees around the axis that is up; none: not known
    std::string radii_file;       // empty: none

    int fewest_passes = 1, most_passes = 1;  // over the capture, until the bitrate is met

    double deadline = 0;         // milliseconds; 0: none
    bool is_timed = false;       // frames' latency is counted, and told at the end
    std::string effort_log;      // file; empty: none is written
    std::string repeat_efforts;  // file; empty: none is read
    bool drops_late = false;     // frames on standard input that come too fast

    BadFrames bad_frames = BadFrames::stop;
    bool fill = false;  // repeats the frame before in the place of missing ones
    bool json = false;
    bool keep_partial = true;  // of an encoding that ends early
    std::size_t chunks = 1;    // of equal length
    std::size_t jobs = 0;      // groups at a time
    Job job;
    double segment_seconds = 2;  // where the output is a playlist
    // Whether the capture is encoded in groups of frames that do not know of each other.
    bool in_groups() const { return chunks != 1 || jobs > 0 || job.of > 0; }
};

// bad_input if the request contradicts itself, or has a text that is no number.
Result<EncodePlan> plan_of(const EncodeRequest& request);

}  // namespace htvm::app
