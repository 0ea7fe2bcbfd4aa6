// Images of 8-bit colours, and meshes that wear one: a texture, with its coordinates in Mesh::texcoords. Coordinate
// 0, 0 is the image's lower left corner and 1, 1 its upper right one, whichever way the file had it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "htvm/image.hpp"  // IWYU pragma: export
#include "htvm/mesh.hpp"

namespace htvm {

// The largest side of a texture; larger images are made smaller as they are read.
inline constexpr int largest_image_side = 4096;

struct TexturedMesh {
    TexturedMesh() = default;
    TexturedMesh(Mesh own, std::shared_ptr<const Image> image = nullptr)
        : mesh(std::move(own)), texture(std::move(image)) {}
    Mesh mesh;                             // with texture coordinates, if there is a texture
    std::shared_ptr<const Image> texture;  // null: none; frames may share it
    std::vector<Colour> tints;             // of the vertices, which multiply the texture in light; empty: none
    std::shared_ptr<const std::vector<std::uint8_t>> texture_file;  // the image's file, where it is to be kept as it is
};

// The image at another size, neither of which may be empty: each pixel is the mean of the area that it covers, so that
// making it smaller does not alias.
Image resized(const Image& image, int width, int height);

namespace internal {

// An image and smaller ones of it, each half as wide and high as the one before, so that a sample can be the mean of
// as many texels as it stands for. Sizes that are odd are rounded up, with the last row or column repeated.
class ImagePyramid {
public:
    // The image must not be empty, and must outlive the pyramid.
    explicit ImagePyramid(const Image& image);
    const Image& image() const { return *image_; }
    std::size_t levels() const { return 1 + smaller_.size(); }
    const Image& at_level(std::size_t level) const { return level == 0 ? *image_ : smaller_[level - 1]; }

    // The level whose texels are nearest in size to `texels` of the image's, counted along a side.
    std::size_t level_for(double texels) const;

    // The colour at texture coordinates u, v: between the centres of the four nearest texels, linearly. Coordinates
    // beyond 0..1 repeat the image; at its border the last texels go on, as the other side is another part of an atlas.
    std::array<float, 3> at(float u, float v, std::size_t level = 0) const;

private:
    const Image* image_;
    std::vector<Image> smaller_;
};

}  // namespace internal
}  // namespace htvm
