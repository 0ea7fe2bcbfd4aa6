#include "tfan_mpeg.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "codec/intra/triangle_fans.h"
#include "core/bytes.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace htvm::lab {

using namespace internal;
namespace {

constexpr std::uint32_t none = 0xFFFFFFFFu;

// ---- Connectivity: triangles to symbols and back --------------------------------------------------------------------

// Values below these have a symbol of their own in the model of a stream; all others follow an escape.
constexpr std::uint32_t fan_symbols = 4, degree_symbols = 16, configuration_symbols = 10, operation_symbols = 2,
                        index_symbols = 8, residual_symbols = 256;

struct FanSymbols {
    std::vector<std::uint32_t> fans;     // one per vertex: the number of fans that it is the focus of
    std::vector<std::uint32_t> degrees;  // one per fan: boundary vertices - 2 + triangles at the focus that were coded
                                         // before
    std::vector<std::uint32_t> configurations;  // one per fan
    // For boundary vertices that the configuration does not determine: 0 for a new vertex, 1 for a known one, which has
    // an index.
    std::vector<std::uint32_t> operations;
    std::vector<std::uint32_t> indices;  // zig-zag
};

std::uint32_t zigzag(std::int32_t v) {
    return (static_cast<std::uint32_t>(v) << 1) ^ static_cast<std::uint32_t>(v >> 31);
}
std::int32_t from_zigzag(std::uint32_t v) {
    return static_cast<std::int32_t>(v >> 1) ^ -static_cast<std::int32_t>(v & 1);
}

// What both sides know at a focus vertex: the coded triangles there, and the vertices that a fan is likely to meet.
// Vertices are named by their visiting number.
class FocusView {
public:
    explicit FocusView(std::size_t vertex_count)
        : first_(vertex_count, none), seen_(vertex_count), place_(vertex_count) {}

    void add_triangle(const Triangle& t) {
        const auto triangle = static_cast<std::uint32_t>(triangles_.size());
        triangles_.push_back(t);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            next_.push_back(none);
            if (std::find(t.begin(), t.begin() + corner, t[corner]) != t.begin() + corner) continue;
            next_.back() = first_[t[corner]];
            first_[t[corner]] = 3 * triangle + static_cast<std::uint32_t>(corner);
        }
    }

    // Builds the list of visited vertices: those in coded triangles at the focus that come after it, ascending. If
    // there are more than two, those in only one triangle, where a fan begins or ends, are moved to the front.
    void look_from(std::uint32_t focus) {
        for (const std::uint32_t v : visited_) seen_[v] = 0;
        visited_.clear();
        focus_ = focus;
        coded_ = 0;
        for (std::uint32_t corner = first_[focus]; corner != none; corner = next_[corner], ++coded_)
            for (const std::uint32_t v : triangles_[corner / 3])
                if (v > focus && seen_[v]++ == 0) visited_.push_back(v);
        std::sort(visited_.begin(), visited_.end());
        if (visited_.size() > 2)
            std::stable_partition(visited_.begin(), visited_.end(), [&](std::uint32_t v) { return seen_[v] == 1; });
        for (std::size_t i = 0; i < visited_.size(); ++i) place_[visited_[i]] = static_cast<std::uint32_t>(i);
    }
    // Appends a new vertex to the list.
    void meet(std::uint32_t v) {
        seen_[v] = 1;
        place_[v] = static_cast<std::uint32_t>(visited_.size());
        visited_.push_back(v);
    }
    std::uint32_t coded_triangles() const { return coded_; }

