#include "container/movie_box.h"

#include <algorithm>
#include <map>

#include "codec/format/sequence.h"
#include "container/box.h"
#include "container/picture_configuration.h"

namespace htvm {
namespace {

constexpr std::uint32_t movie_clock = 1000000;
constexpr std::size_t meshes = 0, pictures = 1, sound = 2;
constexpr std::array<const char*, sample_tracks> handler_names = {"htvm meshes", "htvm pictures", "htvm sound"};

void write_matrix(BoxWriter& out) {
    for (const std::uint32_t v : {0x10000u, 0u, 0u, 0u, 0x10000u, 0u, 0u, 0u, 0x40000000u}) out.u32(v);
}

// ---- Sample entries -------------------------------------------------------------------------------------------------

void begin_entry(BoxWriter& out, std::uint32_t type) {
    out.begin(type);
    out.zeros(6);
    out.u16(1);  // data_reference_index: this file
}

// The fields of a VisualSampleEntry, which tools expect in a track of the handler 'vide'.
void write_visual(BoxWriter& out, std::uint32_t width, std::uint32_t height, std::string_view compressor) {
    out.zeros(16);
    out.u16(width);
    out.u16(height);
    out.u32(0x480000);  // 72 dots an inch
    out.u32(0x480000);
    out.u32(0);
    out.u16(1);  // frame_count
    out.u8(compressor.size());
    out.text(compressor);
    out.zeros(31 - compressor.size());
    out.u16(0x18);    // depth
    out.u16(0xffff);  // pre_defined
}

void write_mesh_entry(BoxWriter& out, const Movie& movie, const MeshEntry& entry) {
    begin_entry(out, mesh_sample_entry);
    write_visual(out, mesh_track_side, mesh_track_side, "htvm");
    out.begin(mesh_configuration, 0, 0);
    out.u16(entry.version);
    out.u16(0);
    const bool first = &entry == movie.entries.meshes.data();
    if (first) out.bytes(movie.index);
    out.bytes(first && !movie.needed_packets.empty() ? movie.needed_packets : entry.header);
    out.end();
    out.end();
}

void write_picture_entry(BoxWriter& out, const PictureEntry& entry) {
    const auto [type, record, name] = video_entry_of(entry.coder);
    begin_entry(out, type);
    write_visual(out, entry.width, entry.height, name);
    out.begin(record);
    out.bytes(entry.configuration);
    out.end();
    out.begin(four("colr"));
    out.text("nclx");
    out.u16(1);   // primaries of BT.709, as sRGB's
    out.u16(13);  // transfer of sRGB
    out.u16(static_cast<std::uint16_t>(entry.matrix));
    out.u8(entry.full_range ? 0x80 : 0);
    out.end();
    out.begin(four("pasp"));
    out.u32(1);
    out.u32(1);
    out.end();
    out.end();
}

void write_sound_entry(BoxWriter& out, const SoundEntry& entry) {
    begin_entry(out, four("Opus"));
    out.zeros(8);
    out.u16(entry.channels);
    out.u16(16);  // bits a sample
    out.zeros(4);
    out.u32(audio_samples_per_second << 16);
    out.begin(four("dOps"));
    out.u8(0);
    out.u8(entry.channels);
    out.u16(std::min<std::uint32_t>(entry.skip, 65535));
    out.u32(audio_samples_per_second);
    out.u16(static_cast<std::uint16_t>(entry.gain));
    out.u8(0);  // one channel, or left and right
    out.end();
    out.end();
}

void write_descriptions(BoxWriter& out, const Movie& movie, std::size_t track) {
    const auto& entries = movie.entries;
    out.begin(four("stsd"), 0, 0);
    if (track == meshes) {
        out.u32(entries.meshes.size());
        for (const auto& entry : entries.meshes) write_mesh_entry(out, movie, entry);
    } else if (track == pictures) {
        out.u32(entries.pictures.size());
        for (const auto& entry : entries.pictures) write_picture_entry(out, entry);
    } else {
        out.u32(entries.sound.size());
        for (const auto& entry : entries.sound) write_sound_entry(out, entry);
    }
    out.end();
}

// ---- Sample tables --------------------------------------------------------------------------------------------------

std::vector<std::uint32_t> durations_of(const SampleTable& table) {
    std::vector<std::uint32_t> out(table.times.size(), table.last_duration);
    for (std::size_t i = 1; i < table.times.size(); ++i)
        out[i - 1] = static_cast<std::uint32_t>(
            std::clamp<std::int64_t>(table.times[i] - table.times[i - 1], 0, std::int64_t{0x7fffffff}));
    return out;
}

// Equal values that follow each other, as pairs of how many and which.
void write_runs(BoxWriter& out, const std::vector<std::uint32_t>& values) {
    const auto count_at = out.size();
    out.u32(0);
    std::uint32_t runs = 0;
    for (std::size_t begin = 0; begin < values.size(); ++runs) {
        auto end = begin;
        while (end < values.size() && values[end] == values[begin]) ++end;
        out.u32(end - begin);
        out.u32(values[begin]);
        begin = end;
    }
    out.set_u32(count_at, runs);
}

void write_chunks(BoxWriter& out, const std::vector<SampleTable::Chunk>& chunks) {
    out.begin(four("stsc"), 0, 0);
    const auto count_at = out.size();
    out.u32(0);
    std::uint32_t runs = 0;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        if (i > 0 && chunks[i].samples == chunks[i - 1].samples && chunks[i].entry == chunks[i - 1].entry) continue;
        out.u32(i + 1);
        out.u32(chunks[i].samples);
        out.u32(chunks[i].entry + 1u);
        ++runs;
    }
    out.set_u32(count_at, runs);
    out.end();
    out.begin(four("co64"), 0, 0);
    out.u32(chunks.size());
    for (const auto& chunk : chunks) out.u64(chunk.offset);
    out.end();
}

// Opus takes 80 ms to converge: so many samples before the one asked for are to be decoded.
void write_roll(BoxWriter& out, std::size_t samples, std::uint32_t duration) {
    constexpr std::uint32_t converging = audio_samples_per_second * 80 / 1000;
    const auto distance = -static_cast<std::int32_t>(converging / std::max(duration, 120u));
    out.begin(four("sgpd"), 1, 0);
    out.text("roll");
    out.u32(2);
    out.u32(1);
    out.u16(static_cast<std::uint16_t>(distance));
    out.end();
    out.begin(four("sbgp"), 0, 0);
    out.text("roll");
    out.u32(1);
    out.u32(samples);
    out.u32(1);
    out.end();
}

void write_table(BoxWriter& out, const Movie& movie, std::size_t track) {
    const auto& table = movie.tables[track];
    out.begin(four("stbl"));
    write_descriptions(out, movie, track);
    out.begin(four("stts"), 0, 0);
    write_runs(out, durations_of(table));
    out.end();
    if (track != sound && !table.sizes.empty() && table.sync.size() != table.sizes.size()) {
        out.begin(four("stss"), 0, 0);
        out.u32(table.sync.size());
        for (const auto number : table.sync) out.u32(number);
        out.end();
    }
    out.begin(four("stsz"), 0, 0);
    out.u32(0);
    out.u32(table.sizes.size());
    for (const auto size : table.sizes) out.u32(size);
    out.end();
    write_chunks(out, table.chunks);
    if (track == meshes && !table.sizes.empty()) {
        std::vector<std::optional<std::vector<std::uint32_t>>> groups(table.sizes.size());
        for (std::size_t i = 0; i < table.sync.size(); ++i) groups[table.sync[i] - 1] = table.needs[i];
        write_access_groups(out, groups, false);
    }
    if (track == sound && !table.sizes.empty()) write_roll(out, table.sizes.size(), table.last_duration);
    out.end();
}

// ---- Tracks ---------------------------------------------------------------------------------------------------------

// Where in time a track begins, and what of it is shown.
struct Edit {
    std::uint64_t empty_us = 0;
    std::int64_t media_time = 0;
    std::uint64_t shown_us = 0;  // 0 in fragments: up to the end
};

Edit edit_of(const Movie& movie, std::size_t track) {
    Edit out;
    if (track == sound) {
        const auto first = movie.first_sound_time;
        const auto skip = movie.entries.sound.empty() ? 0u : movie.entries.sound[0].skip;
        const auto heard = std::max<std::int64_t>(first + skip, 0);
        if (movie.fragmented) {
            out.media_time = movie.sound_shift();
            return out;
        }
        out.empty_us = static_cast<std::uint64_t>(heard) * 125 / 6;  // 1,000,000 / 48,000
        out.media_time = heard - first;
        const auto& times = movie.tables[sound].times;
        const auto end = times.empty() ? 0 : times.back() + movie.tables[sound].last_duration;
        out.shown_us = static_cast<std::uint64_t>(std::max<std::int64_t>(end, 0)) * 125 / 6;
        out.shown_us = std::min(out.shown_us, movie.total_us);
        out.shown_us -= std::min(out.shown_us, out.empty_us);
        return out;
    }
    if (movie.fragmented) return out;
    if (track == pictures) out.empty_us = static_cast<std::uint64_t>(movie.first_picture_time);
    out.shown_us = movie.total_us - std::min(movie.total_us, out.empty_us);
    return out;
}

void write_edits(BoxWriter& out, const Edit& edit) {
    if (edit.empty_us == 0 && edit.media_time == 0) return;
    out.begin(four("edts"));
    out.begin(four("elst"), 1, 0);
    out.u32(edit.empty_us > 0 ? 2 : 1);
    if (edit.empty_us > 0) {
        out.u64(edit.empty_us);
        out.u64(~std::uint64_t{0});
        out.u32(0x10000);
    }
    out.u64(edit.shown_us);
    out.u64(static_cast<std::uint64_t>(edit.media_time));
    out.u32(0x10000);
    out.end();
    out.end();
}

void write_media_header(BoxWriter& out, const Movie& movie, std::size_t track) {
    const auto& table = movie.tables[track];
    std::uint64_t duration = 0;
    if (!table.times.empty())
        duration = static_cast<std::uint64_t>(std::max<std::int64_t>(table.times.back() - table.times.front(), 0)) +
                   table.last_duration;
    out.begin(four("mdhd"), 1, 0);
    out.zeros(16);
    out.u32(track_clocks[track]);
    out.u64(duration);
    out.u16(0x55c4);  // no language
    out.u16(0);
    out.end();
    out.begin(four("hdlr"), 0, 0);
    out.u32(0);
    out.text(track == sound ? "soun" : "vide");
    out.zeros(12);
    out.text(handler_names[track]);
    out.u8(0);
    out.end();
}

void write_track(BoxWriter& out, const Movie& movie, std::size_t track) {
    const auto edit = edit_of(movie, track);
    out.begin(four("trak"));
    out.begin(four("tkhd"), 1, 3);  // enabled, in the presentation
    out.zeros(16);
    out.u32(track + 1);
    out.u32(0);
    out.u64(movie.fragmented ? 0 : edit.empty_us + edit.shown_us);
    out.zeros(8);
    out.u16(0);
    out.u16(0);
    out.u16(track == sound ? 0x100 : 0);
    out.u16(0);
    write_matrix(out);
    const auto side = [&](std::uint32_t PictureEntry::*of) -> std::uint32_t {
        return track == sound ? 0 : track == meshes ? mesh_track_side : movie.entries.pictures[0].*of;
    };
    out.u32(side(&PictureEntry::width) << 16);
    out.u32(side(&PictureEntry::height) << 16);
    out.end();
    write_edits(out, edit);
    out.begin(four("mdia"));
    write_media_header(out, movie, track);
    out.begin(four("minf"));
    if (track == sound) {
        out.begin(four("smhd"), 0, 0);
        out.zeros(4);
    } else {
        out.begin(four("vmhd"), 0, 1);
        out.zeros(8);
    }
    out.end();
    out.begin(four("dinf"));
    out.begin(four("dref"), 0, 0);
    out.u32(1);
    out.begin(four("url "), 0, 1);
    out.end();
    out.end();
    out.end();
    write_table(out, movie, track);
    out.end();
    out.end();
    out.end();
}

// ---- Metadata -------------------------------------------------------------------------------------------------------

void write_text_item(BoxWriter& out, std::uint32_t type, const std::string& text) {
    out.begin(type);
    out.begin(four("data"));
    out.u32(1);  // UTF-8
    out.u32(0);
    out.text(text);
    out.end();
    out.end();
}

// Title and rights, as iTunes and ffmpeg write them.
void write_metadata(BoxWriter& out, const MeshEntry& entry) {
    constexpr std::size_t payload_end = 4;  // behind it, the CRC
    if (entry.header.size() < packet_overhead) return;
    const auto payload = std::span(entry.header).subspan(packet_header_bytes);
    const auto header = internal::read_sequence_header(payload.first(payload.size() - payload_end));
    if (!header) return;
    const auto value = [&](const char* key) -> const std::string* {
        for (const auto& one : header->metadata)
            if (one.key == key) return &one.value;
        return nullptr;
    };
    const auto *title = value("title"), *rights = value("rights");
    if (!title && !rights) return;
    out.begin(four("udta"));
    out.begin(four("meta"), 0, 0);
    out.begin(four("hdlr"), 0, 0);
    out.u32(0);
    out.text("mdirappl");
    out.zeros(9);
    out.end();
    out.begin(four("ilst"));
    if (title) write_text_item(out, 0xa96e616d, *title);  // (c)nam
    if (rights) write_text_item(out, four("cprt"), *rights);
    out.end();
    out.end();
    out.end();
}

}  // namespace

