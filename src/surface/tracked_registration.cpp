#include "surface/tracked_registration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>

#include "core/parallel.h"
#include "surface/open_border.h"

namespace htvm::internal {

namespace {

using Eigen::Matrix3d, Eigen::Matrix3f, Eigen::Vector3d, Eigen::Vector3f;

Vector3d vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }
Vector3f floats_of(const Point3f& p) { return {p[0], p[1], p[2]}; }

// The handles of one level, and the samples that they move away from their rest positions.
struct Stage {
    const DeformableMesh& mesh;
    const DeformationLevel& level;
    std::vector<Point3f> rest, rest_normals;  // of the samples at rest
    std::vector<Vector3d> centre;             // of the handles, at rest
    std::vector<HandlePair> pairs;            // with their points at rest
    std::vector<RigidMotion> motion;
    std::span<const SampleTexture> textures;  // one per sample, or none
};

struct Moved {
    std::vector<Point3f> points, normals;  // of the samples
    std::vector<Point3f> vertices;         // of the mesh; only for rounds that match to its triangles
};

// What a vertex's handles do to it, blended: not rigid, but the same as the mean of what each does.
RigidMotion blended(const SampleBlend& blend, const std::vector<RigidMotion>& motion) {
    RigidMotion out{Matrix3d::Zero(), Vector3d::Zero()};
    for (std::size_t k = 0; k < blend.count; ++k) {
        const double weight = static_cast<double>(blend.weight[k]);
        out.rotation += weight * motion[blend.handle[k]].rotation;
        out.shift += weight * motion[blend.handle[k]].shift;
    }
    return out;
}

// The same for points, of which there are many: in floats, by rows of a turn and a shift, which are vectors. Two in a
// million of a body's size are a hundredth of a millimetre.
using Rows = std::array<float, 12>;

std::vector<Rows> rows_of(std::span<const RigidMotion> motions) {
    std::vector<Rows> out(motions.size());
    for (std::size_t h = 0; h < out.size(); ++h)
        for (int i = 0; i < 3; ++i) {
            auto* row = &out[h][static_cast<std::size_t>(4 * i)];
            for (int j = 0; j < 3; ++j) row[j] = static_cast<float>(motions[h].rotation(i, j));
            row[3] = static_cast<float>(motions[h].shift[i]);
        }
    return out;
}

Rows blended(const SampleBlend& blend, const std::vector<Rows>& rows) {
    Rows out{};
    for (std::size_t k = 0; k < blend.count; ++k) {
        const Rows& row = rows[blend.handle[k]];
        for (std::size_t i = 0; i < out.size(); ++i) out[i] += blend.weight[k] * row[i];
    }
    return out;
}

Point3f turned(const Rows& rows, const Point3f& p) {
    Point3f out;
    for (std::size_t i = 0; i < 3; ++i) out[i] = rows[4 * i] * p[0] + rows[4 * i + 1] * p[1] + rows[4 * i + 2] * p[2];
    return out;
}

Point3f moved_by(const Rows& rows, const Point3f& p) {
    auto out = turned(rows, p);
    for (std::size_t i = 0; i < 3; ++i) out[i] += rows[4 * i + 3];
    return out;
}

struct MovedSample {
    Point3f point, normal;
};
MovedSample moved_sample(const SampleBlend& blend, const std::vector<Rows>& rows, const Point3f& rest,
                         const Point3f& rest_normal) {
    const Rows here = blended(blend, rows);
    const Point3f normal = turned(here, rest_normal);
    const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (!(length > 0)) return {moved_by(here, rest), rest_normal};
    return {moved_by(here, rest), {normal[0] / length, normal[1] / length, normal[2] / length}};
}

Moved move_samples(const Stage& stage, Threads threads) {
    Moved out{std::vector<Point3f>(stage.rest.size()), std::vector<Point3f>(stage.rest.size()), {}};
    const auto rows = rows_of(stage.motion);
    parallel_for(stage.rest.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto moved = moved_sample(stage.level.blends[i], rows, stage.rest[i], stage.rest_normals[i]);
            out.points[i] = moved.point;
            out.normals[i] = moved.normal;
        }
    });
    return out;
}

// A sample, and the plane of the target that it should lie in. Distances between points that are matched are small, so
// floats do for what is summed over the matches; where the handles are, and the step that they make, is in doubles.
struct Match {
    std::uint32_t sample = 0;
    std::uint32_t vertex = 0;            // in the target
    float weight = 0;                    // 0: no match
    float gap = 0;                       // spacing of the points that were searched
    Vector3f normal = Vector3f::Zero();  // the mean of the two normals, or zero: measured along it, points of the same
                                         // round surface are not apart
    float across = 0;                    // how far the target lies from the reference along the normal,
    Vector3f along = Vector3f::Zero();   // and how far the vertex lies from the sample along the surface
};

Match match_of(const Moved& moved, std::uint32_t sample, const SurfaceIndex& target, std::uint32_t vertex, float gap) {
    Match out{sample, vertex, 0, gap};
    const Vector3f apart = floats_of(target.positions[vertex]) - floats_of(moved.points[sample]);
    const Vector3f sum = floats_of(target.normals[vertex]) + floats_of(moved.normals[sample]);
    const float length = sum.norm();
    if (length > 0) out.normal = sum / length;
    out.across = out.normal.dot(apart);
    out.along = apart - out.across * out.normal;
    return out;
}

// The results of the last round's searches, from which the next round's begin.
struct Guesses {
    std::vector<std::uint32_t> forward, back;  // per sample, and per sample of the target
};

struct Round {
    LatticeUnits reach;
    double stiffness = 0;
    double point_share = 0;
    float gap = 0;          // spacing of the reference's samples
    bool far = false;       // search among the target's samples; distant matches still count
    bool colours = false;   // match colours, too; both sides must have them
    bool surfaces = false;  // match the target's samples to the reference's triangles; not with `far`
};

// Near matches have full weight, which fades to zero at the reach; distant ones all have the same small pull.
float match_weight(double squared_distance, const Round& round) {
    const double d = std::sqrt(squared_distance), reach = round.reach.value;
    if (round.far) return static_cast<float>(1 / std::max(1.0, d / (0.1 * reach)));
    const double fade = std::max(0.0, 1 - d * d / (reach * reach));
    return static_cast<float>(fade * fade);
}

// How far a point lies from the moved triangles around a sample's vertex, and from there to it; none if it has no
// triangles.
struct FromReference {
    Point3f apart{};
    float squared_distance = std::numeric_limits<float>::infinity();
};

