#include "encode_pass.h"

#include <fmt/core.h>

#include <chrono>
#include <utility>

#include "codec/format/frame_kinds.h"
#include "command_line/terminal.h"
#include "line_rate.h"

namespace htvm::app {
namespace {

void warn_of_frame(const Pass& pass, FrameWarnings::Kind kind, const std::string& line) {
    if (pass.warnings) pass.warnings->tell(kind, line);
}

Result<void> write(Pass& pass, Packet packet) {
    auto written = pass.write(std::move(packet));
    if (!written) pass.may_go_on = false;
    return written;
}

Result<void> hand_out(Pass& pass, std::vector<Packet> packets) {
    for (auto& packet : packets) {
        pass.rate.buffer.add(packet);
        if (auto written = write(pass, std::move(packet)); !written) return written;
    }
    return {};
}

Result<void> drain(Pass& pass) {
    while (auto packet = pass.encoder.pull()) {
        if (!pass.write) {
            pass.rate.buffer.add(*packet);
            continue;
        }
        Result<std::vector<Packet>> ready;
        if (pass.pictures)
            ready = pass.pictures->lay_behind(std::move(*packet));
        else
            ready->push_back(std::move(*packet));
        if (!ready) return tl::unexpected(ready.error());
        if (auto handed = hand_out(pass, std::move(*ready)); !handed) return handed;
    }
    return {};
}

// Counts the frames that were coded last, and writes their packets.
Result<void> take_coded(Pass& pass) {
    auto& summary = pass.summary;
    std::size_t coded = 0;
    for (const auto& [info, cost] : pass.encoder.coded_frames()) {
        if (auto fits = internal::check_default_limits(info.type, {info.vertices, info.triangles}); !fits)
            warn_of_frame(pass, FrameWarnings::large,
                          fmt::format("frame {} is refused by players and commands that are not told otherwise: {}",
                                      info.frame, fits.error().message));
        if (pass.pictures && pass.write && pass.pictures->bakes()) {
            const auto repeated = pass.encoder.repeated_vertices(coded);
            pass.pictures->show(info.frame, pass.encoder.reconstruction(coded), {repeated.begin(), repeated.end()});
        }
        ++coded;
        add(summary.totals, info);
        add_coded(pass.rate, cost);
        if (!pass.plan.json || !pass.write) continue;
        summary.list.push_back({info, pass.rate.controlled() ? std::optional(cost.quality) : std::nullopt});
    }
    extend(summary.bounds, pass.encoder.bounds());
    return drain(pass);
}

std::string progress_text(const Pass& pass) {
    const auto& info = pass.encoder.last_frame();
    std::string text = fmt::format("{} {:.2f} bpv", kind_of(info.type).letter,
                                   bits_per_vertex(info.bytes.total(), info.source_vertices));
    if (pass.rate.controlled()) text += fmt::format(", quality {:.0f}", pass.encoder.last_cost().quality);
    if (pass.slower_line > 0) text += fmt::format(" for a line of {:.2f} Mbit/s", pass.slower_line / 1e6);
    return text;
}

// A line that does not carry what is made, or does again.
Result<void> follow_line(Pass& pass) {
    const auto bits_per_second = pass.bitrate ? pass.bitrate() : std::nullopt;
    if (!bits_per_second) return {};
    const bool slower = *bits_per_second < pass.rate.bits_per_second;
    if (slower && pass.slower_line == 0)
        warn_of_frame(pass, FrameWarnings::slower_line,
                      fmt::format("the line does not carry {:.2f} Mbit/s; less is sent until it does",
                                  pass.rate.bits_per_second / 1e6));
    pass.slower_line = slower ? *bits_per_second : 0;
    pass.rate.line_was_slower = pass.rate.line_was_slower || slower;
    if (!pass.pictures) return pass.encoder.set_bitrate(*bits_per_second);
    pass.pictures->set_bitrate(*bits_per_second);
    return pass.encoder.set_bitrate(share_of_meshes * *bits_per_second);
}

double milliseconds_since(std::chrono::steady_clock::time_point then) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - then).count();
}

// How much is searched for the next frame, which has waited for so long.
Result<int> choose_effort(Pass& pass, double waited) {
    const auto place = pass.deadline->frames().size();
    if (!pass.efforts.empty() && place >= pass.efforts.size()) {
        pass.may_go_on = false;
        return fail(ErrorKind::bad_input, too_few_efforts(pass.plan.repeat_efforts, pass.efforts.size(), "more"));
    }
    const int effort = pass.efforts.empty() ? pass.deadline->effort(waited) : pass.efforts[place].effort;
    if (auto set = pass.encoder.set_effort(effort); !set) return tl::unexpected(set.error());
    return effort;
}

