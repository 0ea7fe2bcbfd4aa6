#include "codec/bones/mtfan.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "codec/bones/nearest_order.h"
#include "codec/intra/triangle_fans.h"
#include "core/lattice.h"
#include "core/parallel.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// A triangulation of known points is far from random, and the decoder has all positions before the first triangle. So
// the distance order is coded candidate by candidate, nearest first, in contexts of the angles that the new triangle
// would have, and the fans' own decisions get the angles that their next step could close. A context is a class of an
// angle or a ratio, compared in doubles by + - * / alone, so that every machine finds the same class.

struct DistanceOrderModels {
    std::array<std::array<BinaryModel, 2048>, 4> is_it;
    std::array<Mixer<4>, 64> mixer;
    UnsignedModel far;  // for an index outside the distance order
};

struct Vector {
    double x, y, z;
};

// Whole numbers of at most 27 bits, so that differences are exact.
Vector vector_of(LatticePoint p) {
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}
Vector between(Vector from, Vector to) { return {to.x - from.x, to.y - from.y, to.z - from.z}; }
double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

// The square of a cosine, with its sign. Comparing these instead of cosines needs no root.
constexpr double signed_square(double cosine) { return cosine < 0 ? -cosine * cosine : cosine * cosine; }

// How many of the descending cosines are above the cosine of the angle; 0 if a side has no length.
template <std::size_t N>
[[gnu::always_inline]] inline std::uint32_t count_below(Vector a, Vector b, const std::array<double, N>& squares) {
    const double product = dot(a, b), square = product < 0 ? -product * product : product * product;
    const double lengths = dot(a, a) * dot(b, b);
    std::uint32_t count = 0;
    for (const double limit : squares) count += square < limit * lengths;
    return count;
}

// Classes 1 .. 15 of a full turn from a to b around the normal, finer for small turns.
[[gnu::always_inline]] inline std::uint32_t turn_class(Vector a, Vector b, Vector normal) {
    constexpr std::array<double, 10> forward = {
        signed_square(0.94), signed_square(0.82),  signed_square(0.68),  signed_square(0.5),   signed_square(0.3),
        signed_square(0.08), signed_square(-0.17), signed_square(-0.42), signed_square(-0.71), signed_square(-0.9)};
    constexpr std::array<double, 3> folded = {signed_square(0.5), signed_square(-0.17), signed_square(-0.71)};
    if (dot(cross(a, b), normal) >= 0) return 1 + count_below(a, b, forward);
    return 15 - count_below(a, b, folded);
}

// Classes 1 .. 7 of an angle up to 180 degrees; 7 beyond that.
[[gnu::always_inline]] inline std::uint32_t angle_class(Vector a, Vector b, Vector normal) {
    constexpr std::array<double, 5> limits = {signed_square(0.76), signed_square(0.5), signed_square(0.2),
                                              signed_square(-0.17), signed_square(-0.5)};
    if (dot(cross(a, b), normal) < 0) return 7;
    return 1 + count_below(a, b, limits);
}

// The positions by visiting number, and the angles between visited vertices.
class VisitedPositions {
public:
    void push_back(LatticePoint point) { points_.push_back(vector_of(point)); }
    Vector operator[](std::uint32_t number) const { return points_[number]; }

    // The angles that the next step of the fan could close.
    FanHints hints(const FanState& fan) const;

private:
    std::vector<Vector> points_;
};

FanHints VisitedPositions::hints(const FanState& fan) const {
    FanHints hints;
    if (fan.behind == OpenEdges::none || fan.end_count == 0 || fan.ends[0] == fan.start) return hints;
    const Vector focus = points_[fan.focus], at = points_[fan.current], end = points_[fan.ends[0]];
    const Vector to_current = between(focus, at), to_end = between(focus, end);
    Vector normal = cross(between(focus, points_[fan.behind]), to_current);
    if (fan.beyond_end != OpenEdges::none) normal = normal + cross(to_end, between(focus, points_[fan.beyond_end]));
    hints.gap = turn_class(to_current, to_end, normal);
    // At the current vertex the gap turns from the left vertex to the focus; at the end, from the focus to the right.
    if (fan.left != OpenEdges::none)
        hints.left = angle_class(between(at, points_[fan.left]), between(at, focus), normal);
    if (fan.right != OpenEdges::none)
        hints.right = angle_class(between(end, focus), between(end, points_[fan.right]), normal);
    return hints;
}

