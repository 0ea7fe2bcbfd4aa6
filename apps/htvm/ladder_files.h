// The files that are the rungs of a ladder, as `htvm encode --ladder` writes them.
#pragma once

#include <string>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::app {

// The coarsest first: the files that are named, in their order; or those of a list of playlists, by their rates; or, of
// a folder, those of the list of playlists in it, or else its .htvm and .mp4 files, by their sizes. bad_input if there
// are fewer than two, more than a hub takes, or one twice.
Result<std::vector<std::string>> files_of_ladder(const std::vector<std::string>& named);

}  // namespace htvm::app