FromReference nearest_around(const DeformableMesh& mesh, std::span<const Point3f> vertices, std::uint32_t sample,
                             const Point3f& query) {
    FromReference out;
    const auto try_triangle = [&](const Point3f& a, const Point3f& b, const Point3f& c) {
        const NearOnTriangle near = near_on_triangle(a, b, c, query, out.squared_distance);
        if (!(near.squared_distance < out.squared_distance)) return;
        out.squared_distance = near.squared_distance;
        for (std::size_t axis = 0; axis < 3; ++axis)
            out.apart[axis] =
                query[axis] - (near.shares[0] * a[axis] + near.shares[1] * b[axis] + near.shares[2] * c[axis]);
    };
    const auto vertex = mesh.samples[sample];
    const auto& rest = mesh.sample_fans[sample];
    if (rest.regular()) {
        VertexFan fan;
        fan.own = vertices[vertex];
        fan.triangles = rest.triangles;
        for (std::size_t lane = 0; lane < VertexFan::lanes; ++lane) {
            const auto& p = vertices[rest.neighbour[lane]];
            fan.x[lane] = p[0], fan.y[lane] = p[1], fan.z[lane] = p[2];
        }
        const std::size_t nearest = fan_searches().nearest(fan, query, nullptr).lane;
        try_triangle(fan.own, fan.place(nearest), fan.place((nearest + 1) % VertexFan::lanes));
        return out;
    }
    for (const auto triangle : mesh.around.of(vertex)) {
        const auto& t = mesh.triangles[triangle];
        try_triangle(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    }
    return out;
}

// The moved samples in a grid, made once a search among all of them is needed.
class MovedGrid {
public:
    MovedGrid(const Moved& moved, float cell) : moved_(moved), cell_(cell) {}
    const OrientedPoints& points() const {
        std::call_once(once_, [&] { points_.emplace(moved_.points, moved_.normals, cell_); });
        return *points_;
    }

private:
    const Moved& moved_;
    float cell_;
    mutable std::once_flag once_;
    mutable std::optional<OrientedPoints> points_;
};

// ---- Matches in both directions: from each sample to the target, and from each of the target's samples to the nearest
// moved sample, or to the triangles around that.
//
// A search goes from vertex to vertex, or from sample to sample, as long as the distance shrinks, beginning with what
// the last round found; on the target, in the first round, with what the neighbouring search found. (Among the samples
// that took 4 to 6 % more bits.) Where it ends far from the point, or faces elsewhere, the search is among all.

constexpr float begins_near = 4;  // spacings: from farther away it is not worth going

// What the searches of one round share.
struct MatchSearch {
    const DeformableMesh& mesh;
    const DeformationLevel& level;
    const Moved& moved;
    const SurfaceIndex& target;
    const Round& round;
    float reach, agreement;
    float target_gap;                       // spacing of the target's vertices, or in far rounds of its samples
    float sample_gap;                       // spacing of the moved samples
    std::size_t skip;                       // of the target's samples, every how many-th is matched back
    std::vector<std::uint8_t> from_border;  // of the moved samples, or none
    std::span<const std::uint8_t> present;  // DeformationOptions::present
    float unseen_reach;
    MovedGrid grid;  // of the moved samples
};

bool agrees(const MatchSearch& search, const Point3f& a, const Point3f& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] >= search.agreement;
}

bool is_near(const Point3f& a, const Point3f& b, float spacing) {
    const Point3f apart = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2] <= spacing * spacing;
}

// Among the samples of the target. guess: a vertex of the target, or no_point.
OrientedMatch nearest_target_sample(const MatchSearch& search, const Point3f& point, const Point3f& normal,
                                    std::uint32_t guess) {
    const auto& target = search.target;
    std::uint32_t beside = OrientedPoints::no_point;
    if (guess != OrientedPoints::no_point) {
        if (is_near(target.positions[guess], point, begins_near * search.target_gap)) {
            const auto near = target.nearest_along(point, guess);
            const auto most = std::min(search.reach, search.target_gap);
            if (near.squared_distance <= most * most && agrees(search, target.normals[near.index], normal))
                return {near.index, near.squared_distance, true};
        }
        beside = static_cast<std::uint32_t>(std::size_t{guess} * target.samples.size() / target.positions.size());
    }
    auto match = target.coarse.nearest(point, normal, search.reach, search.agreement, beside);
    if (match.found) match.index = target.samples[match.index];
    return match;
}

// Among the moved samples. guess: what the last round found; last: what the search before found; or no_point.
OrientedMatch nearest_moved_sample(const MatchSearch& search, const Point3f& point, const Point3f& normal,
                                   std::uint32_t guess, std::uint32_t last) {
    const auto& moved = search.moved;
    if (guess != OrientedPoints::no_point && is_near(moved.points[guess], point, begins_near * search.sample_gap)) {
        const auto near = nearest_along(moved.points, point, guess, [&](std::uint32_t sample, const auto& visit) {
            for (const auto next : search.level.beside.of(sample)) visit(next);
        });
        const auto most = std::min(search.reach, search.sample_gap);
        if (near.squared_distance <= most * most && agrees(search, moved.normals[near.index], normal))
            return {near.index, near.squared_distance, true};
        guess = near.index;
    }
    return search.grid.points().nearest(point, normal, search.reach, search.agreement,
                                        guess == OrientedPoints::no_point ? last : guess);
}

// Whether a match may say nothing: of what was not seen lately, unless it is near; and where what was found lies on a
// border and the match leads along the surface to it, so that the surface may go on unseen. In far rounds, which search
// among fewer points, what is beside a border counts as on it.
bool says_nothing(const MatchSearch& search, const Match& match, std::span<const std::uint8_t> from_border,
                  std::uint32_t found, float squared_distance) {
    if (!search.present.empty()) {
        const auto vertex = search.mesh.samples[search.level.samples[match.sample]];
        if (search.present[vertex] == 0 && squared_distance > search.unseen_reach * search.unseen_reach) return true;
    }
    if (from_border.empty()) return false;
    const auto inside = search.round.far ? far_from_border : std::uint8_t{1};
    return from_border[found] < inside && match.along.norm() > match.gap;
}

// From a sample to the target. guess: where the last round found it, set to where it is; last: as above. Both ways a
// match that is not found is left as it is.
void match_forward(const MatchSearch& search, std::size_t sample, std::uint32_t last, std::uint32_t& guess,
                   Match& out) {
    const auto& moved = search.moved;
    const auto from = guess == OrientedPoints::no_point ? last : guess;
    const auto match =
        search.round.far
            ? nearest_target_sample(search, moved.points[sample], moved.normals[sample], from)
            : search.target.nearest_facing(moved.points[sample], moved.normals[sample],
                                           {.reach = search.reach, .agreement = search.agreement, .along = true}, from);
    if (!match.found) return;
    guess = match.index;
    out = match_of(moved, static_cast<std::uint32_t>(sample), search.target, match.index, search.target_gap);
    if (says_nothing(search, out, search.target.from_border, match.index, match.squared_distance)) return;
    out.weight = match_weight(match.squared_distance, search.round);
}

