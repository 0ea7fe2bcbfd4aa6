// What the height of a subject says of the unit that its files are in.
#pragma once

#include <string>

#include "htvm/mesh.hpp"
#include "htvm/scene.hpp"
#include "io/mesh_file.h"
#include "io/mesh_reading.h"

namespace htvm::app {

// From the lowest to the highest vertex that triangles name, in the mesh's unit; where up is not known, along y or z,
// whichever is longer.
double height_of(const Mesh& mesh, UpAxis up);

// "1.75 m", "69 cm", "0.2 mm".
std::string length_text(double millimetres);

// What to say of the unit in which the first mesh is so tall, in the files' unit. format: of whose files the unit is
// prescribed, "glTF"; empty: it was guessed. A warning where people are hardly so tall, with the units in which they
// would be; nothing to say where millimetres were guessed, or a format's unit fits.
MeshRemark remark_on_height(double tall, LengthUnit unit, const std::string& format);

}  // namespace htvm::app
