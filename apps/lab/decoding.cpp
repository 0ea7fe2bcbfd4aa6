// htvm-lab decoding: how long each frame of a stream takes to decode.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "metrics/percentile.h"

namespace htvm::lab {
namespace {

struct Options {
    std::vector<std::string> inputs;
    unsigned threads = 1;
    int repeat = 5;
    bool prepare = false;
    bool json = false;
};

struct TimedFrame {
    FrameInfo info;
    double milliseconds = 0;  // the least of all rounds: what else the machine does only adds
    double prepared = 0;      // likewise, of Decoder::prepare() behind it
};

Result<std::vector<TimedFrame>> timed_frames(const std::string& file, const Options& options) {
    const auto bytes = read_file(file);
    if (!bytes) return tl::unexpected(bytes.error());
    PacketReader reader;
    reader.push(*bytes);
    std::vector<Packet> packets;
    while (auto packet = reader.pull()) packets.push_back(std::move(*packet));
    std::vector<TimedFrame> out;
    app::Progress progress("decoding " + file, static_cast<std::size_t>(options.repeat) * packets.size());
    for (int round = 0; round < options.repeat; ++round) {
        DecoderOptions settings;
        settings.threads = options.threads;
        settings.intra_coder = draco_intra_coder();
        Decoder decoder(settings);
        std::size_t at = 0;
        for (const auto& packet : packets) {
            using Clock = std::chrono::steady_clock;
            const auto begin = Clock::now();
            const auto frame = decoder.decode(packet);
            const double milliseconds = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
            progress.step();
            if (!frame) return fail(frame.error().kind, file + ": " + frame.error().message);
            if (!*frame) continue;
            if (round == 0) out.push_back({(*frame)->info, milliseconds, std::numeric_limits<double>::max()});
            auto& own = out[at++];
            own.milliseconds = std::min(own.milliseconds, milliseconds);
            if (!options.prepare) continue;
            const auto between = Clock::now();
            decoder.prepare();
            own.prepared =
                std::min(own.prepared, std::chrono::duration<double, std::milli>(Clock::now() - between).count());
        }
    }
    if (out.empty()) return fail(ErrorKind::bad_input, file + ": there is no frame");
    return out;
}

nlohmann::json summary(std::vector<double> milliseconds) {
    std::sort(milliseconds.begin(), milliseconds.end());
    return {{"frames", milliseconds.size()},
            {"p50_ms", percentile(milliseconds, 50)},
            {"p99_ms", percentile(milliseconds, 99)},
            {"max_ms", milliseconds.back()}};
}

std::string row(const std::string& name, const nlohmann::json& of) {
    return fmt::format("{:20} {:7} {:8.2f} {:8.2f} {:8.2f}\n", name, of["frames"].get<std::size_t>(),
                       of["p50_ms"].get<double>(), of["p99_ms"].get<double>(), of["max_ms"].get<double>());
}

Result<void> run_decoding(const Options& options) {
    auto all = nlohmann::json::array();
    for (const auto& file : options.inputs) {
        const auto frames = timed_frames(file, options);
        if (!frames) return tl::unexpected(frames.error());
        std::vector<double> times;
        std::map<std::string, std::vector<double>> by_kind;
        std::vector<std::uint32_t> vertices;
        auto listed = nlohmann::json::array();
        double longest = 0;
        for (const auto& frame : *frames) {
            const std::string kind = kind_of(frame.info.type).letter;
            times.push_back(frame.milliseconds);
            by_kind[kind].push_back(frame.milliseconds);
            vertices.push_back(frame.info.vertices);
            listed.push_back({{"frame", frame.info.frame}, {"type", kind}, {"ms", frame.milliseconds}});
            if (options.prepare) listed.back()["prepare_ms"] = frame.prepared;
            longest = std::max(longest, frame.prepared);
        }
        std::sort(vertices.begin(), vertices.end());
        auto of_file = summary(times);
        of_file["file"] = file;
        of_file["vertices"] = vertices[vertices.size() / 2];
        of_file["p99_over_p50"] = of_file["p99_ms"].get<double>() / of_file["p50_ms"].get<double>();
        for (const auto& [kind, milliseconds] : by_kind) of_file["by_type"][kind] = summary(milliseconds);
        if (!options.json) {
            fmt::print("{}, {} decoded vertices\n{:20} {:>7} {:>8} {:>8} {:>8}\n", file, vertices[vertices.size() / 2],
                       "", "frames", "p50 ms", "p99 ms", "max ms");
            for (const auto& [kind, of] : of_file["by_type"].items()) fmt::print("{}", row(kind + "-frames", of));
            fmt::print("{}p99 is {:.1f} times p50\n", row("all", of_file), of_file["p99_over_p50"].get<double>());
        }
        if (options.prepare) {
            of_file["longest_prepare_ms"] = longest;
            if (!options.json) fmt::print("between frames, {:.2f} ms at most\n", longest);
        }
        of_file["list"] = std::move(listed);
        all.push_back(std::move(of_file));
    }
    if (options.json) fmt::print("{}\n", all.dump(2));
    return {};
}

}  // namespace

void add_decoding(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("decoding", "How long each frame of a stream takes to decode");
    command->add_option("streams", options->inputs, ".htvm files")->required();
    command->add_option("--threads", options->threads, "Threads of the decoder (default 1)")->check(CLI::Range(1, 256));
    command->add_option("--repeat", options->repeat, "Rounds; of each frame the shortest time counts (default 5)")
        ->check(CLI::Range(1, 1000));
    command->add_flag("--prepare", options->prepare,
                      "Derive between two frames what the next one needs, as the web player does; told apart");
    command->add_flag("--json", options->json, "Print the result, with each frame's time, as JSON on standard output");
    command->footer(
        "Times are of the decoder alone, from packets in memory to meshes in memory. What a kind of frame leaves for\n"
        "the next one to derive counts there, or with --prepare between the two.\n\n"
        "Example:\n"
        "  htvm-lab decoding stream.htvm");
    command->callback([options, &run] { run = [options] { return run_decoding(*options); }; });
}

}  // namespace htvm::lab
