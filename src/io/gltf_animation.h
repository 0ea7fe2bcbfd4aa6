// A whole stream as one .glb file that plays: a mesh per frame, each on a node of its own whose scale is 1 while the
// frame is shown, and 0 otherwise, switched by an animation in steps. docs/gltf.md says why not by morph targets.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "io/gltf_buffer.h"
#include "io/output_file.h"

namespace htvm {

struct GltfAnimationOptions {
    double millimetres_per_unit = 1000;  // of the file's coordinates; finite, above 0; glTF wants metres
    UpAxis up = UpAxis::unknown;         // of the meshes: turned so that y is up; unknown is y
    std::string title, rights;           // of the file; may be empty
    GlobalShift global_shift{};          // mm: where the meshes stand
};

// Whether a frame's triangles may be those of others, which then share them.
using GltfTriangles = internal::GltfTriangles;

// Frames go to disk as they come: what stays in memory are some hundred bytes for each, and one frame's triangles.
class GltfAnimation {
public:
    // A file beside its place, until finish(): output_file.h. bad_input if the path is that of a pipe or device.
    static Result<GltfAnimation> create(const std::filesystem::path& path, GltfAnimationOptions options = {});
    // A frame that is shown from then on; in mm. A time that is not after the one before is put right after it. A mesh
    // without vertices shows nothing. Fails (bad_input) if check_mesh does or a position is too large; (limit) if the
    // file would become larger than the 4 GiB that a .glb can hold; disk_full.
    // triangles: those of one frame take two bytes an index where the mesh has few enough vertices.
    // image: the file of its texture's image (gltf.h); one that is the same memory as the last is not repeated.
    Result<void> add(const Mesh& mesh, double seconds, const std::string& name,
                     const std::shared_ptr<const std::vector<std::uint8_t>>& image = nullptr,
                     GltfTriangles triangles = GltfTriangles::of_many_frames);
    // end_seconds: when the last frame ends.
    Result<void> finish(double end_seconds);

private:
    GltfAnimation(OutputFile file, GltfAnimationOptions options)
        : file_(std::move(file)), options_(std::move(options)) {}
    Result<void> flush();
    Result<void> show_last_until(std::optional<float> next, float end);

    struct Frame {
        std::optional<std::size_t> node;  // none: without vertices
        float begin = 0;
    };
    OutputFile file_;
    GltfAnimationOptions options_;
    internal::GltfBuffer buffer_;
    internal::GltfTopology topology_;
    std::uint64_t json_bytes_ = 1000;  // at most, so far
    std::optional<Frame> last_;
    std::shared_ptr<const std::vector<std::uint8_t>> last_image_;
    std::size_t image_ = 0;  // its number
    nlohmann::json nodes_ = nlohmann::json::array(), samplers_ = nlohmann::json::array(),
                   channels_ = nlohmann::json::array();
};

}  // namespace htvm
