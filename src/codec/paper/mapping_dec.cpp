#include <array>
#include <cmath>

#include "codec/paper/mapping.h"
#include "codec/paper/mapping_models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

struct Reader {
    RangeDecoder& decoder;
    bool bit(BinaryModel& model, bool) { return decoder.bit(model); }
};

// Twice the triangle's area; differences have 26 bits, so the products and the root are IEEE doubles' plain ones.
double double_area(LatticePoint a, LatticePoint b, LatticePoint c) {
    const LatticePoint u = b - a, v = c - a;
    const double ux = u.x, uy = u.y, uz = u.z, vx = v.x, vy = v.y, vz = v.z;
    const double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    return std::sqrt(x * x + y * y + z * z);
}

std::vector<std::uint8_t> area_classes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    constexpr std::array<double, 9> limits = {0.25, 0.45, 0.62, 0.78, 0.92, 1.08, 1.3, 1.65, 2.4};
    std::vector<double> around(positions.size(), 0);
    double sum = 0;
    for (const auto& t : triangles) {
        const double area = double_area(positions[t[0]], positions[t[1]], positions[t[2]]);
        for (const auto v : t) around[v] += area;
        sum += area * 3;
    }
    const double mean = positions.empty() ? 0 : sum / static_cast<double>(positions.size());
    std::vector<std::uint8_t> out;
    out.reserve(positions.size());
    for (const double area : around) {
        std::uint8_t area_class = 0;
        for (const double limit : limits) area_class = static_cast<std::uint8_t>(area_class + (area >= limit * mean));
        out.push_back(area_class);
    }
    return out;
}

}  // namespace

MappingPrior make_mapping_prior(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    constexpr std::uint32_t most_neighbours = 8;
    MappingPrior out;
    out.area_class = area_classes(positions, triangles);
    // Each triangle (a, b, c) gives each corner the next corner round it: an inner vertex gets every neighbour once.
    std::vector<std::uint32_t> count(positions.size(), 0);
    const auto each_lower = [&](const auto& take) {
        for (const auto& t : triangles)
            for (std::size_t i = 0; i < 3; ++i)
                if (t[(i + 1) % 3] < t[i]) take(t[i], t[(i + 1) % 3]);
    };
    each_lower([&](std::uint32_t v, std::uint32_t) { count[v] += count[v] < most_neighbours; });
    out.first_neighbour.assign(positions.size() + 1, 0);
    for (std::size_t v = 0; v < positions.size(); ++v) out.first_neighbour[v + 1] = out.first_neighbour[v] + count[v];
    out.neighbours.resize(out.first_neighbour.back());
    count.assign(positions.size(), 0);
    each_lower([&](std::uint32_t v, std::uint32_t neighbour) {
        if (count[v] < most_neighbours) out.neighbours[out.first_neighbour[v] + count[v]++] = neighbour;
    });
    return out;
}

std::vector<std::uint32_t> eligible_references(std::span<const std::uint8_t> eligible, std::size_t references) {
    std::vector<std::uint32_t> out;
    out.reserve(references);
    for (std::uint32_t k = 0; k < references; ++k)
        if (eligible.empty() || eligible[k] != 0) out.push_back(k);
    return out;
}

Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t residuals,
                                                  const MappingPrior& prior, std::span<const std::uint8_t> eligible) {
    std::vector<std::uint32_t> out(prior.area_class.size(), 0);
    const auto references = eligible_references(eligible, out.size());
    RangeDecoder decoder(bytes);
    Reader reader{decoder};
    MappingContext context(prior);
    std::size_t left = residuals;
    for (std::size_t i = 0; i + 1 < references.size() && left > 0; ++i) {
        const std::uint32_t k = references[i];
        std::uint32_t n = 0;
        context.stand_on(k, out);
        if (context.code(reader, 0, false)) {
            do {
                ++n;
                --left;
            } while (left > 0 && !context.code(reader, n, false));
        }
        out[k] = n;
        context.leave(n);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "mapping layer: it ends too early");
    }
    if (!references.empty()) out[references.back()] += static_cast<std::uint32_t>(left);
    return out;
}

}  // namespace htvm::internal
