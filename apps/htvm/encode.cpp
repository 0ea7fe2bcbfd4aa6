// htvm encode: meshes and a skeleton in, a stream out.
#include "encode.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line/interruption.h"
#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "encoder_options.h"
#include "rate_passes.h"
#include "rate_report.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    CaptureOptions capture;
    EncodingOptions encoding;
    std::string output, on_bad_frame = "stop";
    bool fill = false, json = false;
    bool keep_partial = true;  // of an encoding that ends early
};

// ---- One run over the capture ---------------------------------------------------------------------------------------

struct Summary {
    TotalsByType totals;
    double encode_seconds = 0;
    std::size_t without_triangles = 0;
    // Of the capture's frames, coded or not.
    std::size_t frames = 0;
    std::int64_t first_us = 0, last_us = 0;
    // Frames that are not as captured.
    std::size_t left_out = 0, repeated = 0;  // bad ones
    std::size_t missing = 0, filled = 0;     // by the numbers of the files
    nlohmann::json list = nlohmann::json::array();
};

// Of two runs, the first writes nothing.
struct Pass {
    const Options& options;
    Capture& capture;
    Encoder& encoder;
    StreamOutput* output;  // null: the packets go nowhere
    RateReport& rate;
    std::string name;  // for the progress line
    Summary& summary;
    Progress progress{name, capture.frames()};
    std::optional<Mesh> last = {};  // coded last, where it may have to stand in for others
    bool is_first_to_write = true;  // of several passes that do: says what is wrong with the capture
};

// Of hundreds the first few tell enough.
void warn_of_frame(const Pass& pass, std::size_t how_many_so_far, const std::string& line) {
    constexpr std::size_t most = 10;
    if (!pass.output || !pass.is_first_to_write || how_many_so_far > most) return;
    warn(how_many_so_far < most ? line : line + "; others like it follow");
}

Result<void> drain(const Pass& pass) {
    while (auto packet = pass.encoder.pull()) {
        pass.rate.buffer.add(*packet);
        if (!pass.output) continue;
        if (auto written = pass.output->write(*packet); !written) return written;
    }
    return {};
}

std::string progress_text(const Pass& pass, const FrameInfo& info) {
    std::string text = fmt::format("{} {:.2f} bpv", kind_of(info.type).letter,
                                   bits_per_vertex(info.bytes.total(), info.source_vertices));
    if (pass.rate.controlled()) text += fmt::format(", quality {:.0f}", pass.encoder.last_cost().quality);
    return text;
}

// What became of a mesh.
enum class Coded { yes, dropped };

// Under rate control a frame that does not fit is dropped, and the stream goes on without it; but not the first, as all
// others need an I-frame before them.
Result<Coded> code(Pass& pass, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us) {
    auto& summary = pass.summary;
    const auto start = std::chrono::steady_clock::now();
    const auto pushed = pass.encoder.push(mesh, pose, timestamp_us);
    summary.encode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const bool dropped =
        !pushed && pushed.error().kind == ErrorKind::limit && pass.rate.rate_controlled() && !pass.rate.costs.empty();
    if (!pushed && !dropped)
        return fail(pushed.error().kind, fmt::format("{}: {}", pass.capture.name(), pushed.error().message));
    if (summary.frames++ == 0) summary.first_us = timestamp_us;
    summary.last_us = timestamp_us;
    if (dropped) {
        add_dropped(pass.rate);
        warn_of_frame(pass, pass.rate.dropped.size(),
                      fmt::format("{} is dropped: {}", pass.capture.name(), pushed.error().message));
        pass.progress.step("dropped");
        return Coded::dropped;
    }
    const auto& info = pass.encoder.last_frame();
    add(summary.totals, info);
    add_coded(pass.rate, pass.encoder.last_cost());
    if (pass.options.json && pass.output) {
        summary.list.push_back(frame_json(info));
        if (pass.rate.controlled()) summary.list.back()["quality"] = pass.encoder.last_cost().quality;
    }
    if (auto written = drain(pass); !written) return tl::unexpected(written.error());
    if (const auto bounds = pass.encoder.bounds(); bounds && pass.output) pass.output->add_bounds(*bounds);
    pass.progress.step(progress_text(pass, info));
    return Coded::yes;
}

// The frame coded last, once more.
Result<void> repeat(Pass& pass, std::int64_t timestamp_us) {
    const auto coded = code(pass, *pass.last, nullptr, timestamp_us);
    return coded ? Result<void>() : tl::unexpected(coded.error());
}

