// htvm decode: a stream in, meshes and sound out.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "command_line/capture.h"
#include "command_line/choice.h"
#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "io/gltf_animation.h"
#include "io/loose_vertices.h"
#include "io/mesh_file.h"
#include "io/output_file.h"
#include "io/ply.h"
#include "io/sequence.h"
#include "io/timestamps.h"
#include "sound_output.h"
#include "stream_file.h"
#include "stream_seek.h"
#include "texture_output.h"
#include "used_folder.h"

namespace htvm::app {
namespace {

// What is written for a lost frame.
enum class Conceal { gap, animate };

constexpr std::array conceal_uses = {Choice<Conceal>{"gap", Conceal::gap},
                                     Choice<Conceal>{"animate", Conceal::animate}};
constexpr std::array image_formats = {Choice<ImageFormat>{"png", ImageFormat::png},
                                      Choice<ImageFormat>{"jpeg", ImageFormat::jpeg}};

struct Options {
    std::string input, output, audio, timestamps;
    std::string format = "ply";         // of meshes in a folder: the end of their names
    std::optional<ImageFormat> images;  // not given: PNG
    std::optional<LengthUnit> unit;     // not given: the capture's
    Conceal conceal = Conceal::gap;
    std::uint64_t first = 0;
    std::size_t frames = 0;
    unsigned threads = 0;
    bool json = false;
    bool all_vertices = false;  // also those that are not there
    DecoderOptions limits;
    HubTrust trust;
};

struct Summary {
    std::size_t decoded = 0, concealed = 0;
    std::size_t undecodable = 0;      // frames that arrived but could not be decoded
    std::size_t missing = 0;          // frames that are missing between others
    std::size_t damaged_packets = 0;  // codebooks and headers that could not be read
    std::size_t concealed_in_a_row = 0;
    bool any_picture = false;                  // of a texture
    std::uint32_t due = 0;                     // the number of the frame expected next
    std::optional<std::int64_t> timestamp_us;  // of the previous frame
    double decode_seconds = 0;
    std::optional<Error> refused;  // the error of the first frame that was refused because of a limit or this version
    FrameTimes times;              // of the frames written
    nlohmann::json list = nlohmann::json::array();
    std::size_t written() const { return decoded + concealed; }
    double frames_per_second() const { return static_cast<double>(decoded) / std::max(decode_seconds, 1e-9); }
};

// Where the meshes go: a file for each, one after the other on standard output, or all in one .glb.
class MeshOutput {
public:
    static Result<MeshOutput> open(const Options& options) {
        MeshOutput out;
        out.standard_ = options.output == "-";
        if (out.standard_) return out;
        auto names = mesh_output_names(options.output, "." + options.format);
        if (!names) return tl::unexpected(names.error());
        out.in_metres_ = unit_of_format(output_path(*names, 0)) && !options.unit;
        out.animated_ = names->one_file && unit_of_format(output_path(*names, 0));
        out.names_ = std::move(*names);
        std::error_code error;
        if (!out.names_.folder.empty()) std::filesystem::create_directories(out.names_.folder, error);
        out.is_pattern_ = options.output.find('%') != std::string::npos;
        if (error)
            return fail(ErrorKind::bad_input, out.names_.folder.string() + " cannot be made: " + error.message());
        return out;
    }
    // Returns the name of the file written.
    Result<std::string> write(Mesh& mesh, const FrameInfo& info, const SequenceInfo& sequence,
                              double millimetres_per_unit, const ImageFile& image, GltfTriangles triangles) {
        if (in_metres_) millimetres_per_unit = millimetres_per(LengthUnit::metre);
        if (animated_) return animate(mesh, info, sequence, millimetres_per_unit, image, triangles);
        if (!standard_) {
            const auto path = output_path(names_, info.frame);
            MeshFileOptions file_options;
            file_options.millimetres_per_unit = millimetres_per_unit;
            file_options.timestamp = time_text(info.timestamp_us);
            file_options.global_shift = sequence.global_shift;
            if (image.bytes && unit_of_format(path))
                file_options.image = *image.bytes;
            else if (image.bytes)
                if (auto ok = write_beside(path, image, file_options); !ok) return tl::unexpected(ok.error());
            if (auto ok = write_mesh(path, mesh, file_options); !ok) return tl::unexpected(ok.error());
            written_.insert(path.filename().string());
            return path.string();
        }
        if (image.bytes && !std::exchange(told_of_images_, true))
            note("standard output has no room for the pictures of the texture; -o with a folder or a pattern has");
        if (auto ok = scale_positions(mesh, 1 / millimetres_per_unit); !ok) return tl::unexpected(ok.error());
        const auto bytes = write_ply(mesh, time_text(info.timestamp_us), {}, {},
                                     in_units(sequence.global_shift, millimetres_per_unit));
        if (!bytes) return tl::unexpected(bytes.error());
        if (auto ok = write_standard_output(*bytes); !ok) return tl::unexpected(ok.error());
        return std::string("-");
    }
    // A .glb of all frames is complete.
    Result<void> finish() { return animation_ ? animation_->finish(end_) : Result<void>(); }
    // Whether the first frame is all that is asked for.
    bool one_file() const { return !standard_ && !animated_ && names_.one_file; }
    // Frames of an earlier run would be read as part of the same sequence.
    void warn_of_other_frames() const {
        if (standard_ || names_.one_file) return;
        app::warn_of_other_frames(names_, is_pattern_, written_);
    }

private:
    // An image that frames share goes to the file of the first.
    Result<void> write_beside(const std::filesystem::path& mesh, const ImageFile& image, MeshFileOptions& options) {
        if (image.bytes != written_image_) {
            image_path_ = mesh;
            image_path_.replace_extension(image.extension);
            if (auto ok = write_file(image_path_, *image.bytes); !ok) return ok;
            written_.insert(image_path_.filename().string());
            written_image_ = image.bytes;
        }
        options.texture = image_path_.filename().string();
        return {};
    }
    Result<std::string> animate(const Mesh& mesh, const FrameInfo& info, const SequenceInfo& sequence,
                                double millimetres_per_unit, const ImageFile& image, GltfTriangles triangles) {
        const auto path = output_path(names_, 0);
        const auto in_file = [&](const Error& error) { return fail(error.kind, path.string() + ": " + error.message); };
        if (!animation_) {
            GltfAnimationOptions options{
                millimetres_per_unit, sequence.up, path.stem().string(), {}, sequence.global_shift};
            for (const auto& [key, value] : sequence.metadata) {
                if (key == "title") options.title = value;
                if (key == "rights") options.rights = value;
            }
            auto created = GltfAnimation::create(path, std::move(options));
            if (!created) return tl::unexpected(created.error());
            animation_.emplace(std::move(*created));
        }
        const double seconds = static_cast<double>(info.timestamp_us) / 1e6;
        if (sequence_ != info.sequence) offset_ = end_ - seconds;
        sequence_ = info.sequence;
        if (auto ok =
                animation_->add(mesh, offset_ + seconds, fmt::format("frame {}", info.frame), image.bytes, triangles);
            !ok)
            return in_file(ok.error());
        end_ = offset_ + seconds + static_cast<double>(sequence.fps_denominator) / sequence.fps_numerator;
        return path.string();
    }

