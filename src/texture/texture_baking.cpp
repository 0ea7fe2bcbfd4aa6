#include "texture/texture_baking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>
#include <unordered_map>

#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/raster.h"

namespace htvm {

using namespace internal;

namespace {

constexpr float undrawn = std::numeric_limits<float>::infinity();
constexpr int gutter_texels = 4;

using Texcoords = std::array<std::array<double, 2>, 3>;  // of a triangle's corners, in texels from the lower left

RasterPoint raster_point(const std::array<double, 2>& texels) {
    constexpr double unit = 1 << raster_bits, most = 1 << 20;
    // What is not below zero is rounded by cutting.
    const auto rounded = [&](double c) {
        return static_cast<std::int32_t>(std::clamp(c * unit, -most, most) + most + 0.5) -
               static_cast<std::int32_t>(most);
    };
    return {rounded(texels[0]), rounded(texels[1])};
}

double area_of(const Texcoords& p) {
    return 0.5 * ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]));
}

// Texels of an image between their centres, in whole numbers; coordinates in texels times 2^16 from its first centre.
class Sampler {
public:
    explicit Sampler(const Image& image)
        : rgb_(image.rgb.data()),
          width_(image.width),
          height_(image.height),
          row_(3 * static_cast<std::size_t>(width_)) {}
    void at(std::int64_t x, std::int64_t y, std::uint8_t* out) const {
        const std::int64_t right = (std::int64_t{width_} - 1) << 16, bottom = (std::int64_t{height_} - 1) << 16;
        x = std::clamp<std::int64_t>(x, 0, right);
        y = std::clamp<std::int64_t>(y, 0, bottom);
        const auto left = static_cast<std::size_t>(x >> 16), upper = static_cast<std::size_t>(y >> 16);
        const auto to_right = static_cast<std::uint32_t>(x >> 8 & 255), down = static_cast<std::uint32_t>(y >> 8 & 255);
        const std::uint8_t* p = rgb_ + upper * row_ + 3 * left;
        const std::size_t beside = x < right ? 3 : 0, below = y < bottom ? row_ : 0;
        const std::uint32_t a = (256 - to_right) * (256 - down), b = to_right * (256 - down);
        const std::uint32_t c = (256 - to_right) * down, d = to_right * down;
        for (std::size_t i = 0; i < 3; ++i)
            out[i] = static_cast<std::uint8_t>(
                (a * p[i] + b * p[i + beside] + c * p[i + below] + d * p[i + below + beside] + 32768) >> 16);
    }

private:
    const std::uint8_t* rgb_;
    int width_, height_;
    std::size_t row_;
};

// The shares of a plane's point below p, in the corners of the triangle that lies in the plane: beyond the triangle
// some are negative.
std::optional<std::array<double, 3>> shares_in_plane(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                                     const Vector3d& c) {
    const auto u = b - a, v = c - a, w = p - a;
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
    const double size = uu * vv - uv * uv;
    if (!(size > 1e-9 * uu * vv)) return std::nullopt;
    const double second = (vv * wu - uv * wv) / size, third = (uu * wv - uv * wu) / size;
    return std::array{1 - second - third, second, third};
}

}  // namespace

TextureBaker::TextureBaker(const TextureBakingOptions& options) : options_(options) {
    picture_.width = options.width;
    picture_.height = options.height;
    const auto texels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
    picture_.rgb.assign(3 * texels, 128);
    is_known_.assign(texels, 0);
    doubts_.assign(texels, undrawn);
    drawn_ = picture_;
}

// ---- The layout ----------------------------------------------------------------------------------------------------

bool TextureBaker::is_new(const Mesh& shown) const {
    return layout_.triangles != shown.triangles || layout_.texcoords != shown.texcoords;
}

