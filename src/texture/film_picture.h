// Where a capture's texture is one camera's film: what of it goes into a stream. Of the film only a window around the
// subject is sent, and in that what lies behind the subject, which no mesh shows, is filled smoothly from its edge, so
// that it takes no bits and does not bleed into it.
#pragma once

#include <optional>
#include <vector>

#include "core/image.h"
#include "htvm/mesh.hpp"

namespace htvm {

// Whether the mesh's texture coordinates are one camera's projection, to a pixel of its image, which it must have. An
// atlas is none.
bool is_film(const TexturedMesh& captured);

// A part of a film, in its pixels from the left and from the top. It may reach beyond the film.
struct FilmWindow {
    int left = 0, top = 0, width = 1, height = 1;
    bool operator==(const FilmWindow&) const = default;
};

// The window for a sequence that begins with this mesh: around what it shows, with room to move; the whole film where
// that is not much more.
FilmWindow first_window(const TexturedMesh& captured);

// Texture coordinates in the window, of those in the film. Those at the film's border, where writers cut them off, lie
// outside of the window, since they say nothing.
std::vector<Vector2f> texcoords_in_window(const TexturedMesh& captured, const FilmWindow& window);

// Follows the subject through the film. The window stays as long as the subject is within it, since what moves with it
// has to be predicted anew; and as large, unless the subject is larger.
class FilmFraming {
public:
    explicit FilmFraming(const FilmWindow& first) : first_(first), window_(first) {}
    FilmWindow next(const TexturedMesh& captured);

private:
    FilmWindow first_, window_;
};

// What the window shows, drawn at this size. What the mesh does not cover is filled from around, but for holes in it,
// where a decoded mesh may well have none.
Image film_picture(const TexturedMesh& captured, const FilmWindow& window, int width, int height);

}  // namespace htvm
