// htvm info: what is in a stream.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "codec/format/frame_kinds.h"
#include "codec/intra/leveled_frame.h"
#include "command_line/capture.h"
#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "command_line/visible.h"
#include "commands.h"
#include "htvm/audio.hpp"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/running_time.hpp"
#include "htvm/texture.hpp"
#include "metrics/recoded_area.h"
#include "rate_report.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input;
    bool json = false, summary = false;
    DecoderOptions limits;
    HubTrust trust;
    double megabits = 0, buffer_seconds = 1;  // of the line and the receiver's buffer to check against; 0: no check
};

// Adds a codebook's bytes to those of the frame that it came with.
void add_codebook(LayerBytes& bytes, const Packet& packet) {
    bytes.overhead += packet_overhead;
    if (!packet.payload.empty())
        bytes[packet.payload[0] == 0 ? Layer::geometry : Layer::colour] += packet.payload.size();
}

// A T-frame tells what its layers take only to who decodes it, and what it needs; the other kinds by their tables. Of
// one that cannot be decoded, all is overhead.
class FrameInspector {
public:
    struct Inspected {
        FrameInfo info;
        std::optional<double> recoded;                  // recoded_share(); nothing if it is not known
        std::vector<internal::LevelShare> levels = {};  // of an I-frame that has any
    };
    FrameInspector(Decoder& decoder, const DecoderOptions& limits)
        : decoder_(decoder), most_vertices_(limits.max_vertices) {}
    Result<Inspected> inspect(const Packet& packet) {
        const auto type = frame_type(packet.kind);
        if (type == FrameType::intra && internal::is_referred(packet, internal::rules_of(*type))) intra_ = packet;
        const auto sent = htvm::inspect(packet);
        if (!sent) return tl::unexpected(sent.error());
        if (type == FrameType::tracked || type == FrameType::patched) {
            if (intra_) static_cast<void>(decoder_.decode(*intra_));
            intra_.reset();
            if (const auto decoded = decoder_.decode(packet); decoded && *decoded)
                return Inspected{(*decoded)->info, recoded_share((*decoded)->mesh, *sent)};
            return Inspected{*sent, {}};
        }
        return Inspected{*sent, type == FrameType::predicted ? 0.0 : 1.0,
                         type == FrameType::intra ? levels_of(packet) : std::vector<internal::LevelShare>()};
    }

private:
    std::vector<internal::LevelShare> levels_of(const Packet& packet) const {
        const auto payload = internal::read_frame_payload(packet.payload);
        auto shares =
            payload ? internal::level_shares(*payload, most_vertices_) : Result<std::vector<internal::LevelShare>>();
        return shares ? std::move(*shares) : std::vector<internal::LevelShare>();
    }

    Decoder& decoder_;
    std::size_t most_vertices_;
    std::optional<Packet> intra_;  // the last that may be referred to, as long as nothing needed it
};

// Whether a place to start is marked; that of I- and TP-frames goes without saying.
bool is_marked(const FrameInfo& f, bool start) {
    return start && f.type != FrameType::intra && f.type != FrameType::patched;
}

// start: whether the index names it as a place to start.
void print_frame(const FrameInfo& f, bool start) {
    auto bpv = [&](std::size_t bytes) { return bits_per_vertex(bytes, f.source_vertices); };
    const auto& b = f.bytes;
    fmt::print(
        "{:>6} {:>4} {:>6} {:>10.3f} {:>8} {:>9} {:>9} {:>15.3f} {:>8.3f} {:>8.3f} {:>17.3f} {:>8.3f} {:>8.3f} "
        "{:>14.3f} {:>22.3f} {:>8.3f}{}\n",
        f.frame,
        std::string(kind_of(f.type).letter) + (f.group > 1 ? fmt::format("{}/{}", f.place, f.group) : "") +
            (is_marked(f, start) ? "*" : ""),
        f.reference, static_cast<double>(f.timestamp_us) / 1e6, f.vertices, f.triangles, b.total(),
        bpv(b[Layer::pose] + b[Layer::transforms]), bpv(b[Layer::geometry] + b[Layer::external_intra]),
        bpv(b[Layer::colour]), bpv(b[Layer::normals] + b[Layer::texcoords]), bpv(b[Layer::mapping]),
        bpv(b[Layer::fans]), bpv(b[Layer::distance_orders]),
        bpv(b[Layer::tracked] + b[Layer::removed] + b[Layer::border]), bpv(b.total()),
        f.reason == FrameReason::none ? "" : fmt::format(" {:>7}", name_of(f.reason)));
}