void write_access_groups(BoxWriter& out, std::span<const std::optional<std::vector<std::uint32_t>>> groups,
                         bool in_fragment) {
    std::map<std::vector<std::uint32_t>, std::uint32_t> numbers;
    std::vector<const std::vector<std::uint32_t>*> descriptions;
    std::vector<std::uint32_t> of_samples;
    for (const auto& group : groups) {
        if (!group) {
            of_samples.push_back(0);
            continue;
        }
        const auto [at, is_new] = numbers.try_emplace(*group, static_cast<std::uint32_t>(descriptions.size() + 1));
        if (is_new) descriptions.push_back(&*group);
        // Groups that a fragment itself describes are numbered from 65537.
        of_samples.push_back(at->second + (in_fragment ? 0x10000u : 0u));
    }
    if (descriptions.empty()) return;
    out.begin(four("sgpd"), 1, 0);
    out.u32(access_point_grouping);
    out.u32(0);
    out.u32(descriptions.size());
    for (const auto* needs : descriptions) {
        out.u32(4 * needs->size());
        for (const auto number : *needs) out.u32(number);
    }
    out.end();
    out.begin(four("sbgp"), 0, 0);
    out.u32(access_point_grouping);
    write_runs(out, of_samples);
    out.end();
}

std::vector<std::uint8_t> write_movie(const Movie& movie) {
    BoxWriter out;
    out.begin(four("ftyp"));
    out.text("isom");  // as some tools take no others
    out.u32(0x200);
    out.text("isomiso6mp41htvm");
    if (movie.has(SampleTrack::pictures) && movie.entries.pictures[0].coder == PictureCoder::av1) out.text("av01");
    out.end();
    out.begin(four("moov"));
    out.begin(four("mvhd"), 1, 0);
    out.zeros(16);
    out.u32(movie_clock);
    out.u64(movie.fragmented ? 0 : movie.total_us);
    out.u32(0x10000);  // rate
    out.u16(0x100);    // volume
    out.zeros(10);
    write_matrix(out);
    out.zeros(24);
    out.u32(sample_tracks + 1);  // next_track_ID
    out.end();
    for (std::size_t track = 0; track < sample_tracks; ++track)
        if (movie.has(static_cast<SampleTrack>(track))) write_track(out, movie, track);
    if (movie.fragmented) {
        out.begin(four("mvex"));
        if (movie.total_us > 0) {
            out.begin(four("mehd"), 1, 0);
            out.u64(movie.total_us);
            out.end();
        }
        for (std::size_t track = 0; track < sample_tracks; ++track) {
            if (!movie.has(static_cast<SampleTrack>(track))) continue;
            out.begin(four("trex"), 0, 0);
            out.u32(track + 1);
            out.u32(1);
            out.zeros(12);
            out.end();
        }
        out.end();
    }
    write_metadata(out, movie.entries.meshes[0]);
    out.end();
    return out.take();
}

}  // namespace htvm