// From a vertex of the target to the samples, or to the triangles around the nearest one.
void match_back(const MatchSearch& search, std::uint32_t vertex, std::uint32_t last, std::uint32_t& guess, Match& out) {
    const auto& place = search.target.positions[vertex];
    const auto match = nearest_moved_sample(search, place, search.target.normals[vertex], guess, last);
    if (!match.found) return;
    guess = match.index;
    out = match_of(search.moved, match.index, search.target, vertex, search.round.gap);
    if (says_nothing(search, out, search.from_border, match.index, match.squared_distance)) return;
    auto squared_distance = static_cast<double>(match.squared_distance);
    if (search.round.surfaces) {
        const auto near = nearest_around(search.mesh, search.moved.vertices, match.index, place);
        if (near.squared_distance < match.squared_distance) {
            squared_distance = static_cast<double>(near.squared_distance);
            out.across = out.normal.dot(floats_of(near.apart));
        }
    }
    out.weight = match_weight(squared_distance, search.round);
}

// Both directions are cut into slices, so that the threads have equal work. Each begins without a guess: what is found
// along a surface depends on where a search begins, and must not depend on how the threads share the slices.
constexpr std::size_t slices = 64;

// out: the matches of the samples, then those of the target's samples.
void match_slice(const MatchSearch& search, std::size_t slice, Guesses& guesses, std::vector<Match>& out) {
    constexpr std::size_t ahead = 6;
    const auto& target = search.target;
    const std::size_t forward = guesses.forward.size(), back = guesses.back.size();
    const std::size_t first = slice * forward / slices, after = (slice + 1) * forward / slices;
    target.walk_all(std::span(search.moved.points).subspan(first, after - first),
                    search.round.far ? begins_near * search.target_gap : target.begins_near(),
                    std::span(guesses.forward).subspan(first, after - first));
    std::uint32_t last = OrientedPoints::no_point;
    for (std::size_t i = first; i < after; ++i) {
        if (i + ahead < after) target.expect(guesses.forward[i + ahead]);
        match_forward(search, i, last, guesses.forward[i], out[i]);
        last = guesses.forward[i];
    }
    last = OrientedPoints::no_point;
    for (std::size_t i = slice * back / slices; i < (slice + 1) * back / slices; ++i) {
        match_back(search, target.samples[i * search.skip], last, guesses.back[i], out[forward + i]);
        last = guesses.back[i];
    }
}

std::vector<Match> find_matches(const DeformableMesh& mesh, const DeformationLevel& level, const Moved& moved,
                                const SurfaceIndex& target, const Round& round, const DeformationOptions& options,
                                Guesses& guesses) {
    constexpr AdultMillimetres cell(30);  // of the grid of moved samples
    const std::size_t skip = round.far ? 2 : 1;
    const auto samples = std::max<std::size_t>(moved.points.size(), 1);
    std::vector<std::uint8_t> from_border;
    if (!mesh.sample_from_border.empty())
        for (const auto i : level.samples) from_border.push_back(mesh.sample_from_border[i]);
    const MatchSearch search{.mesh = mesh,
                             .level = level,
                             .moved = moved,
                             .target = target,
                             .round = round,
                             .reach = static_cast<float>(round.reach.value),
                             .agreement = static_cast<float>(options.agreement),
                             .target_gap = round.far ? target.coarse_gap : target.fine_gap,
                             .sample_gap = mesh.sample_gap * std::sqrt(static_cast<float>(mesh.samples.size()) /
                                                                       static_cast<float>(samples)),
                             .skip = skip,
                             .from_border = std::move(from_border),
                             .present = options.present,
                             .unseen_reach = static_cast<float>(options.scale.on_lattice(options.unseen_reach).value),
                             .grid = {moved, static_cast<float>(options.scale.on_lattice(cell).value)}};
    guesses.forward.resize(moved.points.size(), OrientedPoints::no_point);
    guesses.back.resize(target.samples.size() / skip, OrientedPoints::no_point);
    std::vector<Match> out(guesses.forward.size() + guesses.back.size());
    parallel_for(slices, options.threads, 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t slice = begin; slice < end; ++slice) match_slice(search, slice, guesses, out);
    });
    std::erase_if(out, [](const Match& m) { return !(m.weight > 0); });
    return out;
}

// ---- Pulls

// The derivative of a point's motion by the six unknowns of a handle: the turn about `centre`, and the shift.
Eigen::Matrix<double, 3, 6> lever(const Vector3d& point, const Vector3d& centre) {
    const Vector3d r = point - centre;
    Eigen::Matrix<double, 3, 6> out;
    out << 0, r.z(), -r.y(), 1, 0, 0, -r.z(), 0, r.x(), 0, 1, 0, r.y(), -r.x(), 0, 0, 0, 1;
    return out;
}

// The sum over all matches of one sample: the quadratic form of its distances, and its gradient.
struct Pull {
    Matrix3f metric = Matrix3f::Zero();
    Vector3f force = Vector3f::Zero();
};

// For the samples in [begin, end).
std::vector<Pull> sum_pulls(const std::vector<Match>& matches, float point_share, std::size_t begin, std::size_t end) {
    std::vector<Pull> pulls(end - begin);
    for (const Match& match : matches) {
        if (match.sample < begin || match.sample >= end) continue;
        const Vector3f& normal = match.normal;
        // Samples have gaps between them, so only a distance along the surface beyond the gap counts as an error.
        const Vector3f& along = match.along;
        const float weight = match.weight, slide = along.norm();
        const float share = slide > match.gap ? weight * point_share * (1 - match.gap / slide) : 0;
        Pull& pull = pulls[match.sample - begin];
        pull.metric.noalias() += (weight - share) * normal * normal.transpose();
        pull.metric.diagonal().array() += share;
        pull.force += weight * match.across * normal + share * along;
    }
    return pulls;
}

// ---- Colours: where the reference's colours have a slope, a difference tells how far it has slid along the surface.

// The samples' slopes as they lie along the moved surface.
std::vector<Matrix3f> turned_slopes(const Stage& stage, const Moved& moved) {
    std::vector<Matrix3f> out(stage.textures.size(), Matrix3f::Zero());
    const auto rows = rows_of(stage.motion);
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (!(stage.textures[i].trust > 0)) continue;
        const Rows row = blended(stage.level.blends[i], rows);
        Matrix3f turn;
        turn << row[0], row[1], row[2], row[4], row[5], row[6], row[8], row[9], row[10];
        const Vector3f normal = floats_of(moved.normals[i]);
        out[i].noalias() = stage.textures[i].slope * turn.transpose();
        out[i] -= (out[i] * normal).eval() * normal.transpose();
    }
    return out;
}

