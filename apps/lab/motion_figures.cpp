// Choices by the motion of the skeleton: the charts of figures 7, 17 and 18, the pictures of figure 19.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/thread.h"
#include "figures.h"
#include "findings.h"
#include "galleries.h"
#include "metrics/compare.h"

namespace htvm::lab {

using namespace app;

namespace {

constexpr const char* rate_label = "bits per captured vertex and frame (bpvf)";
constexpr const char* no_skeleton = "the capture has no skeleton whose motion could choose.";
constexpr const char* colours[] = {"#0072b2", "#cc79a7", "#009e73"};

using ThresholdPoints = std::vector<std::pair<double, const RdPoint*>>;

double share_of(const RdPoint& point, FrameType type) {
    return static_cast<double>(totals(point, type).frames) /
           static_cast<double>(std::max<std::size_t>(point.frames.size(), 1));
}

double value_of(const RdPoint& point, const char* measure) {
    const auto found = point.values.find(measure);
    return found == point.values.end() ? 0 : found->second;
}

double encode_ms(const RdPoint& point) {
    const double fps = encode_fps(point);
    return fps > 0 ? 1000 / fps : 0;
}

double decode_ms(const RdPoint& point) {
    const double fps = decode_fps(point).value_or(0);
    return fps > 0 ? 1000 / fps : 0;
}

std::string threshold_list(const ThresholdPoints& points) {
    std::string out;
    for (std::size_t i = 0; i < points.size(); ++i)
        out += fmt::format("{}{:g}", i == 0 ? "" : i + 1 == points.size() ? " and " : ", ", points[i].first);
    return out + " mm";
}

// The change of the rate, in the form of bits_phrase().
std::string rate_change(const RdPoint& from, const RdPoint& to) {
    return bits_phrase(bits_per_vertex(to) / std::max(bits_per_vertex(from), 1e-9) - 1);
}

// The second value relative to the first: "38 % less", "12 % more", "as much".
std::string change_words(double from, double to) {
    if (!(from > 0)) return "not known";
    const double percent = 100 * (to / from - 1);
    if (std::abs(percent) < 0.5) return "as much";
    return fmt::format("{:.0f} % {}", std::abs(percent), percent < 0 ? "less" : "more");
}

// Makes the chart's axes, for all its lines, start at 0.
void start_at_zero(Chart& chart) {
    std::vector<double> xs, ys;
    for (const auto& line : chart.lines) {
        for (const auto& [x, y] : line.points) {
            xs.push_back(x);
            ys.push_back(y);
        }
    }
    chart.x = zero_axis(xs);
    chart.y = zero_axis(ys);
}

ThresholdPoints motion_points(const Findings& findings) {
    if (!findings.thresholds) return {};
    return by_threshold(findings.motion, still_below_words, findings.thresholds->still_below);
}

// A row of the table of thresholds.
std::vector<std::string> motion_row(double threshold, const RdPoint& point) {
    return {fmt::format("{:g} mm", threshold),
            fmt::format("{:.0f} / {:.0f} / {:.0f}", 100 * share_of(point, FrameType::intra),
                        100 * share_of(point, FrameType::enhanced), 100 * share_of(point, FrameType::predicted)),
            fmt::format("{:.2f}", bits_per_vertex(point)),
            fmt::format("{:.2f}", value_of(point, "m3_foreground_db")),
            fmt::format("{:.2f}", value_of(point, "m3_full_db")),
            fmt::format("{:.2f}", value_of(point, "m2_mm")),
            fmt::format("{:.1f}", encode_ms(point)),
            fmt::format("{:.1f}", decode_ms(point))};
}

}  // namespace

Figure figure_7_by_motion(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{"7",
                  "share of I-frames and bit rate",
                  "The more frames are I-frames, the higher the rate; the threshold on the skeletal motion goes from "
                  "400 to 500 mm.",
                  {},
                  {}};
    const auto& thresholds = *findings.thresholds;
    Chart chart;
    chart.title = "Share of I-frames, by threshold on the skeletal motion";
    chart.x_label = rate_label;
    chart.y_label = "I-frames, % of frames";
    for (std::size_t q = 0; q < plan.interval_qualities.size(); ++q) {
        std::vector<RdPoint> part;
        for (const auto& point : findings.intra_choice)
            if (point.quality == plan.interval_qualities[q]) part.push_back(point);
        const auto points = by_threshold(part, intra_above_words, thresholds.intra_above);
        if (points.empty()) continue;
        ChartLine line{{}, colours[q % 3], q % 2 == 0 ? 7 : 5, 1, {}};
        const auto &most = *points.front().second, &fewest = *points.back().second;
        line.title = fmt::format("step {:.2g} mm", most.geometry_step);
        for (const auto& [threshold, point] : points)
            line.points.push_back({bits_per_vertex(*point), 100 * share_of(*point, FrameType::intra)});
        figure.found += fmt::format(
            "{}At a step of {:.2g} mm, from a threshold of {:g} to one of {:g} mm, the share falls from {:.0f} to "
            "{:.0f} % and the rate goes from {:.2f} to {:.2f} bpvf: {}.",
            figure.found.empty() ? "" : " ", most.geometry_step, points.front().first, points.back().first,
            line.points.front()[1], line.points.back()[1], bits_per_vertex(most), bits_per_vertex(fewest),
            bits_per_vertex(fewest) < bits_per_vertex(most) ? "EP-frames save bits, as in the paper"
                                                            : "EP-frames cost more bits than I-frames at this step");
        if (q == 0)
            figure.how = "Thresholds of " + threshold_list(points) +
                         ", at equal parts of this capture's own skeletal motion (the sum over its bones); the paper's "
                         "400 and 500 mm would make " +
                         fmt::format("{:.0f} and {:.0f} % of its frames I-frames.", 100 * thresholds.share_at_400,
                                     100 * thresholds.share_at_500) +
                         " No longest interval, no P-frames. Geometry alone, the same steps for all points of a line.";
        chart.lines.push_back(std::move(line));
    }
    start_at_zero(chart);
    figure.charts.push_back(draw(easel, "figure_07", chart));
    return figure;
}

Figure figure_7_predicted(const Findings& findings, Easel& easel) {
    Figure figure{"7b",
                  "share of P-, EP- and I-frames",
                  "Frames whose skeleton moved less than another threshold are P-frames; the paper gives neither the "
                  "threshold nor what it costs.",
                  {},
                  {}};
    if (!findings.thresholds) {
        figure.skipped = no_skeleton;
        return figure;
    }
    const auto& wanted = findings.thresholds->predicted_below;
    const auto points = by_threshold(findings.predicted_choice, predicted_below_words, wanted);
    const auto checked = by_threshold(findings.predicted_choice, checked_words, wanted);
    if (points.empty()) {
        figure.skipped = "nothing was measured.";
        return figure;
    }
    Chart shares;
    shares.title = "Share of frames, by threshold";
    shares.x_label = "threshold on the skeletal motion, mm";
    shares.y_label = "% of frames";
    const std::pair<FrameType, const char*> types[] = {
        {FrameType::predicted, "P"}, {FrameType::enhanced, "EP"}, {FrameType::intra, "I"}};
    for (std::size_t i = 0; i < 3; ++i) {
        ChartLine line{types[i].second, colours[i], 7, 1, {}};
        for (const auto& [threshold, point] : points)
            line.points.push_back({threshold, 100 * share_of(*point, types[i].first)});
        shares.lines.push_back(std::move(line));
    }
    start_at_zero(shares);
    Chart errors;
    errors.title = "What P-frames cost, M2";
    errors.x_label = rate_label;
    errors.y_label = "M2, point to surface, RMS, mm";
    for (const bool check : {false, true}) {
        const auto& from = check ? checked : points;
        if (from.empty()) continue;
        ChartLine line{
            check ? "checked: bones within 2 mm" : "by motion alone", colours[check ? 2 : 0], check ? 5 : 7, 1, {}};
        for (const auto& [threshold, point] : from)
            line.points.push_back({bits_per_vertex(*point), value_of(*point, "m2_mm")});
        std::sort(line.points.begin(), line.points.end());
        errors.lines.push_back(std::move(line));
    }
    start_at_zero(errors);
    figure.charts = {draw(easel, "figure_07b_shares", shares), draw(easel, "figure_07b_errors", errors)};
    const auto &without = *points.front().second, &most = *points.back().second;
    figure.found = fmt::format(
        "Below {:g} mm, {:.0f} % of the frames are P-frames: the rate falls from {:.2f} to {:.2f} bpvf, and M2 rises "
        "from {:.2f} to {:.2f} mm.",
        points.back().first, 100 * share_of(most, FrameType::predicted), bits_per_vertex(without),
        bits_per_vertex(most), value_of(without, "m2_mm"), value_of(most, "m2_mm"));
    if (!checked.empty()) {
        const auto& with_check = *checked.back().second;
        figure.found += fmt::format(
            " Where a frame must also fit the captured surface within 2 mm, bone by bone, {:.0f} % are, at {:.2f} bpvf "
            "and {:.2f} mm.",
            100 * share_of(with_check, FrameType::predicted), bits_per_vertex(with_check),
            value_of(with_check, "m2_mm"));
    }
    figure.how = fmt::format(
        "Thresholds of {}, at equal parts of this capture's skeletal motion since the last "
        "I-frame; geometry alone, step {:.2g} mm, the paper's coder.",
        threshold_list(points), without.geometry_step);
    return figure;
}

Figure figure_17(const Findings& findings, Easel& easel) {
    Figure figure{"17",
                  "encoding and decoding times in motion-based coding",
                  "Coding the moving sub-meshes alone takes less time on both sides: the lower the rate, the less.",
                  {},
                  {}};
    const auto points = motion_points(findings);
    if (points.empty()) {
        figure.skipped = no_skeleton;
        return figure;
    }
    Chart chart;
    chart.title = "Time of a frame, by threshold on the bones' motion";
    chart.x_label = rate_label;
    chart.y_label = "ms per frame";
    ChartLine encode{"encoding", colours[0], 7, 1, {}}, decode{"decoding", colours[1], 5, 1, {}};
    for (const auto& [threshold, point] : points) {
        encode.points.push_back({bits_per_vertex(*point), encode_ms(*point)});
        decode.points.push_back({bits_per_vertex(*point), decode_ms(*point)});
    }
    chart.lines = {encode, decode};
    start_at_zero(chart);
    figure.charts.push_back(draw(easel, "figure_17", chart));
    const auto &full = *points.front().second, &least = *points.back().second;
    figure.found = fmt::format(
        "From all coded to what moves {:g} mm or more: {}, {} time to encode ({:.0f} to {:.0f} ms) and {} to "
        "decode ({:.0f} to {:.0f} ms).",
        points.back().first, rate_change(full, least), change_words(encode_ms(full), encode_ms(least)), encode_ms(full),
        encode_ms(least), change_words(decode_ms(full), decode_ms(least)), decode_ms(full), decode_ms(least));
    if (points.size() > 2) {
        const auto& first = *points[1].second;
        figure.found += fmt::format(
            " At the lowest threshold, {:g} mm, encoding takes {}: to cut the moving part, its distance to the moved "
            "I-frame is measured, and the seam is zippered.",
            points[1].first, change_words(encode_ms(full), encode_ms(first)));
    }
    figure.how = fmt::format(
        "Thresholds of {} on each bone's motion since the I-frame, at equal parts of this capture's; step {:g} mm, "
        "colour step {:g}. Means over all frames, processor time of one thread; I-frames counted.",
        threshold_list(points), full.geometry_step, full.colour_step);
    return figure;
}

Figure figure_18(const Findings& findings, Easel& easel) {
    Figure figure{"18",
                  "picture quality (M3) against bit rate in motion-based coding",
                  "PSNR falls with the rate, but the difference is hard to see where the skeleton is good.",
                  {},
                  {}};
    const auto points = motion_points(findings);
    if (points.empty()) {
        figure.skipped = no_skeleton;
        return figure;
    }
    Chart chart;
    chart.title = "Pictures, M3, by threshold on the bones' motion";
    chart.x_label = rate_label;
    chart.y_label = "PSNR, dB";
    std::vector<double> xs, ys;
    for (const bool foreground : {true, false}) {
        ChartLine line{
            foreground ? "foreground" : "full picture", colours[foreground ? 0 : 1], foreground ? 7 : 5, 1, {}};
        for (const auto& [threshold, point] : points) {
            line.points.push_back(
                {bits_per_vertex(*point), value_of(*point, foreground ? "m3_foreground_db" : "m3_full_db")});
            xs.push_back(line.points.back()[0]);
            ys.push_back(line.points.back()[1]);
        }
        chart.lines.push_back(std::move(line));
    }
    chart.x = zero_axis(xs);
    chart.y = psnr_axis(ys);
    figure.charts.push_back(draw(easel, "figure_18", chart));
    const auto &full = *points.front().second, &least = *points.back().second;
    figure.found = fmt::format(
        "From {:.2f} dB of the foreground at {:.2f} bpvf, all coded, to {:.2f} dB at {:.2f} bpvf; M2 goes from {:.2f} "
        "to {:.2f} mm.",
        value_of(full, "m3_foreground_db"), bits_per_vertex(full), value_of(least, "m3_foreground_db"),
        bits_per_vertex(least), value_of(full, "m2_mm"), value_of(least, "m2_mm"));
    figure.how = fmt::format(
        "The runs of figure 17, nothing but the threshold changed; 10 views around the body, smooth shading{}; "
        "measured "
        "on 1 frame in {}.",
        findings.has_colour ? " with colours" : "", findings.motion_every);
    return figure;
}

std::optional<Table> motion_table(const Findings& findings) {
    const auto points = motion_points(findings);
    if (points.empty()) return std::nullopt;
    Table table;
    table.title = "Motion-based coding";
    table.head = {"Coded above", "I / EP / P, %", "bpvf",      "M3 foreground dB",
                  "M3 dB",       "M2 mm",         "encode ms", "decode ms"};
    for (const auto& [threshold, point] : points) table.rows.push_back(motion_row(threshold, *point));
    table.note =
        "The paper's coder; bones that moved less than the threshold since the I-frame are animated, unchecked.";
    return table;
}

std::optional<Claim> motion_claim(const Findings& findings) {
    const auto points = motion_points(findings);
    if (points.size() < 2) return std::nullopt;
    const auto &full = *points.front().second, &some = *points[points.size() / 2].second;
    Claim claim{
        "Motion-based coding saves bits and time", "both, the more the higher the threshold",
        fmt::format("at {:g} mm: {}, {} time to encode, {} to decode, {:+.1f} dB", points[points.size() / 2].first,
                    rate_change(full, some), change_words(encode_ms(full), encode_ms(some)),
                    change_words(decode_ms(full), decode_ms(some)),
                    value_of(some, "m3_foreground_db") - value_of(full, "m3_foreground_db")),
        "in part",
        bits_per_vertex(some) < bits_per_vertex(full) && encode_ms(some) < encode_ms(full) &&
            decode_ms(some) < decode_ms(full)};
    if (claim.holds) claim.verdict = "holds";
    return claim;
}

// ---- Figure 19: motion-based coding at rising rates, and the seam before and after zippering ------------------------

namespace {

constexpr Colour coded_tint{230, 125, 45}, animated_tint{90, 150, 215}, stitch_tint{60, 170, 90};
constexpr std::size_t most_seams = 10;  // frames whose seams are counted

struct MotionShot {
    std::size_t first = 0, frame = 0;       // the I-frame, and the frame to show
    std::vector<std::size_t> partly_coded;  // ascending: frames in which some bones move and some are still
};

std::vector<std::size_t> every_frame(std::size_t first, std::size_t last) {
    std::vector<std::size_t> out;
    for (std::size_t i = first; i <= last; ++i) out.push_back(i);
    return out;
}

// In the group two thirds into the sequence, the frame in which the share of bones that move by the threshold is
// nearest to half.
Result<MotionShot> choose_shot(const SourceFrames& source, int key_interval, double threshold) {
    const auto interval = static_cast<std::size_t>(key_interval);
    MotionShot out;
    out.first = (source.size() * 2 / 3) / interval * interval;
    if (out.first + 1 >= source.size()) out.first = 0;
    const auto reference = source.frame(out.first);
    if (!reference) return tl::unexpected(reference.error());
    const auto& skeleton = source.facts().skeleton;
    double best = 2;
    for (const auto i : every_frame(out.first + 1, std::min(out.first + interval, source.size()) - 1)) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        if (!(*reference)->pose || !(*frame)->pose) continue;
        const auto motion = bone_motion(skeleton, *(*reference)->pose, *(*frame)->pose);
        const auto moving = std::count_if(motion.begin(), motion.end(), [&](double m) { return m >= threshold; });
        const double part = static_cast<double>(moving) / static_cast<double>(motion.size());
        if (moving > 0 && part < 1) out.partly_coded.push_back(i);
        if (std::abs(part - 0.5) > best) continue;
        best = std::abs(part - 0.5);
        out.frame = i;
    }
    if (out.frame == 0) return fail(ErrorKind::bad_input, "no frame after an I-frame");
    return out;
}

// At most `most`, evenly spread, including the frame shown.
std::vector<std::size_t> spread(const std::vector<std::size_t>& frames, std::size_t most, std::size_t shown) {
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < std::min(most, frames.size()); ++i)
        out.push_back(frames[i * frames.size() / std::min(most, frames.size())]);
    if (std::find(out.begin(), out.end(), shown) == out.end() && !out.empty()) {
        auto nearest = std::min_element(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
            return std::llabs(static_cast<long long>(a) - static_cast<long long>(shown)) <
                   std::llabs(static_cast<long long>(b) - static_cast<long long>(shown));
        });
        *nearest = shown;
        std::sort(out.begin(), out.end());
    }
    return out;
}

