// Meshes and bytes that the tests of mesh files share.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm::samples {

inline std::span<const std::uint8_t> bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

inline std::string text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Attributes {
    bool colours = true;
    bool normals = true;
    bool texcoords = true;
};

// Random positions, attributes and triangles, with some isolated vertices, duplicate and degenerate triangles.
inline Mesh random_mesh(unsigned seed, std::size_t vertices, std::size_t triangles, Attributes attributes = {}) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> position(-2000, 2000);
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto byte = [&] { return static_cast<std::uint8_t>(random() & 255); };
    Mesh mesh;
    for (std::size_t v = 0; v < vertices; ++v) {
        mesh.positions.push_back({position(random), position(random), position(random)});
        if (attributes.colours) mesh.colours.push_back({byte(), byte(), byte()});
        if (attributes.normals) mesh.normals.push_back({unit(random), unit(random), unit(random)});
        if (attributes.texcoords) mesh.texcoords.push_back({unit(random), unit(random)});
    }
    const auto index = [&] { return static_cast<std::uint32_t>(random() % vertices); };
    for (std::size_t t = 0; t < triangles && vertices > 0; ++t) mesh.triangles.push_back({index(), index(), index()});
    return mesh;
}

inline void expect_equal(const Mesh& a, const Mesh& b) {
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.colours, b.colours);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.texcoords, b.texcoords);
}

}  // namespace htvm::samples