// Nothing where no efforts are chosen, as in profiles that have none.
Result<void> set_repair(Pass& pass, std::function<bool()> may_repair) {
    return pass.deadline ? pass.encoder.set_repair(std::move(may_repair)) : Result<void>();
}

// Counts a frame that is coded or dropped: the next ones' efforts follow from it, and the log tells of it.
Result<void> count(Pass& pass, const TimedFrame& timed) {
    if (pass.deadline) pass.deadline->took(timed);
    if (!pass.effort_log) return {};
    auto logged = pass.effort_log->add(timed);
    if (!logged) pass.may_go_on = false;
    return logged;
}

// What became of a mesh.
enum class Coded { yes, dropped };

// Under rate control a frame that does not fit is dropped, and the stream goes on without it; but not the first, as all
// others need an I-frame before them.
bool is_of_rate(const Pass& pass, const Error& error) {
    return error.kind == ErrorKind::limit && pass.rate.rate_controlled();
}

bool is_of_dropped(const Pass& pass, const Error& error) { return is_of_rate(pass, error) && !pass.rate.costs.empty(); }

// The encoder knows only of the rate that it was given.
std::string text_of(const Pass& pass, const Error& error) {
    return is_of_rate(pass, error) && pass.pictures
               ? error.message + "; this is of the meshes, which share --bitrate with the pictures, so give more"
               : error.message;
}

void drop(Pass& pass, const std::string& frame, const Error& error) {
    add_dropped(pass.rate);
    warn_of_frame(pass, FrameWarnings::dropped, fmt::format("{} is dropped: {}", frame, error.message));
}

// A mesh whose texture coordinates are in the part of its camera's film that is sent, and that part.
struct Framed {
    Mesh mesh;
    FilmWindow window;
};

Result<Framed> framed(Pass& pass, const Mesh& mesh, const TexturedMesh* textured) {
    if (!mesh.triangles.empty() && (!textured || mesh.texcoords.size() != textured->mesh.texcoords.size()))
        return fail(ErrorKind::bad_input, pass.capture.name() + " has no image, or no texture coordinates");
    if (!pass.framing) pass.framing.emplace(*pass.plan.film);
    Framed out{mesh, *pass.plan.film};
    if (mesh.triangles.empty()) return out;
    out.window = pass.framing->next(*textured);
    out.mesh.texcoords = texcoords_in_window(*textured, out.window);
    return out;
}

Result<Coded> code(Pass& pass, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us,
                   const std::shared_ptr<const TexturedMesh>& textured) {
    auto& summary = pass.summary;
    const auto start = std::chrono::steady_clock::now();
    const auto on_film =
        pass.plan.film ? Result<std::optional<Framed>>(framed(pass, mesh, textured.get())) : std::optional<Framed>();
    if (!on_film) return tl::unexpected(on_film.error());
    TimedFrame timed;
    timed.timestamp_us = timestamp_us;
    const double held_before = pass.held_back();
    if (pass.deadline) {
        timed.waited = milliseconds_since(pass.capture.came());
        const auto effort = choose_effort(pass, timed.waited);
        if (!effort) return tl::unexpected(effort.error());
        timed.effort = *effort;
    }
    // When it was found that this frame is to be repaired. Under rate control it may be asked for several times.
    std::optional<std::chrono::steady_clock::time_point> repairing;
    const auto may_repair = [&] {
        if (repairing || timed.left_lost) return !timed.left_lost;
        timed.left_lost = !pass.deadline->may_repair(timed.waited + milliseconds_since(start), timestamp_us);
        if (!timed.left_lost) repairing = std::chrono::steady_clock::now();
        return !timed.left_lost;
    };
    const bool limited = pass.deadline && pass.deadline->milliseconds() > 0;  // then no frame waits in the encoder
    std::function<bool()> repair;
    if (limited) {
        repair = may_repair;
    } else if (!pass.efforts.empty()) {
        const bool may = pass.efforts[pass.deadline->frames().size()].may_repair;
        timed.left_lost = !may;
        repair = [may] { return may; };
    }
    if (auto set = set_repair(pass, repair); !set) return tl::unexpected(set.error());
    const bool key_frame = pass.wants_key_frame && pass.wants_key_frame();
    const bool access = pass.wants_access && pass.wants_access(timestamp_us);
    if (access) pass.encoder.request_access();
    const auto pushed = pass.encoder.push(*on_film ? (*on_film)->mesh : mesh, pose, timestamp_us, key_frame);
    if (limited)
        if (auto set = set_repair(pass, {}); !set) return tl::unexpected(set.error());
    summary.encode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const bool dropped = !pushed && is_of_dropped(pass, pushed.error());
    if (!pushed && !dropped)
        return fail(pushed.error().kind, fmt::format("{}: {}", pass.capture.name(), text_of(pass, pushed.error())));
    if (summary.frames++ == 0) summary.first_us = timestamp_us;
    summary.last_us = timestamp_us;
    if (dropped) {
        timed.took = milliseconds_since(start);
        if (auto ok = count(pass, timed); !ok) return tl::unexpected(ok.error());
        drop(pass, pass.capture.name(), pushed.error());
        if (access) pass.encoder.request_access();  // for the next one
        pass.step("dropped");
        return Coded::dropped;
    }
    if (pass.pictures && pass.write && textured)
        pass.pictures->add(timestamp_us, textured,
                           *on_film ? std::optional((*on_film)->window) : std::optional<FilmWindow>());
    if (auto taken = take_coded(pass); !taken) return tl::unexpected(taken.error());
    if (pass.deadline) {
        const double held = pass.held_back() - held_before;
        timed.took = milliseconds_since(start) - held;
        timed.intra = pass.encoder.last_frame().type == FrameType::intra;
        if (repairing) timed.repaired = milliseconds_since(*repairing) - held;
    }
    if (auto ok = count(pass, timed); !ok) return tl::unexpected(ok.error());
    if (auto followed = follow_line(pass); !followed) return tl::unexpected(followed.error());
    pass.step(progress_text(pass));
    return Coded::yes;
}

