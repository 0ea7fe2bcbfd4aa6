#include "live/server/live_segments.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <random>
#include <utility>
#include <vector>

#include "codec/format/sequence.h"
#include "container/fragment.h"
#include "container/playlist.h"
#include "live/hub/stream_name.h"

namespace htvm::live {

class LiveSegments::Waiting {
public:
    Waiting(Wake wake, std::shared_ptr<std::atomic<std::size_t>> count)
        : wake_(std::move(wake)), count_(std::move(count)) {
        ++*count_;
    }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    ~Waiting() { --*count_; }
    void wake() const { wake_(); }

private:
    Wake wake_;
    std::shared_ptr<std::atomic<std::size_t>> count_;
};

namespace {

using Clock = LiveSegments::Clock;
using Bytes = std::shared_ptr<const std::string>;
using Found = LiveSegments::Found;

// Counts as the stream's memory as long as anybody holds it.
Bytes counted(std::string bytes, const HubMemory::SharedShare& share) {
    const auto size = bytes.size();
    share->take(size);
    return {new std::string(std::move(bytes)), [share, size](const std::string* held) {
                share->give_back(size);
                delete held;
            }};
}

std::string text_of(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

std::string name_of(const std::string& bytes) {
    return name_by_content({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::int64_t unix_ms() {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

// A hub that is started anew has other names for parts, which are not made of what is in them.
std::string random_tag() {
    std::random_device random;
    std::array<char, 16> out{};
    std::snprintf(out.data(), out.size(), "%08x", static_cast<unsigned>(random()));
    return out.data();
}

// ---- What can be asked for ------------------------------------------------------------------------------------------

struct Piece {
    Bytes bytes;  // which `content` is of
    std::string_view content;
};

struct Segment {
    std::uint64_t number = 0;
    PlaylistSegment entry;  // with all its parts
    // As the session's packets say of its first frame: what the rungs of a ladder have in common.
    std::uint64_t session = 0;  // 0: unknown
    std::int64_t timestamp_us = 0;
};

// One stream is shown so. Whatever is in `files` can be asked for; the lists say what is in the playlist.
struct Shown {
    HubMemory::SharedShare share;
    std::map<std::string, Piece, std::less<>> files;
    std::map<std::string, std::size_t> uses_of_map;  // segments
    std::deque<Segment> listed;
    std::deque<Segment> leaving;        // no longer listed, but who has the last playlist may still ask for them
    std::optional<Segment> open;        // of which not all parts have come
    std::uint64_t next_number = 0;      // of the segment that begins next
    bool begun = false;                 // there was a segment
    double frames_per_second = 0;       // 0: not known
    std::uint64_t discontinuities = 0;  // before the first one listed
    double longest = 0;                 // seconds of a segment
    std::size_t bytes = 0;              // of whole segments and their maps
    std::optional<Clock::time_point> ended;
    Bytes text;  // of the playlist; null: it is made when it is asked for
    std::string tag;
    std::vector<std::weak_ptr<LiveSegments::Waiting>> waiting;
};

double seconds_of(const std::deque<Segment>& segments) {
    double out = 0;
    for (const auto& segment : segments) out += segment.entry.seconds;
    return out;
}

void forget_segment(Shown& shown, const Segment& segment) {
    if (const auto whole = shown.files.find(segment.entry.uri); whole != shown.files.end()) {
        shown.bytes -= whole->second.content.size();
        shown.files.erase(whole);
    }
    for (const auto& part : segment.entry.parts) shown.files.erase(part.uri);
    const auto uses = shown.uses_of_map.find(segment.entry.map_uri);
    if (uses == shown.uses_of_map.end() || --uses->second > 0) return;
    shown.bytes -= shown.files.at(segment.entry.map_uri).content.size();
    shown.files.erase(segment.entry.map_uri);
    shown.uses_of_map.erase(uses);
}

void take_off_list(Shown& shown) {
    shown.discontinuities += shown.listed.front().entry.discontinuity ? 1u : 0u;
    shown.leaving.push_back(std::move(shown.listed.front()));
    shown.listed.pop_front();
}

void forget_leaving(Shown& shown) {
    forget_segment(shown, shown.leaving.front());
    shown.leaving.pop_front();
}

void forget_all(Shown& shown) {
    while (!shown.listed.empty()) take_off_list(shown);
    while (!shown.leaving.empty()) forget_leaving(shown);
    if (shown.open) {
        shown.discontinuities += shown.open->entry.discontinuity ? 1u : 0u;
        forget_segment(shown, *std::exchange(shown.open, std::nullopt));
        ++shown.next_number;
    }
    shown.text.reset();
}

}  // namespace

// ---- From packets to segments ---------------------------------------------------------------------------------------

namespace {

// Known to the hub's thread alone.
struct Work {
    HubMemory::SharedShare share;
    SharedPacket header{};                       // of the session
    std::uint64_t session = 0;                   // 0: unknown
    std::vector<SharedPacket> before{};          // codebooks since the last frame, while there is no segmenter
    std::optional<StreamSegmenter> segmenter{};  // none: it begins with a frame that can be decoded by itself
    std::size_t held = 0;                        // bytes of it that the share counts
    bool discontinuity = false;                  // the next segment's times begin anew
    Clock::time_point segment_begun{}, asked{}, heard{};
    // Frames that no shown segment begins behind: when each is shown, from the first one on, and when it came.
    struct Arrival {
        std::int64_t begin_us = 0, unix_ms = 0;
    };
    std::deque<Arrival> arrivals{};
    std::optional<std::int64_t> first_us{};  // of the segmenter's first frame
};

// When the frame came with which a segment begins: a segment is there later, with the end of the stream much later.
std::int64_t came_at(Work& work, std::int64_t begin_us) {
    auto& arrivals = work.arrivals;
    while (arrivals.size() > 1 && arrivals[1].begin_us <= begin_us) arrivals.pop_front();
    return arrivals.empty() ? unix_ms() : arrivals.front().unix_ms;
}

bool same_bytes(const SharedPacket& a, const SharedPacket& b) {
    // What is before the payload has the number of the frame that it comes with.
    return a->bytes.size() == b->bytes.size() &&
           std::equal(a->bytes.begin() + packet_header_bytes, a->bytes.end(), b->bytes.begin() + packet_header_bytes);
}

// Timestamps may be anything: what is too much for a number of 64 bits wraps.
std::int64_t sum_of(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
std::int64_t difference_of(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

// Rounds down.
std::int64_t divided(std::int64_t value, std::int64_t by) { return value / by - (value % by < 0 ? 1 : 0); }

std::int64_t microseconds(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

// Streams of a ladder are cut at multiples of a segment's length by the publisher's clock, which they have in common.
SegmentCuts cuts_of(const LiveSegmentOptions& options, bool of_ladder, std::int64_t first_us) {
    const auto length = microseconds(options.seconds);
    if (of_ladder)
        return {.seconds = options.seconds,
                .part_seconds = options.part_seconds,
                .on_grid = true,
                .grid_us = -((first_us % length + length) % length)};
    // Cameras come a little early now and then, and a segment is not to wait for the next access point for that.
    constexpr double early = 0.05;
    return {.seconds = (1 - early) * options.seconds, .part_seconds = options.part_seconds};
}

bool begins_alone(const PacketHeader& header) {
    return header.kind == PacketKind::intra && header.has(packet_flag::referred);
}

}  // namespace

struct LiveSegments::State {
    LiveSegmentOptions options;
    Hub& hub;
    std::string tag = random_tag();
    std::map<std::string, Work> works;
    mutable std::mutex mutex;  // of what follows
    std::map<std::string, Shown> streams;
    LiveSegmentCounters counts;
    std::shared_ptr<std::atomic<std::size_t>> waiting = std::make_shared<std::atomic<std::size_t>>(0);

    State(const LiveSegmentOptions& given, Hub& of) : options(given), hub(of) {
        // Packets for those who watch by socket come first: segments have at most half of a stream's memory.
        options.stream_bytes = std::min(options.stream_bytes, hub.limits().stream_memory / 2);
    }

    void take(const std::string& name, const SharedPacket& packet, Clock::time_point now);
    void push(const std::string& name, Work& work, const SharedPacket& packet, Clock::time_point now);
    void read_header(const std::string& name, Work& work);
    void check(const std::string& name, Work& work, Clock::time_point now);
    void finish(const std::string& name, Work& work);
    void lose(const std::string& name, Work& work);
    void end(const std::string& name);
    void gave_way(const std::string& name);
    void show_what_stands_still(Clock::time_point now);
    void show(const std::string& name, Work& work, StreamSegment segment);
    void begin_segment(const std::string& name, Shown& shown, Work& work, const StreamSegment& segment);
    const Segment* same_of_ladder(const std::string& name, const Segment& segment) const;
    void close_segment(Shown& shown, const Work& work);
    void keep_window(Shown& shown) const;
    void wake(const std::string& name);
    void count_held(Work& work) const;
    void make_text(Shown& shown) const;
    PlaylistVariant variant_of(const Shown& shown) const;
    std::string hint(const Shown& shown) const;
    bool has(const Shown& shown, const Position& position) const;
    Found wait(Shown& shown, const Wake& wake);
};

void LiveSegments::State::take(const std::string& name, const SharedPacket& packet, Clock::time_point now) {
    const auto [found, first] = works.try_emplace(name);
    auto& work = found->second;
    if (first) {
        work.share = hub.share_of(name);
        const std::lock_guard lock(mutex);
        auto& shown = streams[name];
        // A stream of the same name that ended: who comes now begins with this one.
        work.discontinuity = shown.ended.has_value();
        if (std::exchange(shown.ended, std::nullopt)) forget_all(shown);
        shown.share = work.share;
        // A hub that was started again goes on with higher numbers than before, if there were fewer than four segments
        // a second: rounds of a loop may end in short ones.
        shown.next_number = std::max(shown.next_number, static_cast<std::uint64_t>(unix_ms() / 250));
    }
    const auto kind = packet->header.kind;
    if (kind == PacketKind::sequence && (!work.header || !same_bytes(packet, work.header))) {
        // Another session: its times begin anew, and so do all tables.
        finish(name, work);
        work.header = packet;
        read_header(name, work);
        work.before.clear();
        return;
    }
    if (work.segmenter) return push(name, work, packet, now);
    if (!work.header) return;
    if (begins_alone(packet->header)) {
        work.segmenter.emplace(cuts_of(options, ladder_of(name) != name, packet->header.timestamp_us));
        work.segment_begun = now;
        work.arrivals.clear();
        work.first_us.reset();
        const auto before = std::exchange(work.before, {});
        push(name, work, work.header, now);
        for (const auto& one : before) push(name, work, one, now);
        push(name, work, packet, now);
    } else if (packet->is_frame()) {
        work.before.clear();
        const std::chrono::duration<double> since_asked = now - work.asked;
        if (since_asked.count() < options.seconds) return;
        work.asked = now;
        hub.ask_for_key_frame(name, now);
    } else if (kind == PacketKind::codebook) {
        constexpr std::size_t most = 64;
        if (work.before.size() < most) work.before.push_back(packet);
    }
}

void LiveSegments::State::read_header(const std::string& name, Work& work) {
    const std::span<const std::uint8_t> message(work.header->bytes);
    const auto header =
        internal::read_sequence_header(message.subspan(packet_header_bytes, message.size() - packet_overhead));
    work.session = header ? header->session : 0;
    const std::lock_guard lock(mutex);
    streams[name].frames_per_second =
        header ? static_cast<double>(header->fps_numerator) / std::max<double>(header->fps_denominator, 1) : 0;
}

void LiveSegments::State::push(const std::string& name, Work& work, const SharedPacket& packet, Clock::time_point now) {
    if (!work.segmenter) return;
    work.heard = now;
    if (packet->is_frame()) {
        if (!work.first_us) work.first_us = packet->header.timestamp_us;
        constexpr std::size_t most_arrivals = 65536;
        if (work.arrivals.size() < most_arrivals)
            work.arrivals.push_back({difference_of(packet->header.timestamp_us, *work.first_us), unix_ms()});
    }
    const auto room = [&] { return hub.make_room(*work.share, 2 * packet->bytes.size(), now); };
    if (!room()) return lose(name, work);
    auto segment = work.segmenter->push(packet_of(*packet));
    if (!segment) return lose(name, work);
    count_held(work);
    if (*segment) {
        if ((*segment)->ends) work.segment_begun = now;
        show(name, work, std::move(**segment));
    }
    check(name, work, now);
}

// What comes from a publisher that never gives a place to start, or endless tables, does not fill the memory.
void LiveSegments::State::check(const std::string& name, Work& work, Clock::time_point now) {
    constexpr std::size_t most_entries = 256;
    if (work.held > options.stream_bytes / 2 || work.segmenter->entries() > most_entries) return lose(name, work);
    const std::chrono::duration<double> lasts = now - work.segment_begun, since_asked = now - work.asked;
    constexpr double patience = 1;
    if (lasts.count() < 2 * options.seconds + patience || since_asked.count() < options.seconds) return;
    work.asked = now;
    hub.ask_for_key_frame(name, now);
}

void LiveSegments::State::count_held(Work& work) const {
    const auto held = work.segmenter ? work.segmenter->held_bytes() : 0;
    work.share->take(held);
    work.share->give_back(std::exchange(work.held, held));
}

// Shows what there is of the session; the next one begins anew.
void LiveSegments::State::finish(const std::string& name, Work& work) {
    if (!work.segmenter) return;
    if (auto rest = work.segmenter->finish())
        for (auto& segment : *rest) show(name, work, std::move(segment));
    work.segmenter.reset();
    work.discontinuity = true;
    count_held(work);
    const std::lock_guard lock(mutex);
    close_segment(streams[name], work);
}

// Those parts of an unfinished segment stay that players may have already.
void LiveSegments::State::lose(const std::string& name, Work& work) {
    work.segmenter.reset();
    work.before.clear();
    work.discontinuity = true;
    count_held(work);
    {
        const std::lock_guard lock(mutex);
        ++counts.lost;
        close_segment(streams[name], work);
    }
    wake(name);
}

void LiveSegments::State::end(const std::string& name) {
    const auto found = works.find(name);
    if (found == works.end()) return;
    finish(name, found->second);
    works.erase(found);
    {
        const std::lock_guard lock(mutex);
        auto& shown = streams[name];
        shown.ended = Clock::now();
        shown.text.reset();
    }
    wake(name);
}

void LiveSegments::State::gave_way(const std::string& name) {
    if (const auto found = works.find(name); found != works.end()) {
        auto& work = found->second;
        work.segmenter.reset();
        work.before.clear();
        work.discontinuity = true;
        count_held(work);
    }
    const std::lock_guard lock(mutex);
    const auto found = streams.find(name);
    if (found == streams.end()) return;
    forget_all(found->second);
    ++counts.lost;
}

// A stream that falls silent before it has a segment has what came as one, so that there is a playlist of it.
void LiveSegments::State::show_what_stands_still(Clock::time_point now) {
    for (auto& [name, work] : works) {
        const std::chrono::duration<double> silence = now - work.heard;
        if (!work.segmenter || silence.count() < options.seconds) continue;
        {
            const std::lock_guard lock(mutex);
            const auto& shown = streams[name];
            if (!shown.listed.empty() || shown.open) continue;
        }
        finish(name, work);
        wake(name);
    }
}

// ---- From segments to playlists -------------------------------------------------------------------------------------

void LiveSegments::State::show(const std::string& name, Work& work, StreamSegment segment) {
    {
        const std::lock_guard lock(mutex);
        auto& shown = streams[name];
        if (segment.begins) {
            close_segment(shown, work);
            begin_segment(name, shown, work, segment);
        }
        // What goes on with a segment that was given up.
        if (!shown.open) return;
        auto& entry = shown.open->entry;
        const auto seconds = static_cast<double>(segment.end_us - segment.begin_us) / 1e6;
        const auto bytes = counted(text_of(segment.media), work.share);
        // Where there are no parts, this is the whole segment, and nobody asks for it by this name.
        const auto uri = hint(shown);
        shown.files[uri] = {bytes, *bytes};
        entry.parts.push_back({uri, seconds, segment.begins});
        entry.seconds += seconds;
        counts.bytes += bytes->size();
        counts.parts += options.part_seconds > 0 ? 1u : 0u;
        if (segment.ends) close_segment(shown, work);
        shown.text.reset();
    }
    wake(name);
}

// The segment of another rung with frames of the same time, if there is one: numbers and dates follow it.
const Segment* LiveSegments::State::same_of_ladder(const std::string& name, const Segment& segment) const {
    const std::string ladder(ladder_of(name));
    if (ladder == name || segment.session == 0) return nullptr;
    const auto length = microseconds(options.seconds);
    const auto is_same = [&](const Segment& other) {
        return other.session == segment.session &&
               divided(other.timestamp_us, length) == divided(segment.timestamp_us, length);
    };
    for (std::size_t number = 1; number <= most_live_rungs; ++number) {
        const auto found = streams.find(rung_name(ladder, number));
        if (found == streams.end() || found->first == name) continue;
        const auto& other = found->second;
        if (other.open && is_same(*other.open)) return &*other.open;
        for (const auto* list : {&other.listed, &other.leaving})
            for (auto one = list->rbegin(); one != list->rend(); ++one)
                if (is_same(*one)) return &*one;
    }
    return nullptr;
}

void LiveSegments::State::begin_segment(const std::string& name, Shown& shown, Work& work,
                                        const StreamSegment& segment) {
    Segment next;
    next.session = work.session;
    next.timestamp_us = sum_of(work.first_us.value_or(0), segment.begin_us);
    const auto* same = same_of_ladder(name, next);
    const bool listed = !shown.listed.empty() || !shown.leaving.empty();
    if (same && !listed && (!shown.begun || same->number > shown.next_number)) shown.next_number = same->number;
    shown.begun = true;
    next.number = shown.next_number;
    const auto map = text_of(segment.map);
    next.entry.map_uri = "map-" + name_of(map) + ".mp4";
    next.entry.discontinuity = std::exchange(work.discontinuity, false);
    next.entry.unix_ms = came_at(work, segment.begin_us);
    if (same) next.entry.unix_ms = same->entry.unix_ms + difference_of(next.timestamp_us, same->timestamp_us) / 1000;
    if (++shown.uses_of_map[next.entry.map_uri] == 1) {
        const auto bytes = counted(map, work.share);
        shown.files[next.entry.map_uri] = {bytes, *bytes};
        shown.bytes += bytes->size();
        counts.bytes += map.size();
    }
    shown.open = std::move(next);
}

// All parts that came, as the segment.
void LiveSegments::State::close_segment(Shown& shown, const Work& work) {
    if (!shown.open) return;
    auto segment = *std::exchange(shown.open, std::nullopt);
    ++shown.next_number;
    ++counts.segments;
    auto& parts = segment.entry.parts;
    std::string whole;
    for (const auto& part : parts) whole += shown.files.at(part.uri).content;
    segment.entry.uri = std::to_string(segment.number) + '-' + name_of(whole) + ".m4s";
    const auto bytes = counted(std::move(whole), work.share);
    std::size_t begin = 0;
    for (const auto& part : parts) {
        auto& piece = shown.files.at(part.uri);
        piece = {bytes, std::string_view(*bytes).substr(begin, piece.content.size())};
        begin += piece.content.size();
    }
    if (!(options.part_seconds > 0)) {
        shown.files.erase(parts.front().uri);
        parts.clear();
    }
    shown.files[segment.entry.uri] = {bytes, *bytes};
    shown.bytes += bytes->size();
    shown.longest = std::max(shown.longest, segment.entry.seconds);
    shown.listed.push_back(std::move(segment));
    keep_window(shown);
    shown.text.reset();
}

// What leaves the list stays as long again: a list that somebody has may be as old. Where the memory does not do for
// that, what is oldest goes first.
void LiveSegments::State::keep_window(Shown& shown) const {
    const auto window = options.window_seconds;
    // Sessions that end at once have segments that last no time.
    const auto most = static_cast<std::size_t>(16 + 4 * window / options.seconds);
    const auto too_long = [&](const std::deque<Segment>& segments) {
        return segments.size() > most || seconds_of(segments) - segments.front().entry.seconds >= window;
    };
    while (shown.listed.size() > 1 && too_long(shown.listed)) take_off_list(shown);
    while (!shown.leaving.empty() && too_long(shown.leaving)) forget_leaving(shown);
    while (shown.bytes > options.stream_bytes && (!shown.leaving.empty() || shown.listed.size() > 1)) {
        if (shown.leaving.empty()) take_off_list(shown);
        forget_leaving(shown);
    }
}

// The name of the part that comes next.
std::string LiveSegments::State::hint(const Shown& shown) const {
    const auto part = shown.open ? shown.open->entry.parts.size() : 0;
    return std::to_string(shown.next_number) + '-' + tag + '.' + std::to_string(part) + ".m4s";
}

void LiveSegments::State::make_text(Shown& shown) const {
    Playlist list;
    list.kind = PlaylistKind::window;
    list.first_number = shown.listed.empty() ? shown.next_number : shown.listed.front().number;
    list.first_discontinuity = shown.discontinuities;
    list.target_seconds = std::max(shown.longest, options.seconds);
    list.has_end = shown.ended.has_value();
    list.waits = !list.has_end;
    for (const auto& segment : shown.listed) list.segments.push_back(segment.entry);
    // Parts are for who is near the end.
    double behind = 0;
    for (auto segment = list.segments.rbegin(); segment != list.segments.rend(); ++segment) {
        if (behind > 3 * std::ceil(list.target_seconds) || list.has_end) segment->parts.clear();
        behind += segment->seconds;
    }
    if (options.part_seconds > 0 && !list.has_end) {
        list.part_seconds = options.part_seconds;
        for (const auto& segment : list.segments)
            for (const auto& part : segment.parts) list.part_seconds = std::max(list.part_seconds, part.seconds);
        if (shown.open) list.next = shown.open->entry;
        list.hint = hint(shown);
    }
    auto text = write_playlist(list);
    shown.tag = '"' + name_of(text) + '"';
    shown.text = std::make_shared<const std::string>(std::move(text));
}

// What a list of playlists says of it, by the segments that are listed.
PlaylistVariant LiveSegments::State::variant_of(const Shown& shown) const {
    PlaylistVariant out;
    double bits = 0, seconds = 0, most = 0;
    for (const auto& segment : shown.listed) {
        const auto& entry = segment.entry;
        const auto of_segment = 8.0 * static_cast<double>(shown.files.at(entry.uri).content.size());
        bits += of_segment;
        seconds += entry.seconds;
        most = std::max(most, of_segment / std::max(entry.seconds, 0.1));
    }
    out.bits_per_second = static_cast<std::uint64_t>(std::ceil(most));
    out.average = static_cast<std::uint64_t>(std::ceil(bits / std::max(seconds, 0.1)));
    out.frames_per_second = shown.frames_per_second;
    const auto content = shown.files.at(shown.listed.back().entry.map_uri).content;
    const std::span map(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
    out.codecs = codecs_of(map);
    const auto pictures = picture_size_of(map);
    out.width = pictures.width;
    out.height = pictures.height;
    return out;
}

// ---- What is asked for ----------------------------------------------------------------------------------------------

bool LiveSegments::State::has(const Shown& shown, const Position& position) const {
    if (position.segment < shown.next_number) return true;
    const bool in_parts = options.part_seconds > 0 && position.part;
    return in_parts && position.segment == shown.next_number && shown.open &&
           *position.part < shown.open->entry.parts.size();
}

Found LiveSegments::State::wait(Shown& shown, const Wake& wake) {
    Found out;
    out.patience = 3 * std::ceil(std::max(shown.longest, options.seconds));
    if (*waiting >= options.waiting) {
        ++counts.refused_waiting;
        out.state = Found::State::too_many;
        return out;
    }
    std::erase_if(shown.waiting, [](const auto& one) { return one.expired(); });
    out.waiting = std::make_shared<Waiting>(wake, waiting);
    shown.waiting.push_back(out.waiting);
    out.state = Found::State::waits;
    return out;
}

// What is woken asks again, so it is called without the lock.
void LiveSegments::State::wake(const std::string& name) {
    std::vector<Waits> woken;
    {
        const std::lock_guard lock(mutex);
        const auto found = streams.find(name);
        if (found == streams.end()) return;
        for (const auto& one : std::exchange(found->second.waiting, {}))
            if (auto waits = one.lock()) woken.push_back(std::move(waits));
    }
    for (const auto& one : woken) one->wake();
}

LiveSegments::LiveSegments(const LiveSegmentOptions& options, Hub& hub)
    : state_(std::make_unique<State>(options, hub)) {
    auto& state = *state_;
    hub.listen({.sent = [&state](const std::string& stream, const SharedPacket& packet,
                                 Clock::time_point now) { state.take(stream, packet, now); },
                .ended = [&state](const std::string& stream) { state.end(stream); },
                .gave_way = [&state](const std::string& stream) { state.gave_way(stream); }});
}

LiveSegments::~LiveSegments() = default;

Found LiveSegments::playlist(const std::string& stream, const std::optional<Position>& position, const Wake& wake) {
    auto& state = *state_;
    const std::lock_guard lock(state.mutex);
    const auto found = state.streams.find(stream);
    if (found == state.streams.end()) return {};
    auto& shown = found->second;
    const bool empty = shown.listed.empty() && !(shown.open && state.options.part_seconds > 0);
    if (shown.ended && empty) return {};
    if (!shown.ended) {
        if (position && position->segment > shown.next_number + 1) return {.state = Found::State::too_far};
        if (empty || (position && !state.has(shown, *position))) return state.wait(shown, wake);
    }
    if (!shown.text) state.make_text(shown);
    return {.state = Found::State::there, .bytes = shown.text, .content = *shown.text, .tag = shown.tag};
}

Found LiveSegments::ladder(const std::string& name, bool patient, const Wake& wake) {
    if (ladder_of(name) != name) return {};
    auto& state = *state_;
    const std::lock_guard lock(state.mutex);
    std::vector<PlaylistVariant> variants;
    Shown* awaited = nullptr;
    for (std::size_t number = 0; number <= most_live_rungs; ++number) {
        const auto rung = number == 0 ? name : rung_name(name, number);
        const auto found = state.streams.find(rung);
        if (found == state.streams.end()) continue;
        auto& shown = found->second;
        if (!shown.listed.empty()) {
            variants.push_back(state.variant_of(shown));
            variants.back().uri = (number == 0 ? "" : "../" + rung + '/') + std::string("stream.m3u8");
        } else if (!shown.ended) {
            awaited = &shown;
        }
    }
    if (awaited && (patient || variants.empty())) return state.wait(*awaited, wake);
    if (variants.empty()) return {};
    const auto text = std::make_shared<const std::string>(write_variants(variants));
    return {.state = Found::State::there, .bytes = text, .content = *text, .tag = '"' + name_of(*text) + '"'};
}

Found LiveSegments::file(const std::string& stream, const std::string& name, const Wake& wake) {
    auto& state = *state_;
    const std::lock_guard lock(state.mutex);
    const auto found = state.streams.find(stream);
    if (found == state.streams.end()) return {};
    auto& shown = found->second;
    if (const auto file = shown.files.find(name); file != shown.files.end())
        return {.state = Found::State::there, .bytes = file->second.bytes, .content = file->second.content};
    const bool next = state.options.part_seconds > 0 && !shown.ended && name == state.hint(shown);
    return next ? state.wait(shown, wake) : Found{};
}

void LiveSegments::tick(Clock::time_point now) {
    auto& state = *state_;
    state.show_what_stands_still(now);
    const std::lock_guard lock(state.mutex);
    std::erase_if(state.streams, [&](const auto& stream) {
        return stream.second.ended && now - *stream.second.ended > state.options.remembered;
    });
}

LiveSegmentCounters LiveSegments::counters() const {
    const std::lock_guard lock(state_->mutex);
    auto out = state_->counts;
    out.streams = state_->streams.size();
    out.waiting = *state_->waiting;
    for (const auto& [name, shown] : state_->streams) {
        std::map<const std::string*, std::size_t> held;
        for (const auto& [file, piece] : shown.files) held[piece.bytes.get()] = piece.bytes->size();
        for (const auto& [bytes, size] : held) out.held_bytes += size;
    }
    return out;
}

}  // namespace htvm::live
