#include "container/playlist.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "container/box.h"
#include "container/picture_configuration.h"

namespace htvm {
namespace {

constexpr std::size_t most_segments = 1000000, most_uri = 2048;
constexpr double longest = 86400;  // seconds of a segment

std::string hexadecimal(std::uint64_t value, int digits) {
    std::string out;
    for (int i = digits - 1; i >= 0; --i) out += "0123456789abcdef"[(value >> (4 * i)) & 15];
    return out;
}

// Digits, and digits behind a point where `fraction` allows them, up to anything else. Nothing if there is none.
std::optional<double> number_at(std::string_view text, bool fraction) {
    double out = 0, place = 1;
    bool any = false, behind = false;
    for (const char c : text) {
        if (c == '.' && fraction && !behind) {
            behind = true;
            continue;
        }
        if (c < '0' || c > '9') break;
        any = true;
        if (behind) place /= 10;
        out = behind ? out + place * (c - '0') : 10 * out + (c - '0');
    }
    return any ? std::optional(out) : std::nullopt;
}

bool takes(std::string_view& line, std::string_view beginning) {
    if (!line.starts_with(beginning)) return false;
    line.remove_prefix(beginning.size());
    return true;
}

// The value of an attribute in quotes.
std::optional<std::string> quoted(std::string_view attributes, std::string_view name) {
    const auto at = attributes.find(std::string(name) + "=\"");
    if (at == std::string_view::npos) return std::nullopt;
    const auto begin = at + name.size() + 2, end = attributes.find('"', begin);
    if (end == std::string_view::npos) return std::nullopt;
    return std::string(attributes.substr(begin, end - begin));
}

struct Reading {
    Playlist out;
    std::optional<double> seconds;  // of the segment whose name comes next
    std::string map;
};

tl::unexpected<Error> corrupt(const std::string& what) {
    return fail(ErrorKind::corrupt_stream, "the playlist " + what);
}

Result<void> take_tag(Reading& reading, std::string_view line) {
    auto& out = reading.out;
    const auto number = [&](double most, bool fraction) -> Result<double> {
        const auto value = number_at(line, fraction);
        if (!value || *value > most) return corrupt("has a number that is none: " + std::string(line.substr(0, 40)));
        return *value;
    };
    if (takes(line, "#EXTINF:")) {
        const auto value = number(longest, true);
        if (!value) return tl::unexpected(value.error());
        reading.seconds = *value;
    } else if (takes(line, "#EXT-X-TARGETDURATION:")) {
        const auto value = number(longest, true);
        if (!value) return tl::unexpected(value.error());
        out.target_seconds = *value;
    } else if (takes(line, "#EXT-X-MEDIA-SEQUENCE:")) {
        const auto value = number(9007199254740991.0, false);
        if (!value) return tl::unexpected(value.error());
        out.first_number = static_cast<std::uint64_t>(*value);
    } else if (takes(line, "#EXT-X-PLAYLIST-TYPE:")) {
        out.kind = line == "VOD" ? PlaylistKind::whole : PlaylistKind::event;
    } else if (takes(line, "#EXT-X-MAP:")) {
        const auto uri = quoted(line, "URI");
        if (!uri || uri->empty() || uri->size() > most_uri) return corrupt("has a map without a name");
        reading.map = *uri;
        if (line.find("BYTERANGE") != std::string_view::npos)
            return fail(ErrorKind::unsupported, "the playlist has maps that are parts of files");
    } else if (line == "#EXT-X-ENDLIST") {
        out.has_end = true;
    } else if (line.starts_with("#EXT-X-STREAM-INF") || line.starts_with("#EXT-X-BYTERANGE") ||
               (line.starts_with("#EXT-X-KEY") && line.find("METHOD=NONE") == std::string_view::npos)) {
        return fail(ErrorKind::unsupported,
                    "the playlist has " + std::string(line.substr(0, line.find(':'))) + ", which is not read here");
    }
    return {};
}

}  // namespace

namespace {

// To the millionth, with a point wherever this machine is.
std::string decimal(double seconds) {
    std::array<char, 64> out{};
    const auto millionths = static_cast<long long>(std::llround(seconds * 1e6));
    std::snprintf(out.data(), out.size(), "%lld.%06lld", millionths / 1000000, millionths % 1000000);
    return out.data();
}

std::string date(std::int64_t unix_ms) {
    using namespace std::chrono;
    const sys_time<milliseconds> time{milliseconds(unix_ms)};
    const auto day = floor<days>(time);
    const year_month_day date{day};
    const hh_mm_ss clock{time - day};
    std::array<char, 96> out{};
    std::snprintf(out.data(), out.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", static_cast<int>(date.year()),
                  static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                  static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                  static_cast<int>(clock.seconds().count()), static_cast<int>(clock.subseconds().count()));
    return out.data();
}

// That players may ask for what is not there yet, and how far they are to stay behind the end where there are parts.
std::string live_control(const Playlist& playlist) {
    constexpr double parts_behind = 3;
    const bool in_parts = playlist.part_seconds > 0;
    if (!in_parts && !playlist.waits) return "";
    std::string out = std::string("#EXT-X-SERVER-CONTROL:") + (playlist.waits ? "CAN-BLOCK-RELOAD=YES" : "");
    if (in_parts)
        out += (playlist.waits ? "," : "") + ("PART-HOLD-BACK=" + decimal(parts_behind * playlist.part_seconds)) +
               "\n#EXT-X-PART-INF:PART-TARGET=" + decimal(playlist.part_seconds);
    return out + "\n";
}

// What comes before a segment's own name, or before that of its next part.
std::string before_segment(const PlaylistSegment& segment, std::string& map) {
    std::string out;
    if (segment.discontinuity) out += "#EXT-X-DISCONTINUITY\n";
    if (segment.map_uri != map) out += "#EXT-X-MAP:URI=\"" + segment.map_uri + "\"\n";
    map = segment.map_uri;
    if (segment.unix_ms > 0) out += "#EXT-X-PROGRAM-DATE-TIME:" + date(segment.unix_ms) + "\n";
    for (const auto& part : segment.parts)
        out += "#EXT-X-PART:DURATION=" + decimal(part.seconds) + ",URI=\"" + part.uri + '"' +
               (part.independent ? ",INDEPENDENT=YES" : "") + "\n";
    return out;
}

}  // namespace

std::string write_playlist(const Playlist& playlist) {
    double longest_segment = std::max(playlist.target_seconds, 1.0);
    for (const auto& segment : playlist.segments) longest_segment = std::max(longest_segment, segment.seconds);
    const bool in_parts = playlist.part_seconds > 0;
    std::string out = std::string("#EXTM3U\n#EXT-X-VERSION:") + (in_parts ? "9" : "7") + "\n";
    out += "#EXT-X-TARGETDURATION:" + std::to_string(static_cast<long>(std::ceil(longest_segment - 0.0005))) + "\n";
    out += live_control(playlist);
    out += "#EXT-X-MEDIA-SEQUENCE:" + std::to_string(playlist.first_number) + "\n";
    if (playlist.first_discontinuity > 0)
        out += "#EXT-X-DISCONTINUITY-SEQUENCE:" + std::to_string(playlist.first_discontinuity) + "\n";
    if (playlist.kind == PlaylistKind::whole) out += "#EXT-X-PLAYLIST-TYPE:VOD\n";
    if (playlist.kind == PlaylistKind::event) out += "#EXT-X-PLAYLIST-TYPE:EVENT\n";
    out += "#EXT-X-INDEPENDENT-SEGMENTS\n";
    std::string map;
    for (const auto& segment : playlist.segments)
        out += before_segment(segment, map) + "#EXTINF:" + decimal(segment.seconds) + ",\n" + segment.uri + "\n";
    if (!playlist.next.parts.empty()) out += before_segment(playlist.next, map);
    if (!playlist.hint.empty()) out += "#EXT-X-PRELOAD-HINT:TYPE=PART,URI=\"" + playlist.hint + "\"\n";
    if (playlist.has_end) out += "#EXT-X-ENDLIST\n";
    return out;
}

Result<Playlist> read_playlist(std::string_view text) {
    if (!text.starts_with("#EXTM3U")) return corrupt("does not begin with #EXTM3U");
    Reading reading;
    reading.out.kind = PlaylistKind::window;
    reading.out.has_end = false;
    while (!text.empty()) {
        auto line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(text.size(), line.size() + 1));
        while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
        if (line.empty()) continue;
        if (line[0] == '#') {
            if (auto ok = take_tag(reading, line); !ok) return tl::unexpected(ok.error());
            continue;
        }
        if (line.size() > most_uri) return corrupt("has a name that is too long");
        if (!reading.seconds) return corrupt("has a segment without #EXTINF: " + std::string(line.substr(0, 80)));
        if (reading.map.empty()) return corrupt("has a segment without #EXT-X-MAP: " + std::string(line.substr(0, 80)));
        if (reading.out.segments.size() >= most_segments)
            return fail(ErrorKind::limit, "the playlist has more segments than are taken");
        reading.out.segments.push_back({std::string(line), reading.map, *reading.seconds});
        reading.seconds.reset();
    }
    return std::move(reading.out);
}

