#include "codec/charts/chart_layer.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/geometry.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

tl::unexpected<Error> corrupt(const char* what) { return fail(ErrorKind::corrupt_stream, what); }

constexpr int scale_bits = 24, place_bits = 12, rotation_raw_bits = 8, largest_raw_bits = 2;
constexpr std::int32_t coarse_limit = (1 << rotation_bits) / coarse_rotation;

// ---- Which triangles belong to which chart -------------------------------------------------------------------------
//
// A triangle mostly belongs to the chart of a neighbour that came before it. Asked first is the chart to which most of
// its corners belonged last, in contexts of how many they are and of how well the triangle faces that chart's plane,
// compared with the other charts at its corners: the encoder cuts where this changes.

struct Candidate {
    std::uint32_t chart = no_chart;
    std::size_t votes = 0;
    double facing = 0;  // cosine of the angle to the chart's direction, times the length of the triangle's normal
};

struct Candidates {
    std::array<Candidate, 3> of{};
    std::size_t count = 0, known = 0;  // known: corners that belonged to a chart

    void vote(std::uint32_t chart) {
        if (chart == no_chart) return;
        ++known;
        for (std::size_t i = 0; i < count; ++i)
            if (of[i].chart == chart) {
                ++of[i].votes;
                return;
            }
        of[count++] = {chart, 1, 0};
    }
};

constexpr std::size_t facings = 5;

struct ChartModels {
    std::array<std::array<std::array<BinaryModel, facings>, 4>, 4> alone, first;  // by votes, known corners, facing
    std::array<BinaryModel, 4> further;                                           // by candidates that are left
    BinaryModel is_new;
    UnsignedModel number;
    SignedModel size;
};

// The direction from which a chart is seen, of length 1 but for rounding.
Vector3d direction_of(const Chart& chart) {
    const auto matrix = rotation_matrix(chart.rotation);
    constexpr double unit = 1.0 / (1 << matrix_bits);
    return {static_cast<double>(matrix[6]) * unit, static_cast<double>(matrix[7]) * unit,
            static_cast<double>(matrix[8]) * unit};
}

// How many of the bounds, which ascend, the value reaches.
template <std::size_t N>
std::size_t class_of(double value, double unit, const std::array<double, N>& bounds) {
    std::size_t out = 0;
    while (out < N && value >= bounds[out] * unit) ++out;
    return out;
}

template <class Coder>
class ChartCoder {
public:
    ChartCoder(Coder& coder, std::span<const LatticePoint> positions, std::span<const Triangle> triangles)
        : coder_(coder), positions_(positions), triangles_(triangles), last_(positions.size(), no_chart) {}

    // wanted: what is written, or empty where it is read. False if what is read is out of range.
    bool code(ChartLayout& layout, const ChartLayout& wanted) {
        layout.scale = coder_.raw(wanted.scale, scale_bits);
        if (layout.scale == 0) return false;
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            const auto chart = code_chart(t, layout, wanted);
            if (!chart) return false;
            layout.chart_of_triangle.push_back(*chart);
            for (const auto v : triangles_[t]) last_[v] = *chart;
        }
        return true;
    }

private:
    Candidates candidates_of(const Triangle& t) const {
        Candidates out;
        for (const auto v : t) out.vote(last_[v]);
        // Where votes are equal, the candidate that came first wins.
        std::stable_sort(out.of.begin(), out.of.begin() + static_cast<std::ptrdiff_t>(out.count),
                         [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
        return out;
    }

    bool is(BinaryModel& model, std::uint32_t chart, std::uint32_t wanted) {
        return coder_.bit(model, chart == wanted);
    }

    std::optional<std::uint32_t> code_chart(std::size_t t, ChartLayout& layout, const ChartLayout& wanted) {
        const std::uint32_t own = wanted.chart_of_triangle.empty() ? no_chart : wanted.chart_of_triangle[t];
        auto candidates = candidates_of(triangles_[t]);
        const std::size_t count = candidates.count;
        if (count > 0) {
            const auto normal = area_vector(positions_, triangles_[t]);
            const double size = length(normal);
            for (std::size_t i = 0; i < count; ++i)
                candidates.of[i].facing = dot(normal, directions_[candidates.of[i].chart]);
            const auto& first = candidates.of[0];
            const auto votes = first.votes, known = candidates.known;
            if (count == 1) {
                const auto facing = class_of<4>(first.facing, size, {0.4, 0.55, 0.65, 0.8});
                if (is(models_.alone[votes][known][facing], first.chart, own)) return first.chart;
            } else {
                const double other =
                    count == 2 ? candidates.of[1].facing : std::max(candidates.of[1].facing, candidates.of[2].facing);
                const auto facing = class_of<4>(first.facing - other, size, {-0.2, 0, 0.1, 0.3});
                if (is(models_.first[votes][known][facing], first.chart, own)) return first.chart;
            }
            for (std::size_t i = 1; i < count; ++i)
                if (is(models_.further[count - i], candidates.of[i].chart, own)) return candidates.of[i].chart;
        }
        const auto so_far = static_cast<std::uint32_t>(layout.charts.size());
        if (so_far == 0 || coder_.bit(models_.is_new, own == so_far)) {
            const auto chart = code_new(own == no_chart ? Chart{} : wanted.charts[so_far]);
            if (!chart || so_far == most_charts) return std::nullopt;
            layout.charts.push_back(*chart);
            directions_.push_back(direction_of(*chart));
            return so_far;
        }
        const auto back = coder_.number(models_.number, own == no_chart ? 0 : so_far - 1 - own);
        if (back >= so_far) return std::nullopt;
        return so_far - 1 - back;
    }

    std::optional<Chart> code_new(const Chart& wanted) {
        Chart out;
        out.rotation.largest = static_cast<std::uint8_t>(coder_.raw(wanted.rotation.largest, largest_raw_bits));
        for (std::size_t i = 0; i < 3; ++i) {
            const auto coarse = wanted.rotation.others[i] / coarse_rotation + coarse_limit;
            const auto n = static_cast<std::int32_t>(coder_.raw(static_cast<std::uint32_t>(coarse), rotation_raw_bits));
            if (n > 2 * coarse_limit) return std::nullopt;
            out.rotation.others[i] = static_cast<std::int16_t>((n - coarse_limit) * coarse_rotation);
        }
        const std::int64_t size =
            std::int64_t{last_size_} + coder_.signed_number(models_.size, wanted.size - last_size_);
        if (size < 1 || size > largest_size) return std::nullopt;
        out.size = last_size_ = static_cast<std::int32_t>(size);
        out.x = static_cast<std::int32_t>(coder_.raw(static_cast<std::uint32_t>(wanted.x), place_bits));
        out.y = static_cast<std::int32_t>(coder_.raw(static_cast<std::uint32_t>(wanted.y), place_bits));
        return out;
    }

    Coder& coder_;
    std::span<const LatticePoint> positions_;
    std::span<const Triangle> triangles_;
    std::vector<std::uint32_t> last_;   // the chart of the last triangle at each vertex
    std::vector<Vector3d> directions_;  // of the charts so far
    std::int32_t last_size_ = usual_size;
    ChartModels models_;
};

}  // namespace

