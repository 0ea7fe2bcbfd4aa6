// htvm verify: whether a stream is sound: checksums, order, what frames need, the index, and whether they decode.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/audio.hpp"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/picture_decoder.hpp"
#include "io/mesh_file.h"
#include "stream_file.h"
#include "texture_output.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input;
    unsigned threads = 0;
    bool json = false;
    DecoderOptions limits;
};

struct Problem {
    std::optional<std::uint32_t> frame;  // number in the stream
    std::string what;
    std::optional<std::uint32_t> last_frame = frame;  // where it is one of several frames
};

struct Verification {
    Decoder decoder;
    FrameNumbers numbers = {};
    StreamIndexer indexer = {};
    std::optional<StreamIndex> index = {};  // the one in front
    std::uint64_t offset = 0;               // behind the index in front
    std::vector<Problem> problems = {};
    std::optional<ErrorKind> refused = {};  // by a limit, or this version
    std::uint64_t frames = 0;
    // The last frame of the sequence in force: its number and its time.
    std::optional<std::uint32_t> last_number = {};
    std::int64_t last_us = 0;
    std::set<std::uint32_t> droppable = {};         // own numbers of frames since the I-frame
    std::map<std::uint32_t, std::string> why = {};  // by own number: why a frame that cannot be decoded cannot
    std::optional<std::size_t> lost = {};           // the newest problem that is of frames whose reference is missing
    std::optional<double> audio_end = {};           // microseconds
    std::uint64_t audio_packets = 0;
    std::uint64_t pictures = 0, undecoded = 0;  // undecoded: of these, as H.264 is not decoded here
    PictureDecoder shown = picture_decoder();
    std::optional<std::uint32_t> last_picture = {};  // own number of its frame
    std::optional<std::string> lost_picture = {};    // why those up to the next key picture cannot be decoded
    std::optional<std::uint32_t> bare = {};          // number of the first frame that should have a picture to show
};

// Frames that have texture coordinates and nothing to show there, though the stream says that it has pictures, up to
// the one before number.
void report_bare_frames(Verification& v, std::uint32_t number) {
    if (!v.bare) return;
    const auto first = *std::exchange(v.bare, std::nullopt);
    v.problems.push_back(
        {first, "the stream promises pictures, but there is none for its texture coordinates", number - 1});
}

void check_order(Verification& v, const Packet& packet, std::uint32_t number) {
    const auto problem = [&](const std::string& what) { v.problems.push_back({number, what}); };
    if (v.numbers.begins_sequence()) {
        report_bare_frames(v, number);
        v.last_number.reset();
        v.droppable.clear();
        v.why.clear();
        v.audio_end.reset();
        v.shown.reset();
        v.last_picture.reset();
        v.lost_picture.reset();
    }
    if (v.last_number && number <= *v.last_number) problem(fmt::format("comes after frame {}", *v.last_number));
    if (v.last_number && number > *v.last_number + 1)
        problem(fmt::format("comes after frame {}: frames are missing between them", *v.last_number));
    if (v.last_number && packet.timestamp_us <= v.last_us)
        problem("its timestamp is not above that of the previous frame");
    v.last_number = number;
    v.last_us = packet.timestamp_us;
}

void check_dependencies(Verification& v, const Packet& packet, std::uint32_t number) {
    const auto problem = [&](const std::string& what) { v.problems.push_back({number, what}); };
    if (packet.reference != packet.frame && v.droppable.contains(packet.reference))
        problem(fmt::format("it refers to frame {}, which is marked as droppable", v.numbers.of(packet.reference)));
    if (!packet.has(packet_flag::flags_valid)) return;
    if (packet.has(packet_flag::droppable) && packet.has(packet_flag::referred))
        problem("it is marked as droppable, and as one that others may refer to");
    if (packet.has(packet_flag::droppable)) v.droppable.insert(packet.frame);
}

