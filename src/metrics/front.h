// From where a subject is seen from the front: what a stream's metadata say of it, what a surface that is seen from one
// side shows of it, and which angle of the cameras around it that is.
#pragma once

#include <optional>
#include <span>

#include "htvm/mesh.hpp"
#include "htvm/scene.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

// The axes of the cameras around a body, unit vectors: azimuth 0 looks from `front`, and 90 degrees from `right`.
struct ViewAxes {
    Point3 right, up, front;
};
// An unknown axis is y.
ViewAxes view_axes(UpAxis up);

// The direction from the subject to a camera at this azimuth (ViewOptions::first_azimuth), level.
Point3 direction_at(double azimuth, UpAxis up);
// The azimuth, degrees, -180 to 180, of the camera that is nearest to the direction; nothing if it is straight up or
// down.
std::optional<double> azimuth_of(const Point3& direction, UpAxis up);

// The metadata's key and value: the direction from the subject to whoever sees it from the front, as three numbers in
// the stream's coordinates, "0 0 -1".
MetadataEntry front_entry(const Point3& direction);
// The direction as long as 1, by the first such entry; nothing if there is none, or it is not three numbers.
std::optional<Point3> front_of(std::span<const MetadataEntry> metadata);

// The direction that a surface faces which is seen from one side only, as a depth camera sees a person, of whom nothing
// is seen from behind: as long as how much of its area faces there, 0 to 1. Nothing if it faces none, as a closed
// surface does.
std::optional<Point3> facing_of(const Mesh& mesh);

}  // namespace htvm