const char* axis_name(UpAxis up) { return up == UpAxis::unknown ? "unknown" : word_of(up, up_axes); }

void print_sequence(const SequenceInfo& s, const std::string& input) {
    fmt::print(
        "{}: {:g} frames/s, positions on a lattice of {:g} mm, captured in units of {:g} mm; stream version {}\n",
        input, static_cast<double>(s.fps_numerator) / s.fps_denominator, s.lattice_step, s.unit_micrometres / 1000.0,
        s.version);
    if (s.session != 0) fmt::print("session: {}\n", s.session);
    if (s.up != UpAxis::unknown)
        fmt::print("up: {}{}\n", axis_name(s.up), s.floor ? fmt::format(", the floor at {:g} mm", *s.floor) : "");
    for (const auto& [key, value] : s.metadata) fmt::print("{}: {}\n", visible(key), visible(value));
    if (s.global_shift != GlobalShift{})
        fmt::print("global shift, which decode adds: {}, {}, {} mm\n", s.global_shift[0], s.global_shift[1],
                   s.global_shift[2]);
    if (!s.has_skeleton) {
        fmt::print("no skeleton: one bone stands in, radius {:.0f} mm\n", s.radii[0]);
        return;
    }
    fmt::print("skeleton: {} joints, {} bones, radii in mm:", s.skeleton.joint_names.size(), s.skeleton.bones.size());
    for (const auto r : s.radii) fmt::print(" {:.0f}", r);
    fmt::print("\n");
}

nlohmann::json sequence_json(const SequenceInfo& s) {
    nlohmann::json bones = nlohmann::json::array();
    for (const auto& bone : s.skeleton.bones) bones.push_back({bone.first, bone.second});
    nlohmann::json metadata = nlohmann::json::array();
    for (const auto& [key, value] : s.metadata) metadata.push_back({{"key", key}, {"value", value}});
    return {{"version", s.version},
            {"session", s.session},
            {"up", axis_name(s.up)},
            {"floor_mm", s.floor ? nlohmann::json(*s.floor) : nlohmann::json()},
            {"metadata", metadata},
            {"global_shift_mm", s.global_shift},
            {"fps", static_cast<double>(s.fps_numerator) / s.fps_denominator},
            {"lattice_step_mm", s.lattice_step},
            {"unit_mm", s.unit_micrometres / 1000.0},
            {"skeleton_tracked", s.has_skeleton},
            {"joints", s.skeleton.joint_names},
            {"bones", bones},
            {"radii_mm", s.radii},
            {"nearest_vertices", s.nearest_vertices}};
}

// Reports what the stream would do on such a line; an error if its receiver would have to wait.
Result<void> check_buffer(const Options& options, const BufferModel& buffer) {
    if (!options.json)
        fmt::print("over {:g} Mbit/s, a buffer of {:g} s is at most {:.1f} % full (frame {})\n", options.megabits,
                   options.buffer_seconds, buffer.peak_percent(), buffer.peak_frame());
    if (!buffer.overflows()) return {};
    return fail(ErrorKind::limit,
                fmt::format("{}: frame {} overfills the buffer; over {:g} Mbit/s the stream needs one "
                            "of {:.3f} s",
                            options.input, buffer.first_overflow(), options.megabits, buffer.seconds_needed()));
}

nlohmann::json buffer_json(const Options& options, const BufferModel& buffer) {
    return {{"megabits_per_second", options.megabits},   {"seconds", options.buffer_seconds},
            {"peak_percent", buffer.peak_percent()},     {"peak_frame", buffer.peak_frame()},
            {"seconds_needed", buffer.seconds_needed()}, {"overflows", buffer.overflows()}};
}

