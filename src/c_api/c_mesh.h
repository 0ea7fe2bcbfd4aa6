// Meshes on their way through the C interface: a caller's becomes a htvm::Mesh, and one of the library is lent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "c_api/c_status.h"

namespace htvm::c_api {

// `count` elements of N numbers each; none if the array is NULL.
template <class Element>
std::vector<Element> elements(const typename Element::value_type* numbers, std::size_t count) {
    std::vector<Element> out;
    if (!numbers || count == 0) return out;
    out.resize(count);
    std::memcpy(out.data(), numbers, count * sizeof(Element));
    return out;
}

inline htvm_status read_mesh(LastError& error, const htvm_mesh* given, Mesh& out) {
    if (!given) return error.set(HTVM_BAD_INPUT, "the mesh is NULL");
    htvm_mesh mesh{};
    const auto read = check_struct(error, read_struct(given, mesh), "htvm_mesh");
    if (read != HTVM_OK) return read;
    if ((mesh.vertices > 0 && !mesh.positions) || (mesh.triangles > 0 && !mesh.indices))
        return error.set(HTVM_BAD_INPUT, "the mesh has vertices or triangles, but NULL in place of their array");
    out.positions = elements<Vector3f>(mesh.positions, mesh.vertices);
    out.triangles = elements<Triangle>(mesh.indices, mesh.triangles);
    out.colours = elements<Colour>(mesh.colours, mesh.vertices);
    out.normals = elements<Vector3f>(mesh.normals, mesh.vertices);
    out.texcoords = elements<Vector2f>(mesh.texcoords, mesh.vertices);
    return HTVM_OK;
}

// The numbers of an array of points or similar, which are contiguous; null for an empty array.
template <class Element>
const typename Element::value_type* numbers(std::span<const Element> elements) {
    return elements.empty() ? nullptr : elements.front().data();
}

inline htvm_mesh_view lent(const MeshView& mesh, std::uint32_t topology) {
    htvm_mesh_view out{};
    out.vertices = static_cast<std::uint32_t>(mesh.positions.size());
    out.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    out.topology = topology;
    out.positions = numbers(mesh.positions);
    out.indices = numbers(mesh.triangles);
    out.colours = numbers(mesh.colours);
    out.normals = numbers(mesh.normals);
    out.texcoords = numbers(mesh.texcoords);
    return out;
}

}  // namespace htvm::c_api