// Says once of frames behind each other that they have the same cause.
void add_lost_frame(Verification& v, const Packet& packet, std::uint32_t number, const std::string& why) {
    v.why[packet.frame] = why;
    const auto what = "cannot be decoded, since " + why;
    if (v.lost && v.problems[*v.lost].what == what && *v.problems[*v.lost].last_frame + 1 == number) {
        v.problems[*v.lost].last_frame = number;
        return;
    }
    v.lost = v.problems.size();
    v.problems.push_back({number, what});
}

// Sound comes behind the frame in whose time it begins, and piece after piece.
void check_audio(Verification& v, const Packet& packet, std::uint32_t number) {
    const auto problem = [&](const std::string& what) { v.problems.push_back({number, what}); };
    const auto audio = read_audio(packet);
    if (!audio && audio.error().kind == ErrorKind::unsupported) return;
    if (!audio) return problem(audio.error().message);
    ++v.audio_packets;
    constexpr double longest = 120000;  // a packet of Opus, by which two pieces may overlap where streams are joined
    const auto begin = static_cast<double>(packet.timestamp_us);
    if (v.audio_end && begin < *v.audio_end - longest) problem("its sound begins before the sound before it ends");
    if (!v.last_number || *v.last_number != number) problem("there is sound of it, but not directly behind it");
    v.audio_end = begin + 1e6 * static_cast<double>(audio->samples()) / audio_samples_per_second;
}

// Pictures come behind their frame, one at most, and each decodes from those before it.
void check_picture(Verification& v, const Packet& packet, std::uint32_t number) {
    const auto problem = [&](const std::string& what) { v.problems.push_back({number, what}); };
    ++v.pictures;
    if (v.bare == number) v.bare.reset();
    report_bare_frames(v, number);
    if (!v.last_number || *v.last_number != number) problem("there is a picture of it, but not directly behind it");
    if (v.last_picture && packet.frame <= *v.last_picture) problem("it has a second picture");
    const auto before = std::exchange(v.last_picture, packet.frame);
    if (const auto read = read_texture_picture(packet); read && read->coder == PictureCoder::h264) {
        ++v.undecoded;
        if (!is_key_picture(packet) && before != packet.reference)
            problem(fmt::format("the picture that it needs, of frame {}, is not there", packet.reference));
        return;
    }
    const bool goes_on = v.lost_picture && !is_key_picture(packet);
    const auto decoded = v.shown.decode(packet);
    if (decoded) v.lost_picture.reset();
    if (decoded || goes_on) return;  // said once of those behind each other
    v.lost_picture = decoded.error().message;
    const auto kind = decoded.error().kind;
    if (kind == ErrorKind::limit || kind == ErrorKind::unsupported) v.refused = kind;
    problem(decoded.error().message +
            (is_key_picture(packet) ? "" : ", nor do those up to the next key picture decode"));
}

void check_decoding(Verification& v, const Packet& packet, std::uint32_t number) {
    const auto decoded = v.decoder.decode(packet);
    const bool is_frame = frame_type(packet.kind).has_value();
    const auto reference = is_frame && packet.reference != packet.frame ? v.why.find(packet.reference) : v.why.end();
    if (reference != v.why.end()) return add_lost_frame(v, packet, number, std::string(reference->second));
    if (is_frame && packet.reference != packet.frame && v.numbers.dependencies().closure().empty())
        return add_lost_frame(v, packet, number, fmt::format("frame {} is not there", v.numbers.of(packet.reference)));
    if (decoded && *decoded && is_frame && !v.last_picture && !v.bare && !(*decoded)->mesh.texcoords.empty() &&
        v.decoder.sequence()->texture.layout != TextureLayout::none)
        v.bare = number;
    if (decoded) return;
    if (is_frame) v.why[packet.frame] = fmt::format("frame {} cannot be decoded", number);
    const auto kind = decoded.error().kind;
    if (kind == ErrorKind::limit || kind == ErrorKind::unsupported) v.refused = kind;
    v.problems.push_back({is_frame ? std::optional(number) : std::nullopt, decoded.error().message});
}