// Most vertices are found among the first few; the rest of the m nearest are searched for only if one is not.
constexpr std::size_t first_look = 8;

// An unvisited vertex as a candidate for the fan's next boundary vertex. Its misfit grows with the cotangent of the new
// triangle's angle at the vertex (it is smallest for the Delaunay triangle) and is huge if the triangle folds back.
struct Candidate {
    std::uint32_t vertex = 0;
    double misfit = 0;
    Vector to_it = {};  // from the focus
};

// Where the fan's next boundary vertex is looked for.
struct OpenSide {
    std::uint32_t stage = 0;  // 0: the fan's start, 1: no triangle behind, 2: no end to reach, 3: within a gap
    Vector side = {};         // from the focus to the current vertex
    Vector normal = {};       // of the triangle behind, in stages 2 and 3
};

// The contexts for coding whether a candidate is the vertex.
struct CandidateClasses {
    std::uint32_t stage = 0;                            // of OpenSide
    std::uint32_t place = 0, left = 0;                  // 0 .. 7: number of candidates before it and after it
    std::uint32_t better_before = 0, better_after = 0;  // 0 .. 3: number of those with less misfit
    std::uint32_t fit = 0;                              // 0 .. 7: class of the misfit
    std::uint32_t turn = 0;      // 0 .. 15: class of the angle at the focus, from the current vertex to it
    std::uint32_t distance = 0;  // 0 .. 7: class of its distance from the current vertex relative to that from the
                                 // focus
};

// Finds those of the m vertices nearest to a focus that are not yet visited, nearest first.
class UnvisitedNear {
public:
    UnvisitedNear(std::span<const LatticePoint> positions, int m, Threads threads);
    UnvisitedNear(const UnvisitedNear&) = delete;
    UnvisitedNear& operator=(const UnvisitedNear&) = delete;

    // Calls traverse(), which uses the functions below. With several threads, another thread meanwhile searches for the
    // first few nearest of every vertex. Where the traversal is ahead of it, it searches itself; both find the same.
    template <class Traversal>
    void search_beside(const Traversal& traverse) {
        struct Traversed {
            std::atomic<bool>& flag;
            ~Traversed() { flag = true; }
        };
        parallel_invoke(
            threads_,
            [&] {
                const Traversed end{traversed_};
                traverse();
            },
            [&] {
                if (!first_nearest_.empty()) search_ahead();
            });
    }

    bool visited(std::uint32_t vertex) const { return visited_[vertex]; }
    void visit(std::uint32_t vertex) { visited_[vertex] = true; }
    // look() sets candidates() for the next boundary vertex of the fan, from the `first_look` nearest. look_farther(),
    // called after it, adds the farther ones.
    void look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus);
    void look_farther();
    std::span<const Candidate> candidates() const { return {candidates_.data(), count_}; }
    CandidateClasses classes(std::size_t place) const;

private:
    void search_ahead();
    [[gnu::always_inline]] void add_candidate(std::uint32_t vertex);

    std::span<const LatticePoint> positions_;
    NearestOrder order_;
    std::size_t m_;
    std::vector<std::uint32_t> first_nearest_;  // first_look each, for the vertices below searched_
    std::atomic<std::size_t> searched_ = 0;
    std::atomic<bool> traversed_ = false;
    Threads threads_ = {};  // the caller's thread alone if the mesh is too small for more
    std::vector<bool> visited_;
    std::uint32_t focus_;  // the vertex whose nearest vertices are in `nearest_`
    OpenSide at_;
    std::size_t found_ = 0, looked_ = 0, count_ = 0;
    std::array<std::uint32_t, mtfan_max_nearest> nearest_;
    std::array<Candidate, mtfan_max_nearest> candidates_;
};