Result<double> surface_error(const Mesh& original, const Mesh& decoded, unsigned threads) {
    CompareOptions options;
    options.points = options.regions = options.cloud = options.pictures = options.topology = false;
    options.surface_options.samples = 100000;
    const internal::ThreadPool pool(threads);
    options.threads = pool.threads();
    const auto compared = compare_frame(original, decoded, options);
    if (!compared) return tl::unexpected(compared.error());
    return m2(compared->surface);
}

// Three of the thresholds at which not everything is coded: low, middle, high.
std::vector<std::pair<double, const RdPoint*>> shown_points(const Findings& findings) {
    auto all = by_threshold(findings.motion, still_below_words, findings.thresholds->still_below);
    std::erase_if(all, [](const auto& entry) { return !(entry.first > 0); });
    if (all.size() <= 3) return all;
    return {all.front(), all[all.size() / 2], all.back()};
}

Result<Figure> figure_19(const SourceFrames& source, const ExperimentPlan& plan, const Findings& findings,
                         const MotionShot& shot, double azimuth, const GalleryOptions& options) {
    Figure figure{"19",
                  fmt::format("a frame by motion-based coding, frame {}", shot.frame),
                  "Shows a frame at 11.5, 13.2 and 14.5 bpvf; differences are hard to see where the skeleton is good.",
                  {},
                  "From left to right: the original, and motion-based coding at falling thresholds; smooth shading. "
                  "Rates are the whole sequence's. The animation is unchecked, as in the paper."};
    const auto original = source.frame(shot.frame);
    if (!original) return tl::unexpected(original.error());
    std::vector<Mesh> decoded;
    std::vector<std::string> labels{"original"};
    auto points = shown_points(findings);
    std::reverse(points.begin(), points.end());
    for (const auto& [threshold, point] : points) {
        PictureJob job{motion_coder(plan.key_interval, threshold),
                       point->geometry_step,
                       point->colour_step,
                       bits_per_vertex(*point),
                       {shot.frame},
                       shot.first};
        auto meshes = decode_frames(source, job, options.threads);
        if (!meshes) return tl::unexpected(meshes.error());
        const auto error = surface_error((*original)->mesh, meshes->front(), options.threads);
        if (!error) return tl::unexpected(error.error());
        labels.push_back(
            fmt::format("coded above {:g} mm: {:.1f} bpvf, M2 {:.2f} mm", threshold, bits_per_vertex(*point), *error));
        figure.found += fmt::format("{}{:.2f} mm at {:.1f} bpvf", figure.found.empty() ? "M2 of this frame: " : ", ",
                                    *error, bits_per_vertex(*point));
        decoded.push_back(std::move(meshes->front()));
    }
    figure.found += ".";
    std::vector<const Mesh*> meshes{&(*original)->mesh};
    for (const auto& mesh : decoded) meshes.push_back(&mesh);
    for (const bool close_up : {false, true}) {
        RenderOptions render_options;
        const auto pictures =
            draw_tiles(meshes, {azimuth, close_up, close_up ? 300 : 440}, render_options, options.threads);
        if (!pictures) return tl::unexpected(pictures.error());
        auto row = save_tiles(*pictures, labels, options.folder, close_up ? "figure_19_close" : "figure_19");
        if (!row) return tl::unexpected(row.error());
        figure.tiles.push_back(std::move(*row));
    }
    return figure;
}

