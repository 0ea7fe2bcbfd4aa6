// Packs a tetrahedron by the installed plug-in and gives it back.
#include <htvm/intra_coder.hpp>

int main() {
    htvm::LatticeMesh mesh;
    mesh.positions = {{0, 0, 0}, {5, 0, 0}, {0, 6, 0}, {0, 0, 7}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const auto coder = htvm::draco_intra_coder();
    const auto bytes = coder.encode(mesh);
    if (!bytes) return 1;
    const auto back = coder.decode(*bytes);
    return back && back->positions.size() == 4 && back->triangles.size() == 4 ? 0 : 1;
}