// For each match, what the reference's colour would be at the target's vertex, minus the vertex's: levels.
std::vector<Vector3f> colour_differences(const Stage& stage, const std::vector<Match>& matches, const Moved& moved,
                                         const std::vector<Matrix3f>& slopes, const SurfaceIndex& target) {
    std::vector<Vector3f> out;
    out.reserve(matches.size());
    for (const Match& match : matches) {
        const Vector3f apart = floats_of(target.positions[match.vertex]) - floats_of(moved.points[match.sample]);
        const Colour& seen = target.colours[match.vertex];
        out.emplace_back(stage.textures[match.sample].colour + slopes[match.sample] * apart -
                         Vector3f(seen[0], seen[1], seen[2]));
    }
    return out;
}

// Variance of the components, from the median of the squares as if these were Gaussian: so what has slid far does not
// count as noise.
float colour_noise(const std::vector<Vector3f>& differences) {
    constexpr float mean_by_median = 2.2F, rounding = 1;
    std::vector<float> squares;
    squares.reserve(differences.size());
    for (const auto& difference : differences) squares.push_back(difference.squaredNorm() / 3);
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return mean_by_median * std::max(rounding, *middle);
}

// 1 for a difference of zero; beyond three standard deviations it soon stops to count: a shadow, or another place.
float colour_trust(const Vector3f& difference, float variance) {
    const float size = difference.squaredNorm() / 3 / (9 * variance);
    return 1 / ((1 + size) * (1 + size));
}

// The mean difference around each handle, as another exposure or light makes it.
std::vector<Vector3f> mean_differences(const Stage& stage, const std::vector<Match>& matches,
                                       const std::vector<Vector3f>& differences, float noise) {
    std::vector<Vector3f> sums(stage.centre.size(), Vector3f::Zero());
    std::vector<float> weights(stage.centre.size(), 0);
    for (std::size_t m = 0; m < matches.size(); ++m) {
        const SampleBlend& blend = stage.level.blends[matches[m].sample];
        const float weight = matches[m].weight * colour_trust(differences[m], noise);
        for (std::size_t k = 0; k < blend.count; ++k) {
            const float share = weight * blend.weight[k];
            sums[blend.handle[k]] += share * differences[m];
            weights[blend.handle[k]] += share;
        }
    }
    for (std::size_t h = 0; h < sums.size(); ++h)
        if (weights[h] > 0) sums[h] /= weights[h];
    return sums;
}

// How the colours pull each sample along the surface.
std::vector<Pull> colour_pulls(const Stage& stage, const std::vector<Match>& matches, const Moved& moved,
                               const SurfaceIndex& target, const DeformationOptions& options) {
    constexpr float least_slope = 0.1F;  // noise per mm: a slope that changes less is not told from it in a centimetre
    std::vector<Pull> pulls(stage.rest.size());
    if (matches.empty()) return pulls;
    const auto slopes = turned_slopes(stage, moved);
    const auto differences = colour_differences(stage, matches, moved, slopes, target);
    const float noise = colour_noise(differences);
    const auto unit = static_cast<float>(options.scale.adult_millimetre.value * options.scale.adult_millimetre.value);
    const auto colour_weight = static_cast<float>(options.colour_weight);
    const auto means = mean_differences(stage, matches, differences, noise);
    for (std::size_t m = 0; m < matches.size(); ++m) {
        const Match& match = matches[m];
        const SampleTexture& texture = stage.textures[match.sample];
        const Matrix3f& slope = slopes[match.sample];
        const float steepness = slope.squaredNorm() * unit;  // levels^2/mm^2
        if (!(steepness > least_slope * least_slope * noise)) continue;
        const SampleBlend& blend = stage.level.blends[match.sample];
        Vector3f left = differences[m];
        for (std::size_t k = 0; k < blend.count; ++k) left -= blend.weight[k] * means[blend.handle[k]];
        const float variance = noise + texture.unevenness;
        // At most as much as a match by distance.
        const float weight = match.weight * texture.trust * colour_trust(left, variance) * unit *
                             std::min(colour_weight / variance, 1 / steepness);
        Pull& pull = pulls[match.sample];
        pull.metric.noalias() += weight * (slope.transpose() * slope);
        pull.force.noalias() += weight * (slope.transpose() * left);
    }
    return pulls;
}

Matrix3d cross_matrix(const Vector3d& r) {
    Matrix3d out;
    out << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return out;
}

// What the pulls on samples do to a turn about one common origin and a shift, the same for all handles: the blocks of a
// symmetric matrix of 6 x 6. A sample's is found once, however many pairs of handles move it; what it does to a handle
// that turns about its own centre follows from the sum over all samples (about_centres()).
struct AboutOrigin {
    enum Place : std::size_t {
        // turns, symmetric
        turn_xx,
        turn_xy,
        turn_xz,
        turn_yy,
        turn_yz,
        turn_zz,
        // turn by shift: a row per axis of the turn
        x_shift_x,
        x_shift_y,
        x_shift_z,
        y_shift_x,
        y_shift_y,
        y_shift_z,
        z_shift_x,
        z_shift_y,
        z_shift_z,
        // shifts, symmetric
        shift_xx,
        shift_xy,
        shift_xz,
        shift_yy,
        shift_yz,
        shift_zz,
        places
    };
    static constexpr std::size_t padded = 24;  // for vectors, four by four
    static_assert(places <= padded);
    std::array<float, padded> sum{};

    float& operator[](Place place) { return sum[place]; }

    Matrix3d turns() const {
        Matrix3d out;
        out << sum[turn_xx], sum[turn_xy], sum[turn_xz], sum[turn_xy], sum[turn_yy], sum[turn_yz], sum[turn_xz],
            sum[turn_yz], sum[turn_zz];
        return out;
    }
    Matrix3d turn_by_shift() const {
        Matrix3d out;
        out << sum[x_shift_x], sum[x_shift_y], sum[x_shift_z], sum[y_shift_x], sum[y_shift_y], sum[y_shift_z],
            sum[z_shift_x], sum[z_shift_y], sum[z_shift_z];
        return out;
    }
    Matrix3d shifts() const {
        Matrix3d out;
        out << sum[shift_xx], sum[shift_xy], sum[shift_xz], sum[shift_xy], sum[shift_yy], sum[shift_yz], sum[shift_xz],
            sum[shift_yz], sum[shift_zz];
        return out;
    }
};

