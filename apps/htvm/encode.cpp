// htvm encode: meshes and a skeleton in, a stream out.
#include "encode.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "effort_log.h"
#include "encode_jobs.h"
#include "encode_pass.h"
#include "encode_settings.h"
#include "htvm/running_time.hpp"
#include "rate_passes.h"
#include "rate_report.h"
#include "rate_sharing.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

// How long the capture's frames last, coded or not.
double seconds_of(const Summary& summary, double fps) {
    return seconds_of_frames(summary.first_us, summary.last_us, std::max<std::size_t>(summary.frames, 1), 1 / fps);
}

// ---- What is said of it ---------------------------------------------------------------------------------------------

nlohmann::json pictures_json(const EncodePlan& plan, const PictureTotals& pictures, double seconds) {
    const bool keep = plan.capture.texture_as == TextureAs::keep;
    const auto codec = plan.pictures.codec.value_or(PictureCoder::av1);
    nlohmann::json out = {{"coder", keep ? "files" : word_of(codec, video_codecs)},
                          {"pictures", pictures.pictures},
                          {"key_pictures", pictures.key_pictures},
                          {"bytes", pictures.bytes},
                          {"megabits_per_second", 8e-6 * static_cast<double>(pictures.bytes) / seconds},
                          {"draw_seconds", pictures.baking_seconds},
                          {"encode_seconds", pictures.seconds}};
    return out;
}