    // -k for the k-th of the list, counted from 1; for others, how much later than the focus it was visited.
    std::int32_t index_of(std::uint32_t v) const {
        return seen_[v] ? -1 - static_cast<std::int32_t>(place_[v]) : static_cast<std::int32_t>(v - focus_);
    }
    // The inverse; none if there is no such place. The caller must refuse a vertex beyond the visited ones.
    std::uint32_t vertex_of(std::int32_t index) const {
        if (index >= 0) return focus_ + static_cast<std::uint32_t>(index);
        const auto place = static_cast<std::size_t>(-1 - index);
        return place < visited_.size() ? visited_[place] : none;
    }
    std::vector<Triangle>& triangles() { return triangles_; }

private:
    std::vector<Triangle> triangles_;
    std::vector<std::uint32_t> first_, next_;  // corners (3 triangle + corner) at each vertex, as lists
    std::vector<std::uint32_t> seen_;          // number of the focus's triangles at the vertex; 0: not in the list
    std::vector<std::uint32_t> place_;         // its place in the list
    std::vector<std::uint32_t> visited_;
    std::uint32_t focus_ = 0, coded_ = 0;
};

// A fan's boundary as operations and indices. A configuration fixes the first and the last of them, and may say that
// all between are new:
//   0, 7  known, new ..., known; the first and the last are the list's first two, in either order
//   1, 8  the same with anything between
//   2, 3  new ..., known: the list's first, or second
//   4, 5  known: the list's first, or second; new ...
//   6     all new
//   9     anything
struct Boundary {
    std::vector<std::uint8_t> known;    // one per boundary vertex
    std::vector<std::int32_t> indices;  // one per known vertex
};

constexpr std::uint32_t anything = 9;

std::uint32_t configuration_of(const Boundary& b) {
    const bool first = b.known.front(), last = b.known.back();
    const bool between_new =
        std::none_of(b.known.begin() + 1, b.known.end() - 1, [](auto known) { return known != 0; });
    if (b.indices.empty()) return 6;
    const std::int32_t from = b.indices.front(), to = b.indices.back();
    if (first && last && from == -1 && to == -2) return between_new ? 0 : 1;
    if (first && last && from == -2 && to == -1) return between_new ? 7 : 8;
    if (!between_new || (first && last)) return anything;
    if (last && to >= -2 && to <= -1) return to == -1 ? 2 : 3;
    if (first && from >= -2 && from <= -1) return from == -1 ? 4 : 5;
    return anything;
}

void write_boundary(const Boundary& b, FanSymbols& out) {
    const std::uint32_t configuration = configuration_of(b);
    out.configurations.push_back(configuration);
    const std::size_t named = configuration == 1 || configuration == 8 ? 1 : 0;  // at each end
    if (named == 0 && configuration != anything) return;
    out.operations.insert(out.operations.end(), b.known.begin() + named, b.known.end() - named);
    for (std::size_t i = named; i + named < b.indices.size(); ++i) out.indices.push_back(zigzag(b.indices[i]));
}

// Reads symbols one after another.
struct Cursor {
    const std::vector<std::uint32_t>& values;
    std::size_t next = 0;
    bool ended = false;  // true once more were read than there are; the surplus ones are 0
    std::uint32_t take() {
        if (next < values.size()) return values[next++];
        ended = true;
        return 0;
    }
};

void read_boundary(std::uint32_t configuration, std::size_t degree, Cursor& operations, Cursor& indices, Boundary& b) {
    b.known.assign(degree, 0);
    b.indices.clear();
    const auto between = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end && !operations.ended; ++i) {
            b.known[i] = operations.take() != 0;
            if (b.known[i]) b.indices.push_back(from_zigzag(indices.take()));
        }
    };
    const auto ends = [&](std::int32_t from, std::int32_t to, bool all_new) {
        b.known.front() = b.known.back() = 1;
        b.indices.push_back(from);
        if (!all_new) between(1, degree - 1);
        b.indices.push_back(to);
    };
    switch (configuration) {
        case 0:
        case 1:
            return ends(-1, -2, configuration == 0);
        case 7:
        case 8:
            return ends(-2, -1, configuration == 7);
        case 2:
        case 3:
            b.known.back() = 1;
            return b.indices.push_back(configuration == 2 ? -1 : -2);
        case 4:
        case 5:
            b.known.front() = 1;
            return b.indices.push_back(configuration == 4 ? -1 : -2);
        case 6:
            return;
        default:
            return between(0, degree);
    }
}

