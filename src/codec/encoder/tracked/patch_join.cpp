#include "codec/encoder/tracked/patch_join.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

// A vertex of a border, as the strip sees it. The piece's vertices are numbered behind the decoded mesh's.
struct StripVertex {
    std::uint32_t number = 0;
    Vector3d position{}, normal{};
};

// The triangles between two paths that run the same way, the mesh that stays to the left of `left`, the piece to the
// right of `right`. Of all strips, the one with the shortest crossings whose triangles face as the borders do: found
// row by row, since going by the shorter diagonal alone falls behind where one border is longer. Nothing if the paths
// are too long for that or do not face each other.
std::optional<std::vector<Triangle>> strip_between(const std::vector<StripVertex>& left,
                                                   const std::vector<StripVertex>& right) {
    constexpr std::size_t most = std::size_t{1} << 21;
    constexpr double turned = 8;  // what a triangle that faces the other way costs, against one that faces right
    const std::size_t n = left.size(), m = right.size();
    if (n == 0 || m == 0 || n + m < 3 || n * m > most) return std::nullopt;
    constexpr double infinite = std::numeric_limits<double>::infinity();
    std::vector<double> cost(n * m, infinite);
    std::vector<bool> along_left(n * m, false);
    const auto price = [&](const StripVertex& a, const StripVertex& b, const StripVertex& c, double crossing) {
        const auto across = area_vector(a.position, b.position, c.position);
        const double size = length(across);
        const auto facing = normalised(a.normal + b.normal + c.normal);
        const double agreement = size > 0 ? dot(across, facing) / size : -1;
        return crossing * (1 + turned * (1 - agreement) / 2) + (size > 0 ? 0 : 1e12);
    };
    cost[0] = 0;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < m; ++j) {
            const auto apart = left[i].position - right[j].position;
            const double crossing = dot(apart, apart);
            auto& best = cost[i * m + j];
            if (i > 0) {
                const double by_left = cost[(i - 1) * m + j] + price(left[i], left[i - 1], right[j], crossing);
                if (by_left < best) best = by_left, along_left[i * m + j] = true;
            }
            if (j > 0) {
                const double by_right = cost[i * m + j - 1] + price(right[j - 1], right[j], left[i], crossing);
                if (by_right < best) best = by_right, along_left[i * m + j] = false;
            }
        }
    std::vector<Triangle> out;
    for (std::size_t i = n - 1, j = m - 1; i > 0 || j > 0;) {
        if (along_left[i * m + j]) {
            out.push_back({left[i].number, left[i - 1].number, right[j].number});
            --i;
        } else {
            out.push_back({right[j - 1].number, right[j].number, left[i].number});
            --j;
        }
    }
    std::reverse(out.begin(), out.end());
    return out;
}

// The nearest point of the side ab to p, squared.
double squared_distance_to_side(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
    const auto along = b - a, from = p - a;
    const double size = dot(along, along);
    const auto off = from - along * (size > 0 ? std::clamp(dot(from, along) / size, 0.0, 1.0) : 0.0);
    return dot(off, off);
}

// The side of the open border that a side of the piece's border runs along.
struct Partner {
    std::uint32_t chain = no_side, side = 0;
};

class Joiner {
public:
    Joiner(const PatchedMesh& mesh, const LatticeMesh& piece, const CaptureRim& rim, double gap)
        : decoded_(mesh.decoded),
          sides_(mesh.sides),
          stays_(mesh.stays),
          piece_(piece),
          piece_sides_(piece.positions, piece.triangles),
          edge_(mesh.edge),
          rim_(rim),
          gap_(gap),
          normals_(vertex_normals(mesh.decoded.positions, mesh.stays.triangles)),
          piece_normals_(vertex_normals(piece.positions, piece.triangles)),
          unclear_(mesh.decoded.positions.size(), false) {
        for (std::uint32_t c = 0; c < stays_.chains.size(); ++c) {
            taken_.emplace_back(stays_.chains[c].sides.size(), false);
            for (std::uint32_t s = 0; s < stays_.chains[c].sides.size(); ++s) open_.push_back(open_side({c, s}));
        }
    }

    Join run() {
        for (const auto& loop : border_loops(piece_sides_, [](std::uint32_t) { return true; })) join_loop(loop);
        check_what_is_left();
        const bool clear = std::find(unclear_.begin(), unclear_.end(), true) == unclear_.end();
        return {std::move(triangles_), clear ? std::vector<bool>{} : std::move(unclear_)};
    }

private:
    const LatticeMesh& decoded_;
    const Sides& sides_;
    const Remainder& stays_;
    const LatticeMesh& piece_;
    Sides piece_sides_;
    std::span<const double> edge_;
    const CaptureRim& rim_;
    double gap_;
    std::vector<Vector3d> normals_, piece_normals_;
    // A side of the open border, as partners are looked for.
    struct OpenSide {
        Partner at;
        Vector3d from{}, to{}, facing{};
        Vector3d middle{};
        double near = 0;    // how far from it the side of a piece may be that runs along it
        double within = 0;  // how far such a side's middle may be from its own
    };
    std::vector<OpenSide> open_;
    std::vector<std::vector<bool>> taken_;  // sides of the chains that are joined
    std::vector<Triangle> triangles_;
    std::vector<bool> unclear_;
    std::vector<std::uint32_t> staying_;            // vertices that stay, ascending, once the nearest was looked for,
    std::optional<NearestPoints> nearest_staying_;  // in the same order

