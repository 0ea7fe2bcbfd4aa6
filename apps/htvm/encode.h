// What the command encode does, for others too.
#pragma once

#include <cstddef>
#include <string>

#include "audio_track.h"
#include "command_line/capture.h"
#include "encoder_options.h"
#include "htvm/result.hpp"
#include "picture_track.h"
#include "publishing.h"

namespace htvm::app {

// One of several jobs that together encode a capture (encode_jobs.h).
struct Job {
    std::size_t number = 0, of = 0;  // 1 of 8 to 8 of 8
};

struct EncodeOptions {
    CaptureOptions capture;
    EncodingOptions encoding;
    std::string output;
    PublishingOptions publishing;  // where the output is a hub
    AudioOptions audio;
    TexturePictureOptions pictures;  // where the capture's images go into the stream
    bool drop_late = false;      // of standard input: drops the oldest of frames that come faster than they are encoded
    double deadline = 0;         // milliseconds from a mesh's arrival to its packet; 0: none
    std::string effort_log;      // file: writes what was decided of each frame; empty: nowhere
    std::string repeat_efforts;  // file: takes the efforts of frames from there; empty: they are decided
    std::string on_bad_frame = "stop";  // or skip, repeat
    bool fill = false;                  // repeats the frame before in the place of missing ones
    bool json = false;
    bool keep_partial = true;  // of an encoding that ends early
    std::size_t chunks = 1;    // that the capture is cut into; 0: one per core
    std::size_t jobs = 0;      // at a time; 0: not in groups from one I-frame to the next
    Job job;                   // of 0: all of the capture
    // Whether the capture is encoded in groups of frames that do not know of each other.
    bool in_groups() const { return chunks != 1 || jobs > 0 || job.of > 0; }
};

// Tells of it as the command does.
Result<void> encode(const EncodeOptions& options);

}  // namespace htvm::app
