#include "encode_ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "container/playlist.h"
#include "encode_pass.h"
#include "encode_settings.h"
#include "htvm/running_time.hpp"
#include "io/mesh_file.h"
#include "io/number_text.h"
#include "io/output_file.h"
#include "live/client/hub_address.h"
#include "picture_pace.h"
#include "segment_folder.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_rungs = 8;

// For pages: what a phone's line carries, the default, and what a good line carries.
constexpr std::array web_qualities = {30.0, 42.0, 60.0};

tl::unexpected<Error> refused(const std::string& why) { return fail(ErrorKind::bad_input, "--ladder " + why); }

// What the capture is encoded to in one rung, and all that this takes.
struct Work {
    EncodePlan plan;
    EncoderOptions settings = {};
    std::optional<StreamOutput> output = {};
    std::optional<Encoder> encoder = {};
    std::optional<PictureTrack> pictures = {};
    Summary summary = {};
    std::optional<RateReport> rate = {};
    std::optional<Pass> pass = {};
};

std::string rung_place(const std::string& place, std::size_t number) {
    if (live::looks_like_hub_address(place)) return rung_address(place, number);
    const fs::path path(place);
    return (path.parent_path() / fmt::format("{}-{}.m3u8", path.stem().string(), number)).string();
}

Result<EncodePlan> plan_of_rung(const EncodeRequest& request, const Rung& rung, std::size_t number) {
    auto own = request;
    own.ladder.clear();
    own.output = rung_place(request.output, number);
    for (auto& hub : own.publishing.other_hubs) hub = rung_place(hub, number);
    if (rung.bits_per_second > 0) {
        own.encoding.given.emplace_back(find_option("rate.bits_per_second"), rung.bits_per_second);
        own.encoding.passes = 1;
    } else {
        own.encoding.quality = rung.quality;
    }
    auto plan = plan_of(own);
    if (!plan) return plan;
    // Decoding can start where segments begin, which the ladder decides, and where surface is patched.
    constexpr int never = 1000000;
    plan->encoder.tracked.access_interval = plan->access_interval_with_pictures = never;
    return plan;
}

Result<void> check(const EncodeRequest& request) {
    if (!is_playlist_name(request.output) && !destination_of(request.output).is_hub())
        return refused("is for segments and hubs: -o NAME.m3u8, or -o ws://HOST:PORT/publish/NAME");
    if (request.encoding.profile != Profile::tracked) return refused("is for --profile tracked");
    if (request.chunks != 1 || request.jobs > 0 || request.job.of > 0)
        return refused("goes through the capture once: not with --chunks, --jobs or --job");
    if (request.deadline > 0 || !request.effort_log.empty() || !request.repeat_efforts.empty())
        return refused("codes each frame several times: not with --deadline, --effort-log or --repeat-efforts");
    return {};
}

// Asks for a place to start in the first frame at or behind each multiple of a segment's length: from the first frame
// on in files; on a hub by the timestamps themselves, as it may see the first frame of a rung late.
auto at_segments(double seconds, bool on_hub) {
    const auto length_us = static_cast<std::int64_t>(seconds * 1e6);
    using Time = std::optional<std::int64_t>;
    return [length_us, first = on_hub ? Time(0) : Time(), last = Time()](std::int64_t timestamp_us) mutable {
        if (!first) first = timestamp_us;
        const auto since = timestamp_us - *first;
        const auto segment = since / length_us - (since % length_us < 0 ? 1 : 0);
        const auto before = std::exchange(last, segment);
        return before && *before != segment;
    };
}

Result<void> open(Work& work, Capture& capture, const std::optional<AudioTrack>& audio, double segment_seconds) {
    work.plan.capture.texture_as = capture.texture_as();
    work.plan.film = film_of(capture);
    auto settings = settings_for(work.plan, capture);
    if (!settings) return tl::unexpected(settings.error());
    work.settings = std::move(*settings);
    work.rate.emplace(work.settings);
    const double of_all = work.settings.rate.bits_per_second;
    if (keeps_pictures(work.plan.capture.texture_as)) work.settings.rate.bits_per_second = share_of_meshes * of_all;
    auto output = StreamOutput::open(work.plan.output.place, work.plan.publishing);
    if (!output) return tl::unexpected(output.error());
    if (!work.plan.is_piped) output->pace();
    output->set(SegmentOptions{.seconds = segment_seconds, .on_grid = true});
    if (audio) output->lay(*audio);
    work.output.emplace(std::move(*output));
    auto encoder = Encoder::create(work.settings);
    if (!encoder) return tl::unexpected(encoder.error());
    work.encoder.emplace(std::move(*encoder));
    auto pictures = picture_track(work.plan, capture, work.settings);
    if (!pictures) return tl::unexpected(pictures.error());
    work.pictures = std::move(*pictures);
    return {};
}

