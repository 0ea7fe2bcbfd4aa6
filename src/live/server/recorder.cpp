#include "live/server/recorder.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <ctime>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "htvm/stream_index.hpp"
#include "htvm/texture.hpp"
#include "io/output_file.h"

namespace htvm::live {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// What the threads share.
struct Shared {
    std::atomic<std::uint64_t> files = 0, packets = 0, bytes = 0, dropped_frames = 0, faults = 0;
    std::mutex mutex;
    std::vector<Event> events;

    void tell(Event event) {
        const std::lock_guard lock(mutex);
        events.push_back(std::move(event));
    }
    // count: whether it is a fault that the counter tells.
    void warn(const std::string& name, const std::string& stream, const std::string& text, bool fault = true) {
        if (fault) ++faults;
        tell({.name = name, .text = text, .stream = stream, .warning = true});
    }
};

// ---- A file that grows ----------------------------------------------------------------------------------------------

// Waits until the disk has the name of a new file; what is in it is another matter. Not every file system can.
void sync_name(const fs::path& path) {
    const int folder = ::open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    ::fsync(folder);
    ::close(folder);
}

class GrowingFile {
public:
    // path: without a number that may be needed and without ".htvm".
    static Result<GrowingFile> begin(const fs::path& path) {
        constexpr int most_of_a_second = 100;
        for (int number = 1; number <= most_of_a_second; ++number) {
            GrowingFile out;
            out.path_ = path.string() + (number > 1 ? "-" + std::to_string(number) : "") + ".htvm";
            out.file_.reset(std::fopen(out.path_.c_str(), "wbx"));
            if (!out.file_ && errno == EEXIST) continue;
            if (!out.file_) return tl::unexpected(write_error(out.path_.string(), errno));
            // Each packet goes to the system at once, so nothing of it is lost if this program ends.
            std::setvbuf(out.file_.get(), nullptr, _IONBF, 0);
            sync_name(out.path_);
            return out;
        }
        return fail(ErrorKind::limit, "too many files begin in the same second");
    }

    const fs::path& path() const { return path_; }
    std::uint64_t bytes() const { return bytes_; }

    Result<void> write(const LivePacket& packet) {
        indexer_.add(packet_of(packet), bytes_);
        if (std::fwrite(packet.bytes.data(), 1, packet.bytes.size(), file_.get()) != packet.bytes.size())
            return tl::unexpected(write_error(path_.string(), errno));
        bytes_ += packet.bytes.size();
        return {};
    }

    // Waits until the disk has what was written.
    Result<void> sync() {
        if (::fdatasync(::fileno(file_.get())) != 0) return tl::unexpected(write_error(path_.string(), errno));
        return {};
    }

    // Leaves the whole packets.
    void cut_off() {
        file_.reset();
        std::error_code ignored;
        fs::resize_file(path_, bytes_, ignored);
    }

    // Replaces the file by one with the index in front, for which it is copied. If that fails, it stays as it is.
    Result<void> finish() {
        file_.reset();
        auto whole = OutputFile::create(path_);
        if (!whole) return tl::unexpected(whole.error());
        if (auto ok = whole->write(write_packet(write_index(indexer_.finish(bytes_)))); !ok) return ok;
        if (auto ok = whole->append(path_); !ok) return ok;
        if (auto ok = whole->sync(); !ok) return ok;
        return whole->finish();
    }

private:
    GrowingFile() = default;
    fs::path path_;
    File file_;
    StreamIndexer indexer_;
    std::uint64_t bytes_ = 0;
};

// ---- The files of one stream, one after the other -------------------------------------------------------------------

class Recording {
public:
    using Clock = Recorder::Clock;
    struct Item {
        SharedPacket packet;  // null: none has come
        fs::path new_file{};  // begins with this packet; empty: it goes on
    };

    Recording(std::string stream, std::chrono::milliseconds sync, std::shared_ptr<Shared> shared)
        : stream_(std::move(stream)), sync_(sync), shared_(std::move(shared)), thread_([this] { run(); }) {}
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;
    ~Recording() {
        end();
        thread_.join();
    }

    // Whether there was room.
    bool put(Item item, std::size_t most_waiting) {
        const std::lock_guard lock(mutex_);
        const auto bytes = item.packet->bytes.size();
        if (waiting_ > 0 && waiting_ + bytes > most_waiting) return false;
        waiting_ += bytes;
        items_.push_back(std::move(item));
        changed_.notify_one();
        return true;
    }
    void end() {
        const std::lock_guard lock(mutex_);
        ended_ = true;
        changed_.notify_one();
    }
    bool done() const { return done_; }
    // Whether writing failed since the last call.
    bool failed() { return failed_.exchange(false); }

private:
    void run() {
        while (auto item = next()) {
            if (!item->new_file.empty()) {
                finish();
                begin(item->new_file);
            }
            if (file_ && item->packet) write(*item->packet);
            if (file_ && unsynced_since_ && Clock::now() - *unsynced_since_ >= sync_) sync();
        }
        finish();
        done_ = true;
    }

