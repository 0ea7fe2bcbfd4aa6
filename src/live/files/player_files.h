// The files of the web player that are part of the program; none in a build without it. cmake/live.cmake writes
// player_files.cpp from the folder that HTVM_PLAYER names.
#pragma once

#include <span>
#include <string_view>

namespace htvm::live {

struct PlayerFile {
    std::string_view name;
    std::string_view content;
};

std::span<const PlayerFile> player_files();
// Whether the player was built into this program.
inline bool has_player() { return !player_files().empty(); }

}  // namespace htvm::live
