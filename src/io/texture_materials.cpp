#include "io/texture_materials.h"

#include <optional>
#include <string_view>
#include <utility>

#include "io/mesh_file.h"
#include "io/obj_material.h"

namespace htvm {

namespace {

namespace fs = std::filesystem;

std::string in_quotes(const std::string& name) {
    constexpr std::size_t longest = 200;
    return '"' + name.substr(0, longest) + '"';
}

// The files that a line of mtllib names, and the names that no file has.
struct MaterialFiles {
    std::vector<fs::path> paths;
    std::vector<std::string> missing;
};
MaterialFiles files_of_line(const std::string& line, const fs::path& folder, NamedFiles& named) {
    MaterialFiles best;
    for (const auto& names : material_file_names(line)) {
        MaterialFiles tried;
        for (const auto& name : names) {
            if (auto path = named.find(folder, name))
                tried.paths.push_back(std::move(*path));
            else
                tried.missing.push_back(name);
        }
        const bool is_first = best.paths.empty() && best.missing.empty();
        if (is_first || tried.paths.size() > best.paths.size()) best = std::move(tried);
        if (best.missing.empty()) break;
    }
    return best;
}

struct KnownMaterials {
    std::vector<ObjMaterial> materials;
    bool any_file = false;
};

// Gives the materials their images' names from the mesh's folder, where these are there from the material file's.
void name_from(const fs::path& folder, const fs::path& file, std::vector<ObjMaterial>& materials, NamedFiles& named) {
    const auto between = file.parent_path().lexically_normal().lexically_relative(folder.lexically_normal());
    if (between.empty() || between == ".") return;
    for (auto& material : materials) {
        if (material.image.empty()) continue;
        const auto name = (between / material.image).string();
        if (named.find(folder, name)) material.image = name;
    }
}

KnownMaterials read_materials(MeshFindings& findings, const fs::path& folder, bool is_needed, NamedFiles& named) {
    KnownMaterials out;
    for (const auto& line : findings.texture.material_files) {
        const auto files = files_of_line(line, folder, named);
        for (const auto& name : files.missing)
            remark(&findings, "material-file",
                   "its material file " + in_quotes(name) + " is not in its folder (" + folder.string() + ")",
                   is_needed);
        for (const auto& path : files.paths) {
            constexpr std::uint64_t most_bytes = std::uint64_t{1} << 26;
            const auto bytes = read_file(path, most_bytes);
            if (!bytes) {
                remark(&findings, "material-file", "its material file cannot be read: " + bytes.error().message,
                       is_needed);
                continue;
            }
            auto more = read_obj_materials({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
            name_from(folder, path, more, named);
            out.materials.insert(out.materials.end(), more.begin(), more.end());
            out.any_file = true;
        }
    }
    return out;
}

}  // namespace

void take_materials(MeshFindings& findings, const fs::path& folder, const std::vector<bool>& worn, bool is_needed,
                    NamedFiles& named) {
    auto& texture = findings.texture;
    if (texture.material_files.empty()) return;
    bool any_name = false;
    for (std::size_t p = 0; p < worn.size(); ++p)
        any_name = any_name || (worn[p] && !texture.parts[p].material.empty());
    if (!any_name) return;
    const auto known = read_materials(findings, folder, is_needed, named);
    for (std::size_t p = 0; p < worn.size(); ++p) {
        auto& part = texture.parts[p];
        if (!worn[p] || part.material.empty()) continue;
        const auto* material = find_material(known.materials, part.material);
        if (!material) {
            if (known.any_file)
                remark(&findings, "material",
                       "its material " + in_quotes(part.material) + " is in none of its material files", is_needed);
            continue;
        }
        const bool has_image =
            !material->image.empty() && (!material->is_substitute || named.find(folder, material->image));
        if (!has_image) {
            part.colour = material->colour;
            continue;
        }
        part.image = add_image(texture, material->image);
        if (material->is_substitute)
            remark(&findings, "substitute-image",
                   "its material " + in_quotes(part.material) +
                       " has no map_Kd; the image of its map_Ka or map_Ke is taken, as if it were that");
        if (material->is_placed)
            remark(&findings, "placed-image",
                   "its material " + in_quotes(part.material) +
                       " scales or moves its image, by -s, -o or -t of its map; that is passed over",
                   is_needed);
    }
}

}  // namespace htvm