namespace {

// By which a triangle is known again whose corners lie where they lay: it shows what it showed.
std::uint64_t key_of(const Triangle& t, std::span<const Vector2f> texcoords) {
    std::uint64_t key = 0;
    for (const auto v : t)
        for (const float c : texcoords[v])
            key = (key ^ static_cast<std::uint64_t>(std::lround(65536 * c))) * 0x9e3779b97f4a7c15u;
    return key;
}

// Each triangle's chart, from 1 on: triangles that share a vertex as shown are of one.
std::vector<std::uint32_t> charts_of(const Mesh& shown) {
    DisjointSets sets(shown.positions.size());
    for (const auto& [a, b, c] : shown.triangles) sets.join(a, b), sets.join(b, c);
    std::unordered_map<std::uint32_t, std::uint32_t> charts;
    std::vector<std::uint32_t> out;
    for (const auto& t : shown.triangles)
        out.push_back(
            charts.emplace(static_cast<std::uint32_t>(sets.of(t[0])), static_cast<std::uint32_t>(charts.size() + 1))
                .first->second);
    return out;
}

}  // namespace

namespace {

// What corresponds on this subject to a millimetre on an adult: what stands between 1.1 and 2.5 m is one.
double adult_millimetre(const Mesh& mesh) {
    constexpr double adult = 1750, shortest = 1100, longest = 2500;
    Vector3f low = mesh.positions[0], high = low;
    for (const auto& p : mesh.positions)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
        }
    double size = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) size = std::max(size, static_cast<double>(high[axis] - low[axis]));
    return size >= shortest && size <= longest ? 1 : size / adult;
}

}  // namespace

// Draws the triangles' charts into the picture. What a triangle that stays showed remains known.
std::vector<std::uint8_t> TextureBaker::place_charts(const Mesh& shown, Layout& next) const {
    const int width = options_.width, height = options_.height;
    std::vector<std::uint64_t> before;
    for (const auto& t : layout_.triangles) before.push_back(key_of(t, layout_.texcoords));
    std::sort(before.begin(), before.end());
    const auto texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    next.chart_of_texel.assign(texels, 0);
    std::vector<std::uint8_t> is_known(texels, 0);
    double in_picture = 0, in_space = 0;
    bool any_stays = false;
    for (std::size_t t = 0; t < shown.triangles.size(); ++t) {
        const bool stays =
            std::binary_search(before.begin(), before.end(), key_of(shown.triangles[t], shown.texcoords));
        any_stays = any_stays || stays;
        Texcoords at;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto& coordinates = shown.texcoords[shown.triangles[t][i]];
            at[i] = {static_cast<double>(coordinates[0]) * width, static_cast<double>(coordinates[1]) * height};
        }
        in_picture += std::abs(area_of(at));
        next.is_mirrored.push_back(area_of(at) < 0);
        in_space += length(area_vector(std::span(shown.positions), shown.triangles[t])) / 2;
        for_each_cell({raster_point(at[0]), raster_point(at[1]), raster_point(at[2])}, {0, 0, width, height},
                      [&](std::int32_t x, std::int32_t y) {
                          const auto texel = static_cast<Texel>((height - 1 - y) * width + x);
                          if (next.chart_of_texel[texel] == 0) next.inside.push_back(texel);
                          next.chart_of_texel[texel] = next.chart_of_triangle[t];
                          if (stays) is_known[texel] = is_known_[texel];
                      });
    }
    if (in_space > 0) next.texels_per_millimetre = std::sqrt(in_picture / in_space);
    add_gutters(next);
    // What lies between charts is nobody's, and stays as it is unless all is new.
    if (any_stays)
        for (std::size_t texel = 0; texel < texels; ++texel)
            if (next.chart_of_texel[texel] == 0) is_known[texel] = is_known_[texel];
    return is_known;
}

// The gutters grow ring by ring from the charts, so that each of their texels is of the nearest.
void TextureBaker::add_gutters(Layout& next) const {
    const int width = options_.width, height = options_.height;
    const auto for_each_around = [&](Texel texel, int reach, const auto& at) {
        const int x = static_cast<int>(texel) % width, y = static_cast<int>(texel) / width;
        for (int v = std::max(y - reach, 0); v <= std::min(y + reach, height - 1); ++v)
            for (int u = std::max(x - reach, 0); u <= std::min(x + reach, width - 1); ++u)
                at(static_cast<Texel>(v * width + u), (u - x) * (u - x) + (v - y) * (v - y));
    };
    std::vector<Texel> ring = next.inside, further, gutter;
    for (int step = 0; step < gutter_texels; ++step) {
        further.clear();
        for (const auto texel : ring)
            for_each_around(texel, 1, [&](Texel to, int) {
                if (next.chart_of_texel[to] != 0) return;
                next.chart_of_texel[to] = next.chart_of_texel[texel];
                further.push_back(to);
            });
        gutter.insert(gutter.end(), further.begin(), further.end());
        ring.swap(further);
    }
    std::vector<std::uint8_t> is_inside(next.chart_of_texel.size(), 0);
    for (const auto texel : next.inside) is_inside[texel] = 1;
    for (const auto texel : gutter) {
        Texel source = texel;
        int least = std::numeric_limits<int>::max();
        for_each_around(texel, gutter_texels, [&](Texel from, int squared) {
            if (is_inside[from] == 0 || squared >= least) return;
            least = squared;
            source = from;
        });
        next.gutter.push_back({texel, source});
    }
}