std::string write_variants(const std::vector<PlaylistVariant>& variants) {
    std::string out = "#EXTM3U\n#EXT-X-VERSION:7\n#EXT-X-INDEPENDENT-SEGMENTS\n";
    for (const auto& variant : variants) {
        out += "#EXT-X-STREAM-INF:BANDWIDTH=" + std::to_string(variant.bits_per_second) +
               ",AVERAGE-BANDWIDTH=" + std::to_string(variant.average);
        if (variant.width > 0)
            out += ",RESOLUTION=" + std::to_string(variant.width) + "x" + std::to_string(variant.height);
        if (!variant.codecs.empty()) out += ",CODECS=\"" + variant.codecs + "\"";
        if (variant.frames_per_second > 0) {
            std::array<char, 32> rate{};
            std::snprintf(rate.data(), rate.size(), "%.3f", variant.frames_per_second);
            out += ",FRAME-RATE=" + std::string(rate.data());
        }
        out += "\n" + variant.uri + "\n";
    }
    return out;
}

std::vector<PlaylistVariant> read_variants(std::string_view text) {
    constexpr std::size_t most_variants = 64;
    std::vector<PlaylistVariant> out;
    std::optional<PlaylistVariant> told;
    while (!text.empty() && out.size() < most_variants) {
        auto line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(text.size(), line.size() + 1));
        while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
        if (takes(line, "#EXT-X-STREAM-INF:")) {
            told.emplace();
            constexpr std::string_view name = "BANDWIDTH=";
            for (auto at = line.find(name); at != std::string_view::npos; at = line.find(name, at + 1)) {
                const auto value = number_at(line.substr(at + name.size()), false);
                if (!value || *value > 1e15) continue;
                const bool average = at > 0 && line[at - 1] == '-';
                (average ? told->average : told->bits_per_second) = static_cast<std::uint64_t>(*value);
            }
            told->codecs = quoted(line, "CODECS").value_or("");
        } else if (!line.empty() && line[0] != '#' && told) {
            told->uri = line.substr(0, most_uri);
            out.push_back(std::move(*told));
            told.reset();
        }
    }
    return out;
}

