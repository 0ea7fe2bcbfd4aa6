// htvm info: what is in a stream.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "codec/format/frame_kinds.h"
#include "command_line/layer_table.h"
#include "command_line/terminal.h"
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
        std::optional<double> recoded;  // recoded_share(); nothing if it is not known
    };
    explicit FrameInspector(Decoder& decoder) : decoder_(decoder) {}
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
        return Inspected{*sent, type == FrameType::predicted ? 0.0 : 1.0};
    }

private:
    Decoder& decoder_;
    std::optional<Packet> intra_;  // the last that may be referred to, as long as nothing needed it
};

// start: whether the index names it as a place to start; that of I- and TP-frames goes without saying.
void print_frame(const FrameInfo& f, bool start) {
    auto bpv = [&](std::size_t bytes) { return bits_per_vertex(bytes, f.source_vertices); };
    const auto& b = f.bytes;
    fmt::print(
        "{:>6} {:>4} {:>6} {:>10.3f} {:>8} {:>9} {:>9} {:>15.3f} {:>8.3f} {:>8.3f} {:>17.3f} {:>8.3f} {:>8.3f} "
        "{:>14.3f} {:>22.3f} {:>8.3f}\n",
        f.frame,
        std::string(kind_of(f.type).letter) + (f.group > 1 ? fmt::format("{}/{}", f.place, f.group) : "") +
            (start && f.type != FrameType::intra && f.type != FrameType::patched ? "*" : ""),
        f.reference, static_cast<double>(f.timestamp_us) / 1e6, f.vertices, f.triangles, b.total(),
        bpv(b[Layer::pose] + b[Layer::transforms]), bpv(b[Layer::geometry] + b[Layer::external_intra]),
        bpv(b[Layer::colour]), bpv(b[Layer::normals] + b[Layer::texcoords]), bpv(b[Layer::mapping]),
        bpv(b[Layer::fans]), bpv(b[Layer::distance_orders]),
        bpv(b[Layer::tracked] + b[Layer::removed] + b[Layer::border]), bpv(b.total()));
}

const char* axis_name(UpAxis up) {
    constexpr std::array names = {"unknown", "x", "-x", "y", "-y", "z", "-z"};
    return names[static_cast<std::size_t>(up)];
}

