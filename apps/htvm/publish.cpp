// htvm publish: a stream from a file or a pipe, to a hub, at the time of its frames.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "ladder_files.h"
#include "live_rounds.h"
#include "pacing.h"
#include "publishing.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

using Clock = Pacing::Clock;

struct Options {
    std::string input;                // the first of
    std::vector<std::string> inputs;  // a ladder's rungs, the coarsest first
    std::vector<std::string> hubs;    // the first is where the stream goes, the others where to go on
    PublishingOptions publishing;
    bool ladder = false, loop = false, json = false;
    double speed = 1;
    DecoderOptions limits;
};

// A stream, or a rung of a ladder.
struct Source {
    std::string file;
    Publishing hub;
    LiveRounds stream;
    std::optional<StreamInput> input = {};      // in this round
    std::deque<Packet> ready = {};              // to be sent
    std::optional<std::int64_t> first_us = {};  // the timestamp of the file's first frame
};

struct Publication {
    const Options& options;
    std::vector<Source> sources;
    std::optional<Progress> progress = {};
    Pacing pacing = {};
    std::size_t rounds = 0;
    Clock::time_point told = {};  // the last line of JSON
};

nlohmann::json state_json(const Source& source, std::size_t rounds) {
    const auto state = source.hub.state();
    const auto milliseconds = [](std::chrono::microseconds time) { return static_cast<double>(time.count()) / 1e3; };
    return {{"hub", state.hub},
            {"connected", state.connected},
            {"connections", state.connections},
            {"rounds", rounds},
            {"frames", source.stream.frames()},
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
    auto out = nlohmann::json::array();
    for (const auto& source : p.sources) out.push_back(state_json(source, p.rounds));
    const auto line = p.options.ladder ? nlohmann::json{{"rungs", std::move(out)}} : std::move(out.front());
    fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    std::fflush(stdout);
}

// Opens the files anew. What a rung left out at its end is no reason to be earlier in the next round than the others.
Result<void> begin_round(Publication& p) {
    std::uint64_t end_us = 0;
    for (const auto& source : p.sources) end_us = std::max(end_us, source.stream.end_us());
    for (auto& source : p.sources) {
        auto input = StreamInput::open(source.file, p.options.limits.max_packet_bytes);
        if (!input) return tl::unexpected(input.error());
        source.input.emplace(std::move(*input));
        source.stream.begin_round();
        source.stream.put_off(end_us - source.stream.end_us());
    }
    return {};
}

// Reads on to what is to be sent. False at the end of the file.
Result<bool> read_on(Source& source) {
    while (source.ready.empty()) {
        auto packet = source.input->next();
        if (!packet) return false;
        if (!source.first_us && frame_type(packet->kind)) source.first_us = packet->timestamp_us;
        auto ready = source.stream.take(std::move(*packet));
        if (!ready) return fail(ready.error().kind, source.file + ": " + ready.error().message);
        for (auto& next : *ready) source.ready.push_back(std::move(next));
    }
    return true;
}

// The source whose next packet is due first; null where all files have ended.
Result<Source*> next_due(Publication& p) {
    Source* out = nullptr;
    for (auto& source : p.sources) {
        const auto more = read_on(source);
        if (!more) return tl::unexpected(more.error());
        if (*more && (!out || source.ready.front().timestamp_us < out->ready.front().timestamp_us)) out = &source;
    }
    return out;
}

// Rungs that begin at different times are no ladder: a viewer who goes from one to another would see other frames.
Result<void> check_beginnings(const Publication& p) {
    const auto& first = p.sources.front();
    for (const auto& source : p.sources)
        if (source.first_us && first.first_us && source.first_us != first.first_us)
            return fail(ErrorKind::bad_input,
                        fmt::format("--ladder: {} begins at {:.3f} s and {} at {:.3f} s; rungs are "
                                    "of one capture, by one htvm encode --ladder",
                                    first.file, 1e-6 * static_cast<double>(*first.first_us), source.file,
                                    1e-6 * static_cast<double>(*source.first_us)));
    return {};
}

Result<void> send_next(Publication& p, Source& source) {
    const auto packet = std::move(source.ready.front());
    source.ready.pop_front();
    const bool frame = frame_type(packet.kind).has_value();
    if (frame) wait_until(p.pacing.due(packet.timestamp_us, Clock::now()));
    if (interruption() != 0) return {};
    if (auto sent = source.hub.send(packet); !sent) return sent;
    if (frame && &source == &p.sources.back()) p.progress->step(source.hub.progress());
    tell(p, false);
    return {};
}

// Once through the stream.
Result<void> publish_round(Publication& p) {
    std::vector<std::uint64_t> before;
    for (const auto& source : p.sources) before.push_back(source.stream.frames());
    if (auto begun = begin_round(p); !begun) return begun;
    while (interruption() == 0) {
        auto source = next_due(p);
        if (!source) return tl::unexpected(source.error());
        if (!*source) break;
        if (auto fine = check_beginnings(p); !fine) return fine;
        if (auto sent = send_next(p, **source); !sent) return sent;
    }
    if (interruption() != 0) return {};
    ++p.rounds;
    for (std::size_t i = 0; i < p.sources.size(); ++i) {
        auto& source = p.sources[i];
        if (source.stream.frames() == before[i])
            return fail(ErrorKind::corrupt_stream, source.file + " is not an htvm stream: it has no frame");
        if (auto whole = check_whole(*source.input, source.file); !whole) return whole;
    }
    return {};
}

// A number for each sequence of each round; those of a ladder's rungs have the same, by which the hub knows that they
// belong together.
class Sessions {
public:
    std::function<std::uint64_t()> of_source() {
        return [drawn = drawn_, next = std::size_t{0}]() mutable {
            if (next == drawn->size()) drawn->push_back(random_session());
            return (*drawn)[next++];
        };
    }

private:
    std::shared_ptr<std::vector<std::uint64_t>> drawn_ = std::make_shared<std::vector<std::uint64_t>>();
};

// How a rung's hubs are called.
Result<Publishing> open_hub(const Options& options, std::size_t number) {
    if (!options.ladder) return Publishing::open(options.hubs[0], options.publishing);
    auto publishing = options.publishing;
    for (auto& hub : publishing.other_hubs) hub = rung_address(hub, number);
    return Publishing::open(rung_address(options.hubs[0], number), publishing);
}

Result<void> publish(const Options& options) {
    watch_for_interruption();
    auto files = options.ladder ? files_of_ladder(options.inputs) : Result<std::vector<std::string>>(options.inputs);
    if (!files) return tl::unexpected(files.error());
    Publication p{options, {}};
    Sessions sessions;
    for (const auto& file : *files) {
        auto hub = open_hub(options, p.sources.size() + 1);
        if (!hub) return tl::unexpected(hub.error());
        p.sources.push_back({file, std::move(*hub), LiveRounds(sessions.of_source(), options.speed)});
    }
    p.progress.emplace("publishing", 0);
    Result<void> done;
    do done = publish_round(p);
    while (done && options.loop && interruption() == 0);
    for (auto& source : p.sources)
        if (const auto finished = source.hub.finish(); done && !finished) done = finished;
    tell(p, true);
    p.progress.reset();
    if (!done) return done;
    for (const auto& source : p.sources) {
        const auto state = source.hub.state();
        note(fmt::format("{} to {}, {} dropped", counted(source.stream.frames(), "frame"), state.hub,
                         state.dropped_frames));
    }
    if (interruption() != 0 && !options.loop) return fail(ErrorKind::bad_input, "interrupted");
    return {};
}

// A ladder names any number of files, and the hubs behind them.
void tell_files_from_hubs(Options& options) {
    const auto is_hub = [](const std::string& one) { return destination_of(one).is_hub(); };
    const auto first = std::find_if(options.hubs.begin(), options.hubs.end(), is_hub);
    options.inputs.insert(options.inputs.end(), options.hubs.begin(), first);
    options.hubs.erase(options.hubs.begin(), first);
}

std::string contradiction_in(const Options& options) {
    const bool standard = std::find(options.inputs.begin(), options.inputs.end(), "-") != options.inputs.end();
    if (options.loop && standard) return "--loop: begins again, which standard input does not allow; give a file";
    if (options.ladder && standard) return "--ladder: takes files, not standard input";
    if (options.ladder && options.hubs.empty())
        return "--ladder: the last word is where to: ws://HOST:PORT/publish/NAME, or wss://";
    if (destination_of(options.inputs.front()).is_hub())
        return "input: is a file or standard input; hubs come behind it";
    if (options.hubs.empty()) return "hubs: say where to, behind the file: ws://HOST:PORT/publish/NAME, or wss://";
    return {};
}

}  // namespace