void begin(Work& work, Capture& capture, double segment_seconds, FrameWarnings* warnings,
           std::function<void(const std::string&)> step) {
    work.pass.emplace(Pass{.plan = work.plan,
                           .capture = capture,
                           .encoder = *work.encoder,
                           .write = [&output = *work.output](const Packet& packet) { return output.write(packet); },
                           .step = std::move(step),
                           .is_stopped = [] { return interruption() != 0; },
                           .warnings = warnings,
                           .summary = work.summary,
                           .rate = *work.rate,
                           .wants_access = at_segments(segment_seconds, work.plan.output.is_hub())});
    if (work.pictures) work.pass->pictures = &*work.pictures;
    if (auto* hub = work.output->publishing()) follow_hub(*work.pass, *hub);
}

// Where viewers of one rung need a key frame, all rungs have one: so they stay cut alike. The finest is asked first.
void share_key_frames(std::deque<Work>& works) {
    const auto wanted = std::make_shared<bool>(false);
    for (auto& work : works) work.pass->wants_key_frame = [wanted] { return *wanted; };
    works.back().pass->wants_key_frame = [wanted, &works] {
        *wanted = false;
        for (auto& work : works)
            if (work.output->publishing()->wants_key_frame()) *wanted = true;
        return *wanted;
    };
}

// What the list of playlists says of a rung, by its files.
Result<PlaylistVariant> variant_of(const Work& work, double fps) {
    const fs::path place(work.plan.output.place);
    const auto text = read_file(place.string());
    if (!text) return tl::unexpected(text.error());
    const auto list = read_playlist({reinterpret_cast<const char*>(text->data()), text->size()});
    if (!list) return tl::unexpected(list.error());
    PlaylistVariant out;
    out.uri = place.filename().string();
    out.frames_per_second = fps;
    double bits = 0, seconds = 0, most = 0;
    for (const auto& segment : list->segments) {
        std::error_code error;
        const auto of_segment = 8.0 * static_cast<double>(fs::file_size(place.parent_path() / segment.uri, error));
        bits += of_segment;
        seconds += segment.seconds;
        most = std::max(most, of_segment / std::max(segment.seconds, 0.1));
    }
    out.bits_per_second = static_cast<std::uint64_t>(std::ceil(most));
    out.average = static_cast<std::uint64_t>(std::ceil(bits / std::max(seconds, 0.1)));
    if (work.settings.texture.layout != TextureLayout::none) {
        out.width = static_cast<std::uint32_t>(work.settings.texture.width);
        out.height = static_cast<std::uint32_t>(work.settings.texture.height);
    }
    const auto map = read_file((place.parent_path() / list->segments.front().map_uri).string());
    if (!map) return tl::unexpected(map.error());
    out.codecs = codecs_of(*map);
    return out;
}

void tell(Work& work, const PlaylistVariant& variant, nlohmann::json& json) {
    const auto frames = work.summary.totals.all().frames;
    const double rate = static_cast<double>(frames) / std::max(work.summary.encode_seconds, 1e-9);
    auto* hub = work.output->publishing();
    const auto not_sent = hub ? hub->state().dropped_frames : 0;
    const double average = 1e-6 * static_cast<double>(variant.average);
    const double most = 1e-6 * static_cast<double>(variant.bits_per_second);
    if (work.plan.json) {
        json.push_back({{"output", shown_place(work.plan.output.place)},
                        {"bytes", work.output->bytes()},
                        {"frames", frames},
                        {"megabits_per_second", average},
                        {"encode_seconds", work.summary.encode_seconds}});
        if (hub)
            json.back()["not_sent_frames"] = not_sent;
        else
            json.back()["most_megabits_per_second"] = most;
        return;
    }
    note(
        fmt::format("{}: {}, {:.2f} Mbit/s{}, encoded at {:.1f} frames/s{}", shown_place(work.plan.output.place),
                    counted(frames, "frame"), average, hub ? "" : fmt::format(", at most {:.2f}", most), rate,
                    not_sent > 0 ? fmt::format(", {} not sent, as the line did not take them in time", not_sent) : ""));
}

// Only the mean is known where a stream went to a hub.
PlaylistVariant published_variant(const Work& work, double fps) {
    const auto& summary = work.summary;
    const double seconds =
        seconds_of_frames(summary.first_us, summary.last_us, std::max<std::size_t>(summary.frames, 1), 1 / fps);
    PlaylistVariant out;
    out.average = static_cast<std::uint64_t>(8.0 * static_cast<double>(work.output->bytes()) / std::max(seconds, 0.1));
    return out;
}

// The ends of all rungs, and the list of their playlists, which is there once they are; a hub makes its own.
Result<void> conclude(std::deque<Work>& works, const std::string& place, double fps) {
    const bool on_hub = works.front().plan.output.is_hub();
    std::vector<PlaylistVariant> variants;
    auto json = nlohmann::json::array();
    for (auto& work : works) {
        if (auto something = check_something_was_coded(work.plan, work.summary); !something) return something;
        work.output->add_bounds(*work.summary.bounds);
        if (auto finished = work.output->finish(); !finished) return finished;
        auto variant = on_hub ? published_variant(work, fps) : variant_of(work, fps);
        if (!variant) return tl::unexpected(variant.error());
        tell(work, *variant, json);
        variants.push_back(std::move(*variant));
    }
    if (works.front().plan.json)
        fmt::print("{}\n", nlohmann::json{{"output", shown_place(place)}, {"rungs", json}}.dump(2));
    return on_hub ? Result<void>() : write_file(place, write_variants(variants));
}

