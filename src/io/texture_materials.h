// What an OBJ's material files say of the parts of its mesh.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/mesh_reading.h"
#include "io/named_file.h"

namespace htvm {

// Gives each part that is worn the image of its material, or its colour if it has none. Images are named from the
// mesh's folder. Files and materials that are not there, and what is passed over, are remarks: a loss if is_needed, so
// if nothing else gives the mesh its colours. worn: a flag for each part (texture_parts.h).
void take_materials(MeshFindings& findings, const std::filesystem::path& folder, const std::vector<bool>& worn,
                    bool is_needed, NamedFiles& named);

}  // namespace htvm
