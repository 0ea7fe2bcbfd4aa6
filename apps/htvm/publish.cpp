// htvm publish: a stream from a file or a pipe, to a hub, at the time of its frames.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "live_rounds.h"
#include "pacing.h"
#include "publishing.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

using Clock = Pacing::Clock;

struct Options {
    std::string input;
    std::vector<std::string> hubs;  // the first is where the stream goes, the others where to go on
    PublishingOptions publishing;
    bool loop = false, json = false;
    double speed = 1;
    DecoderOptions limits;
};

struct Publication {
    const Options& options;
    Publishing& hub;
    LiveRounds stream;
    Pacing pacing = {};
    Progress progress;
    std::size_t rounds = 0;
    Clock::time_point told = {};  // the last line of JSON
};

nlohmann::json state_json(const Publication& p) {
    const auto state = p.hub.state();
    const auto milliseconds = [](std::chrono::microseconds time) { return static_cast<double>(time.count()) / 1e3; };
    return {{"hub", state.hub},
            {"connected", state.connected},
            {"connections", state.connections},
            {"rounds", p.rounds},
            {"frames", p.stream.frames()},
            {"packets", state.sent_packets},
            {"bytes", state.sent_bytes},
            {"dropped_frames", state.dropped_frames},
            {"queue_bytes", state.queue_bytes},
            {"queue_ms", state.queue_time.count()},
            {"round_trip_ms", state.round_trip ? nlohmann::json(milliseconds(*state.round_trip)) : nlohmann::json()},
            {"viewers", state.viewers ? nlohmann::json(*state.viewers) : nlohmann::json()},
            {"trouble", state.trouble}};
}

void tell(Publication& p, bool at_once) {
    constexpr std::chrono::seconds each{1};
    const auto now = Clock::now();
    if (!p.options.json || (!at_once && now - p.told < each)) return;
    p.told = now;
    fmt::print("{}\n", state_json(p).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    std::fflush(stdout);
}

Result<void> send(Publication& p, const Packet& packet) {
    const bool frame = frame_type(packet.kind).has_value();
    if (frame) wait_until(p.pacing.due(packet.timestamp_us, Clock::now()));
    if (interruption() != 0) return {};
    if (auto sent = p.hub.send(packet); !sent) return sent;
    if (frame) p.progress.step(p.hub.progress());
    tell(p, false);
    return {};
}

// Once through the stream.
Result<void> publish_round(Publication& p) {
    auto input = StreamInput::open(p.options.input, p.options.limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    p.stream.begin_round();
    const auto before = p.stream.frames();
    while (interruption() == 0) {
        auto packet = input->next();
        if (!packet) break;
        auto ready = p.stream.take(std::move(*packet));
        if (!ready) return fail(ready.error().kind, p.options.input + ": " + ready.error().message);
        for (const auto& next : *ready)
            if (auto sent = send(p, next); !sent) return sent;
    }
    if (interruption() != 0) return {};
    if (p.stream.frames() == before)
        return fail(ErrorKind::corrupt_stream, p.options.input + " is not an htvm stream: it has no frame");
    ++p.rounds;
    return check_whole(*input, p.options.input);
}

Result<void> publish(const Options& options) {
    watch_for_interruption();
    auto hub = Publishing::open(options.hubs[0], options.publishing);
    if (!hub) return tl::unexpected(hub.error());
    Result<void> done;
    std::uint64_t frames = 0;
    {
        Publication p{options, *hub, LiveRounds(random_session, options.speed), {}, Progress("publishing", 0)};
        do done = publish_round(p);
        while (done && options.loop && interruption() == 0);
        const auto finished = hub->finish();
        if (done && !finished) done = finished;
        tell(p, true);
        frames = p.stream.frames();
    }
    if (!done) return done;
    const auto state = hub->state();
    note(fmt::format("{} to {}, {} dropped", counted(frames, "frame"), state.hub, state.dropped_frames));
    if (interruption() != 0 && !options.loop) return fail(ErrorKind::bad_input, "interrupted");
    return {};
}

std::string contradiction_in(const Options& options) {
    if (options.loop && options.input == "-")
        return "--loop: begins again, which standard input does not allow; give a file";
    if (destination_of(options.input).is_hub()) return "input: is a file or standard input; hubs come behind it";
    return {};
}

}  // namespace

void add_publish(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("publish", "Send an .htvm stream to a hub, live, at the time of its frames");
    command->add_option("input", options->input, "The stream: a file, or - for standard input")
        ->type_name("FILE")
        ->required();
    command
        ->add_option("hubs", options->hubs,
                     "Where to: ws://HOST:PORT/publish/NAME, or wss:// with TLS. Of several, where to go on if one is\n"
                     "lost; they may leave the path away")
        ->type_name("URL")
        ->expected(1, -1)
        ->required();
    command->add_flag("--loop", options->loop,
                      "Begin again at the end, until Ctrl-C: each round is a session of its own, and time goes on");
    command->add_option("--speed", options->speed, "So many times as fast as it was captured (default 1)")
        ->check(CLI::Range(0.01, 100.0));
    command->add_flag("--json", options->json, "Print a line of JSON on standard output each second, and at the end")
        ->group(heading::scripts);
    add_publishing_options(*command, options->publishing);
    add_packet_limits(*command, options->limits);
    command->footer(
        "Frames are sent when they are due by their timestamps. What the line does not take in time is dropped so "
        "that\n"
        "what arrives can be decoded, and counted. Where the hub is lost, it is looked for until it is back; the "
        "frames\n"
        "of that time are dropped.\n"
        "Examples:\n"
        "  htvm publish person.htvm ws://localhost:8080/publish/person --loop\n"
        "  HTVM_TOKEN=... htvm publish person.htvm wss://hub.example/publish/person\n"
        "  ssh rig htvm encode ... -o - | htvm publish - ws://localhost:8080/publish/person");
    add_front_page(*command, {{{"--loop"},
                               {"--speed"},
                               {"--token-file",
                                "A file whose first line is the token by which the hub knows who may "
                                "publish\n(or the environment variable HTVM_TOKEN)"},
                               {"--ca", "wss: PEM file of the certificates that may vouch for the hub's"},
                               {"--json", "Print how it goes, a line of JSON each second"}}});
    command->callback([options, &run] {
        if (const auto why = contradiction_in(*options); !why.empty()) throw CLI::ValidationError(why);
        options->publishing.other_hubs.assign(options->hubs.begin() + 1, options->hubs.end());
        run = [options] { return publish(*options); };
    });
}

}  // namespace htvm::app
