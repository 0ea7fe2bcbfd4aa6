// Which extensions of glTF a file may use or require.
#include <algorithm>
#include <string_view>

#include "io/gltf_file.h"

namespace htvm::internal {
namespace {

using nlohmann::json;

// Read, or looked at where they occur and refused there if nothing stands in for them.
constexpr std::string_view read_here[] = {
    "KHR_mesh_quantization",   "KHR_node_visibility",     "KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression", "KHR_meshopt_compression", "MSFT_texture_dds",           "EXT_texture_webp",
    "EXT_texture_avif",        "KHR_texture_basisu",      "KHR_texture_transform",
};

// Beginnings of names whose extensions change nothing that is read here: the surface's answer to light, lights,
// cameras, notes, sound, behaviour.
constexpr std::string_view harmless_beginnings[] = {
    "KHR_materials_",
    "ADOBE_materials_",
    "EXT_materials_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_animation_",
    "KHR_interactivity",
    "KHR_physics_",
    "KHR_node_",
    "KHR_texture_",
    "EXT_texture_",
    "OMI_",
    "VRM",
    "GODOT_",
    "AGI_",
    "FB_",
    "MSFT_packing_",
    "MSFT_lod",
    "EXT_mesh_manifold",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_instance_features",
    "CESIUM_primitive_outline",
};

bool is_known(std::string_view name) {
    return std::ranges::find(read_here, name) != std::end(read_here) ||
           std::ranges::any_of(harmless_beginnings, [&](auto begin) { return name.starts_with(begin); });
}

std::vector<std::string> names_in(const json& root, const char* list) {
    std::vector<std::string> out;
    const auto* names = gltf_member(root, list);
    if (!names || !names->is_array()) return out;
    for (const auto& name : *names) out.push_back(name.is_string() ? name.get<std::string>() : std::string());
    return out;
}

}  // namespace

Result<void> check_gltf_extensions(const json& root, MeshFindings* findings) {
    for (const auto& name : names_in(root, "extensionsRequired"))
        if (!is_known(name))
            return fail(ErrorKind::unsupported, "the glTF needs the extension \"" + name.substr(0, 60) +
                                                    "\", which is not read; export it without");
    for (const auto& name : names_in(root, "extensionsUsed"))
        if (!is_known(name))
            remark(findings, "extension",
                   "it uses the extension \"" + name.substr(0, 60) + "\", which is not known here: it is passed over");
    return {};
}

const json* gltf_extension(const json& object, const char* name) {
    const auto* extensions = gltf_member(object, "extensions");
    const auto* extension = extensions ? gltf_member(*extensions, name) : nullptr;
    return extension && extension->is_object() ? extension : nullptr;
}

}  // namespace htvm::internal