AboutOrigin about_origin(const Vector3f& point, const Pull& pull) {
    const auto& m = pull.metric;
    Matrix3f b;  // cross matrix of the point * metric
    const float x = point.x(), y = point.y(), z = point.z();
    for (int column = 0; column < 3; ++column)
        b.col(column) << y * m(2, column) - z * m(1, column), z * m(0, column) - x * m(2, column),
            x * m(1, column) - y * m(0, column);
    using enum AboutOrigin::Place;
    AboutOrigin out;
    // -b * cross matrix of the point
    out[turn_xx] = b(0, 2) * y - b(0, 1) * z;
    out[turn_xy] = b(0, 0) * z - b(0, 2) * x;
    out[turn_xz] = b(0, 1) * x - b(0, 0) * y;
    out[turn_yy] = b(1, 0) * z - b(1, 2) * x;
    out[turn_yz] = b(1, 1) * x - b(1, 0) * y;
    out[turn_zz] = b(2, 1) * x - b(2, 0) * y;
    out[x_shift_x] = b(0, 0), out[x_shift_y] = b(0, 1), out[x_shift_z] = b(0, 2);
    out[y_shift_x] = b(1, 0), out[y_shift_y] = b(1, 1), out[y_shift_z] = b(1, 2);
    out[z_shift_x] = b(2, 0), out[z_shift_y] = b(2, 1), out[z_shift_z] = b(2, 2);
    out[shift_xx] = m(0, 0), out[shift_xy] = m(0, 1), out[shift_xz] = m(0, 2);
    out[shift_yy] = m(1, 1), out[shift_yz] = m(1, 2), out[shift_zz] = m(2, 2);
    return out;
}

void add_scaled(AboutOrigin& to, const AboutOrigin& from, float scale) {
    for (std::size_t i = 0; i < to.sum.size(); ++i) to.sum[i] += scale * from.sum[i];
}

using Vector6f = Eigen::Matrix<float, 6, 1>;

// The sums over samples, by handle and by pair of handles, each sample with the product of its weights.
struct PullSums {
    std::vector<AboutOrigin> diagonal, above;
    std::vector<Vector6f> right;
    void clear(const BlockPattern& pattern) {
        diagonal.assign(pattern.handles, {});
        above.assign(pattern.place.size(), {});
        right.assign(pattern.handles, Vector6f::Zero());
    }
    PullSums& operator+=(const PullSums& other) {
        for (std::size_t i = 0; i < diagonal.size(); ++i) add_scaled(diagonal[i], other.diagonal[i], 1);
        for (std::size_t i = 0; i < above.size(); ++i) add_scaled(above[i], other.above[i], 1);
        for (std::size_t i = 0; i < right.size(); ++i) right[i] += other.right[i];
        return *this;
    }
};

// A sample moves with the turn and shift of handle k by weight_k (turn x point + shift). point: its moved place, seen
// from the origin; the few millimetres by which its handles would take it elsewhere are neglected as levers.
void add_pull(const SampleBlend& blend, const Vector3f& point, const Pull& pull, PullSums& sums) {
    const auto form = about_origin(point, pull);
    const Vector3f& f = pull.force;
    Vector6f force;
    force << point.y() * f.z() - point.z() * f.y(), point.z() * f.x() - point.x() * f.z(),
        point.x() * f.y() - point.y() * f.x(), f;
    std::size_t slot = 0;
    for (std::size_t a = 0; a < blend.count; ++a) {
        const float weight = blend.weight[a];
        add_scaled(sums.diagonal[blend.handle[a]], form, weight * weight);
        sums.right[blend.handle[a]] += weight * force;
        for (std::size_t b = a + 1; b < blend.count; ++b)
            add_scaled(sums.above[blend.block[slot++]], form, weight * blend.weight[b]);
    }
}

// The block of two handles that turn about their own centres, as seen from the origin.
Matrix6 about_centres(const AboutOrigin& sums, const Vector3d& centre_a, const Vector3d& centre_b) {
    const Matrix3d turns = sums.turns(), turn_shift = sums.turn_by_shift(), shifts = sums.shifts();
    const Matrix3d a = cross_matrix(centre_a), b = cross_matrix(centre_b);
    const Matrix3d shift_turn = turn_shift.transpose() + shifts * b;
    Matrix6 out;
    out << turns + turn_shift * b - a * shift_turn, turn_shift - a * shifts, shift_turn, shifts;
    return out;
}

void set_system(const BlockPattern& pattern, const PullSums& sums, const std::vector<Vector3d>& centres,
                BlockSystem& system) {
    for (std::size_t h = 0; h < centres.size(); ++h) {
        system.diagonal[h] = about_centres(sums.diagonal[h], centres[h], centres[h]);
        system.right[h] = sums.right[h].cast<double>();
        system.right[h].head<3>() -= centres[h].cross(Vector3d(system.right[h].tail<3>()));
    }
    for (std::size_t i = 0; i < pattern.place.size(); ++i)
        system.above[i] =
            about_centres(sums.above[i], centres[pattern.place[i].first], centres[pattern.place[i].second]);
}

void add_pairs(const Stage& stage, const std::vector<Vector3d>& centres, double stiffness, BlockSystem& system) {
    for (const HandlePair& pair : stage.pairs) {
        const RigidMotion &a = stage.motion[pair.first], &b = stage.motion[pair.second];
        const Vector3d at_a = a(pair.point), at_b = b(pair.point);
        const auto lever_a = lever(at_a, centres[pair.first]), lever_b = lever(at_b, centres[pair.second]);
        const double shift = stiffness * pair.shift_stiffness;
        const double turn = stiffness * pair.turn_stiffness * 0.25 *
                            (stage.centre[pair.first] - stage.centre[pair.second]).squaredNorm();
        system.diagonal[pair.first].noalias() += shift * lever_a.transpose() * lever_a;
        system.diagonal[pair.second].noalias() += shift * lever_b.transpose() * lever_b;
        system.right[pair.first].noalias() += shift * lever_a.transpose() * (at_b - at_a);
        system.right[pair.second].noalias() -= shift * lever_b.transpose() * (at_b - at_a);
        Matrix6 across = -shift * lever_a.transpose() * lever_b;
        const Matrix3d apart = b.rotation * a.rotation.transpose();
        const Vector3d twist =
            0.5 * Vector3d(apart(2, 1) - apart(1, 2), apart(0, 2) - apart(2, 0), apart(1, 0) - apart(0, 1));
        for (int k = 0; k < 3; ++k) {
            system.diagonal[pair.first](k, k) += turn;
            system.diagonal[pair.second](k, k) += turn;
            across(k, k) -= turn;
            system.right[pair.first][k] += turn * twist[k];
            system.right[pair.second][k] -= turn * twist[k];
        }
        system.above[stage.level.pattern.find(pair.first, pair.second)] += across;
    }
}

// Applies the step and gives the largest distance that a handle moves, counting its turn at a hand's breadth from its
// centre.
LatticeUnits apply_step(const std::vector<Vector6>& step, const std::vector<Vector3d>& centres, LatticeUnits breadth,
                        Stage& stage) {
    double farthest = 0;
    for (std::size_t h = 0; h < step.size(); ++h) {
        if (!step[h].allFinite()) continue;
        const Vector3d turn = step[h].head<3>();
        const double angle = turn.norm();
        farthest = std::max(farthest, step[h].tail<3>().norm() + breadth.value * angle);
        RigidMotion& motion = stage.motion[h];
        if (angle > 1e-12)
            motion.rotation =
                Eigen::AngleAxisd(std::min(angle, 0.6), turn / angle).toRotationMatrix() * motion.rotation;
        motion.shift = centres[h] + step[h].tail<3>() - motion.rotation * stage.centre[h];
    }
    return LatticeUnits(farthest);
}

