// htvm encode: meshes and a skeleton in, a stream out.
#include "encode.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/thread.h"
#include "effort_log.h"
#include "encode_jobs.h"
#include "encode_pass.h"
#include "htvm/running_time.hpp"
#include "io/output_file.h"
#include "job_options.h"
#include "line_rate.h"
#include "live/client/hub_address.h"
#include "rate_passes.h"
#include "rate_report.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

// How long the capture's frames last, coded or not.
double seconds_of(const Summary& summary, double fps) {
    return seconds_of_frames(summary.first_us, summary.last_us, std::max<std::size_t>(summary.frames, 1), 1 / fps);
}

// ---- What is said of it ---------------------------------------------------------------------------------------------

nlohmann::json pictures_json(const EncodeOptions& options, const PictureTotals& pictures, double seconds) {
    const bool keep = options.capture.texture_as == "keep";
    nlohmann::json out = {{"coder", keep ? "files" : options.pictures.codec},
                          {"pictures", pictures.pictures},
                          {"key_pictures", pictures.key_pictures},
                          {"bytes", pictures.bytes},
                          {"megabits_per_second", 8e-6 * static_cast<double>(pictures.bytes) / seconds},
                          {"draw_seconds", pictures.baking_seconds},
                          {"encode_seconds", pictures.seconds}};
    return out;
}

std::string pictures_text(const EncodeOptions& options, const PictureTotals& pictures, double seconds) {
    const bool keep = options.capture.texture_as == "keep";
    auto out = fmt::format("of this {:.2f} Mbit/s are {}", 8e-6 * static_cast<double>(pictures.bytes) / seconds,
                           counted(pictures.pictures, keep ? "image file" : "picture"));
    const auto each_second = [&](double in) { return static_cast<double>(pictures.pictures) / std::max(in, 1e-9); };
    if (!keep) out += fmt::format(", {} of them key pictures, ", pictures.key_pictures);
    if (pictures.baking_seconds > 0) out += fmt::format("drawn at {:.1f}, ", each_second(pictures.baking_seconds));
    if (!keep) out += fmt::format("coded at {:.1f} a second", each_second(pictures.seconds));
    return out;
}

nlohmann::json json_of(const std::vector<ListedFrame>& list) {
    auto out = nlohmann::json::array();
    for (const auto& frame : list) {
        out.push_back(frame_json(frame.info));
        if (frame.quality) out.back()["quality"] = *frame.quality;
    }
    return out;
}

void report(const EncodeOptions& options, const Summary& summary, const RateReport& rate, std::uint64_t bytes,
            double fps, std::size_t dropped_late, const Publishing* hub = nullptr, const Deadline* deadline = nullptr) {
    const auto frames = summary.totals.all().frames;
    const double seconds = seconds_of(summary, fps);
    const double megabits = 8e-6 * static_cast<double>(bytes);
    const auto not_sent = hub ? hub->state().dropped_frames : 0;
    if (options.json) {
        nlohmann::json out = {{"output", options.output},
                              {"bytes", bytes},
                              {"frames", json_of(summary.list)},
                              {"left_out_frames", summary.left_out},
                              {"repeated_frames", summary.repeated},
                              {"missing_frames", summary.missing},
                              {"filled_frames", summary.filled},
                              {"dropped_late_frames", dropped_late},
                              {"megabits_per_second", megabits / seconds},
                              {"encode_frames_per_second", static_cast<double>(frames) / summary.encode_seconds}};
        if (hub) out["not_sent_frames"] = not_sent;
        if (keeps_pictures(options.capture)) out["pictures"] = pictures_json(options, summary.pictures, seconds);
        if (rate.controlled()) out["control"] = rate_json(rate, bytes, seconds);
        if (deadline) out["pace"] = deadline_json(*deadline);
        fmt::print("{}\n", out.dump(2));
    } else {
        tell(layer_table(summary.totals));
        note(fmt::format("{}: {}, {} bytes, {:.2f} Mbit/s at {:g} fps, encoded at {:.1f} frames/s",
                         shown_place(options.output), counted(frames, "frame"), bytes, megabits / seconds, fps,
                         static_cast<double>(frames) / summary.encode_seconds));
        if (keeps_pictures(options.capture)) note(pictures_text(options, summary.pictures, seconds));
        if (rate.controlled()) note(rate_summary(rate, bytes, seconds));
        if (deadline) note(deadline_summary(*deadline));
    }
    if (dropped_late > 0)
        warn(fmt::format(
            "{} of {} came faster than they were encoded, and were dropped; a lower -q or --bitrate is faster",
            dropped_late, counted(summary.frames + dropped_late, "frame")));
    if (not_sent > 0)
        warn(fmt::format(
            "the line did not take {} of {} in time, and they were not sent; a lower --bitrate or -q fits it", not_sent,
            counted(frames, "frame")));
    if (const auto strain = rate_warning(rate); !strain.empty()) warn(strain);
    if (deadline)
        if (const auto late = deadline_warning(*deadline, {is_piped(options.capture), options.drop_late});
            !late.empty())
            warn(late);
    if (dropped_late > 0 && !options.effort_log.empty())
        warn(fmt::format("{} repeats this run of the meshes alone that were kept", options.effort_log));
    if (summary.without_triangles > 0)
        warn(fmt::format("{} of {} no triangles; see that the files hold meshes", summary.without_triangles,
                         counted(frames, "frame") + (summary.without_triangles == 1 ? " has" : " have")));
    if (summary.left_out > 0) warn(counted(summary.left_out, "bad frame") + " left out");
    if (summary.repeated > 0) warn(counted(summary.repeated, "bad frame") + " replaced by the frame before");
}

