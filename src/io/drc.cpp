#include "io/drc.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "io/draco_geometry.h"
#include "io/finite_mesh.h"

namespace htvm {

using namespace internal;

namespace {

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the Draco file cannot be read: " + why);
}

struct Names {
    const char *about, *many;
};

// An attribute of one kind, the first of several, with its numbers.
struct Rows {
    const DracoAttribute* attribute = nullptr;  // nullptr: there is none
    std::vector<double> numbers;
    // Integers that stand for shares are those.
    double number(std::uint32_t point, std::size_t column) const {
        const double value = numbers[std::size_t{point} * attribute->components + column];
        return attribute->normalised && attribute->most ? std::max(value / *attribute->most, -1.0) : value;
    }
};

// The first attribute of the kind, if its components are at least that many.
Result<Rows> rows_of(const DracoGeometry& geometry, DracoKind kind, std::size_t least, const Names& names,
                     MeshFindings* findings) {
    Rows out;
    std::size_t count = 0;
    for (const auto& attribute : geometry.attributes)
        if (attribute.kind == kind && count++ == 0) out.attribute = &attribute;
    if (count > 1)
        remark(findings, names.about,
               "of its " + std::to_string(count) + " sets of " + names.many + " the first is taken");
    if (!out.attribute) return out;
    const auto components = out.attribute->components;
    if (components < least || components > 4) {
        remark(findings, names.about,
               std::string("its ") + names.many + " have " + std::to_string(components) + " numbers each, not " +
                   std::to_string(least) + ": they are passed over",
               true);
        return Rows();
    }
    auto numbers = draco_rows(geometry, *out.attribute);
    if (!numbers) return tl::unexpected(numbers.error());
    out.numbers = std::move(*numbers);
    return out;
}

// A position that no float can hold becomes one that is not finite, as it may be that of a vertex that nothing uses.
Result<void> copy_positions(const DracoGeometry& geometry, const std::array<double, 3>& origin, Mesh& mesh,
                            MeshFindings* findings) {
    const bool any = std::ranges::any_of(geometry.attributes,
                                         [](const auto& attribute) { return attribute.kind == DracoKind::position; });
    if (!any) return geometry.points == 0 ? Result<void>() : not_readable("it holds no positions");
    const auto rows = rows_of(geometry, DracoKind::position, 2, {"positions", "positions"}, findings);
    if (!rows) return tl::unexpected(rows.error());
    if (!rows->attribute)
        return fail(ErrorKind::unsupported, "the Draco file's positions do not have three components");
    for (std::uint32_t p = 0; p < geometry.points; ++p) {
        auto& position = mesh.positions.emplace_back();
        for (std::size_t i = 0; i < 3; ++i) {
            const double c = (i < rows->attribute->components ? rows->number(p, i) : 0) - origin[i];
            position[i] = fits_float(c) ? static_cast<float>(c) : std::numeric_limits<float>::quiet_NaN();
        }
    }
    return {};
}

// Colours of one or two components are grey, with or without alpha. Of all but bytes, the type does not say the range.
Result<void> copy_colours(const DracoGeometry& geometry, const std::optional<ColourRange>& given, Mesh& mesh,
                          MeshFindings* findings) {
    const auto rows = rows_of(geometry, DracoKind::colour, 1, {"colours", "colours"}, findings);
    if (!rows) return tl::unexpected(rows.error());
    if (!rows->attribute) return {};
    const auto components = rows->attribute->components;
    const bool is_grey = components < 3;
    if (is_grey) remark(findings, "grey-colours", "its colours have one number each, and are taken for grey");
    const auto of = [&](std::uint32_t p, std::size_t i) { return rows->number(p, is_grey ? 0 : i); };
    const bool is_share = rows->attribute->normalised && rows->attribute->most;
    const bool is_byte = !is_share && rows->attribute->most && *rows->attribute->most <= 255;
    ColourRange range = is_share ? ColourRange::unit : ColourRange::bytes;
    if (!is_share && !is_byte) {
        ColourLevels levels;
        for (std::uint32_t p = 0; p < geometry.points; ++p)
            for (std::size_t i = 0; i < 3; ++i) levels.count(of(p, i));
        range = given.value_or(colour_range_of(levels));
        // Whole numbers up to 1 are dark levels.
        if (rows->attribute->most && range == ColourRange::unit) range = ColourRange::bytes;
        if (findings) findings->colour_levels += levels;
    }
    for (std::uint32_t p = 0; p < geometry.points; ++p)
        mesh.colours.push_back(
            {colour_level(of(p, 0), range), colour_level(of(p, 1), range), colour_level(of(p, 2), range)});
    return {};
}

template <std::size_t N>
Result<void> copy_floats(const DracoGeometry& geometry, DracoKind kind, const Names& names,
                         std::vector<std::array<float, N>>& out, MeshFindings* findings) {
    const auto rows = rows_of(geometry, kind, N, names, findings);
    if (!rows) return tl::unexpected(rows.error());
    if (!rows->attribute) return {};
    // Integers of either can only be shares.
    const double scale = rows->attribute->most && !rows->attribute->normalised ? 1 / *rows->attribute->most : 1;
    for (std::uint32_t p = 0; p < geometry.points; ++p) {
        auto& row = out.emplace_back();
        for (std::size_t i = 0; i < N; ++i) row[i] = finite_or_zero(rows->number(p, i) * scale);
    }
    return {};
}

}  // namespace

Result<Mesh> read_drc(std::span<const std::uint8_t> bytes, const MeshReadOptions& options, MeshFindings* findings) {
    auto geometry = read_draco_geometry(bytes, options.limits);
    if (!geometry) return tl::unexpected(geometry.error());
    Mesh mesh;
    auto taken = copy_positions(*geometry, options.origin, mesh, findings);
    if (taken) taken = copy_colours(*geometry, options.colour_range, mesh, findings);
    if (taken) taken = copy_floats(*geometry, DracoKind::normal, {"normals", "normals"}, mesh.normals, findings);
    if (taken)
        taken = copy_floats(*geometry, DracoKind::texcoord, {"texture-coordinates", "texture coordinates"},
                            mesh.texcoords, findings);
    if (!taken) return tl::unexpected(taken.error());
    mesh.triangles = std::move(geometry->triangles);
    MeshFindings unheard;
    if (auto ok = leave_out_not_finite(mesh, findings ? *findings : unheard); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    return mesh;
}

}  // namespace htvm
