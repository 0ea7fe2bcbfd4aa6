#include <array>
#include <cmath>
#include <string>

#include "io/number_text.h"
#include "io/obj.h"

namespace htvm {

namespace {

template <class Number, std::size_t N>
void append_statement(std::string& text, const char* keyword, const std::array<Number, N>& values) {
    text += keyword;
    for (const Number value : values) {
        text += ' ';
        append_number(text, value);
    }
}

}  // namespace

std::string write_obj_material(std::string_view image) {
    return "newmtl texture\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd " + std::string(image) + '\n';
}

Result<std::string> write_obj(const Mesh& mesh, std::string_view material_file, const std::array<double, 3>& origin) {
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    const bool is_shifted = origin != std::array<double, 3>{};
    std::string text;
    if (!material_file.empty()) text.append("mtllib ").append(material_file).append("\n");
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        if (is_shifted) {
            const auto& p = mesh.positions[v];
            append_statement<double, 3>(text, "v",
                                        {static_cast<double>(p[0]) + origin[0], static_cast<double>(p[1]) + origin[1],
                                         static_cast<double>(p[2]) + origin[2]});
        } else {
            append_statement(text, "v", mesh.positions[v]);
        }
        if (!mesh.colours.empty()) {
            for (const std::uint8_t c : mesh.colours[v]) {
                text += ' ';
                // Six digits distinguish 256 levels and stay legible.
                append_number(text, static_cast<float>(std::round(c / 255.0 * 1e6) / 1e6));
            }
        }
        text += '\n';
    }
    for (const Vector2f& texcoord : mesh.texcoords) append_statement(text, "vt", texcoord), text += '\n';
    for (const Vector3f& normal : mesh.normals) append_statement(text, "vn", normal), text += '\n';
    if (!material_file.empty()) text += "usemtl texture\n";
    for (const Triangle& triangle : mesh.triangles) {
        text += 'f';
        for (const std::uint32_t index : triangle) {
            const std::string number = std::to_string(std::uint64_t{index} + 1);
            text += ' ' + number;
            if (!mesh.texcoords.empty()) text += '/' + number;
            if (!mesh.normals.empty()) text += (mesh.texcoords.empty() ? "//" : "/") + number;
        }
        text += '\n';
    }
    return text;
}

}  // namespace htvm