struct RoundResult {
    LatticeUnits farthest;  // the largest distance that a handle moved, see apply_step
    double weight = 0;      // of all matches
};

// What a level's rounds use again and again.
struct RoundMemory {
    BlockSystem system;
    std::array<PullSums, 2> sums;
    Guesses guesses;
    explicit RoundMemory(const BlockPattern& pattern) : system(pattern), sums{}, guesses{} {}
};

RoundResult run_round(Stage& stage, const SurfaceIndex& target, const Round& round, RoundMemory& memory,
                      const DeformationOptions& options) {
    // What holds a handle that nothing else holds at its place: of each unit of load, against a turn (mm^2 on an adult)
    // and against a shift.
    constexpr double held_turn = 10, held_shift = 0.01;
    constexpr AdultMillimetres hand(100);  // breadth
    Moved moved = move_samples(stage, options.threads);
    if (round.surfaces) moved.vertices = deform(stage.mesh, stage.motion, options.threads);
    const auto matches = find_matches(stage.mesh, stage.level, moved, target, round, options, memory.guesses);
    std::vector<Pull> of_colours;
    if (round.colours) of_colours = colour_pulls(stage, matches, moved, target, options);
    std::vector<Vector3d> centres(stage.centre.size());
    Vector3d origin = Vector3d::Zero();
    for (std::size_t h = 0; h < centres.size(); ++h) origin += centres[h] = stage.motion[h](stage.centre[h]);
    origin /= static_cast<double>(centres.size());
    // Always in two halves, so that the sums do not depend on the number of threads.
    auto add_half = [&](std::size_t half) {
        auto& sums = memory.sums[half];
        sums.clear(stage.level.pattern);
        const std::size_t begin = half * stage.rest.size() / 2, end = (half + 1) * stage.rest.size() / 2;
        auto pulls = sum_pulls(matches, static_cast<float>(round.point_share), begin, end);
        for (std::size_t i = begin; i < end && !of_colours.empty(); ++i) {
            pulls[i - begin].metric += of_colours[i].metric;
            pulls[i - begin].force += of_colours[i].force;
        }
        for (std::size_t i = begin; i < end; ++i)
            if (pulls[i - begin].metric.trace() > 0)
                add_pull(stage.level.blends[i], (vector_of(moved.points[i]) - origin).cast<float>(), pulls[i - begin],
                         sums);
    };
    parallel_invoke(
        options.threads, [&] { add_half(1); }, [&] { add_half(0); });
    memory.sums[0] += memory.sums[1];
    auto& system = memory.system;
    std::vector<Vector3d> from_origin(centres);
    for (auto& centre : from_origin) centre -= origin;
    set_system(stage.level.pattern, memory.sums[0], from_origin, system);
    const double load = static_cast<double>(stage.rest.size()) / static_cast<double>(centres.size());
    add_pairs(stage, centres, round.stiffness * load, system);
    const double unit = options.scale.adult_millimetre.value * options.scale.adult_millimetre.value;
    for (auto& diagonal : system.diagonal) {
        diagonal.topLeftCorner<3, 3>().diagonal().array() += held_turn * load * unit;
        diagonal.bottomRightCorner<3, 3>().diagonal().array() += held_shift * load;
    }
    RoundResult out;
    out.farthest = apply_step(solve(stage.level.pattern, system, options.solver_iterations, 1e-2), centres,
                              options.scale.on_lattice(hand), stage);
    for (const Match& match : matches) out.weight += static_cast<double>(match.weight);
    return out;
}

// The step that was made since hardly changes the form. Where a handle has hardly any matches, as in a lost limb, the
// data leave all of its motion open, and it would be let go: so each is held at its place by a small share of what
// holds the others on average.
DeformationForm form_of(const BlockPattern& pattern, BlockSystem system, double weight) {
    constexpr double share = 0.03;
    DeformationForm out;
    out.diagonal = std::move(system.diagonal);
    double turns = 0, shifts = 0;
    for (const auto& block : out.diagonal) {
        turns += block.diagonal().head<3>().sum() / 3;
        shifts += block.diagonal().tail<3>().sum() / 3;
    }
    const auto count = static_cast<double>(std::max<std::size_t>(out.diagonal.size(), 1));
    for (auto& block : out.diagonal) {
        block.diagonal().head<3>().array() += share * turns / count;
        block.diagonal().tail<3>().array() += share * shifts / count;
    }
    out.above.reserve(pattern.place.size());
    for (std::size_t i = 0; i < pattern.place.size(); ++i)
        out.above.push_back({pattern.place[i].first, pattern.place[i].second, system.above[i]});
    out.weight = weight;
    return out;
}

Stage fine_stage(const DeformableMesh& mesh, std::vector<RigidMotion> motion) {
    Stage stage{mesh, mesh.fine, {}, {}, mesh.handles, mesh.fine.pairs, std::move(motion), mesh.sample_textures};
    for (std::size_t i = 0; i < mesh.samples.size(); ++i) {
        stage.rest.push_back(mesh.positions[mesh.samples[i]]);
        stage.rest_normals.push_back(mesh.sample_normals[i]);
    }
    return stage;
}

// Groups of handles start from where `fine` has their handles.
Stage coarse_stage(const DeformableMesh& mesh, const Stage& fine, Threads threads) {
    Stage stage{mesh, mesh.coarse, {}, {}, {}, mesh.coarse.pairs, std::vector<RigidMotion>(mesh.coarse.centre.size()),
                {}};
    const Moved moved = move_samples(fine, threads);
    for (const std::uint32_t i : mesh.coarse.samples) {
        stage.rest.push_back(moved.points[i]);
        stage.rest_normals.push_back(moved.normals[i]);
    }
    for (const std::uint32_t h : mesh.coarse.centre) stage.centre.push_back(fine.motion[h](mesh.handles[h]));
    for (auto& pair : stage.pairs) pair.point = 0.5 * (stage.centre[pair.first] + stage.centre[pair.second]);
    return stage;
}