void print_sequence(const SequenceInfo& s, const std::string& input) {
    fmt::print(
        "{}: {:g} frames/s, positions on a lattice of {:g} mm, captured in units of {:g} mm; stream version {}\n",
        input, static_cast<double>(s.fps_numerator) / s.fps_denominator, s.lattice_step, s.unit_micrometres / 1000.0,
        s.version);
    if (s.session != 0) fmt::print("session: {}\n", s.session);
    if (s.up != UpAxis::unknown)
        fmt::print("up: {}{}\n", axis_name(s.up), s.floor ? fmt::format(", the floor at {:g} mm", *s.floor) : "");
    for (const auto& [key, value] : s.metadata) fmt::print("{}: {}\n", key, value);
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

nlohmann::json audio_json(const AudioTotals& totals) {
    if (totals.packets == 0) return {};
    return {{"coder", "opus"}, {"channels", totals.channels}, {"seconds", totals.seconds()}, {"bytes", totals.bytes}};
}

Result<void> info(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes, options.trust);
    if (!input) return tl::unexpected(input.error());
    Decoder headers(options.limits);  // takes the sequence headers, and frames where the inspector asks for it
    FrameInspector inspector(headers);
    TotalsByType totals;
    std::size_t count = 0;
    LayerBytes codebooks;
    nlohmann::json frames = nlohmann::json::array();
    std::uint64_t bytes = 0;
    bool index = false;
    FrameNumbers numbers;
    RunningTime time;
    std::optional<StreamIndex> front;
    bool grouped = false;
    AudioTotals audio;
    StreamPictures pictures;
    PatchedArea patched;
    nlohmann::json sequences = nlohmann::json::array();
    std::optional<SequenceInfo> first_sequence;
    std::optional<BufferModel> buffer;
    if (options.megabits > 0) buffer.emplace(1e6 * options.megabits, options.buffer_seconds);
    while (auto packet = input->next()) {
        if (buffer) buffer->add(*packet);
        numbers.push(*packet);
        time.push(*packet, numbers.begins_sequence());
        bytes += packet->payload.size() + packet_overhead;
        if (packet->kind == PacketKind::sequence) {
            const bool first = !headers.sequence();
            if (auto ok = headers.decode(*packet); !ok) return tl::unexpected(ok.error());
            if (!options.json && first) print_sequence(*headers.sequence(), options.input);
            if (!options.json && first && front) print_index(*front);
            if (!options.json && first && !options.summary)
                fmt::print(
                    "{:>6} {:>4} {:>6} {:>10} {:>8} {:>9} {:>9} {:>15} {:>8} {:>8} {:>17} {:>8} {:>8} {:>14} {:>22} "
                    "{:>8}\n",
                    "frame", "type", "ref", "time s", "vertices", "triangles", "bytes", "pose/transforms", "geometry",
                    "colour", "normals/texcoords", "mapping", "fans", "distance order", "tracked/removed/border",
                    "bpv");
        }
        if (packet->kind == PacketKind::codebook) add_codebook(codebooks, *packet);
        if (packet->kind == PacketKind::audio)
            if (auto ok = add(audio, *packet); !ok)
                return fail(ok.error().kind, options.input + ": " + ok.error().message);
        if (packet->kind == PacketKind::texture)
            if (auto ok = add(pictures, *packet); !ok)
                return fail(ok.error().kind, options.input + ": " + ok.error().message);
        if (packet->kind == PacketKind::front_index && !front) {
            auto read = read_index(*packet);
            if (!read) return fail(read.error().kind, options.input + ": " + read.error().message);
            front = std::move(*read);
            if (!options.json && headers.sequence()) print_index(*front);  // else behind the line that names the file
        }
        if (packet->kind == PacketKind::index || packet->kind == PacketKind::front_index) index = true;
        if (!frame_type(packet->kind)) continue;
        auto inspected = inspector.inspect(*packet);
        if (!inspected) return tl::unexpected(inspected.error());
        const auto& recoded = inspected->recoded;
        auto* frame = &inspected->info;
        frame->bytes += codebooks;
        codebooks = {};
        frame->frame = numbers.of(frame->frame);
        frame->reference = numbers.of(frame->reference);
        if (numbers.begins_sequence() && headers.sequence()) {
            if (!options.json && count > 0)
                print_sequence(*headers.sequence(), fmt::format("from frame {} on, another sequence", frame->frame));
            if (!first_sequence) first_sequence = headers.sequence();
            sequences.push_back(sequence_json(*headers.sequence()));
            sequences.back()["first_frame"] = frame->frame;
        }
        ++count;
        grouped = grouped || frame->group > 1;
        add(totals, *frame);
        add(patched, frame->type, recoded);
        if (options.json) {
            frames.push_back(frame_json(*frame));
            frames.back()["recoded_share"] = recoded ? nlohmann::json(*recoded) : nlohmann::json();
        }
        if (!options.json && !options.summary) print_frame(*frame, front && is_start(*front, frame->frame));
        if (input->is_live()) std::fflush(stdout);
    }
    if (input->refusal()) return tl::unexpected(*input->refusal());
    if (!headers.sequence() && input->oversized_packets() > 0) return check_whole(*input, options.input);
    if (!headers.sequence())
        return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream: no sequence header was found");
    const auto& s = *headers.sequence();
    const double seconds = static_cast<double>(count > 0 ? time.total_us() : time.one_frame_us()) / 1e6;
    const double megabits = 8e-6 * static_cast<double>(bytes) / seconds;
    const auto outside_frames =
        bytes - totals.all().bytes.total() - audio.bytes - pictures.bytes;  // sequence headers, the index
    if (options.json) {
        nlohmann::json out{{"sequence", sequence_json(first_sequence ? *first_sequence : s)},
                           {"sequences", sequences},
                           {"frames", frames},
                           {"bytes", bytes},
                           {"bytes_outside_frames", outside_frames},
                           {"audio", audio_json(audio)},
                           {"pictures", pictures_json(pictures, seconds)},
                           {"patched_area", patched_area_json(patched)},
                           {"index", index},
                           {"front_index", front ? index_json(*front) : nlohmann::json()},
                           {"damaged_bytes", input->damaged_bytes()},
                           {"megabits_per_second", megabits}};
        if (buffer) out["buffer"] = buffer_json(options, *buffer);
        fmt::print("{}\n", out.dump(2));
    } else {
        if (!options.summary)
            fmt::print(
                "bpv: bits per captured vertex, as from pose/transforms on; vertices and triangles: of the decoded "
                "mesh\n"
                "*: a place to start, as every I- and TP-frame is\n{}\n",
                grouped
                    ? "T1/8: the first of a group of eight T-frames; its packet, and others, bring frames that follow\n"
                    : "");
        if (audio.packets > 0)
            fmt::print("audio: Opus, {}, {:.2f} s, {} bytes\n", audio.channels == 1 ? "mono" : "stereo",
                       audio.seconds(), audio.bytes);
        if (pictures.pictures > 0)
            fmt::print("pictures: {}, {} of them key pictures, {} bytes, {:.2f} Mbit/s\n", kinds_text(pictures),
                       pictures.keys, pictures.bytes, 8e-6 * static_cast<double>(pictures.bytes) / seconds);
        if (patched.patched > 0)
            fmt::print("patches in {} replace {:.2f} % of the surface a T- or TP-frame on average, at most {:.1f} %\n",
                       counted(patched.patched, "TP-frame"), 100 * patched.mean(), 100 * patched.largest);
        fmt::print("{}{} in {:.2f} s, {} bytes ({} outside frames), {:.2f} Mbit/s{}\n", layer_table(totals),
                   counted(count, "frame"), seconds, bytes, outside_frames, megabits,
                   index ? ", with an index for seeking" : "");
    }
    if (auto whole = check_whole(*input, options.input); !whole) return whole;
    if (buffer) return check_buffer(options, *buffer);
    return {};
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("info", "Show what is in an .htvm stream: frames, sizes by layer, skeleton");
    command
        ->add_option("input", options->input,
                     "The stream: a file, - for standard input, or a live one, ws://HOST:PORT/watch/NAME, until it or\n"
                     "Ctrl-C ends it")
        ->type_name("FILE")
        ->required();
    command->add_flag("--summary", options->summary, "The totals only, no line per frame");
    command->add_flag("--json", options->json, "Everything as JSON");
    add_hub_trust(*command, options->trust, "Hubs");
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
        "Columns: ref is the frame that it refers to; pose is the skeleton (I), transforms are the bones' (EP) or the\n"
        "nodes' (T); fans and distance order are the connectivity's two parts; texcoords are texture coordinates; of\n"
        "TP-frames tracked is what a T-frame has too, in one, removed what the patch replaces, border where it joins,\n"
        "and the other columns are the patch's; bpv is the frame's total, with packet and layer headers, counts and\n"
        "ends of runs (overhead, below). All in bits per vertex of the captured mesh.\n"
        "T-frames are decoded to tell their parts; one that cannot be counts as overhead.\n"
        "Decoded positions lie on the lattice; the step of the quality (encode -q) is coarser.");
    command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace htvm::app