std::string pictures_text(const EncodePlan& plan, const PictureTotals& pictures, double seconds) {
    const bool keep = plan.capture.texture_as == TextureAs::keep;
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

// Why frames say what of the surface is there, and what follows.
std::string presence_text(internal::Openness first) {
    using enum internal::Openness;
    const auto* why = first == bordered    ? "the first mesh has borders, as where depth cameras see a person: "
                      : first == in_pieces ? "the first mesh is in pieces, as where depth cameras see a person: "
                                           : "";
    return std::string(why) +
           "frames say what is there, holes that open for a moment are filled, specks are left out (--presence, "
           "--fill-holes, --specks)";
}

void report(const EncodePlan& plan, const Summary& summary, const RateReport& rate, std::uint64_t bytes, double fps,
            std::size_t dropped_late, const Publishing* hub = nullptr, const Deadline* deadline = nullptr) {
    const auto frames = summary.totals.all().frames;
    const double seconds = seconds_of(summary, fps);
    const double megabits = 8e-6 * static_cast<double>(bytes);
    const auto not_sent = hub ? hub->state().dropped_frames : 0;
    if (plan.json) {
        nlohmann::json out = {{"output", plan.output.place},
                              {"bytes", bytes},
                              {"frames", json_of(summary.list)},
                              {"reasons", reasons_json(summary.totals)},
                              {"left_out_frames", summary.left_out},
                              {"repeated_frames", summary.repeated},
                              {"missing_frames", summary.missing},
                              {"filled_frames", summary.filled},
                              {"dropped_late_frames", dropped_late},
                              {"megabits_per_second", megabits / seconds},
                              {"encode_frames_per_second", static_cast<double>(frames) / summary.encode_seconds}};
        if (hub) out["not_sent_frames"] = not_sent;
        if (keeps_pictures(plan.capture.texture_as)) out["pictures"] = pictures_json(plan, summary.pictures, seconds);
        if (rate.controlled()) out["control"] = rate_json(rate, bytes, seconds);
        if (deadline) out["pace"] = deadline_json(*deadline);
        fmt::print("{}\n", out.dump(2));
    } else {
        tell(layer_table(summary.totals) + reasons_text(summary.totals));
        if (summary.totals.all().bytes[Layer::presence] > 0) note(presence_text(summary.first_surface));
        note(fmt::format("{}: {}, {} bytes, {:.2f} Mbit/s at {:g} fps, encoded at {:.1f} frames/s",
                         shown_place(plan.output.place), counted(frames, "frame"), bytes, megabits / seconds, fps,
                         static_cast<double>(frames) / summary.encode_seconds));
        if (keeps_pictures(plan.capture.texture_as)) note(pictures_text(plan, summary.pictures, seconds));
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
        if (const auto late = deadline_warning(*deadline, {plan.is_piped, plan.drops_late}); !late.empty()) warn(late);
    if (dropped_late > 0 && !plan.effort_log.empty())
        warn(fmt::format("{} repeats this run of the meshes alone that were kept", plan.effort_log));
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
    if (pass.summary.totals.all().frames == 0 || !pass.plan.keep_partial) return tl::unexpected(error);
    (void)finish(pass);  // of the two errors, the first says why
    const auto frames = pass.summary.totals.all().frames;
    const auto kept = output.keep();
    std::string message = fmt::format("{}; {} encoded before", error.message,
                                      counted(frames, "frame") + (frames == 1 ? " was" : " were"));
    if (!kept.name.empty() && kept.frames >= frames)
        message += fmt::format(", now in {}, which is a whole stream: rename it to use it", kept.name);
    else if (!kept.name.empty())
        message += fmt::format(", the first {} of them now in {}, which is a whole stream: rename it to use it",
                               kept.frames, kept.name);
    std::error_code ignored;
    if (std::filesystem::is_regular_file(pass.plan.output.place, ignored))
        message += fmt::format(". {} is as it was", pass.plan.output.place);
    return fail(error.kind, message);
}

// ---- The passes -----------------------------------------------------------------------------------------------------

// Whether another pass can come nearer to the rate.
bool is_off(const RateReport& rate, double bits, double seconds) {
    const double error = bits / seconds / rate.bits_per_second - 1;
    const auto quality = quality_range(rate);
    if (error > 0) return error > rate_tolerance && quality.highest > 0;
    constexpr double full = 85;  // percent: then it is the buffer that keeps the rate down
    return error < -rate_tolerance && quality.lowest < 100 && rate.buffer.peak_percent() < full;
}

// What a skeleton would do, or a better first frame, where motion follows the bones.
void note_bones(const EncoderOptions& settings) {
    if (settings.profile == Profile::tracked) return;
    if (settings.skeleton.bones.empty())
        note(
            fmt::format("no skeleton given: one bone that spans the mesh stands in, which costs bits with --profile {} "
                        "(see --skeleton)",
                        profile_name(settings.profile)));
    else if (settings.radii.empty())
        note("bone radii are calibrated on the first frame; a T-pose is best (see htvm calibrate)");
}

// How many groups a capture makes, of all jobs.
std::string groups_text(const EncodePlan& plan, int key_interval, std::size_t frames) {
    const auto made_of = counted(frames, "frame") + (frames == 1 ? " makes" : " make");
    if (plan.chunks > 1) return fmt::format("{} {}", made_of, counted(std::min(plan.chunks, frames), "chunk"));
    const auto of_group = frames_of_group(key_interval);
    return fmt::format("{} {} of {}{}", made_of, counted((frames + of_group - 1) / of_group, "group"), of_group,
                       of_group > static_cast<std::size_t>(key_interval)
                           ? fmt::format(" (whole multiples of --keyint, of at least {})", least_of_group)
                           : "");
}

// Each group of frames by an encoder of its own. A job that has nothing to do leaves no file.
Result<void> encode_in_groups(const EncodePlan& plan, Capture& capture, const EncoderOptions& settings,
                              const std::optional<AudioTrack>& audio) {
    const auto groups = groups_of(plan, settings.key_interval, capture.frames());
    const auto have = groups_text(plan, settings.key_interval, capture.frames());
    if (groups.empty()) {
        std::error_code error;
        if (std::filesystem::is_regular_file(plan.output.place, error))
            return fail(ErrorKind::bad_input, fmt::format("job {} of {} has nothing to do, as {}, but {} is there: "
                                                          "remove it, so that it is not joined with the others",
                                                          plan.job.number, plan.job.of, have, plan.output.place));
        note(fmt::format("job {} of {} has nothing to do, and writes nothing: {}", plan.job.number, plan.job.of, have));
        return {};
    }
    if (plan.jobs > groups.size()) note(fmt::format("{}: as many jobs are enough", have));
    if (plan.chunks > groups.size()) note(have);
    auto output = StreamOutput::open(plan.output.place);
    if (!output) return tl::unexpected(output.error());
    if (audio) output->lay(*audio);
    note_bones(settings);
    Summary summary;
    RateReport rate(settings);
    if (auto done = encode_groups(plan, settings, capture, groups, *output, summary, rate); !done)
        return plan.output.may_be_live()
                   ? done
                   : fail(done.error().kind, fmt::format("{}; nothing is written", done.error().message));
    if (summary.totals.all().frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
    // All frames of a job may be empty, though the capture is not.
    if (summary.bounds) output->add_bounds(*summary.bounds);
    if (auto finished = output->finish(); !finished) return finished;
    report(plan, summary, rate, output->bytes(), capture.fps(), 0);
    return {};
}

// The log that --repeat-efforts names; nothing without it.
Result<std::optional<EffortLog>> efforts_to_repeat(const EncodePlan& plan, const Capture& capture) {
    if (plan.repeat_efforts.empty()) return std::nullopt;
    auto log = read_effort_log(plan.repeat_efforts);
    if (!log) return tl::unexpected(log.error());
    // Nobody knows how many frames come from a pipe, nor which files can be read where bad ones are skipped.
    const bool all = !plan.is_piped && plan.bad_frames != BadFrames::skip;
    if (all && log->frames.size() < capture.frames())
        return fail(ErrorKind::bad_input,
                    too_few_efforts(plan.repeat_efforts, log->frames.size(), std::to_string(capture.frames())));
    return std::optional(std::move(*log));
}

// A log takes the place of another one, as it may be of an earlier run; but not of what this run reads.
Result<void> check_effort_log(const EncodePlan& plan, const Capture& capture) {
    if (plan.effort_log.empty()) return {};
    std::vector<std::filesystem::path> read = capture.files();
    for (const auto& file :
         {plan.capture.skeleton, plan.capture.timestamps, plan.radii_file, plan.audio.file, plan.repeat_efforts})
        if (!file.empty()) read.emplace_back(file);
    std::error_code ignored;
    for (const auto& file : read)
        if (std::filesystem::equivalent(plan.effort_log, file, ignored))
            return fail(ErrorKind::bad_input,
                        fmt::format("--effort-log {} would replace {}, which is read: give the log another name",
                                    plan.effort_log, file.string()));
    return {};
}

// What the passes of a run have in common.
struct Passes {
    const EncodePlan& plan;
    Capture& capture;
    EncoderOptions settings;  // of the next pass
    const std::optional<AudioTrack>& audio;
    const std::vector<LoggedFrame>& efforts;  // that are repeated; empty: they are decided
    EffortLogWriter* log;                     // takes the efforts of the last pass; null: nobody asked for them
    // The quality of the next pass's pictures; nothing: as the plan says, or what a bitrate leaves them.
    std::optional<double> picture_quality = {};

    bool writes(int number) const { return number >= plan.fewest_passes; }
    bool are_timed() const { return plan.is_timed || !efforts.empty(); }
};

// What came of a pass.
struct Outcome {
    Summary summary;
    RateReport rate;
    Deadline deadline;
};

Result<StreamOutput> open_output(const Passes& passes) {
    auto output = StreamOutput::open(passes.plan.output.place, passes.plan.publishing);
    if (!output) return output;
    if (!passes.plan.is_piped) output->pace();
    if (passes.audio) output->lay(*passes.audio);
    output->set(SegmentOptions{.seconds = passes.plan.segment_seconds});
    return output;
}

// Codes all frames. What a pass that writes has made when it ends early is kept as far as it goes.
Result<void> run_pass(const Passes& passes, int number, StreamOutput& output, Outcome& out) {
    const auto& plan = passes.plan;
    auto encoder = Encoder::create(passes.settings);
    if (!encoder) return tl::unexpected(encoder.error());
    if (number == 1) note_bones(passes.settings);
    auto pictures = picture_track(plan, passes.capture, passes.settings, passes.picture_quality);
    if (!pictures) return tl::unexpected(pictures.error());
    auto* hub = output.publishing();
    Progress progress(plan.most_passes == 1 ? "encoding" : fmt::format("pass {}", number), passes.capture.frames());
    FrameWarnings warnings;
    Pass pass{.plan = plan,
              .capture = passes.capture,
              .encoder = *encoder,
              .write = {},
              .step = [&](const std::string& text) { progress.step(hub ? text + ", " + hub->progress() : text); },
              .is_stopped = [] { return interruption() != 0; },
              .warnings = number == plan.fewest_passes ? &warnings : nullptr,
              .summary = out.summary,
              .rate = out.rate};
    if (*pictures) pass.pictures = &**pictures;
    if (passes.are_timed()) pass.deadline = &out.deadline;
    pass.efforts = passes.efforts;
    pass.effort_log = passes.log;
    if (passes.writes(number)) pass.write = [&](const Packet& packet) { return output.write(packet); };
    pass.held_back = [&] { return output.held_back(); };
    if (hub) follow_hub(pass, *hub);
    if (auto done = encode_frames(pass); !done)
        return passes.writes(number) ? ended_early(pass, output, done.error()) : done;
    if (auto done = finish(pass); !done) return done;
    if (*pictures) out.summary.pictures = (*pictures)->totals();
    return {};
}

// Whether another pass follows: the first ones only learn, and later ones may miss the rate.
bool goes_on(const Passes& passes, int number, const Outcome& outcome, const StreamOutput& output) {
    if (!passes.writes(number)) return true;
    if (number >= passes.plan.most_passes) return false;
    return is_off(outcome.rate, 8.0 * static_cast<double>(output.bytes()),
                  seconds_of(outcome.summary, passes.capture.fps()));
}

// The end of the last pass: the stream and the log are there, and all is told.
Result<void> conclude(const Passes& passes, const Outcome& outcome, StreamOutput& output) {
    const auto& [summary, rate, deadline] = outcome;
    if (auto something = check_something_was_coded(passes.plan, summary); !something) return something;
    output.add_bounds(*summary.bounds);
    if (auto finished = output.finish(); !finished) return finished;
    report(passes.plan, summary, rate, output.bytes(), passes.capture.fps(), passes.capture.dropped(),
           output.publishing(), passes.are_timed() ? &deadline : nullptr);
    if (passes.log)
        if (auto finished = passes.log->finish(); !finished) return finished;
    if (const auto missed = missed_rate(rate, output.bytes(), seconds_of(summary, passes.capture.fps()));
        !missed.empty())
        return fail(ErrorKind::limit, fmt::format("{} is complete, but {}", passes.plan.output.place, missed));
    if (rate.dropped.empty()) return {};
    return fail(ErrorKind::limit,
                fmt::format("{} is complete but for {} of {} frames, which did not fit into the buffer; give a higher "
                            "--bitrate or a larger --buffer",
                            passes.plan.output.place, rate.dropped.size(), rate.costs.size()));
}

// How meshes and pictures share a bitrate, where several passes find it. In a single pass meshes have a fixed share,
// and pictures what they leave.
class SharedRate {
public:
    // Begins with the fixed share.
    explicit SharedRate(Passes& passes) : passes_(passes), of_all_(passes.settings.rate.bits_per_second) {
        passes_.settings.rate.bits_per_second *= share_of_meshes;
    }
    // Behind a pass: decides what the next one gives to meshes and pictures. false: there need be none.
    bool plan_next(bool wrote, const Outcome& outcome, std::uint64_t bytes, double seconds) {
        if (!wrote) {
            begin(quality_range(outcome.rate).mean, seconds);
            return true;
        }
        const double of_pictures = 8.0 * static_cast<double>(outcome.summary.pictures.bytes);
        const double of_meshes = 8.0 * static_cast<double>(bytes) - of_pictures;
        if (!passes_.picture_quality) {  // by the rate, for the sake of the buffer
            const double of_wanted = (of_meshes + of_pictures) / sharing_->wanted_bits();
            if (std::abs(of_wanted - 1) <= rate_tolerance) return false;
            mesh_bits_ /= of_wanted;
        } else {
            const double quality = quality_range(outcome.rate).mean;
            sharing_->add({quality, of_meshes, *passes_.picture_quality, of_pictures});
            note(fmt::format("so shared, meshes take {:.3f} Mbit/s at quality {:.0f}, pictures {:.3f} at {:.0f}",
                             of_meshes / seconds / 1e6, quality, of_pictures / seconds / 1e6,
                             *passes_.picture_quality));
            // One quality for all pictures knows nothing of a buffer, which may be too small though the rate is met.
            constexpr double nearly = 0.1;
            const bool overfills = outcome.rate.buffer.overflows() &&
                                   std::abs((of_meshes + of_pictures) / sharing_->wanted_bits() - 1) < nearly;
            if (sharing_->is_met() && !overfills) return false;
            const auto next = sharing_->next();
            passes_.picture_quality = next.picture_quality;
            mesh_bits_ = next.mesh_bits;
            constexpr double too_far = 12;  // steps of quality from those that the number of pixels is for
            if (std::abs(next.picture_quality - quality_of_size_) > too_far) follow_with_size(next.picture_quality);
            if (overfills) passes_.picture_quality.reset();  // a rate knows of it
        }
        passes_.settings.rate.bits_per_second = mesh_bits_ / seconds;
        return true;
    }
    double mesh_bits() const { return mesh_bits_; }
    bool is_finest() const { return sharing_ && sharing_->is_finest(); }

private:
    // The pictures begin at the quality that meshes have with the fixed share, and with pixels for it.
    void begin(double quality, double seconds) {
        sharing_.emplace(of_all_ * seconds);
        mesh_bits_ = share_of_meshes * of_all_ * seconds;
        passes_.picture_quality = quality;
        usual_side_ = passes_.settings.texture.width;
        follow_with_size(quality);
    }
    void follow_with_size(double quality) {
        quality_of_size_ = quality;
        auto& texture = passes_.settings.texture;
        if (texture.layout == TextureLayout::charts && passes_.plan.pictures.size == 0)
            texture.width = texture.height = picture_side_of(usual_side_, std::min(quality, 100.0));
        if (passes_.plan.film && passes_.plan.pictures.size == 0) {
            const auto pictures = film_size_at(*passes_.plan.film, quality);
            texture.width = pictures.width;
            texture.height = pictures.height;
        }
    }
    Passes& passes_;
    double of_all_, mesh_bits_ = 0, quality_of_size_ = 0;
    int usual_side_ = 0;  // of pictures at the default quality
    std::optional<RateSharing> sharing_ = {};
};

// One pass after another, until the bitrate is met.
Result<void> encode_in_passes(Passes passes) {
    const auto of_all = passes.settings;
    std::optional<SharedRate> shared;
    if (keeps_pictures(passes.plan.capture.texture_as)) shared.emplace(passes);
    const bool may_share = shared && passes.plan.most_passes > passes.plan.fewest_passes;
    std::optional<RatePasses> learned;
    for (int number = 1;; ++number) {
        // Before the first pass, so that a place that cannot be written to does not cost one.
        auto output = open_output(passes);
        if (!output) return tl::unexpected(output.error());
        Outcome outcome{{}, RateReport(of_all), Deadline(passes.plan.deadline, passes.settings.tracked.effort)};
        outcome.rate.is_shared = may_share;
        if (auto done = run_pass(passes, number, *output, outcome); !done) return done;
        const double seconds = seconds_of(outcome.summary, passes.capture.fps());
        if (!learned) learned.emplace(passes.settings.rate.bits_per_second * seconds);
        bool again = false;
        if (may_share) {
            again = shared->plan_next(passes.writes(number), outcome, output->bytes(), seconds) &&
                    number < passes.plan.most_passes;
            outcome.rate.is_finest = shared->is_finest();
            learned->want(shared->mesh_bits());
        } else {
            again = goes_on(passes, number, outcome, *output);
        }
        if (!again) return conclude(passes, outcome, *output);
        learned->add(std::move(outcome.rate.costs));
        passes.settings.rate.first_pass = learned->expected();
        passes.capture.rewind();
    }
}

// By the clock, or by the log of a run that went by it.
Result<void> encode_in_one(const EncodePlan& plan, Capture& capture, EncoderOptions settings,
                           const std::optional<AudioTrack>& audio) {
    const auto repeated = efforts_to_repeat(plan, capture);
    if (!repeated) return tl::unexpected(repeated.error());
    const auto efforts = *repeated ? (*repeated)->frames : std::vector<LoggedFrame>{};
    if (*repeated) settings.tracked.effort = (*repeated)->asked;
    if (plan.effort_log.empty()) return encode_in_passes({plan, capture, std::move(settings), audio, efforts, nullptr});
    auto log = EffortLogWriter::create(plan.effort_log, settings.tracked.effort);
    if (!log) return tl::unexpected(log.error());
    auto done = encode_in_passes({plan, capture, std::move(settings), audio, efforts, &*log});
    if (done) return done;
    const auto kept = log->keep();
    return kept.empty() ? done
                        : fail(done.error().kind, fmt::format("{}; the efforts of frames up to there are in {}",
                                                              done.error().message, kept.string()));
}

}  // namespace

Result<void> encode(const EncodePlan& plan) {
    watch_for_interruption();
    auto capture = Capture::open(plan.capture);
    if (!capture) return tl::unexpected(capture.error());
    if (auto may_log = check_effort_log(plan, *capture); !may_log) return may_log;
    auto decided = plan;
    decided.capture.texture_as = capture->texture_as();
    decided.film = film_of(*capture);
    auto settings = settings_for(decided, *capture);
    if (!settings) return tl::unexpected(settings.error());
    const auto audio = AudioTrack::open(plan.audio);
    if (!audio) return tl::unexpected(audio.error());
    return plan.in_groups() ? encode_in_groups(decided, *capture, *settings, *audio)
                            : encode_in_one(decided, *capture, std::move(*settings), *audio);
}

}  // namespace htvm::app
