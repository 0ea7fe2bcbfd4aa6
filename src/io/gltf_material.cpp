#include "io/gltf_material.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace htvm::internal {
namespace {

using nlohmann::json;

constexpr std::array<double, 4> white{1, 1, 1, 1};

bool is_black(const std::array<double, 3>& light) {
    return std::ranges::all_of(light, [](double c) { return c <= 0.001; });
}

// The image of a texture: what any reader takes before what needs an extension.
Result<std::optional<std::uint64_t>> image_of_texture(const GltfFile& file, std::uint64_t index,
                                                      MeshFindings* findings) {
    const auto texture = gltf_item(file, "textures", index);
    if (!texture) return tl::unexpected(texture.error());
    const auto by = [&](const char* name) -> Result<std::optional<std::uint64_t>> {
        const auto* extension = gltf_extension(**texture, name);
        return extension ? gltf_index(*extension, "source") : std::optional<std::uint64_t>();
    };
    const auto webp = by("EXT_texture_webp"), dds = by("MSFT_texture_dds"), plain = gltf_index(**texture, "source"),
               basis = by("KHR_texture_basisu"), avif = by("EXT_texture_avif");
    for (const auto* found : {&webp, &dds, &plain, &basis, &avif})
        if (!*found) return *found;
    if (*webp) return webp;
    if (*plain) {
        if (*basis || *avif)
            remark(findings, "texture-beside",
                   std::string("its texture is also there as ") + (*basis ? "KTX2" : "AVIF") +
                       ", which is not read: the plain image beside it is taken");
        return plain;
    }
    return *dds ? dds : *basis ? basis : avif;
}

// KHR_texture_transform: scaled, turned, moved.
Result<std::array<double, 6>> placed_by(const json& transform) {
    const auto offset = gltf_numbers<2>(transform, "offset", {0, 0});
    const auto scale = gltf_numbers<2>(transform, "scale", {1, 1});
    const auto angle = gltf_real(transform, "rotation", 0);
    if (!offset) return tl::unexpected(offset.error());
    if (!scale) return tl::unexpected(scale.error());
    if (!angle) return tl::unexpected(angle.error());
    const double c = std::cos(*angle), s = std::sin(*angle);
    return std::array<double, 6>{c * (*scale)[0],  s * (*scale)[1], (*offset)[0],
                                 -s * (*scale)[0], c * (*scale)[1], (*offset)[1]};
}

// A texture that a material names, or nullptr.
Result<void> add_texture(const GltfFile& file, const json* texture, GltfLook& look, MeshFindings* findings) {
    if (!texture) return {};
    const auto index = gltf_index(*texture, "index");
    const auto set = gltf_number(*texture, "texCoord", 0);
    if (!index) return tl::unexpected(index.error());
    if (!set) return tl::unexpected(set.error());
    if (!*index) return {};
    const auto image = image_of_texture(file, **index, findings);
    if (!image) return tl::unexpected(image.error());
    look.image = *image;
    look.texcoord_set = *set;
    if (const auto* transform = gltf_extension(*texture, "KHR_texture_transform")) {
        const auto placed = placed_by(*transform);
        if (!placed) return tl::unexpected(placed.error());
        look.placed = *placed;
        const auto other = gltf_number(*transform, "texCoord", *set);
        if (!other) return tl::unexpected(other.error());
        look.texcoord_set = *other;
    }
    return {};
}

// What reflects light.
struct Base {
    const json* texture = nullptr;
    std::array<double, 4> factor = white;
    bool is_said = false;
};

Result<Base> base_of(const json& material) {
    const auto part = [](const json* from, const char* texture, const char* factor) -> Result<Base> {
        if (!from) return Base();
        const auto light = gltf_numbers<4>(*from, factor, white);
        if (!light) return tl::unexpected(light.error());
        const auto* image = gltf_member(*from, texture);
        return Base{image, *light, image || gltf_member(*from, factor)};
    };
    const auto metal = part(gltf_member(material, "pbrMetallicRoughness"), "baseColorTexture", "baseColorFactor");
    const auto gloss =
        part(gltf_extension(material, "KHR_materials_pbrSpecularGlossiness"), "diffuseTexture", "diffuseFactor");
    if (!metal) return metal;
    if (!gloss) return gloss;
    // The one stands in for the other where a reader does not know that.
    return gloss->is_said && (gloss->texture || !metal->texture) ? gloss : metal;
}

struct Emission {
    const json* texture = nullptr;
    std::array<double, 3> factor{};
};

Result<Emission> emission_of(const json& material) {
    auto factor = gltf_numbers<3>(material, "emissiveFactor", {0, 0, 0});
    if (!factor) return tl::unexpected(factor.error());
    if (const auto* extension = gltf_extension(material, "KHR_materials_emissive_strength")) {
        const auto strength = gltf_real(*extension, "emissiveStrength", 1);
        if (!strength) return tl::unexpected(strength.error());
        for (auto& c : *factor) c *= *strength;
    }
    return Emission{is_black(*factor) ? nullptr : gltf_member(material, "emissiveTexture"), *factor};
}

// Whether the base colour or the emission is what is seen.
bool is_seen_by_emission(const Base& base, const Emission& emission, const json& material, bool any_colours) {
    if (gltf_extension(material, "KHR_materials_unlit") || is_black(emission.factor)) return false;
    if (is_black({base.factor[0], base.factor[1], base.factor[2]})) return true;
    return emission.texture && !base.texture && !any_colours;
}

Result<void> add_alpha(const json& material, double alpha, GltfLook& look) {
    const auto* mode = gltf_member(material, "alphaMode");
    const bool is_mask = mode && *mode == "MASK", is_blend = mode && *mode == "BLEND";
    const auto cutoff = gltf_real(material, "alphaCutoff", 0.5);
    if (!cutoff) return tl::unexpected(cutoff.error());
    look.is_see_through = is_mask || is_blend;
    look.is_shown = !(is_blend && alpha <= 0) && !(is_mask && alpha < *cutoff);
    return {};
}

}  // namespace