    OutputNames names_;
    std::set<std::string> written_;
    std::shared_ptr<const std::vector<std::uint8_t>> written_image_;  // the last
    std::filesystem::path image_path_;                                // its file
    bool told_of_images_ = false;
    std::optional<GltfAnimation> animation_;  // from the first frame on, if all go into one .glb
    std::optional<std::uint32_t> sequence_;   // of the last frame in it
    double offset_ = 0, end_ = 0;             // seconds: of its sequence's timestamps; when it ends
    bool standard_ = false, is_pattern_ = false, animated_ = false;
    bool in_metres_ = false;  // whatever the capture was in
};

double output_unit(const Options& options, const SequenceInfo& info) {
    return options.unit ? millimetres_per(*options.unit) : info.unit_micrometres / 1000.0;
}

// Frames in a row that came, but cannot be decoded: told in one line, as most of them are lost with the first.
struct LostFrames {
    std::uint32_t first = 0, count = 0;
    std::uint32_t concealed = 0;
    std::string why;  // of the first
};

// The data that the steps of decoding work on.
struct Decoding {
    const Options& options;
    StreamInput& input;
    MeshOutput& output;
    Decoder& decoder;
    Summary& summary;
    Progress& progress;
    FrameNumbers numbers = {};
    LostFrames lost = {};
    std::uint32_t begins_with = 0;  // number of the first frame of a stream that begins in the middle, until told
    std::uint64_t promised = 0;     // frames of the stream, by indices in front
    SoundOutput* sound = nullptr;   // takes what is read, if sound is asked for
    std::uint32_t next_number = 0;  // of the frame after the last
    TextureOutput textures = TextureOutput(options.images.value_or(ImageFormat::png));
    bool caught_up = false;  // with a live stream: who joins is sent what frames to come need, and none between
    std::optional<DecodedFrame> held = {};  // the last frame, until its picture has come
    std::optional<SequenceInfo> held_sequence = {};
};

bool is_enough(const Decoding& d) { return d.options.frames > 0 && d.summary.written() >= d.options.frames; }

Result<void> write_now(Decoding& d, DecodedFrame& frame, const SequenceInfo& sequence) {
    const auto image = frame.mesh.texcoords.empty() ? Result<ImageFile>(ImageFile{}) : d.textures.image();
    if (!image) return tl::unexpected(image.error());
    // Such a frame's triangles are those of no other, most often.
    const bool is_part = !frame.presence.empty();
    if (is_part && !d.options.all_vertices) drop_loose_vertices(frame.mesh);
    frame.info.vertices = static_cast<std::uint32_t>(frame.mesh.positions.size());
    const auto name = d.output.write(frame.mesh, frame.info, sequence, output_unit(d.options, sequence), *image,
                                     is_part ? GltfTriangles::of_one_frame : GltfTriangles::of_many_frames);
    if (!name) return tl::unexpected(name.error());
    d.summary.times.numbers.push_back(frame.info.frame);
    d.summary.times.microseconds.push_back(frame.info.timestamp_us);
    d.progress.step();
    if (!d.options.json) return {};
    auto entry = frame_json(frame.info);
    entry["file"] = *name;
    entry["concealed"] = frame.concealed;
    d.summary.list.push_back(std::move(entry));
    return {};
}

Result<void> write_held(Decoding& d) {
    if (!d.held) return {};
    auto frame = *std::exchange(d.held, std::nullopt);
    return write_now(d, frame, *d.held_sequence);
}

// A frame's picture comes behind it: one that may have one waits for it, which is until the next frame at most.
Result<void> write(Decoding& d, DecodedFrame frame) {
    if (auto ok = write_held(d); !ok) return ok;
    if (frame.mesh.texcoords.empty()) return write_now(d, frame, *d.decoder.sequence());
    d.held_sequence = *d.decoder.sequence();
    d.held = std::move(frame);
    return {};
}

// More in a row would be just a still picture, and a false frame number could fill the disk with them.
constexpr std::size_t most_concealed_in_a_row = 300;

// Writes a stand-in for a frame. False if there is none.
Result<bool> conceal(Decoding& d, std::uint32_t number, std::int64_t timestamp_us) {
    if (d.options.conceal != Conceal::animate || d.summary.concealed_in_a_row >= most_concealed_in_a_row) return false;
    auto frame = d.decoder.conceal_copy(number, timestamp_us);
    if (!frame) return false;
    if (auto ok = write(d, std::move(*frame)); !ok) return tl::unexpected(ok.error());
    ++d.summary.concealed;
    ++d.summary.concealed_in_a_row;
    return true;
}

std::string frames_text(std::uint32_t first, std::uint32_t count) {
    return count == 1 ? fmt::format("frame {}", first) : fmt::format("frames {} to {}", first, first + (count - 1));
}

// What stands in for those of `count` frames that are concealed.
std::string stand_in_text(std::uint32_t concealed, std::uint32_t count) {
    if (concealed == 0) return {};
    const std::string whom = concealed < count ? fmt::format("{} of them", concealed) : count == 1 ? "it" : "them";
    return "; the I-frame's mesh, moved, stands in for " + whom;
}

// What was lost up to now, once it is known how much.
void tell_lost(Decoding& d) {
    const auto lost = std::exchange(d.lost, {});
    const auto begins_with = std::exchange(d.begins_with, 0);
    const auto frames = frames_text(lost.first, lost.count);
    if (begins_with > 0 && lost.count > 0)
        warn(fmt::format("the stream begins in the middle, with frame {}: {} cannot be shown without those before",
                         begins_with, frames));
    else if (begins_with > 0)
        note(fmt::format("the stream begins with frame {}", begins_with));
    else if (lost.count > 0)
        warn(fmt::format("{} {} lost: {}{}", frames, lost.count == 1 ? "is" : "are", lost.why,
                         stand_in_text(lost.concealed, lost.count)));
}

// Frames that were lost in transmission leave no damage behind, only a gap in the numbers.
// number, timestamp_us: of what comes next, a frame or the end.
Result<void> fill_gap(Decoding& d, std::uint32_t number, std::int64_t timestamp_us, bool is_frame) {
    auto& summary = d.summary;
    const std::uint32_t first = summary.due;
    if (number <= first || (d.input.is_live() && !d.caught_up)) return {};
    const std::uint32_t gap = number - first;
    const auto before = static_cast<std::uint64_t>(summary.timestamp_us.value_or(timestamp_us));
    const bool ascends = summary.timestamp_us && *summary.timestamp_us < timestamp_us;
    const std::uint64_t interval =
        ascends ? (static_cast<std::uint64_t>(timestamp_us) - before) / (std::uint64_t{gap} + 1) : 0;
    std::uint32_t shown = 0;
    while (shown < gap && !is_enough(d)) {
        const auto done = conceal(d, first + shown, static_cast<std::int64_t>(before + interval * (shown + 1)));
        if (!done) return tl::unexpected(done.error());
        if (!*done) break;
        ++shown;
    }
    if (!summary.timestamp_us) {
        if (is_frame) d.begins_with = first + gap;
        return {};
    }
    summary.missing += gap;
    tell_lost(d);
    std::string instead = stand_in_text(shown, gap);
    if (shown > 0 && shown < gap)
        instead = fmt::format("; the I-frame's mesh, moved, stands in for the first {}", shown);
    warn(frames_text(first, gap) + (gap == 1 ? " is" : " are") + " not in the stream" + instead);
    return {};
}

// Handles a packet that is undamaged but cannot be decoded.
Result<void> take_failure(Decoding& d, const Packet& packet, const Error& error) {
    const bool is_refused = error.kind == ErrorKind::unsupported || error.kind == ErrorKind::limit;
    if (!frame_type(packet.kind)) {
        if (is_refused) return tl::unexpected(error);
        warn(fmt::format("a packet that came with frame {} is lost: {}", packet.frame, error.message));
        ++d.summary.damaged_packets;
        return {};
    }
    const auto number = d.numbers.of(packet.frame);
    const auto done = conceal(d, number, packet.timestamp_us);
    if (!done) return tl::unexpected(done.error());
    if (d.lost.count++ == 0) {
        d.lost.first = number;
        d.lost.why = error.message;
    }
    d.lost.concealed += *done ? 1 : 0;
    ++d.summary.undecodable;
    if (is_refused && !d.summary.refused) d.summary.refused = error;
    return {};
}

// What a hub has for who joins comes at once; from the first packet on that is waited for, frames come as they are
// made.
std::optional<Packet> next_packet(Decoding& d) {
    constexpr std::chrono::milliseconds at_once{8};
    const auto begin = std::chrono::steady_clock::now();
    auto packet = d.input.next();
    if (d.summary.timestamp_us && std::chrono::steady_clock::now() - begin > at_once) d.caught_up = true;
    return packet;
}

// Decodes the next packet; true while there is more.
Result<bool> decode_next(Decoding& d) {
    if (is_enough(d) && !d.held) return false;
    const auto packet = next_packet(d);
    const bool picture = packet && packet->kind == PacketKind::texture;
    if (picture) d.textures.take(*packet);
    d.summary.any_picture = d.summary.any_picture || picture;
    if (d.held && (!packet || picture || packet->kind == PacketKind::sequence || frame_type(packet->kind))) {
        if (auto ok = write_held(d); !ok) return tl::unexpected(ok.error());
        if (is_enough(d) || d.output.one_file()) return false;
    }
    if (!packet) {
        const auto promised = static_cast<std::uint32_t>(std::min<std::uint64_t>(d.promised, 0xFFFFFFFF));
        // Where a stream ends before its first frame, all that its index tells of is missing.
        if (d.next_number == 0) d.summary.missing = promised;
        if (auto ok = fill_gap(d, promised, d.summary.timestamp_us.value_or(0), false); !ok)
            return tl::unexpected(ok.error());
        return false;
    }
    if (d.sound)
        if (auto ok = d.sound->take(*packet); !ok) return tl::unexpected(ok.error());
    const bool is_frame = frame_type(packet->kind).has_value();
    const auto sequences = d.numbers.dependencies().sequences();
    d.numbers.push(*packet);
    if (d.numbers.dependencies().sequences() != sequences) d.textures.begin_sequence();
    if (d.numbers.begins_sequence()) d.summary.timestamp_us.reset();  // frames before its first one never existed
    if (is_frame || packet->kind == PacketKind::index) {              // the index gives the number of frames
        // Before decoding the packet, because it may be an I-frame, which the lost frames did not refer to.
        if (auto ok = fill_gap(d, d.numbers.of(packet->frame), packet->timestamp_us, is_frame); !ok)
            return tl::unexpected(ok.error());
        if (is_enough(d)) return false;
    }
    if (packet->kind == PacketKind::front_index)
        if (const auto index = read_index(*packet)) d.promised = d.next_number + index->frames;
    // A frame before the first one asked for: decoded because that one, or one after it, needs it.
    const bool is_earlier = is_frame && d.numbers.of(packet->frame) < d.options.first;
    if (is_frame) {
        d.next_number = d.numbers.of(packet->frame) + 1;
        d.summary.due = std::max(d.summary.due, d.next_number);
    }
    const auto start = std::chrono::steady_clock::now();
    auto frame = d.decoder.decode_copy(*packet);
    if (is_frame) d.summary.timestamp_us = packet->timestamp_us;
    if (is_earlier) return true;
    if (!frame) {
        if (auto ok = take_failure(d, *packet, frame.error()); !ok) return tl::unexpected(ok.error());
        return true;
    }
    if (!*frame) return true;
    d.summary.decode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    d.summary.concealed_in_a_row = 0;
    tell_lost(d);
    auto& info = (**frame).info;
    info.frame = d.numbers.of(info.frame);
    info.reference = d.numbers.of(info.reference);
    if (auto ok = write(d, std::move(**frame)); !ok) return tl::unexpected(ok.error());
    ++d.summary.decoded;
    return d.held || !d.output.one_file();
}

void print_json(const Summary& summary, const StreamInput& input) {
    fmt::print("{}\n", nlohmann::json{{"frames", summary.list},
                                      {"lost_frames", summary.undecodable},
                                      {"missing_frames", summary.missing},
                                      {"concealed_frames", summary.concealed},
                                      {"damaged_bytes", input.damaged_bytes()},
                                      {"decode_frames_per_second", summary.frames_per_second()}}
                           .dump(2));
}

void tell_what_was_written(const Options& options, const MeshOutput& output, const Summary& summary) {
    std::string frames = output.one_file() ? "the first frame alone" : counted(summary.written(), "frame");
    if (summary.concealed > 0) frames += fmt::format(" ({} concealed)", summary.concealed);
    note(fmt::format("{} to {}, decoded at {:.1f} frames/s", frames,
                     options.output == "-" ? "standard output" : options.output, summary.frames_per_second()));
    if (options.images && !summary.any_picture) note("there are no pictures of a texture, so --images does nothing");
    if (summary.written() > 0) output.warn_of_other_frames();
}

// An error if the stream is incomplete.
Result<void> judge(const Options& options, const MeshOutput& output, const StreamInput& input, const Summary& summary,
                   std::size_t lost_pictures) {
    const auto lost = summary.undecodable + summary.missing;
    if (summary.refused && input.oversized_packets() == 0)
        return fail(summary.refused->kind, fmt::format("{}: {} frames could not be decoded; the first: {}",
                                                       options.input, summary.undecodable, summary.refused->message));
    const bool all = (options.frames == 0 || summary.written() < options.frames) && !output.one_file();
    if (all || input.oversized_packets() > 0 || input.damaged_bytes() > 0)
        if (auto whole =
                check_whole(input, options.input,
                            fmt::format("{} decoded, {} {} lost",
                                        counted(summary.decoded, "frame") + (summary.decoded == 1 ? " was" : " were"),
                                        counted(lost, "other"), lost == 1 ? "is" : "are"));
            !whole)
            return whole;
    if (lost == 0 && summary.damaged_packets == 0 && lost_pictures > 0)
        return fail(ErrorKind::corrupt_stream,
                    fmt::format("{}: {} of the texture could not be decoded; no frame was lost", options.input,
                                counted(lost_pictures, "picture")));
    if (lost == 0 && summary.damaged_packets == 0) return {};
    if (lost == 0)
        return fail(ErrorKind::corrupt_stream,
                    fmt::format("{} has packets that could not be read, but no frame was lost", options.input));
    return fail(ErrorKind::corrupt_stream,
                fmt::format("{} is incomplete: {} frames could not be decoded, {} are missing", options.input,
                            summary.undecodable, summary.missing));
}

// Skips what the frames asked for do not need, if the stream is an undamaged file; otherwise all of it is read.
void begin_at_first(Decoding& d) {
    const auto start = go_to_frame(d.input, d.options.input, d.options.first, d.options.limits.max_packet_bytes);
    if (!start) return;
    d.numbers.begin(start->first_needed_frame, start->first_needed_number);
    d.promised = start->promised;
}

tl::unexpected<Error> not_a_stream(const Options& options) {
    if (interruption() != 0) return fail(ErrorKind::bad_input, options.input + ": interrupted before a stream began");
    return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream: no sequence header was found");
}

// The sound alone: no frame is decoded.
Result<void> extract_sound(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes, options.trust);
    if (!input) return tl::unexpected(input.error());
    SoundOutput sound(options.audio, {options.first, options.frames});
    Decoder headers(options.limits);  // only checks the sequence headers
    while (auto packet = input->next()) {
        if (packet->kind == PacketKind::sequence)
            if (auto ok = headers.decode(*packet); !ok) return tl::unexpected(ok.error());
        if (auto ok = sound.take(*packet); !ok) return fail(ok.error().kind, options.input + ": " + ok.error().message);
        if (sound.is_enough()) break;
    }
    if (input->refusal()) return tl::unexpected(*input->refusal());
    if (!headers.sequence() && input->oversized_packets() == 0) return not_a_stream(options);
    if (auto ok = sound.finish(options.input); !ok) return ok;
    return sound.is_enough() ? Result<void>() : check_whole(*input, options.input);
}

Result<void> decode(const Options& options) {
    // A file is read once more for its sound, since the frames asked for may need only some of it.
    std::error_code no_file;
    const bool apart = options.output.empty() || std::filesystem::is_regular_file(options.input, no_file);
    if (!options.audio.empty() && apart) {
        auto extracted = extract_sound(options);
        if (!extracted || options.output.empty()) return extracted;
    }
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes, options.trust);
    if (!input) return tl::unexpected(input.error());
    auto output = MeshOutput::open(options);
    if (!output) return tl::unexpected(output.error());
    DecoderOptions settings = options.limits;
    settings.threads = options.threads;
    settings.intra_coder = draco_intra_coder();
    Decoder decoder(settings);
    Summary summary;
    summary.due = static_cast<std::uint32_t>(options.first);
    SoundOutput sound(options.audio, {options.first, options.frames});
    const bool sound_beside = !options.audio.empty() && !apart;
    std::size_t lost_pictures = 0;
    {
        Progress progress("decoding", options.frames);
        Decoding decoding{options, *input, *output, decoder, summary, progress};
        if (sound_beside) decoding.sound = &sound;
        if (options.first > 0) begin_at_first(decoding);
        for (;;) {
            const auto more = decode_next(decoding);
            if (!more) return tl::unexpected(more.error());
            if (!*more) break;
        }
        if (auto ok = write_held(decoding); !ok) return ok;
        tell_lost(decoding);
        lost_pictures = decoding.textures.lost();
    }
    if (auto ok = output->finish(); !ok) return ok;
    if (!options.timestamps.empty())
        if (auto ok = write_file(options.timestamps, frame_times_csv(summary.times)); !ok) return ok;
    if (options.json) print_json(summary, *input);
    if (input->refusal()) return tl::unexpected(*input->refusal());
    if (!decoder.sequence() && input->oversized_packets() == 0)
        return input->lost_segments() > 0 ? check_whole(*input, options.input, "nothing was decoded")
                                          : not_a_stream(options);
    if (summary.written() == 0 && options.first > 0 && summary.undecodable + summary.missing == 0)
        return fail(ErrorKind::bad_input, fmt::format("{} has no frame {}", options.input, options.first));
    tell_what_was_written(options, *output, summary);
    if (sound_beside)
        if (auto ok = sound.finish(options.input); !ok) return ok;
    return judge(options, *output, *input, summary, lost_pictures);
}

