#include "container/fragment.h"

#include <algorithm>
#include <array>
#include <utility>

#include "container/box.h"

namespace htvm {
namespace {

constexpr std::size_t meshes = 0, sound = 2;

std::vector<const TrackSample*> samples_of(const SampleRange& range, std::size_t track) {
    std::vector<const TrackSample*> out;
    for (const auto& sample : range.samples)
        for (const auto& one : sample.tracks[track]) out.push_back(&one);
    return out;
}

std::uint32_t duration_of(std::span<const TrackSample* const> samples, std::size_t i, std::size_t track,
                          std::int64_t end_us) {
    const bool last = i + 1 == samples.size();
    if (last && track == sound) return samples[i]->duration;
    const auto end = last ? end_us : samples[i + 1]->time;
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(end - samples[i]->time, 0, 0x7fffffff));
}

std::uint32_t flags_of(const TrackSample& sample) {
    constexpr std::uint32_t needs_none = 0x2000000, needs_others = 0x1000000, is_not_sync = 0x10000;
    if (!sample.sync) return needs_others | is_not_sync;
    return sample.needs_others ? needs_others : needs_none;
}

void write_groups_of(BoxWriter& out, std::span<const StreamSample> samples) {
    std::vector<std::optional<std::vector<std::uint32_t>>> groups;
    for (const auto& sample : samples)
        groups.push_back(sample.mesh().sync ? std::optional(sample.needs) : std::nullopt);
    write_access_groups(out, groups, true);
}

struct Run {
    std::size_t track = 0, begin = 0, end = 0;  // samples of the track, all of the same entry
    std::size_t offset_at = 0;                  // of the field for where its data begin
};

void write_run(BoxWriter& out, Run& run, const std::vector<const TrackSample*>& all, std::int64_t end_us,
               std::int64_t shift) {
    const std::span samples(all);
    out.begin(four("tfhd"), 0, 0x20002);  // offsets from the moof; the entry
    out.u32(run.track + 1);
    out.u32(samples[run.begin]->entry + 1u);
    out.end();
    out.begin(four("tfdt"), 1, 0);
    out.u64(static_cast<std::uint64_t>(std::max<std::int64_t>(samples[run.begin]->time + shift, 0)));
    out.end();
    const bool has_flags = run.track != sound;
    out.begin(four("trun"), 0, has_flags ? 0x701 : 0x301);
    out.u32(run.end - run.begin);
    run.offset_at = out.size();
    out.u32(0);
    for (auto i = run.begin; i < run.end; ++i) {
        out.u32(duration_of(samples, i, run.track, end_us));
        out.u32(samples[i]->bytes.size());
        if (has_flags) out.u32(flags_of(*samples[i]));
    }
    out.end();
}

}  // namespace

// ---- Ranges ---------------------------------------------------------------------------------------------------------

std::optional<SampleRange> RangeCutter::cut(std::int64_t end_us, bool next_begins) {
    range_.end_us = end_us;
    range_.ends = next_begins;
    auto out = std::exchange(range_, {});
    range_.begins = next_begins;
    return out;
}

std::optional<SampleRange> RangeCutter::push(StreamSample sample) {
    std::optional<SampleRange> out;
    const auto& mesh = sample.mesh();
    if (!range_.samples.empty()) {
        const auto last = range_.samples.back().mesh().time, first = range_.samples.front().mesh().time;
        if (mesh.sync && (is_long(mesh.time) || mesh.entry != entry_))
            out = cut(mesh.time, true);
        else if (part_us_ > 0 && mesh.time + (mesh.time - last) - first > part_us_)
            out = cut(mesh.time, false);
    }
    if (range_.samples.empty() && range_.begins) {
        begin_us_ = mesh.time;
        entry_ = mesh.entry;
    }
    range_.samples.push_back(std::move(sample));
    return out;
}

