#include "container/stream_samples.h"

#include <algorithm>
#include <utility>

#include "container/picture_configuration.h"
#include "core/bytes.h"
#include "core/opus_packet.h"
#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"

namespace htvm {

using namespace internal;
namespace {

// Whether the packet is the first that comes with a frame, where one is there already.
bool comes_before_frames(PacketKind kind) {
    return kind == PacketKind::sequence || kind == PacketKind::codebook || frame_type(kind).has_value();
}

// Which of the entries this one is; it becomes the last if it is new. Nothing where there are too many.
template <class Entry>
std::optional<std::uint16_t> place_of(std::vector<Entry>& entries, Entry entry) {
    constexpr std::size_t most = 65000;
    const auto found = std::find(entries.begin(), entries.end(), entry);
    const auto place = static_cast<std::size_t>(found - entries.begin());
    if (place >= most) return std::nullopt;
    if (found == entries.end()) entries.push_back(std::move(entry));
    return static_cast<std::uint16_t>(place);
}

// What stands for a packet of which all behind `prefix` bytes of its payload are samples of another track.
std::vector<std::uint8_t> parted(std::span<const std::uint8_t> whole, std::size_t prefix, SampleTrack track,
                                 std::size_t samples) {
    ByteWriter out;
    out.bytes(parted_sync);
    out.u8(static_cast<std::uint8_t>(track));
    out.u8(0);
    out.u16(static_cast<std::uint16_t>(samples));
    out.bytes(whole.first(packet_header_bytes));
    out.bytes(whole.last(4));
    out.u32(static_cast<std::uint32_t>(prefix));
    out.bytes(whole.subspan(packet_header_bytes, prefix));
    return out.take();
}

void append(std::vector<std::uint8_t>& to, std::span<const std::uint8_t> bytes) {
    to.insert(to.end(), bytes.begin(), bytes.end());
}

}  // namespace

std::optional<StreamSample> StreamSampler::push(Packet packet) {
    std::optional<StreamSample> out;
    if (has_frame_ && comes_before_frames(packet.kind)) out = complete();
    const auto header = header_with_flags(packet);
    numbers_.push(header);
    time_.push(packet, numbers_.begins_sequence());
    const auto place = places_++;
    if (!sample_) {
        sample_.emplace();
        sample_->number = ++samples_;
        sample_->tracks[0].emplace_back();
        begin_place_ = place;
    }
    auto whole = write_packet(packet);
    if (packet.kind == PacketKind::sequence) {
        const auto version =
            packet.payload.size() < 6 ? 0u : unsigned{packet.payload[4]} | unsigned{packet.payload[5]} << 8;
        // One that is repeated differs in the number of the frame that it comes with, and says the same.
        const auto same = std::find_if(entries_.meshes.begin(), entries_.meshes.end(), [&](const MeshEntry& entry) {
            return entry.header.size() == whole.size() &&
                   std::equal(packet.payload.begin(), packet.payload.end(), entry.header.begin() + packet_header_bytes);
        });
        if (same != entries_.meshes.end())
            mesh_entry_ = static_cast<std::uint16_t>(same - entries_.meshes.begin());
        else
            mesh_entry_ = place_of(entries_.meshes, {whole, static_cast<std::uint16_t>(version)});
    }
    if (frame_type(packet.kind)) add_frame(packet);
    const bool elsewhere = (packet.kind == PacketKind::texture && add_picture(packet, whole)) ||
                           (packet.kind == PacketKind::audio && add_sound(packet, whole));
    if (!elsewhere) append(sample_->tracks[0][0].bytes, whole);
    if (comes_before_frames(packet.kind) || packet.kind == PacketKind::texture) {
        stored_bytes_ += whole.size();
        stored_[place] = {sample_->number, std::move(whole)};
    }
    return out;
}

std::size_t StreamSampler::held_bytes() const {
    std::size_t out = stored_bytes_;
    if (sample_)
        for (const auto& track : sample_->tracks)
            for (const auto& one : track) out += one.bytes.size();
    return out;
}

bool StreamSampler::is_usable(SampleTrack track, std::uint16_t entry) const {
    if (!usable_) return true;
    const auto& usable = (*usable_)[static_cast<std::size_t>(track)];
    return std::find(usable.begin(), usable.end(), entry) != usable.end();
}

void StreamSampler::add_frame(const Packet& packet) {
    has_frame_ = true;
    auto& mesh = sample_->tracks[0][0];
    if (!mesh_entry_) mesh_entry_ = place_of(entries_.meshes, {});
    mesh.entry = mesh_entry_.value_or(0);
    mesh.time = static_cast<std::int64_t>(std::min(time_.microseconds(), longest_us));
    frame_timestamp_us_ = packet.timestamp_us;
    if (header_with_flags(packet).has(packet_flag::access)) closure_ = numbers_.dependencies().closure();
}

// Whether the coded picture is a sample of the track of pictures now.
bool StreamSampler::add_picture(const Packet& packet, std::span<const std::uint8_t> whole) {
    auto& samples = sample_->tracks[static_cast<std::size_t>(SampleTrack::pictures)];
    const auto picture = read_texture_picture(packet);
    if (!has_frame_ || !samples.empty() || !picture || !is_video(picture->coder)) return false;
    const bool key = is_key_picture(packet);
    if (key) {
        auto configuration = picture_configuration(*picture);
        picture_entry_.reset();
        if (configuration)
            picture_entry_ = place_of(entries_.pictures, {picture->coder, picture->width, picture->height,
                                                          picture->matrix, picture->full_range, *configuration});
        // The pictures that go on from it then stay whole, too.
        if (picture_entry_ && !is_usable(SampleTrack::pictures, *picture_entry_)) picture_entry_.reset();
    }
    if (!picture_entry_ || !is_usable(SampleTrack::pictures, *picture_entry_)) return false;
    const auto& entry = entries_.pictures[*picture_entry_];
    const auto delimiter = delimiter_bytes(*picture);
    if (entry.coder != picture->coder || delimiter >= picture->coded.size()) return false;
    TrackSample sample;
    sample.time = sample_->mesh().time;
    sample.entry = *picture_entry_;
    sample.sync = key;
    const auto coded = picture->coded.subspan(delimiter);
    sample.bytes.assign(coded.begin(), coded.end());
    append(sample_->tracks[0][0].bytes, parted(whole, packet.payload.size() - coded.size(), SampleTrack::pictures, 1));
    samples.push_back(std::move(sample));
    return true;
}

// The same of sound.
bool StreamSampler::add_sound(const Packet& packet, std::span<const std::uint8_t> whole) {
    const auto audio = read_audio(packet);
    // Sound of the time before a frame may lie between the header that comes with that frame and the frame.
    const bool after_any_frame = has_frame_ || samples_ > 1;
    if (!after_any_frame || !audio) return false;
    // Sizes may be written longer than they need be, and bytes may lie behind the last.
    if (write_audio(*audio, packet.frame, packet.timestamp_us).payload != packet.payload) return false;
    const auto entry = place_of(entries_.sound, {audio->channels, audio->gain, audio->skip_begin});
    if (!entry || !is_usable(SampleTrack::sound, *entry)) return false;
    constexpr std::int64_t farthest_us = std::int64_t{1} << 40;
    const auto behind = static_cast<double>(packet.timestamp_us) - static_cast<double>(frame_timestamp_us_);
    if (behind < -static_cast<double>(farthest_us) || behind > static_cast<double>(farthest_us)) return false;
    const auto begin_us = static_cast<std::int64_t>(std::min(time_.microseconds(), longest_us)) +
                          (packet.timestamp_us - frame_timestamp_us_);
    auto time = begin_us * 48 / 1000;
    constexpr std::int64_t rounded = audio_samples_per_second / 1000;
    if (sound_end_ && time < *sound_end_ + rounded) time = *sound_end_;
    std::size_t bytes = 0;
    for (const auto& opus : audio->opus) {
        TrackSample sample;
        sample.time = time;
        sample.duration = opus_samples(opus).value_or(0);
        sample.entry = *entry;
        sample.sync = true;
        sample.bytes = opus;
        time += sample.duration;
        bytes += opus.size();
        sample_->tracks[static_cast<std::size_t>(SampleTrack::sound)].push_back(std::move(sample));
    }
    sound_end_ = time;
    append(sample_->tracks[0][0].bytes,
           parted(whole, packet.payload.size() - bytes, SampleTrack::sound, audio->opus.size()));
    return true;
}

void StreamSampler::find_needs(StreamSample& sample) {
    const auto kept = numbers_.dependencies().kept();
    std::erase_if(stored_, [&](const auto& one) {
        const bool unneeded = std::find(kept.begin(), kept.end(), one.first) == kept.end();
        if (unneeded) stored_bytes_ -= one.second.bytes.size();
        return unneeded;
    });
    auto& mesh = sample.tracks[0][0];
    mesh.sync = !closure_.empty();
    if (closure_.empty()) return;
    const auto& entry = entries_.meshes[mesh.entry];
    sample.needed_packets = entry.header;
    std::vector<std::uint64_t> needed(closure_.begin() + 1, closure_.end());
    needed.insert(needed.end(), kept.begin(), kept.end());
    std::sort(needed.begin(), needed.end());
    needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
    for (const auto place : needed) {
        const auto found = stored_.find(place);
        if (place >= begin_place_ || found == stored_.end()) continue;
        if (found->second.bytes[4] == static_cast<std::uint8_t>(PacketKind::sequence)) continue;
        append(sample.needed_packets, found->second.bytes);
        if (sample.needs.empty() || sample.needs.back() != found->second.sample)
            sample.needs.push_back(found->second.sample);
    }
    mesh.needs_others = !sample.needs.empty();
    closure_.clear();
}

std::optional<StreamSample> StreamSampler::complete() {
    find_needs(*sample_);
    has_frame_ = false;
    return std::exchange(sample_, std::nullopt);
}

std::optional<StreamSample> StreamSampler::finish() {
    if (!sample_) return std::nullopt;
    // Packets behind the last frame that go with a next one: a sample of no duration.
    if (!has_frame_) {
        sample_->tracks[0][0].time = static_cast<std::int64_t>(total_us());
        sample_->tracks[0][0].entry = mesh_entry_.value_or(0);
        if (entries_.meshes.empty()) entries_.meshes.emplace_back();
    }
    return complete();
}

}  // namespace htvm