    Vector3d piece_point(std::uint32_t v) const { return to_vector(piece_.positions[v]); }
    Vector3d middle_of(std::uint32_t side) const {
        return (piece_point(piece_sides_.from(side)) + piece_point(piece_sides_.to(side))) * 0.5;
    }

    OpenSide open_side(const Partner& at) const {
        constexpr double most_gaps = 3;
        const auto side = stays_.chains[at.chain].sides[at.side];
        const auto from = sides_.from(side), to = sides_.to(side);
        OpenSide out{at, to_vector(decoded_.positions[from]), to_vector(decoded_.positions[to])};
        out.facing = normals_[from] + normals_[to];
        out.middle = (out.from + out.to) * 0.5;
        out.near = most_gaps * gap_ * std::max(edge_[from], edge_[to]);
        out.within = out.near + length(out.to - out.from);
        return out;
    }

    Partner partner_of(std::uint32_t side) const {
        const auto middle = middle_of(side);
        const auto along = piece_point(piece_sides_.to(side)) - piece_point(piece_sides_.from(side));
        const auto facing = normal_of(piece_.positions, piece_.triangles[side / 3]);
        Partner out;
        double least = std::numeric_limits<double>::infinity();
        for (const auto& open : open_) {
            const auto apart = middle - open.middle;
            if (dot(apart, apart) > open.within * open.within) continue;
            const double squared = squared_distance_to_side(middle, open.from, open.to);
            if (squared >= least || squared > open.near * open.near) continue;
            if (dot(along, open.to - open.from) > 0 || dot(facing, open.facing) <= 0) continue;
            least = squared;
            out = open.at;
        }
        return out;
    }

    StripVertex staying(std::uint32_t v) const { return {v, to_vector(decoded_.positions[v]), normals_[v]}; }
    StripVertex coming(std::uint32_t v) const {
        return {static_cast<std::uint32_t>(decoded_.positions.size()) + v, to_vector(piece_.positions[v]),
                piece_normals_[v]};
    }

    void give_up_staying(std::uint32_t side) { unclear_[sides_.from(side)] = unclear_[sides_.to(side)] = true; }
    void give_up(const Chain& chain) {
        for (const auto side : chain.sides) give_up_staying(side);
    }
    void give_up_coming(std::uint32_t side) {
        if (stays_.triangles.empty()) return;
        if (!nearest_staying_) {
            std::vector<bool> stays(decoded_.positions.size(), false);
            for (const auto& t : stays_.triangles)
                for (const auto v : t) stays[v] = true;
            std::vector<Point3f> points;
            for (std::uint32_t v = 0; v < stays.size(); ++v) {
                if (!stays[v]) continue;
                staying_.push_back(v);
                points.push_back(point_of(decoded_.positions[v]));
            }
            nearest_staying_.emplace(points);
        }
        unclear_[staying_[nearest_staying_->nearest(to_floats(middle_of(side))).index]] = true;
    }