std::optional<SampleRange> RangeCutter::finish(std::uint64_t total_us) {
    if (range_.samples.empty()) return std::nullopt;
    return cut(std::max(static_cast<std::int64_t>(total_us), range_.samples.back().mesh().time), true);
}

// ---- Fragments ------------------------------------------------------------------------------------------------------

Result<std::vector<std::uint8_t>> write_fragment(const SampleRange& range, std::uint32_t sequence,
                                                 std::int64_t sound_shift, bool with_groups) {
    BoxWriter out;
    std::vector<Run> runs;
    std::uint64_t bytes = 0;
    out.begin(four("moof"));
    out.begin(four("mfhd"), 0, 0);
    out.u32(sequence);
    out.end();
    for (std::size_t track = 0; track < sample_tracks; ++track) {
        const auto samples = samples_of(range, track);
        for (const auto* sample : samples) bytes += sample->bytes.size();
        for (std::size_t begin = 0; begin < samples.size();) {
            Run run{track, begin, begin + 1};
            while (run.end < samples.size() && samples[run.end]->entry == samples[begin]->entry) ++run.end;
            out.begin(four("traf"));
            write_run(out, run, samples, range.end_us, track == sound ? sound_shift : 0);
            if (track == meshes && with_groups)
                write_groups_of(out, std::span(range.samples).subspan(begin, run.end - begin));
            out.end();
            begin = run.end;
            runs.push_back(run);
        }
    }
    out.end();
    if (bytes + out.size() >= 0x7fffffff)
        return fail(ErrorKind::limit, "a fragment is larger than 2 GiB; cut it into shorter ones");
    const auto header = out.size();
    out.u32(bytes + 8);
    out.text("mdat");
    std::size_t done = 0;
    for (const auto& run : runs) {
        out.set_u32(run.offset_at, static_cast<std::uint32_t>(header + 8 + done));
        const auto samples = samples_of(range, run.track);
        for (auto i = run.begin; i < run.end; ++i) {
            out.bytes(samples[i]->bytes);
            done += samples[i]->bytes.size();
        }
    }
    return out.take();
}

// ---- Segments -------------------------------------------------------------------------------------------------------

namespace {

void add_used(StreamSampler::EntryNumbers& used, const StreamSample& sample) {
    for (std::size_t track = 0; track < sample_tracks; ++track)
        for (const auto& one : sample.tracks[track])
            if (std::find(used[track].begin(), used[track].end(), one.entry) == used[track].end())
                used[track].push_back(one.entry);
}

template <class Entry>
std::vector<Entry> chosen(const std::vector<Entry>& all, const std::vector<std::uint16_t>& numbers) {
    std::vector<Entry> out;
    for (const auto number : numbers) out.push_back(all[number]);
    return out;
}

}  // namespace

// Those that the samples have, alone. Tracks stay once they are there, so that maps differ no more than they must.
void StreamSegmenter::choose_entries(const SampleRange& range) {
    StreamSampler::EntryNumbers used;
    for (const auto& sample : range.samples) add_used(used, sample);
    if (in_parts_) {
        // The map is there before the rest of the segment: it has what is under way already, and nothing else may come.
        for (const auto& sample : cutter_.waiting().samples) add_used(used, sample);
        if (sampler_.incomplete()) add_used(used, *sampler_.incomplete());
    }
    const auto& entries = sampler_.entries();
    if (used[1].empty() && has_pictures_) used[1] = {static_cast<std::uint16_t>(entries.pictures.size() - 1)};
    if (used[2].empty() && has_sound_) used[2] = {static_cast<std::uint16_t>(entries.sound.size() - 1)};
    has_pictures_ = !used[1].empty();
    has_sound_ = !used[2].empty();
    map_entries_ = used;
    if (in_parts_) sampler_.use_only(std::move(used));
}