// Each handle takes the blended motion of its groups: the turns blended as quaternions, the shift chosen so that the
// handle ends where its groups take it.
void follow_groups(const DeformableMesh& mesh, const Stage& coarse, std::vector<RigidMotion>& motion) {
    for (std::size_t h = 0; h < motion.size(); ++h) {
        const SampleBlend& blend = mesh.groups[h];
        Eigen::Vector4d sum = Eigen::Vector4d::Zero();
        const Eigen::Quaterniond first(coarse.motion[blend.handle[0]].rotation);
        for (std::size_t k = 0; k < blend.count; ++k) {
            const Eigen::Quaterniond turn(coarse.motion[blend.handle[k]].rotation);
            sum += (turn.dot(first) < 0 ? -1.0 : 1.0) * static_cast<double>(blend.weight[k]) * turn.coeffs();
        }
        const Matrix3d turn = Eigen::Quaterniond(sum).normalized().toRotationMatrix();
        const Vector3d before = motion[h](mesh.handles[h]);
        const Vector3d after = blended(blend, coarse.motion)(before);
        motion[h].rotation = turn * motion[h].rotation;
        motion[h].shift = after - motion[h].rotation * mesh.handles[h];
    }
}

// What the coarse rounds found last, for the fine ones to begin with: each sample begins where it did itself or the one
// before it. (Of the target's samples that took 5 % more bits on a calm man.)
Guesses finer(const DeformableMesh& mesh, const Guesses& coarse) {
    Guesses out;
    out.forward.assign(mesh.samples.size(), OrientedPoints::no_point);
    for (std::size_t i = 0; i < coarse.forward.size(); ++i)
        for (const std::size_t sample : {mesh.coarse.samples[i], mesh.coarse.samples[i] + 1})
            if (sample < out.forward.size()) out.forward[sample] = coarse.forward[i];
    return out;
}

// How far apart two motions take a handle if one of them takes it elsewhere.
constexpr AdultMillimetres elsewhere(15);

bool is_elsewhere(const DeformableMesh& mesh, std::size_t handle, const RigidMotion& motion, const RigidMotion& other,
                  const DeformationOptions& options) {
    const auto& place = mesh.handles[handle];
    return LatticeUnits((motion(place) - other(place)).norm()) > options.scale.on_lattice(elsewhere);
}

// Whether the motion takes no limb elsewhere than `known` does.
bool leads_to(const DeformableMesh& mesh, std::span<const RigidMotion> motion, std::span<const RigidMotion> known,
              const DeformationOptions& options) {
    constexpr int fewest_in_limb = 3;
    int there = 0;
    for (std::size_t h = 0; h < known.size(); ++h) there += is_elsewhere(mesh, h, motion[h], known[h], options) ? 1 : 0;
    return there < fewest_in_limb;
}

bool in_vain(const DeformationOptions& options) {
    return options.in_vain && options.in_vain->load(std::memory_order_relaxed);
}

// The value of a step of a geometric series that leads from one value to another.
template <class Value>
Value between(Value from, Value to, int step, int steps) {
    return steps <= 1 ? to : from * std::pow(to / from, static_cast<double>(step) / (steps - 1));
}

}  // namespace

std::vector<RigidMotion> register_deformation(const DeformableMesh& mesh, const SurfaceIndex& target,
                                              std::span<const RigidMotion> start, const DeformationOptions& options,
                                              DeformationForm* form, std::span<const RigidMotion> known) {
    std::vector<RigidMotion> motion(start.begin(), start.end());
    motion.resize(mesh.handles.size());
    if (mesh.samples.empty() || target.samples.empty()) return motion;
    Stage fine = fine_stage(mesh, std::move(motion));
    Guesses guesses;
    if (options.coarse_rounds > 0) {
        Stage coarse = coarse_stage(mesh, fine, options.threads);
        RoundMemory memory(mesh.coarse.pattern);
        for (int i = 0; i < options.coarse_rounds && !in_vain(options); ++i) {
            const auto reach = between(options.far_reach, options.middle_reach, i, options.coarse_rounds);
            const Round round = {options.scale.on_lattice(reach), options.first_stiffness, options.first_point_share,
                                 0.7f * mesh.sample_gap, true};
            const auto moved = run_round(coarse, target, round, memory, options).farthest;
            if (moved < options.scale.on_lattice(options.settled))
                i = std::max(i, options.coarse_rounds - 2);  // one more
            if (known.empty()) continue;
            auto so_far = fine.motion;
            follow_groups(mesh, coarse, so_far);
            if (leads_to(mesh, so_far, known, options)) return {known.begin(), known.end()};
        }
        follow_groups(mesh, coarse, fine.motion);
        guesses = finer(mesh, memory.guesses);
    }
    RoundMemory memory(mesh.fine.pattern);
    memory.guesses = std::move(guesses);
    double weight = 0;
    for (int i = 0; i < options.fine_rounds && !in_vain(options); ++i) {
        auto value = [&](auto from, auto to) { return between(from, to, i, options.fine_rounds); };
        Round round = {options.scale.on_lattice(value(options.middle_reach, options.near_reach)),
                       value(options.first_stiffness, options.last_stiffness),
                       value(options.first_point_share, options.last_point_share), 0.5f * mesh.sample_gap, false};
        round.colours = i + options.colour_rounds >= options.fine_rounds && !target.colours.empty() &&
                        !mesh.sample_textures.empty();
        round.surfaces = i + options.surface_rounds >= options.fine_rounds;
        weight = run_round(fine, target, round, memory, options).weight;
    }
    if (form && options.fine_rounds > 0) {
        *form = form_of(mesh.fine.pattern, std::move(memory.system), weight);
        form->matches = mesh.sample_of;
        for (auto& match : form->matches)
            match = match < memory.guesses.forward.size() ? memory.guesses.forward[match] : OrientedPoints::no_point;
    }
    return fine.motion;
}

std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last) {
    std::vector<RigidMotion> next(last.begin(), last.end());
    for (std::size_t h = 0; h < next.size(); ++h) {
        const Vector3d was = before[h](mesh.handles[h]), is = last[h](mesh.handles[h]);
        next[h].rotation = last[h].rotation * before[h].rotation.transpose() * last[h].rotation;
        next[h].shift = 2 * is - was - next[h].rotation * mesh.handles[h];
    }
    return next;
}