// ---- Options --------------------------------------------------------------------------------------------------------

void add_places(CLI::App& command, Options& options) {
    command
        .add_option("input", options.input,
                    "The stream: a file (.htvm, .mp4 or .m3u8), - for standard input, a playlist,\n"
                    "http://HOST/hls/NAME/stream.m3u8, or a live stream, ws://HOST:PORT/watch/NAME, until it or Ctrl-C "
                    "ends it")
        ->type_name("FILE")
        ->required();
    command
        .add_option("-o,--output", options.output,
                    "Where the meshes go: a folder, a pattern such as out/frame_%05d.obj, the name of one .glb (all\n"
                    "frames, as an animation), of one .ply or .obj (the first frame only), or - for concatenated PLY\n"
                    "on standard output")
        ->type_name("FILE")
        ->group(heading::output);
    command
        .add_option("--audio", options.audio,
                    "Where the sound goes: an .opus or .ogg file, with the packets as they are in the stream, or a\n"
                    ".wav. It begins with the first frame asked for. Without -o, only the sound is written")
        ->type_name("FILE")
        ->group(heading::output);
    command
        .add_option("--timestamps", options.timestamps,
                    "Write when each frame was captured to this file too, CSV, as 'htvm encode --timestamps' reads it\n"
                    "(PLY files say it in a comment anyway)")
        ->type_name("FILE")
        ->group(heading::output);
}