struct Traversed {
    FanSymbols symbols;
    std::vector<std::uint32_t> order;  // input index by visiting number
    std::vector<Triangle> triangles;   // in visiting numbers, as decoded
};

Traversed traverse(std::uint32_t vertex_count, std::span<const Triangle> triangles) {
    Traversed out;
    FocusLinks links(vertex_count, triangles);
    FocusView view(vertex_count);
    std::vector<std::uint32_t> number(vertex_count, none);
    const auto visit = [&](std::uint32_t vertex) {
        number[vertex] = static_cast<std::uint32_t>(out.order.size());
        out.order.push_back(vertex);
    };
    Boundary boundary;
    std::uint32_t seed = 0;
    for (std::uint32_t focus = 0; focus < vertex_count; ++focus) {
        if (focus == out.order.size()) {
            while (number[seed] != none) ++seed;
            visit(seed);
        }
        view.look_from(focus);
        const std::uint32_t coded = view.coded_triangles();
        std::uint32_t fans = 0;
        for (links.gather(out.order[focus]); links.remaining() > 0; ++fans) {
            boundary.known.clear();
            boundary.indices.clear();
            std::uint32_t previous = none;
            const auto step = [&](std::uint32_t vertex) {
                boundary.known.push_back(number[vertex] != none);
                if (number[vertex] == none) {
                    visit(vertex);
                    view.meet(number[vertex]);
                } else {
                    boundary.indices.push_back(view.index_of(number[vertex]));
                }
                if (previous != none) view.add_triangle({focus, previous, number[vertex]});
                previous = number[vertex];
            };
            std::uint32_t vertex = links.any_start();
            for (step(vertex); links.leads_on(vertex);) step(vertex = links.follow(vertex));
            out.symbols.degrees.push_back(static_cast<std::uint32_t>(boundary.known.size()) - 2 + coded);
            write_boundary(boundary, out.symbols);
        }
        out.symbols.fans.push_back(fans);
    }
    out.triangles = std::move(view.triangles());
    return out;
}

Result<std::vector<Triangle>> triangles_of(const FanSymbols& symbols, std::uint32_t vertex_count,
                                           std::uint32_t triangle_count) {
    const auto damaged = [] { return fail(ErrorKind::corrupt_stream, "the fans name an impossible vertex"); };
    FocusView view(vertex_count);
    Cursor fans{symbols.fans}, degrees{symbols.degrees}, configurations{symbols.configurations};
    Cursor operations{symbols.operations}, indices{symbols.indices};
    Boundary boundary;
    std::uint32_t visited = 0, left = triangle_count;
    for (std::uint32_t focus = 0; focus < vertex_count; ++focus) {
        if (focus == visited) ++visited;
        view.look_from(focus);
        for (std::uint32_t fan = fans.take(); fan > 0; --fan) {
            const std::uint32_t degree = degrees.take() - view.coded_triangles() + 2;
            if (degrees.ended || degree < 2 || degree - 1 > left) return damaged();
            left -= degree - 1;
            read_boundary(configurations.take(), degree, operations, indices, boundary);
            if (configurations.ended || operations.ended || indices.ended) return damaged();
            std::size_t next = 0;
            std::uint32_t previous = none;
            for (const bool known : boundary.known) {
                if (!known && visited == vertex_count) return damaged();
                const std::uint32_t vertex = known ? view.vertex_of(boundary.indices[next++]) : visited++;
                if (vertex >= visited) return damaged();
                if (!known) view.meet(vertex);
                if (previous != none) view.add_triangle({focus, previous, vertex});
                previous = vertex;
            }
        }
    }
    if (fans.ended || left > 0) return damaged();
    return std::move(view.triangles());
}

// ---- Attributes: one prediction per vertex --------------------------------------------------------------------------

