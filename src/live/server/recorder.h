// Keeps live streams as files. Each session of a stream becomes NAME-YYYYMMDD-HHMMSS.htvm (UTC), begun with a frame
// that can be decoded by itself.
//
// A file grows under its final name: it can be watched while it is recorded, and if the program ends in the middle, it
// holds every packet up to the last one that was written whole, and nothing has to be renamed. If the machine does, by
// a power cut, it may lack those of the last seconds. What it lacks then besides is the index in front. Once a
// recording has ended, the file is replaced by one that begins with the index, and not before the disk has all of that.
//
// Each recording has a thread of its own that writes, so a slow disk holds up neither the server nor the other
// recordings. What waits for the disk is bounded; what does not fit is dropped up to the next frame that can be decoded
// from what is in the file, and counted.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/client/broadcast.h"
#include "live/hub/event.h"

namespace htvm::live {

struct RecorderOptions {
    std::filesystem::path folder;
    // After this a stream's next file begins, at a frame that can be decoded by itself; 0: one file a session.
    std::chrono::milliseconds file_length{0};
    std::size_t waiting_bytes = std::size_t{64} << 20;  // for the disk, of one stream
    std::chrono::milliseconds sync{2000};               // what was written is on the disk after this
    std::size_t streams = 300;                          // at once, those included whose files are being finished
    std::chrono::milliseconds retry{60000};             // after a fault, such as a full disk, until it is tried again
};

struct RecorderCounters {
    std::uint64_t streams = 0;  // being recorded
    std::uint64_t files = 0;    // begun
    std::uint64_t packets = 0, bytes = 0;
    std::uint64_t dropped_frames = 0;  // the disk was too slow
    std::uint64_t faults = 0;          // files that could not begin, or ended early, and streams above the limit
};

class Recorder {
public:
    using Clock = Broadcast::Clock;

    // bad_input: there is no such folder, or nothing can be written there.
    static Result<Recorder> open(const RecorderOptions& options);
    Recorder(Recorder&&) noexcept;
    Recorder& operator=(Recorder&&) noexcept;
    // Like finish().
    ~Recorder();

    // The next packet that went to the viewers of this stream. time: of the system clock, for the file's name. Returns
    // whether a frame that can be decoded by itself is wanted, since a file can only begin with one, and where frames
    // were dropped goes on the sooner.
    bool record(const std::string& stream, const SharedPacket& packet, Clock::time_point now,
                std::chrono::system_clock::time_point time);
    // All have ended; waits until their files are finished.
    void finish();
    // The stream has ended; its file is finished in the background.
    void end(const std::string& stream);

    RecorderCounters counters() const;
    // What happened since the last call.
    std::vector<Event> new_events();

private:
    struct State;
    explicit Recorder(const RecorderOptions& options);
    std::unique_ptr<State> state_;
};

// The name of a file that begins at this time, without ".htvm". In the stream's name letters, digits, "-", "_", "." and
// bytes above 127 stay, others become %XX; at most 200 bytes of it are used.
std::string recording_name(const std::string& stream, std::chrono::system_clock::time_point time);

}  // namespace htvm::live