namespace {

std::string two_digits(unsigned value) {
    return {static_cast<char>('0' + value / 10), static_cast<char>('0' + value % 10)};
}

constexpr std::size_t visual_fields = 78;  // of a sample entry of pictures, before its boxes

// As "av01.0.08M.08", "vp09.00.31.08" or "avc3.64001f", by the record of its configuration.
std::string codec_of(const MediaBox& entry) {
    if (entry.type == four("Opus")) return "opus";
    if (entry.type == four("htvm")) return "htvm";
    if (entry.inside.size() < visual_fields) return {};
    const auto inside = entry.inside.subspan(visual_fields);
    if (const auto record = find_box(inside, four("av1C")); record && record->inside.size() >= 4) {
        const auto profile = record->inside[1] >> 5, level = record->inside[1] & 31;
        const bool high_tier = (record->inside[2] & 0x80) != 0, high_depth = (record->inside[2] & 0x40) != 0;
        const bool twelve = (record->inside[2] & 0x20) != 0;
        return "av01." + std::to_string(profile) + "." + two_digits(static_cast<unsigned>(level)) +
               (high_tier ? "H." : "M.") + (high_depth ? twelve ? "12" : "10" : "08");
    }
    if (const auto record = find_box(inside, four("vpcC")); record && record->inside.size() >= 7)
        return "vp09." + two_digits(record->inside[4] % 100) + "." + two_digits(record->inside[5] % 100) + "." +
               two_digits(record->inside[6] >> 4);
    if (const auto record = find_box(inside, four("avcC")); record && record->inside.size() >= 4) {
        std::string out = "avc3.";
        for (const auto byte : record->inside.subspan(1, 3))
            for (const auto digit : {byte >> 4, byte & 15}) out += "0123456789abcdef"[digit];
        return out;
    }
    return {};
}

// The first sample entry of each track that a map has.
std::vector<MediaBox> entries_of(std::span<const std::uint8_t> map) {
    std::vector<MediaBox> out;
    const auto movie = find_box(map, four("moov"));
    if (!movie) return out;
    BoxReader in(movie->inside);
    while (const auto track = in.next()) {
        if (track->type != four("trak")) continue;
        std::optional<MediaBox> box = track;
        for (const auto type : {four("mdia"), four("minf"), four("stbl"), four("stsd")})
            if (box) box = find_box(box->inside, type);
        constexpr std::size_t count_fields = 8;
        if (!box || box->inside.size() < count_fields) continue;
        BoxReader entries(box->inside.subspan(count_fields));
        if (const auto entry = entries.next()) out.push_back(*entry);
    }
    return out;
}

}  // namespace

