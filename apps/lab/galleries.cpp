#include "galleries.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <new>
#include <numbers>

#include "command_line/terminal.h"
#include "core/parallel.h"
#include "experiments.h"
#include "findings.h"
#include "metrics/compare.h"

namespace htvm::lab {

using namespace app;
using namespace internal;

// ---- Decoded frames side by side ------------------------------------------------------------------------------------

namespace {

std::optional<std::size_t> joint_like(const Skeleton& skeleton, bool left, const std::string& part) {
    for (std::size_t i = 0; i < skeleton.joint_names.size(); ++i) {
        std::string name = skeleton.joint_names[i];
        for (auto& c : name)
            if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
        if (name.find(part) == std::string::npos) continue;
        const bool says_left = name.find("left") != std::string::npos || name.front() == 'l';
        const bool says_right = name.find("right") != std::string::npos || name.front() == 'r';
        if (left ? says_left : says_right) return i;
    }
    return std::nullopt;
}

// From the right side of the body to the left, on the floor (x, z).
std::optional<std::array<double, 2>> leftwards(const Skeleton& skeleton, const std::optional<Pose>& pose) {
    if (!pose) return std::nullopt;
    for (const char* part : {"hip", "shoulder", "arm"}) {
        const auto left = joint_like(skeleton, true, part), right = joint_like(skeleton, false, part);
        if (!left || !right || *left >= pose->joints.size() || *right >= pose->joints.size()) continue;
        const auto& l = pose->joints[*left];
        const auto& r = pose->joints[*right];
        if (std::hypot(l[0] - r[0], l[2] - r[2]) > 1) return std::array<double, 2>{l[0] - r[0], l[2] - r[2]};
    }
    return std::nullopt;
}

// The centre on the floor of the vertices between two heights, given as fractions of the body's height.
std::optional<std::array<double, 2>> centre_between(const Mesh& mesh, const Box& box, double low, double high) {
    const double bottom = box.low[1], height = box.high[1] - box.low[1];
    std::array<double, 2> sum{0, 0};
    double count = 0;
    for (const auto& p : mesh.positions) {
        const double part = (static_cast<double>(p[1]) - bottom) / height;
        if (!(part >= low && part <= high)) continue;
        sum[0] += static_cast<double>(p[0]);
        sum[1] += static_cast<double>(p[2]);
        ++count;
    }
    if (count == 0) return std::nullopt;
    return std::array<double, 2>{sum[0] / count, sum[1] / count};
}

double degrees(double x, double z) { return std::atan2(x, z) * 180 / std::numbers::pi; }

bool wanted(const PictureJob& job, std::size_t frame) {
    return std::find(job.frames.begin(), job.frames.end(), frame) != job.frames.end();
}

}  // namespace

Result<std::vector<Mesh>> decode_frames(const SourceFrames& source, const PictureJob& job, unsigned threads) {
    QualityPoint quality;
    quality.geometry_step = job.geometry_step;
    quality.colour_step = job.colour_step;
    quality.threads = threads;
    const auto coder = job.coder.start(source.facts(), quality);
    if (!coder) return tl::unexpected(coder.error());
    const bool intra_only = job.coder.name.starts_with("tfan") || job.coder.name.starts_with("draco");
    std::vector<Mesh> out;
    for (std::size_t i = job.first; i <= job.frames.back(); ++i) {
        if (intra_only && !wanted(job, i)) continue;
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        auto coded = (*coder)(**frame);
        if (!coded) return tl::unexpected(coded.error());
        if (wanted(job, i)) out.push_back(std::move(coded->decoded));
    }
    return out;
}

double front_azimuth(const Mesh& mesh, const Skeleton& skeleton, const std::optional<Pose>& pose) {
    // With y up, a person whose left hand points towards +x looks towards +z.
    if (const auto left = leftwards(skeleton, pose)) return degrees(-(*left)[1], (*left)[0]);
    const Box box = bounding_box(mesh);
    if (box.empty || !(box.high[1] > box.low[1])) return 0;
    const auto feet = centre_between(mesh, box, 0, 0.03), shins = centre_between(mesh, box, 0.08, 0.2);
    if (!feet || !shins) return 0;
    return degrees((*feet)[0] - (*shins)[0], (*feet)[1] - (*shins)[1]);
}

Crop covered_part(const Picture& picture) {
    int left = picture.width, right = -1, top = picture.height, bottom = -1;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            if (!picture.covered[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                                 static_cast<std::size_t>(x)])
                continue;
            left = std::min(left, x);
            right = std::max(right, x);
            top = std::min(top, y);
            bottom = std::max(bottom, y);
        }
    }
    if (right < 0) return {0, 0, picture.width, picture.height};
    const int margin = (bottom - top + 1) / 50 + 1;
    left = std::max(0, left - margin);
    top = std::max(0, top - margin);
    right = std::min(picture.width - 1, right + margin);
    bottom = std::min(picture.height - 1, bottom + margin);
    return {left, top, right - left + 1, bottom - top + 1};
}

