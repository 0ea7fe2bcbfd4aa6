#include "encode_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "core/thread.h"
#include "htvm/intra_coder.hpp"
#include "io/number_text.h"
#include "live/client/hub_address.h"
#include "picture_pace.h"
#include "rate_passes.h"

namespace htvm::app {
namespace {

// The last value that an option of the library's list was given, in the library's unit.
std::optional<double> given(const EncodeRequest& request, std::string_view name) {
    const auto& all = request.encoding.given;
    const auto last = std::find_if(all.rbegin(), all.rend(), [&](const auto& one) { return one.first->name == name; });
    return last == all.rend() ? std::nullopt : std::optional(last->second);
}

bool has_bitrate(const EncodeRequest& request) { return given(request, "rate.bits_per_second").has_value(); }

bool is_cut(const EncodeRequest& request) { return request.chunks != 1 || request.jobs > 0 || request.job.of > 0; }

bool goes_to_hub(const EncodeRequest& request) { return live::looks_like_hub_address(request.output); }

// Frames go by a clock, or by the log of a run that did.
bool is_paced(const EncodeRequest& request) {
    return request.deadline > 0 || !request.effort_log.empty() || !request.repeat_efforts.empty();
}

// Somebody waits for each frame, so that a group's packets, which come with its last one, would be late.
bool may_not_wait(const EncodeRequest& request) { return goes_to_hub(request) || request.deadline > 0; }

// ---- Contradictions -------------------------------------------------------------------------------------------------

// The option by which the capture is cut.
const char* cutting_option(const EncodeRequest& request) {
    return request.chunks != 1 ? "--chunks" : request.jobs > 0 ? "--jobs" : "--job";
}

std::string refused(const char* option, std::string_view why) { return fmt::format("{}: {}", option, why); }

// The library's sentence, with flags instead of its names.
std::string in_flags(std::string_view sentence) {
    std::string out;
    while (!sentence.empty()) {
        const auto end = std::min(sentence.find_first_of(" ,;"), sentence.size());
        const auto* option = find_option(sentence.substr(0, end));
        out += option && *option->flag ? option->flag : sentence.substr(0, end);
        if (end < sentence.size()) out += sentence[end];
        sentence.remove_prefix(std::min(sentence.size(), end + 1));
    }
    return out;
}

// Options of another profile, and values that the encoder does not take together.
std::string in_encoding(const EncodeRequest& request) {
    const auto& encoding = request.encoding;
    for (const auto& [option, value] : encoding.given)
        if (!serves(option->group, encoding.profile))
            return fmt::format("{} does nothing with --profile {}: add --profile {}", option->flag,
                               profile_name(encoding.profile), group_name(option->group));
    if (const auto encoder = Encoder::create(encoder_options(encoding)); !encoder)
        return in_flags(encoder.error().message);
    return {};
}

// What becomes of images by default, and why not pictures, for people.
struct OfImages {
    TextureAs use = TextureAs::picture;
    const char* why_no_pictures = "";
};

OfImages default_of_images(const EncodeRequest& request) {
    constexpr auto colours = TextureAs::colours;
    switch (request.encoding.profile) {
        case Profile::paper:
        case Profile::topology:
            return {colours, "--texture-as captured sends the images, too"};
        case Profile::tracked:
            break;
    }
    return {};
}

// What can become of a capture's images.
std::string in_pictures(const EncodeRequest& request) {
    const bool is_default = request.capture.texture_as == TextureAs::by_default;
    const auto use = is_default ? default_of_images(request).use : request.capture.texture_as;
    const auto& pictures = request.pictures;
    const char* about_video = pictures.size > 0  ? "--texture-size"
                              : pictures.codec   ? "--texture-codec"
                              : pictures.quality ? "--texture-quality"
                                                 : nullptr;
    if (about_video && use != TextureAs::captured && use != TextureAs::picture && use != TextureAs::projection)
        return refused(about_video,
                       "is for pictures that are coded as video: add --texture-as picture, projection or captured");
    if (has_bitrate(request) && pictures.quality)
        return refused("--texture-quality", "follows from --bitrate; give one of the two");
    if (is_default || !keeps_pictures(use)) return {};
    const bool tracked = request.encoding.profile == Profile::tracked;
    const std::string word = word_of(use, texture_uses);
    const bool lasts = use == TextureAs::picture || use == TextureAs::projection;
    if (tracked && !lasts)
        return refused("--texture-as",
                       word +
                           " keeps every frame's own texture coordinates, which --profile tracked does not: add "
                           "--profile topology, or give picture");
    if (!tracked && lasts)
        return refused("--texture-as",
                       word +
                           " is drawn on a mesh that lasts, as --profile tracked makes it; with other profiles give "
                           "captured");
    if (request.capture.texture.files == "none")
        return refused("--texture", "none leaves no images for --texture-as " + word);
    if (has_bitrate(request) && use == TextureAs::keep)
        return refused("--texture-as",
                       "keep leaves image files as large as they are, which no --bitrate can change; captured codes "
                       "them as video");
    return {};
}

// What groups cannot do, as they do not know of each other.
std::string in_groups(const EncodeRequest& request) {
    if (!is_cut(request)) return {};
    const char* option = cutting_option(request);
    const bool is_job = request.job.of > 0;
    if (request.chunks != 1 && (request.jobs > 0 || is_job))
        return refused(option,
                       "says where the capture is cut, and --jobs and --job cut it by --keyint: give one of "
                       "them");
    if (is_piped(request.capture))
        return refused(option, "takes frames from many places at once, which needs files, not standard input");
    if (goes_to_hub(request))
        return refused(option, "encodes groups of frames at once: for files, not for what is live");
    if (has_bitrate(request))
        return refused(option,
                       "encodes groups of frames that do not know what the others take, so they cannot share a "
                       "--bitrate; -q and --target-error go with it");
    if (!request.audio.file.empty() && is_job)
        return refused("--audio", "is for the whole: give it to the htvm join of the parts");
    if (request.encoding.draws_session && is_job)
        return refused("--session",
                       "is random, so the parts of several jobs would not be of one stream: give all the same number");
    return {};
}

// What standard input, standard output and hubs cannot do.
std::string in_places(const EncodeRequest& request) {
    if (request.publishing.fixed_bitrate && !(goes_to_hub(request) && has_bitrate(request)))
        return refused("--fixed-bitrate", "does nothing without a --bitrate and a hub to publish to");
    if (request.output == "-" && request.json)
        return refused("--json", "prints on standard output, where -o - puts the stream; choose one");
    if (request.drop_late && !is_piped(request.capture))
        return refused("--drop-late", "is for meshes on standard input: files can wait");
    return {};
}

// What goes with the clock, frame after frame.
std::string in_pace(const EncodeRequest& request) {
    const char* option = request.deadline > 0              ? "--deadline"
                         : !request.effort_log.empty()     ? "--effort-log"
                         : !request.repeat_efforts.empty() ? "--repeat-efforts"
                                                           : nullptr;
    if (!option) return {};
    if (request.encoding.profile != Profile::tracked)
        return refused(option, "is for --profile tracked: the others have no efforts");
    if (is_cut(request))
        return refused(option,
                       std::string("goes frame by frame through the capture, not with ") + cutting_option(request));
    if (request.encoding.passes == 2) return refused(option, "goes with one pass over the frames, not with --passes 2");
    return {};
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

std::string in_log_and_output(const EncodeRequest& request) {
    if (request.effort_log.empty() || goes_to_hub(request)) return {};
    // Until they are whole, both are under other names, which may be taken as little.
    const std::string output = request.output == "-" ? "/dev/stdout" : request.output;
    for (const char* until_whole : {"", ".partial"})
        if (is_same_file(request.effort_log, output + until_whole) ||
            is_same_file(request.effort_log + until_whole, output))
            return refused("--effort-log", fmt::format("{} is where -o puts the stream: give the log another name",
                                                       request.effort_log));
    return {};
}

// Frames that wait for others, where somebody waits for them.
std::string in_waiting(const EncodeRequest& request) {
    if (given(request, "tracked.group").value_or(0) > 1 && may_not_wait(request))
        return refused("--group", request.deadline > 0
                                      ? "holds frames back, beyond any --deadline: give one of the two"
                                      : "holds frames back, which who watches live would wait for: it is for files, "
                                        "not for a hub");
    if (given(request, "latency_frames").value_or(0) > 0 && request.deadline > 0)
        return refused("--latency-frames",
                       "lets a frame wait for the next one, while --deadline counts the time until it is coded: give "
                       "one of them");
    if (std::isnan(request.deadline)) return refused("--deadline", "is a number of milliseconds, not nan");
    return {};
}

std::string in_passes(const EncodeRequest& request) {
    if (request.encoding.passes != 2 || !is_piped(request.capture)) return {};
    return refused("--passes",
                   "2 reads the capture twice, which standard input does not allow; give files, or --passes 1");
}

// ---- Decisions ------------------------------------------------------------------------------------------------------

Result<Floor> floor_of(const std::string& text) {
    if (text.empty()) return Floor{};
    if (text == "lowest") return Floor{true, {}};
    const auto metres = parse_number(text);
    if (!metres || !std::isfinite(*metres))
        return fail(ErrorKind::bad_input, "--floor must be a number of metres or lowest, not '" + text + "'");
    return Floor{false, *metres};
}

// Below it, time is worth more than bits.
constexpr int least_effort_with_groups = 3;

// PictureEncoderOptions::speed, with foresight: at the least effort as fast as one picture after the other.
int speed_of_pictures(int effort) { return effort < 3 ? 9 : effort < 6 ? 8 : 7; }

// What the highest effort takes; 0 where there may be no groups.
int largest_group(EncoderOptions options) {
    options.tracked.effort = 9;
    const int frames = frames_in_group(options);
    return frames > 1 ? frames : 0;
}

// Nobody waits for the frames of a file.
bool is_of_files(const EncodeRequest& request) {
    return !is_piped(request.capture) && !may_not_wait(request) && request.effort_log.empty();
}

// The library's options, with what the command takes in place of its defaults.
EncoderOptions encoder_of(const EncodeRequest& request, const Destination& output) {
    auto out = encoder_options(request.encoding);
    out.metadata = request.encoding.metadata;
    if (request.encoding.intra == IntraCoder::draco) out.intra_coder = draco_intra_coder();
    // A run and its repetition make the same of an effort.
    if (out.tracked.group == 0 && (may_not_wait(request) || is_paced(request))) out.tracked.group = 1;
    // A first frame that takes seconds is none to be watched live.
    if (!given(request, "tracked.levels") && may_not_wait(request)) out.tracked.levels = ReferenceLevels::off;
    const bool of_files = is_of_files(request);
    if (!given(request, "latency_frames") && of_files && !output.may_be_live()) out.latency_frames = 1;
    if (of_files && out.tracked.group == 0 && out.tracked.effort >= least_effort_with_groups)
        out.tracked.group = largest_group(out);
    if (!given(request, "session") && request.job.of == 0 && output.may_be_live()) out.session = random_session();
    return out;
}

void choose_passes(EncodePlan& plan, const EncodeRequest& request) {
    const int asked = request.encoding.passes;
    const bool by_rate = plan.encoder.rate.bits_per_second > 0 && !is_paced(request);
    plan.fewest_passes = !by_rate ? 1 : asked > 0 ? asked : plan.is_piped ? 1 : 2;
    // What went to a pipe cannot be taken back.
    const bool may_add = asked == 0 && plan.fewest_passes == 2 && !plan.output.may_be_live();
    plan.most_passes = may_add ? most_passes : plan.fewest_passes;
}

}  // namespace

std::string contradiction_in(const EncodeRequest& request) {
    for (const auto look :
         {in_encoding, in_pictures, in_groups, in_places, in_pace, in_log_and_output, in_waiting, in_passes})
        if (auto found = look(request); !found.empty()) return found;
    return {};
}

Result<EncodePlan> plan_of(const EncodeRequest& request) {
    if (const auto why = contradiction_in(request); !why.empty()) return fail(ErrorKind::bad_input, why);
    const auto floor = floor_of(request.encoding.floor);
    if (!floor) return tl::unexpected(floor.error());
    EncodePlan plan;
    plan.capture = request.capture;
    const auto of_images = default_of_images(request);
    plan.capture.of_images = of_images.use;
    plan.capture.why_no_pictures = of_images.why_no_pictures;
    plan.capture.keeps_idle_texcoords = request.encoding.profile != Profile::tracked;
    plan.capture.while_busy = request.drop_late      ? WhileBusy::drop
                              : request.deadline > 0 ? WhileBusy::read_on
                                                     : WhileBusy::wait;
    plan.is_piped = is_piped(request.capture);
    plan.output = destination_of(request.output);
    plan.publishing = request.publishing;
    plan.audio = request.audio;
    plan.pictures = request.pictures;
    plan.encoder = encoder_of(request, plan.output);
    if (of_images.use == TextureAs::picture && may_not_wait(request))
        plan.capture.pictures_too_slow =
            pictures_too_slow({request.pictures, {plan.encoder.quality}, plan.encoder.threads, request.deadline});
    if (!may_not_wait(request) && !is_paced(request) && !plan.output.may_be_live())
        plan.speed_ahead = speed_of_pictures(plan.encoder.tracked.effort);
    // A key picture takes as many bits as a second of others.
    constexpr int frames_between_key_pictures = 90;
    plan.access_interval_with_pictures =
        given(request, "tracked.access_interval") ? plan.encoder.tracked.access_interval : frames_between_key_pictures;
    plan.floor = *floor;
    plan.front = request.encoding.front;
    plan.radii_file = request.encoding.radii_file;
    choose_passes(plan, request);
    plan.deadline = request.deadline;
    plan.effort_log = request.effort_log;
    plan.repeat_efforts = request.repeat_efforts;
    plan.is_timed = request.deadline > 0 || !request.effort_log.empty() ||
                    (plan.is_piped && plan.encoder.profile == Profile::tracked);
    plan.drops_late = request.drop_late;
    plan.bad_frames = request.bad_frames;
    plan.fill = request.fill;
    plan.json = request.json;
    plan.keep_partial = request.keep_partial;
    plan.chunks = request.chunks == 0 ? internal::thread_count(0) : request.chunks;
    plan.jobs = request.jobs;
    plan.job = request.job;
    plan.segment_seconds = request.segment_seconds;
    return plan;
}

}  // namespace htvm::app