nlohmann::json index_json(const StreamIndex& index) {
    nlohmann::json out = {{"frames", index.frames}, {"seconds", static_cast<double>(index.duration_us) / 1e6}};
    if (index.bounds) out["bounds_mm"] = {index.bounds->low, index.bounds->high};
    return out;
}

bool is_start(const StreamIndex& index, std::uint64_t frame) {
    return std::ranges::binary_search(index.points, frame, {}, &AccessPoint::frame);
}

void print_index(const StreamIndex& index) {
    fmt::print("index: {}, {:.2f} s, {} to start", counted(index.frames, "frame"),
               static_cast<double>(index.duration_us) / 1e6, counted(index.points.size(), "place"));
    if (const auto& b = index.bounds)
        fmt::print(", within {:.0f} {:.0f} {:.0f} to {:.0f} {:.0f} {:.0f} mm", b->low[0], b->low[1], b->low[2],
                   b->high[0], b->high[1], b->high[2]);
    fmt::print("\n");
}

// How much of the surface the patches of TP-frames replace, over all frames that refer to another mesh.
struct PatchedArea {
    std::size_t frames = 0, patched = 0;
    double sum = 0, largest = 0;
    double mean() const { return frames > 0 ? sum / static_cast<double>(frames) : 0; }
};

void add(PatchedArea& area, FrameType type, std::optional<double> recoded) {
    if ((type != FrameType::tracked && type != FrameType::patched) || !recoded) return;
    ++area.frames;
    if (type == FrameType::patched) ++area.patched;
    area.sum += *recoded;
    area.largest = std::max(area.largest, *recoded);
}

// Adds those of one I-frame to those of all.
void add(std::vector<internal::LevelShare>& sum, std::span<const internal::LevelShare> levels) {
    if (sum.size() < levels.size()) sum.resize(levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k) {
        sum[k].vertices += levels[k].vertices;
        sum[k].bytes += levels[k].bytes;
        sum[k].colour_bytes += levels[k].colour_bytes;
        sum[k].referred = levels[k].referred;
    }
}

nlohmann::json levels_json(std::span<const internal::LevelShare> levels) {
    nlohmann::json out = nlohmann::json::array();
    for (const auto& level : levels)
        out.push_back({{"vertices", level.vertices},
                       {"bytes", level.bytes},
                       {"colour_bytes", level.colour_bytes},
                       {"referred", level.referred}});
    return out;
}

// What each level takes, a line each. frames: how many I-frames have levels.
std::string levels_text(std::span<const internal::LevelShare> levels, std::size_t frames) {
    if (frames == 0) return {};
    std::string out = fmt::format("levels, a mean of {}:\n", counted(frames, "I-frame"));
    const auto mean = [&](std::size_t sum) { return static_cast<double>(sum) / static_cast<double>(frames); };
    std::size_t referred = 0;
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const auto& level = levels[k];
        out += fmt::format("  {:<7} {:>7.0f} more vertices, {:>6.0f} bytes",
                           k == 0 ? "base" : fmt::format("level {}", k), mean(level.vertices), mean(level.bytes));
        if (level.colour_bytes > 0) out += fmt::format(", {:.0f} of colours", mean(level.colour_bytes));
        referred += level.referred ? 1 : 0;
        out += level.referred ? "\n" : fmt::format("; left out by decode --level {}\n", k - referred);
    }
    return out;
}

nlohmann::json patched_area_json(const PatchedArea& area) {
    if (area.frames == 0) return {};
    return {{"frames", area.frames},
            {"patched", area.patched},
            {"mean_share", area.mean()},
            {"largest_share", area.largest}};
}

// The sound of the whole stream.
struct AudioTotals {
    std::uint64_t packets = 0, bytes = 0, samples = 0;  // samples: that are heard
    std::uint8_t channels = 0;                          // the most
    double seconds() const { return static_cast<double>(samples) / audio_samples_per_second; }
};