void TextureBaker::lay_out(const Mesh& shown, std::span<const std::uint32_t> repeated) {
    const std::size_t own = shown.positions.size() - repeated.size();
    Layout next;
    next.triangles = shown.triangles;
    next.texcoords = shown.texcoords;
    next.welded = shown.triangles;
    for (auto& t : next.welded)
        for (auto& v : t)
            if (v >= own) v = repeated[v - own];
    next.beside = triangles_beside(next.welded);
    next.chart_of_triangle = charts_of(shown);
    next.adult_millimetre = adult_millimetre(shown);
    is_known_ = place_charts(shown, next);
    layout_ = std::move(next);
}

// ---- Drawing -------------------------------------------------------------------------------------------------------

// Where a captured triangle's corners lie in the picture, in texels from the lower left, as far as its k-th corner's
// chart goes: a corner's match if that is in the chart, else by the plane of the triangle in which the k-th corner's
// is, a little beyond the chart's border. Nothing where that fails, or where a corner was matched elsewhere.
std::optional<TextureBaker::Corners> TextureBaker::corners_in_picture(const Mesh& captured, const Mesh& shown,
                                                                      const Triangle& t,
                                                                      const std::array<const SurfaceMatch*, 3>& match,
                                                                      std::size_t k) const {
    const auto place = [&](const std::array<double, 3>& shares, std::uint32_t triangle) {
        std::array<double, 2> out{};
        for (std::size_t i = 0; i < 3; ++i) {
            const auto& at = layout_.texcoords[layout_.triangles[triangle][i]];
            out[0] += shares[i] * static_cast<double>(at[0]) * options_.width;
            out[1] += shares[i] * static_cast<double>(at[1]) * options_.height;
        }
        return out;
    };
    const auto place_by_plane = [&](std::uint32_t v, std::uint32_t triangle) -> std::optional<std::array<double, 2>> {
        const auto& [a, b, c] = layout_.triangles[triangle];
        const auto shares = shares_in_plane(to_vector(captured.positions[v]), to_vector(shown.positions[a]),
                                            to_vector(shown.positions[b]), to_vector(shown.positions[c]));
        return shares ? std::optional(place(*shares, triangle)) : std::nullopt;
    };
    const auto chart_at = [&](std::size_t i) { return layout_.chart_of_triangle[match[i]->triangle]; };
    Corners at;
    for (std::size_t i = 0; i < 3; ++i) {
        if (chart_at(i) == chart_at(k)) {
            const auto& s = match[i]->shares;
            at[i] = place({static_cast<double>(s[0]), static_cast<double>(s[1]), static_cast<double>(s[2])},
                          match[i]->triangle);
        } else {
            const auto beyond = place_by_plane(t[i], match[k]->triangle);
            if (!beyond) return std::nullopt;
            at[i] = *beyond;
        }
    }
    // The captured triangle lies as the decoded one does, unless it is of the other side, whose rim came near.
    if ((area_of(at) < 0) != layout_.is_mirrored[match[k]->triangle]) return std::nullopt;
    // A triangle that comes out much larger than it is has a corner that was matched elsewhere.
    constexpr double stretch = 3, besides = 4;  // texels
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const double apart = length(to_vector(captured.positions[t[i]]) - to_vector(captured.positions[t[j]]));
        const double x = at[i][0] - at[j][0], y = at[i][1] - at[j][1];
        const double most = stretch * apart * layout_.texels_per_millimetre + besides;
        if (!(x * x + y * y <= most * most)) return std::nullopt;
    }
    return at;
}

