#include "codec/reference/film_projection.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "codec/reference/textured_surface.h"
#include "core/bytes.h"

namespace htvm::internal {
namespace {

std::int32_t within_film(double place) {
    const double inside = place > 0 ? std::min(place, 1.0) : 0;
    return static_cast<std::int32_t>(inside * chart_texcoord_unit + 0.5);
}

}  // namespace

bool is_finite(const FilmProjection& projection) {
    return std::all_of(projection.rows.begin(), projection.rows.end(), [](float c) { return std::isfinite(c); });
}

void project(const FilmProjection& projection, std::span<const LatticePoint> positions,
             std::vector<QuantisedTexcoord>& out) {
    std::array<double, 12> m{};
    for (std::size_t i = 0; i < m.size(); ++i) m[i] = static_cast<double>(projection.rows[i]);
    const auto along = [&m](std::size_t row, const LatticePoint& p) {
        return m[row] * p.x + m[row + 1] * p.y + m[row + 2] * p.z + m[row + 3];
    };
    out.resize(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const auto& p = positions[v];
        const double depth = along(8, p);
        out[v] = depth > 0 ? QuantisedTexcoord{within_film(along(0, p) / depth), within_film(along(4, p) / depth)}
                           : QuantisedTexcoord{};
    }
}

std::vector<std::uint8_t> write_projection_layer(const FilmProjection& projection) {
    ByteWriter out;
    for (const float c : projection.rows) out.u32(std::bit_cast<std::uint32_t>(c));
    return out.take();
}

Result<FilmProjection> read_projection_layer(std::span<const std::uint8_t> layer) {
    FilmProjection out;
    if (layer.size() != 4 * out.rows.size())
        return fail(ErrorKind::corrupt_stream, "projection: its layer is not of twelve numbers");
    ByteReader in(layer);
    for (auto& c : out.rows) c = std::bit_cast<float>(in.u32());
    if (!is_finite(out)) return fail(ErrorKind::corrupt_stream, "projection: a number is not finite");
    return out;
}

}  // namespace htvm::internal