std::vector<std::uint8_t> StreamSegmenter::map_of(const SampleRange& range) {
    choose_entries(range);
    const auto& entries = sampler_.entries();
    Movie movie;
    movie.fragmented = true;
    movie.first_sound_time = std::min<std::int64_t>(first_sound_time_.value_or(0), 0);
    movie.entries.meshes = chosen(entries.meshes, map_entries_[0]);
    movie.entries.pictures = chosen(entries.pictures, map_entries_[1]);
    movie.entries.sound = chosen(entries.sound, map_entries_[2]);
    // Only the first map tells what is not heard of the first packet.
    if (sequence_ > 0)
        for (auto& entry : movie.entries.sound) entry.skip = 0;
    if (sequence_ == 0) movie.index = index_;
    movie.needed_packets = range.samples.front().needed_packets;
    return write_movie(movie);
}

Result<std::optional<StreamSegment>> StreamSegmenter::segment_of(std::optional<SampleRange> range) {
    if (!range) return std::nullopt;
    if (const auto heard = samples_of(*range, sound); !heard.empty() && !first_sound_time_)
        first_sound_time_ = heard[0]->time;
    StreamSegment out;
    out.begins = range->begins;
    out.ends = range->ends;
    out.begin_us = range->samples.front().mesh().time;
    out.end_us = range->end_us;
    if (out.begins) out.map = map_of(*range);
    for (auto& sample : range->samples)
        for (std::size_t track = 0; track < sample_tracks; ++track)
            for (auto& one : sample.tracks[track]) {
                const auto& known = map_entries_[track];
                const auto at = std::find(known.begin(), known.end(), one.entry);
                // A sequence header that comes in the middle of a segment is in the sample itself.
                one.entry = static_cast<std::uint16_t>(at == known.end() ? 0 : at - known.begin());
            }
    BoxWriter media;
    if (out.begins) {
        media.begin(four("styp"));
        media.text("msdh");
        media.u32(0);
        media.text("msdhhtvm");
        media.end();
    }
    const auto shift = std::max<std::int64_t>(-first_sound_time_.value_or(0), 0);
    const auto fragment = write_fragment(*range, ++sequence_, shift, false);
    if (!fragment) return tl::unexpected(fragment.error());
    media.bytes(*fragment);
    out.media = media.take();
    return out;
}

std::size_t StreamSegmenter::held_bytes() const {
    std::size_t out = index_.size() + sampler_.held_bytes();
    for (const auto& sample : cutter_.waiting().samples) {
        out += sample.needed_packets.size();
        for (const auto& track : sample.tracks)
            for (const auto& one : track) out += one.bytes.size();
    }
    return out;
}

std::size_t StreamSegmenter::entries() const {
    const auto& entries = sampler_.entries();
    return entries.meshes.size() + entries.pictures.size() + entries.sound.size();
}

Result<std::optional<StreamSegment>> StreamSegmenter::push(Packet packet) {
    if (!std::exchange(begun_, true) && packet.kind == PacketKind::front_index) {
        index_ = write_packet(packet);
        return std::nullopt;
    }
    auto sample = sampler_.push(std::move(packet));
    return segment_of(sample ? cutter_.push(std::move(*sample)) : std::nullopt);
}

Result<std::vector<StreamSegment>> StreamSegmenter::finish() {
    std::vector<StreamSegment> out;
    auto sample = sampler_.finish();
    const auto take = [&](std::optional<SampleRange> range) -> Result<void> {
        auto segment = segment_of(std::move(range));
        if (!segment) return tl::unexpected(segment.error());
        if (*segment) out.push_back(std::move(**segment));
        return {};
    };
    // One after the other: the map of the first has what still waits in the cutter.
    if (sample)
        if (auto taken = take(cutter_.push(std::move(*sample))); !taken) return tl::unexpected(taken.error());
    if (auto taken = take(cutter_.finish(sampler_.total_us())); !taken) return tl::unexpected(taken.error());
    return out;
}

}  // namespace htvm