void TextureBaker::draw(const TexturedMesh& captured, const Mesh& shown, std::span<const SurfaceMatch> matches) {
    const Mesh& mesh = captured.mesh;
    const int width = options_.width, height = options_.height;
    std::fill(doubts_.begin(), doubts_.end(), undrawn);
    const ImagePyramid pyramid(*captured.texture);
    std::vector<Sampler> samplers;
    for (std::size_t level = 0; level < pyramid.levels(); ++level) samplers.emplace_back(pyramid.at_level(level));

    // Draws a captured triangle into a chart. at: where its corners lie in the picture.
    const auto draw_triangle = [&](const Triangle& t, const Corners& at, std::uint32_t chart,
                                   const std::array<double, 3>& doubts) {
        // From places in the picture to places in the captured image.
        const double area = 2 * area_of(at);
        if (std::abs(area) < 1e-9) return;
        const auto& image = *captured.texture;
        Texcoords from;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto& c = mesh.texcoords[t[i]];
            from[i] = {static_cast<double>(c[0]) * image.width, (1 - static_cast<double>(c[1])) * image.height};
        }
        const double ratio = std::sqrt(std::abs(2 * area_of(from) / area));
        const auto level = pyramid.level_for(ratio);
        const double smaller = 1.0 / static_cast<double>(std::size_t{1} << level);
        // By x, by y, constant: what has these values at the corners, in terms of the texel. A texel's centre is half a
        // texel from its corner.
        const auto affine_of = [&](double a, double b, double c) -> std::array<double, 3> {
            const double first = b - a, second = c - a;
            const double by_x = (first * (at[2][1] - at[0][1]) - second * (at[1][1] - at[0][1])) / area;
            const double by_y = (second * (at[1][0] - at[0][0]) - first * (at[2][0] - at[0][0])) / area;
            return {by_x, by_y, a + by_x * (0.5 - at[0][0]) + by_y * (0.5 - at[0][1])};
        };
        std::array<std::array<double, 3>, 2> affine;  // per axis
        for (std::size_t axis = 0; axis < 2; ++axis) {
            affine[axis] = affine_of(from[0][axis], from[1][axis], from[2][axis]);
            for (auto& factor : affine[axis]) factor *= smaller;
            affine[axis][2] -= 0.5;
        }
        const auto doubt_of = affine_of(doubts[0], doubts[1], doubts[2]);
        constexpr double unit = 65536;
        const auto& sampler = samplers[level];
        for_each_cell({raster_point(at[0]), raster_point(at[1]), raster_point(at[2])}, {0, 0, width, height},
                      [&](std::int32_t x, std::int32_t y) {
                          const auto texel = static_cast<std::size_t>((height - 1 - y) * width + x);
                          const auto doubt = static_cast<float>(doubt_of[0] * x + doubt_of[1] * y + doubt_of[2]);
                          if (layout_.chart_of_texel[texel] != chart || doubts_[texel] <= doubt) return;
                          doubts_[texel] = doubt;
                          const auto& [u, v] = affine;
                          sampler.at(static_cast<std::int64_t>((u[0] * x + u[1] * y + u[2]) * unit),
                                     static_cast<std::int64_t>((v[0] * x + v[1] * y + v[2]) * unit),
                                     &drawn_.rgb[3 * texel]);
                      });
    };

    for (const auto& t : mesh.triangles) {
        const std::array<const SurfaceMatch*, 3> match = {&matches[t[0]], &matches[t[1]], &matches[t[2]]};
        if (!match[0]->found() || !match[1]->found() || !match[2]->found()) continue;
        const std::array<double, 3> doubts = {match[0]->doubt, match[1]->doubt, match[2]->doubt};
        std::array<std::uint32_t, 3> chart;
        for (std::size_t i = 0; i < 3; ++i) chart[i] = layout_.chart_of_triangle[match[i]->triangle];
        for (std::size_t k = 0; k < 3; ++k) {
            if ((k > 0 && chart[k] == chart[0]) || (k > 1 && chart[k] == chart[1])) continue;
            if (const auto at = corners_in_picture(mesh, shown, t, match, k)) draw_triangle(t, *at, chart[k], doubts);
        }
    }
}

// ---- Exposure and what is not seen ---------------------------------------------------------------------------------