    // A whole loop of the piece along a whole loop of the open border, from where they are nearest to each other.
    void join_closed(std::uint32_t number, const std::vector<std::uint32_t>& loop) {
        const auto& chain = stays_.chains[number].sides;
        std::size_t start = 0, start_of_loop = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < chain.size(); ++i)
            for (std::size_t j = 0; j < loop.size(); ++j) {
                const auto apart =
                    to_vector(decoded_.positions[sides_.from(chain[i])]) - piece_point(piece_sides_.from(loop[j]));
                if (dot(apart, apart) < least) least = dot(apart, apart), start = i, start_of_loop = j;
            }
        std::vector<StripVertex> left, right;
        for (std::size_t i = 0; i <= chain.size(); ++i)
            left.push_back(staying(sides_.from(chain[(start + i) % chain.size()])));
        for (std::size_t j = 0; j <= loop.size(); ++j)
            right.push_back(coming(piece_sides_.from(loop[(start_of_loop + loop.size() - j) % loop.size()])));
        add_strip(left, right, number);
        taken_[number].assign(chain.size(), true);
    }

    void add_strip(const std::vector<StripVertex>& left, const std::vector<StripVertex>& right, std::uint32_t number) {
        const auto strip = strip_between(left, right);
        if (!strip)
            give_up(stays_.chains[number]);
        else
            triangles_.insert(triangles_.end(), strip->begin(), strip->end());
    }

    void join_loop(const std::vector<std::uint32_t>& loop) {
        constexpr double most = 0.8;
        const std::size_t size = loop.size();
        std::vector<Partner> partners;
        for (const auto& side : loop) partners.push_back(partner_of(side));
        std::map<std::uint32_t, std::size_t> votes;
        for (const auto& p : partners) ++votes[p.chain];
        if (votes.size() == 1 && votes.count(no_side) > 0) return check_loose(loop);
        for (const auto& [chain, count] : votes) {
            if (chain == no_side || !stays_.chains[chain].closed) continue;
            if (static_cast<double>(count) < most * static_cast<double>(size)) continue;
            if (std::find(taken_[chain].begin(), taken_[chain].end(), true) != taken_[chain].end())
                give_up(stays_.chains[chain]);
            else
                join_closed(chain, loop);
            return;
        }
        join_runs(loop, partners);
    }

    // Sides of the piece's border that are joined to nothing must be the capture's own border.
    void check_loose(std::span<const std::uint32_t> sides) {
        for (const auto side : sides)
            if (!rim_.is_near(to_floats(middle_of(side)))) {
                give_up_coming(side);
            }
    }

    // Where a border of the capture interrupts the cut, or one of the mesh the open border: each run of sides with
    // partners in one chain is joined for itself.
    void join_runs(const std::vector<std::uint32_t>& loop, std::vector<Partner>& partners) {
        constexpr std::size_t bridged = 2, fewest = 2;
        const std::size_t size = loop.size();
        for (std::size_t i = 0; i < size; ++i) {  // single sides between two of one chain go with them
            if (partners[i].chain == no_side) continue;
            for (std::size_t gap = 1; gap <= bridged; ++gap) {
                const auto& end = partners[(i + gap + 1) % size];
                if (end.chain != partners[i].chain) continue;
                for (std::size_t k = 1; k <= gap; ++k)
                    if (partners[(i + k) % size].chain != end.chain) partners[(i + k) % size] = partners[i];
            }
        }
        std::vector<std::uint32_t> loose;
        std::size_t start = 0;
        while (start < size && partners[start].chain == partners[(start + size - 1) % size].chain) ++start;
        if (start == size) start = 0;
        for (std::size_t i = 0; i < size;) {
            const auto chain = partners[(start + i) % size].chain;
            std::size_t end = i;
            while (end < size && partners[(start + end) % size].chain == chain) ++end;
            if (chain != no_side && end - i >= fewest)
                join_run(loop, partners, (start + i) % size, end - i);
            else
                for (std::size_t k = i; k < end; ++k) loose.push_back(loop[(start + k) % size]);
            i = end;
        }
        check_loose(loose);
    }

    void join_run(const std::vector<std::uint32_t>& loop, const std::vector<Partner>& partners, std::size_t first,
                  std::size_t count) {
        constexpr std::size_t to_the_end = 2;
        const auto number = partners[first].chain;
        const auto& chain = stays_.chains[number];
        const std::size_t size = chain.sides.size();
        // The piece's border runs the other way.
        std::size_t from = partners[(first + count - 1) % loop.size()].side, to = partners[first].side;
        if (!chain.closed) {
            if (from <= to_the_end) from = 0;
            if (to + to_the_end + 1 >= size) to = size - 1;
            if (from > to) return give_up(chain);
        }
        const std::size_t sides = (to + size - from) % size + 1;
        std::vector<StripVertex> left, right;
        for (std::size_t i = 0; i < sides; ++i) {
            const std::size_t s = (from + i) % size;
            if (taken_[number][s]) give_up_staying(chain.sides[s]);
            taken_[number][s] = true;
            left.push_back(staying(sides_.from(chain.sides[s])));
        }
        left.push_back(staying(sides_.to(chain.sides[to])));
        right.push_back(coming(piece_sides_.to(loop[(first + count - 1) % loop.size()])));
        for (std::size_t i = count; i-- > 0;)
            right.push_back(coming(piece_sides_.from(loop[(first + i) % loop.size()])));
        add_strip(left, right, number);
    }

    // An open border may stay open only where the capture ends.
    void check_what_is_left() {
        for (std::uint32_t c = 0; c < stays_.chains.size(); ++c) {
            const auto& sides = stays_.chains[c].sides;
            for (std::size_t i = 0; i < sides.size(); ++i)
                if (!taken_[c][i] && !rim_.is_near(point_of(decoded_.positions[sides_.from(sides[i])]))) {
                    give_up_staying(sides[i]);
                }
        }
    }
};

}  // namespace

Join join_piece(const PatchedMesh& mesh, const LatticeMesh& piece, const CaptureRim& rim, double gap) {
    return Joiner(mesh, piece, rim, gap).run();
}

}  // namespace htvm::internal