// Every vertex is predicted from vertices before it. Best is a + b - c of a triangle (a, b, c) that shares its edge a,
// b with one of the vertex's own triangles; of several, the one with the latest c, which is the nearest along the
// traversal. Otherwise the latest neighbour is used, and for a vertex without known neighbours the vertex before it.
struct Prediction {
    std::uint32_t a = none, b = none, c = none;  // for a neighbour, b and c are none; for the first vertex, a is none
                                                 // too
};

class Predictor {
public:
    Predictor(std::size_t vertex_count, std::span<const Triangle> triangles)
        : triangles_(triangles), first_(vertex_count + 1), at_(3 * triangles.size()) {
        for (const Triangle& t : triangles)
            for (const std::uint32_t v : t) ++first_[v + 1];
        for (std::size_t v = 0; v < vertex_count; ++v) first_[v + 1] += first_[v];
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        for (std::uint32_t t = 0; t < triangles.size(); ++t)
            for (const std::uint32_t v : triangles[t]) at_[next[v]++] = t;
    }

    Prediction parallelogram(std::uint32_t vertex) const {
        Prediction best;
        for (const std::uint32_t t : triangles_at(vertex)) {
            const auto [a, b] = others(triangles_[t], vertex);
            if (a >= vertex || b >= vertex || a == b) continue;
            const std::uint32_t c = latest_across(a, b, vertex);
            if (c != none && (best.c == none || c > best.c)) best = {a, b, c};
        }
        return best.c != none ? best : neighbour(vertex);
    }

    Prediction neighbour(std::uint32_t vertex) const {
        Prediction best;
        for (const std::uint32_t t : triangles_at(vertex))
            for (const std::uint32_t v : triangles_[t])
                if (v < vertex && (best.a == none || v > best.a)) best.a = v;
        if (best.a == none && vertex > 0) best.a = vertex - 1;
        return best;
    }

private:
    // The most triangles examined per vertex: bounds the work at the hub of a large fan, in the same way on both sides.
    static constexpr std::size_t most_triangles = 64;

    std::span<const std::uint32_t> triangles_at(std::uint32_t v) const {
        return std::span(at_).subspan(first_[v], std::min<std::size_t>(first_[v + 1] - first_[v], most_triangles));
    }
    static std::pair<std::uint32_t, std::uint32_t> others(const Triangle& t, std::uint32_t vertex) {
        const std::size_t corner = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
        return {t[(corner + 1) % 3], t[(corner + 2) % 3]};
    }
    std::uint32_t latest_across(std::uint32_t a, std::uint32_t b, std::uint32_t before) const {
        if (first_[b + 1] - first_[b] < first_[a + 1] - first_[a]) std::swap(a, b);
        std::uint32_t latest = none;
        for (const std::uint32_t t : triangles_at(a)) {
            const auto [p, q] = others(triangles_[t], a);
            const std::uint32_t c = p == b ? q : q == b ? p : none;
            if (c < before && c != a && c != b && (latest == none || c > latest)) latest = c;
        }
        return latest;
    }

    std::span<const Triangle> triangles_;
    std::vector<std::uint32_t> first_, at_;  // triangles at each vertex, in compressed rows
};

using Values = std::array<std::int32_t, 3>;  // a quantised position or colour

// Sums modulo 2^32: in a damaged stream predictions can build on each other until they overflow.
std::int32_t wrapped(std::int64_t v) { return static_cast<std::int32_t>(static_cast<std::uint32_t>(v)); }

Values predicted_values(const Prediction& p, const std::vector<Values>& values) {
    if (p.a == none) return {};
    Values out = values[p.a];
    for (std::size_t i = 0; i < 3 && p.c != none; ++i)
        out[i] = wrapped(std::int64_t{out[i]} + values[p.b][i] - values[p.c][i]);
    return out;
}