// The triangles near the spot, without those in front of it.
Mesh around(const Mesh& mesh, const SeamSpot& spot, double radius) {
    Mesh out = mesh;
    out.triangles.clear();
    const auto is_near = [&](std::uint32_t v) {
        const Point3 offset = to_point(mesh.positions[v]) - spot.centre;
        return length(offset) <= 1.5 * radius && dot(offset, spot.normal) <= 0.4 * radius;
    };
    for (const auto& t : mesh.triangles)
        if (std::all_of(t.begin(), t.end(), is_near)) out.triangles.push_back(t);
    return out;
}

Result<std::vector<Picture>> draw_spot(const std::vector<Mesh>& meshes, const SeamSpot& spot, double radius, int height,
                                       unsigned threads) {
    const double half = 0.55 * radius;
    Box box;
    box.low = spot.centre - Point3{{half, half, half}};
    box.high = spot.centre + Point3{{half, half, half}};
    box.empty = false;
    ViewOptions views;
    views.views = 1;
    views.first_azimuth = std::atan2(spot.normal[0], spot.normal[2]) * 180 / std::numbers::pi;
    views.elevation =
        std::clamp(std::asin(std::clamp(spot.normal[1], -1.0, 1.0)) * 180 / std::numbers::pi, -60.0, 60.0);
    views.orthographic = true;
    views.margin = 0;
    views.width = views.height = 2 * height;
    const auto cameras = cameras_round(box, views);
    if (!cameras) return tl::unexpected(cameras.error());
    RenderOptions options;
    options.shading = Shading::flat;
    const internal::ThreadPool pool(threads);
    std::vector<Picture> out;
    for (const auto& mesh : meshes)
        out.push_back(halved(render(around(mesh, spot, radius), cameras->front(), options, pool.threads())));
    return out;
}

