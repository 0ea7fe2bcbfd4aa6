#include "codec/encoder/bones/vector_quantiser.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nanoflann.hpp>
#include <numeric>
#include <optional>

#include "core/lattice.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

constexpr double minimum_population = 3;  // a codeword takes about 20 bits of the codebook, an escape about 15

double lambda_in_units(const QuantiserOptions& o) { return o.lambda * o.step * o.step; }

std::int32_t multiple(std::int32_t v, std::int32_t step) {
    return static_cast<std::int32_t>(divide_rounded(v, step)) * step;
}

double squared_error(const ResidualVector& a, const ResidualVector& b) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const double d = static_cast<double>(a[c]) - b[c];
        sum += d * d;
    }
    return sum;
}

// Approximate bits of the escape's three components, as coded by an exponential Golomb code.
double escape_bits(const ResidualVector& value, std::int32_t step) {
    double bits = 0;
    for (const auto c : value) {
        const auto n = static_cast<std::uint32_t>(std::abs(c / step));
        bits += n == 0 ? 1.0 : 2.0 * static_cast<double>(std::bit_width(n)) + 0.5;
    }
    return bits;
}

// |e - c|^2 + lambda * length is a squared distance in four dimensions, from (e, 0) to (c, sqrt(lambda * length)), so
// the best codeword is an ordinary nearest neighbour.
class CodewordSearch {
public:
    CodewordSearch(const Codebook& codebook, double lambda) {
        for (std::size_t i = 0; i < codebook.codewords.size(); ++i) {
            const auto& c = codebook.codewords[i];
            points_.push_back({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                               static_cast<float>(std::sqrt(lambda * codebook.lengths[i] / 8.0))});
        }
        if (!points_.empty()) tree_.emplace(4, *this, nanoflann::KDTreeSingleIndexAdaptorParams(8));
    }
    // Index of the best codeword, and its squared error + lambda * bits; infinity for an empty codebook.
    std::pair<std::size_t, double> best(const ResidualVector& e) const {
        if (points_.empty()) return {0, INFINITY};
        const std::array<float, 4> query = {static_cast<float>(e[0]), static_cast<float>(e[1]),
                                            static_cast<float>(e[2]), 0.0f};
        std::size_t index = 0;
        float distance = 0;
        static_cast<void>(tree_->knnSearch(query.data(), 1, &index, &distance));  // one, always
        return {index, distance};
    }

    std::size_t kdtree_get_point_count() const { return points_.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t d) const { return points_[i][d]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }

private:
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, CodewordSearch>,
                                                     CodewordSearch, 4, std::size_t>;
    std::vector<std::array<float, 4>> points_;
    std::optional<Tree> tree_;
};

// Where each residual was last met. Residuals of colours are small whole numbers, most of which come often.
class RecentResiduals {
public:
    RecentResiduals() : last_(std::size_t{1} << bits, none) {}
    // An earlier residual that equals residual k, or k itself; from now on k is the last one.
    std::size_t exchange(std::span<const ResidualVector> residuals, std::size_t k) {
        const auto& e = residuals[k];
        std::uint32_t mixed = 0;
        for (const auto c : e) mixed = (mixed ^ static_cast<std::uint32_t>(c)) * 0x9E3779B1u;
        auto& last = last_[mixed >> (32 - bits)];
        if (last != none && residuals[last] == e) return last;
        last = static_cast<std::uint32_t>(k);
        return k;
    }

private:
    static constexpr int bits = 12;
    static constexpr std::uint32_t none = 0xFFFFFFFFu;
    std::vector<std::uint32_t> last_;
};

struct Cell {
    std::array<double, 3> sum{};
    double population = 0;
};

