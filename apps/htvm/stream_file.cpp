#include "stream_file.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <limits>
#include <utility>

#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "container/mp4_packets.h"
#include "core/letter_case.h"
#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "live/client/hub_address.h"
#include "segment_folder.h"
#include "segment_input.h"

namespace htvm::app {

// ---- Packets --------------------------------------------------------------------------------------------------------

namespace {

// A hub that is not there, and a stream that nobody publishes yet, may come: each is said once.
std::function<void(const std::string&)> warn_once() {
    return [last = std::string()](const std::string& trouble) mutable {
        if (std::exchange(last, trouble) != trouble) warn(trouble + "; trying again");
    };
}

Result<Watcher> open_watcher(const std::string& address, std::size_t max_packet_bytes, const HubTrust& trust) {
    watch_for_interruption();
    WatcherOptions options;
    options.certificates = trust.certificates;
    options.insecure = trust.insecure;
    auto token = token_of_environment();
    if (!token) return tl::unexpected(token.error());
    options.token = std::move(*token);
    options.largest_packet = std::min(max_packet_bytes, options.largest_packet);
    options.is_stopped = [] { return interruption() != 0; };
    options.trouble = warn_once();
    return Watcher::open(address, options);
}

}  // namespace

bool is_stream_name(const std::string& path) {
    const auto ending = internal::lower_case(std::filesystem::path(path).extension().string());
    return ending == ".htvm" || ending == ".mp4" || is_playlist_name(path);
}

namespace {

Result<FileBytes> source_of_file(std::shared_ptr<std::ifstream> file, const std::string& path) {
    file->clear();
    file->seekg(0, std::ios::end);
    const auto size = file->tellg();
    if (size < 0)
        return fail(ErrorKind::bad_input, path + " is an .mp4, which is read from a file alone, not from a pipe");
    return FileBytes{
        static_cast<std::uint64_t>(size), [file = std::move(file)](std::uint64_t offset, std::span<std::uint8_t> to) {
            file->clear();
            file->seekg(static_cast<std::streamoff>(offset));
            return bool(file->read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size())));
        }};
}

}  // namespace

Result<StreamInput> StreamInput::open(const std::string& path, std::uint64_t max_packet_bytes, const HubTrust& trust) {
    StreamInput input;
    const auto most =
        static_cast<std::size_t>(std::min<std::uint64_t>(max_packet_bytes, std::numeric_limits<std::size_t>::max()));
    input.reader_ = PacketReader(most);
    input.max_packet_bytes_ = max_packet_bytes;
    if (live::looks_like_web_address(path) || (is_playlist_name(path) && !live::looks_like_hub_address(path))) {
        auto segments = SegmentInput::open(path, max_packet_bytes, trust);
        if (!segments) return tl::unexpected(segments.error());
        input.segments_ = std::make_shared<SegmentInput>(std::move(*segments));
        return input;
    }
    if (live::looks_like_hub_address(path)) {
        if (path.find("/watch/") == std::string::npos)
            return fail(ErrorKind::bad_input, "'" + path.substr(0, path.find('?')) +
                                                  "' is not where a stream is "
                                                  "watched: that is ws://HOST:PORT/watch/NAME, or a playlist, "
                                                  "http://HOST/PATH.m3u8");
        auto watcher = open_watcher(path, most, trust);
        if (!watcher) return tl::unexpected(watcher.error());
        input.watcher_.emplace(std::move(*watcher));
        return input;
    }
    input.standard_ = path == "-";
    if (input.standard_) return input;
    const auto open_mp4 = [&](Result<FileBytes> source) -> Result<void> {
        if (!source) return tl::unexpected(source.error());
        auto opened = Mp4Packets::open(std::move(*source), max_packet_bytes);
        if (!opened) return fail(opened.error().kind, path + ": " + opened.error().message);
        input.mp4_ = std::make_shared<Mp4Packets>(std::move(*opened));
        return {};
    };
    if (std::filesystem::is_directory(path))
        return fail(ErrorKind::bad_input, path + " is a folder; give an .htvm file");
    input.file_->open(path, std::ios::binary);
    if (!*input.file_) return fail(ErrorKind::bad_input, path + " cannot be read: " + std::strerror(errno));
    if (!std::filesystem::is_regular_file(path)) return input;  // what is read of a pipe is gone
    std::array<std::uint8_t, 8> beginning{};
    input.file_->read(reinterpret_cast<char*>(beginning.data()), beginning.size());
    const bool mp4 = input.file_->gcount() == beginning.size() && looks_like_mp4(beginning);
    input.file_->clear();
    input.file_->seekg(0);
    if (!mp4) return input;
    if (auto opened = open_mp4(source_of_file(input.file_, path)); !opened) return tl::unexpected(opened.error());
    return input;
}