void take(Verification& v, const Packet& packet) {
    if (packet.kind == PacketKind::front_index && v.offset == 0 && !v.index) {
        auto index = read_index(packet);
        if (index)
            v.index = std::move(*index);
        else
            v.problems.push_back({{}, index.error().message});
        return;
    }
    v.numbers.push(packet);
    v.indexer.add(packet, v.offset);
    v.offset += packet.payload.size() + packet_overhead;
    const auto number = v.numbers.of(packet.frame);
    if (frame_type(packet.kind)) {
        ++v.frames;
        check_order(v, packet, number);
        check_dependencies(v, packet, number);
    }
    if (packet.kind == PacketKind::audio) check_audio(v, packet, number);
    if (packet.kind == PacketKind::texture) check_picture(v, packet, number);
    check_decoding(v, packet, number);
}

// Where a stream ends that has fewer frames than its index says, or whose end is torn.
void report_end(Verification& v, const StreamInput& input) {
    if (input.missing_bytes() > 0)
        v.problems.push_back(
            {{},
             fmt::format("the file is cut short: its end, {}, is missing", counted(input.missing_bytes(), "byte"))});
    if (input.cut_short_bytes() > 0)
        v.problems.push_back({{},
                              fmt::format("the stream ends in the middle of a packet, {} behind the last whole one",
                                          counted(input.cut_short_bytes(), "byte"))});
    if (v.frames == 0) return;
    const auto promised = v.index ? v.index->frames : 0;
    v.problems.push_back(
        {{},
         fmt::format(
             "{} {} whole, up to frame {} at {:.2f} s",
             promised > v.frames ? fmt::format("{} of {} frames", v.frames, promised) : counted(v.frames, "frame"),
             v.frames == 1 ? "is" : "are", *v.last_number, static_cast<double>(v.last_us) / 1e6)});
}

// An index that covers the whole file must be what its packets give. Where the end is missing, that is what is said.
void check_index(Verification& v, const StreamInput& input) {
    if (is_whole_but_for_end(input)) return report_end(v, input);
    if (input.cut_short_bytes() > 0) v.problems.push_back({{}, "the stream ends in the middle of a packet"});
    if (input.damaged_bytes() > 0 || !v.index || v.index->bytes < v.offset) return;
    auto found = v.indexer.finish(v.offset);
    found.bounds = v.index->bounds;
    found.duration_us = v.index->duration_us;  // informative: how long the last frame lasts is the writer's choice
    if (*v.index == found) return;
    const bool ends_early = v.problems.empty() && v.index->frames > found.frames && v.last_number == v.frames - 1;
    if (v.index->frames != found.frames)
        v.problems.push_back(
            {{}, fmt::format("the index says {} frames, there are {}", v.index->frames, found.frames)});
    else
        v.problems.push_back({{}, "the index does not fit the packets; 'htvm index' writes another"});
    if (ends_early) report_end(v, input);
}

// What to do with a stream that is not sound.
std::string advice_on(const Verification& v, const StreamInput& input, const std::string& path) {
    const bool is_undamaged = input.damaged_bytes() + input.cut_short_bytes() == 0;
    const bool lacks_frames = is_undamaged && v.index && v.index->frames > v.frames && v.last_number == v.frames - 1;
    if (v.frames > 0 && (is_whole_but_for_end(input) || lacks_frames))
        return fmt::format("; 'htvm join {} -o whole.htvm' copies what is whole", path);
    return ": " + counted(v.problems.size(), "problem");
}