void add_formats(CLI::App& command, Options& options) {
    command.add_option("--format", options.format, "Format in a folder: ply (default), obj or glb")
        ->check(one_of({"ply", "obj", "glb"}))
        ->group(heading::output);
    add_choice(command, "--images", options.images, image_formats,
               "Format of the pictures of a texture, which go beside the meshes, or into a .glb: png (default) or\n"
               "jpeg. Image files that were kept (encode --texture-as keep) stay as they are")
        ->group(heading::output);
    add_unit(command, options.unit, "capture",
             "Unit of the positions: the capture's (default; metres for .glb), mm, cm, dm, m, in or ft")
        ->group(heading::output);
    add_choice(command, "--conceal", options.conceal, conceal_uses,
               "What to write for a lost frame: gap (default), nothing, and the numbers continue; or animate,\n"
               "the I-frame's mesh moved as in the last known frame, for up to 300 in a row")
        ->group(heading::output);
}

void add_frames(CLI::App& command, Options& options) {
    command.add_option("--first", options.first, "First frame to decode, counted from 0 (default: 0)")
        ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{0xFFFFFFFF}))
        ->group(heading::input);
    command.add_option("--frames", options.frames, "Decode at most this many frames; 0: all (default: all)")
        ->group(heading::input);
}

std::string contradiction_in(const Options& options) {
    if (options.output == "-" && options.json)
        return "--json: prints on standard output, where -o - puts the meshes; choose one";
    if (options.output.empty() && options.audio.empty()) return "-o: is required, or --audio for the sound alone";
    if (!options.audio.empty() && !is_written_sound_name(options.audio))
        return fmt::format("--audio: '{}' does not end in one of {}", options.audio, written_sound_extensions);
    return {};
}

}  // namespace

