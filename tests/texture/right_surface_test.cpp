// Baking where surfaces lie close: each texel shows the captured surface that its own triangle is of.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "core/geometry.h"
#include "texture/texture_baking.h"

namespace htvm {
namespace {

using namespace internal;

using Point = std::array<double, 3>;

// A part of the scene: the surface of a cube, or some of its faces, each a grid, bent into a shape.
struct Body {
    std::function<Point(const Point&)> captured, decoded;  // from the cube's surface, -1..1, to mm
    int captured_cells, decoded_cells;                     // along a side of a face
    std::array<int, 6> colour_of_face;                     // of the captured one; -1: the face is missing
};

constexpr std::array<std::array<int, 3>, 4> colours = {{{210, 60, 60}, {60, 60, 210}, {60, 200, 60}, {200, 200, 60}}};
constexpr int picture_side = 512, cell_side = 64, cells_in_a_row = 7;

// A point of a face: 0, 1: x = 1, -1; then y, then z. Counter-clockwise seen from outside in u and v.
Point on_cube(int face, double u, double v) {
    const double side = face % 2 == 0 ? 1 : -1;
    const auto axis = static_cast<std::size_t>(face / 2);
    Point out{};
    out[axis] = side;
    out[(axis + 1) % 3] = side > 0 ? 2 * u - 1 : 1 - 2 * u;
    out[(axis + 2) % 3] = 2 * v - 1;
    return out;
}

Point rounded(const Point& p) {
    return {std::round(1e4 * p[0]) / 1e4, std::round(1e4 * p[1]) / 1e4, std::round(1e4 * p[2]) / 1e4};
}

// Each colour is a column of the image.
std::shared_ptr<Image> columns() {
    auto out = std::make_shared<Image>();
    out->width = out->height = 64;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            for (const int level : colours[static_cast<std::size_t>(x / 16)])
                out->rgb.push_back(static_cast<std::uint8_t>(level));
    return out;
}

void add_grid(Mesh& mesh, std::uint32_t first, int cells) {
    const auto row = static_cast<std::uint32_t>(cells + 1);
    for (std::uint32_t j = 0; j + 1 < row; ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t a = first + j * row + i, b = a + row;
            mesh.triangles.push_back({a, a + 1, b + 1});
            mesh.triangles.push_back({a, b + 1, b});
        }
}

// With smooth normals across the edges of faces, whose vertices are repeated as a studio's are.
TexturedMesh captured_scene(std::span<const Body> bodies, double scale) {
    Mesh mesh;
    for (const auto& body : bodies)
        for (int face = 0; face < 6; ++face) {
            const int colour = body.colour_of_face[static_cast<std::size_t>(face)];
            if (colour < 0) continue;
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (int j = 0; j <= body.captured_cells; ++j)
                for (int i = 0; i <= body.captured_cells; ++i) {
                    const auto p = body.captured(
                        rounded(on_cube(face, 1.0 * i / body.captured_cells, 1.0 * j / body.captured_cells)));
                    mesh.positions.push_back({static_cast<float>(scale * p[0]), static_cast<float>(scale * p[1]),
                                              static_cast<float>(scale * p[2])});
                    mesh.texcoords.push_back({(static_cast<float>(colour) + 0.5F) / 4, 0.5F});
                }
            add_grid(mesh, first, body.captured_cells);
        }
    std::map<Vector3f, Vector3f> sums;
    for (const auto& t : mesh.triangles) {
        const auto n = area_vector(std::span<const Vector3f>(mesh.positions), t);
        for (const auto v : t)
            for (std::size_t axis = 0; axis < 3; ++axis) sums[mesh.positions[v]][axis] += static_cast<float>(n[axis]);
    }
    for (const auto& p : mesh.positions) mesh.normals.push_back(to_floats(normalised(to_vector(sums[p]))));
    return {mesh, columns()};
}

struct Decoded {
    Mesh mesh;
    std::vector<std::uint32_t> repeated;
    std::vector<std::array<int, 2>> charts;  // of each face that is there: its colour, and how many texels high it is
};

// Each face is a chart in a cell of the picture, as wide and high as it is long, a texel a few millimetres.
Decoded decoded_scene(std::span<const Body> bodies, double scale, double texels_per_millimetre) {
    Decoded out;
    std::vector<Mesh> faces;
    std::map<Point, std::uint32_t> own;
    for (const auto& body : bodies)
        for (int face = 0; face < 6; ++face) {
            if (body.colour_of_face[static_cast<std::size_t>(face)] < 0) continue;
            Mesh grid;
            const int n = body.decoded_cells;
            for (int j = 0; j <= n; ++j)
                for (int i = 0; i <= n; ++i) {
                    const auto p = body.decoded(rounded(on_cube(face, 1.0 * i / n, 1.0 * j / n)));
                    grid.positions.push_back({static_cast<float>(scale * p[0]), static_cast<float>(scale * p[1]),
                                              static_cast<float>(scale * p[2])});
                }
            add_grid(grid, 0, n);
            const auto length_of = [&](std::size_t a, std::size_t b) {
                return length(to_vector(grid.positions[a]) - to_vector(grid.positions[b])) / scale;
            };
            const auto middle = static_cast<std::size_t>(n / 2 * (n + 1));
            double wide = 0, high = 0;
            for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
                wide += length_of(middle + i, middle + i + 1);
                high += length_of(i * static_cast<std::size_t>(n + 1) + static_cast<std::size_t>(n / 2),
                                  (i + 1) * static_cast<std::size_t>(n + 1) + static_cast<std::size_t>(n / 2));
            }
            const int number = static_cast<int>(faces.size());
            const double left = 8 + 70 * (number % cells_in_a_row), bottom = 8 + 70 * (number / cells_in_a_row);
            const double w = std::min(wide * texels_per_millimetre, 1.0 * cell_side);
            const double h = std::min(high * texels_per_millimetre, 1.0 * cell_side);
            for (int j = 0; j <= n; ++j)
                for (int i = 0; i <= n; ++i)
                    grid.texcoords.push_back({static_cast<float>((left + w * i / n) / picture_side),
                                              static_cast<float>((bottom + h * j / n) / picture_side)});
            faces.push_back(grid);
            out.charts.push_back(
                {body.colour_of_face[static_cast<std::size_t>(face)], static_cast<int>(std::min(w, h))});
        }
    // Vertices in several faces are repeated behind all others.
    std::vector<std::vector<std::uint32_t>> index(faces.size());
    std::map<Vector3f, std::uint32_t> at;
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (std::size_t v = 0; v < faces[f].positions.size(); ++v) {
            const auto [found, is_new] =
                at.emplace(faces[f].positions[v], static_cast<std::uint32_t>(out.mesh.positions.size()));
            index[f].push_back(is_new ? found->second : SurfaceMatch::nothing);
            if (!is_new) continue;
            out.mesh.positions.push_back(faces[f].positions[v]);
            out.mesh.texcoords.push_back(faces[f].texcoords[v]);
        }
    for (std::size_t f = 0; f < faces.size(); ++f) {
        for (std::size_t v = 0; v < faces[f].positions.size(); ++v) {
            if (index[f][v] != SurfaceMatch::nothing) continue;
            index[f][v] = static_cast<std::uint32_t>(out.mesh.positions.size());
            out.repeated.push_back(at[faces[f].positions[v]]);
            out.mesh.positions.push_back(faces[f].positions[v]);
            out.mesh.texcoords.push_back(faces[f].texcoords[v]);
        }
        for (const auto& t : faces[f].triangles)
            out.mesh.triangles.push_back({index[f][t[0]], index[f][t[1]], index[f][t[2]]});
    }
    return out;
}

// The share of the texels of faces that show another colour than their own. Faces of less than 6 texels, as the rims of
// a shell, do not count.
double wrong_share(std::span<const Body> bodies, double scale, double texels_per_millimetre) {
    const auto decoded = decoded_scene(bodies, scale, texels_per_millimetre);
    TextureBaker baker({.width = picture_side, .height = picture_side});
    const auto baked = baker.bake(captured_scene(bodies, scale), decoded.mesh, decoded.repeated);
    EXPECT_TRUE(baked) << baked.error().message;
    if (!baked) return 1;
    std::size_t all = 0, wrong = 0;
    for (std::size_t chart = 0; chart < decoded.charts.size(); ++chart) {
        const auto [colour, side] = decoded.charts[chart];
        if (side < 6) continue;
        const int left = 8 + 70 * static_cast<int>(chart % cells_in_a_row);
        const int bottom = 8 + 70 * static_cast<int>(chart / cells_in_a_row);
        for (int y = bottom; y < bottom + side; ++y)
            for (int x = left; x < left + side; ++x) {
                const auto* p =
                    &baked->picture.rgb[3 * static_cast<std::size_t>((picture_side - 1 - y) * picture_side + x)];
                int off = 0;
                for (std::size_t c = 0; c < 3; ++c)
                    off = std::max(off, std::abs(p[c] - colours[static_cast<std::size_t>(colour)][c]));
                ++all;
                wrong += off > 40 ? 1 : 0;
            }
    }
    EXPECT_GT(all, 4000u);
    return static_cast<double>(wrong) / static_cast<double>(all);
}

constexpr double allowed = 0.001;

// What a decoded surface is off: waves of some centimetres.
Point waved(Point p, double height) {
    const Point q = p;
    for (std::size_t axis = 0; axis < 3; ++axis)
        p[axis] +=
            height * std::sin(0.071 * q[(axis + 1) % 3] + 0.093 * q[(axis + 2) % 3] + 1.3 * static_cast<double>(axis));
    return p;
}

Point on_ellipsoid(const Point& p, const Point& middle, const Point& half) {
    const double size = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    return {middle[0] + half[0] * p[0] / size, middle[1] + half[1] * p[1] / size, middle[2] + half[2] * p[2] / size};
}

// A marble at the other end of a person: what scenes are part of is as tall as an adult.
Body marble() {
    const auto shape = [](const Point& p) { return on_ellipsoid(p, {0, 1600, 0}, {12, 12, 12}); };
    return {shape, shape, 8, 6, {2, 2, 2, 2, 2, 2}};
}

// A curved shell of 1 mm, red outside, blue inside; what is decoded is off by up to several times as much.
std::vector<Body> thin_shell() {
    const auto shape = [](const Point& p) -> Point {
        const double angle = 0.9 * p[0], radius = 110 + 0.5 * p[2];
        return {radius * std::sin(angle), 100 * p[1], radius * std::cos(angle)};
    };
    return {{shape, [=](const Point& p) { return waved(shape(p), 4); }, 40, 16, {0, 0, 0, 0, 0, 1}}, marble()};
}

// Four fingers of 16 mm lie beside each other on a ball, half a millimetre above it; what is decoded is up to 8 mm off.
std::vector<Body> fingers_on_a_ball() {
    std::vector<Body> out = {marble()};
    const auto add = [&](const Point& middle, const Point& half, int captured, int decoded, int colour) {
        const auto shape = [=](const Point& p) { return on_ellipsoid(p, middle, half); };
        out.push_back({shape,
                       [=](const Point& p) { return waved(shape(p), 5); },
                       captured,
                       decoded,
                       {colour, colour, colour, colour, colour, colour}});
    };
    add({0, 0, 0}, {100, 100, 100}, 40, 10, 0);
    for (int finger = 0; finger < 4; ++finger) {
        const double angle = 0.16 * (finger - 1.5);
        add({108.5 * std::sin(angle), 0, 108.5 * std::cos(angle)}, {8, 30, 8}, 14, 5, 1);
    }
    return out;
}

// A cloth on another, both seen from the same side; what is decoded of the upper one sags to where it is nearer to the
// lower one as captured than what is decoded of that.
std::vector<Body> cloth_on_cloth() {
    const auto sheet = [](double z) { return [=](const Point& p) -> Point { return {100 * p[0], 100 * p[1], z}; }; };
    const auto sag = [](double z, double depth) {
        return [=](const Point& p) -> Point {
            const double squared = p[0] * p[0] + p[1] * p[1];
            const double sunk = depth * std::exp(-squared / (2 * 0.12 * 0.12));
            return waved({100 * p[0], 100 * p[1], z - sunk}, 0.7);
        };
    };
    return {{sheet(0), sag(0, 2.75), 40, 20, {-1, -1, -1, -1, 0, -1}},
            {sheet(4), sag(4, 3), 40, 20, {-1, -1, -1, -1, 1, -1}},
            marble()};
}

TEST(RightSurface, BothSidesOfAThinShellKeepTheirColours) { EXPECT_LE(wrong_share(thin_shell(), 1, 0.25), allowed); }

TEST(RightSurface, FingersAndTheBallBelowKeepTheirColours) {
    EXPECT_LE(wrong_share(fingers_on_a_ball(), 1, 0.4), allowed);
}

TEST(RightSurface, ClothKeepsItsColoursWhereItTouchesCloth) {
    EXPECT_LE(wrong_share(cloth_on_cloth(), 1, 0.3), allowed);
}

TEST(RightSurface, ACaptureTenTimesAsLargeOrSmallIsAsGood) {
    for (const double scale : {10.0, 0.1}) {
        EXPECT_LE(wrong_share(thin_shell(), scale, 0.25), allowed);
        EXPECT_LE(wrong_share(fingers_on_a_ball(), scale, 0.4), allowed);
        EXPECT_LE(wrong_share(cloth_on_cloth(), scale, 0.3), allowed);
    }
}

}  // namespace
}  // namespace htvm
