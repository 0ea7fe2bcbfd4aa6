#include "segment_input.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <thread>
#include <utility>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "container/box.h"
#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "live/client/http_client.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_list_bytes = std::size_t{1} << 25, most_segment_bytes = std::size_t{1} << 29;

// False if the program is interrupted.
bool pause(double seconds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    constexpr std::chrono::milliseconds often{50};
    while (interruption() == 0 && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(often);
    return interruption() == 0;
}

// ---- Where files come from ------------------------------------------------------------------------------------------

FetchedFile fetch_beside(const std::string& base, const std::string& name, std::size_t most_bytes) {
    FetchedFile out;
    if (!base.empty() && !is_name_below(name)) return {.trouble = "is not a file beside it"};
    const auto path = base.empty() ? fs::path(name) : fs::path(base).parent_path() / name;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return {.trouble = "is not there"};
    if (fs::file_size(path, error) > most_bytes || error)
        return {.trouble = fmt::format("is larger than the {} MiB that are taken", most_bytes >> 20)};
    auto bytes = read_file(path.string());
    if (!bytes) return {.trouble = "cannot be read"};
    out.bytes = std::move(*bytes);
    out.place = path.string();
    return out;
}

// What a server's answer means for who asked.
std::string trouble_of(const live::HttpAnswer& answer) {
    constexpr unsigned unauthorized = 401, forbidden = 403, not_found = 404, gone = 410;
    if (answer.status == not_found || answer.status == gone) return fmt::format("is not there ({})", answer.status);
    if (answer.status == unauthorized || answer.status == forbidden)
        return fmt::format("is not handed out ({}): a link or a token is missing, or no longer good", answer.status);
    return fmt::format("is not handed out: the server answers {}: {}", answer.status, answer.said);
}

FetchedFile fetch_by_http(live::HttpClient& client, const live::HubAddress& address, std::size_t most_bytes) {
    constexpr std::array pauses = {0.25, 0.75, 2.0};  // seconds; a server may be busy, a line may break
    for (std::size_t tries = 0;; ++tries) {
        auto answer = client.get(address, most_bytes);
        constexpr unsigned success = 200, other = 300, busy = 429, of_server = 500;
        if (answer && answer->status >= success && answer->status < other)
            return {.bytes = std::move(answer->body), .place = live::web_text(answer->address)};
        const bool for_good =
            answer ? answer->status < of_server && answer->status != busy : answer.error().kind == ErrorKind::limit;
        if (for_good || tries == pauses.size() || !pause(pauses[tries]))
            return {.trouble = answer ? trouble_of(*answer) : "does not come: " + answer.error().message};
    }
}

Result<SegmentSource> source_by_http(const std::string& place, const HubTrust& trust) {
    const auto address = live::parse_web_address(place);
    if (!address) return tl::unexpected(address.error());
    watch_for_interruption();
    live::HttpClientOptions options;
    auto token = token_of_environment();
    if (!token) return tl::unexpected(token.error());
    options.token = std::move(*token);
    options.certificates = trust.certificates;
    options.insecure = trust.insecure;
    options.is_stopped = [] { return interruption() != 0; };
    auto client = live::HttpClient::create(options);
    if (!client) return tl::unexpected(client.error());
    auto shared = std::make_shared<live::HttpClient>(std::move(*client));
    const auto fetch = [shared](const std::string& base, const std::string& name, std::size_t most) -> FetchedFile {
        if (base.empty()) return fetch_by_http(*shared, *live::parse_web_address(name), most);
        const auto from = live::parse_web_address(base);
        const auto to = live::resolved_reference(*from, name);
        if (!to) return {.trouble = "is no address of a web server"};
        if (from->secure && !to->secure) return {.trouble = "is where there is no TLS"};
        return fetch_by_http(*shared, *to, most);
    };
    return SegmentSource{fetch, true};
}

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

// ---- The playlist ---------------------------------------------------------------------------------------------------

Result<void> SegmentInput::read_list(const FetchedFile& file) {
    auto list = read_playlist(text_of(file.bytes));
    if (!list && source_.waits && !text_of(file.bytes).starts_with("#EXTM3U"))
        return fail(list.error().kind, shown_ + ": " + list.error().message +
                                           "; of a stream's addresses, programs read those that end in .m3u8, and a "
                                           "hub's that begin with ws:// or wss://");
    if (!list) return fail(list.error().kind, shown_ + ": " + list.error().message);
    list_ = std::move(*list);
    list_place_ = file.place;
    return {};
}

Result<SegmentInput> SegmentInput::open(const std::string& place, std::uint64_t max_packet_bytes,
                                        const HubTrust& trust) {
    SegmentInput out;
    out.max_packet_bytes_ = max_packet_bytes;
    out.shown_ = shown_place(place);
    out.source_ = {fetch_beside, false};
    if (live::looks_like_web_address(place)) {
        // An endless answer, which no list of segments is.
        const auto address = live::parse_web_address(place);
        const bool of_hub = address && address->target.starts_with("/watch/");
        if (of_hub && address->target.substr(0, address->target.find('?')).find(".m3u8") == std::string::npos)
            return fail(ErrorKind::bad_input, out.shown_ +
                                                  " is a hub's live stream: its address begins with ws:// in place of "
                                                  "http://, wss:// in place of https://");
        auto source = source_by_http(place, trust);
        if (!source) return tl::unexpected(source.error());
        out.source_ = std::move(*source);
    }
    auto file = out.source_.fetch("", place, most_list_bytes);
    if (!file.trouble.empty()) return fail(ErrorKind::bad_input, fmt::format("{} {}", out.shown_, file.trouble));
    out.list_name_ = place;
    std::string base;
    // The finest, where there are several qualities.
    if (const auto variants = read_variants(text_of(file.bytes)); !variants.empty()) {
        const auto& finest = *std::max_element(variants.begin(), variants.end(), [](const auto& a, const auto& b) {
            return a.bits_per_second < b.bits_per_second;
        });
        const auto list = out.source_.fetch(file.place, finest.uri, most_list_bytes);
        // So that no list leads to itself.
        const bool of_lists = list.trouble.empty() && !read_variants(text_of(list.bytes)).empty();
        if (!list.trouble.empty() || of_lists)
            return fail(ErrorKind::bad_input, fmt::format("{} names {}, which {}", out.shown_, finest.uri,
                                                          of_lists ? "is a list of playlists" : list.trouble));
        out.list_name_ = list.place;
        file = list;
    }
    if (auto read = out.read_list(file); !read) return tl::unexpected(read.error());
    if (out.list_.segments.empty() && (out.list_.has_end || !out.source_.waits))
        return fail(ErrorKind::corrupt_stream, out.shown_ + " names no segment");
    // Nothing else of this machine's files is read because a playlist says so.
    for (const auto& segment : out.list_.segments)
        for (const auto& name : {segment.map_uri, segment.uri})
            if (!out.source_.waits && !is_name_below(name))
                return fail(ErrorKind::bad_input,
                            fmt::format("{} names {}, which is not a file beside it", out.shown_, name));
    out.next_number_ = out.list_.first_number;
    out.began_with_end_ = out.list_.has_end;
    return out;
}

// A live stream's list is read again, now and then. False if nothing more is to be expected.
bool SegmentInput::wait_for_more() {
    constexpr int most_failures = 8;
    constexpr double most_seconds = 60;
    const auto seconds = std::clamp(list_.target_seconds / 2, 0.25, 5.0);
    if (!pause(seconds)) return false;
    waited_ += seconds;
    const auto file = source_.fetch("", list_name_, most_list_bytes);
    if (interruption() != 0) return false;
    Result<void> read = fail(ErrorKind::corrupt_stream, fmt::format("{} {}", shown_, file.trouble));
    if (file.trouble.empty()) read = read_list(file);
    failures_ = read ? 0 : failures_ + 1;
    if (failures_ == 1) warn(read.error().message + "; trying again");
    if (failures_ > most_failures) refusal_ = read.error();
    if (waited_ > most_seconds && !refusal_)
        refusal_ = Error{ErrorKind::corrupt_stream,
                         fmt::format("{} had no new segment for {:.0f} seconds, and does not say that the stream ended",
                                     shown_, most_seconds)};
    return !refusal_;
}

// ---- Segments -------------------------------------------------------------------------------------------------------

void SegmentInput::lose(const std::string& name, const std::string& what) {
    const auto loss = fmt::format("{} names {}, which {}", shown_, name, what);
    if (lost_++ == 0) first_loss_ = loss;
    if (source_.waits) warn(loss + "; going on behind it");
    anew_ = true;
}

void SegmentInput::end_segment() {
    const auto damaged = packets_->damaged_bytes();
    damaged_ += damaged;
    if (packets_->missing_bytes() > 0)
        lose(segment_, "is cut short, or no segment");
    else if (damaged > 0)
        anew_ = true;
    packets_.reset();
    bytes_.reset();
}

// False if it is left out.
bool SegmentInput::begin(const PlaylistSegment& segment) {
    if (segment.map_uri != map_) {
        map_.clear();
        auto map = source_.fetch(list_place_, segment.map_uri, most_segment_bytes);
        if (map.trouble.empty() && !has_whole_boxes(map.bytes)) map.trouble = "is cut short, or no map";
        if (!map.trouble.empty()) {
            lose(segment.map_uri, map.trouble);
            return false;
        }
        map_ = segment.map_uri;
        map_bytes_ = std::move(map.bytes);
    }
    auto media = source_.fetch(list_place_, segment.uri, most_segment_bytes);
    if (!media.trouble.empty()) {
        lose(segment.uri, media.trouble);
        return false;
    }
    bytes_ = std::make_shared<std::vector<std::uint8_t>>(map_bytes_);
    bytes_->insert(bytes_->end(), media.bytes.begin(), media.bytes.end());
    auto packets = Mp4Packets::open(source_of(*bytes_), max_packet_bytes_, !anew_);
    if (!packets) {
        lose(segment.uri, "cannot be read: " + packets.error().message);
        return false;
    }
    filters_ = anew_ && !(known_.empty() && known_before_.empty());
    anew_ = false;
    segment_ = segment.uri;
    packets_.emplace(std::move(*packets));
    return true;
}

// False at the end of the stream.
bool SegmentInput::open_next() {
    while (interruption() == 0) {
        const auto& segments = list_.segments;
        if (next_number_ < list_.first_number) {
            lose(std::to_string(next_number_), "left it before it was read");
            lost_ += list_.first_number - next_number_ - 1;
            next_number_ = list_.first_number;
        }
        const auto place = next_number_ - list_.first_number;
        // A publisher that begins again may begin its numbers again.
        if (place > segments.size()) next_number_ = list_.first_number;
        if (place < segments.size()) {
            waited_ = 0;
            ++next_number_;
            const auto segment = segments[static_cast<std::size_t>(place)];
            if (begin(segment)) return true;
        } else if (place == segments.size() && (list_.has_end || !source_.waits || !wait_for_more())) {
            return false;
        }
    }
    return false;
}

std::optional<std::vector<std::uint8_t>> SegmentInput::next() {
    for (;;) {
        if (packets_) {
            if (auto bytes = packets_->next()) return without_repeats(std::move(*bytes));
            end_segment();
        }
        if (!open_next()) return std::nullopt;
    }
}

// Whether the packet came before. Else it counts as having come.
bool SegmentInput::is_known(const Packet& packet) {
    const bool header = packet.kind == PacketKind::sequence;
    const bool others_need = header || packet.kind == PacketKind::codebook || packet.kind == PacketKind::texture ||
                             (packet.flags & packet_flag::referred) != 0;
    if (!others_need) return false;
    // A header may be said again with any frame.
    auto hashed = header ? packet.payload : write_packet(packet);
    hashed.push_back(static_cast<std::uint8_t>(packet.kind));
    const auto hash = std::hash<std::string_view>{}(text_of(hashed));
    if (known_.contains(hash) || known_before_.contains(hash)) return true;
    constexpr std::size_t most = std::size_t{1} << 20;
    if (packet.kind == PacketKind::intra || known_.size() >= most) known_before_ = std::exchange(known_, {});
    known_.insert(hash);
    return false;
}

// Those of the first packets behind a gap that did not come before; all of the others.
std::vector<std::uint8_t> SegmentInput::without_repeats(std::vector<std::uint8_t> bytes) {
    const bool filters = std::exchange(filters_, false);
    PacketReader reader(static_cast<std::size_t>(std::min<std::uint64_t>(max_packet_bytes_, SIZE_MAX)));
    reader.push(bytes);
    std::vector<std::uint8_t> out;
    while (const auto packet = reader.pull()) {
        if (is_known(*packet) || !filters) continue;
        const auto whole = write_packet(*packet);
        out.insert(out.end(), whole.begin(), whole.end());
    }
    return filters ? out : bytes;
}

}  // namespace htvm::app