std::uint64_t StreamInput::damaged_bytes() const {
    return reader_.damaged_bytes() + (watcher_ ? watcher_->state().damaged_bytes : 0) +
           (mp4_ ? mp4_->damaged_bytes() : 0) + (segments_ ? segments_->damaged_bytes() : 0);
}

bool StreamInput::is_live() const { return watcher_ || (segments_ && segments_->is_live()); }

std::uint64_t StreamInput::missing_bytes() const { return mp4_ ? mp4_->missing_bytes() : 0; }

std::uint64_t StreamInput::cut_off_bytes() const { return mp4_ ? mp4_->cut_off_bytes() : 0; }

std::uint64_t StreamInput::lost_segments() const { return segments_ ? segments_->lost_segments() : 0; }

std::string StreamInput::first_loss() const { return segments_ ? segments_->first_loss() : std::string(); }

void StreamInput::go_on_with(std::vector<Packet> first, std::uint64_t offset) {
    first_.assign(std::make_move_iterator(first.begin()), std::make_move_iterator(first.end()));
    file_->clear();
    file_->seekg(static_cast<std::streamoff>(offset));
}

// Whether standard input is an .mp4, which is then read to its end, as its tables may lie there.
bool StreamInput::begin_standard() {
    std::array<std::uint8_t, 8> beginning{};
    std::cin.read(reinterpret_cast<char*>(beginning.data()), beginning.size());
    const auto got = static_cast<std::size_t>(std::cin.gcount());
    const auto known = std::span(beginning).first(got);
    if (!looks_like_mp4(known)) {
        reader_.push(known);
        return false;
    }
    auto all = std::make_shared<std::vector<std::uint8_t>>(known.begin(), known.end());
    std::array<char, 65536> buffer;
    while (std::cin.read(buffer.data(), buffer.size()), std::cin.gcount() > 0)
        all->insert(all->end(), buffer.begin(), buffer.begin() + std::cin.gcount());
    auto source = source_of(*all);
    source.read = [all, read = std::move(source.read)](std::uint64_t offset, std::span<std::uint8_t> to) {
        return read(offset, to);
    };
    auto opened = Mp4Packets::open(std::move(source), max_packet_bytes_);
    if (opened)
        mp4_ = std::make_shared<Mp4Packets>(std::move(*opened));
    else
        refusal_ = Error{opened.error().kind, "standard input: " + opened.error().message};
    return true;
}

// Pushes more bytes to the reader; false at the end.
bool StreamInput::read_some() {
    if (standard_ && !std::exchange(begun_, true) && begin_standard() && refusal_) return false;
    if (segments_) {
        const auto bytes = segments_->next();
        if (bytes) reader_.push(*bytes);
        if (!bytes) refusal_ = segments_->refusal();
        return bytes.has_value();
    }
    if (mp4_) {
        const auto bytes = mp4_->next();
        if (bytes) reader_.push(*bytes);
        return bytes.has_value();
    }
    std::istream& in = standard_ ? std::cin : *file_;
    std::array<char, 65536> buffer;
    // Data of a live stream is taken as it arrives, not only once the buffer is full.
    in.read(buffer.data(), 1);
    std::streamsize got = in.gcount();
    if (got > 0) got += in.readsome(buffer.data() + 1, static_cast<std::streamsize>(buffer.size()) - 1);
    reader_.push({reinterpret_cast<const std::uint8_t*>(buffer.data()), static_cast<std::size_t>(got)});
    return got > 0;
}

std::optional<Packet> StreamInput::next() {
    if (!first_.empty()) {
        auto packet = std::move(first_.front());
        first_.pop_front();
        return packet;
    }
    if (watcher_) {
        auto packet = watcher_->next();
        if (packet) return std::move(*packet);
        refusal_ = packet.error();
        return std::nullopt;
    }
    for (;;) {
        if (auto packet = reader_.pull()) {
            damaged_before_ = reader_.damaged_bytes();
            return packet;
        }
        if (at_end_) return std::nullopt;
        at_end_ = !read_some();
    }
}