struct Counts {
    double open_edges = 0, cracks = 0, crack_length = 0, flaps = 0, flap_area = 0, non_manifold = 0;
};

Counts mean_counts(const std::vector<SeamCounts>& seams, Topology SeamCounts::*stage) {
    Counts out;
    for (const auto& seam : seams) {
        const auto& t = seam.*stage;
        const double n = static_cast<double>(seams.size());
        out.open_edges += static_cast<double>(t.open_edges) / n;
        out.cracks += static_cast<double>(t.cracks) / n;
        out.crack_length += t.crack_length / n;
        out.flaps += static_cast<double>(t.flaps) / n;
        out.flap_area += t.flap_area / n;
        out.non_manifold += static_cast<double>(t.non_manifold_edges) / n;
    }
    return out;
}

std::string seam_words(const std::vector<SeamCounts>& seams) {
    const auto before = mean_counts(seams, &SeamCounts::overlapping), after = mean_counts(seams, &SeamCounts::zippered),
               trimmed = mean_counts(seams, &SeamCounts::trimmed), original = mean_counts(seams, &SeamCounts::original),
               animated = mean_counts(seams, &SeamCounts::animated);
    std::string out = fmt::format(
        "A frame on average, over {} frames: laid over each other, the parts have {:.0f} open edges, and {:.0f} mm² "
        "lie "
        "double or close to double; trimmed, {:.0f} open edges, {:.1f} cracks of {:.0f} mm in all and {:.0f} mm²; "
        "zippered, {:.1f} open edges, {:.1f} cracks of {:.1f} mm and {:.0f} mm².",
        seams.size(), before.open_edges, before.flap_area, trimmed.open_edges, trimmed.cracks, trimmed.crack_length,
        trimmed.flap_area, after.open_edges, after.cracks, after.crack_length, after.flap_area);
    return out + fmt::format(
                     " Without a seam, the captured mesh has {:.1f} open edges and {:.0f} mm², and the I-frame's mesh, "
                     "animated as a whole, {:.1f} and {:.0f} mm².",
                     original.open_edges, original.flap_area, animated.open_edges, animated.flap_area);
}

