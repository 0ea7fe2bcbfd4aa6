// htvm cut: a part of a stream as a stream of its own, without encoding anything again.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <deque>
#include <memory>
#include <optional>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/running_time.hpp"
#include "htvm/texture.hpp"
#include "stream_file.h"
#include "stream_seek.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input, output;
    std::uint64_t first = 0, frames = 0;  // frames 0: all
    double from = 0, to = -1;             // seconds; to < 0: up to the end
    DecoderOptions limits;
};

// Numbers the frames of the first sequence from 0; those of later sequences keep their numbers.
struct Renumbering {
    std::uint32_t sequence = 0, first = 0;
    void apply(Packet& packet, std::uint32_t sequence_of_packet) const {
        if (sequence_of_packet != sequence) return;
        packet.frame -= std::min(packet.frame, first);
        if (packet.kind != PacketKind::sequence) packet.reference -= std::min(packet.reference, first);
    }
};

struct Cut {
    const Options& options;
    StreamOutput& output;
    Decoder headers;  // for the sequence headers alone
    FrameNumbers numbers = {};
    RunningTime time = {};
    std::optional<Packet> header = {};  // in force
    std::deque<Packet> waiting = {};    // since the last frame at which decoding can start
    std::uint32_t start_number = 0;     // the number of that frame in the input
    // Where meshes can start, pictures may not: a later such frame is where the part begins only if a key picture
    // comes behind it, or none was in `waiting` anyway.
    bool has_key = false;  // `waiting` has a key picture
    struct LaterStart {
        std::size_t place = 0;  // in `waiting`
        std::uint32_t frame = 0, number = 0;
    };
    std::optional<LaterStart> later = {};
    bool asked = false;  // the first frame asked for is in `waiting`; what comes behind it may decide where it begins
    bool started = false;
    bool pictures = false;  // the next picture can be decoded, as the part has those before
    Renumbering renumbering = {};
    std::uint64_t frames = 0;  // written
    std::uint32_t first_asked = 0, last_number = 0;
};

double seconds(const Cut& cut) { return static_cast<double>(cut.time.microseconds()) / 1e6; }

bool is_before(const Cut& cut, std::uint32_t number) {
    return number < cut.options.first || seconds(cut) < cut.options.from;
}

bool is_behind(const Cut& cut, std::uint32_t number) {
    const auto& options = cut.options;
    return (options.frames > 0 && number >= options.first + options.frames) ||
           (options.to >= 0 && seconds(cut) >= options.to);
}

Result<void> write(Cut& cut, Packet packet) {
    if (packet.kind == PacketKind::texture) {
        cut.pictures = cut.pictures || is_key_picture(packet);
        if (!cut.pictures) return {};
    }
    cut.renumbering.apply(packet, cut.numbers.dependencies().sequences());
    return cut.output.write(packet);
}

// Whether every frame asked for has been read.
bool has_all(const Cut& cut) {
    const auto& options = cut.options;
    return cut.started && options.frames > 0 && cut.last_number + 1 == options.first + options.frames;
}

// Whether no later frame needs anything before this one but the sequence header; what pictures need is another matter.
bool can_start_here(const Cut& cut) {
    const auto& dependencies = cut.numbers.dependencies();
    const auto needed = dependencies.closure(), of_picture = dependencies.picture_closure();
    auto kept = dependencies.kept();
    std::erase_if(kept, [&](std::uint64_t place) {
        const bool is_header = !needed.empty() && place == needed.front();
        return !is_header && std::find(of_picture.begin(), of_picture.end(), place) != of_picture.end();
    });
    constexpr std::size_t header_and_frame = 2;
    return needed.size() == header_and_frame && (kept.size() < header_and_frame || kept == needed);
}

Result<void> start(Cut& cut) {
    cut.started = true;
    cut.renumbering = {cut.numbers.dependencies().sequences(), cut.waiting.front().frame};
    auto header = *cut.header;
    header.frame = cut.waiting.front().frame;
    header.timestamp_us = cut.waiting.front().timestamp_us;
    if (auto ok = write(cut, header); !ok) return ok;
    for (auto& packet : cut.waiting) {
        if (frame_type(packet.kind)) ++cut.frames;
        if (auto ok = write(cut, std::move(packet)); !ok) return ok;
    }
    cut.waiting.clear();
    return {};
}