Picture cropped(const Picture& picture, const Crop& crop) {
    Picture out;
    out.width = crop.width;
    out.height = crop.height;
    for (int y = 0; y < crop.height; ++y) {
        const auto begin = static_cast<std::ptrdiff_t>(crop.top + y) * picture.width + crop.left;
        out.rgb.insert(out.rgb.end(), picture.rgb.begin() + 3 * begin, picture.rgb.begin() + 3 * (begin + crop.width));
        out.covered.insert(out.covered.end(), picture.covered.begin() + begin,
                           picture.covered.begin() + begin + crop.width);
    }
    return out;
}

Picture halved(const Picture& picture) {
    Picture out;
    out.width = picture.width / 2;
    out.height = picture.height / 2;
    const auto at = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x);
    };
    for (int y = 0; y < out.height; ++y) {
        for (int x = 0; x < out.width; ++x) {
            const std::array<std::size_t, 4> four = {at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1),
                                                     at(2 * x + 1, 2 * y + 1)};
            for (std::size_t channel = 0; channel < 3; ++channel) {
                int sum = 2;
                for (const auto pixel : four) sum += picture.rgb[3 * pixel + channel];
                out.rgb.push_back(static_cast<std::uint8_t>(sum / 4));
            }
            bool covered = false;
            for (const auto pixel : four) covered = covered || picture.covered[pixel] != 0;
            out.covered.push_back(covered ? 1 : 0);
        }
    }
    return out;
}

Result<std::vector<Picture>> draw_tiles(const std::vector<const Mesh*>& meshes, const TileView& view,
                                        const RenderOptions& options, unsigned threads) {
    Box box = bounding_box(*meshes.front());
    ViewOptions views;
    views.views = 1;
    views.first_azimuth = view.azimuth;
    views.orthographic = true;
    views.margin = 0.02;
    views.height = 2 * view.height;
    views.width = 3 * view.height;
    if (view.close_up && !box.empty) {
        // The upper two fifths, equally wide, around the middle of the head.
        const double height = box.high[1] - box.low[1], half = 0.2 * height;
        const auto head = centre_between(*meshes.front(), box, 0.9, 1).value_or(std::array<double, 2>{0, 0});
        const double aside = 0.9 * half / std::numbers::sqrt2;
        box.low = {{head[0] - aside, box.high[1] - 2 * half, head[1] - aside}};
        box.high = {{head[0] + aside, box.high[1], head[1] + aside}};
        views.width = views.height * 9 / 10;
        views.margin = 0;
    }
    const auto cameras = cameras_round(box, views);
    if (!cameras) return tl::unexpected(cameras.error());
    std::vector<Picture> out;
    std::optional<Crop> crop;
    const internal::ThreadPool pool(threads);
    for (const auto* mesh : meshes) {
        const Picture picture = render(*mesh, cameras->front(), options, pool.threads());
        if (!crop) crop = view.close_up ? Crop{0, 0, picture.width, picture.height} : covered_part(picture);
        out.push_back(halved(cropped(picture, *crop)));
    }
    return out;
}