// Numbers that are missing between two files.
Result<void> take_gap(Pass& pass) {
    auto& summary = pass.summary;
    const auto missing = pass.capture.missing_before();
    if (missing == 0) return {};
    const bool fill = pass.options.fill && pass.last;
    warn_of_frame(pass, summary.missing + 1,
                  fmt::format("{} missing before {}, by the numbers in the names; {}",
                              counted(missing, "frame") + (missing == 1 ? " is" : " are"), pass.capture.name(),
                              fill ? "the frame before is repeated" : "a gap in time is left (see --fill)"));
    summary.missing += missing;
    for (std::size_t k = 0; fill && k < missing; ++k) {
        if (auto repeated = repeat(pass, pass.capture.missing_timestamp_us(k)); !repeated) return repeated;
        ++summary.filled;
    }
    return {};
}

// A frame that cannot be read or coded.
Result<void> take_bad(Pass& pass, const Error& error) {
    auto& summary = pass.summary;
    const auto& policy = pass.options.on_bad_frame;
    if (interruption() != 0 || error.kind == ErrorKind::disk_full) return tl::unexpected(error);
    if (!pass.capture.survives_errors()) return tl::unexpected(error);
    if (policy == "stop") return fail(error.kind, error.message + " (--on-bad-frame skip goes on without such frames)");
    const bool repeats = policy == "repeat" && pass.last;
    warn_of_frame(pass, summary.left_out + summary.repeated + 1,
                  error.message + (repeats ? "; the frame before is repeated in its place" : "; it is left out"));
    ++(repeats ? summary.repeated : summary.left_out);
    if (repeats) return repeat(pass, pass.capture.timestamp_us());
    pass.progress.step("left out");
    return {};
}

// What cannot be coded as it should, though the encoder would take it.
Result<void> check_triangles(Pass& pass, const Mesh& mesh) {
    auto& summary = pass.summary;
    if (!mesh.triangles.empty()) return {};
    const bool first = summary.totals.all().frames == summary.without_triangles;
    const auto name = pass.capture.name();
    if (first && pass.options.encoding.profile == "tracked" && !mesh.positions.empty())
        return fail(ErrorKind::bad_input,
                    name +
                        " has points, but no triangles, and --profile tracked codes surfaces: make a mesh of the "
                        "points first, or give --profile topology, which codes points as they are");
    if (!first && pass.options.on_bad_frame != "stop") return fail(ErrorKind::bad_input, name + " has no triangles");
    ++summary.without_triangles;
    return {};
}

Result<void> take(Pass& pass, Mesh& mesh) {
    if (auto fine = check_triangles(pass, mesh); !fine) return fine;
    const auto coded = code(pass, mesh, pass.capture.pose(), pass.capture.timestamp_us());
    if (!coded) return tl::unexpected(coded.error());
    if (*coded == Coded::yes && (pass.options.fill || pass.options.on_bad_frame == "repeat"))
        pass.last = std::move(mesh);
    return {};
}

// Ends with an error of any kind where it is interrupted.
Result<void> encode_frames(Pass& pass) {
    const auto interrupted = [] { return fail(ErrorKind::bad_input, "interrupted"); };
    for (;;) {
        if (interruption() != 0) return interrupted();
        auto mesh = pass.capture.next();
        if (mesh && !*mesh) break;
        if (auto filled = take_gap(pass); !filled) return filled;
        const auto taken = mesh ? take(pass, **mesh) : tl::unexpected(mesh.error());
        if (taken) continue;
        if (auto survived = take_bad(pass, taken.error()); !survived) return survived;
    }
    if (interruption() != 0) return interrupted();
    pass.encoder.finish();
    return drain(pass);
}

// How long the capture's frames last.
double seconds_of(const Summary& summary, double fps) {
    const auto frames = static_cast<double>(summary.frames);
    return summary.frames > 1 ? static_cast<double>(summary.last_us - summary.first_us) / 1e6 * frames / (frames - 1)
                              : 1 / fps;
}

// ---- What is said of it ---------------------------------------------------------------------------------------------