// predict: gives the Prediction of a vertex. The residuals of all components, zig-zag, in one stream.
template <class Predict>
std::vector<std::uint32_t> residuals_of(const std::vector<Values>& values, Predict predict) {
    std::vector<std::uint32_t> out;
    out.reserve(3 * values.size());
    for (std::uint32_t v = 0; v < values.size(); ++v) {
        const Values expected = predicted_values(predict(v), values);
        for (std::size_t i = 0; i < 3; ++i) out.push_back(zigzag(wrapped(std::int64_t{values[v][i]} - expected[i])));
    }
    return out;
}

template <class Predict>
std::vector<Values> values_of(const std::vector<std::uint32_t>& residuals, Predict predict) {
    std::vector<Values> out(residuals.size() / 3);
    for (std::uint32_t v = 0; v < out.size(); ++v) {
        const Values expected = predicted_values(predict(v), out);
        for (std::size_t i = 0; i < 3; ++i)
            out[v][i] = wrapped(std::int64_t{expected[i]} + from_zigzag(residuals[3 * std::size_t{v} + i]));
    }
    return out;
}

// ---- Entropy coding: a stream of numbers under one adaptive model ---------------------------------------------------

struct NumberModel {
    explicit NumberModel(std::uint32_t own_symbols)
        : escape(own_symbols), symbols(SymbolModel::for_alphabet(own_symbols + 1)) {}
    std::uint32_t escape;
    SymbolModel symbols;
    UnsignedModel beyond;  // exponential Golomb
};

void write_numbers(const std::vector<std::uint32_t>& values, std::uint32_t own_symbols, ByteWriter& out) {
    RangeEncoder encoder;
    NumberModel model(own_symbols);
    for (const std::uint32_t value : values) {
        encode_symbol(encoder, model.symbols, std::min(value, model.escape));
        if (value >= model.escape) encode_unsigned(encoder, model.beyond, value - model.escape);
    }
    const auto bytes = encoder.finish();
    out.varint(values.size());
    out.varint(bytes.size());
    out.bytes(bytes);
}

bool read_numbers(ByteReader& in, std::uint32_t own_symbols, std::uint64_t most, std::vector<std::uint32_t>& values) {
    const std::uint64_t count = in.varint();
    const auto bytes = in.bytes(in.varint());
    if (!in.ok() || count > most) return false;
    RangeDecoder decoder(bytes);
    NumberModel model(own_symbols);
    for (std::uint64_t i = 0; i < count && !decoder.exhausted(); ++i) {
        std::uint32_t value = decode_symbol(decoder, model.symbols);
        if (value >= model.escape) value = model.escape + decode_unsigned(decoder, model.beyond);
        values.push_back(value);
    }
    return values.size() == count;
}

// ---- A frame --------------------------------------------------------------------------------------------------------

// Cells over the bounding box, of equal size in all directions.
struct Grid {
    std::array<float, 3> low{};
    float side = 0;  // the longest
    int bits = 10;
    double cell() const { return side / (std::exp2(bits) - 1); }
};

Grid grid_of(const Mesh& mesh, int bits) {
    Grid grid;
    grid.bits = bits;
    if (mesh.positions.empty()) return grid;
    std::array<float, 3> high = grid.low = mesh.positions[0];
    for (const auto& p : mesh.positions)
        for (std::size_t i = 0; i < 3; ++i) {
            grid.low[i] = std::min(grid.low[i], p[i]);
            high[i] = std::max(high[i], p[i]);
        }
    for (std::size_t i = 0; i < 3; ++i) grid.side = std::max(grid.side, high[i] - grid.low[i]);
    return grid;
}

