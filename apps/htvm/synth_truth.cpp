#include "synth_truth.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/image_file.h"
#include "io/mesh_file.h"
#include "io/output_file.h"
#include "synth/synth.h"

namespace htvm::app {
namespace {

double hundredths(double value) { return std::round(100 * value) / 100; }

nlohmann::ordered_json mark_json(const SurfaceMark& mark) {
    return {{"of", figure_name(mark.part)},
            {"part", part_name(mark.part)},
            {"rest", {hundredths(mark.rest[0]), hundredths(mark.rest[1]), hundredths(mark.rest[2])}}};
}

nlohmann::ordered_json event_json(const LimbEvent& event) {
    nlohmann::ordered_json out = {{"event", event_name(event.kind)},
                                  {"of", figure_name(event.part)},
                                  {"limb", part_name(event.part)},
                                  {"first", event.first},
                                  {"last", event.last}};
    if (event.kind == LimbEventKind::fast) out["largest_step_mm"] = hundredths(event.largest_step);
    if (event.kind == LimbEventKind::touch || event.kind == LimbEventKind::release) {
        out["with"] = part_name(event.other);
        out["with_of"] = figure_name(event.other);
    }
    return out;
}

nlohmann::ordered_json vector_json(const Eigen::Vector3d& v) {
    const auto rounded = [](double value) { return std::round(1e5 * value) / 1e5; };
    return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

nlohmann::ordered_json cameras_json(const DepthCameraOptions& options,
                                    const std::vector<std::vector<DepthCamera>>& places) {
    nlohmann::ordered_json out = {{"sensor", sensor_name(options.sensor)}};
    auto& frames = out["frames"] = nlohmann::ordered_json::array();
    for (const auto& cameras : places) {
        auto& frame = frames.emplace_back(nlohmann::ordered_json::array());
        for (const DepthCamera& camera : cameras)
            frame.push_back({{"width", camera.width},
                             {"height", camera.height},
                             {"focal", camera.focal},
                             {"position", vector_json(camera.position)},
                             {"right", vector_json(camera.right)},
                             {"up", vector_json(camera.up)},
                             {"backward", vector_json(camera.backward)}});
    }
    return out;
}

}  // namespace

Result<TruthFiles> TruthFiles::create(const std::filesystem::path& folder, const SynthOptions& options, int first_frame,
                                      int marks, const DepthCameraOptions* cameras) {
    for (const char* name : {"surface", "marks", "seen"}) {
        if (!cameras && std::string_view(name) == "seen") continue;
        std::error_code error;
        std::filesystem::create_directories(folder / name, error);
        if (error) return fail(ErrorKind::bad_input, (folder / name).string() + " cannot be made: " + error.message());
    }
    TruthFiles files;
    files.folder_ = folder;
    files.options_ = options;
    files.first_frame_ = first_frame;
    if (cameras) files.cameras_ = *cameras;
    files.marks_ = surface_marks(options, static_cast<std::size_t>(marks));
    return files;
}

Result<void> TruthFiles::add(const std::string& file_name, SynthFrame frame, TrueFrame truth,
                             const SynthTexture* texture, const DepthCapture* capture) {
    if (texture) {
        const auto path = folder_ / "texture" / std::filesystem::path(file_name).replace_extension(".png");
        std::error_code error;
        std::filesystem::create_directories(path.parent_path(), error);
        if (error)
            return fail(ErrorKind::bad_input, path.parent_path().string() + " cannot be made: " + error.message());
        const auto bytes = write_png_image(texture->exact);
        if (!bytes) return tl::unexpected(bytes.error());
        if (auto ok = write_file(path, *bytes); !ok) return ok;
        textures_.push_back({texture->layout, texture->gain});
    }
    if (capture) {
        if (auto ok = write_mesh(folder_ / "seen" / file_name, seen_surface(frame, *capture)); !ok) return ok;
        camera_places_.push_back(capture->cameras);
    }
    Mesh surface = std::move(frame.mesh);
    surface.positions = std::move(frame.true_positions);
    surface.normals.clear();  // they are those of the noisy surface
    if (auto ok = write_mesh(folder_ / "surface" / file_name, surface); !ok) return ok;
    Mesh marks;
    marks.positions = std::move(truth.positions);
    marks.normals = std::move(truth.normals);
    if (auto ok = write_mesh(folder_ / "marks" / file_name, marks); !ok) return ok;
    limbs_.push_back(std::move(truth.limbs));
    return {};
}

Result<void> TruthFiles::finish() const {
    nlohmann::ordered_json out = {
        {"fps", options_.fps}, {"first_frame", first_frame_}, {"frames", limbs_.size()}, {"seed", options_.seed}};
    auto& marks = out["marks"] = nlohmann::ordered_json::array();
    for (const SurfaceMark& mark : marks_) marks.push_back(mark_json(mark));
    auto& events = out["events"] = nlohmann::ordered_json::array();
    for (const LimbEvent& event : limb_events(limbs_, first_frame_, options_.fps)) events.push_back(event_json(event));
    for (const auto& [layout, gain] : textures_)
        out["textures"].push_back(
            {{"layout", layout},
             {"gain",
              {std::round(1e4 * gain[0]) / 1e4, std::round(1e4 * gain[1]) / 1e4, std::round(1e4 * gain[2]) / 1e4}}});
    if (cameras_) out["cameras"] = cameras_json(*cameras_, camera_places_);
    return write_file(folder_ / "truth.json", out.dump(1) + "\n");
}

}  // namespace htvm::app