Result<Figure> zippering_figure(const Mesh& original, const SeamStages& stages, double azimuth,
                                const GalleryOptions& options, const Findings& findings) {
    Figure figure{"19b", fmt::format("the seams of a motion-coded frame, frame {}", stages.frame),
                  "Overlapping border triangles are trimmed, one border is cut back to the other, and both are "
                  "zippered into one surface.",
                  seam_words(findings.seams),
                  "Orange: coded. Blue: the I-frame's mesh, animated. Green: stitches. Below, a seam close up, flat "
                  "shading. A crack is an open edge that faces another within two mean edges; a flap, two layers of "
                  "surface within half an edge."};
    const Mesh overlapping = tinted(stages.overlapping, stages.coded_triangles, stages.overlapping.triangles.size()),
               trimmed = tinted(stages.trimmed, stages.coded_triangles, stages.kept_end),
               zippered = tinted(stages.zippered, stages.coded_triangles, stages.kept_end);
    const auto whole =
        draw_tiles({&original, &overlapping, &zippered, &stages.zippered}, {azimuth, false, 440}, {}, options.threads);
    if (!whole) return tl::unexpected(whole.error());
    auto row = save_tiles(*whole, {"original", "coded and animated parts", "zippered", "zippered, as it is shown"},
                          options.folder, "figure_19b");
    if (!row) return tl::unexpected(row.error());
    figure.tiles.push_back(std::move(*row));
    std::vector<Picture> strip(whole->begin(), whole->end());
    const double radius = 8 * internal::mean_edge(original.positions, original.triangles);
    if (const auto spot = busiest_seam(stages, radius)) {
        const auto close =
            draw_spot({overlapping, trimmed, zippered, stages.zippered}, *spot, radius, 440, options.threads);
        if (!close) return tl::unexpected(close.error());
        row = save_tiles(*close, {"overlapping", "trimmed", "zippered", "zippered, as it is shown"}, options.folder,
                         "figure_19b_close");
        if (!row) return tl::unexpected(row.error());
        figure.tiles.push_back(std::move(*row));
        strip = {(*whole)[0], (*whole)[1], (*whole)[2], (*close)[0], (*close)[1], (*close)[2]};
    }
    if (auto written = write_png(side_by_side(strip), (options.folder / "zippering.png").string()); !written)
        return tl::unexpected(written.error());
    return figure;
}

