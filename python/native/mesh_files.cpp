#include "mesh_files.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include "c_api/c_mesh.h"
#include "c_api/c_status.h"
#include "io/mesh_file.h"

using htvm::c_api::guarded;
using htvm::c_api::LastError;

struct htvm_mesh_file {
    htvm::Mesh mesh;
};

namespace {

// Does the work, and gives what went wrong to the caller's text.
template <class Work>
htvm_status with_text(char* text, std::size_t text_capacity, const Work& work) {
    LastError error;
    const auto status = guarded(error, [&] { return work(error); });
    if (text && text_capacity > 0) {
        const auto length = std::min(std::strlen(error.text.data()), text_capacity - 1);
        std::memcpy(text, error.text.data(), length);
        text[length] = '\0';
    }
    return status;
}

}  // namespace

htvm_status htvm_mesh_file_read(const char* path, const char* unit, htvm_mesh_file** file, char* text,
                                size_t text_capacity) {
    if (!file) return HTVM_BAD_INPUT;
    *file = nullptr;
    return with_text(text, text_capacity, [&](LastError& error) {
        if (!path || !unit) return error.set(HTVM_BAD_INPUT, "the path or the unit is NULL");
        const bool guess = std::string_view(unit) == "auto";
        const auto known = htvm::length_unit(guess ? "mm" : unit);
        if (!known) return error.set(known.error());
        htvm::MeshFileOptions options;
        options.millimetres_per_unit = htvm::millimetres_per(*known);
        auto mesh = htvm::read_mesh(path, options);
        if (!mesh) return error.set(mesh.error());
        if (guess)
            if (const auto ok = htvm::scale_positions(*mesh, htvm::millimetres_per(htvm::likely_unit(path, *mesh)));
                !ok)
                return error.set(ok.error());
        *file = new htvm_mesh_file{std::move(*mesh)};
        return htvm_status{HTVM_OK};
    });
}

void htvm_mesh_file_destroy(htvm_mesh_file* file) { delete file; }

htvm_status htvm_mesh_file_view(htvm_mesh_file* file, htvm_mesh_view* view, size_t view_size) {
    if (!file) return HTVM_BAD_INPUT;
    return htvm::c_api::write_struct(htvm::c_api::lent(htvm::view_of(file->mesh), 0), view, view_size);
}

htvm_status htvm_mesh_file_write(const char* path, const char* unit, const htvm_mesh* mesh, char* text,
                                 size_t text_capacity) {
    return with_text(text, text_capacity, [&](LastError& error) {
        if (!path || !unit) return error.set(HTVM_BAD_INPUT, "the path or the unit is NULL");
        const auto known = std::string_view(unit) == "auto"
                               ? htvm::unit_of_format(path).value_or(htvm::LengthUnit::millimetre)
                               : htvm::length_unit(unit);
        if (!known) return error.set(known.error());
        htvm::Mesh read;
        if (const auto status = htvm::c_api::read_mesh(error, mesh, read); status != HTVM_OK) return status;
        htvm::MeshFileOptions options;
        options.millimetres_per_unit = htvm::millimetres_per(*known);
        const auto written = htvm::write_mesh(path, read, options);
        return written ? htvm_status{HTVM_OK} : error.set(written.error());
    });
}