std::vector<std::uint8_t> encode_charts(const ChartLayout& layout, std::span<const LatticePoint> positions,
                                        std::span<const Triangle> triangles) {
    RangeEncoder run;
    WritingCoder<RangeEncoder> coder{run};
    ChartLayout written;
    ChartCoder(coder, positions, triangles).code(written, layout);
    return run.finish();
}

Result<ChartLayout> decode_charts(std::span<const std::uint8_t> bytes, std::span<const LatticePoint> positions,
                                  std::span<const Triangle> triangles) {
    RangeDecoder run(bytes);
    ReadingCoder<RangeDecoder> coder{run};
    ChartLayout out;
    out.chart_of_triangle.reserve(triangles.size());
    ChartLayout nothing;
    if (!ChartCoder(coder, positions, triangles).code(out, nothing)) return corrupt("charts: a number is out of range");
    if (run.exhausted()) return corrupt("charts: the layer ends too early");
    return out;
}

// ---- Coordinates ---------------------------------------------------------------------------------------------------

std::vector<CornerTexcoords> projected_corners(const ChartLayout& layout, std::span<const LatticePoint> positions,
                                               std::span<const Triangle> triangles) {
    // Sixteenths of a lattice unit: below 2^30 on the lattice.
    constexpr int kept_bits = 4;
    struct Plane {
        RotationMatrix matrix;
        std::array<std::int64_t, 2> least = {std::numeric_limits<std::int64_t>::max(),
                                             std::numeric_limits<std::int64_t>::max()};
        std::int64_t scale;
    };
    std::vector<Plane> planes;
    for (const auto& chart : layout.charts) {
        Plane plane;
        plane.matrix = rotation_matrix(chart.rotation);
        plane.scale = std::int64_t{layout.scale} * chart.size;
        planes.push_back(plane);
    }
    const auto along = [&](const Plane& plane, std::size_t axis, const LatticePoint& p) {
        const auto* row = &plane.matrix[3 * axis];
        return (row[0] * p.x + row[1] * p.y + row[2] * p.z) >> (matrix_bits - kept_bits);
    };
    // Each corner's two coordinates once: they are below 2^31, as is what they are reduced by.
    std::vector<CornerTexcoords> out(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        auto& plane = planes[layout.chart_of_triangle[t]];
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t axis = 0; axis < 2; ++axis) {
                const auto c = along(plane, axis, positions[triangles[t][i]]);
                out[t][i][axis] = static_cast<std::int32_t>(c);
                plane.least[axis] = std::min(plane.least[axis], c);
            }
    }
    constexpr int shift = 16 + kept_bits + 4;  // of the scale, of the coordinates, of the size
    constexpr std::int64_t beyond = std::numeric_limits<std::int32_t>::max();
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& plane = planes[layout.chart_of_triangle[t]];
        for (auto& corner : out[t])
            for (std::size_t axis = 0; axis < 2; ++axis)
                corner[axis] = static_cast<std::int32_t>(
                    std::min(((corner[axis] - plane.least[axis]) * plane.scale) >> shift, beyond));
    }
    return out;
}

Result<std::vector<CornerTexcoords>> chart_texcoords(const ChartLayout& layout, const StreamTexture& picture,
                                                     std::span<const LatticePoint> positions,
                                                     std::span<const Triangle> triangles) {
    auto out = projected_corners(layout, positions, triangles);
    const std::array<std::int64_t, 2> sides = {picture.width, picture.height};
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& chart = layout.charts[layout.chart_of_triangle[t]];
        const std::array<std::int64_t, 2> place = {chart.x, chart.y};
        for (auto& corner : out[t])
            for (std::size_t axis = 0; axis < 2; ++axis) {
                const std::int64_t c = corner[axis] + (place[axis] << texel_bits);
                if (c > sides[axis] << texel_bits) return corrupt("charts: one does not fit into the picture");
                corner[axis] = static_cast<std::int32_t>(divide_rounded(c << (picture_bits - texel_bits), sides[axis]));
            }
    }
    return out;
}

}  // namespace htvm::internal