Result<GltfLook> gltf_look(const GltfFile& file, const json& primitive, MeshFindings* findings) {
    GltfLook look;
    const auto index = gltf_index(primitive, "material");
    if (!index) return tl::unexpected(index.error());
    look.material = *index;
    if (!*index) return look;
    const auto material = gltf_item(file, "materials", **index);
    if (!material) return tl::unexpected(material.error());
    const auto base = base_of(**material);
    if (!base) return tl::unexpected(base.error());
    const auto emission = emission_of(**material);
    if (!emission) return tl::unexpected(emission.error());
    const auto* attributes = gltf_member(primitive, "attributes");
    const bool any_colours = attributes && gltf_member(*attributes, "COLOR_0");
    if (is_seen_by_emission(*base, *emission, **material, any_colours)) {
        look.factor = emission->factor;
        look.takes_vertex_colours = false;
        if (auto ok = add_texture(file, emission->texture, look, findings); !ok) return tl::unexpected(ok.error());
    } else {
        look.factor = {base->factor[0], base->factor[1], base->factor[2]};
        if (auto ok = add_texture(file, base->texture, look, findings); !ok) return tl::unexpected(ok.error());
        GltfLook glow;
        if (auto ok = add_texture(file, emission->texture, glow, findings); !ok) return tl::unexpected(ok.error());
        const bool is_unlit = gltf_extension(**material, "KHR_materials_unlit") != nullptr;
        if (glow.image && glow.image != look.image && !is_unlit)
            remark(findings, "emission", "its material glows besides its colour (emissiveTexture), which is left out",
                   true);
    }
    if (auto ok = add_alpha(**material, base->factor[3], look); !ok) return tl::unexpected(ok.error());
    return look;
}

}  // namespace htvm::internal
