#include "io/ogg_opus.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include "core/bytes.h"
#include "core/opus_packet.h"
#include "io/mesh_file.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::uint64_t most_bytes = std::uint64_t{1} << 30;
constexpr const char* advice = "; ffmpeg makes one of any sound: ffmpeg -i SOUND -ac 2 -c:a libopus sound.opus";

tl::unexpected<Error> damaged(std::string_view what) {
    return fail(ErrorKind::bad_input, "the Ogg Opus file is damaged: " + std::string(what));
}

// CRC-32 of Ogg: the polynomial of zlib, but not reflected, and without a first or last exclusive-or.
std::uint32_t ogg_crc(std::span<const std::uint8_t> bytes, std::uint32_t crc) {
    static const auto table = [] {
        std::array<std::uint32_t, 256> out{};
        for (std::uint32_t n = 0; n < out.size(); ++n) {
            out[n] = n << 24;
            for (int bit = 0; bit < 8; ++bit) out[n] = (out[n] << 1) ^ ((out[n] >> 31) != 0 ? 0x04c11db7u : 0);
        }
        return out;
    }();
    for (const auto byte : bytes) crc = (crc << 8) ^ table[(crc >> 24) ^ byte];
    return crc;
}

constexpr std::size_t sum_at = 22;  // of a page: where its sum is

// The sum of a page is that with zeros in its place.
std::uint32_t page_sum(std::span<const std::uint8_t> page) {
    auto sum = ogg_crc(page.first(sum_at), 0);
    sum = ogg_crc(std::array<std::uint8_t, 4>{}, sum);
    return ogg_crc(page.subspan(sum_at + 4), sum);
}

struct Page {
    bool continues = false, first = false, last = false;
    std::int64_t granule = -1;  // samples up to the end of the last packet that ends in it, pre-skip included
    std::uint32_t serial = 0, number = 0;
    std::span<const std::uint8_t> lacing, body;
};

// The page at the beginning of the bytes; nothing if there is none, or a damaged one.
std::optional<Page> read_page(std::span<const std::uint8_t> bytes, std::size_t& size) {
    ByteReader in(bytes);
    const auto mark = in.bytes(4);
    if (!in.ok() || std::memcmp(mark.data(), "OggS", 4) != 0 || in.u8() != 0) return std::nullopt;
    Page page;
    const auto flags = in.u8();
    page.continues = (flags & 1) != 0;
    page.first = (flags & 2) != 0;
    page.last = (flags & 4) != 0;
    page.granule = static_cast<std::int64_t>(in.u64());
    page.serial = in.u32();
    page.number = in.u32();
    const auto stored = in.u32();
    page.lacing = in.bytes(in.u8());
    std::size_t body = 0;
    for (const auto length : page.lacing) body += length;
    page.body = in.bytes(body);
    if (!in.ok()) return std::nullopt;
    size = in.position();
    if (page_sum(bytes.first(size)) != stored) return std::nullopt;
    return page;
}

bool begins_with(std::span<const std::uint8_t> bytes, std::string_view text) {
    return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// The packet "OpusHead".
Result<OpusTrack> read_head(std::span<const std::uint8_t> packet) {
    ByteReader in(packet.subspan(8));
    const auto version = in.u8();
    OpusTrack out;
    out.channels = in.u8();
    out.pre_skip = in.u16();
    (void)in.u32();  // the rate of what was coded: Opus is decoded at 48 kHz whatever that was
    out.gain = static_cast<std::int16_t>(in.u16());
    const auto family = in.u8();
    if (!in.ok()) return damaged("its header is cut short");
    if (version >= 16)
        return fail(ErrorKind::unsupported, "the Ogg Opus file is of version " + std::to_string(version));
    if (family != 0 || out.channels < 1 || out.channels > 2)
        return fail(ErrorKind::unsupported, "the sound has " + std::to_string(out.channels) +
                                                " channels, and streams have one or two" + advice);
    return out;
}

// Packets one behind the other, on pages of about a second.
class PageWriter {
public:
    // granule: samples up to the packet's end, pre-skip included.
    void add(std::span<const std::uint8_t> packet, std::int64_t granule) {
        for (;;) {
            if (lacing_.size() == 255) close();
            const auto piece = packet.first(std::min<std::size_t>(packet.size(), 255));
            lacing_.push_back(static_cast<std::uint8_t>(piece.size()));
            body_.insert(body_.end(), piece.begin(), piece.end());
            packet = packet.subspan(piece.size());
            open_ = piece.size() == 255;
            if (!open_) break;
        }
        granule_ = granule;
    }
    // The page ends here; last: and with it the file.
    void close(bool last = false) {
        ByteWriter page;
        for (const char c : {'O', 'g', 'g', 'S', '\0'}) page.u8(static_cast<std::uint8_t>(c));
        page.u8(static_cast<std::uint8_t>((continues_ ? 1 : 0) | (number_ == 0 ? 2 : 0) | (last ? 4 : 0)));
        page.u64(static_cast<std::uint64_t>(granule_));
        page.u32(0x6874766d);  // the number of the only stream in the file
        page.u32(number_++);
        page.u32(0);
        page.u8(static_cast<std::uint8_t>(lacing_.size()));
        page.bytes(lacing_);
        page.bytes(body_);
        auto bytes = page.take();
        const auto sum = page_sum(bytes);
        for (int n = 0; n < 4; ++n)
            bytes[sum_at + static_cast<std::size_t>(n)] = static_cast<std::uint8_t>(sum >> (8 * n));
        file_.insert(file_.end(), bytes.begin(), bytes.end());
        continues_ = open_;
        granule_ = -1;
        lacing_.clear();
        body_.clear();
    }
    std::vector<std::uint8_t> take() { return std::move(file_); }

private:
    std::vector<std::uint8_t> file_, lacing_, body_;
    std::int64_t granule_ = -1;  // of the last packet that ends on the page
    std::uint32_t number_ = 0;
    bool open_ = false, continues_ = false;
};

void put_text(ByteWriter& out, std::string_view text) {
    for (const char c : text) out.u8(static_cast<std::uint8_t>(c));
}

}  // namespace