// The median of what texels that were known became, each a vote for a gain.
std::array<double, 3> TextureBaker::exposure() const {
    std::array<double, 3> out = {1, 1, 1};
    constexpr int least = 24, most = 235;  // levels in which neither noise nor clipping counts much
    constexpr std::size_t every = 5, fewest = 300;
    constexpr double per_step = 1024, smallest = 0.003, largest = 2;
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<std::uint32_t> votes(static_cast<std::size_t>(4 * per_step), 0);
        std::size_t all = 0;
        for (std::size_t i = 0; i < layout_.inside.size(); i += every) {
            const auto texel = layout_.inside[i];
            if (!is_known_[texel] || doubts_[texel] == undrawn) continue;
            const int was = picture_.rgb[3 * texel + c], is = drawn_.rgb[3 * texel + c];
            if (was < least || was > most || is < least || is > most) continue;
            // Levels are whole numbers: spread evenly over the step that each stands for.
            const double spread = static_cast<double>((texel * 2654435761u) >> 16 & 1023) / 1024 - 0.5;
            const double ratio = (is + spread) / was;
            ++votes[static_cast<std::size_t>(std::clamp(ratio * per_step, 0.0, static_cast<double>(votes.size() - 1)))];
            ++all;
        }
        if (all < fewest) return {1, 1, 1};
        std::size_t sum = 0, step = 0;
        while (2 * (sum + votes[step]) < all) sum += votes[step++];
        const double within =
            votes[step] > 0 ? (0.5 * static_cast<double>(all) - static_cast<double>(sum)) / votes[step] : 0;
        const double gain = (static_cast<double>(step) + within) / per_step;
        if (gain > largest || gain < 1 / largest) return {1, 1, 1};  // another picture, not another exposure
        out[c] = std::abs(gain - 1) < smallest ? 1 : gain;
    }
    return out;
}

// Gives texels without a colour those around them: means of what is known, from coarse to fine.
void TextureBaker::fill_holes() {
    struct Level {
        int width, height;
        std::vector<float> sums;  // red, green, blue, weight
    };
    std::vector<Level> levels;
    Level finest{picture_.width, picture_.height, {}};
    const auto texels = is_known_.size();
    finest.sums.assign(4 * texels, 0);
    for (std::size_t i = 0; i < texels; ++i) {
        if (!is_known_[i]) continue;
        for (std::size_t c = 0; c < 3; ++c) finest.sums[4 * i + c] = picture_.rgb[3 * i + c];
        finest.sums[4 * i + 3] = 1;
    }
    levels.push_back(std::move(finest));
    while (levels.back().width > 1 || levels.back().height > 1) {
        const auto& below = levels.back();
        Level next{(below.width + 1) / 2, (below.height + 1) / 2, {}};
        next.sums.assign(4 * static_cast<std::size_t>(next.width) * static_cast<std::size_t>(next.height), 0);
        for (int y = 0; y < below.height; ++y)
            for (int x = 0; x < below.width; ++x) {
                const float* from = &below.sums[4 * static_cast<std::size_t>(y * below.width + x)];
                float* to = &next.sums[4 * static_cast<std::size_t>((y / 2) * next.width + x / 2)];
                for (int c = 0; c < 4; ++c) to[c] += from[c];
            }
        for (std::size_t i = 0; i < next.sums.size(); i += 4)
            if (next.sums[i + 3] > 1)
                for (std::size_t c = 0; c < 4; ++c) next.sums[i + c] /= next.sums[i + 3];
        levels.push_back(std::move(next));
    }
    for (std::size_t k = levels.size() - 1; k-- > 0;) {
        const auto& above = levels[k + 1];
        auto& own = levels[k];
        for (int y = 0; y < own.height; ++y)
            for (int x = 0; x < own.width; ++x) {
                float* to = &own.sums[4 * static_cast<std::size_t>(y * own.width + x)];
                if (to[3] > 0) continue;
                // Between the centres of the four nearest above, so that what is filled is smooth, and costs no bits.
                const int left = x / 2, row = y / 2;
                const int beside = std::clamp(left + (x % 2 == 0 ? -1 : 1), 0, above.width - 1);
                const int next = std::clamp(row + (y % 2 == 0 ? -1 : 1), 0, above.height - 1);
                const auto at = [&](int u, int v) {
                    return &above.sums[4 * static_cast<std::size_t>(v * above.width + u)];
                };
                const float *a = at(left, row), *b = at(beside, row), *d = at(left, next), *e = at(beside, next);
                for (int c = 0; c < 4; ++c) to[c] = (9 * a[c] + 3 * b[c] + 3 * d[c] + e[c]) / 16;
            }
    }
    for (std::size_t i = 0; i < texels; ++i) {
        if (is_known_[i]) continue;
        const float* from = &levels[0].sums[4 * i];
        if (!(from[3] > 0)) continue;
        for (std::size_t c = 0; c < 3; ++c)
            picture_.rgb[3 * i + c] = static_cast<std::uint8_t>(std::clamp(from[c] + 0.5F, 0.0F, 255.0F));
        is_known_[i] = 1;
    }
}