std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last, std::span<const Vector3d> handles) {
    std::vector<Vector3d> places;
    for (std::size_t h = 0; h < last.size(); ++h) places.push_back(last[h](mesh.handles[h]));
    std::vector<RigidMotion> next(places.empty() ? 0 : handles.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
        const auto apart = [&](const Vector3d& place) { return (place - handles[i]).squaredNorm(); };
        const auto nearest = std::min_element(places.begin(), places.end(),
                                              [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
        const auto h = static_cast<std::size_t>(nearest - places.begin());
        const auto back = last[h].inverse();
        next[i].rotation = last[h].rotation * before[h].rotation.transpose();
        next[i].shift = 2 * handles[i] - before[h](back(handles[i])) - next[i].rotation * handles[i];
    }
    return next;
}

namespace {

// Settles motions that are near the target already.
void settle(const DeformableMesh& mesh, const SurfaceIndex& target, const DeformationOptions& options,
            std::vector<RigidMotion>& motions, DeformationForm* form) {
    auto near = options;
    near.coarse_rounds = 0;
    near.fine_rounds = 2;
    near.middle_reach = options.near_reach;
    near.first_stiffness = std::sqrt(options.first_stiffness * options.last_stiffness);
    near.first_point_share = options.last_point_share;
    motions = register_deformation(mesh, target, motions, near, form);
}

// By what a motion is judged: samples of the reference, and vertices of the target. By index.
struct Compared {
    std::vector<std::uint32_t> forward, back;
};

struct Limit {
    LatticeUnits reach;  // no distance counts as more
    double agreement = 0;
    bool along = false;  // FacingReach::along, towards the target
};

// The sum of the distances of the samples from the target's planes, and of the target's vertices from the planes in
// which they lie from the nearest of all moved samples.
double sum_of_distances(const Compared& compared, const std::vector<Point3f>& points,
                        const std::vector<Point3f>& normals, const SurfaceIndex& target, const Limit& limit) {
    const double most = limit.reach.value;
    const auto reach = static_cast<float>(most), agreement = static_cast<float>(limit.agreement);
    const OrientedPoints reference(points, normals, reach / 2);
    const auto distance = [&](std::uint32_t sample, std::uint32_t vertex) {
        const Vector3d apart = vector_of(target.positions[vertex]) - vector_of(points[sample]);
        return std::min(most, std::abs(apart.dot(vector_of(target.normals[vertex]))));
    };
    double sum = 0;
    std::uint32_t guess = OrientedPoints::no_point;
    for (const auto i : compared.forward) {
        const auto match = target.nearest_facing(points[i], normals[i],
                                                 {.reach = reach, .agreement = agreement, .along = limit.along}, guess);
        if (match.found) guess = match.index;
        sum += match.found ? distance(i, match.index) : most;
    }
    guess = OrientedPoints::no_point;
    for (const auto vertex : compared.back) {
        const auto match = reference.nearest(target.positions[vertex], target.normals[vertex], reach, agreement, guess);
        if (match.found) guess = match.index;
        sum += match.found ? distance(match.index, vertex) : most;
    }
    return sum;
}

// What two motions that differ in one limb are compared by: its samples, and those of the target that lie near it where
// either of the two takes it. Elsewhere both are the same.
Compared around_limb(const DeformableMesh& mesh, const SurfaceIndex& target, const std::vector<bool>& in_limb,
                     std::span<const Moved* const> moved, LatticeUnits within) {
    Compared out;
    for (std::uint32_t i = 0; i < mesh.samples.size(); ++i) {
        const SampleBlend& blend = mesh.fine.blends[i];
        for (std::size_t k = 0; k < blend.count; ++k)
            if (in_limb[blend.handle[k]]) {
                out.forward.push_back(i);
                break;
            }
    }
    std::vector<Point3f> places;
    for (const Moved* m : moved)
        for (const auto i : out.forward) places.push_back(m->points[i]);
    if (places.empty()) return out;
    const std::vector<Point3f> any_way(places.size(), Point3f{});
    const auto reach = static_cast<float>(within.value);
    const OrientedPoints near(places, any_way, reach / 2);
    for (const auto vertex : target.samples)
        if (near.nearest(target.positions[vertex], {}, reach, 0).found) out.back.push_back(vertex);
    return out;
}

}  // namespace

bool follow_nearer_limbs(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> other,
                         const DeformationOptions& options, std::vector<RigidMotion>& motions, DeformationForm* form) {
    const Limit limit{.reach = options.scale.on_lattice(options.near_reach), .agreement = options.agreement};
    std::vector<bool> differs(motions.size());
    for (std::size_t h = 0; h < motions.size(); ++h) differs[h] = is_elsewhere(mesh, h, motions[h], other[h], options);
    if (std::find(differs.begin(), differs.end(), true) == differs.end()) return false;
    const auto beside = graph_of_handles(mesh).beside;
    Stage stage = fine_stage(mesh, motions);
    Moved moved = move_samples(stage, options.threads);
    bool taken = false;
    for (std::size_t seed = 0; seed < motions.size(); ++seed) {
        if (!differs[seed]) continue;
        std::vector<std::size_t> limb = {seed};
        std::vector<bool> in_limb(motions.size(), false);
        differs[seed] = false;
        in_limb[seed] = true;
        for (std::size_t i = 0; i < limb.size(); ++i)
            for (const auto next : beside[limb[i]])
                if (differs[next]) differs[next] = false, in_limb[next] = true, limb.push_back(next);
        for (const auto h : limb) stage.motion[h] = other[h];
        Moved trial = move_samples(stage, options.threads);
        const std::array<const Moved*, 2> both = {&moved, &trial};
        const auto compared = around_limb(mesh, target, in_limb, both, limit.reach);
        const auto error_of = [&](const Moved& m) {
            return sum_of_distances(compared, m.points, m.normals, target, limit);
        };
        if (error_of(trial) < error_of(moved)) {
            moved = std::move(trial);
            taken = true;
        } else {
            for (const auto h : limb) stage.motion[h] = motions[h];
        }
    }
    if (!taken) return false;
    motions = std::move(stage.motion);
    settle(mesh, target, options, motions, form);
    return true;
}

double deformation_error(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> motions,
                         const DeformationOptions& options) {
    if (mesh.samples.empty() || target.samples.empty()) return 0;
    const std::size_t every = mesh.samples.size() + target.samples.size() < 2000 ? 1 : 16;
    const auto rows = rows_of(motions);
    std::vector<Point3f> points, normals;
    for (std::size_t i = 0; i < mesh.samples.size(); i += every) {
        const auto moved =
            moved_sample(mesh.fine.blends[i], rows, mesh.positions[mesh.samples[i]], mesh.sample_normals[i]);
        points.push_back(moved.point);
        normals.push_back(moved.normal);
    }
    Compared compared;
    compared.forward.resize(points.size());
    std::iota(compared.forward.begin(), compared.forward.end(), 0u);
    for (std::size_t i = 0; i < target.samples.size(); i += every) compared.back.push_back(target.samples[i]);
    const double sum = sum_of_distances(
        compared, points, normals, target,
        {.reach = options.scale.on_lattice(options.near_reach), .agreement = options.agreement, .along = true});
    return sum / static_cast<double>(compared.forward.size() + compared.back.size());
}

std::vector<Point3f> deform(const DeformableMesh& mesh, std::span<const RigidMotion> motions, Threads threads) {
    std::vector<Point3f> out(mesh.positions);
    if (motions.empty()) return out;
    const auto rows = rows_of(motions);
    parallel_for(out.size(), threads, 2048, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) out[v] = moved_by(blended(mesh.blends[v], rows), mesh.positions[v]);
    });
    return out;
}

}  // namespace htvm::internal