Result<Figure> seams(const SourceFrames& source, const ExperimentPlan& plan, const MotionShot& shot, double threshold,
                     double azimuth, const GalleryOptions& options, Findings& findings) {
    auto coder = paper_options(plan.key_interval);
    coder.topology.still_below = threshold;
    coder.topology.animation_error = 0;
    coder.geometry_step = plan.motion_step;
    coder.colour_step = plan.picture_colour_step;
    coder.threads = options.threads;
    auto numbers = spread(shot.partly_coded, most_seams, shot.frame);
    numbers.insert(numbers.begin(), shot.first);
    std::vector<std::shared_ptr<const SourceFrame>> frames;
    for (const auto number : numbers) {
        auto frame = source.frame(number);
        if (!frame) return tl::unexpected(frame.error());
        frames.push_back(std::move(*frame));
    }
    const auto stages = code_in_stages(frames, source.facts(), coder);
    if (!stages) return tl::unexpected(stages.error());
    const SeamStages* shown = nullptr;
    for (const auto& stage : *stages) {
        const auto original = source.frame(stage.frame);
        if (!original) return tl::unexpected(original.error());
        const auto counted = count_seams((*original)->mesh, stage, options.threads);
        if (!counted) return tl::unexpected(counted.error());
        findings.seams.push_back(*counted);
        if (!shown || stage.frame == shot.frame) shown = &stage;
    }
    if (!shown) {
        Figure figure{"19b", "the seams of a motion-coded frame", {}, {}, {}};
        figure.skipped = "no frame has both bones that move and bones that are still.";
        return figure;
    }
    const auto original = source.frame(shown->frame);
    if (!original) return tl::unexpected(original.error());
    return zippering_figure((*original)->mesh, *shown, azimuth, options, findings);
}

}  // namespace