    // Nothing once the recording has ended. Waits for a packet no longer than until the disk has to have the last ones.
    std::optional<Item> next() {
        std::unique_lock lock(mutex_);
        const auto some = [this] { return ended_ || !items_.empty(); };
        if (!unsynced_since_)
            changed_.wait(lock, some);
        else if (!changed_.wait_until(lock, *unsynced_since_ + sync_, some))
            return Item{};
        if (items_.empty()) return std::nullopt;
        auto item = std::move(items_.front());
        items_.pop_front();
        waiting_ -= item.packet->bytes.size();
        return item;
    }

    void begin(const fs::path& path) {
        auto begun = GrowingFile::begin(path);
        if (!begun) {
            shared_->warn("recording_failed", stream_, "recording cannot begin: " + begun.error().message);
            failed_ = true;
            return;
        }
        file_.emplace(std::move(*begun));
        ++shared_->files;
        shared_->tell({.name = "recording", .text = "recording to " + file_->path().string(), .stream = stream_});
    }

    void write(const LivePacket& packet) {
        if (const auto written = file_->write(packet); !written) return stop(written.error());
        if (!unsynced_since_) unsynced_since_ = Clock::now();
        ++shared_->packets;
        shared_->bytes += packet.bytes.size();
    }

    void sync() {
        unsynced_since_.reset();
        if (const auto synced = file_->sync(); !synced) stop(synced.error());
    }

    void stop(const Error& error) {
        file_->cut_off();
        shared_->warn("recording_failed", stream_, "recording stops, the live stream goes on: " + error.message);
        file_.reset();
        unsynced_since_.reset();
        failed_ = true;
    }

    void finish() {
        if (!file_) return;
        const auto path = file_->path().string();
        if (const auto finished = file_->finish(); finished)
            shared_->tell({.name = "recorded",
                           .text = "recorded to " + path,
                           .stream = stream_,
                           .numbers = {{"bytes", static_cast<std::int64_t>(file_->bytes())}}});
        else
            shared_->warn("recorded_without_index", stream_,
                          path + " has no index in front, for which it is copied once: " + finished.error().message +
                              "; 'htvm index' adds it",
                          false);
        file_.reset();
        unsynced_since_.reset();
    }

    std::string stream_;
    std::chrono::milliseconds sync_;
    std::shared_ptr<Shared> shared_;
    std::mutex mutex_;  // of what follows, up to ended_
    std::condition_variable changed_;
    std::deque<Item> items_;
    std::size_t waiting_ = 0;  // bytes
    bool ended_ = false;
    std::atomic<bool> done_ = false, failed_ = false;
    std::optional<GrowingFile> file_;  // the thread's own, and so
    std::optional<Clock::time_point> unsynced_since_{};
    std::thread thread_;  // last: it uses the others
};

// It can be decoded by itself, and others go on from it.
bool begins_file(const PacketHeader& header) {
    return header.kind == PacketKind::intra && header.has(packet_flag::referred);
}

// ---- The streams, as the server sees them ---------------------------------------------------------------------------

struct Stream {
    std::unique_ptr<Recording> recording;  // null: there are too many
    SharedPacket header{};                 // of the session
    bool file = false;                     // one has begun, and nothing happened to it
    bool whole = false;                    // what comes next can be decoded from what is in it,
    bool reference = false;                // or at least what needs the reference alone
    bool pictures = false;                 // the next picture can be decoded, as the file has those before
    Recorder::Clock::time_point begun{};   // the file
    std::optional<Recorder::Clock::time_point> failed{};
};

}  // namespace

struct Recorder::State {
    RecorderOptions options;
    std::shared_ptr<Shared> shared = std::make_shared<Shared>();
    std::map<std::string, Stream> streams;
    std::vector<std::unique_ptr<Recording>> ending;

    Stream& stream(const std::string& name) {
        const auto found = streams.find(name);
        if (found != streams.end()) return found->second;
        auto& out = streams[name];
        std::erase_if(ending, [](const auto& recording) { return recording->done(); });
        if (streams.size() + ending.size() <= options.streams)
            out.recording = std::make_unique<Recording>(name, options.sync, shared);
        else
            shared->warn("recording_failed", name, "not recorded: as many streams as can be are being recorded");
        return out;
    }
};

Recorder::Recorder(const RecorderOptions& options) : state_(std::make_unique<State>()) { state_->options = options; }
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() {
    if (state_) finish();
}

