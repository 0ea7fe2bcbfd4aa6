#include "core/lattice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace htvm::internal {

namespace {

constexpr double normal_scale = 127.0;
constexpr double texcoord_limit = 4096.0;
// Half the lattice, so that predictions and residuals of captured values stay on it.
constexpr std::int32_t capture_limit = lattice_limit / 2;

bool finite(const Vector3f& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

template <class Values>
Result<void> check_length(const Values& values, std::size_t vertices, const char* what) {
    if (values.empty() || values.size() == vertices) return {};
    return fail(ErrorKind::bad_input, std::string("the mesh has ") + std::to_string(vertices) + " vertices but " +
                                          std::to_string(values.size()) + " " + what);
}

Result<void> check(const Mesh& mesh) {
    if (mesh.positions.size() > 0x7FFFFFFF || mesh.triangles.size() > 0x7FFFFFFF)
        return fail(ErrorKind::limit, "the mesh has more than 2^31 - 1 vertices or triangles");
    const std::size_t n = mesh.positions.size();
    if (auto ok = check_length(mesh.colours, n, "colours"); !ok) return ok;
    if (auto ok = check_length(mesh.normals, n, "normals"); !ok) return ok;
    if (auto ok = check_length(mesh.texcoords, n, "texture coordinates"); !ok) return ok;
    std::uint32_t highest = 0;
    for (const auto& t : mesh.triangles) highest = std::max(std::max(highest, t[0]), std::max(t[1], t[2]));
    for (std::size_t k = 0; highest >= n && k < mesh.triangles.size(); ++k)
        for (const auto index : mesh.triangles[k])
            if (index >= n)
                return fail(ErrorKind::bad_input, "triangle " + std::to_string(k) + " names vertex " +
                                                      std::to_string(index) + " of " + std::to_string(n));
    return {};
}

// floor(v + 0.5), of what fits, without a call.
std::int32_t rounded(double v) {
    const double above = v + 0.5;
    const auto towards_zero = static_cast<std::int32_t>(above);
    return towards_zero - (towards_zero > above ? 1 : 0);
}

// Nothing if it is too far away, or not finite.
std::optional<LatticePoint> rounded_to(const std::array<double, 3>& point, const Lattice& lattice) {
    const double scale = static_cast<double>(1 << lattice.bits);
    const double x = (point[0] - lattice.origin[0]) * scale, y = (point[1] - lattice.origin[1]) * scale,
                 z = (point[2] - lattice.origin[2]) * scale;
    const auto is_near = [](double c) { return std::abs(c) < capture_limit; };
    if (!is_near(x) || !is_near(y) || !is_near(z)) return std::nullopt;
    return LatticePoint{rounded(x), rounded(y), rounded(z)};
}

}  // namespace

Result<std::array<std::int32_t, 3>> lattice_origin(const Mesh& mesh) {
    std::array<std::int32_t, 3> origin{};
    if (mesh.positions.empty()) return origin;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double low = mesh.positions[0][axis], high = low;
        for (const auto& p : mesh.positions) {
            low = std::min(low, static_cast<double>(p[axis]));
            high = std::max(high, static_cast<double>(p[axis]));
        }
        const double middle = (low + high) / 2;
        if (!(std::abs(middle) < 1e9))
            return fail(
                ErrorKind::bad_input,
                "the first mesh has a coordinate that is not finite, or lies more than 1000 km from the origin");
        origin[axis] = rounded(middle);
    }
    return origin;
}

Result<LatticePoint> to_lattice(const std::array<double, 3>& point, const Lattice& lattice) {
    const auto out = rounded_to(point, lattice);
    if (out) return *out;
    return fail(ErrorKind::bad_input, "a point lies more than " +
                                          std::to_string((capture_limit >> lattice.bits) / 1000) +
                                          " m from where the sequence began, or is not finite");
}

Result<LatticeMesh> to_lattice(const Mesh& mesh, const Lattice& lattice) {
    if (auto ok = check(mesh); !ok) return tl::unexpected(ok.error());
    LatticeMesh out;
    out.triangles = mesh.triangles;
    out.colours = mesh.colours;
    out.positions.resize(mesh.positions.size());
    for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
        const auto& p = mesh.positions[k];
        const std::array<double, 3> millimetres{p[0], p[1], p[2]};
        const auto point = rounded_to(millimetres, lattice);
        if (!point)
            return fail(ErrorKind::bad_input,
                        "vertex " + std::to_string(k) + ": " + to_lattice(millimetres, lattice).error().message);
        out.positions[k] = *point;
    }
    for (std::size_t k = 0; k < mesh.normals.size(); ++k) {
        const auto& n = mesh.normals[k];
        if (!finite(n) || std::abs(n[0]) > 8 || std::abs(n[1]) > 8 || std::abs(n[2]) > 8)
            return fail(ErrorKind::bad_input,
                        "vertex " + std::to_string(k) + " has a normal that is not a unit vector");
        out.normals.push_back(
            {rounded(n[0] * normal_scale), rounded(n[1] * normal_scale), rounded(n[2] * normal_scale)});
    }
    for (std::size_t k = 0; k < mesh.texcoords.size(); ++k) {
        const auto& t = mesh.texcoords[k];
        if (!(std::abs(t[0]) < texcoord_limit) || !(std::abs(t[1]) < texcoord_limit))
            return fail(ErrorKind::bad_input,
                        "vertex " + std::to_string(k) + " has a texture coordinate beyond 4096 or not finite");
        out.texcoords.push_back({rounded(t[0] * captured_texcoord_unit), rounded(t[1] * captured_texcoord_unit)});
    }
    return out;
}

std::array<double, 3> to_millimetres(LatticePoint p, const Lattice& lattice) {
    const double step = lattice.step();
    return {lattice.origin[0] + p.x * step, lattice.origin[1] + p.y * step, lattice.origin[2] + p.z * step};
}

void to_millimetres(std::span<const LatticePoint> positions, const Lattice& lattice, std::vector<Vector3f>& out) {
    out.clear();
    out.reserve(positions.size());
    for (const auto& p : positions) {
        const auto mm = to_millimetres(p, lattice);
        out.push_back({static_cast<float>(mm[0]), static_cast<float>(mm[1]), static_cast<float>(mm[2])});
    }
}

void to_unit_normals(std::span<const QuantisedNormal> normals, std::vector<Vector3f>& out) {
    out.clear();
    out.reserve(normals.size());
    for (const auto& n : normals) {
        const double x = n[0], y = n[1], z = n[2];
        const double length = std::sqrt(x * x + y * y + z * z);
        const double scale = length > 0 ? 1.0 / length : 0.0;
        out.push_back({static_cast<float>(x * scale), static_cast<float>(y * scale), static_cast<float>(z * scale)});
    }
}

void to_texcoords(std::span<const QuantisedTexcoord> texcoords, double unit, std::vector<Vector2f>& out) {
    out.clear();
    out.reserve(texcoords.size());
    for (const auto& t : texcoords) out.push_back({static_cast<float>(t[0] / unit), static_cast<float>(t[1] / unit)});
}

Mesh to_mesh(const LatticeMesh& mesh, const Lattice& lattice, double texcoord_unit) {
    Mesh out;
    to_millimetres(mesh.positions, lattice, out.positions);
    to_unit_normals(mesh.normals, out.normals);
    to_texcoords(mesh.texcoords, texcoord_unit, out.texcoords);
    out.triangles = mesh.triangles;
    out.colours = mesh.colours;
    return out;
}

}  // namespace htvm::internal