Result<void> check_whole(const StreamInput& input, const std::string& path, const std::string& advice) {
    if (input.refusal()) return tl::unexpected(*input.refusal());
    if (input.oversized_packets() > 0)
        return fail(ErrorKind::limit, fmt::format("{} has {} larger than --max-packet; raise --max-packet to read all",
                                                  path, counted(input.oversized_packets(), "packet")));
    if (const auto lost = input.lost_segments(); lost > 0)
        return fail(ErrorKind::corrupt_stream,
                    fmt::format("{}{}; {}", input.first_loss(),
                                lost > 1 ? fmt::format("; {} more {} left out, too", counted(lost - 1, "segment"),
                                                       lost > 2 ? "are" : "is")
                                         : "",
                                advice));
    if (input.missing_bytes() > 0)
        return fail(ErrorKind::corrupt_stream, fmt::format("{} is cut short: its end, {}, is missing; {}", path,
                                                           counted(input.missing_bytes(), "byte"), advice));
    if (input.damaged_bytes() > 0)
        return fail(ErrorKind::corrupt_stream, fmt::format("{} is damaged: {} of it are no valid packets; {}", path,
                                                           counted(input.damaged_bytes(), "byte"), advice));
    if (input.cut_short_bytes() > 0)
        return fail(ErrorKind::corrupt_stream, fmt::format("{} ends in the middle of a packet; {}", path, advice));
    return {};
}

bool is_whole_but_for_end(const StreamInput& input) {
    if (input.refusal() || input.oversized_packets() > 0 || input.lost_segments() > 0) return false;
    const auto damage = input.damaged_bytes() + input.cut_short_bytes();
    if (input.missing_bytes() > 0) return damage == input.cut_off_bytes();
    return damage > 0 && damage == input.torn_bytes();
}

Result<void> check_whole_but_for_end(const StreamInput& input, const std::string& path) {
    if (!is_whole_but_for_end(input)) return check_whole(input, path);
    warn(input.missing_bytes() > 0 ? fmt::format("{} is cut short: its end, {}, is missing, and is left out", path,
                                                 counted(input.missing_bytes(), "byte"))
                                   : fmt::format("{} ends in {} that are no whole packet, which are left out", path,
                                                 counted(input.torn_bytes(), "byte")));
    return {};
}

namespace {

// What else than a stream a file of that name is: "a mesh"; empty: nothing that is known. Who gives such a name expects
// a file of that kind.
std::string other_kind_of(const std::filesystem::path& path) {
    if (is_mesh_file_name(path)) return "a mesh";
    const auto ending = internal::lower_case(path.extension().string());
    const auto is_of = [&](std::initializer_list<const char*> endings) {
        return std::find(endings.begin(), endings.end(), ending) != endings.end();
    };
    if (is_of({".m4v", ".mov", ".mkv", ".webm", ".avi", ".y4m", ".mpg"})) return "a video";
    if (is_of({".png", ".jpg", ".jpeg", ".webp", ".gif"})) return "a picture";
    if (is_of({".wav", ".flac", ".opus", ".ogg", ".mp3", ".m4a", ".aac"})) return "a sound";
    if (is_of({".bvh", ".json", ".csv", ".txt", ".html"})) return "a text";
    if (is_of({".zip", ".gz", ".tar", ".7z", ".usd", ".usdz", ".fbx", ".abc"})) return "another format";
    return {};
}

// Whether a stream may be written to a file of that name.
Result<void> check_name(const std::string& path) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none))
        return fail(ErrorKind::bad_input, path +
                                              " cannot be written: it is a folder; give the stream a name, such as " +
                                              (std::filesystem::path(path) / "person.htvm").string());
    if (const auto what = other_kind_of(path); !what.empty())
        return fail(ErrorKind::bad_input, path + " is the name of " + what +
                                              ", but a stream would be written there; give one that ends in .htvm");
    const auto ending = internal::lower_case(std::filesystem::path(path).extension().string());
    const bool is_device = std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none);
    if (!is_stream_name(path) && !ending.empty() && !is_device)
        return fail(ErrorKind::bad_input,
                    fmt::format("{}: {} is no ending of a stream; give .htvm, .mp4, or .m3u8 for segments and their "
                                "playlist",
                                path, ending));
    return {};
}