Result<void> add(AudioTotals& totals, const Packet& packet) {
    const auto audio = read_audio(packet);
    if (!audio) return audio.error().kind == ErrorKind::unsupported ? Result<void>() : tl::unexpected(audio.error());
    ++totals.packets;
    totals.bytes += packet.payload.size() + packet_overhead;
    totals.samples += audio->samples() - audio->skip_begin - audio->skip_end;
    totals.channels = std::max(totals.channels, audio->channels);
    return {};
}

// Pictures of one coder and size.
struct PictureKind {
    PictureCoder coder{};
    std::uint32_t width = 0, height = 0;
    std::uint64_t pictures = 0;
};

// The pictures of the whole stream.
struct StreamPictures {
    static constexpr std::size_t most_kinds = 16;
    std::uint64_t pictures = 0, keys = 0, bytes = 0;
    std::vector<PictureKind> kinds = {};  // in the stream's order; those beyond the most are not listed
};

Result<void> add(StreamPictures& totals, const Packet& packet) {
    auto picture = read_texture_picture(packet);
    if (!picture)
        return picture.error().kind == ErrorKind::unsupported ? Result<void>() : tl::unexpected(picture.error());
    const auto known = std::find_if(totals.kinds.begin(), totals.kinds.end(), [&](const PictureKind& kind) {
        return kind.coder == picture->coder && kind.width == picture->width && kind.height == picture->height;
    });
    if (known != totals.kinds.end())
        ++known->pictures;
    else if (totals.kinds.size() < StreamPictures::most_kinds)
        totals.kinds.push_back({picture->coder, picture->width, picture->height, 1});
    ++totals.pictures;
    totals.keys += is_key_picture(packet) ? 1 : 0;
    totals.bytes += packet.payload.size() + packet_overhead;
    return {};
}

nlohmann::json pictures_json(const StreamPictures& totals, double seconds) {
    if (totals.pictures == 0) return {};
    const auto& first = totals.kinds[0];
    nlohmann::json kinds = nlohmann::json::array();
    for (const auto& [coder, width, height, pictures] : totals.kinds)
        kinds.push_back({{"coder", name_of(coder)}, {"width", width}, {"height", height}, {"pictures", pictures}});
    return {{"coder", name_of(first.coder)},
            {"width", first.width},
            {"height", first.height},
            {"differ", totals.kinds.size() > 1},
            {"kinds", kinds},
            {"pictures", totals.pictures},
            {"key_pictures", totals.keys},
            {"bytes", totals.bytes},
            {"megabits_per_second", 8e-6 * static_cast<double>(totals.bytes) / seconds}};
}

// "AV1, 256 x 256 pixels, 9 pictures", and the same of others.
std::string kinds_text(const StreamPictures& totals) {
    std::string out;
    std::uint64_t listed = 0;
    for (const auto& [coder, width, height, pictures] : totals.kinds) {
        out += fmt::format("{}{}, {} x {} pixels, {}", out.empty() ? "" : "; ", name_of(coder), width, height,
                           counted(pictures, "picture"));
        listed += pictures;
    }
    if (listed < totals.pictures) out += fmt::format("; {} of other sizes", totals.pictures - listed);
    if (totals.kinds.size() > 1) out += fmt::format("; {} in all", totals.pictures);
    return out;
}

// What the pictures are, for people and for programs.
const char* layout_text(TextureLayout layout) {
    return layout == TextureLayout::projection ? "of one camera's film, projected, " : "";
}

const char* layout_word(TextureLayout layout) {
    switch (layout) {
        case TextureLayout::none:
            break;
        case TextureLayout::captured:
            return "captured";
        case TextureLayout::charts:
            return "charts";
        case TextureLayout::projection:
            return "projection";
    }
    return "none";
}

nlohmann::json audio_json(const AudioTotals& totals) {
    if (totals.packets == 0) return {};
    return {{"coder", "opus"}, {"channels", totals.channels}, {"seconds", totals.seconds()}, {"bytes", totals.bytes}};
}

// What is known of a stream so far.
struct Findings {
    TotalsByType totals;
    std::size_t frames = 0;
    std::uint64_t bytes = 0;
    bool has_index = false, has_groups = false;
    bool marks_starts = false;  // of a T-frame
    std::optional<StreamIndex> front;
    AudioTotals audio;
    StreamPictures pictures;
    PatchedArea patched;
    std::vector<internal::LevelShare> levels;  // of all I-frames that have any
    std::size_t leveled_frames = 0;
    std::optional<SequenceInfo> first_sequence;
    nlohmann::json sequence_list = nlohmann::json::array(), frame_list = nlohmann::json::array();
};