Mesh tinted(const Mesh& mesh, std::size_t coded_triangles, std::size_t kept_end) {
    Mesh out;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        for (const auto v : mesh.triangles[t]) out.positions.push_back(mesh.positions[v]);
        const auto tint = t < coded_triangles ? coded_tint : t < kept_end ? animated_tint : stitch_tint;
        out.colours.insert(out.colours.end(), 3, tint);
        out.triangles.push_back({first, first + 1, first + 2});
    }
    return out;
}

std::optional<SeamSpot> busiest_seam(const SeamStages& stages, double radius) {
    const auto& mesh = stages.zippered;
    std::vector<SeamSpot> stitches;
    for (std::size_t t = stages.kept_end; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Point3 corners[] = {to_point(mesh.positions[a]), to_point(mesh.positions[b]),
                                  to_point(mesh.positions[c])};
        stitches.push_back({(corners[0] + corners[1] + corners[2]) * (1.0 / 3),
                            normalised(cross(corners[1] - corners[0], corners[2] - corners[0]))});
    }
    std::optional<SeamSpot> best;
    double most = 0;
    for (const auto& stitch : stitches) {
        Point3 normal{{0, 0, 0}};
        double near = 0;
        for (const auto& other : stitches) {
            if (length(other.centre - stitch.centre) > radius / 2) continue;
            normal = normal + other.normal;
            ++near;
        }
        // Many stitches that face the same way: from there they are side by side in a picture.
        const double together = length(normal), score = together * together / near;
        if (!(score > most)) continue;
        most = score;
        best = SeamSpot{stitch.centre, normalised(normal)};
    }
    return best;
}