void report(const Options& options, const Summary& summary, const RateReport& rate, std::uint64_t bytes, double fps,
            std::size_t dropped_late) {
    const auto frames = summary.totals.all().frames;
    const double seconds = seconds_of(summary, fps);
    const double megabits = 8e-6 * static_cast<double>(bytes);
    if (options.json) {
        nlohmann::json out = {{"output", options.output},
                              {"bytes", bytes},
                              {"frames", summary.list},
                              {"left_out_frames", summary.left_out},
                              {"repeated_frames", summary.repeated},
                              {"missing_frames", summary.missing},
                              {"filled_frames", summary.filled},
                              {"late_frames", dropped_late},
                              {"megabits_per_second", megabits / seconds},
                              {"encode_frames_per_second", static_cast<double>(frames) / summary.encode_seconds}};
        if (rate.controlled()) out["control"] = rate_json(rate, bytes, seconds);
        fmt::print("{}\n", out.dump(2));
    } else {
        tell(layer_table(summary.totals));
        note(fmt::format("{}: {} frames, {} bytes, {:.2f} Mbit/s at {:g} fps, encoded at {:.1f} frames/s",
                         options.output, frames, bytes, megabits / seconds, fps,
                         static_cast<double>(frames) / summary.encode_seconds));
        if (rate.controlled()) note(rate_summary(rate, bytes, seconds));
    }
    if (dropped_late > 0)
        warn(fmt::format(
            "{} of {} came faster than they were encoded, and were dropped; a lower -q or --bitrate is faster",
            dropped_late, counted(summary.frames + dropped_late, "frame")));
    if (const auto strain = rate_warning(rate); !strain.empty()) warn(strain);
    if (summary.without_triangles > 0)
        warn(fmt::format("{} of {} no triangles; see that the files hold meshes", summary.without_triangles,
                         counted(frames, "frame") + (summary.without_triangles == 1 ? " has" : " have")));
    if (summary.left_out > 0) warn(counted(summary.left_out, "bad frame") + " left out");
    if (summary.repeated > 0) warn(counted(summary.repeated, "bad frame") + " replaced by the frame before");
}

// Why an encoding ended early, and what is left of it.
tl::unexpected<Error> ended_early(Pass& pass, const Error& error) {
    const auto frames = pass.summary.totals.all().frames;
    if (frames == 0 || !pass.options.keep_partial) return tl::unexpected(error);
    pass.encoder.finish();
    const bool whole = drain(pass).has_value();
    const auto kept = pass.output->keep();
    std::string message = fmt::format("{}; {} encoded before", error.message,
                                      counted(frames, "frame") + (frames == 1 ? " was" : " were"));
    if (!kept.empty())
        message += fmt::format(", now in {}, which {}: rename it to use it", kept,
                               whole ? "is a whole stream" : "plays up to where it ends");
    std::error_code ignored;
    if (std::filesystem::is_regular_file(pass.options.output, ignored))
        message += fmt::format(". {} is as it was", pass.options.output);
    return fail(error.kind, message);
}

// A stream that goes to a pipe or a device may be live: a session keeps it apart from a run before.
bool may_be_live(const std::string& output) {
    std::error_code error;
    return output == "-" ||
           (std::filesystem::exists(output, error) && !std::filesystem::is_regular_file(output, error));
}

// ---- The passes -----------------------------------------------------------------------------------------------------

int fewest_passes(const Options& options, const EncoderOptions& settings) {
    if (!(settings.rate.bits_per_second > 0)) return 1;
    if (options.encoding.passes > 0) return options.encoding.passes;
    return is_piped(options.capture) ? 1 : 2;
}

// Whether another pass can come nearer to the rate.
bool is_off(const RateReport& rate, double bits, double seconds) {
    const double error = bits / seconds / rate.bits_per_second - 1;
    const auto quality = quality_range(rate);
    if (error > 0) return error > rate_tolerance && quality.highest > 0;
    constexpr double full = 85;  // percent: then it is the buffer that keeps the rate down
    return error < -rate_tolerance && quality.lowest < 100 && rate.buffer.peak_percent() < full;
}