// Why an encoding ended early, and what is left of it.
tl::unexpected<Error> ended_early(Pass& pass, StreamOutput& output, const Error& error) {
    if (auto* hub = output.publishing()) {
        if (finish(pass)) (void)hub->finish();  // of the two errors, the first says why
        return tl::unexpected(error);
    }
    if (pass.summary.totals.all().frames == 0 || !pass.options.keep_partial) return tl::unexpected(error);
    const bool whole = finish(pass).has_value();
    const auto frames = pass.summary.totals.all().frames;
    const auto kept = output.keep();
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

// A stream that goes to a hub, a pipe or a device may be live: a session keeps it apart from a run before.
bool may_be_live(const std::string& output) {
    std::error_code error;
    return output == "-" || live::looks_like_hub_address(output) ||
           (std::filesystem::exists(output, error) && !std::filesystem::is_regular_file(output, error));
}

// ---- The passes -----------------------------------------------------------------------------------------------------

// Whether frames go by a clock, or by the log of a run that did.
bool is_paced(const EncodeOptions& options) {
    return options.deadline > 0 || !options.effort_log.empty() || !options.repeat_efforts.empty();
}

int fewest_passes(const EncodeOptions& options, const EncoderOptions& settings) {
    if (!(settings.rate.bits_per_second > 0) || is_paced(options)) return 1;
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

// What a skeleton would do, or a better first frame, where motion follows the bones.
void note_bones(const EncodeOptions& options, const EncoderOptions& settings) {
    if (settings.profile == Profile::tracked) return;
    if (settings.skeleton.bones.empty())
        note(
            fmt::format("no skeleton given: one bone that spans the mesh stands in, which costs bits with --profile {} "
                        "(see --skeleton)",
                        options.encoding.profile));
    else if (settings.radii.empty())
        note("bone radii are calibrated on the first frame; a T-pose is best (see htvm calibrate)");
}

// How many groups a capture makes, of all jobs.
std::string groups_text(const EncodeOptions& options, int key_interval, std::size_t frames) {
    const auto made_of = counted(frames, "frame") + (frames == 1 ? " makes" : " make");
    if (options.chunks > 1) return fmt::format("{} {}", made_of, counted(std::min(options.chunks, frames), "chunk"));
    const auto of_group = frames_of_group(key_interval);
    return fmt::format("{} {} of {}{}", made_of, counted((frames + of_group - 1) / of_group, "group"), of_group,
                       of_group > static_cast<std::size_t>(key_interval)
                           ? fmt::format(" (whole multiples of --keyint, of at least {})", least_of_group)
                           : "");
}

// Each group of frames by an encoder of its own. A job that has nothing to do leaves no file.
Result<void> encode_in_groups(const EncodeOptions& options, Capture& capture, const EncoderOptions& settings,
                              const std::optional<AudioTrack>& audio) {
    const auto groups = groups_of(options, settings.key_interval, capture.frames());
    const auto have = groups_text(options, settings.key_interval, capture.frames());
    if (groups.empty()) {
        std::error_code error;
        if (std::filesystem::is_regular_file(options.output, error))
            return fail(ErrorKind::bad_input, fmt::format("job {} of {} has nothing to do, as {}, but {} is there: "
                                                          "remove it, so that it is not joined with the others",
                                                          options.job.number, options.job.of, have, options.output));
        note(fmt::format("job {} of {} has nothing to do, and writes nothing: {}", options.job.number, options.job.of,
                         have));
        return {};
    }
    if (options.jobs > groups.size()) note(fmt::format("{}: as many jobs are enough", have));
    if (options.chunks > groups.size()) note(have);
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    if (audio) output->lay(*audio);
    note_bones(options, settings);
    Summary summary;
    RateReport rate(settings);
    if (auto done = encode_groups(options, settings, capture, groups, *output, summary, rate); !done)
        return may_be_live(options.output)
                   ? done
                   : fail(done.error().kind, fmt::format("{}; nothing is written", done.error().message));
    if (summary.totals.all().frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
    if (summary.bounds) output->add_bounds(*summary.bounds);
    if (auto finished = output->finish(); !finished) return finished;
    report(options, summary, rate, output->bytes(), capture.fps(), 0);
    return {};
}

// Of --repeat-efforts; nothing without it.
Result<std::optional<EffortLog>> efforts_to_repeat(const EncodeOptions& options, const Capture& capture) {
    if (options.repeat_efforts.empty()) return std::nullopt;
    auto log = read_effort_log(options.repeat_efforts);
    if (!log) return tl::unexpected(log.error());
    // Of a pipe nobody knows how many come, nor of files which of them can be read.
    const bool all = !is_piped(options.capture) && options.on_bad_frame != "skip";
    if (all && log->frames.size() < capture.frames())
        return fail(ErrorKind::bad_input,
                    too_few_efforts(options.repeat_efforts, log->frames.size(), std::to_string(capture.frames())));
    return std::optional(std::move(*log));
}

// A log takes the place of another one, as it may be of an earlier run; but not of what this run reads.
Result<void> check_effort_log(const EncodeOptions& options, const Capture& capture) {
    if (options.effort_log.empty()) return {};
    std::vector<std::filesystem::path> read = capture.files();
    for (const auto& file : {options.capture.skeleton, options.capture.timestamps, options.encoding.radii_file,
                             options.audio.file, options.repeat_efforts})
        if (!file.empty()) read.emplace_back(file);
    std::error_code ignored;
    for (const auto& file : read)
        if (std::filesystem::equivalent(options.effort_log, file, ignored))
            return fail(ErrorKind::bad_input,
                        fmt::format("--effort-log {} would replace {}, which is read: give the log another name",
                                    options.effort_log, file.string()));
    return {};
}

// One run after another, until the bitrate is met. log: takes the efforts of the last one; null: nobody asked for them.
Result<void> encode_in_passes(const EncodeOptions& options, Capture& capture, EncoderOptions settings,
                              const std::optional<AudioTrack>& audio, const std::vector<LoggedFrame>& efforts,
                              EffortLogWriter* log) {
    const int fewest = fewest_passes(options, settings);
    // What went to a pipe cannot be taken back.
    const int most = options.encoding.passes == 0 && fewest == 2 && !may_be_live(options.output) ? most_passes : fewest;
    std::optional<RatePasses> passes;
    // Meshes and pictures share the rate.
    const auto of_all = settings;
    const bool has_pictures = keeps_pictures(options.capture);
    if (has_pictures) settings.rate.bits_per_second *= share_of_meshes;
    for (int number = 1;; ++number) {
        // Before the first pass, so that a place that cannot be written to does not cost one.
        auto output = StreamOutput::open(options.output, options.publishing);
        if (!output) return tl::unexpected(output.error());
        auto* hub = output->publishing();
        if (!is_piped(options.capture)) output->pace();
        if (audio) output->lay(*audio);
        auto encoder = Encoder::create(settings);
        if (!encoder) return tl::unexpected(encoder.error());
        if (number == 1) note_bones(options, settings);
        Summary summary;
        RateReport rate(of_all);
        Deadline deadline(options.deadline, settings.tracked.effort);
        const bool timed = options.deadline > 0 || log || !efforts.empty() ||
                           (is_piped(options.capture) && settings.profile == Profile::tracked);
        const bool writes = number >= fewest;
        {
            Progress progress(most == 1 ? "encoding" : fmt::format("pass {}", number), capture.frames());
            FrameWarnings warnings;
            Pass pass{
                .options = options,
                .capture = capture,
                .encoder = *encoder,
                .write = {},
                .step = [&](const std::string& text) { progress.step(hub ? text + ", " + hub->progress() : text); },
                .is_stopped = [] { return interruption() != 0; },
                .warnings = number == fewest ? &warnings : nullptr,
                .summary = summary,
                .rate = rate};
            auto pictures = picture_track(options, capture, settings);
            if (!pictures) return tl::unexpected(pictures.error());
            if (*pictures) pass.pictures = &**pictures;
            if (timed) pass.deadline = &deadline;
            pass.efforts = efforts;
            pass.effort_log = log;
            if (writes) pass.write = [&](const Packet& packet) { return output->write(packet); };
            pass.held_back = [&] { return output->held_back(); };
            if (hub) pass.wants_key_frame = [hub] { return hub->wants_key_frame(); };
            if (hub && rate.rate_controlled() && !options.publishing.fixed_bitrate)
                pass.bitrate = [hub, line = LineRate(rate.bits_per_second)]() mutable {
                    return line.follow(hub->line());
                };
            auto done = encode_frames(pass);
            if (!done) return writes ? ended_early(pass, *output, done.error()) : done;
            if (done = finish(pass); !done) return done;
            if (*pictures) summary.pictures = (*pictures)->totals();
        }
        const double seconds = seconds_of(summary, capture.fps());
        if (!writes ||
            (number < most && !has_pictures && is_off(rate, 8.0 * static_cast<double>(output->bytes()), seconds))) {
            if (!passes) passes.emplace(settings.rate.bits_per_second * seconds);
            passes->add(std::move(rate.costs));
            settings.rate.first_pass = passes->expected();
            capture.rewind();
            continue;
        }
        if (summary.totals.all().frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
        if (summary.bounds) output->add_bounds(*summary.bounds);
        if (auto finished = output->finish(); !finished) return finished;
        report(options, summary, rate, output->bytes(), capture.fps(), capture.dropped(), hub,
               timed ? &deadline : nullptr);
        if (log)
            if (auto finished = log->finish(); !finished) return finished;
        if (rate.dropped.empty()) return {};
        return fail(
            ErrorKind::limit,
            fmt::format("{} is complete but for {} of {} frames, which did not fit into the buffer; give a higher "
                        "--bitrate or a larger --buffer",
                        options.output, rate.dropped.size(), rate.costs.size()));
    }
}

// By the clock, or by the log of a run that went by it.
Result<void> encode_in_one(const EncodeOptions& options, Capture& capture, EncoderOptions settings,
                           const std::optional<AudioTrack>& audio) {
    const auto repeated = efforts_to_repeat(options, capture);
    if (!repeated) return tl::unexpected(repeated.error());
    const auto efforts = *repeated ? (*repeated)->frames : std::vector<LoggedFrame>{};
    if (*repeated) settings.tracked.effort = (*repeated)->asked;
    if (options.effort_log.empty())
        return encode_in_passes(options, capture, std::move(settings), audio, efforts, nullptr);
    auto log = EffortLogWriter::create(options.effort_log, settings.tracked.effort);
    if (!log) return tl::unexpected(log.error());
    auto done = encode_in_passes(options, capture, std::move(settings), audio, efforts, &*log);
    if (done) return done;
    const auto kept = log->keep();
    return kept.empty() ? done
                        : fail(done.error().kind, fmt::format("{}; the efforts of frames up to there are in {}",
                                                              done.error().message, kept.string()));
}

// What can become of a capture's pictures.
void check_pictures(const EncodeOptions& options, const CLI::App& command) {
    const auto& as = options.capture.texture_as;
    for (const char* flag : {"--texture-size", "--texture-codec", "--texture-quality"})
        if (command.count(flag) > 0 && as != "captured" && as != "picture")
            throw CLI::ValidationError(flag,
                                       "is for pictures that are coded as video: add --texture-as picture or captured");
    if (!keeps_pictures(options.capture)) return;
    const bool tracked = options.encoding.profile == "tracked";
    if (tracked && as != "picture")
        throw CLI::ValidationError("--texture-as",
                                   as + " keeps every frame's own texture coordinates, which --profile tracked does "
                                        "not: add --profile topology, or give picture");
    if (!tracked && as == "picture")
        throw CLI::ValidationError("--texture-as",
                                   "picture is drawn on a mesh that lasts, as --profile tracked makes it; with other "
                                   "profiles give captured");
    if (options.capture.texture.files == "none")
        throw CLI::ValidationError("--texture", "none leaves no images for --texture-as " + as);
    if (as == "picture" && options.in_groups() && options.chunks == 1)
        throw CLI::ValidationError("--texture-as",
                                   "picture goes through the capture in one, as each frame's is drawn over the one "
                                   "before; not with --jobs or --job, but with --chunks");
    const bool rate = is_given(options.encoding, "rate.bits_per_second");
    if (rate && as == "keep")
        throw CLI::ValidationError("--texture-as",
                                   "keep leaves image files as large as they are, which no --bitrate can change; "
                                   "captured codes them as video");
    if (rate && options.pictures.quality)
        throw CLI::ValidationError("--texture-quality", "follows from --bitrate; give one of the two");
}

// Whether somebody waits for each frame, so that a group's packets, which come with its last one, would be late.
bool may_not_wait(const EncodeOptions& options) {
    return live::looks_like_hub_address(options.output) || options.deadline > 0;
}

void check_waiting(const EncodeOptions& options) {
    if (given_value(options.encoding, "tracked.group").value_or(0) > 1 && may_not_wait(options))
        throw CLI::ValidationError("--group", options.deadline > 0
                                                  ? "holds frames back, beyond any --deadline: give one of the two"
                                                  : "holds frames back, which who watches live would wait for: it is "
                                                    "for files, not for a hub");
    if (given_value(options.encoding, "latency_frames").value_or(0) > 0 && options.deadline > 0)
        throw CLI::ValidationError("--latency-frames",
                                   "lets a frame wait for the next one, while --deadline counts the time until it is "
                                   "coded: give one of them");
    if (std::isnan(options.deadline)) throw CLI::ValidationError("--deadline", "is a number of milliseconds, not nan");
}

// What goes with the clock, frame after frame.
void check_pace(const EncodeOptions& options) {
    const char* flag = options.deadline > 0              ? "--deadline"
                       : !options.effort_log.empty()     ? "--effort-log"
                       : !options.repeat_efforts.empty() ? "--repeat-efforts"
                                                         : nullptr;
    if (!flag) return;
    if (options.encoding.profile != "tracked")
        throw CLI::ValidationError(flag, "is for --profile tracked: the others have no efforts");
    if (options.in_groups())
        throw CLI::ValidationError(
            flag, std::string("goes frame by frame through the capture, not with ") + job_option(options));
    if (options.encoding.passes == 2)
        throw CLI::ValidationError(flag, "goes with one pass over the frames, not with --passes 2");
}

// Whether both names are of one file, which need not be there yet.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code error;
    if (std::filesystem::equivalent(a, b, error)) return true;
    const auto place = [&error](const std::filesystem::path& path) {
        return std::filesystem::weakly_canonical(std::filesystem::absolute(path, error), error);
    };
    return place(a) == place(b);
}

void check_log_and_output(const EncodeOptions& options) {
    if (options.effort_log.empty() || live::looks_like_hub_address(options.output)) return;
    // Until they are whole, both are under other names, which may be taken as little.
    const std::string output = options.output == "-" ? "/dev/stdout" : options.output;
    for (const char* until_whole : {"", ".partial"})
        if (is_same_file(options.effort_log, output + until_whole) ||
            is_same_file(options.effort_log + until_whole, output))
            throw CLI::ValidationError(
                "--effort-log",
                fmt::format("{} is where -o puts the stream: give the log another name", options.effort_log));
}

// What the sequence header says of a capture's pictures, and how often they can be started at.
Result<void> set_texture(const EncodeOptions& options, const Capture& capture, EncoderOptions& settings) {
    if (!keeps_pictures(options.capture)) return {};
    const auto* first = capture.first_textured();
    if (!first) return fail(ErrorKind::bad_input, "the capture's first mesh has no texture");
    const bool bake = options.capture.texture_as == "picture";
    settings.texture.layout = bake ? TextureLayout::charts : TextureLayout::captured;
    const auto& image = *first->texture;
    const int size = options.capture.texture_as == "keep" ? 0 : options.pictures.size;
    constexpr long least = 16;
    if (bake) {
        settings.texture.width = settings.texture.height = size > 0 ? size : picture_side_for(*first);
        note(fmt::format("pictures have {0} x {0} pixels{1}", settings.texture.width,
                         size > 0 ? "" : "; --texture-size sets others"));
    } else {
        const double scale = size > 0 ? static_cast<double>(size) / std::max(image.width, image.height) : 1;
        settings.texture.width = static_cast<int>(std::max(least, std::lround(scale * image.width)));
        settings.texture.height = static_cast<int>(std::max(least, std::lround(scale * image.height)));
    }
    // A key picture takes as many bits as a second of others.
    constexpr int frames_between_key_pictures = 90;
    if (bake && !is_given(options.encoding, "tracked.access_interval"))
        settings.tracked.access_interval = frames_between_key_pictures;
    return {};
}

}  // namespace

Result<void> encode(const EncodeOptions& options) {
    watch_for_interruption();
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    if (auto may_log = check_effort_log(options, *capture); !may_log) return may_log;
    auto settings = encoder_options(options.encoding, *capture);
    if (!settings) return tl::unexpected(settings.error());
    if (auto set = set_texture(options, *capture, *settings); !set) return set;
    // A run and its repetition make the same of an effort.
    if (settings->tracked.group == 0 && (may_not_wait(options) || is_paced(options))) settings->tracked.group = 1;
    // Nobody waits for the frames of a file.
    if (!is_given(options.encoding, "latency_frames") && !is_piped(options.capture) && !may_be_live(options.output) &&
        options.deadline == 0 && options.effort_log.empty())
        settings->latency_frames = 1;
    const bool drawn = !is_given(options.encoding, "session") && options.job.of == 0 && may_be_live(options.output);
    if (drawn) settings->session = random_session();
    const auto audio = AudioTrack::open(options.audio);
    if (!audio) return tl::unexpected(audio.error());
    return options.in_groups() ? encode_in_groups(options, *capture, *settings, *audio)
                               : encode_in_one(options, *capture, std::move(*settings), *audio);
}

void add_encode(CLI::App& app, Run& run) {
    auto options = std::make_shared<EncodeOptions>();
    auto* command = app.add_subcommand("encode", "Compress a sequence of meshes into an .htvm stream");
    add_capture_options(*command, options->capture);
    command
        ->add_option(
            "-o,--output", options->output,
            "The stream: a file, - for standard output, or a hub, for others to watch it while it is encoded:\n"
            "ws://HOST:PORT/publish/NAME, or wss:// with TLS")
        ->type_name("FILE")
        ->required();
    constexpr const char* hubs = "Hubs";
    command
        ->add_option("--other-hub", options->publishing.other_hubs,
                     "Where to go on if the hub is lost, another address (repeatable)")
        ->type_name("URL")
        ->allow_extra_args(false)
        ->group(hubs);
    add_publishing_options(*command, options->publishing, hubs);
    command
        ->add_flag("--fixed-bitrate", options->publishing.fixed_bitrate,
                   "Keep to --bitrate where the hub's line does not carry it, and drop frames instead (default: less\n"
                   "is sent while it does not)")
        ->group(hubs);
    add_audio_options(*command, options->audio);
    add_texture_picture_options(*command, options->pictures);
    add_encoding_options(*command, options->encoding);
    command
        ->add_option(
            "--on-bad-frame", options->on_bad_frame,
            "What becomes of a frame that cannot be read or coded: stop (default), skip, or repeat, the frame\n"
            "before once more. Its time is kept. With skip and repeat, frames without triangles are bad too, each\n"
            "is told, and the exit code is 0. On standard input only behind a mesh that came whole")
        ->check(CLI::IsMember({"stop", "skip", "repeat"}));
    command->add_flag(
        "--fill", options->fill,
        "Where the numbers of the files leave some out, repeat the frame before (default: a gap in time)");
    command->add_flag("--drop-late", options->drop_late,
                      "Of meshes on standard input that come faster than they are encoded, drop the oldest that wait,\n"
                      "so that a camera never has to (default: the sender waits). A warning says how many were, and\n"
                      "the exit code is 0, as they were dropped by wish");
    constexpr const char* pace = "A camera's pace";
    command
        ->add_option("--deadline", options->deadline,
                     "Milliseconds from when a mesh is there to when its packet is: where a frame would be late, less\n"
                     "is searched for it (see --effort), at last its motion alone is coded, and lost tracking is\n"
                     "repaired in a later one; no frame is left out. How many were late or got less is said at the\n"
                     "end, and --effort-log has it all. Frames are then coded one by one: not with --latency-frames,\n"
                     "--group, --passes 2, --chunks, --jobs or another --profile")
        ->check(CLI::Range(1.0, 60000.0))
        ->type_name("MS")
        ->group(pace);
    command
        ->add_option("--effort-log", options->effort_log,
                     "Write what was decided of each frame, and how long it took, as lines of CSV, while frames are\n"
                     "encoded: in FILE.partial until all are there, where an encode that ends early leaves them. An\n"
                     "earlier log is replaced, other files are not")
        ->type_name("FILE")
        ->check([](const std::string& file) {
            return file.empty() || file == "-" ? std::string("is a file's name, as efforts.csv") : std::string();
        })
        ->group(pace);
    command
        ->add_option("--repeat-efforts", options->repeat_efforts,
                     "Take the effort of each frame from such a log, not from the clock: the same bytes again, if\n"
                     "the other options are the same. --effort is in the log")
        ->type_name("FILE")
        ->group(pace)
        ->excludes("--deadline")
        ->excludes("--effort");
    add_job_options(*command, *options);
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
        "  htvm encode capture/ -o person.htvm\n"
        "  htvm encode scan_*.obj -q 60 --keyint 60 -o person.htvm\n"
        "  htvm encode capture/ --profile topology -s capture/skeleton.json -o exact.htvm\n"
        "  htvm encode capture/ --bitrate 6 --buffer 0.5 -o person.htvm\n"
        "  htvm encode capture/ --jobs 8 -o person.htvm\n"
        "  rig --ply | htvm encode - --bitrate 8 --drop-late -o wss://hub.example/publish/person");
    show_first(*command, {"--skeleton",   "--output",       "--fps",       "--unit",    "--height",  "--texture",
                          "--texture-as", "--audio",        "--frames",    "--first",   "--quality", "--effort",
                          "--deadline",   "--effort-log",   "--drop-late", "--profile", "--bitrate", "--buffer",
                          "--keyint",     "--on-bad-frame", "--threads",   "--chunks",  "--jobs",    "--json"});
    command->callback([options, command, &run] {
        check_together(options->encoding);
        const auto sessions = command->get_option("--session")->results();
        check_pictures(*options, *command);
        check_jobs(*options, !sessions.empty() && sessions[0] == "random");
        if (options->publishing.fixed_bitrate &&
            !(live::looks_like_hub_address(options->output) && is_given(options->encoding, "rate.bits_per_second")))
            throw CLI::ValidationError("--fixed-bitrate", "does nothing without a --bitrate and a hub to publish to");
        if (options->output == "-" && options->json)
            throw CLI::ValidationError("--json", "prints on standard output, where -o - puts the stream; choose one");
        if (options->drop_late && !is_piped(options->capture))
            throw CLI::ValidationError("--drop-late", "is for meshes on standard input: files can wait");
        options->capture.while_busy = options->drop_late      ? WhileBusy::drop
                                      : options->deadline > 0 ? WhileBusy::read_on
                                                              : WhileBusy::wait;
        check_pace(*options);
        check_log_and_output(*options);
        check_waiting(*options);
        if (options->encoding.passes == 2 && is_piped(options->capture))
            throw CLI::ValidationError(
                "--passes",
                "2 reads the capture twice, which standard input does not allow; give files, or --passes 1");
        if (options->chunks == 0) options->chunks = internal::thread_count(0);
        run = [options] { return encode(*options); };
    });
}

}  // namespace htvm::app