Result<void> check(const Mesh& mesh, const MpegTfanSettings& settings) {
    const std::size_t count = mesh.positions.size();
    if (settings.position_bits < 1 || settings.position_bits > 30)
        return fail(ErrorKind::bad_input, "tfan-mpeg: position bits are 1 to 30");
    if (settings.colour_step < 1 || settings.colour_step > 255)
        return fail(ErrorKind::bad_input, "tfan-mpeg: a colour step is 1 to 255");
    if (!mesh.colours.empty() && mesh.colours.size() != count)
        return fail(ErrorKind::bad_input, "tfan-mpeg: there are not as many colours as vertices");
    for (const auto& p : mesh.positions)
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            return fail(ErrorKind::bad_input, "tfan-mpeg: a position is not finite");
    for (const Triangle& t : mesh.triangles)
        if (std::max({t[0], t[1], t[2]}) >= count)
            return fail(ErrorKind::bad_input, "tfan-mpeg: a triangle names a vertex that does not exist");
    return {};
}

}  // namespace

Result<MpegTfanFrame> encode_mpeg_tfan(const Mesh& mesh, const MpegTfanSettings& settings) {
    if (auto ok = check(mesh, settings); !ok) return tl::unexpected(ok.error());
    const auto vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
    const Grid grid = grid_of(mesh, settings.position_bits);
    ByteWriter out;
    out.varint(vertex_count);
    out.varint(mesh.triangles.size());
    out.u8(static_cast<std::uint8_t>(grid.bits));
    for (const float f : {grid.low[0], grid.low[1], grid.low[2], grid.side}) out.u32(std::bit_cast<std::uint32_t>(f));
    out.u8(static_cast<std::uint8_t>(mesh.colours.empty() ? 0 : settings.colour_step));
    MpegTfanFrame frame;
    std::size_t counted = 0;
    const auto bytes_since = [&] { return out.size() - std::exchange(counted, out.size()); };
    frame.layers.overhead = bytes_since();

    Traversed traversed = traverse(vertex_count, mesh.triangles);
    write_numbers(traversed.symbols.fans, fan_symbols, out);
    write_numbers(traversed.symbols.degrees, degree_symbols, out);
    write_numbers(traversed.symbols.configurations, configuration_symbols, out);
    write_numbers(traversed.symbols.operations, operation_symbols, out);
    write_numbers(traversed.symbols.indices, index_symbols, out);
    frame.layers[Layer::fans] = bytes_since();

    const Predictor predictor(vertex_count, traversed.triangles);
    std::vector<Values> values(vertex_count);
    const double scale = grid.side > 0 ? 1 / grid.cell() : 0;
    for (std::uint32_t v = 0; v < vertex_count; ++v)
        for (std::size_t i = 0; i < 3; ++i)
            values[v][i] = static_cast<std::int32_t>(
                std::lround((double{mesh.positions[traversed.order[v]][i]} - grid.low[i]) * scale));
    write_numbers(residuals_of(values, [&](std::uint32_t v) { return predictor.parallelogram(v); }), residual_symbols,
                  out);
    frame.layers[Layer::geometry] = bytes_since();

    if (!mesh.colours.empty()) {
        for (std::uint32_t v = 0; v < vertex_count; ++v)
            for (std::size_t i = 0; i < 3; ++i)
                values[v][i] = static_cast<std::int32_t>(
                    std::lround(static_cast<double>(mesh.colours[traversed.order[v]][i]) / settings.colour_step));
        write_numbers(residuals_of(values, [&](std::uint32_t v) { return predictor.neighbour(v); }), residual_symbols,
                      out);
        frame.layers[Layer::colour] = bytes_since();
    }
    frame.order = std::move(traversed.order);
    frame.bytes = out.take();
    return frame;
}