// The frame before, once more.
Result<void> repeat(Pass& pass, std::int64_t timestamp_us) {
    const auto coded =
        code(pass, *pass.last, pass.last_pose ? &*pass.last_pose : nullptr, timestamp_us, pass.last_textured);
    return coded ? Result<void>() : tl::unexpected(coded.error());
}

// Numbers that are missing between two files.
Result<void> take_gap(Pass& pass) {
    auto& summary = pass.summary;
    const auto missing = pass.capture.missing_before();
    if (missing == 0) return {};
    const bool fill = pass.plan.fill && pass.last;
    warn_of_frame(pass, FrameWarnings::missing,
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
    const auto policy = pass.plan.bad_frames;
    if (pass.is_stopped() || error.kind == ErrorKind::disk_full) return tl::unexpected(error);
    if (!pass.may_go_on || is_of_rate(pass, error)) return tl::unexpected(error);  // no frame is bad
    if (!pass.capture.survives_errors())
        return policy == BadFrames::stop
                   ? tl::unexpected(error)
                   : fail(error.kind, fmt::format("{} (--on-bad-frame {} goes on behind meshes that came whole, which "
                                                  "is not known of this one)",
                                                  error.message, word_of(policy, bad_frame_uses)));
    if (policy == BadFrames::stop)
        return fail(error.kind, error.message + " (--on-bad-frame skip goes on without such frames)");
    const bool repeats = policy == BadFrames::repeat && pass.last;
    warn_of_frame(pass, FrameWarnings::bad,
                  error.message + (repeats ? "; the frame before is repeated in its place" : "; it is left out"));
    ++(repeats ? summary.repeated : summary.left_out);
    if (repeats) return repeat(pass, pass.capture.timestamp_us());
    pass.step("left out");
    return {};
}

// What cannot be coded as it should, though the encoder would take it.
Result<void> check_triangles(Pass& pass, const Mesh& mesh) {
    auto& summary = pass.summary;
    if (!mesh.triangles.empty()) {
        if (!pass.saw_triangles) summary.first_surface = internal::openness_of(mesh.positions, mesh.triangles);
        pass.saw_triangles = true;
        return {};
    }
    const bool first = !pass.saw_triangles;
    const auto name = pass.capture.name();
    if (first && pass.plan.encoder.profile == Profile::tracked && !mesh.positions.empty())
        return fail(ErrorKind::bad_input,
                    name +
                        " has points, but no triangles, and --profile tracked codes surfaces: make a mesh of the "
                        "points first, or give --profile topology, which codes points as they are");
    if (!first && pass.plan.bad_frames != BadFrames::stop)
        return fail(ErrorKind::bad_input, name + " has no triangles");
    ++summary.without_triangles;
    return {};
}

void keep_last(Pass& pass, const Mesh& mesh) {
    if (!pass.plan.fill && pass.plan.bad_frames != BadFrames::repeat) return;
    pass.last = mesh;
    if (const auto* pose = pass.capture.pose()) pass.last_pose = *pose;
    if (pass.pictures) pass.last_textured = pass.capture.textured();
}

Result<void> take(Pass& pass, const Mesh& mesh) {
    if (auto fine = check_triangles(pass, mesh); !fine) return fine;
    const auto coded = code(pass, mesh, pass.capture.pose(), pass.capture.timestamp_us(), pass.capture.textured());
    if (!coded) return tl::unexpected(coded.error());
    if (*coded == Coded::yes) keep_last(pass, mesh);
    return {};
}

}  // namespace