Result<void> run_verify(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    auto settings = options.limits;
    settings.threads = options.threads;
    settings.intra_coder = draco_intra_coder();
    Verification v{Decoder(settings)};
    {
        Progress progress("verify", 0);
        while (const auto packet = input->next()) {
            take(v, *packet);
            if (frame_type(packet->kind)) progress.step();
        }
    }
    if (v.last_number) report_bare_frames(v, *v.last_number + 1);
    if (const auto damaged = input->damaged_bytes() - input->cut_off_bytes(); damaged > 0)
        v.problems.insert(  // the cause of others
            v.problems.begin(), Problem{{}, counted(damaged, "byte") + " are not part of an undamaged packet"});
    if (const auto lost = input->lost_segments(); lost > 0)
        v.problems.insert(
            v.problems.begin(),
            Problem{{},
                    input->first_loss() +
                        (lost > 1 ? fmt::format("; {} in all are gone or cut short", counted(lost, "segment")) : "")});
    if (v.frames == 0) v.problems.push_back({{}, "there is no frame"});
    check_index(v, *input);
    const bool is_stream = v.decoder.sequence() || v.frames > 0 || v.refused || v.index;
    if (!is_stream && !input->refusal() && input->oversized_packets() == 0 && input->lost_segments() == 0)
        v.problems = {{{}, "it is no htvm stream: no sequence header was found"}};
    const bool sound = v.problems.empty();
    if (options.json) {
        nlohmann::json problems = nlohmann::json::array();
        for (const auto& [frame, what, last_frame] : v.problems)
            problems.push_back({{"frame", frame ? nlohmann::json(*frame) : nlohmann::json()},
                                {"last_frame", last_frame ? nlohmann::json(*last_frame) : nlohmann::json()},
                                {"problem", what}});
        fmt::print("{}\n", nlohmann::json{{"sound", sound},
                                          {"frames", v.frames},
                                          {"sequences", v.numbers.dependencies().sequences()},
                                          {"index", v.index.has_value()},
                                          {"audio_packets", v.audio_packets},
                                          {"pictures", v.pictures},
                                          {"damaged_bytes", input->damaged_bytes()},
                                          {"missing_bytes", input->missing_bytes()},
                                          {"cut_short_bytes", input->cut_short_bytes()},
                                          {"problems", problems}}
                               .dump(2));
    } else {
        constexpr std::size_t most = 50;
        for (std::size_t i = 0; i < std::min(v.problems.size(), most); ++i) {
            const auto& [frame, what, last_frame] = v.problems[i];
            const auto who = !frame                  ? std::string()
                             : *frame == *last_frame ? fmt::format("frame {}: ", *frame)
                                                     : fmt::format("frames {} to {}: ", *frame, *last_frame);
            fmt::print("{}{}\n", who, what);
        }
        if (v.problems.size() > most) fmt::print("and {} more\n", v.problems.size() - most);
        if (sound)
            fmt::print("{}: {} in {}, all sound{}{}{}{}\n", options.input, counted(v.frames, "frame"),
                       counted(v.numbers.dependencies().sequences(), "sequence"), v.index ? ", with an index" : "",
                       v.audio_packets > 0 ? ", with audio" : "",
                       v.pictures > 0 ? ", with " + counted(v.pictures, "picture") : "",
                       v.undecoded > 0 ? ", which are H.264 and were not decoded" : "");
    }
    if (sound) return {};
    return fail(v.refused.value_or(ErrorKind::corrupt_stream),
                fmt::format("{} is not sound{}", options.input, advice_on(v, *input, options.input)));
}

}  // namespace

void add_verify(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command =
        app.add_subcommand("verify", "Check an .htvm stream: checksums, order, references, index, decoding");
    command->add_option("input", options->input, "The stream: a file, or - for standard input")
        ->type_name("FILE")
        ->required();
    command->add_option("--threads", options->threads, "Threads (default: one per core)");
    command->add_flag("--json", options->json, "Print the result as JSON on standard output");
    add_decoder_limits(*command, options->limits);
    command->footer("Exits with 0 if all is sound, otherwise with 3 (4 and 5: unsupported, or beyond a limit).");
    command->callback([options, &run] { run = [options] { return run_verify(*options); }; });
}

}  // namespace htvm::app