Result<Mesh> decode_mpeg_tfan(std::span<const std::uint8_t> bytes) {
    const auto damaged = [] { return fail(ErrorKind::corrupt_stream, "the tfan-mpeg frame ends early or is damaged"); };
    ByteReader in(bytes);
    const std::uint64_t vertices = in.varint(), triangles = in.varint();
    Grid grid;
    grid.bits = in.u8();
    for (float& f : grid.low) f = std::bit_cast<float>(in.u32());
    grid.side = std::bit_cast<float>(in.u32());
    const int colour_step = in.u8();
    // A vertex or triangle takes at least a thousandth of a bit; data that claims more of them is damaged.
    const std::uint64_t most = std::min<std::uint64_t>(1u << 28, 8192 * std::uint64_t{bytes.size()});
    if (!in.ok() || vertices > most || triangles > most || grid.bits < 1 || grid.bits > 30) return damaged();

    FanSymbols symbols;
    if (!read_numbers(in, fan_symbols, vertices, symbols.fans) ||
        !read_numbers(in, degree_symbols, triangles, symbols.degrees) ||
        !read_numbers(in, configuration_symbols, triangles, symbols.configurations) ||
        !read_numbers(in, operation_symbols, 2 * triangles, symbols.operations) ||
        !read_numbers(in, index_symbols, 2 * triangles, symbols.indices))
        return damaged();
    auto connectivity =
        triangles_of(symbols, static_cast<std::uint32_t>(vertices), static_cast<std::uint32_t>(triangles));
    if (!connectivity) return tl::unexpected(connectivity.error());

    Mesh mesh;
    mesh.triangles = std::move(*connectivity);
    const Predictor predictor(vertices, mesh.triangles);
    std::vector<std::uint32_t> residuals;
    if (!read_numbers(in, residual_symbols, 3 * vertices, residuals) || residuals.size() != 3 * vertices)
        return damaged();
    for (const Values& q : values_of(residuals, [&](std::uint32_t v) { return predictor.parallelogram(v); })) {
        auto& p = mesh.positions.emplace_back();
        for (std::size_t i = 0; i < 3; ++i) p[i] = static_cast<float>(grid.low[i] + q[i] * grid.cell());
    }
    if (colour_step == 0) return mesh;
    residuals.clear();
    if (!read_numbers(in, residual_symbols, 3 * vertices, residuals) || residuals.size() != 3 * vertices)
        return damaged();
    for (const Values& q : values_of(residuals, [&](std::uint32_t v) { return predictor.neighbour(v); })) {
        auto& c = mesh.colours.emplace_back();
        for (std::size_t i = 0; i < 3; ++i)
            c[i] = static_cast<std::uint8_t>(std::clamp<std::int64_t>(std::int64_t{q[i]} * colour_step, 0, 255));
    }
    return mesh;
}

CoderUnderTest mpeg_tfan_under_test(const std::string& name) {
    CoderUnderTest out;
    out.name = name;
    out.description =
        "TFAN as published and in MPEG-4: streams without contexts, one parallelogram; every frame by itself";
    out.settings = "one parallelogram";
    const auto bits = [](const SequenceFacts& facts, const QualityPoint& quality) {
        return draco_position_bits(facts.frame_side, quality.geometry_step);
    };
    out.start = [bits](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        MpegTfanSettings settings;
        settings.position_bits = bits(facts, quality);
        settings.colour_step = std::max(1, static_cast<int>(std::lround(quality.colour_step)));
        return FrameCoder([settings](const SourceFrame& frame) -> Result<CodedFrame> {
            CodedFrame coded;
            const Stopwatch encoding(1);
            const auto packed = encode_mpeg_tfan(frame.mesh, settings);
            coded.encode_ms = encoding.milliseconds();
            if (!packed) return tl::unexpected(packed.error());
            coded.bytes = packed->layers;
            const Stopwatch decoding(1);
            auto mesh = decode_mpeg_tfan(packed->bytes);
            coded.decode_ms = decoding.milliseconds();
            if (!mesh) return tl::unexpected(mesh.error());
            coded.decoded = std::move(*mesh);
            return coded;
        });
    };
    out.describe_quality = [bits](const SequenceFacts& facts, const QualityPoint& quality) {
        const int n = bits(facts, quality);
        return fmt::format("{} bits ({:.2f} mm)", n, facts.frame_side / (std::exp2(n) - 1));
    };
    return out;
}

}  // namespace htvm::lab