// The starting cells: those cells of the cubic lattice that hold enough residuals, fullest first.
std::vector<Cell> lattice_cells(std::span<const ResidualVector> residuals, std::int32_t step) {
    constexpr std::int32_t reach = 1 << 20;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    for (std::uint32_t k = 0; k < residuals.size(); ++k) {
        std::uint64_t key = 0;
        bool inside = true;
        for (const auto c : residuals[k]) {
            const auto q = static_cast<std::int32_t>(divide_rounded(c, step)) + reach / 2;
            inside = inside && q >= 0 && q < reach;
            key = key << 20 | static_cast<std::uint32_t>(q & (reach - 1));
        }
        if (inside) keys.emplace_back(key, k);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<Cell> cells;
    for (std::size_t i = 0; i < keys.size();) {
        Cell cell;
        const auto key = keys[i].first;
        for (; i < keys.size() && keys[i].first == key; ++i) {
            cell.population += 1;
            for (std::size_t c = 0; c < 3; ++c) cell.sum[c] += residuals[keys[i].second][c];
        }
        if (cell.population >= minimum_population) cells.push_back(cell);
    }
    std::stable_sort(cells.begin(), cells.end(),
                     [](const Cell& a, const Cell& b) { return a.population > b.population; });
    if (cells.size() > max_codewords) cells.resize(max_codewords);
    return cells;
}

std::uint16_t code_length(double population, double total) {
    const double bits = -std::log2(std::max(population, 0.5) / std::max(total, 1.0));
    return static_cast<std::uint16_t>(std::clamp(std::lround(bits * 8), 0L, static_cast<long>(max_length)));
}

// Centroids, rounded to a grid that is fine enough not to add distortion, sorted by code length.
Codebook codebook_of(const std::vector<Cell>& cells, double escapes, std::int32_t step) {
    double total = escapes;
    for (const auto& cell : cells) total += cell.population;
    const double grid = std::max(1, step / 8);
    std::vector<std::pair<std::uint16_t, ResidualVector>> entries;
    for (const auto& cell : cells) {
        ResidualVector codeword{};
        for (std::size_t c = 0; c < 3; ++c)
            codeword[c] =
                static_cast<std::int32_t>(std::lround(cell.sum[c] / cell.population / grid) * static_cast<long>(grid));
        entries.emplace_back(code_length(cell.population, total), codeword);
    }
    std::sort(entries.begin(), entries.end());
    Codebook out;
    out.escape_step = step;
    for (const auto& [length, codeword] : entries) {
        out.codewords.push_back(codeword);
        out.lengths.push_back(length);
    }
    out.lengths.push_back(code_length(escapes, total));
    return out;
}

std::vector<ResidualVector> evenly_spread(std::span<const ResidualVector> residuals, std::size_t count) {
    if (count == 0 || residuals.size() <= count) return {residuals.begin(), residuals.end()};
    std::vector<ResidualVector> out;
    out.reserve(count);
    for (std::size_t i = 0; i < count; ++i) out.push_back(residuals[i * residuals.size() / count]);
    return out;
}

}  // namespace

QuantisedResiduals quantise(std::span<const ResidualVector> residuals, const Codebook& codebook,
                            const QuantiserOptions& options) {
    const double lambda = lambda_in_units(options);
    const CodewordSearch search(codebook, lambda);
    const auto escape = static_cast<std::uint16_t>(codebook.codewords.size());
    QuantisedResiduals out;
    out.indices.resize(residuals.size());
    out.values.resize(residuals.size());
    const auto quantise_one = [&](std::size_t k) {
        const auto& e = residuals[k];
        const auto [index, cost] = search.best(e);
        out.indices[k] = static_cast<std::uint16_t>(index);
        // The escape's error is at most half the diagonal of its cell. If the codeword beats even a perfect escape,
        // the escape need not be tried.
        if (cost > lambda * (codebook.lengths[escape] / 8.0 + 3)) {
            ResidualVector value{};
            for (std::size_t c = 0; c < 3; ++c) value[c] = multiple(e[c], codebook.escape_step);
            const double escape_cost = squared_error(e, value) + lambda * (codebook.lengths[escape] / 8.0 +
                                                                           escape_bits(value, codebook.escape_step));
            if (escape_cost < cost) {
                out.indices[k] = escape;
                out.values[k] = value;
                return;
            }
        }
        out.values[k] = codebook.codewords[index];
    };
    constexpr std::size_t piece = 4096;
    parallel_for(residuals.size(), options.threads, piece, [&](std::size_t begin, std::size_t end) {
        RecentResiduals recent;
        for (std::size_t k = begin; k < end; ++k) {
            const std::size_t same = recent.exchange(residuals, k);
            if (same == k) {
                quantise_one(k);
            } else {
                out.indices[k] = out.indices[same];
                out.values[k] = out.values[same];
            }
        }
    });
    return out;
}

double lagrangian(std::span<const ResidualVector> residuals, const QuantisedResiduals& quantised,
                  const Codebook& codebook, const QuantiserOptions& options) {
    const double lambda = lambda_in_units(options);
    double cost = 0;
    for (std::size_t k = 0; k < residuals.size(); ++k) {
        double bits = codebook.lengths[quantised.indices[k]] / 8.0;
        if (quantised.indices[k] == codebook.codewords.size())
            bits += escape_bits(quantised.values[k], codebook.escape_step);
        cost += squared_error(residuals[k], quantised.values[k]) + lambda * bits;
    }
    return cost;
}

Codebook train_codebook(std::span<const ResidualVector> residuals, const QuantiserOptions& options) {
    const auto sample = evenly_spread(residuals, options.training);
    auto cells = lattice_cells(sample, options.step);
    double escapes = static_cast<double>(sample.size());
    for (const auto& cell : cells) escapes -= cell.population;
    auto codebook = codebook_of(cells, escapes, options.step);
    for (int round = 0; round < options.iterations; ++round) {
        const auto quantised = quantise(sample, codebook, options);
        cells.assign(codebook.codewords.size() + 1, {});
        for (std::size_t k = 0; k < sample.size(); ++k) {
            auto& cell = cells[quantised.indices[k]];
            cell.population += 1;
            for (std::size_t c = 0; c < 3; ++c) cell.sum[c] += sample[k][c];
        }
        escapes = cells.back().population;
        cells.pop_back();
        std::erase_if(cells, [&](const Cell& cell) {
            const bool drop = cell.population < minimum_population;
            if (drop) escapes += cell.population;
            return drop;
        });
        codebook = codebook_of(cells, escapes, options.step);
    }
    return codebook;
}

}  // namespace htvm::internal