Result<Recorder> Recorder::open(const RecorderOptions& options) {
    std::error_code error;
    const auto folder = options.folder.string();
    if (!fs::is_directory(options.folder, error))
        return fail(ErrorKind::bad_input, "streams cannot be recorded: there is no folder " + folder);
    const auto trial = options.folder / ".htvm-recording-trial";
    const File file(std::fopen(trial.c_str(), "wb"));
    if (!file) return tl::unexpected(write_error("streams cannot be recorded: " + folder, errno));
    fs::remove(trial, error);
    return Recorder(options);
}

bool Recorder::record(const std::string& name, const SharedPacket& packet, Clock::time_point now,
                      std::chrono::system_clock::time_point time) {
    const auto& options = state_->options;
    auto& stream = state_->stream(name);
    if (!stream.recording) return false;
    const auto& header = packet->header;
    if (header.kind == PacketKind::sequence) {
        const bool same = stream.header && stream.header->header.reference == header.reference;
        if (!same) stream.file = stream.whole = false;
        stream.header = packet;
        return false;
    }
    if (stream.recording->failed()) {
        stream.file = stream.whole = false;
        stream.failed = now;
    }
    const bool frame = packet->is_frame();
    if (!stream.header || (stream.failed && now - *stream.failed < options.retry)) return false;
    const bool due = stream.file && options.file_length.count() > 0 && now - stream.begun >= options.file_length;
    const auto put = [&](const SharedPacket& item, fs::path new_file) {
        if (stream.recording->put({item, std::move(new_file)}, options.waiting_bytes)) return true;
        if (std::exchange(stream.whole, false))
            state_->shared->warn("recording_behind", name, "the disk is too slow: frames are not recorded", false);
        if (frame) ++state_->shared->dropped_frames;
        return false;
    };
    if (begins_file(header) && (!stream.file || due)) {
        stream.whole = stream.reference = stream.file = put(stream.header, options.folder / recording_name(name, time));
        stream.begun = now;
        stream.pictures = false;
        stream.failed.reset();
    } else if (begins_file(header) || (stream.file && stream.reference && packet->is_access())) {
        stream.whole = stream.reference = true;
    } else if (!stream.whole && frame && stream.file) {
        ++state_->shared->dropped_frames;
    }
    if (packet->is_picture()) {
        stream.pictures = stream.whole && (stream.pictures || is_key_picture(header)) && put(packet, {});
        return false;
    }
    const bool recorded = stream.whole && put(packet, {});
    if (!recorded && (packet->is_reference() || header.kind == PacketKind::codebook)) stream.reference = false;
    return (frame && !stream.whole) || (due && !begins_file(header));
}

void Recorder::end(const std::string& name) {
    const auto found = state_->streams.find(name);
    if (found == state_->streams.end()) return;
    if (auto recording = std::move(found->second.recording)) {
        recording->end();
        state_->ending.push_back(std::move(recording));
    }
    state_->streams.erase(found);
}

void Recorder::finish() {
    // All at the same time: each waits for its own thread when it is destroyed.
    for (auto& [name, stream] : state_->streams)
        if (stream.recording) stream.recording->end();
    state_->streams.clear();
    state_->ending.clear();
}

RecorderCounters Recorder::counters() const {
    const auto& shared = *state_->shared;
    RecorderCounters out{.files = shared.files,
                         .packets = shared.packets,
                         .bytes = shared.bytes,
                         .dropped_frames = shared.dropped_frames,
                         .faults = shared.faults};
    for (const auto& [name, stream] : state_->streams) out.streams += stream.file ? 1 : 0;
    return out;
}

std::vector<Event> Recorder::new_events() {
    const std::lock_guard lock(state_->shared->mutex);
    return std::exchange(state_->shared->events, {});
}

std::string recording_name(const std::string& stream, std::chrono::system_clock::time_point time) {
    constexpr std::size_t longest = 200;
    constexpr std::string_view harmless = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
    constexpr const char* digits = "0123456789ABCDEF";
    std::string out;
    for (const char c : stream) {
        const auto byte = static_cast<unsigned char>(c);
        const bool hidden = out.empty() && c == '.';
        const bool stays = byte > 127 || (harmless.find(c) != std::string_view::npos && !hidden);
        const std::string piece = stays ? std::string(1, c) : std::string{'%', digits[byte >> 4], digits[byte & 15]};
        if (out.size() + piece.size() > longest) break;
        out += piece;
    }
    const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
    std::tm parts{};
    gmtime_r(&seconds, &parts);
    std::array<char, 32> text{};
    out.append(text.data(), std::strftime(text.data(), text.size(), "-%Y%m%d-%H%M%S", &parts));
    return out;
}

}  // namespace htvm::live