void add(Summary& summary, Summary behind) {
    const auto before = summary.totals.all().frames;
    for (auto frame : behind.list) {
        for (auto* number : {&frame.info.frame, &frame.info.reference}) *number += static_cast<std::uint32_t>(before);
        summary.list.push_back(frame);
    }
    add(summary.totals, behind.totals);
    summary.encode_seconds += behind.encode_seconds;
    summary.without_triangles += behind.without_triangles;
    if (behind.frames > 0 && summary.frames == 0) summary.first_us = behind.first_us;
    if (behind.frames > 0) summary.last_us = behind.last_us;
    summary.frames += behind.frames;
    summary.left_out += behind.left_out;
    summary.repeated += behind.repeated;
    summary.missing += behind.missing;
    summary.filled += behind.filled;
    extend(summary.bounds, behind.bounds);
    summary.pictures.pictures += behind.pictures.pictures;
    summary.pictures.key_pictures += behind.pictures.key_pictures;
    summary.pictures.bytes += behind.pictures.bytes;
    summary.pictures.seconds += behind.pictures.seconds;
    summary.pictures.baking_seconds += behind.pictures.baking_seconds;
}

Result<void> check_something_was_coded(const EncodePlan& plan, const Summary& summary) {
    const auto frames = summary.totals.all().frames;
    if (frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
    if (!summary.bounds) return fail(ErrorKind::bad_input, all_empty(plan.capture, frames));
    return {};
}

void FrameWarnings::tell(Kind kind, const std::string& line) {
    constexpr std::size_t most = 10;
    const std::lock_guard lock(mutex_);
    const auto told = ++told_[kind];
    if (told <= most) warn(told < most ? line : line + "; others like it follow");
}

Result<std::optional<PictureTrack>> picture_track(const EncodePlan& plan, const Capture& capture,
                                                  const EncoderOptions& settings, std::optional<double> quality) {
    const auto use = plan.capture.texture_as;
    if (!keeps_pictures(use)) return std::nullopt;
    PictureTrack::Settings out;
    out.options = plan.pictures;
    out.keep = use == TextureAs::keep;
    out.bake = use == TextureAs::picture;
    out.width = settings.texture.width;
    out.height = settings.texture.height;
    out.quality = quality.value_or(plan.encoder.quality);
    out.frames_per_second = capture.fps();
    if (!quality) out.bits_per_second = plan.encoder.rate.bits_per_second;  // of all; the settings have the meshes'
    out.buffer_seconds = settings.rate.buffer_seconds;
    out.speed_ahead = plan.speed_ahead;
    out.threads = settings.threads;
    auto track = PictureTrack::create(out);
    if (!track) return tl::unexpected(track.error());
    return std::optional(std::move(*track));
}

Result<void> encode_frames(Pass& pass) {
    Pass* const alone = &pass;
    return encode_frames(std::span(&alone, 1));
}

Result<void> encode_frames(std::span<Pass* const> passes) {
    const auto stopped = [] { return fail(ErrorKind::bad_input, "interrupted"); };
    auto& first = *passes.front();
    for (;;) {
        if (first.is_stopped()) return stopped();
        const auto mesh = first.capture.next();
        if (mesh && !*mesh) break;
        for (auto* pass : passes) {
            if (auto filled = take_gap(*pass); !filled) return filled;
            const auto taken = mesh ? take(*pass, **mesh) : tl::unexpected(mesh.error());
            if (taken) continue;
            if (auto survived = take_bad(*pass, taken.error()); !survived) return survived;
        }
    }
    return first.is_stopped() ? stopped() : Result<void>();
}

void follow_hub(Pass& pass, Publishing& hub) {
    pass.wants_key_frame = [&hub] { return hub.wants_key_frame(); };
    if (!pass.rate.rate_controlled() || pass.plan.publishing.fixed_bitrate) return;
    pass.bitrate = [&hub, line = LineRate(pass.rate.bits_per_second)]() mutable { return line.follow(hub.line()); };
}

Result<void> finish(Pass& pass) {
    const auto start = std::chrono::steady_clock::now();
    auto finished = pass.encoder.finish();
    // The frame that waited may not fit.
    if (!finished && is_of_dropped(pass, finished.error())) {
        drop(pass, "the last frame", finished.error());
        finished = pass.encoder.finish();
    }
    pass.summary.encode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!finished) return finished;
    if (auto taken = pass.encoder.coded_frames().empty() ? drain(pass) : take_coded(pass); !taken) return taken;
    if (!pass.pictures || !pass.write) return {};
    auto rest = pass.pictures->finish();
    return rest ? hand_out(pass, std::move(*rest)) : tl::unexpected(rest.error());
}

}  // namespace htvm::app