void add_decode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("decode", "Turn an .htvm stream back into meshes, their textures, and sound");
    add_places(*command, *options);
    add_formats(*command, *options);
    add_frames(*command, *options);
    command
        ->add_option("--threads", options->threads, "Threads (default: one per core); the meshes do not depend on it")
        ->group(heading::parallel);
    command
        ->add_flag(
            "--all-vertices", options->all_vertices,
            "Also write the vertices that are not there in a frame and that no triangle names, so that vertices keep "
            "their places while frames have one reference")
        ->group(heading::output);
    command->add_flag("--json", options->json, "Print what was decoded as JSON on standard output")
        ->group(heading::scripts);
    add_hub_trust(*command, options->trust);
    add_decoder_limits(*command, options->limits);
    command->footer(
        "If a stream is damaged or truncated, every undamaged frame is decoded, losses are reported, and the\n"
        "exit code is 3; likewise if frames are missing. A lost P- or EP-frame costs no other frame; a lost T-frame,\n"
        "unless encoded with --tracked-from intra, those up to the next place to start (encode --access-interval); a\n"
        "lost I- or TP-frame those up to the next I-frame; a damaged sequence header all frames until it is repeated,\n"
        "with an I-frame at least ten frames later.\n"
        "Examples:\n"
        "  htvm decode person.htvm -o meshes/\n"
        "  htvm decode person.htvm -o 'out/%04d.obj'       with .mtl and .png files where it has a texture\n"
        "  htvm decode person.htvm -o person.glb\n"
        "  htvm decode person.htvm --audio voice.wav\n"
        "  htvm decode - -o - < person.htvm | viewer --ply\n"
        "  htvm decode ws://localhost:8080/watch/person -o - | viewer --ply");
    add_front_page(*command,
                   {{{"--output",
                      "Where the meshes go: a folder, a pattern such as out/%05d.obj, one .glb of all frames,\n"
                      "or - for PLY after PLY on standard output"},
                     {"--format"},
                     {"--audio", "Where the sound goes: an .opus, .ogg or .wav file"},
                     {"--first", "The first frame, counted from 0"},
                     {"--frames", "At most so many frames (default: all)"},
                     {"--unit", "Unit of the positions (default: the capture's; metres for .glb)"},
                     {"--conceal", "What to write for a lost frame: nothing (gap, default), or the last mesh, moved"},
                     {"--max-memory"},
                     {"--threads"},
                     {"--json"}},
                    "Losses in a damaged stream are told, and the exit code is then 3.\n"
                    "Examples:\n"
                    "  htvm decode person.htvm -o meshes/\n"
                    "  htvm decode person.htvm -o person.glb\n"
                    "  htvm decode ws://localhost:8080/watch/person -o - | viewer --ply"});
    command->callback([options, &run] {
        if (const auto why = contradiction_in(*options); !why.empty()) throw CLI::ValidationError(why);
        run = [options] { return decode(*options); };
    });
}

}  // namespace htvm::app
