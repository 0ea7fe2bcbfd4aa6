#include "used_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <vector>

#include "command_line/terminal.h"
#include "core/letter_case.h"
#include "io/image_file.h"
#include "io/mesh_file.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

bool is_image_name(const fs::path& name) {
    const auto ending = internal::lower_case(name.extension().string());
    return std::find(std::begin(image_extensions), std::end(image_extensions), ending) != std::end(image_extensions);
}

// Whether the name has digits in the pattern's place of the number.
bool is_of_pattern(const OutputNames& names, const std::string& name) {
    const auto around = names.prefix.size() + names.suffix.size();
    if (name.size() <= around || !name.starts_with(names.prefix) || !name.ends_with(names.suffix)) return false;
    const auto number = name.substr(names.prefix.size(), name.size() - around);
    return number.find_first_not_of("0123456789") == std::string::npos;
}

struct ByNumber {
    bool operator()(const std::string& a, const std::string& b) const { return natural_less(a, b); }
};
using Names = std::set<std::string, ByNumber>;

// "9 meshes (00003.ply, 00004.ply, 00005.ply and 6 others)"; empty for none.
std::string listed(const Names& names, const char* one, const char* many) {
    if (names.empty()) return {};
    constexpr std::size_t most = 3;
    std::string text;
    for (auto name = names.begin(); name != names.end() && std::distance(names.begin(), name) < std::ptrdiff_t{most};
         ++name)
        text += (text.empty() ? "" : ", ") + *name;
    if (names.size() > most) text += " and " + counted(names.size() - most, "other");
    return fmt::format("{} {} ({})", names.size(), names.size() == 1 ? one : many, text);
}

}  // namespace

void warn_of_other_frames(const OutputNames& names, bool is_pattern, const std::set<std::string>& written) {
    const auto folder = names.folder.empty() ? fs::path(".") : names.folder;
    Names meshes, stems, images;
    std::vector<fs::path> pictures;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.is_directory(error)) continue;
        const auto name = entry.path().filename();
        if (is_image_name(name) && !written.contains(name.string())) pictures.push_back(name);
        if (!is_mesh_file_name(name) || (is_pattern && !is_of_pattern(names, name.string()))) continue;
        stems.insert(name.stem().string());
        if (!written.contains(name.string())) meshes.insert(name.string());
    }
    for (const auto& picture : pictures)
        if (stems.contains(picture.stem().string())) images.insert(picture.string());
    if (meshes.empty() && images.empty()) return;
    const bool both = !meshes.empty() && !images.empty();
    warn(fmt::format(
        "{} holds {}{}{} that this run did not write: whoever reads these frames takes them for part of "
        "the same capture; remove them, or write to an empty folder",
        folder.string(), listed(meshes, "mesh", "meshes"), both ? " and " : "", listed(images, "image", "images")));
}

}  // namespace htvm::app