// The stream, packet by packet.
struct Inspection {
    const Options& options;
    Decoder headers =
        Decoder(options.limits);  // takes the sequence headers, and frames where the inspector asks for it
    FrameInspector inspector = FrameInspector(headers, options.limits);
    FrameNumbers numbers = {};
    RunningTime time = {};
    LayerBytes codebooks = {};               // that came since the last frame
    std::optional<BufferModel> buffer = {};  // that --bitrate checks
    Findings found = {};
    bool lists_frames() const { return !options.json && !options.summary; }
};

void print_heading() {
    fmt::print(
        "{:>6} {:>4} {:>6} {:>10} {:>8} {:>9} {:>9} {:>15} {:>8} {:>8} {:>17} {:>8} {:>8} {:>14} {:>22} {:>8} {:>7}\n",
        "frame", "type", "ref", "time s", "vertices", "triangles", "bytes", "pose/transforms", "geometry", "colour",
        "normals/texcoords", "mapping", "fans", "distance order", "tracked/removed/border", "bpv", "why");
}

Result<void> take_header(Inspection& in, const Packet& packet) {
    const bool first = !in.headers.sequence();
    if (auto ok = in.headers.decode(packet); !ok) return tl::unexpected(ok.error());
    if (!first || in.options.json) return {};
    print_sequence(*in.headers.sequence(), in.options.input);
    if (in.found.front) print_index(*in.found.front);
    if (in.lists_frames()) print_heading();
    return {};
}

Result<void> take_front_index(Inspection& in, const Packet& packet) {
    auto read = read_index(packet);
    if (!read) return tl::unexpected(read.error());
    in.found.front = std::move(*read);
    // Else it stands behind the line that names the file.
    if (!in.options.json && in.headers.sequence()) print_index(*in.found.front);
    return {};
}

// What is no frame. Errors do not name the stream.
Result<void> take_beside_frames(Inspection& in, const Packet& packet) {
    switch (packet.kind) {
        case PacketKind::codebook:
            add_codebook(in.codebooks, packet);
            return {};
        case PacketKind::audio:
            return add(in.found.audio, packet);
        case PacketKind::texture:
            return add(in.found.pictures, packet);
        case PacketKind::index:
            in.found.has_index = true;
            return {};
        case PacketKind::front_index:
            in.found.has_index = true;
            return in.found.front ? Result<void>() : take_front_index(in, packet);
        default:
            return {};
    }
}

// The first frame behind another sequence header.
void begin_sequence(Inspection& in, std::uint32_t first_frame) {
    const auto& sequence = *in.headers.sequence();
    if (!in.options.json && in.found.frames > 0)
        print_sequence(sequence, fmt::format("from frame {} on, another sequence", first_frame));
    if (!in.found.first_sequence) in.found.first_sequence = sequence;
    in.found.sequence_list.push_back(sequence_json(sequence));
    in.found.sequence_list.back()["first_frame"] = first_frame;
}

Result<void> take_frame(Inspection& in, const Packet& packet) {
    auto inspected = in.inspector.inspect(packet);
    if (!inspected) return tl::unexpected(inspected.error());
    auto& [frame, recoded, levels] = *inspected;
    auto& found = in.found;
    frame.bytes += std::exchange(in.codebooks, {});
    frame.frame = in.numbers.of(frame.frame);
    frame.reference = in.numbers.of(frame.reference);
    if (in.numbers.begins_sequence() && in.headers.sequence()) begin_sequence(in, frame.frame);
    ++found.frames;
    found.has_groups = found.has_groups || frame.group > 1;
    add(found.totals, frame);
    add(found.patched, frame.type, recoded);
    add(found.levels, levels);
    found.leveled_frames += levels.empty() ? 0 : 1;
    if (in.options.json) {
        found.frame_list.push_back(frame_json(frame));
        found.frame_list.back()["recoded_share"] = recoded ? nlohmann::json(*recoded) : nlohmann::json();
        if (!levels.empty()) found.frame_list.back()["levels"] = levels_json(levels);
    }
    const bool start = found.front && is_start(*found.front, frame.frame);
    found.marks_starts = found.marks_starts || is_marked(frame, start);
    if (in.lists_frames()) print_frame(frame, start);
    return {};
}