void add_publish(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("publish", "Send an .htvm stream to a hub, live, at the time of its frames");
    command->add_option("input", options->input, "The stream: a file, or - for standard input; with --ladder several")
        ->type_name("FILE")
        ->required();
    command
        ->add_option("hubs", options->hubs,
                     "Where to: ws://HOST:PORT/publish/NAME, or wss:// with TLS. Of several, where to go on if one is\n"
                     "lost; they may leave the path away")
        ->type_name("URL")
        ->expected(1, -1);
    command->add_flag(
        "--ladder", options->ladder,
        "The stream in several qualities, each a file of its own, the coarsest first, or what htvm encode\n"
        "--ladder wrote: its list of playlists, or the folder. They go out as the streams NAME~1, NAME~2\n"
        "and so on, at the same time, and viewers of the hub's segments go from one to another");
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
        "  htvm publish low.htvm high.htvm --ladder ws://localhost:8080/publish/person\n"
        "  ssh rig htvm encode ... -o - | htvm publish - ws://localhost:8080/publish/person");
    add_front_page(*command, {{{"--ladder", "The stream in several qualities: files, or a list of playlists"},
                               {"--loop"},
                               {"--speed"},
                               {"--token-file",
                                "A file whose first line is the token by which the hub knows who may "
                                "publish\n(or the environment variable HTVM_TOKEN)"},
                               {"--ca", "wss: PEM file of the certificates that may vouch for the hub's"},
                               {"--json", "Print how it goes, a line of JSON each second"}}});
    command->callback([options, &run] {
        options->inputs = {options->input};
        if (options->ladder) tell_files_from_hubs(*options);
        if (const auto why = contradiction_in(*options); !why.empty()) throw CLI::ValidationError(why);
        options->publishing.other_hubs.assign(options->hubs.begin() + 1, options->hubs.end());
        run = [options] { return publish(*options); };
    });
}

}  // namespace htvm::app