UnvisitedNear::UnvisitedNear(std::span<const LatticePoint> positions, int m, Threads threads)
    : positions_(positions),
      order_(positions),
      m_(static_cast<std::size_t>(m)),
      visited_(positions.size()),
      focus_(OpenEdges::none) {
    constexpr std::size_t worth_threads = 4096;
    if (threads.count < 2 || positions.size() < worth_threads || m_ < first_look) return;
    threads_ = threads;
    first_nearest_.resize(positions.size() * first_look);
}

void UnvisitedNear::search_ahead() {
    constexpr std::size_t block = 64;
    for (std::size_t begin = 0; begin < positions_.size() && !traversed_; begin += block) {
        const std::size_t end = std::min(begin + block, positions_.size());
        for (std::size_t v = begin; v < end; ++v)
            order_.find(static_cast<std::uint32_t>(v), std::span(first_nearest_).subspan(v * first_look, first_look));
        searched_.store(end, std::memory_order_release);
    }
}

void UnvisitedNear::look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus) {
    if (focus != focus_) {
        focus_ = focus;
        if (focus >= searched_.load(std::memory_order_acquire)) {
            looked_ = found_ = order_.find(focus, std::span(nearest_).first(std::min(first_look, m_)));
        } else {
            looked_ = found_ = first_look;
            std::copy_n(first_nearest_.begin() + static_cast<std::ptrdiff_t>(std::size_t{focus} * first_look),
                        first_look, nearest_.begin());
        }
    }
    at_ = {};
    if (fan.current != OpenEdges::none) {
        const Vector centre = vector_of(positions_[focus]);
        at_.stage = 1;
        at_.side = between(centre, known[fan.current]);
        if (fan.behind != OpenEdges::none) {
            at_.stage = fan.end_count == 0 || fan.ends[0] == fan.start ? 2 : 3;
            at_.normal = cross(between(centre, known[fan.behind]), at_.side);
        }
    }
    count_ = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < found_; ++i)
        if (!visited_[nearest_[i]]) nearest_[kept++] = nearest_[i];
    found_ = kept;
    for (std::size_t i = 0; i < found_; ++i) add_candidate(nearest_[i]);
}

void UnvisitedNear::look_farther() {
    if (looked_ < first_look || looked_ >= m_) return;
    std::array<std::uint32_t, mtfan_max_nearest> all;
    const std::size_t found = order_.find(focus_, std::span(all).first(m_));
    for (std::size_t i = looked_; i < found; ++i) {
        if (visited_[all[i]]) continue;
        nearest_[found_++] = all[i];
        add_candidate(all[i]);
    }
    looked_ = m_;
}

inline void UnvisitedNear::add_candidate(std::uint32_t vertex) {
    Candidate& candidate = candidates_[count_++];
    candidate.vertex = vertex;
    candidate.to_it = between(vector_of(positions_[focus_]), vector_of(positions_[vertex]));
    const Vector from_current = between(at_.side, candidate.to_it);
    const Vector face = cross(at_.side, candidate.to_it);
    const double area = dot(face, face), product = dot(candidate.to_it, from_current);
    candidate.misfit = area > 0 ? (product < 0 ? -product * product : product * product) / area : 1e12;
    if (at_.stage >= 2 && dot(face, at_.normal) < 0) candidate.misfit = 1e13 - candidate.misfit;
}

CandidateClasses UnvisitedNear::classes(std::size_t place) const {
    CandidateClasses classes;
    const Candidate& candidate = candidates_[place];
    constexpr std::array<double, 7> fits = {-0.09, 0, 0.09, 0.36, 1, 2.25, 9};
    for (const double limit : fits) classes.fit += candidate.misfit >= limit;
    for (std::size_t i = 0; i < place; ++i) classes.better_before += candidates_[i].misfit < candidate.misfit;
    for (std::size_t i = place + 1; i < count_; ++i) classes.better_after += candidates_[i].misfit < candidate.misfit;
    classes.better_before = std::min(classes.better_before, 3u);
    classes.better_after = std::min(classes.better_after, 3u);
    classes.place = static_cast<std::uint32_t>(std::min<std::size_t>(place, 7));
    classes.left = static_cast<std::uint32_t>(std::min<std::size_t>(count_ - place - 1, 7));
    classes.stage = at_.stage;
    if (at_.stage == 0) return classes;
    constexpr std::array<double, 7> ratios = {0.4, 0.7, 1.0, 1.45, 2.0, 3.0, 5.0};
    const Vector from_current = between(at_.side, candidate.to_it);
    const double from = dot(from_current, from_current), to = dot(candidate.to_it, candidate.to_it);
    for (const double ratio : ratios) classes.distance += from >= ratio * to;
    if (at_.stage >= 2) classes.turn = turn_class(at_.side, candidate.to_it, at_.normal);
    return classes;
}