Result<void> count(Inspection& in, const Packet& packet) {
    if (in.buffer) in.buffer->add(packet);
    in.numbers.push(packet);
    in.time.push(packet, in.numbers.begins_sequence());
    in.found.bytes += packet.payload.size() + packet_overhead;
    if (packet.kind == PacketKind::sequence) return take_header(in, packet);
    if (frame_type(packet.kind)) return take_frame(in, packet);
    const auto taken = take_beside_frames(in, packet);
    return taken ? taken : fail(taken.error().kind, in.options.input + ": " + taken.error().message);
}

// What the whole stream takes.
struct Size {
    double seconds = 0, megabits_per_second = 0;
    std::uint64_t bytes_outside_frames = 0;  // sequence headers, the index
};

Size size_of(const Inspection& in) {
    const auto& found = in.found;
    Size out;
    out.seconds = static_cast<double>(found.frames > 0 ? in.time.total_us() : in.time.one_frame_us()) / 1e6;
    out.megabits_per_second = 8e-6 * static_cast<double>(found.bytes) / out.seconds;
    out.bytes_outside_frames =
        found.bytes - found.totals.all().bytes.total() - found.audio.bytes - found.pictures.bytes;
    return out;
}

void print_json(const Inspection& in, const StreamInput& input) {
    const auto& found = in.found;
    const auto size = size_of(in);
    const auto& sequence = found.first_sequence ? *found.first_sequence : *in.headers.sequence();
    nlohmann::json out{{"sequence", sequence_json(sequence)},
                       {"sequences", found.sequence_list},
                       {"frames", found.frame_list},
                       {"reasons", reasons_json(found.totals)},
                       {"bytes", found.bytes},
                       {"bytes_outside_frames", size.bytes_outside_frames},
                       {"audio", audio_json(found.audio)},
                       {"pictures", pictures_json(found.pictures, size.seconds)},
                       {"patched_area", patched_area_json(found.patched)},
                       {"index", found.has_index},
                       {"front_index", found.front ? index_json(*found.front) : nlohmann::json()},
                       {"damaged_bytes", input.damaged_bytes()},
                       {"megabits_per_second", size.megabits_per_second}};
    if (found.pictures.pictures > 0) out["pictures"]["layout"] = layout_word(sequence.texture.layout);
    if (in.buffer) out["buffer"] = buffer_json(in.options, *in.buffer);
    fmt::print("{}\n", out.dump(2));
}

void print_totals(const Inspection& in) {
    const auto& found = in.found;
    const AudioTotals& audio = found.audio;
    const StreamPictures& pictures = found.pictures;
    const PatchedArea& patched = found.patched;
    const auto size = size_of(in);
    const auto& sequence = found.first_sequence ? *found.first_sequence : *in.headers.sequence();
    if (!in.options.summary)
        fmt::print(
            "bpv: bits per captured vertex, as from pose/transforms on; vertices and triangles: of the decoded "
            "mesh{}\n{}{}\n",
            found.leveled_frames > 0 ? ", of an I-frame with levels without its detail" : "",
            found.marks_starts ? "*: a place to start, as every I- and TP-frame is\n" : "",
            found.has_groups
                ? "T1/8: the first of a group of eight T-frames; its packet, and others, bring frames that follow\n"
                : "");
    if (audio.packets > 0)
        fmt::print("audio: Opus, {}, {:.2f} s, {} bytes\n", audio.channels == 1 ? "mono" : "stereo", audio.seconds(),
                   audio.bytes);
    if (pictures.pictures > 0)
        fmt::print("pictures: {}{}, {} of them key pictures, {} bytes, {:.2f} Mbit/s\n",
                   layout_text(sequence.texture.layout), kinds_text(pictures), pictures.keys, pictures.bytes,
                   8e-6 * static_cast<double>(pictures.bytes) / size.seconds);
    if (patched.patched > 0)
        fmt::print("patches in {} replace {:.2f} % of the surface a T- or TP-frame on average, at most {:.1f} %\n",
                   counted(patched.patched, "TP-frame"), 100 * patched.mean(), 100 * patched.largest);
    fmt::print("{}", levels_text(found.levels, found.leveled_frames));
    fmt::print("{}{}{} in {:.2f} s, {} bytes ({} outside frames), {:.2f} Mbit/s{}\n", layer_table(found.totals),
               reasons_text(found.totals), counted(found.frames, "frame"), size.seconds, found.bytes,
               size.bytes_outside_frames, size.megabits_per_second,
               found.has_index ? ", with an index for seeking" : "");
}

