#include "reproduce_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace htvm::lab {
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

// From the right to the left of the body, on the floor (x, z).
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

// Where the vertices between two heights are, on the floor; heights as parts of the body's.
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
    const bool intra_only = job.coder.name == "tfan" || job.coder.name.starts_with("draco");
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
    // With y up, who has the left hand towards +x looks towards +z.
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
        // The upper two fifths, and as wide as that is high, round the middle of the head.
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

}  // namespace htvm::lab