// Codes whether a candidate is the next boundary vertex, given that none before it is.
template <class Coder>
bool code_is_it(Coder& coder, DistanceOrderModels& models, const CandidateClasses& c, bool wanted) {
    const std::uint32_t rank = c.better_after * 4 + c.stage;
    auto& is_it = models.is_it;
    return code_mixed(
        coder, models.mixer[rank * 4 + c.better_before],
        std::array<BinaryModel*, 4>{&is_it[0][(rank * 8 + c.place) * 8 + c.left],
                                    &is_it[1][(rank * 16 + c.turn) * 8 + c.distance],
                                    &is_it[2][((rank * 8 + c.fit) * 4 + c.better_before) * 4 + std::min(c.left, 3u)],
                                    &is_it[3][(rank * 16 + c.turn) * 8 + c.fit]},
        wanted);
}

// Codes the distance order of the vertex that the fan's step leads to: its place among the candidates, which are set
// before, or candidates().size() if it is not among them.
template <class Coder>
std::size_t code_distance_order(Coder& coder, DistanceOrderModels& models, UnvisitedNear& unvisited,
                                const VisitedPositions& known, const FanState& fan, std::uint32_t focus,
                                std::uint32_t wanted) {
    unvisited.look(known, fan, focus);
    std::size_t place = 0;
    for (int round = 0; round < 2; ++round) {
        const auto candidates = unvisited.candidates();
        for (; place < candidates.size(); ++place)
            if (code_is_it(coder, models, unvisited.classes(place), candidates[place].vertex == wanted)) return place;
        if (round == 0) unvisited.look_farther();
    }
    return place;
}

// Codes the index z of a vertex that is not among the candidates (-z - 1 in eq. 8), relative to the index of the
// current boundary vertex: if the positions come in an order along the surface, neighbours have similar indices. In a
// corrupt stream it may be out of range.
template <class Coder>
std::uint32_t code_index_directly(Coder& coder, DistanceOrderModels& models, std::uint32_t current,
                                  std::uint32_t wanted) {
    const std::uint32_t forward = wanted - current, backward = current - wanted;
    const std::uint32_t folded = coder.number(models.far, wanted >= current ? 2 * forward : 2 * backward - 1);
    return folded % 2 == 0 ? current + folded / 2 : current - folded / 2 - 1;
}

// What both sides know while the fans visit the vertices, and how the next vertex is named.
struct Visits {
    Visits(std::span<const LatticePoint> all, int m, Threads threads) : positions(all), unvisited(all, m, threads) {}

    std::span<const LatticePoint> positions;
    UnvisitedNear unvisited;
    VisitedPositions known;
    std::vector<std::uint32_t> order;  // input index by visiting number
    DistanceOrderModels models;

    void visit(std::uint32_t vertex) {
        unvisited.visit(vertex);
        known.push_back(positions[vertex]);
        order.push_back(vertex);
    }
    struct Named {
        std::uint32_t vertex = 0;  // may be out of range, or visited already, in a corrupt stream
        std::size_t place = 0;     // its distance order, if it has one
        bool directly = false;     // it has no distance order: its index is coded
    };
    template <class Coder>
    Named code_vertex(Coder coder, const FanState& fan, std::uint32_t wanted) {
        const std::size_t place = code_distance_order(coder, models, unvisited, known, fan, order[fan.focus], wanted);
        const auto candidates = unvisited.candidates();
        if (place < candidates.size()) return {candidates[place].vertex, place, false};
        const std::uint32_t current = order[fan.current == OpenEdges::none ? fan.focus : fan.current];
        return {code_index_directly(coder, models, current, wanted), place, true};
    }
};