std::string codecs_of(std::span<const std::uint8_t> map) {
    std::string out;
    for (const auto& entry : entries_of(map))
        if (const auto codec = codec_of(entry); !codec.empty()) out += (out.empty() ? "" : ",") + codec;
    return out;
}

PictureSize picture_size_of(std::span<const std::uint8_t> map) {
    constexpr std::size_t width_at = 24, height_at = 26;
    for (const auto& entry : entries_of(map)) {
        if (!is_picture_entry(entry.type) || entry.inside.size() < visual_fields) continue;
        const auto number_at = [&](std::size_t at) {
            return static_cast<std::uint32_t>(entry.inside[at] << 8 | entry.inside[at + 1]);
        };
        return {number_at(width_at), number_at(height_at)};
    }
    return {};
}

bool is_name_below(std::string_view uri) {
    if (uri.empty() || uri[0] == '/' || uri.size() > most_uri) return false;
    if (uri.find_first_of(":\\?#%") != std::string_view::npos || uri.find('\0') != std::string_view::npos) return false;
    for (std::size_t begin = 0; begin <= uri.size();) {
        const auto end = std::min(uri.find('/', begin), uri.size());
        const auto part = uri.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..") return false;
        begin = end + 1;
    }
    return true;
}

std::string name_by_content(std::span<const std::uint8_t> bytes) {
    // FNV-1a, and a second hash of another kind. A CRC-32 would be the same for all that ends with its own, as maps do.
    std::uint64_t hash = 0xcbf29ce484222325, other = bytes.size();
    for (const auto byte : bytes) {
        hash = (hash ^ byte) * 0x100000001b3;
        other = (other + byte + 1) * 0x9e3779b97f4a7c15;
        other ^= other >> 29;
    }
    return hexadecimal(hash, 16) + hexadecimal(other >> 32, 8);
}

}  // namespace htvm