std::optional<Table> seam_table(const Findings& findings) {
    if (findings.seams.empty()) return std::nullopt;
    Table table;
    table.title = "Seams of motion-based coding";
    table.head = {"Stage, mean of a frame", "open edges", "cracks", "crack mm", "flaps", "flap mm²",
                  "non-manifold edges"};
    const std::pair<const char*, Topology SeamCounts::*> stages[] = {{"as captured", &SeamCounts::original},
                                                                     {"animated alone", &SeamCounts::animated},
                                                                     {"laid over each other", &SeamCounts::overlapping},
                                                                     {"trimmed", &SeamCounts::trimmed},
                                                                     {"zippered", &SeamCounts::zippered}};
    for (const auto& [name, stage] : stages) {
        const auto counts = mean_counts(findings.seams, stage);
        table.rows.push_back({name, fmt::format("{:.1f}", counts.open_edges), fmt::format("{:.1f}", counts.cracks),
                              fmt::format("{:.1f}", counts.crack_length), fmt::format("{:.1f}", counts.flaps),
                              fmt::format("{:.0f}", counts.flap_area), fmt::format("{:.1f}", counts.non_manifold)});
    }
    table.note = fmt::format("{} frames, partly coded.", findings.seams.size());
    return table;
}

Result<std::vector<Figure>> motion_pictures(const SourceFrames& source, const ExperimentPlan& plan,
                                            const std::set<int>& wanted, const GalleryOptions& options,
                                            Findings& findings) {
    std::vector<Figure> out;
    if (!wanted.contains(19)) return out;
    if (!findings.thresholds || findings.motion.empty()) {
        Figure figure{"19", "a frame by motion-based coding", {}, {}, {}};
        figure.skipped = "the capture has no skeleton whose motion could choose.";
        out.push_back(std::move(figure));
        return out;
    }
    const auto points = shown_points(findings);
    if (points.empty()) return out;
    const double threshold = points[points.size() / 2].first;
    const auto shot = choose_shot(source, plan.key_interval, threshold);
    if (!shot) return tl::unexpected(shot.error());
    const auto shown = source.frame(shot->frame);
    if (!shown) return tl::unexpected(shown.error());
    const double azimuth =
        options.azimuth.value_or(front_azimuth((*shown)->mesh, source.facts().skeleton, (*shown)->pose));
    auto pictures = figure_19(source, plan, findings, *shot, azimuth, options);
    if (!pictures) return tl::unexpected(pictures.error());
    out.push_back(std::move(*pictures));
    auto zippered = seams(source, plan, *shot, threshold, azimuth, options, findings);
    if (!zippered) return tl::unexpected(zippered.error());
    out.push_back(std::move(*zippered));
    return out;
}

}  // namespace htvm::lab