// What viewers of a hub have not got yet they get; of files nothing is left.
Result<void> ended_early(std::deque<Work>& works, const Error& error) {
    for (auto& work : works)
        if (auto* hub = work.output->publishing(); hub && finish(*work.pass)) (void)hub->finish();
    return tl::unexpected(error);
}

}  // namespace

Result<std::vector<Rung>> rungs_of(const std::string& text) {
    std::vector<Rung> out;
    if (text == "web") {
        for (const double quality : web_qualities) out.push_back({0, quality});
        return out;
    }
    bool by_rate = false, by_quality = false;
    for (std::size_t begin = 0; begin <= text.size();) {
        const auto end = std::min(text.find(',', begin), text.size());
        auto word = text.substr(begin, end - begin);
        begin = end + 1;
        const bool is_quality = !word.empty() && word[0] == 'q';
        if (is_quality) word.erase(0, 1);
        (is_quality ? by_quality : by_rate) = true;
        const auto value = parse_number(word);
        const bool fits = value && (is_quality ? *value >= 0 && *value <= 100 : *value >= 0.01 && *value <= 1000);
        if (!fits)
            return refused(
                fmt::format("takes rates in Mbit/s from 0.01 to 1000, as 0.3,0.8,2, or qualities from 0 to 100, "
                            "as q35,q50, or web; '{}' is neither",
                            text));
        out.push_back(is_quality ? Rung{0, *value} : Rung{*value * 1e6, 0});
    }
    if (by_rate && by_quality) return refused("takes rates or qualities, not both: " + text);
    if (out.size() > most_rungs) return refused(fmt::format("takes at most {} rungs", most_rungs));
    std::sort(out.begin(), out.end(), [](const Rung& a, const Rung& b) {
        return a.bits_per_second + a.quality < b.bits_per_second + b.quality;
    });
    for (std::size_t i = 1; i < out.size(); ++i)
        if (out[i].bits_per_second == out[i - 1].bits_per_second && out[i].quality == out[i - 1].quality)
            return refused("has a rung twice: " + text);
    return out;
}

Result<void> encode_ladder(const EncodeRequest& request) {
    if (auto fine = check(request); !fine) return fine;
    const auto rungs = rungs_of(request.ladder);
    if (!rungs) return tl::unexpected(rungs.error());
    watch_for_interruption();
    std::deque<Work> works;  // which passes refer to
    for (const auto& rung : *rungs) {
        auto plan = plan_of_rung(request, rung, works.size() + 1);
        if (!plan) return tl::unexpected(plan.error());
        works.push_back({std::move(*plan)});
    }
    // By which the hub knows that they belong together.
    for (auto& work : works) work.plan.encoder.session = works.front().plan.encoder.session;
    auto& capture_options = works.front().plan.capture;
    if (capture_options.pictures_too_slow) {
        std::vector<double> qualities;
        for (const auto& work : works) qualities.push_back(work.plan.encoder.quality);
        capture_options.pictures_too_slow =
            pictures_too_slow({request.pictures, qualities, works.front().plan.encoder.threads, 0});
    }
    auto capture = Capture::open(capture_options);
    if (!capture) return tl::unexpected(capture.error());
    const auto audio = AudioTrack::open(request.audio);
    if (!audio) return tl::unexpected(audio.error());
    for (auto& work : works)
        if (auto opened = open(work, *capture, *audio, request.segment_seconds); !opened) return opened;
    // The finest first, by which the others go.
    auto& finest = works.back();
    for (auto& work : works)
        if (&work != &finest)
            if (auto shared = work.encoder->share_with(*finest.encoder); !shared) return shared;
    Progress progress("encoding", capture->frames());
    FrameWarnings warnings;
    std::vector<Pass*> passes;
    for (auto work = works.rbegin(); work != works.rend(); ++work) {
        const bool first = &*work == &finest;
        auto* hub = work->output->publishing();
        begin(*work, *capture, request.segment_seconds, first ? &warnings : nullptr,
              [&progress, first, hub](const auto& text) {
                  if (first) progress.step(hub ? text + ", " + hub->progress() : text);
              });
        passes.push_back(&*work->pass);
    }
    if (works.front().plan.output.is_hub()) share_key_frames(works);
    if (auto done = encode_frames(passes); !done) return ended_early(works, done.error());
    for (auto* pass : passes)
        if (auto done = finish(*pass); !done) return done;
    return conclude(works, request.output, capture->fps());
}

}  // namespace htvm::app
