#include "io/mesh_check.h"

#include <cmath>
#include <limits>
#include <string>

namespace htvm {

namespace {

Result<void> check_attribute(std::size_t size, std::size_t vertices, std::string_view name) {
    if (size == 0 || size == vertices) return {};
    return fail(ErrorKind::bad_input, "the mesh has " + std::to_string(vertices) + " vertices but " +
                                          std::to_string(size) + " " + std::string(name) +
                                          "; give one per vertex, or none");
}

}  // namespace

Result<void> check_mesh(const Mesh& mesh) {
    const std::size_t vertices = mesh.positions.size();
    if (auto ok = check_attribute(mesh.colours.size(), vertices, "colours"); !ok) return ok;
    if (auto ok = check_attribute(mesh.normals.size(), vertices, "normals"); !ok) return ok;
    if (auto ok = check_attribute(mesh.texcoords.size(), vertices, "texture coordinates"); !ok) return ok;
    for (std::size_t v = 0; v < vertices; ++v) {
        for (const float c : mesh.positions[v]) {
            if (!std::isfinite(c)) {
                return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(v) + " is not finite");
            }
        }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t index : mesh.triangles[t]) {
            if (index >= vertices) {
                return fail(ErrorKind::bad_input, "triangle " + std::to_string(t) + " uses vertex " +
                                                      std::to_string(index) + ", but the mesh has " +
                                                      std::to_string(vertices) + " vertices");
            }
        }
    }
    return {};
}

Result<void> check_count(std::uint64_t count, std::uint64_t most, std::string_view what) {
    if (count <= most) return {};
    return fail(ErrorKind::limit, "the mesh has " + std::to_string(count) + " " + std::string(what) +
                                      ", more than the limit of " + std::to_string(most));
}

bool fits_float(double value) { return std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()); }

float finite_or_zero(double value) { return fits_float(value) ? static_cast<float>(value) : 0.0f; }

}  // namespace htvm
