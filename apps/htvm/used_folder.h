// Frames that an earlier run left in a folder: whoever reads it takes them for more of the same capture.
#pragma once

#include <set>
#include <string>

#include "io/sequence.h"

namespace htvm::app {

// Warns of the meshes in the folder of `names`, and the images named like a mesh there, that are not among `written`,
// which are file names without their folder; says which they are. is_pattern: only meshes with a number in its place
// are read along with these; without it, any of the folder.
void warn_of_other_frames(const OutputNames& names, bool is_pattern, const std::set<std::string>& written);

}  // namespace htvm::app
