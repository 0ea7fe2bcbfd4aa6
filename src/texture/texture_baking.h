// From textured captured meshes, each with an image and a layout of its own, to pictures in the layout of the stream's
// charts (EncoderOptions::texture): what a video of the texture is made of. A stream's layout lasts, so these hardly
// change from frame to frame, whatever the capture's does.
//
// Each captured vertex is matched with a point of the decoded surface (surface_matches.h), which has a place in the
// picture. The captured triangles are then drawn between these places, with the captured image on them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "texture/surface_matches.h"

namespace htvm {

struct TextureBakingOptions {
    int width = 1024, height = 1024;  // of the pictures, as the sequence header says
    double reach = 30;                // mm on an adult, in proportion to size on other subjects: captured vertices
                                      // farther from the decoded surface are left out
    bool exposure = true;             // whether the picture keeps the exposure of the one before: see BakedTexture
    internal::Threads threads = {};
};

struct BakedTexture {
    // Charts have gutters of some texels around them; what lies between them is as it was in the picture before.
    Image picture;
    // The captured image's exposure in red, green and blue, divided by the picture's. Where cameras flicker, the
    // picture does not; who shows it multiplies by these.
    std::array<double, 3> gains = {1, 1, 1};
    double seen = 0;  // the share of the charts' texels that the captured surface reached; the others are as they were,
                      // or filled from around if there was nothing
};

// Makes the pictures of a sequence, one after another: each begins with the one before.
class TextureBaker {
public:
    explicit TextureBaker(const TextureBakingOptions& options);

    // captured: with texture coordinates and an image. shown: Encoder::reconstruction() of that frame; repeated:
    // Encoder::repeated_vertices(). Errors: bad_input if one has no texture coordinates, or numbers do not fit.
    Result<BakedTexture> bake(const TexturedMesh& captured, const Mesh& shown, std::span<const std::uint32_t> repeated);

private:
    using Texel = std::uint32_t;  // its place in the picture, row by row from the top
    // What follows from the shown mesh's triangles and texture coordinates, until these change.
    struct Layout {
        std::vector<Triangle> triangles;  // as shown
        std::vector<Vector2f> texcoords;
        std::vector<Triangle> welded;                      // the same without repeated vertices
        std::vector<std::array<std::uint32_t, 3>> beside;  // the triangles across each one's edges
        std::vector<std::uint32_t> chart_of_triangle;      // from 1
        std::vector<std::uint32_t> chart_of_texel;         // of those within a chart or its gutter; else 0
        std::vector<Texel> inside;                         // the texels within charts
        std::vector<std::array<Texel, 2>> gutter;          // a texel, and the one nearest to it that is inside
        std::vector<bool> is_mirrored;                     // of each triangle: whether it lies face down in the picture
        double texels_per_millimetre = 1;
        double adult_millimetre = 1;  // what corresponds on this subject to a mm on an adult
    };
    using Corners = std::array<std::array<double, 2>, 3>;  // of a triangle, in texels

    bool is_new(const Mesh& shown) const;
    void lay_out(const Mesh& shown, std::span<const std::uint32_t> repeated);
    std::vector<std::uint8_t> place_charts(const Mesh& shown, Layout& next) const;
    void add_gutters(Layout& next) const;
    std::optional<Corners> corners_in_picture(const Mesh& captured, const Mesh& shown, const Triangle& t,
                                              const std::array<const SurfaceMatch*, 3>& match, std::size_t k) const;
    void draw(const TexturedMesh& captured, const Mesh& shown, std::span<const SurfaceMatch> matches);
    std::array<double, 3> exposure() const;
    void fill_holes();

    TextureBakingOptions options_;
    Layout layout_;
    Image picture_;                       // the last one
    std::vector<std::uint8_t> is_known_;  // of each texel of the last one: whether it has a colour that means something
    Image drawn_;                         // this frame's, before exposure is taken out
    std::vector<float> doubts_;           // of each texel drawn: SurfaceMatch::doubt of what it shows
};

// The side of square pictures in which charts have about as many texels a millimetre as the captured image: a multiple
// of 64, or the image's longer side if that is more, as where it shows a face larger than the rest; 256 to 4096. The
// mesh must have texture coordinates and its image.
int picture_side_for(const TexturedMesh& captured);

}  // namespace htvm