Result<void> info(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes, options.trust);
    if (!input) return tl::unexpected(input.error());
    Inspection in{options};
    if (options.megabits > 0) in.buffer.emplace(1e6 * options.megabits, options.buffer_seconds);
    while (auto packet = input->next()) {
        if (auto counted = count(in, *packet); !counted) return counted;
        if (input->is_live()) std::fflush(stdout);
    }
    if (input->refusal()) return tl::unexpected(*input->refusal());
    if (!in.headers.sequence() && input->oversized_packets() + input->lost_segments() > 0)
        return check_whole(*input, options.input);
    if (!in.headers.sequence())
        return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream: no sequence header was found");
    if (options.json)
        print_json(in, *input);
    else
        print_totals(in);
    if (auto whole = check_whole(*input, options.input); !whole) return whole;
    return in.buffer ? check_buffer(options, *in.buffer) : Result<void>();
}

// What each word of the last column means.
std::string reasons_help() {
    std::string out = "The last column and the counts below say why an I- or TP-frame was sent:";
    for (const auto& [reason, name, meaning] : frame_reasons)
        if (reason != FrameReason::none) out += fmt::format("\n  {:<8} {}", name, meaning);
    return out;
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("info", "Show what is in an .htvm stream: frames, sizes by layer, skeleton");
    command
        ->add_option(
            "input", options->input,
            "The stream: a file (.htvm, .mp4 or .m3u8), - for standard input, a playlist,\n"
            "http://HOST/hls/NAME/stream.m3u8, or a live stream, ws://HOST:PORT/watch/NAME, until it or Ctrl-C "
            "ends it")
        ->type_name("FILE")
        ->required();
    command->add_flag("--summary", options->summary, "The totals only, no line per frame");
    command->add_flag("--json", options->json, "Everything as JSON");
    add_hub_trust(*command, options->trust);
    add_packet_limits(*command, options->limits);
    auto* bitrate = command->add_option("--bitrate", options->megabits,
                                        "Check that the stream plays without a pause over a line of this many Mbit/s,\n"
                                        "counting all bytes of its packets (exit code 5 if not)");
    bitrate->check(CLI::Range(1e-3, 1e6));
    command
        ->add_option("--buffer", options->buffer_seconds,
                     "--bitrate: seconds of stream that the receiver holds (default 1)")
        ->check(CLI::Range(0.01, 3600.0))
        ->needs(bitrate);
    command->footer(
        "Columns: ref is the frame that it refers to; vertices are the decoded mesh's, with those that are not there\n"
        "where surface comes and goes, and triangles those shown; pose is the skeleton (I), transforms are the bones'\n"
        "(EP) or the nodes' (T); fans and distance order are the connectivity's two parts; texcoords are texture\n"
        "coordinates; of TP-frames tracked is what a T-frame has too, in one, removed what the patch replaces, border\n"
        "where it joins, and the other columns are the patch's; bpv is the frame's total, with packet and layer\n"
        "headers, counts and ends of runs (overhead, below). All in bits per vertex of the captured mesh.\n"
        "T-frames are decoded to tell their parts; one that cannot be counts as overhead.\n"
        "Decoded positions lie on the lattice; the step of the quality (encode -q) is coarser.\n" +
        reasons_help());
    command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace htvm::app