Result<std::vector<Tile>> save_tiles(const std::vector<Picture>& pictures, const std::vector<std::string>& labels,
                                     const std::filesystem::path& folder, const std::string& name) {
    std::vector<Tile> out;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const auto path = folder / fmt::format("{}_{}.png", name, i);
        if (auto written = write_png(pictures[i], path.string()); !written) return tl::unexpected(written.error());
        out.push_back({path, labels[i]});
    }
    return out;
}

// ---- Figures 8, 9, 14 and 15 ----------------------------------------------------------------------------------------

namespace {

constexpr const char* no_rates = "the coders share no range of rates in this run, so that none can be matched.";

// One rate: the decoded frames of the two coders, [coder][frame], and their surface errors.
struct Match {
    double rate = 0;
    std::array<std::vector<Mesh>, 2> decoded;
    std::array<std::vector<double>, 2> m2_mm;
};

struct Shot {
    std::vector<std::size_t> frames;  // two: one near the I-frame at the start of the run, one far from it
    std::size_t first = 0;
};

Shot choose_frames(std::size_t count, int key_interval) {
    Shot shot;
    std::size_t far = count * 2 / 3;
    const auto interval = static_cast<std::size_t>(std::max(key_interval, 1));
    if (interval > 1 && far % interval == 0 && far + 1 < count) ++far;  // so that it is not an I-frame
    far = std::min(far, count - 1);
    shot.first = far / interval * interval;
    shot.frames = {shot.first + (far - shot.first + 1) / 2, far};
    if (shot.frames[0] == shot.frames[1]) shot.frames.pop_back();
    return shot;
}

Result<double> surface_error_of(const SourceFrames& source, std::size_t index, const Mesh& decoded) {
    const auto frame = source.frame(index);
    if (!frame) return tl::unexpected(frame.error());
    CompareOptions options;
    options.points = options.regions = options.cloud = options.pictures = options.topology = false;
    options.surface_options.samples = 100000;
    const auto compared = compare_frame((*frame)->mesh, decoded, options);
    if (!compared) return tl::unexpected(compared.error());
    return m2(compared->surface);
}

Result<void> run_one(const SourceFrames& source, const PictureJob& job, std::size_t coder, Match& match) {
    try {
        auto decoded = decode_frames(source, job, 1);
        if (!decoded) return tl::unexpected(decoded.error());
        for (std::size_t i = 0; i < decoded->size(); ++i) {
            const auto error = surface_error_of(source, job.frames[i], (*decoded)[i]);
            if (!error) return tl::unexpected(error.error());
            match.m2_mm[coder].push_back(*error);
        }
        match.decoded[coder] = std::move(*decoded);
        return {};
    } catch (const std::bad_alloc&) {
        return fail(ErrorKind::limit, "out of memory");
    } catch (const std::exception& error) {
        return fail(ErrorKind::bad_input, error.what());
    }
}

// Both coders at each of the rates that the points reach.
Result<std::vector<Match>> match_rates(const SourceFrames& source, const std::vector<RdPoint>& points, int count,
                                       double highest, bool colours, const Shot& shot, const GalleryOptions& options) {
    constexpr std::array<const char*, 2> coders = {"paper", "tfan"};
    const auto built_in = built_in_coders(options.key_interval);
    std::vector<Match> matches;
    std::vector<PictureJob> jobs;
    for (const double rate : matched_rates(points, "paper", "tfan", count, highest)) {
        const auto ours = geometry_step_at_rate(points, "paper", rate),
                   theirs = geometry_step_at_rate(points, "tfan", rate);
        if (!ours || !theirs) continue;
        matches.push_back({rate, {}, {}});
        for (std::size_t i = 0; i < coders.size(); ++i)
            for (const auto& coder : built_in)
                if (coder.name == coders[i])
                    jobs.push_back({colours ? coder : without_colours(coder), i == 0 ? *ours : *theirs,
                                    options.colour_step, rate, shot.frames, shot.first});
    }
    std::vector<Result<void>> results(jobs.size());
    std::atomic<std::size_t> next = 0;
    const ThreadPool pool(options.threads);
    parallel_for(pool.threads().count, pool.threads(), 1, [&](std::size_t, std::size_t) {
        for (std::size_t i = next++; i < jobs.size(); i = next++)
            results[i] = run_one(source, jobs[i], i % 2, matches[i / 2]);
    });
    for (const auto& result : results)
        if (!result) return tl::unexpected(result.error());
    return matches;
}

// A row: the original, then the coder's meshes by rising rate.
Result<std::vector<Tile>> coder_row(const Mesh& original, const std::vector<const Match*>& matches, std::size_t coder,
                                    std::size_t frame, const TileView& view, const RenderOptions& render_options,
                                    const GalleryOptions& options, const std::string& name) {
    std::vector<const Mesh*> meshes{&original};
    std::vector<std::string> labels{"original"};
    for (const auto* match : matches) {
        meshes.push_back(&match->decoded[coder][frame]);
        labels.push_back(fmt::format("{}, {:.1f} bpvf, M2 {:.2f} mm", look_of_coder(coder == 0 ? "paper" : "tfan").name,
                                     match->rate, match->m2_mm[coder][frame]));
    }
    const auto pictures = draw_tiles(meshes, view, render_options, options.threads);
    if (!pictures) return tl::unexpected(pictures.error());
    return save_tiles(*pictures, labels, options.folder, name);
}

std::string surface_words(const std::vector<const Match*>& matches, std::size_t frame) {
    std::string out = "M2 of this frame, the paper's coder and TFAN:";
    for (const auto* match : matches)
        out += fmt::format(" {:.2f} and {:.2f} mm at {:.1f} bpvf;", match->m2_mm[0][frame], match->m2_mm[1][frame],
                           match->rate);
    out.back() = '.';
    const std::string often = matches.size() == 1 ? "." : " each time.";
    std::size_t better = 0;
    for (const auto* match : matches) better += match->m2_mm[0][frame] < match->m2_mm[1][frame] ? 1 : 0;
    if (better == matches.size()) return out + " The paper's coder is nearer to the original" + often;
    if (better == 0) return out + " TFAN is nearer to the original" + often;
    return out + fmt::format(" The paper's coder is nearer to the original at {} of {} rates.", better, matches.size());
}

// One figure with two rows, ours on top, of the frame shot.frames[frame].
Result<Figure> two_rows(Figure figure, const SourceFrames& source, const std::vector<const Match*>& matches,
                        const Shot& shot, std::size_t frame, const TileView& view, const RenderOptions& render_options,
                        const GalleryOptions& options) {
    if (matches.empty()) {
        figure.skipped = no_rates;
        return figure;
    }
    frame = std::min(frame, shot.frames.size() - 1);
    const auto original = source.frame(shot.frames[frame]);
    if (!original) return tl::unexpected(original.error());
    for (std::size_t coder = 0; coder < 2; ++coder) {
        auto row = coder_row((*original)->mesh, matches, coder, frame, view, render_options, options,
                             fmt::format("figure_{:0>2}_{}", figure.number, coder == 0 ? "paper" : "tfan"));
        if (!row) return tl::unexpected(row.error());
        figure.tiles.push_back(std::move(*row));
    }
    figure.title += fmt::format(", frame {}", shot.frames[frame]);
    figure.found += surface_words(matches, frame);
    figure.how += " Rates are the whole sequence's, read off the measured curves, the same for both coders.";
    return figure;
}

// Original, ours and TFAN in one row.
Result<std::vector<Tile>> one_row(const SourceFrames& source, const Match& match, const Shot& shot, std::size_t frame,
                                  const TileView& view, const RenderOptions& render_options,
                                  const GalleryOptions& options, const std::string& name, bool joined) {
    frame = std::min(frame, shot.frames.size() - 1);
    const auto original = source.frame(shot.frames[frame]);
    if (!original) return tl::unexpected(original.error());
    std::vector<std::string> labels{"original"};
    for (std::size_t coder = 0; coder < 2; ++coder)
        labels.push_back(fmt::format("{}, {:.1f} bpvf, M2 {:.2f} mm", look_of_coder(coder == 0 ? "paper" : "tfan").name,
                                     match.rate, match.m2_mm[coder][frame]));
    const auto pictures = draw_tiles({&(*original)->mesh, &match.decoded[0][frame], &match.decoded[1][frame]}, view,
                                     render_options, options.threads);
    if (!pictures) return tl::unexpected(pictures.error());
    if (joined)
        if (auto written = write_png(side_by_side(*pictures), (options.folder / "first_results.png").string());
            !written)
            return tl::unexpected(written.error());
    return save_tiles(*pictures, labels, options.folder, name);
}

RenderOptions shaded(Shading shading, bool colours) {
    RenderOptions options;
    options.shading = shading;
    options.colours = colours;
    return options;
}

std::vector<const Match*> pointers(const std::vector<Match>& matches) {
    std::vector<const Match*> out;
    for (const auto& match : matches) out.push_back(&match);
    return out;
}

Result<void> geometry_figures(const SourceFrames& source, const std::vector<Match>& matches, const Shot& shot,
                              const std::set<int>& wanted, double azimuth, const GalleryOptions& options,
                              Gallery& gallery) {
    const std::string how = "The original first, the paper's coder on top, TFAN below; geometry alone.";
    if (wanted.contains(8)) {
        auto figure =
            two_rows({"8",
                      "a whole frame at rising rates, flat shading",
                      "Shows a frame at 6.3, 8.7, 10.55 and 11.5 bpvf above MPEG-4 TFAN at 7.7, 8.8, 10.45 and 12.6.",
                      {},
                      how},
                     source, pointers(matches), shot, 1, {azimuth, false, 440}, shaded(Shading::flat, false), options);
        if (!figure) return tl::unexpected(figure.error());
        gallery.figures.push_back(std::move(*figure));
    }
    if (wanted.contains(9)) {
        auto figure =
            two_rows({"9",
                      "a frame close up at rising rates, smooth shading",
                      "Shows a frame at 5.7, 10.81 and 13.4 bpvf above MPEG-4 TFAN at 7.5, 12.58 and 14.75.",
                      {},
                      how},
                     source, pointers(matches), shot, 0, {azimuth, true, 300}, shaded(Shading::smooth, false), options);
        if (!figure) return tl::unexpected(figure.error());
        gallery.figures.push_back(std::move(*figure));
    }
    return {};
}

Result<void> colour_figures(const SourceFrames& source, const std::vector<Match>& matches, const Shot& shot,
                            const std::set<int>& wanted, double azimuth, const GalleryOptions& options,
                            Gallery& gallery) {
    Figure close{"14",
                 "colours close up, smooth shading",
                 "Shows its coder at 13.2 bpvf beside MPEG-4 TFAN at 15.8.",
                 {},
                 "From left to right: the original, the paper's coder, TFAN at the same rate, colours included."};
    Figure whole{"15",
                 "a whole frame, unlit and with flat shading",
                 "Shows its coder at 19.8 bpvf beside MPEG-4 TFAN at 20.09.",
                 {},
                 "Top: colours without lighting; bottom: flat shading, without colours. From left to right: the "
                 "original, the paper's coder, TFAN at the same rate."};
    if (matches.empty()) close.skipped = whole.skipped = no_rates;
    if (!matches.empty() && wanted.contains(14)) {
        auto row = one_row(source, matches.front(), shot, 0, {azimuth, true, 440}, shaded(Shading::smooth, true),
                           options, "figure_14", false);
        if (!row) return tl::unexpected(row.error());
        close.tiles.push_back(std::move(*row));
        close.found = surface_words({&matches.front()}, 0);
        close.title += fmt::format(", frame {}", shot.frames.front());
    }
    if (!matches.empty() && wanted.contains(15)) {
        for (const auto shading : {Shading::unlit, Shading::flat}) {
            const bool unlit = shading == Shading::unlit;
            auto row = one_row(source, matches.back(), shot, 1, {azimuth, false, 440}, shaded(shading, unlit), options,
                               unlit ? "figure_15_unlit" : "figure_15_flat", false);
            if (!row) return tl::unexpected(row.error());
            whole.tiles.push_back(std::move(*row));
        }
        whole.found = surface_words({&matches.back()}, shot.frames.size() - 1);
        whole.title += fmt::format(", frame {}", shot.frames.back());
    }
    if (wanted.contains(14)) gallery.figures.push_back(std::move(close));
    if (wanted.contains(15)) gallery.figures.push_back(std::move(whole));
    return {};
}

Result<void> opening_row(const SourceFrames& source, const Match& match, const Shot& shot, double azimuth, bool colours,
                         const GalleryOptions& options, Gallery& gallery) {
    auto row = one_row(source, match, shot, 1, {azimuth, false, 480}, shaded(Shading::smooth, colours), options,
                       "opening", true);
    if (!row) return tl::unexpected(row.error());
    gallery.opening = std::move(*row);
    gallery.opening_caption = fmt::format(
        "Frame {} as captured, from the paper's coder and from TFAN, at the same rate.", shot.frames.back());
    return {};
}

std::vector<RdPoint> at_colour_step(const std::vector<RdPoint>& points, double step) {
    std::vector<RdPoint> out;
    for (const auto& point : points)
        if (point.colour_step == step) out.push_back(point);
    return out;
}

}  // namespace