// The packets of a file that this program has written.
Result<PacketSource> packets_in(const std::filesystem::path& path) {
    auto file = std::make_shared<std::ifstream>(path, std::ios::binary);
    if (!*file) return fail(ErrorKind::bad_input, path.string() + " cannot be read again");
    return PacketSource([file, reader = std::make_shared<PacketReader>(),
                         buffer = std::vector<char>(std::size_t{1} << 20)]() mutable -> std::optional<Packet> {
        for (;;) {
            if (auto packet = reader->pull()) return packet;
            file->read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
            const auto got = static_cast<std::size_t>(file->gcount());
            if (got == 0) return std::nullopt;
            reader->push({reinterpret_cast<const std::uint8_t*>(buffer.data()), got});
        }
    });
}

}  // namespace

Result<StreamOutput> StreamOutput::open(const std::string& path, const PublishingOptions& publishing) {
    StreamOutput output;
    if (path == "-") return output;
    if (live::looks_like_hub_address(path)) {
        auto opened = Publishing::open(path, publishing);
        if (!opened) return tl::unexpected(opened.error());
        output.publishing_.emplace(std::move(*opened));
        return output;
    }
    if (auto fine = check_name(path); !fine) return tl::unexpected(fine.error());
    return open_file(path);
}

Result<StreamOutput> StreamOutput::replace(const std::string& path) { return open_file(path); }

Result<StreamOutput> StreamOutput::open_file(const std::string& path) {
    StreamOutput output;
    const auto ending = internal::lower_case(std::filesystem::path(path).extension().string());
    // Another file is made of these at the end.
    std::string packets = path;
    constexpr const char* packets_beside = ".htvm";
    if (ending == ".mp4") {
        auto mp4 = OutputFile::create(path);
        if (!mp4) return tl::unexpected(mp4.error());
        output.mp4_.emplace(std::move(*mp4));
        packets += packets_beside;
    }
    if (is_playlist_name(path)) {
        output.playlist_ = path;
        packets += packets_beside;
    }
    auto file = OutputFile::create(packets);
    if (!file) return tl::unexpected(file.error());
    output.file_.emplace(std::move(*file));
    return output;
}

Result<void> StreamOutput::write(const Packet& packet) {
    if (!audio_) return write_one(packet);
    if (packet.kind == PacketKind::audio) return {};
    const auto before = packet.kind == PacketKind::index ? audio_->rest() : audio_->before(packet);
    if (auto written = write_all(before); !written) return written;
    return write_one(packet);
}

Result<void> StreamOutput::write_all(const std::vector<Packet>& packets) {
    for (const auto& packet : packets)
        if (auto written = write_one(packet); !written) return written;
    return {};
}

Result<void> StreamOutput::write_one(const Packet& packet) {
    if (is_indexed()) {
        if (packet.kind == PacketKind::index || packet.kind == PacketKind::front_index) return {};
        indexer_.add(packet, bytes_);
    }
    if (publishing_) {
        if (pacing_ && frame_type(packet.kind)) {
            const auto now = Pacing::Clock::now();
            wait_until(pacing_->due(packet.timestamp_us, now));
            held_back_ += std::chrono::duration<double, std::milli>(Pacing::Clock::now() - now).count();
        }
        bytes_ += packet_overhead + packet.payload.size();
        return publishing_->send(packet);
    }
    // Behind a part of a packet nothing has its place.
    if (failed_) return tl::unexpected(*failed_);
    const auto bytes = write_packet(packet);
    if (auto written = file_ ? file_->write(bytes) : write_standard_output(bytes); !written) {
        failed_ = written.error();
        return written;
    }
    bytes_ += bytes.size();
    if (file_) written_.push_back({bytes_, frame_type(packet.kind).has_value()});
    return {};
}

void StreamOutput::add_bounds_of(const Packet& packet) {
    if (packet.kind != PacketKind::front_index) return;
    if (const auto index = read_index(packet); index && index->bounds) indexer_.add(*index->bounds);
}

