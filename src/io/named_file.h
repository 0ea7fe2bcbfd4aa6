// Files that another file names, such as the image of a mesh's material.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace htvm {

// Where a path leads that a file may name if it is inside of the folder, links and ".." followed: to no file; to one
// elsewhere, which is not to be read; or to one in the folder or below it.
enum class NamedPlace { nowhere, outside, inside };
NamedPlace named_place(const std::filesystem::path& folder, const std::filesystem::path& path);

// Looks for them in a folder and those in it, nowhere else. What is tried, until a file is there: the name as it is;
// without quotes; with percent codes decoded; without a comment behind it; of each, where it leads elsewhere, as where
// a program wrote its own folders into it, ever shorter ends of it; and then all that again in either case, as Windows
// takes names.
class NamedFiles {
public:
    std::optional<std::filesystem::path> find(const std::filesystem::path& folder, const std::string& name);

private:
    std::optional<std::filesystem::path> find_in_either_case(const std::filesystem::path& folder,
                                                             const std::string& name);
    using Listing = std::map<std::string, std::string>;  // names in lower case, and as they are
    const Listing& names_in(const std::filesystem::path& folder);
    std::map<std::filesystem::path, Listing> listings_;  // read once
};

}  // namespace htvm
