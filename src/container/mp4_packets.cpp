#include "container/mp4_packets.h"

#include <algorithm>

#include "core/bytes.h"
#include "core/crc32.h"
#include "htvm/decoder.hpp"
#include "htvm/packet.hpp"

namespace htvm {

using namespace internal;

Result<Mp4Packets> Mp4Packets::open(FileBytes file, std::uint64_t max_packet_bytes, bool goes_on) {
    auto tables = read_mp4_tables(file);
    if (!tables) return tl::unexpected(tables.error());
    Mp4Packets out;
    out.file_ = std::move(file);
    out.max_packet_bytes_ = max_packet_bytes;
    out.tracks_ = std::move(tables->tracks);
    out.missing_ = tables->missing_bytes;
    out.goes_on_ = goes_on;
    bool has_meshes = false;
    for (std::size_t i = 0; i < out.tracks_.size(); ++i) {
        const auto& track = out.tracks_[i];
        if (track.kind == SampleTrack::meshes) {
            if (!has_meshes) out.meshes_ = i;
            has_meshes = true;
            continue;
        }
        Other other;
        other.track = i;
        for (const auto& sample : track.samples) other.ends.push_back(other.ends.back() + sample.size);
        out.others_.push_back(std::move(other));
    }
    return out;
}

std::optional<std::vector<std::uint8_t>> Mp4Packets::next() {
    constexpr std::uint32_t most_sample_bytes = std::uint32_t{1} << 30;
    const auto& samples = tracks_[meshes_].samples;
    while (next_ < samples.size()) {
        const auto& sample = samples[next_];
        const bool first = next_++ == 0 && !goes_on_;
        std::vector<std::uint8_t> bytes;
        if (sample.size <= most_sample_bytes) bytes.resize(sample.size);
        if (bytes.size() != sample.size || !file_.read(sample.offset, bytes)) {
            damaged_ += sample.size;
            continue;
        }
        auto out = rebuilt(bytes);
        if (!first) return std::move(out.bytes);
        auto whole = configuration(sample, out.has_header);
        whole.insert(whole.end(), out.bytes.begin(), out.bytes.end());
        return whole;
    }
    return std::nullopt;
}

// The packets of the sample, of which some lie in part in other tracks.
Mp4Packets::Rebuilt Mp4Packets::rebuilt(std::span<const std::uint8_t> sample) {
    Rebuilt out;
    // Who begins in the middle has no frame that sound before the first one is of.
    bool hears = next_ > 1 || goes_on_;
    const auto copy = [&](std::size_t bytes) {
        out.bytes.insert(out.bytes.end(), sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(bytes));
        sample = sample.subspan(bytes);
    };
    while (!sample.empty()) {
        std::uint32_t payload = 0;
        if (sample.size() >= parted_header_bytes &&
            std::equal(parted_sync.begin(), parted_sync.end(), sample.begin())) {
            ByteReader in(sample.subspan(parted_header_bytes - 4));
            const auto prefix = in.u32();
            if (prefix <= sample.size() - parted_header_bytes) {
                const auto whole = sample.first(parted_header_bytes + prefix);
                const bool sound = whole[parted_sync.size()] == static_cast<std::uint8_t>(SampleTrack::sound);
                if ((hears || !sound) && !rebuild_parted(whole, prefix, out.bytes)) damaged_ += whole.size();
                sample = sample.subspan(whole.size());
                continue;
            }
        }
        const auto header = read_packet_header(sample, payload);
        if (!header || payload > sample.size() - std::min(sample.size(), packet_overhead)) {
            copy(sample.size());  // damage, which a PacketReader finds its way through
            continue;
        }
        hears = hears || frame_type(header->kind).has_value();
        out.has_header = out.has_header || header->kind == PacketKind::sequence;
        copy(packet_overhead + payload);
    }
    return out;
}

// Appends the packet whose beginning is in the track of meshes. False if the rest, in a track that is there, is not
// found; where there is no such track, as when only meshes were kept, the packet is left out.
bool Mp4Packets::rebuild_parted(std::span<const std::uint8_t> parted, std::size_t prefix,
                                std::vector<std::uint8_t>& out) {
    ByteReader in(parted.subspan(parted_sync.size()));
    const auto kind = static_cast<SampleTrack>(in.u8());
    in.u8();
    const auto samples = in.u16();
    const auto header_bytes = in.bytes(packet_header_bytes);
    const auto crc = in.u32();
    std::uint32_t payload_bytes = 0;
    if (!read_packet_header(header_bytes, payload_bytes) || payload_bytes < prefix || samples == 0) return false;
    if (payload_bytes > max_packet_bytes_) return true;
    bool any = false, is_cut_off = false;
    for (auto& other : others_) {
        if (tracks_[other.track].kind != kind) continue;
        any = true;
        const auto payload = find_payload(other, parted.last(prefix), payload_bytes, samples, crc);
        if (!payload) {
            const auto left = tracks_[other.track].samples.size() - other.next;
            other.has_ended = other.has_ended || (missing_ > 0 && samples > left);
            is_cut_off = is_cut_off || other.has_ended;
            continue;
        }
        out.insert(out.end(), header_bytes.begin(), header_bytes.end());
        out.insert(out.end(), payload->begin(), payload->end());
        for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(crc >> (8 * i)));
        return true;
    }
    if (is_cut_off) cut_off_ += parted.size();
    return !any;
}