std::vector<std::uint8_t> write_ogg_opus(const OpusTrack& track) {
    PageWriter pages;
    ByteWriter head;
    put_text(head, "OpusHead");
    head.u8(1);
    head.u8(track.channels);
    head.u16(static_cast<std::uint16_t>(track.pre_skip));
    head.u32(48000);
    head.u16(static_cast<std::uint16_t>(track.gain));
    head.u8(0);
    pages.add(head.data(), 0);
    pages.close();
    ByteWriter tags;
    put_text(tags, "OpusTags");
    tags.u32(4);
    put_text(tags, "htvm");
    tags.u32(0);
    pages.add(tags.data(), 0);
    pages.close();
    const std::uint64_t end = track.pre_skip + track.samples;
    std::uint64_t decoded = 0, page_begin = 0;
    for (const auto& packet : track.packets) {
        if (decoded >= end) break;
        if (decoded >= page_begin + 48000) {
            pages.close();
            page_begin = decoded;
        }
        decoded += opus_samples(packet).value_or(0);
        pages.add(packet, static_cast<std::int64_t>(std::min(decoded, end)));
    }
    pages.close(true);
    return pages.take();
}

Result<OpusTrack> read_ogg_opus(std::span<const std::uint8_t> file) {
    std::optional<OpusTrack> track;
    std::uint32_t serial = 0, next_number = 0;
    std::size_t headers = 0;
    std::vector<std::uint8_t> packet;  // what earlier pages have of the next one
    bool open = false, ended = false;
    std::uint64_t decoded = 0, decoded_at_first = 0;  // samples, of all packets so far; of the first page's
    std::uint64_t first_granule = 0, last_granule = 0;
    const auto take = [&]() -> Result<void> {
        if (headers == 0) {
            auto head = read_head(packet);
            if (!head) return tl::unexpected(head.error());
            track = std::move(*head);
        } else if (headers > 1) {
            const auto samples = opus_samples(packet);
            if (!samples) return damaged("a packet of Opus is malformed");
            decoded += *samples;
            track->packets.push_back(packet);
        }
        headers = std::min<std::size_t>(headers + 1, 2);
        packet.clear();
        return {};
    };
    for (std::size_t at = 0; at < file.size() && !ended;) {
        std::size_t size = 0;
        const auto page = read_page(file.subspan(at), size);
        if (!page && at == 0) return fail(ErrorKind::bad_input, std::string("it is no Ogg Opus file") + advice);
        if (!page) return damaged("there is no page at byte " + std::to_string(at));
        at += size;
        // Other streams, such as a film's picture, may lie between.
        if (!track && !(page->first && begins_with(page->body, "OpusHead"))) continue;
        if (!track) {
            serial = page->serial;
            next_number = page->number;
        }
        if (page->serial != serial) continue;
        if (page->number != next_number++) return damaged("a page is missing before byte " + std::to_string(at));
        if (page->continues != open) return damaged("a packet has no beginning, or no end");
        std::size_t begin = 0;
        for (const auto length : page->lacing) {
            const auto piece = page->body.subspan(begin, length);
            packet.insert(packet.end(), piece.begin(), piece.end());
            begin += length;
            open = length == 255;
            if (open) continue;
            if (auto taken = take(); !taken) return tl::unexpected(taken.error());
        }
        if (page->granule >= 0 && decoded > 0) {
            last_granule = static_cast<std::uint64_t>(page->granule);
            if (decoded_at_first == 0) first_granule = last_granule;
            if (decoded_at_first == 0) decoded_at_first = decoded;
        }
        ended = page->last;
    }
    if (!track) return fail(ErrorKind::bad_input, std::string("it is no Ogg Opus file") + advice);
    if (open || track->packets.empty()) return damaged("it ends too early");
    // A recording that was cut out counts samples that are not there, before its first. The last page may end before
    // its last packet does.
    const std::uint64_t missing = first_granule > decoded_at_first ? first_granule - decoded_at_first : 0;
    const std::uint64_t end = last_granule >= missing ? std::min(decoded, last_granule - missing) : decoded;
    track->samples = end > track->pre_skip ? end - track->pre_skip : 0;
    if (track->samples == 0) return damaged("there is no sound in it");
    return std::move(*track);
}

Result<OpusTrack> read_ogg_opus(const std::filesystem::path& path) {
    const auto bytes = read_file(path, most_bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    auto track = read_ogg_opus(*bytes);
    if (!track) return fail(track.error().kind, path.string() + ": " + track.error().message);
    return track;
}

}  // namespace htvm