// What comes behind a frame before the part has begun.
void wait_with(Cut& cut, Packet packet) {
    if (is_key_picture(packet)) {
        if (cut.later && packet.frame == cut.later->frame) {
            cut.waiting.erase(cut.waiting.begin(), cut.waiting.begin() + static_cast<std::ptrdiff_t>(cut.later->place));
            cut.start_number = cut.later->number;
            cut.later.reset();
        }
        cut.has_key = true;
    }
    cut.waiting.push_back(std::move(packet));
}

// False once the end of the part is reached.
Result<bool> take(Cut& cut, Packet packet) {
    if (cut.asked && !cut.started) {
        const bool decides = packet.kind == PacketKind::texture;
        if (decides) wait_with(cut, packet);
        if (auto ok = start(cut); !ok) return tl::unexpected(ok.error());
        if (decides) return true;
    }
    cut.numbers.push(packet);
    cut.time.push(packet, cut.numbers.begins_sequence());
    if (cut.numbers.begins_sequence()) cut.has_key = false, cut.later.reset();
    cut.output.add_bounds_of(packet);
    if (packet.kind == PacketKind::index || packet.kind == PacketKind::front_index) return true;
    if (packet.kind == PacketKind::sequence) {
        if (auto ok = cut.headers.decode(packet); !ok) return tl::unexpected(ok.error());
        cut.header = packet;
    }
    if (!frame_type(packet.kind)) {
        if (cut.started)
            if (auto ok = write(cut, std::move(packet)); !ok) return tl::unexpected(ok.error());
        if (!cut.started && packet.kind != PacketKind::sequence && !cut.waiting.empty())
            wait_with(cut, std::move(packet));
        return true;
    }
    const auto number = cut.numbers.of(packet.frame);
    if (is_behind(cut, number)) return false;
    cut.last_number = number;
    if (cut.started) {
        ++cut.frames;
        if (auto ok = write(cut, std::move(packet)); !ok) return tl::unexpected(ok.error());
        return true;
    }
    if (can_start_here(cut) && cut.has_key) {
        cut.later = {cut.waiting.size(), packet.frame, number};
    } else if (can_start_here(cut)) {
        cut.waiting.clear();
        cut.start_number = number;
    } else if (cut.waiting.empty()) {
        return true;  // it needs what is not there
    }
    cut.waiting.push_back(std::move(packet));
    if (is_before(cut, number)) return true;
    cut.first_asked = number;
    cut.asked = true;
    if (cut.later && cut.later->number == number) return true;
    if (auto ok = start(cut); !ok) return tl::unexpected(ok.error());
    return true;
}

// The last frame of the index at which the part may begin; null if only reading tells.
const AccessPoint* point_for(const Options& options, const StreamIndex& index) {
    if (index.sequences.size() != 1) return nullptr;  // a later one may repeat numbers and times
    if (!(options.from > 0)) return point_before(index, options.first);
    const AccessPoint* out = nullptr;
    for (const auto& point : index.points)
        if (static_cast<double>(point.timestamp_us) - static_cast<double>(index.first_timestamp_us) <=
            1e6 * options.from)
            out = &point;
    return out ? point_before(index, out->frame) : nullptr;
}

// Skips what lies before the part, if the stream is a file with an index of all of it; otherwise that is read too.
void skip_to_part(Cut& cut, StreamInput& input) {
    auto stream = SeekableStream::open(cut.options.input, cut.options.limits.max_packet_bytes);
    const auto index = stream ? stream->index_at(0) : std::nullopt;
    const auto* point = index && index->end() == stream->size() ? point_for(cut.options, index->index) : nullptr;
    if (!point) return;
    // A part begins where nothing before is needed, of pictures neither.
    const auto needs_more = [&](const AccessPoint& at) {
        const auto picture = stream->picture_behind(index->begin + at.offset);
        return at.back > 0 || (picture && !is_key_picture(picture->header));
    };
    while (needs_more(*point) && point != index->index.points.data()) --point;
    if (point->back > 0) return;
    const auto first = stream->at(index->begin + point->offset);
    const auto header_place = stream->at(index->begin + index->index.sequences[0].offset);
    const auto front_place = stream->at(0);
    if (!first || !frame_type(first->header.kind) || !header_place || !front_place) return;
    auto header = stream->read(*header_place), front = stream->read(*front_place);
    if (!header || !front) return;
    cut.numbers.begin(first->header.frame, static_cast<std::uint32_t>(point->frame));
    cut.time.begin(index->index.first_timestamp_us);
    input.go_on_with({std::move(*front), std::move(*header)}, first->offset);
}