Result<BakedTexture> TextureBaker::bake(const TexturedMesh& captured, const Mesh& shown,
                                        std::span<const std::uint32_t> repeated) {
    const auto bad = [](const char* what) { return fail(ErrorKind::bad_input, what); };
    if (!captured.texture || captured.texture->width < 1 || captured.texture->height < 1 ||
        captured.mesh.texcoords.size() != captured.mesh.positions.size() || captured.mesh.positions.empty())
        return bad("the captured mesh has no texture, or no texture coordinates");
    if (shown.texcoords.size() != shown.positions.size() || shown.positions.empty())
        return bad("the decoded mesh has no texture coordinates: it is not of a stream with charts");
    const std::size_t own = shown.positions.size() - std::min(repeated.size(), shown.positions.size());
    if (own == 0 || std::any_of(repeated.begin(), repeated.end(), [&](std::uint32_t v) { return v >= own; }))
        return bad("the decoded mesh does not have the vertices that are to be repeated");
    const bool anew = is_new(shown);
    if (anew) lay_out(shown, repeated);
    const MatchedSurface surface{std::span(shown.positions).first(own), layout_.welded, layout_.beside};
    draw(captured, shown,
         surface_matches(captured.mesh, surface, options_.reach * layout_.adult_millimetre, options_.threads));

    BakedTexture out;
    if (options_.exposure) out.gains = exposure();
    std::array<std::array<std::uint8_t, 256>, 3> level;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t l = 0; l < 256; ++l)
            level[c][l] =
                static_cast<std::uint8_t>(std::clamp(std::lround(static_cast<double>(l) / out.gains[c]), 0L, 255L));
    const auto keep = [&](Texel texel) {
        for (std::size_t c = 0; c < 3; ++c) picture_.rgb[3 * texel + c] = level[c][drawn_.rgb[3 * texel + c]];
        is_known_[texel] = 1;
    };
    std::size_t seen = 0;
    for (const auto texel : layout_.inside) {
        if (doubts_[texel] == undrawn) continue;
        keep(texel);
        ++seen;
    }
    out.seen = layout_.inside.empty() ? 0 : static_cast<double>(seen) / static_cast<double>(layout_.inside.size());
    // Holes within charts are filled before their gutters are, which go on from them.
    if (anew) {
        for (const auto& [texel, source] : layout_.gutter) is_known_[texel] = 0;
        fill_holes();
    }
    for (const auto& [texel, source] : layout_.gutter) {
        if (doubts_[texel] != undrawn) {
            keep(texel);
            continue;
        }
        for (std::size_t c = 0; c < 3; ++c) picture_.rgb[3 * texel + c] = picture_.rgb[3 * source + c];
    }
    out.picture = picture_;
    return out;
}

int picture_side_for(const TexturedMesh& captured) {
    const auto& mesh = captured.mesh;
    double texels = 0;
    for (const auto& t : mesh.triangles) {
        Texcoords at;
        for (std::size_t i = 0; i < 3; ++i)
            at[i] = {static_cast<double>(mesh.texcoords[t[i]][0]) * captured.texture->width,
                     static_cast<double>(mesh.texcoords[t[i]][1]) * captured.texture->height};
        texels += std::abs(area_of(at));
    }
    constexpr double share = 0.5;  // of the picture that charts cover, and some foreshortening
    constexpr double step = 64, least = 256;
    const double side = std::max(captured.texture->width, captured.texture->height);
    return static_cast<int>(std::clamp(std::max(step * std::ceil(std::sqrt(texels / share) / step), side), least,
                                       1.0 * largest_image_side));
}

}  // namespace htvm
