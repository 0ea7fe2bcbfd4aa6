// Whether texture coordinates are one camera's projection of the surface, as those of a phone's depth capture are, and
// which one: a 3 x 4 matrix fitted to pairs of position and texture coordinates.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "htvm/mesh.hpp"

namespace htvm::internal {

// Positions and coordinates of the same vertices. Coordinates at or beyond the image's border say nothing, as writers
// cut them off there.
struct FilmPairs {
    std::span<const Eigen::Vector3d> positions;
    std::span<const Vector2f> texcoords;  // (0, 0) is the image's lower left corner, (1, 1) its upper right one
    double width = 1, height = 1;         // of the image, pixels
};

// The first two rows over the third are texture coordinates; the third is above 0 before the camera.
using ProjectionMatrix = Eigen::Matrix<double, 3, 4>;

// How well a projection explains pairs.
struct ProjectionErrors {
    double median = 0;     // pixels
    double explained = 0;  // the share of the pairs that it puts within a pixel of where they are
};
ProjectionErrors projection_errors(const ProjectionMatrix& projection, const FilmPairs& pairs);

// Whether coordinates with these errors are taken for a projection.
inline bool is_projection(const ProjectionErrors& errors) { return errors.explained >= 0.95; }

// The projection of these pairs; nothing unless it explains them. Pairs that it does not explain, up to one in twenty,
// do not move it.
std::optional<ProjectionMatrix> fit_projection(const FilmPairs& pairs);

// The same where the projection of the frame before may go on: it is kept as long as it explains the pairs about as
// well as a new one would, so that a camera that stays takes no bits.
std::optional<ProjectionMatrix> follow_projection(const ProjectionMatrix& before, const FilmPairs& pairs);

}  // namespace htvm::internal