// The callbacks of encode_fans() and decode_fans() for each vertex that the fans visit.
struct EncodedOrders {
    static constexpr bool visits_isolated = true;
    Visits visits;
    RangeEncoder encoder;
    std::vector<std::uint32_t> counts;  // by distance order; the last entry: coded directly

    void seed(std::uint32_t vertex) { visits.visit(vertex); }
    FanHints hints(const FanState& fan) const { return visits.known.hints(fan); }
    void discover(const FanState& fan, std::uint32_t vertex) {
        const auto named = visits.code_vertex(WritingCoder<RangeEncoder>{encoder}, fan, vertex);
        ++(named.directly ? counts.back() : counts[named.place]);
        visits.visit(vertex);
    }
};

struct DecodedOrders {
    static constexpr bool visits_isolated = true;
    Visits visits;
    RangeDecoder decoder;
    std::uint32_t next_seed = 0;

    bool seed() {
        while (next_seed < visits.positions.size() && visits.unvisited.visited(next_seed)) ++next_seed;
        if (next_seed == visits.positions.size()) return false;
        visits.visit(next_seed);
        return true;
    }
    FanHints hints(const FanState& fan) const { return visits.known.hints(fan); }
    bool discover(const FanState& fan) {
        const std::uint32_t vertex =
            visits.code_vertex(ReadingCoder<RangeDecoder>{decoder}, fan, OpenEdges::none).vertex;
        if (vertex >= visits.positions.size() || visits.unvisited.visited(vertex) || decoder.exhausted()) return false;
        visits.visit(vertex);
        return true;
    }
};

}  // namespace

EncodedMtfan encode_mtfan(std::span<const LatticePoint> decoded_positions, std::span<const Triangle> triangles, int m,
                          Threads threads) {
    EncodedMtfan result;
    result.distance_order_counts.resize(static_cast<std::size_t>(m) + 1);
    if (triangles.empty()) return result;
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    const auto models = std::unique_ptr<FanModels>(new FanModels);
    // On the heap, because the models and candidates are large.
    const auto discovery = std::unique_ptr<EncodedOrders>(
        new EncodedOrders{{decoded_positions, m, threads}, {}, std::move(result.distance_order_counts)});
    FanOrder fans;
    discovery->visits.unvisited.search_beside([&] {
        fans = encode_fans(coder, *models, static_cast<std::uint32_t>(decoded_positions.size()), triangles, *discovery);
    });
    result.fans = encoder.finish();
    result.distance_orders = discovery->encoder.finish();
    result.distance_order_counts = std::move(discovery->counts);
    result.triangles = std::move(fans.triangles);
    for (Triangle& triangle : result.triangles)
        for (std::uint32_t& vertex : triangle) vertex = fans.order[vertex];
    return result;
}

Result<std::vector<Triangle>> decode_mtfan(std::span<const std::uint8_t> fans,
                                           std::span<const std::uint8_t> distance_orders,
                                           std::span<const LatticePoint> positions, std::uint32_t triangle_count, int m,
                                           Threads threads) {
    if (m < 1 || m > mtfan_max_nearest)
        return fail(ErrorKind::corrupt_stream,
                    "M-TFAN's number of nearest vertices must be 1 to 64, but the stream has " + std::to_string(m) +
                        ": it is damaged.");
    std::vector<Triangle> triangles;
    if (triangle_count == 0) return triangles;
    RangeDecoder decoder(fans);
    const auto discovery =
        std::unique_ptr<DecodedOrders>(new DecodedOrders{{positions, m, threads}, RangeDecoder(distance_orders)});
    bool decoded = false;
    discovery->visits.unvisited.search_beside(
        [&] { decoded = decode_fans(decoder, triangle_count, *discovery, triangles); });
    if (!decoded)
        return fail(ErrorKind::corrupt_stream,
                    "The M-TFAN connectivity names vertices that do not exist or ends early: the stream is damaged.");
    for (Triangle& triangle : triangles)
        for (std::uint32_t& vertex : triangle) vertex = discovery->visits.order[vertex];
    return triangles;
}

}  // namespace htvm::internal