Result<void> encode(const Options& options) {
    watch_for_interruption();
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    auto settings = encoder_options(options.encoding, *capture);
    if (!settings) return tl::unexpected(settings.error());
    if (!is_given(options.encoding, "session") && may_be_live(options.output)) settings->session = random_session();
    const int fewest = fewest_passes(options, *settings);
    // What went to a pipe cannot be taken back.
    const int most = options.encoding.passes == 0 && fewest == 2 && !may_be_live(options.output) ? most_passes : fewest;
    std::optional<RatePasses> passes;
    for (int number = 1;; ++number) {
        // Before the first pass, so that a place that cannot be written to does not cost one.
        auto output = StreamOutput::open(options.output);
        if (!output) return tl::unexpected(output.error());
        auto encoder = Encoder::create(*settings);
        if (!encoder) return tl::unexpected(encoder.error());
        Summary summary;
        RateReport rate(*settings);
        const bool writes = number >= fewest;
        {
            const auto name = most == 1 ? std::string("encoding") : fmt::format("pass {}", number);
            Pass pass{options, *capture, *encoder, writes ? &*output : nullptr, rate, name, summary};
            pass.is_first_to_write = number == fewest;
            if (auto ok = encode_frames(pass); !ok) return writes ? ended_early(pass, ok.error()) : ok;
        }
        const double seconds = seconds_of(summary, capture->fps());
        if (!writes || (number < most && is_off(rate, 8.0 * static_cast<double>(output->bytes()), seconds))) {
            if (!passes) passes.emplace(rate.bits_per_second * seconds);
            passes->add(std::move(rate.costs));
            settings->rate.first_pass = passes->expected();
            capture->rewind();
            continue;
        }
        if (summary.totals.all().frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
        if (auto finished = output->finish(); !finished) return finished;
        report(options, summary, rate, output->bytes(), capture->fps(), capture->dropped());
        if (rate.dropped.empty()) return {};
        return fail(
            ErrorKind::limit,
            fmt::format("{} is complete but for {} of {} frames, which did not fit into the buffer; give a higher "
                        "--bitrate or a larger --buffer",
                        options.output, rate.dropped.size(), rate.costs.size()));
    }
}

}  // namespace

Result<void> encode_by_default(const std::vector<std::string>& inputs, const std::string& output) {
    Options options;
    options.capture.inputs = inputs;
    options.output = output;
    options.keep_partial = false;
    return encode(options);
}

void add_encode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("encode", "Compress a sequence of meshes into an .htvm stream");
    add_capture_options(*command, options->capture);
    command->add_option("-o,--output", options->output, "The stream: a file, or - for standard output")
        ->type_name("FILE")
        ->required();
    add_encoding_options(*command, options->encoding);
    command
        ->add_option(
            "--on-bad-frame", options->on_bad_frame,
            "What becomes of a frame that cannot be read or coded: stop (default), skip, or repeat, the frame\n"
            "before once more. Its time is kept. With skip and repeat, frames without triangles are bad too")
        ->check(CLI::IsMember({"stop", "skip", "repeat"}));
    command->add_flag(
        "--fill", options->fill,
        "Where the numbers of the files leave some out, repeat the frame before (default: a gap in time)");
    command->add_flag("--drop-late", options->capture.drop_late,
                      "Of meshes on standard input that come faster than they are encoded, drop the oldest that wait,\n"
                      "so that a camera never has to (default: the sender waits)");
    command->add_flag("--json", options->json, "Print sizes by frame and layer as JSON on standard output");
    command->add_flag_callback(
        "--help-options",
        [] {
            fmt::print("{}", options_in_markdown());
            throw CLI::Success();
        },
        "Print all options of the library with their ranges, as docs/options.md has them, and exit");
    command->footer(
        "Examples:\n"
        "  htvm encode capture/ --skeleton capture/skeleton.json -o person.htvm\n"
        "  htvm encode scan_*.obj -q 60 --keyint 60 -o person.htvm\n"
        "  htvm encode capture/ --profile topology -s capture/skeleton.json -o exact.htvm\n"
        "  htvm encode capture/ --bitrate 6 --buffer 0.5 -o person.htvm\n"
        "  rig --ply | htvm encode - --bitrate 8 -o - | nc host 9000");
    show_first(*command, {"--skeleton", "--output", "--fps", "--unit", "--height", "--frames", "--first", "--quality",
                          "--profile", "--bitrate", "--keyint", "--on-bad-frame", "--threads", "--json"});
    command->callback([options, &run] {
        check_together(options->encoding);
        if (options->output == "-" && options->json)
            throw CLI::ValidationError("--json", "prints on standard output, where -o - puts the stream; choose one");
        if (options->capture.drop_late && !is_piped(options->capture))
            throw CLI::ValidationError("--drop-late", "is for meshes on standard input: files can wait");
        if (options->encoding.passes == 2 && is_piped(options->capture))
            throw CLI::ValidationError(
                "--passes",
                "2 reads the capture twice, which standard input does not allow; give files, or --passes 1");
        run = [options] { return encode(*options); };
    });
}

}  // namespace htvm::app
