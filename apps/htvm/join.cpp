// htvm join: streams one after the other as one stream, without encoding anything again.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    std::vector<std::string> inputs;
    std::string output;
    DecoderOptions limits;
};

// What the output holds so far.
struct Joined {
    StreamOutput& output;
    std::optional<std::vector<std::uint8_t>> header;  // payload of the one in force
    std::uint64_t frames = 0;
    std::size_t sequences = 0;
    std::uint32_t next_number = 0;  // in the sequence in force
    std::int64_t last_us = 0;
    double frame_us = 0;  // of a frame, by the header's rate
};

// A sequence of an input, as it goes into the output.
struct Part {
    std::optional<Packet> header;         // waits for the frame behind it
    std::vector<Packet> waiting = {};     // likewise, codebooks and others
    std::uint32_t first = 0, number = 0;  // own number of its first frame, and its number in the output
    std::int64_t later_us = 0;            // added to its timestamps
    bool begun = false;
};

Packet moved(Packet packet, const Part& part) {
    packet.frame = packet.frame - part.first + part.number;
    if (packet.kind != PacketKind::sequence) packet.reference = packet.reference - part.first + part.number;
    packet.timestamp_us = static_cast<std::int64_t>(static_cast<std::uint64_t>(packet.timestamp_us) +
                                                    static_cast<std::uint64_t>(part.later_us));
    return packet;
}

// With the same header it is the same sequence, whose numbers go on; with another one a new sequence begins. Timestamps
// stay, unless they would not ascend.
void begin(Joined& joined, Part& part, const Packet& frame, const Packet& header) {
    const bool goes_on = joined.header && *joined.header == header.payload;
    part.first = frame.frame;
    part.number = goes_on ? joined.next_number : 0;
    part.later_us = 0;
    if (joined.frames > 0 && frame.timestamp_us <= joined.last_us)
        part.later_us = joined.last_us + static_cast<std::int64_t>(joined.frame_us + 0.5) - frame.timestamp_us;
    joined.sequences += goes_on ? 0 : 1;
    joined.header = header.payload;
    part.begun = true;
}

Result<void> write_frame(Joined& joined, Part& part, Packet packet) {
    auto frame = moved(std::move(packet), part);
    if (part.header) {
        auto header = moved(std::move(*part.header), part);
        part.header.reset();
        header.frame = frame.frame;
        header.timestamp_us = frame.timestamp_us;
        if (auto ok = joined.output.write(header); !ok) return ok;
    }
    for (auto& before : part.waiting)
        if (auto ok = joined.output.write(moved(std::move(before), part)); !ok) return ok;
    part.waiting.clear();
    ++joined.frames;
    joined.next_number = std::max(joined.next_number, frame.frame + 1);
    joined.last_us = frame.timestamp_us;
    return joined.output.write(frame);
}

Result<void> add_input(Joined& joined, const std::string& path, const DecoderOptions& limits) {
    auto input = StreamInput::open(path, limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    Decoder headers(limits);  // for the sequence headers alone
    FrameNumbers numbers;
    Part part;
    std::optional<Packet> in_force;
    while (auto packet = input->next()) {
        numbers.take(*packet);
        if (packet->kind == PacketKind::front_index)
            if (const auto index = read_index(*packet); index && index->bounds)
                joined.output.add_bounds(*index->bounds);
        if (packet->kind == PacketKind::index || packet->kind == PacketKind::front_index) continue;
        if (packet->kind == PacketKind::sequence) {
            if (auto ok = headers.push(*packet); !ok) return tl::unexpected(ok.error());
            in_force = part.header = std::move(*packet);
        } else if (!frame_type(packet->kind)) {
            part.waiting.push_back(std::move(*packet));
        } else if (in_force) {
            if (numbers.begins_sequence()) {
                const auto& rate = *headers.sequence();
                joined.frame_us = 1e6 * rate.fps_denominator / rate.fps_numerator;
                begin(joined, part, *packet, *in_force);
                if (part.number == 0) joined.next_number = 0;
                part.header = in_force;
            }
            if (auto ok = write_frame(joined, part, std::move(*packet)); !ok) return ok;
        }
    }
    if (auto fine = check_whole(*input, path); !fine) return fine;
    if (!part.begun) return fail(ErrorKind::corrupt_stream, path + " is not an htvm stream, or has no frames");
    return {};
}

Result<void> run_join(const Options& options) {
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    Joined joined{*output, {}};
    for (const auto& input : options.inputs)
        if (auto added = add_input(joined, input, options.limits); !added) return added;
    if (auto finished = output->finish(); !finished) return finished;
    note(fmt::format("{}: {} in {}", options.output, counted(joined.frames, "frame"),
                     counted(joined.sequences, "sequence")));
    return {};
}

}  // namespace

void add_join(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("join", "Put .htvm streams one after the other, without encoding them again");
    command->add_option("inputs", options->inputs, "The streams, in their order")->required()->expected(1, -1);
    command->add_option("-o,--output", options->output, "The new stream: a file, or - for standard output")->required();
    add_packet_limits(*command, options->limits);
    command->footer(
        "Streams with the same header, such as parts of one stream, become one sequence whose frames are numbered on.\n"
        "Timestamps stay as they are, unless they would not ascend; then those of the stream are moved behind the "
        "last.\n"
        "Example:\n"
        "  htvm join part1.htvm part2.htvm -o whole.htvm");
    command->callback([options, &run] { run = [options] { return run_join(*options); }; });
}

}  // namespace htvm::app
