// Folders that commands make for their results, and for what they need only while they run.
#pragma once

#include <filesystem>

#include "htvm/result.hpp"

namespace htvm::lab {

// Removed with all that is in it, however the command ends.
struct WorkFolder {
    std::filesystem::path where;
    explicit WorkFolder(std::filesystem::path folder) : where(std::move(folder)) {}
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    ~WorkFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(where, ignored);
    }
};

inline Result<void> make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return fail(ErrorKind::bad_input, folder.string() + " cannot be made: " + error.message());
    return {};
}

}  // namespace htvm::lab