// An error if the input, as far as it was read, was not whole. An end that is cut off behind the part is not missed.
Result<void> check_whole_up_to_part(const Cut& cut, const StreamInput& input) {
    const auto& options = cut.options;
    if (!cut.started || input.refusal() || input.damaged_bytes() > 0 || input.oversized_packets() > 0)
        return check_whole(input, options.input);
    if (has_all(cut)) return {};
    return check_whole(input, options.input,
                       fmt::format("--first {} --frames {} copies what is whole", cut.first_asked,
                                   cut.last_number - cut.first_asked + 1));
}

std::string no_such_frames(const Cut& cut) {
    const auto& input = cut.options.input;
    if (cut.waiting.empty()) return fmt::format("{} has no such frames; 'htvm info' tells which it has", input);
    return fmt::format("{} has no such frames: it has {} and lasts {:.2f} s", input,
                       counted(std::size_t{cut.last_number} + 1, "frame"),
                       static_cast<double>(cut.time.microseconds() + cut.time.one_frame_us()) / 1e6);
}

Result<void> run_cut(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    Cut cut{options, *output, Decoder(options.limits)};
    if (options.first > 0 || options.from > 0) skip_to_part(cut, *input);
    while (auto packet = input->next()) {
        const auto more = take(cut, std::move(*packet));
        if (!more) return tl::unexpected(more.error());
        if (!*more) break;
    }
    if (cut.asked && !cut.started)
        if (auto ok = start(cut); !ok) return ok;
    if (auto fine = check_whole_up_to_part(cut, *input); !fine) return fine;
    if (!cut.started)
        return fail(ErrorKind::bad_input, cut.header
                                              ? no_such_frames(cut)
                                              : options.input + " is not an htvm stream: no sequence header was found");
    if (auto finished = output->finish(); !finished) return finished;
    const bool widened = cut.first_asked > cut.start_number;
    note(fmt::format(
        "{}: {}, numbers {} to {} of {}{}", options.output, counted(cut.frames, "frame"), cut.start_number,
        cut.last_number, options.input,
        widened ? fmt::format(", from I-frame {} on, which frame {} needs", cut.start_number, cut.first_asked) : ""));
    return {};
}

}  // namespace

void add_cut(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("cut", "Copy some frames of an .htvm stream, without encoding them again");
    command->add_option("input", options->input, "The stream: a file, or - for standard input")
        ->type_name("FILE")
        ->required();
    command->add_option("-o,--output", options->output, "The new stream: a file, or - for standard output")
        ->type_name("FILE")
        ->required();
    auto* first = command->add_option("--first", options->first, "First frame, counted from 0 (default: 0)");
    auto* frames =
        command->add_option("--frames", options->frames, "At most this many frames from there; 0: all (default: all)");
    auto* from = command->add_option("--from", options->from, "Instead of --first: seconds from the first frame");
    auto* to =
        command->add_option("--to", options->to, "Instead of --frames: up to this many seconds from the first frame");
    from->check(CLI::NonNegativeNumber)->excludes(first)->excludes(frames);
    to->check(CLI::NonNegativeNumber)->excludes(first)->excludes(frames);
    add_packet_limits(*command, options->limits);
    command->footer(
        "The part begins with an I-frame, the first frame asked for or the last before it: what follows refers to it,\n"
        "also at the places between where players start (encode --access-interval). What is to be cut closely is\n"
        "encoded with a smaller --keyint. Frames are numbered from 0 and keep their timestamps.\n"
        "Of a stream whose end is missing, --frames takes what is whole.\n"
        "Examples:\n"
        "  htvm cut person.htvm --first 300 --frames 150 -o part.htvm\n"
        "  htvm cut person.htvm --from 10 --to 15 -o part.htvm");
    command->callback([options, &run] {
        if (options->to >= 0 && options->to <= options->from)
            throw CLI::ValidationError("--to",
                                       fmt::format("{:g} s is not after --from, {:g} s", options->to, options->from));
        run = [options] { return run_cut(*options); };
    });
}

}  // namespace htvm::app