Result<Gallery> picture_figures(const SourceFrames& source, const Findings& findings, const std::set<int>& wanted,
                                const GalleryOptions& options) {
    Gallery gallery;
    const bool geometry = wanted.contains(8) || wanted.contains(9);
    const bool colour = wanted.contains(14) || wanted.contains(15);
    if (!geometry && !colour) return gallery;
    const Shot shot = choose_frames(source.size(), options.key_interval);
    const auto shown = source.frame(shot.frames.back());
    if (!shown) return tl::unexpected(shown.error());
    const double azimuth =
        options.azimuth.value_or(front_azimuth((*shown)->mesh, source.facts().skeleton, (*shown)->pose));
    if (colour && findings.has_colour) {
        const auto points = at_colour_step(findings.colour, options.colour_step);
        const auto matches = match_rates(source, points, 2, 20, true, shot, options);
        if (!matches) return tl::unexpected(matches.error());
        if (auto ok = colour_figures(source, *matches, shot, wanted, azimuth, options, gallery); !ok)
            return tl::unexpected(ok.error());
        if (!matches->empty())
            if (auto ok = opening_row(source, matches->front(), shot, azimuth, true, options, gallery); !ok)
                return tl::unexpected(ok.error());
    } else if (colour) {
        for (const int number : {14, 15})
            if (wanted.contains(number))
                gallery.figures.push_back({std::to_string(number),
                                           "colours beside each other",
                                           {},
                                           {},
                                           {},
                                           {},
                                           {},
                                           "the capture has no colours."});
    }
    if (geometry) {
        const auto matches = match_rates(source, findings.geometry, 3, 12, false, shot, options);
        if (!matches) return tl::unexpected(matches.error());
        if (auto ok = geometry_figures(source, *matches, shot, wanted, azimuth, options, gallery); !ok)
            return tl::unexpected(ok.error());
        if (!matches->empty() && gallery.opening.empty())
            if (auto ok = opening_row(source, (*matches)[matches->size() / 2], shot, azimuth, false, options, gallery);
                !ok)
                return tl::unexpected(ok.error());
    }
    return gallery;
}

}  // namespace htvm::lab
