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

std::optional<SampleRange> RangeCutter::push(StreamSample sample) {
    std::optional<SampleRange> out;
    const auto time = sample.mesh().time;
    if (!range_.samples.empty() && sample.mesh().sync) {
        const auto& first = range_.samples.front().mesh();
        const bool is_long = on_grid_ ? time / least_us_ > first.time / least_us_ : time - first.time >= least_us_;
        if (is_long || sample.mesh().entry != first.entry) {
            range_.end_us = time;
            out = std::exchange(range_, {});
        }
    }
    range_.samples.push_back(std::move(sample));
    return out;
}

std::optional<SampleRange> RangeCutter::finish(std::uint64_t total_us) {
    if (range_.samples.empty()) return std::nullopt;
    range_.end_us = std::max(static_cast<std::int64_t>(total_us), range_.samples.back().mesh().time);
    return std::exchange(range_, {});
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

// The entries that the samples have, alone, and the samples renamed to them.
template <class Entry>
std::vector<Entry> entries_of(SampleRange& range, std::size_t track, const std::vector<Entry>& all) {
    std::vector<std::uint16_t> used;
    for (auto& sample : range.samples)
        for (auto& one : sample.tracks[track]) {
            const auto at = std::find(used.begin(), used.end(), one.entry);
            const auto place = static_cast<std::uint16_t>(at - used.begin());
            if (at == used.end()) used.push_back(one.entry);
            one.entry = place;
        }
    std::vector<Entry> out;
    for (const auto number : used) out.push_back(all[number]);
    return out;
}

}  // namespace

Result<std::optional<StreamSegment>> StreamSegmenter::segment_of(std::optional<SampleRange> range) {
    if (!range) return std::nullopt;
    Movie movie;
    const auto& entries = sampler_.entries();
    const auto first_of = [&](std::size_t track) { return samples_of(*range, track); };
    if (const auto heard = first_of(sound); !heard.empty() && !first_sound_time_) first_sound_time_ = heard[0]->time;
    movie.fragmented = true;
    movie.first_sound_time = std::min<std::int64_t>(first_sound_time_.value_or(0), 0);
    movie.entries.meshes = entries_of(*range, 0, entries.meshes);
    movie.entries.pictures = entries_of(*range, 1, entries.pictures);
    movie.entries.sound = entries_of(*range, 2, entries.sound);
    // Tracks stay once they are there, so that maps differ no more than they must.
    if (movie.entries.pictures.empty() && has_pictures_) movie.entries.pictures = {entries.pictures.back()};
    if (movie.entries.sound.empty() && has_sound_) movie.entries.sound = {entries.sound.back()};
    has_pictures_ = !movie.entries.pictures.empty();
    has_sound_ = !movie.entries.sound.empty();
    // Only the first map tells what is not heard of the first packet.
    if (sequence_ > 0)
        for (auto& entry : movie.entries.sound) entry.skip = 0;
    if (sequence_ == 0) movie.index = index_;
    movie.needed_packets = range->samples.front().needed_packets;
    StreamSegment out;
    out.begin_us = range->samples.front().mesh().time;
    out.end_us = range->end_us;
    out.map = write_movie(movie);
    BoxWriter media;
    media.begin(four("styp"));
    media.text("msdh");
    media.u32(0);
    media.text("msdhhtvm");
    media.end();
    const auto fragment = write_fragment(*range, ++sequence_, movie.sound_shift(), false);
    if (!fragment) return tl::unexpected(fragment.error());
    media.bytes(*fragment);
    out.media = media.take();
    return out;
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
    std::array<std::optional<SampleRange>, 2> ranges;
    if (sample) ranges[0] = cutter_.push(std::move(*sample));
    ranges[1] = cutter_.finish(sampler_.total_us());
    for (auto& range : ranges) {
        auto segment = segment_of(std::move(range));
        if (!segment) return tl::unexpected(segment.error());
        if (*segment) out.push_back(std::move(**segment));
    }
    return out;
}

}  // namespace htvm
