// htvm check: what a capture is like, what an encoder makes of it, and what is better mended where it is made. It reads
// frames as encode does, and judges them by the same rules.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line/capture.h"
#include "command_line/capture_kind.h"
#include "command_line/interruption.h"
#include "command_line/subject_height.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/lattice.h"
#include "htvm/encoder.hpp"
#include "metrics/mesh_facts.h"
#include "metrics/percentile.h"
#include "surface/open_border.h"
#include "surface/triangle_cleaning.h"

namespace htvm::app {
namespace {

struct Options {
    CaptureOptions capture;
    std::size_t trial = 20;  // frames that are encoded to see what they take; 0: none
    bool json = false;
};

struct CheckedFrame {
    std::string name;
    std::int64_t timestamp_us = 0;
    std::size_t missing_before = 0;  // frames, by the numbers in the names
    MeshFacts facts;
    double height = 0;                    // mm
    std::size_t doubled = 0, turned = 0;  // triangles (surface/triangle_cleaning.h)
    bool colours = false, normals = false, texcoords = false;
    int texture_width = 0, texture_height = 0;  // of its image; 0: none
    MeshSize size;
    double farthest = 0;           // of its vertices from its middle, mm
    std::vector<std::string> odd;  // what is not as in the other frames, clauses behind its name
    bool repeats = false;          // the same positions as the frame before
    std::string wrong;             // why encode does not take it; empty: it does
};

// What encoding some frames gave.
struct Trial {
    std::size_t frames = 0, intra = 0, patched = 0;
    double megabits_per_second = 0;
};

struct Report {
    std::vector<CheckedFrame> frames;
    Trial trial;
    double fps = 30;
    double millimetres_per_unit = 1;
    GlobalShift shift{};
    internal::Openness openness = internal::Openness::closed;  // of the first frame, as encode sees the capture
    std::string lacks_images;  // why no frame can be encoded, where it is the images alone; empty: some can
};

// ---- Looking at frames ----------------------------------------------------------------------------------------------

// origin: of the lattice on which the first frame put all; nothing: it has no position.
CheckedFrame look_at(const Capture& capture, const Mesh& mesh, UpAxis up,
                     const std::optional<std::array<std::int32_t, 3>>& origin) {
    CheckedFrame out;
    out.name = capture.name();
    out.timestamp_us = capture.timestamp_us();
    const auto textured = capture.textured();
    const Mesh& captured = textured ? textured->mesh : mesh;
    out.facts = facts_of(mesh);
    out.height = height_of(mesh, up);
    out.size = size_of(mesh);
    out.farthest = farthest_from(out.size.middle, mesh);
    out.colours = !captured.colours.empty();
    out.normals = !captured.normals.empty();
    out.texcoords = !captured.texcoords.empty();
    if (textured && textured->texture) {
        out.texture_width = textured->texture->width;
        out.texture_height = textured->texture->height;
    }
    if (!origin) return out;
    constexpr int bits = 5;  // of the lattice that encode takes for people
    const auto on_lattice = internal::to_lattice(mesh, internal::Lattice{*origin, bits});
    // As far from the first frame as a stream's coordinates reach, whether it is tried or not.
    if (!on_lattice) {
        out.wrong = out.name + ": " + on_lattice.error().message;
        return out;
    }
    const auto cleaned = internal::clean_triangles(on_lattice->positions, on_lattice->triangles);
    out.doubled = cleaned.doubled;
    out.turned = cleaned.turned;
    return out;
}

// Feeds the first frames to an encoder with the defaults.
class TrialRun {
public:
    TrialRun(const Capture& capture, std::size_t most) : most_(most), fps_(capture.fps()) {
        if (most == 0) return;
        EncoderOptions options;
        options.global_shift = capture.global_shift();
        if (auto created = Encoder::create(options)) encoder_.emplace(std::move(*created));
    }
    // Why the frame cannot be coded; empty: it can, or is not tried.
    std::string add(const Mesh& mesh, std::int64_t timestamp_us) {
        if (!encoder_ || trial_.frames >= most_ || mesh.triangles.empty()) return {};
        Mesh pushed_mesh = mesh;
        pushed_mesh.texcoords.clear();  // as encode leaves them out, where its image does not become colours
        if (const auto pushed = encoder_->push(pushed_mesh, nullptr, timestamp_us); !pushed)
            return pushed.error().message;
        ++trial_.frames;
        count();
        return {};
    }
    Trial finish() {
        if (encoder_) {
            (void)encoder_->finish();
            count();
        }
        const double seconds = static_cast<double>(trial_.frames) / fps_;
        if (seconds > 0) trial_.megabits_per_second = 8 * static_cast<double>(bytes_) / seconds / 1e6;
        return trial_;
    }

private:
    void count() {
        while (const auto packet = encoder_->pull()) {
            bytes_ += write_packet(*packet).size();
            trial_.intra += packet->kind == PacketKind::intra;
            trial_.patched += packet->kind == PacketKind::patched;
        }
    }
    std::optional<Encoder> encoder_;
    Trial trial_;
    std::size_t most_ = 0;
    std::uint64_t bytes_ = 0;
    double fps_ = 30;
};

// The capture; without its images if no mesh could be read because of these alone, which is told in `lacks_images`.
Result<Capture> open_capture(const CaptureOptions& options, std::string& lacks_images) {
    auto capture = Capture::open(options);
    if (capture || !options.texture.files.empty() || is_piped(options)) return capture;
    auto without = options;
    without.texture.files = "none";
    auto bare = Capture::open(without);
    if (!bare) return capture;
    lacks_images = capture.error().message;
    return bare;
}

Result<Report> look_at_all(const Options& options) {
    Report report;
    auto capture = open_capture(options.capture, report.lacks_images);
    if (!capture) return tl::unexpected(capture.error());
    report.fps = capture->fps();
    report.millimetres_per_unit = capture->millimetres_per_unit();
    report.shift = capture->global_shift();
    TrialRun trial(*capture, options.trial);
    Progress progress("check", capture->frames());
    std::vector<Vector3f> before;
    std::optional<std::array<std::int32_t, 3>> origin;  // of the first frame
    while (interruption() == 0) {
        auto mesh = capture->next();
        if (mesh && !*mesh) break;
        if (!mesh) {
            CheckedFrame bad;
            bad.name = capture->name();
            bad.timestamp_us = capture->timestamp_us();
            bad.missing_before = capture->missing_before();
            bad.wrong = mesh.error().message;
            report.frames.push_back(std::move(bad));
            progress.step();
            if (!capture->survives_errors()) break;
            continue;
        }
        if (!origin)
            if (const auto found = internal::lattice_origin(**mesh)) {
                origin = *found;
                report.openness = internal::openness_of((*mesh)->positions, (*mesh)->triangles);
            }
        auto frame = look_at(*capture, **mesh, options.capture.up, origin);
        frame.missing_before = capture->missing_before();
        frame.repeats = !before.empty() && before == (*mesh)->positions;
        if (const auto why = trial.add(**mesh, frame.timestamp_us); !why.empty()) frame.wrong = frame.name + ": " + why;
        before = std::move((*mesh)->positions);
        report.frames.push_back(std::move(frame));
        progress.step();
    }
    report.trial = trial.finish();
    return report;
}

// ---- Judging --------------------------------------------------------------------------------------------------------

bool has_images(const Report& report) {
    return std::any_of(report.frames.begin(), report.frames.end(),
                       [](const auto& frame) { return frame.texture_width > 0; });
}

// Values are those of the frames that could be read.
template <class Value>
std::vector<double> values_of(const Report& report, Value value) {
    std::vector<double> out;
    for (const auto& frame : report.frames)
        if (frame.wrong.empty()) out.push_back(static_cast<double>(value(frame)));
    return out;
}

// The middle one of the changes from frame to frame, as a share of what changes.
double flicker_of(const std::vector<double>& values) {
    std::vector<double> changes;
    for (std::size_t k = 1; k < values.size(); ++k) {
        const double size = std::max(std::abs(values[k]), std::abs(values[k - 1]));
        if (size > 0) changes.push_back(std::abs(values[k] - values[k - 1]) / size);
    }
    return middle_of(std::move(changes));
}

struct Spread {
    double least = 0, middle = 0, most = 0;
};

Spread spread_of(const std::vector<double>& values) {
    if (values.empty()) return {};
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    return {*least, middle_of(values), *most};
}

std::string text_of(const Spread& spread) {
    if (spread.least == spread.most) return fmt::format("{:.0f}", spread.middle);
    return fmt::format("{:.0f} ({:.0f} to {:.0f})", spread.middle, spread.least, spread.most);
}

std::size_t count_of(const Report& report, bool (*is)(const CheckedFrame&)) {
    return static_cast<std::size_t>(std::count_if(report.frames.begin(), report.frames.end(),
                                                  [&](const auto& frame) { return frame.wrong.empty() && is(frame); }));
}

// Values that frames usually have, by which others are odd.
struct Usual {
    MeshSize size;
    double light = -1;  // 0..255; -1: no frame has colours
};

Usual usual_of(const Report& report) {
    Usual out;
    std::vector<MeshSize> sizes;
    std::vector<double> light;
    for (const auto& frame : report.frames) {
        if (!frame.wrong.empty() || frame.size.reach == 0) continue;
        sizes.push_back(frame.size);
        if (frame.facts.light >= 0) light.push_back(frame.facts.light);
    }
    out.size = usual_size(sizes);
    if (!light.empty()) out.light = middle_of(std::move(light));
    return out;
}

// Another unit, a vertex far away, another light.
std::vector<std::string> odd_of(const CheckedFrame& frame, const Usual& usual) {
    std::vector<std::string> out;
    if (!frame.wrong.empty() || frame.size.reach == 0) return out;
    if (const auto scale = odd_scale(frame.size, usual.size); !scale.empty()) out.push_back("it is " + scale);
    constexpr double far = 12;  // reaches: the hands and feet of people are three or four away
    if (frame.farthest > far * std::max(frame.size.reach, usual.size.reach))
        out.push_back(fmt::format("a vertex is {} from the middle of the subject", length_text(frame.farthest)));
    constexpr double share = 1.0 / 3, white = 255, dim = 12;  // below that black is no oddity
    const double light = frame.facts.light;
    if (light >= 0 && usual.light > dim && light < share * usual.light)
        out.push_back(fmt::format("it is {}: its brightness is {:.0f} of 255, usually {:.0f}",
                                  light < 1 ? "black" : "far darker than the others", light, usual.light));
    if (light >= 0 && usual.light < white - dim && white - light < share * (white - usual.light))
        out.push_back(fmt::format("it is {}: its brightness is {:.0f} of 255, usually {:.0f}",
                                  light > white - 1 ? "white" : "far brighter than the others", light, usual.light));
    return out;
}

void find_odd_frames(Report& report) {
    const auto usual = usual_of(report);
    for (auto& frame : report.frames) frame.odd = odd_of(frame, usual);
}

struct Judgement {
    Spread vertices, triangles, height, edge, border, pieces, specks, strays, unused;
    double area_flicker = 0, light_flicker = 0;
    std::size_t readable = 0, bad = 0, missing = 0, repeated = 0, odd = 0;
    double doubled = 0, turned = 0;  // shares of the triangles
    std::vector<std::string> advice;
};

void advise(const Report& report, Judgement& j) {
    const auto say = [&j](const std::string& line) { j.advice.push_back(line); };
    if (j.bad > 0)
        say(fmt::format("{} cannot be encoded: mend them, or give encode --on-bad-frame skip or repeat",
                        counted(j.bad, "frame")));
    if (j.missing > 0)
        say(fmt::format("{} by the numbers in the names: look for dropped frames; --fill repeats the one before",
                        counted(j.missing, "frame") + (j.missing == 1 ? " is missing" : " are missing")));
    if (j.odd > 0)
        say(fmt::format("{} not like the others, as said above: look at {}, and leave {} out with --ignore if need be",
                        counted(j.odd, "frame") + (j.odd == 1 ? " is" : " are"), j.odd == 1 ? "it" : "them",
                        j.odd == 1 ? "it" : "them"));
    if (j.repeated > 0)
        say(fmt::format("{} what the one before has: the rig's rate may be lower than its recording's",
                        counted(j.repeated, "frame") + (j.repeated == 1 ? " repeats" : " repeat")));
    if (j.strays.middle >= 1) say("pieces float far from the subject: cut the reconstruction to a box around it");
    if (j.specks.middle >= 5)
        say(fmt::format(
            "{:.0f} specks a frame: remove small pieces where the surface is made; each costs bits in every "
            "frame and flashes",
            j.specks.middle));
    if (j.unused.middle > 0.01 * j.vertices.middle)
        say(
            fmt::format("{:.0f} vertices a frame are in no triangle: they cost bits with --profile topology and show "
                        "nothing",
                        j.unused.middle));
    if (j.doubled > 0.01) say("triangles are there twice, once for each side: export single-sided surfaces");
    if (j.turned > 0.01) say("triangles are wound either way: unify the orientation, else lit renderings are spotted");
    if (j.border.middle > 0.5 * j.height.middle)
        say(
            fmt::format("the surface is open, {:.1f} m of border a frame: fill holes, or add cameras, where the whole "
                        "person is to be seen",
                        j.border.middle / 1000));
    if (j.area_flicker > 0.02)
        say(
            fmt::format("the surface's area changes by {:.1f} % from frame to frame: parts come and go, which costs I- "
                        "and patched frames; steadier masks and depth help",
                        100 * j.area_flicker));
    if (j.light_flicker > 0.05)
        say(
            fmt::format("brightness changes by {:.1f} % from frame to frame: fix the cameras' exposure and white "
                        "balance",
                        100 * j.light_flicker));
    if (count_of(report, [](const auto& f) { return !f.colours && f.texture_width == 0; }) == j.readable &&
        j.readable > 0)
        say("there are no colours: neither at vertices nor in an image that was found");
}

Judgement judge(const Report& report) {
    Judgement j;
    const auto spread = [&](auto value) { return spread_of(values_of(report, value)); };
    j.vertices = spread([](const auto& f) { return f.facts.vertices; });
    j.triangles = spread([](const auto& f) { return f.facts.triangles; });
    j.height = spread([](const auto& f) { return f.height; });
    j.edge = spread([](const auto& f) { return f.facts.mean_edge; });
    j.border = spread([](const auto& f) { return f.facts.border; });
    j.pieces = spread([](const auto& f) { return f.facts.pieces; });
    j.specks = spread([](const auto& f) { return f.facts.specks; });
    j.strays = spread([](const auto& f) { return f.facts.strays; });
    j.unused = spread([](const auto& f) { return f.facts.unused_vertices; });
    j.area_flicker = flicker_of(values_of(report, [](const auto& f) { return f.facts.area; }));
    j.light_flicker = flicker_of(values_of(report, [](const auto& f) { return std::max(f.facts.light, 0.0); }));
    double doubled = 0, turned = 0, triangles = 0;
    for (const auto& frame : report.frames) {
        j.missing += frame.missing_before;
        ++(frame.wrong.empty() ? j.readable : j.bad);
        j.repeated += frame.repeats;
        j.odd += !frame.odd.empty();
        doubled += static_cast<double>(frame.doubled);
        turned += static_cast<double>(frame.turned);
        triangles += static_cast<double>(frame.facts.triangles);
    }
    if (!report.lacks_images.empty()) j.bad = report.frames.size();
    j.doubled = triangles > 0 ? doubled / triangles : 0;
    j.turned = triangles > 0 ? turned / triangles : 0;
    advise(report, j);
    return j;
}

// ---- Telling --------------------------------------------------------------------------------------------------------

std::string attributes_of(const Report& report, const Judgement& j) {
    std::string out;
    const auto add = [&](const char* what, std::size_t count) {
        if (count == 0) return;
        out += (out.empty() ? "" : ", ") + std::string(what);
        if (count < j.readable) out += fmt::format(" (in {} of {} frames)", count, j.readable);
    };
    add("colours at vertices", count_of(report, [](const auto& f) { return f.colours; }));
    add("normals", count_of(report, [](const auto& f) { return f.normals; }));
    add("texture coordinates", count_of(report, [](const auto& f) { return f.texcoords; }));
    const auto images = count_of(report, [](const auto& f) { return f.texture_width > 0; });
    const auto first =
        std::find_if(report.frames.begin(), report.frames.end(), [](const auto& f) { return f.texture_width > 0; });
    if (images > 0)
        add(fmt::format("images of {} x {} pixels", first->texture_width, first->texture_height).c_str(), images);
    return out.empty() ? "none" : out;
}

// The first of the frames of which there is something to say, by name; count: of all of them.
template <class Text>
void print_frames(const char* what, const Report& report, std::size_t count, Text text_of_frame) {
    constexpr std::size_t most = 10;
    std::size_t told = 0;
    for (const auto& frame : report.frames) {
        const std::string text = text_of_frame(frame);
        if (text.empty()) continue;
        if (told++ < most) fmt::print("  {:<12} {}\n", what, text);
        if (told == most + 1) fmt::print("  {:<12} {} in all\n", what, counted(count, "frame"));
    }
}

const char* surface_text(internal::Openness openness) {
    using enum internal::Openness;
    if (openness == bordered) return "open: it has borders; encode says with each frame what is there (--presence)";
    if (openness == in_pieces)
        return "in pieces, as where depth cameras see a person; encode says with each frame what is there (--presence)";
    return "closed, or nearly so";
}

void print_report(const Report& report, const Judgement& j, const std::string& input) {
    const auto& last = report.frames.back();
    fmt::print("{}: {} at {:g} frames/s, {:.2f} s\n", input, counted(report.frames.size(), "frame"), report.fps,
               static_cast<double>(last.timestamp_us - report.frames.front().timestamp_us) / 1e6 + 1 / report.fps);
    fmt::print("  vertices     {}\n  triangles    {}\n", text_of(j.vertices), text_of(j.triangles));
    fmt::print("  size         {} mm tall, edges of {:.1f} mm, in units of {:g} mm\n", text_of(j.height), j.edge.middle,
               report.millimetres_per_unit);
    if (report.shift != GlobalShift{})
        fmt::print("  place        {:.0f}, {:.0f}, {:.0f} m from the origin\n",
                   static_cast<double>(report.shift[0]) / 1000, static_cast<double>(report.shift[1]) / 1000,
                   static_cast<double>(report.shift[2]) / 1000);
    fmt::print("  attributes   {}\n", attributes_of(report, j));
    fmt::print("  surface      {}\n", surface_text(report.openness));
    fmt::print("  pieces       {}, of them specks {}, far away {}\n", text_of(j.pieces), text_of(j.specks),
               text_of(j.strays));
    fmt::print("  border       {:.2f} m, vertices in no triangle {}\n", j.border.middle / 1000, text_of(j.unused));
    fmt::print("  winding      {:.1f} % of the triangles doubled, {:.1f} % turned\n", 100 * j.doubled, 100 * j.turned);
    fmt::print("  flicker      area {:.2f} %, brightness {:.2f} % from frame to frame\n", 100 * j.area_flicker,
               100 * j.light_flicker);
    if (report.trial.frames > 0)
        fmt::print("  encoded      the first {} with the defaults{}: {:.2f} Mbit/s, {} I-, {} TP-frames\n",
                   counted(report.trial.frames, "frame"),
                   has_images(report) ? ", but with colours in place of pictures" : "",
                   report.trial.megabits_per_second, report.trial.intra, report.trial.patched);
    if (!report.lacks_images.empty())
        fmt::print("  bad          every frame; the first of them: {}\n", report.lacks_images);
    print_frames("bad", report, j.bad, [](const auto& frame) { return frame.wrong; });
    print_frames("odd", report, j.odd, [](const auto& frame) {
        std::string out;
        for (const auto& clause : frame.odd) out += (out.empty() ? frame.name + ": " : "; ") + clause;
        return out;
    });
    if (j.advice.empty()) fmt::print("nothing to mend was found\n");
    for (const auto& line : j.advice) fmt::print("- {}\n", line);
    fmt::print("'htvm check --help-all' explains the words\n");
}

nlohmann::json json_of(const Spread& s) { return {{"least", s.least}, {"middle", s.middle}, {"most", s.most}}; }

void print_json(const Report& report, const Judgement& j) {
    nlohmann::json frames = nlohmann::json::array();
    for (const auto& f : report.frames)
        frames.push_back({{"name", f.name},
                          {"timestamp_us", f.timestamp_us},
                          {"missing_before", f.missing_before},
                          {"error", f.wrong.empty() ? nlohmann::json() : nlohmann::json(f.wrong)},
                          {"vertices", f.facts.vertices},
                          {"triangles", f.facts.triangles},
                          {"pieces", f.facts.pieces},
                          {"specks", f.facts.specks},
                          {"strays", f.facts.strays},
                          {"unused_vertices", f.facts.unused_vertices},
                          {"border_mm", f.facts.border},
                          {"forked_edges", f.facts.forked_edges},
                          {"area_mm2", f.facts.area},
                          {"mean_edge_mm", f.facts.mean_edge},
                          {"doubled_triangles", f.doubled},
                          {"turned_triangles", f.turned},
                          {"light", f.facts.light < 0 ? nlohmann::json() : nlohmann::json(f.facts.light)},
                          {"colours", f.colours},
                          {"normals", f.normals},
                          {"texcoords", f.texcoords},
                          {"texture", {f.texture_width, f.texture_height}},
                          {"farthest_mm", f.farthest},
                          {"odd", f.odd},
                          {"repeats", f.repeats}});
    fmt::print("{}\n",
               nlohmann::json{{"frames", frames},
                              {"fps", report.fps},
                              {"unit_mm", report.millimetres_per_unit},
                              {"global_shift_mm", report.shift},
                              {"bad_frames", j.bad},
                              {"missing_frames", j.missing},
                              {"repeated_frames", j.repeated},
                              {"odd_frames", j.odd},
                              {"vertices", json_of(j.vertices)},
                              {"triangles", json_of(j.triangles)},
                              {"height_mm", json_of(j.height)},
                              {"border_mm", json_of(j.border)},
                              {"surface", report.openness == internal::Openness::closed     ? "closed"
                                          : report.openness == internal::Openness::bordered ? "bordered"
                                                                                            : "in_pieces"},
                              {"doubled_share", j.doubled},
                              {"turned_share", j.turned},
                              {"area_flicker", j.area_flicker},
                              {"light_flicker", j.light_flicker},
                              {"trial",
                               {{"frames", report.trial.frames},
                                {"mbit_per_second", report.trial.megabits_per_second},
                                {"intra_frames", report.trial.intra},
                                {"patched_frames", report.trial.patched}}},
                              {"lacks_images",
                               report.lacks_images.empty() ? nlohmann::json() : nlohmann::json(report.lacks_images)},
                              {"advice", j.advice}}
                   .dump(2));
}

Result<void> check(const Options& options) {
    watch_for_interruption();
    auto report = look_at_all(options);
    if (!report) return tl::unexpected(report.error());
    find_odd_frames(*report);
    if (report->frames.empty()) return fail(ErrorKind::bad_input, "there are no frames to check");
    const auto judgement = judge(*report);
    if (options.json)
        print_json(*report, judgement);
    else
        print_report(*report, judgement, input_name(options.capture));
    if (judgement.bad == 0) return {};
    return fail(ErrorKind::bad_input,
                fmt::format("{} of {} cannot be encoded", judgement.bad, counted(report->frames.size(), "frame")));
}

constexpr const char* words_of_the_report =
    "The words of the report:\n"
    "  a range in brackets   the least and the most that a frame has, beside the middle one of all frames\n"
    "  size                  from the lowest to the highest vertex, along --up, or else y or z, whichever is longer;\n"
    "                        edges: the mean of their lengths\n"
    "  surface               of the first frame: closed, with borders, or in five large pieces or more, each of which\n"
    "                        may be closed by itself\n"
    "  pieces, specks        triangles that hang together; those of less than a hundredth of the largest one's area\n"
    "  far away              pieces that float farther from the largest one than a tenth of its size\n"
    "  border                how long the edges are in all that only one triangle has: the rims of holes and of open\n"
    "                        surfaces; a closed body has none\n"
    "  winding, turned       in which order triangles name their corners, which tells their outside; those that are\n"
    "                        wound the other way round than their neighbours\n"
    "  doubled               triangles that are there twice, as of surfaces with two sides\n"
    "  flicker               by how much the surface's area and brightness change from frame to frame, the middle one "
    "of\n"
    "                        all changes\n"
    "  I-, TP-frames         of those encoded on trial: coded by themselves, and tracked with a part sent anew\n"
    "  bad, odd              frames that encode refuses; and those that it takes, but that are in another unit, far "
    "darker\n"
    "                        or brighter than the others, or have a vertex far away\n";

}  // namespace

void add_check(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("check", "Look a capture over before it is encoded, and say what to mend");
    add_capture_options(*command, options->capture);
    options->capture.tells_odd_sizes = false;  // the report does
    command->add_option("--trial", options->trial,
                        "Encode so many frames with the defaults to see what they take; 0: none (default: 20)");
    command->add_flag("--json", options->json, "Print the report as JSON on standard output, with every frame");
    constexpr const char* examples =
        "Exits with 0 if encode would take every frame, otherwise with 1.\n"
        "Examples:\n"
        "  htvm check capture/\n"
        "  htvm check 'scan_*.ply' --json | jq .advice";
    command->footer(std::string(words_of_the_report) + examples);
    add_front_page(*command,
                   {{{"--frames"}, {"--first"}, {"--ignore"}, {"--unit"}, {"--texture"}, {"--trial"}, {"--json"}},
                    std::string("--help-all explains the words of the report.\n") + examples});
    command->callback([options, &run] { run = [options] { return check(*options); }; });
}

}  // namespace htvm::app