Result<void> StreamOutput::finish() {
    if (audio_)
        if (auto written = write_all(audio_->rest()); !written) return written;
    if (publishing_) return publishing_->finish();
    if (!file_) return {};
    if (!is_indexed()) return file_->finish();
    const auto index = indexer_.finish(bytes_);
    if (mp4_) return finish_mp4(index);
    if (!playlist_.empty()) return finish_segments(index);
    if (index.frames == 0) return file_->finish();
    const auto front = write_packet(write_index(index));
    if (const auto done = file_->finish_behind(front); !done) {
        warn(fmt::format(
            "the stream has no index in front, for which all of it is copied once: {}; 'htvm index' adds it",
            done.error().message));
        return file_->finish();
    }
    bytes_ += front.size();
    has_index_ = true;
    return {};
}

// Makes the .mp4 of the packets, which are in a file that goes away with this one.
Result<void> StreamOutput::finish_mp4(const StreamIndex& index) {
    if (auto flushed = file_->flush(); !flushed) return flushed;
    const auto open = [&packets = file_->written_at()] { return packets_in(packets); };
    std::uint64_t bytes = 0;
    const auto written = write_mp4(open, write_index(index), mp4_options_, [&](std::span<const std::uint8_t> piece) {
        bytes += piece.size();
        return mp4_->write(piece);
    });
    if (!written) return written;
    bytes_ = bytes;
    has_index_ = true;
    return mp4_->finish();
}

// Makes the segments, likewise.
Result<void> StreamOutput::finish_segments(const StreamIndex& index) {
    if (auto flushed = file_->flush(); !flushed) return flushed;
    auto source = packets_in(file_->written_at());
    if (!source) return tl::unexpected(source.error());
    SegmentFolder folder(playlist_, segment_options_);
    if (auto written = folder.write(write_index(index)); !written) return written;
    while (auto packet = (*source)())
        if (auto written = folder.write(std::move(*packet)); !written) return written;
    if (auto finished = folder.finish(); !finished) return finished;
    bytes_ = folder.bytes();
    has_index_ = true;
    return {};
}

StreamOutput::Kept StreamOutput::keep() {
    if (!file_) return {};
    const auto path = file_->keep();
    if (path.empty()) return {};
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    const auto is_whole = [size](const Written& packet) { return packet.end <= size; };
    const auto beyond = std::find_if_not(written_.begin(), written_.end(), is_whole);
    Kept out{path.string(), static_cast<std::size_t>(std::count_if(
                                written_.begin(), beyond, [](const Written& packet) { return packet.is_frame; }))};
    if (error) return out;
    if (out.frames == 0) {
        std::filesystem::remove(path, error);
        return {};
    }
    const auto end = std::prev(beyond)->end;
    if (end < size) std::filesystem::resize_file(path, end, error);
    return out;
}

// ---- What the commands accept of a stream ---------------------------------------------------------------------------

namespace {

// Numbers with a sign, or beyond 64 bits, are parsed as values far above this.
constexpr std::uint64_t most_bytes = std::uint64_t{1} << 60;

}  // namespace

void add_decoder_limits(CLI::App& command, DecoderOptions& limits) {
    command
        .add_option("-M,--max-memory", limits.max_memory,
                    "Most memory that decoding may use: bytes, or a number with K, M or G (default 4G)")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::Range(std::uint64_t{1}, most_bytes, "from 1 to 2^60 bytes"))
        ->group(heading::limits);
    command
        .add_option("--level", limits.detail_levels,
                    "Levels of detail that are shown below the mesh that frames refer to, where the stream has any: 0, "
                    "none, takes least time (default: all)")
        ->check(CLI::Range(0u, 9u));
    command.add_option("--max-vertices", limits.max_vertices, "Most vertices of a frame (default 4194304)")
        ->group(heading::limits);
    command.add_option("--max-triangles", limits.max_triangles, "Most triangles of a frame (default 8388608)")
        ->group(heading::limits);
    command
        .add_option("--max-vertices-per-byte", limits.max_vertices_per_byte,
                    "Most work for each byte of the stream so far, counted in vertices shown (default 4096)")
        ->group(heading::limits);
    add_packet_limits(command, limits);
}

void add_packet_limits(CLI::App& command, DecoderOptions& limits) {
    command
        .add_option("--max-bones", limits.max_bones, "Most bones of the skeleton (default 1024, the format's maximum)")
        ->group(heading::limits);
    command
        .add_option("--max-packet", limits.max_packet_bytes,
                    "Most bytes of a packet, likewise with K, M or G (default 256M); larger ones are skipped")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::Range(std::uint64_t{1}, most_bytes, "from 1 to 2^60 bytes"))
        ->group(heading::limits);
}

}  // namespace htvm::app