// The payload: what is known of its beginning, and the next samples with which its checksum fits: those behind the last
// that were taken, or, where tools have left some out, later ones.
std::optional<std::vector<std::uint8_t>> Mp4Packets::find_payload(Other& other, std::span<const std::uint8_t> beginning,
                                                                  std::size_t bytes, std::size_t samples,
                                                                  std::uint32_t crc) {
    constexpr std::size_t most_looked_at = 4096;
    const auto most_in_vain = (std::uint64_t{1} << 26) + 4 * file_.size;
    const auto& all = tracks_[other.track].samples;
    const auto wanted = bytes - beginning.size();
    for (auto first = other.next; samples <= all.size() && first <= all.size() - samples; ++first) {
        if (first - other.next >= most_looked_at || in_vain_ > most_in_vain) return std::nullopt;
        // Samples of this size are there before memory is taken for them.
        if (other.ends[first + samples] - other.ends[first] != wanted) continue;
        std::vector<std::uint8_t> payload(bytes);
        std::copy(beginning.begin(), beginning.end(), payload.begin());
        auto place = std::span(payload).subspan(beginning.size());
        bool whole = true;
        for (auto i = first; i < first + samples && whole; ++i) {
            whole = file_.read(all[i].offset, place.first(all[i].size));
            place = place.subspan(all[i].size);
        }
        if (whole && crc32(payload) == crc) {
            other.next = first + samples;
            return payload;
        }
        in_vain_ += bytes;
    }
    return std::nullopt;
}

// What comes before the first sample: the index, and what the record of the configuration has for who begins here. The
// sequence header comes only if it is needed, as a stream's first sample has its own.
std::vector<std::uint8_t> Mp4Packets::configuration(const Mp4Sample& first, bool has_header) const {
    const auto& records = tracks_[meshes_].configurations;
    if (first.entry >= records.size()) return {};
    PacketReader reader(static_cast<std::size_t>(std::min<std::uint64_t>(max_packet_bytes_, SIZE_MAX)));
    reader.push(records[first.entry]);
    std::vector<Packet> packets;
    while (auto packet = reader.pull()) packets.push_back(std::move(*packet));
    const auto is_needed = [](const Packet& packet) {
        return packet.kind != PacketKind::front_index && packet.kind != PacketKind::sequence;
    };
    const bool needed = std::any_of(packets.begin(), packets.end(), is_needed);
    std::vector<std::uint8_t> out;
    for (const auto& packet : packets) {
        if (packet.kind == PacketKind::sequence && has_header && !needed) continue;
        const auto bytes = write_packet(packet);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return out;
}

}  // namespace htvm
