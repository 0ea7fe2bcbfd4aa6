// Several images and colours of a mesh in one image: an atlas, with coordinates of its own.
//
// The layout follows from the sizes and the names of the parts alone, so that it stays the same from frame to frame.
// Around every image its border goes on for some pixels (a gutter), so that nothing of its neighbours shows where
// colours are taken between pixels or from smaller images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// What a part of the mesh shows.
struct AtlasPart {
    std::string name;                    // by which parts are ordered
    std::shared_ptr<const Image> image;  // null: it has the colour alone
    Colour colour{255, 255, 255};        // multiplies the image, in light
};

struct Atlas {
    // One for all parts that show the same.
    struct Tile {
        std::shared_ptr<const Image> image;
        Colour colour{};
        int across = 1, up = 1;  // how often the image is repeated
        bool operator==(const Tile&) const = default;
    };
    // In pixels of the atlas, of all repetitions together, from the upper left corner.
    struct Place {
        int x = 0, y = 0, width = 0, height = 0;
    };
    std::vector<Tile> tiles;
    std::vector<Place> places;  // of the tiles
    double scale = 1;           // of the images, 1 or less
    std::shared_ptr<const Image> image;
};

struct Atlased {
    Atlas atlas;
    bool is_folded = false;  // coordinates ran over more repetitions than an atlas holds, and show something else there
};

// Puts the parts' images into one, of which no side is longer than `largest_side`, and gives the mesh its coordinates
// in it: triangles beyond 0..1 are moved by whole numbers, and where one reaches over a border, the image is repeated.
// Vertices that triangles with different images share are split: the first keeps its place, copies follow at the end.
// part_of: of each triangle. The mesh must have texture coordinates. known: an earlier atlas, whose image is taken if
// it would become the same. Fails (limit) if there are too many parts.
Result<Atlased> put_into_atlas(Mesh& mesh, std::span<const AtlasPart> parts, std::span<const std::size_t> part_of,
                               const Atlas& known = {}, int largest_side = largest_image_side);

// The image with all of its colours multiplied by that one, in light.
Image multiplied(const Image& image, const Colour& colour);

}  // namespace htvm
