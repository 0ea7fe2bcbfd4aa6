#include "container/mp4_tables.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>

#include "container/box.h"
#include "container/movie_box.h"
#include "container/picture_configuration.h"

namespace htvm {
namespace {

constexpr std::uint64_t most_table_bytes = std::uint64_t{1} << 29;

tl::unexpected<Error> corrupt(const std::string& what) { return fail(ErrorKind::corrupt_stream, "the .mp4's " + what); }
// What to do about a file without the box 'moov', which lists its frames.
constexpr const char* tables_advice = "; without it none of its frames is found: fetch or write the file anew";

// What a fragment takes where it says nothing itself.
struct Defaults {
    std::uint32_t entry = 1, duration = 0, size = 0, flags = 0;
};

struct OpenTrack {
    Mp4Track track;
    std::uint32_t id = 0;
    Defaults defaults;
    std::uint64_t next_time = 0;  // behind the last sample
};

struct Tables {
    const FileBytes& file;
    std::vector<OpenTrack> tracks;
    std::size_t samples = 0;  // of all tracks
    std::uint64_t bytes = 0;  // likewise; samples that do not lie over each other are no more than the file
    bool has_movie = false;
    std::uint64_t told_bytes = 0;  // of the file by its boxes: more than there are where it is cut short
};

// Adds a sample, if the file has it. Behind the first one of a track that was cut off nothing is added to it.
Result<void> add(Tables& tables, OpenTrack& track, Mp4Sample sample) {
    if (tables.samples >= most_mp4_samples) return fail(ErrorKind::limit, "the .mp4 has more samples than are taken");
    if (sample.offset > tables.told_bytes || sample.size > tables.told_bytes - sample.offset)
        return corrupt("samples lie behind its end");
    if (sample.offset + sample.size > tables.file.size) track.track.is_cut = true;
    if (track.track.is_cut) return {};
    tables.bytes += sample.size;
    if (tables.bytes > tables.file.size) return corrupt("samples lie over each other");
    ++tables.samples;
    track.track.samples.push_back(sample);
    return {};
}

// ---- Tracks ---------------------------------------------------------------------------------------------------------

std::optional<SampleTrack> kind_of(std::uint32_t sample_entry) {
    if (sample_entry == mesh_sample_entry) return SampleTrack::meshes;
    if (is_picture_entry(sample_entry)) return SampleTrack::pictures;
    if (sample_entry == four("Opus")) return SampleTrack::sound;
    return std::nullopt;
}

std::vector<std::uint8_t> configuration_of(const MediaBox& entry) {
    constexpr std::size_t fields = 78, record_fields = 8;
    if (entry.inside.size() < fields) return {};
    const auto record = find_box(entry.inside.subspan(fields), mesh_configuration);
    if (!record || record->inside.size() < record_fields) return {};
    const auto packets = record->inside.subspan(record_fields);
    return {packets.begin(), packets.end()};
}

// Nothing for a track that no stream has.
std::optional<Mp4Track> described_track(const MediaBox& descriptions) {
    BoxReader in(descriptions.inside);
    in.skip(8);
    Mp4Track out;
    bool any = false;
    while (const auto entry = in.next()) {
        const auto kind = kind_of(entry->type);
        if (!kind || (any && *kind != out.kind)) return std::nullopt;
        out.kind = *kind;
        any = true;
        if (*kind == SampleTrack::meshes) out.configurations.push_back(configuration_of(*entry));
    }
    return any ? std::optional(std::move(out)) : std::nullopt;
}

// ---- Tables of a whole file -----------------------------------------------------------------------------------------

// The sizes of all samples, one after another.
struct Sizes {
    BoxReader in;
    std::uint32_t each = 0, count = 0;
    std::uint32_t next() { return each > 0 ? each : in.u32(); }
};

Result<Sizes> sizes_of(std::span<const std::uint8_t> boxes, std::uint64_t told_bytes) {
    const auto box = find_box(boxes, four("stsz"));
    Sizes out{BoxReader(box ? box->inside : std::span<const std::uint8_t>())};
    if (!box) return out;
    out.in.skip(4);
    out.each = out.in.u32();
    out.count = out.in.u32();
    const bool fits = out.each > 0 ? out.count <= told_bytes / out.each : out.count <= out.in.remaining() / 4;
    if (!out.in.ok() || !fits) return corrupt("table of sizes is cut short");
    return out;
}

// Where chunks begin, and how many samples each has, chunk after chunk.
struct Chunks {
    BoxReader offsets, runs;
    bool wide = false;
    std::uint32_t count = 0, run_count = 0;
    std::uint32_t chunk = 0, next_first = 1;  // the number of the last one; where the next run begins
    std::uint32_t samples = 0, entry = 1, upcoming_samples = 0, upcoming_entry = 1;
    // The next chunk's offset; nothing behind the last.
    std::optional<std::uint64_t> next() {
        if (chunk >= count) return std::nullopt;
        ++chunk;
        while (run_count > 0 && chunk >= next_first) {
            samples = upcoming_samples;
            entry = upcoming_entry;
            --run_count;
            if (run_count == 0) break;
            next_first = runs.u32();
            upcoming_samples = runs.u32();
            upcoming_entry = runs.u32();
        }
        return wide ? offsets.u64() : offsets.u32();
    }
};

Result<Chunks> chunks_of(std::span<const std::uint8_t> boxes) {
    const auto runs = find_box(boxes, four("stsc"));
    auto offsets = find_box(boxes, four("co64"));
    const bool wide = offsets.has_value();
    if (!wide) offsets = find_box(boxes, four("stco"));
    if (!runs || !offsets) return corrupt("table of chunks is missing");
    Chunks out{BoxReader(offsets->inside), BoxReader(runs->inside), wide};
    out.offsets.skip(4);
    out.count = out.offsets.u32();
    out.runs.skip(4);
    out.run_count = out.runs.u32();
    if (!out.offsets.ok() || !out.runs.ok() || out.count > out.offsets.remaining() / (wide ? 8 : 4) ||
        out.run_count > out.runs.remaining() / 12)
        return corrupt("table of chunks is cut short");
    if (out.run_count > 0) {
        out.next_first = out.runs.u32();
        out.upcoming_samples = out.runs.u32();
        out.upcoming_entry = out.runs.u32();
    }
    return out;
}

// Runs of equal durations.
struct Durations {
    BoxReader in;
    std::uint32_t runs = 0, left = 0, duration = 0;
    explicit Durations(const std::optional<MediaBox>& box) : in(box ? box->inside : std::span<const std::uint8_t>()) {
        in.skip(4);
        runs = in.u32();
    }
    std::uint32_t next() {
        while (left == 0 && runs > 0 && in.ok()) {
            --runs;
            left = in.u32();
            duration = in.u32();
        }
        if (left > 0) --left;
        return duration;
    }
};

void mark_sync(Mp4Track& track, const MediaBox& box) {
    for (auto& sample : track.samples) sample.sync = false;
    BoxReader in(box.inside);
    in.skip(4);
    for (auto left = in.u32(); left > 0; --left) {
        const auto number = in.u32();
        if (!in.ok()) return;
        if (number >= 1 && number <= track.samples.size()) track.samples[number - 1].sync = true;
    }
}

Result<void> read_sample_table(Tables& tables, OpenTrack& track, std::span<const std::uint8_t> boxes) {
    auto sizes = sizes_of(boxes, tables.told_bytes);
    if (!sizes) return tl::unexpected(sizes.error());
    if (sizes->count == 0) return {};  // all in fragments
    auto chunks = chunks_of(boxes);
    if (!chunks) return tl::unexpected(chunks.error());
    Durations durations(find_box(boxes, four("stts")));
    std::uint32_t left = sizes->count;
    while (left > 0) {
        auto offset = chunks->next();
        if (!offset) return corrupt("chunks have fewer samples than there are");
        if (chunks->entry == 0) return corrupt("table of chunks names no sample entry");
        for (auto n = std::min(chunks->samples, left); n > 0 && !track.track.is_cut; --n, --left) {
            const auto size = sizes->next();
            if (auto ok = add(tables, track, {*offset, track.next_time, size, chunks->entry - 1, true}); !ok) return ok;
            *offset += size;
            track.next_time += durations.next();
        }
        if (track.track.is_cut) break;
    }
    if (const auto sync = find_box(boxes, four("stss"))) mark_sync(track.track, *sync);
    return {};
}

std::optional<MediaBox> find_path(std::span<const std::uint8_t> boxes, std::initializer_list<std::uint32_t> path) {
    std::optional<MediaBox> out;
    for (const auto type : path) {
        out = find_box(boxes, type);
        if (!out) return out;
        boxes = out->inside;
    }
    return out;
}

Result<void> read_track(Tables& tables, const MediaBox& trak) {
    const auto header = find_box(trak.inside, four("tkhd"));
    const auto media = find_path(trak.inside, {four("mdia"), four("mdhd")});
    const auto table = find_path(trak.inside, {four("mdia"), four("minf"), four("stbl")});
    if (!header || !media || !table) return {};
    const auto descriptions = find_box(table->inside, four("stsd"));
    auto described = descriptions ? described_track(*descriptions) : std::nullopt;
    if (!described) return {};
    OpenTrack track;
    track.track = std::move(*described);
    BoxReader in(header->inside), clock(media->inside);
    in.skip(in.u8() == 1 ? 19 : 11);
    track.id = in.u32();
    clock.skip(clock.u8() == 1 ? 19 : 11);
    track.track.clock = std::max(clock.u32(), 1u);
    if (!in.ok() || !clock.ok()) return corrupt("track headers are cut short");
    // Segments with maps between them, one after another, say again what is known.
    for (const auto& known : tables.tracks)
        if (known.id == track.id) return {};
    constexpr std::size_t most_tracks = 64;
    if (tables.tracks.size() >= most_tracks) return fail(ErrorKind::limit, "the .mp4 has more tracks than are taken");
    tables.tracks.push_back(std::move(track));
    return read_sample_table(tables, tables.tracks.back(), table->inside);
}

Result<void> read_movie(Tables& tables, std::span<const std::uint8_t> moov) {
    tables.has_movie = true;
    BoxReader in(moov);
    while (const auto box = in.next())
        if (box->type == four("trak"))
            if (auto ok = read_track(tables, *box); !ok) return ok;
    if (!in.ok()) return corrupt("box 'moov' is cut short");
    const auto extends = find_box(moov, four("mvex"));
    if (!extends) return {};
    BoxReader defaults(extends->inside);
    while (const auto box = defaults.next()) {
        if (box->type != four("trex")) continue;
        BoxReader fields(box->inside);
        fields.skip(4);
        const auto id = fields.u32();
        Defaults of_track;
        of_track.entry = fields.u32();
        of_track.duration = fields.u32();
        of_track.size = fields.u32();
        of_track.flags = fields.u32();
        for (auto& track : tables.tracks)
            if (track.id == id && fields.ok()) track.defaults = of_track;
    }
    return {};
}

// ---- Fragments ------------------------------------------------------------------------------------------------------

struct Fragment {
    std::uint64_t begin = 0;  // of its moof
    std::uint64_t next = 0;   // where the data of the next run begin, if it does not say it
    Defaults defaults;
};

Result<void> read_run(Tables& tables, OpenTrack& track, Fragment& fragment, std::uint64_t base, const MediaBox& run) {
    BoxReader in(run.inside);
    const auto flags = in.u32() & 0xffffff;
    auto count = in.u32();
    if (flags & 1) fragment.next = base + static_cast<std::uint64_t>(std::int64_t{static_cast<std::int32_t>(in.u32())});
    const bool has_first_flags = (flags & 4) != 0;
    const auto first_flags = has_first_flags ? in.u32() : 0u;
    std::size_t fields = 0;
    for (const auto bit : {0x100u, 0x200u, 0x400u, 0x800u}) fields += flags & bit ? 4 : 0;
    if (!in.ok() || (fields > 0 && count > in.remaining() / fields)) return corrupt("fragments are cut short");
    for (bool first = true; count > 0; --count, first = false) {
        const auto duration = flags & 0x100 ? in.u32() : fragment.defaults.duration;
        const auto size = flags & 0x200 ? in.u32() : fragment.defaults.size;
        auto sample_flags = flags & 0x400 ? in.u32() : fragment.defaults.flags;
        if (first && has_first_flags) sample_flags = first_flags;
        if (flags & 0x800) in.u32();
        constexpr std::uint32_t is_not_sync = 0x10000;
        const bool sync = (sample_flags & is_not_sync) == 0;
        if (auto ok = add(tables, track, {fragment.next, track.next_time, size, fragment.defaults.entry - 1, sync});
            !ok)
            return ok;
        if (track.track.is_cut) {
            // What says no place of its own lies behind it, and is cut off, too.
            fragment.next = tables.file.size;
            return {};
        }
        fragment.next += size;
        track.next_time += duration;
    }
    return {};
}

Result<void> read_track_fragment(Tables& tables, Fragment& fragment, const MediaBox& traf) {
    const auto header = find_box(traf.inside, four("tfhd"));
    if (!header) return corrupt("fragments have no header");
    BoxReader in(header->inside);
    const auto flags = in.u32() & 0xffffff;
    const auto id = in.u32();
    const auto found = std::find_if(tables.tracks.begin(), tables.tracks.end(),
                                    [&](const OpenTrack& track) { return track.id == id; });
    if (found == tables.tracks.end()) return {};
    std::uint64_t base = fragment.begin;
    if (flags & 1) base = in.u64();
    fragment.defaults = found->defaults;
    if (flags & 2) fragment.defaults.entry = in.u32();
    if (flags & 8) fragment.defaults.duration = in.u32();
    if (flags & 0x10) fragment.defaults.size = in.u32();
    if (flags & 0x20) fragment.defaults.flags = in.u32();
    if (!in.ok() || fragment.defaults.entry == 0) return corrupt("fragments have a header that is cut short");
    if ((flags & 1) || fragment.next == 0) fragment.next = base;
    if (const auto time = find_box(traf.inside, four("tfdt"))) {
        BoxReader fields(time->inside);
        const bool wide = fields.u8() == 1;
        fields.skip(3);
        found->next_time = wide ? fields.u64() : fields.u32();
    }
    BoxReader runs(traf.inside);
    while (const auto box = runs.next())
        if (box->type == four("trun"))
            if (auto ok = read_run(tables, *found, fragment, base, *box); !ok) return ok;
    return {};
}

Result<void> read_fragment(Tables& tables, std::uint64_t begin, std::span<const std::uint8_t> moof) {
    Fragment fragment{begin, 0, {}};
    BoxReader in(moof);
    while (const auto box = in.next())
        if (box->type == four("traf"))
            if (auto ok = read_track_fragment(tables, fragment, *box); !ok) return ok;
    return in.ok() ? Result<void>() : corrupt("fragments are cut short");
}

// ---- The file -------------------------------------------------------------------------------------------------------

struct Place {
    std::uint32_t type = 0;
    std::uint64_t inside = 0, end = 0;
    std::uint64_t missing = 0;  // bytes of it that the end of the file cuts off
};

// The box of the file that begins there; nothing if none does. One that goes beyond the file's end ends with it.
std::optional<Place> box_at(const FileBytes& file, std::uint64_t offset) {
    std::array<std::uint8_t, 16> bytes{};
    const auto left = file.size - offset;
    const auto known = std::span(bytes).first(static_cast<std::size_t>(std::min<std::uint64_t>(left, bytes.size())));
    if (left < 8 || !file.read(offset, known)) return std::nullopt;
    BoxReader in(known);
    std::uint64_t size = in.u32(), header = 8;
    Place out;
    out.type = in.u32();
    if (size == 1) {
        size = in.u64();
        header = 16;
    }
    if (size == 0) size = left;
    if (size > left) out.missing = size - left;
    size = std::min(size, left);
    if (!in.ok() || size < header) return std::nullopt;
    out.inside = offset + header;
    out.end = offset + size;
    return out;
}

// What the last box of the file has behind its end.
std::uint64_t missing_bytes(const FileBytes& file) {
    std::uint64_t out = 0;
    for (std::uint64_t offset = 0; offset < file.size;) {
        const auto box = box_at(file, offset);
        constexpr std::uint64_t header = 8;
        if (!box && file.size - offset < header) return header - (file.size - offset);
        if (!box) break;
        out = box->missing;
        offset = box->end;
    }
    constexpr std::uint64_t most = std::uint64_t{1} << 60;
    return std::min(out, most);
}

}  // namespace

FileBytes source_of(std::span<const std::uint8_t> bytes) {
    return {bytes.size(), [bytes](std::uint64_t offset, std::span<std::uint8_t> to) {
                if (offset > bytes.size() || to.size() > bytes.size() - offset) return false;
                if (!to.empty()) std::memcpy(to.data(), bytes.data() + offset, to.size());
                return true;
            }};
}

bool looks_like_mp4(std::span<const std::uint8_t> beginning) {
    BoxReader in(beginning);
    in.skip(4);
    const auto type = in.u32();
    constexpr std::array first = {four("ftyp"), four("styp"), four("moov"), four("moof"), four("mdat"),
                                  four("free"), four("wide"), four("skip"), four("sidx")};
    return in.ok() && std::find(first.begin(), first.end(), type) != first.end();
}

Result<Mp4Tables> read_mp4_tables(const FileBytes& file) {
    Tables tables{file, {}};
    Mp4Tables out;
    out.missing_bytes = missing_bytes(file);
    tables.told_bytes = file.size + out.missing_bytes;
    for (std::uint64_t offset = 0; offset < file.size;) {
        const auto box = box_at(file, offset);
        if (!box) break;
        const bool movie = box->type == four("moov");
        if (movie || box->type == four("moof")) {
            if (box->end - box->inside > most_table_bytes)
                return fail(ErrorKind::limit, "the .mp4's tables are larger than 512 MiB");
            std::vector<std::uint8_t> inside(static_cast<std::size_t>(box->end - box->inside));
            if (!file.read(box->inside, inside)) return corrupt("tables cannot be read");
            auto ok = movie ? read_movie(tables, inside) : read_fragment(tables, offset, inside);
            // What comes behind the last whole fragment was cut off.
            if (!ok && !movie && box->end == file.size && !tables.tracks.empty()) break;
            if (!ok && movie && out.missing_bytes > 0)
                return corrupt(std::string("box 'moov' is cut short") + tables_advice);
            if (!ok) return tl::unexpected(ok.error());
        }
        offset = box->end;
    }
    if (!tables.has_movie)
        return corrupt(std::string("box 'moov' is missing: the file is cut short, or a piece of one") + tables_advice);
    bool has_meshes = false;
    for (auto& track : tables.tracks) {
        has_meshes = has_meshes || track.track.kind == SampleTrack::meshes;
        out.tracks.push_back(std::move(track.track));
    }
    if (!has_meshes)
        return fail(ErrorKind::bad_input, "the .mp4 has no track of meshes, which has the sample entry 'htvm'");
    return out;
}

}  // namespace htvm
