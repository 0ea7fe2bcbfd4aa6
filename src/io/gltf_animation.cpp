#include "io/gltf_animation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "io/mesh_check.h"
#include "io/mesh_file.h"

namespace htvm {

using namespace internal;

namespace {

using nlohmann::json;

constexpr std::uint64_t json_bytes_of_a_frame = 2500;  // more than any takes, with its numbers of many digits
constexpr Vector3f shown{1, 1, 1}, hidden{0, 0, 0};

// The rotation, as a quaternion x, y, z, w, that brings what is up to +y.
json upright(UpAxis up) {
    const double half = std::sqrt(0.5);
    switch (up) {
        case UpAxis::plus_x:
            return {0, 0, half, half};
        case UpAxis::minus_x:
            return {0, 0, -half, half};
        case UpAxis::minus_y:
            return {1, 0, 0, 0};
        case UpAxis::plus_z:
            return {-half, 0, 0, half};
        case UpAxis::minus_z:
            return {half, 0, 0, half};
        case UpAxis::unknown:
        case UpAxis::plus_y:
            break;
    }
    return {0, 0, 0, 1};
}

// The time as a float that is later than `before`.
float time_after(float before, double seconds) {
    const auto limited = std::clamp(seconds, 0.0, 1e30);
    return std::max(static_cast<float>(limited), std::nextafter(before, std::numeric_limits<float>::max()));
}

}  // namespace

Result<GltfAnimation> GltfAnimation::create(const std::filesystem::path& path, GltfAnimationOptions options) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (!file->is_file())
        return fail(ErrorKind::bad_input, path.string() + ": a .glb can only be written to a file, not to a pipe");
    return GltfAnimation(std::move(*file), std::move(options));
}

// The bytes that the buffer still holds go to the file.
Result<void> GltfAnimation::flush() {
    if (auto ok = file_.write(buffer_.bytes); !ok) return ok;
    buffer_.written += buffer_.bytes.size();
    buffer_.bytes.clear();
    return {};
}

// The animation of the last frame's node. next: when another frame takes its place, else it stays until the end.
Result<void> GltfAnimation::show_last_until(std::optional<float> next, float end) {
    if (!last_ || !last_->node) return {};
    std::vector<float> times;
    std::vector<Vector3f> scales;
    const auto key = [&](float time, const Vector3f& scale) {
        times.push_back(time);
        scales.push_back(scale);
    };
    if (last_->begin > 0) key(0, hidden);
    key(last_->begin, shown);
    // The last key of all frames is the animation's end.
    key(next.value_or(end), next ? hidden : shown);
    const auto input = add_numbers(buffer_, times), output = add_rows(buffer_, scales);
    samplers_.push_back({{"input", input}, {"output", output}, {"interpolation", "STEP"}});
    channels_.push_back({{"sampler", samplers_.size() - 1}, {"target", {{"node", *last_->node}, {"path", "scale"}}}});
    return flush();
}

Result<void> GltfAnimation::add(const Mesh& mesh, double seconds, const std::string& name,
                                const std::shared_ptr<const std::vector<std::uint8_t>>& image,
                                GltfTriangles triangles) {
    if (auto ok = check_mesh(mesh); !ok) return ok;
    const float begin = last_ ? time_after(last_->begin, seconds) : 0.0f;
    if (auto ok = show_last_until(begin, begin); !ok) return ok;
    last_ = Frame{{}, begin};
    if (mesh.positions.empty()) return {};
    Mesh scaled = mesh;
    if (auto ok = scale_positions(scaled, 1 / options_.millimetres_per_unit); !ok) return ok;
    const bool textured = image && !mesh.texcoords.empty();
    if (textured && image != last_image_) {
        image_ = add_image(buffer_, *image);
        last_image_ = image;
    }
    json node = {
        {"name", name},
        {"mesh", add_mesh(buffer_, scaled, topology_, textured ? std::optional(image_) : std::nullopt, triangles)}};
    // As players that know no animations show it: the first frame alone.
    if (begin > 0) node["scale"] = hidden;
    nodes_.push_back(std::move(node));
    last_->node = nodes_.size() - 1;
    json_bytes_ += json_bytes_of_a_frame + 6 * name.size();
    if (buffer_.size() + json_bytes_ > most_glb_bytes)
        return fail(ErrorKind::limit,
                    "more than " + std::to_string(nodes_.size() - 1) +
                        " frames do not fit into a .glb, which can hold 4 GiB; write fewer, or a file "
                        "for each frame");
    return flush();
}

Result<void> GltfAnimation::finish(double end_seconds) {
    if (last_)
        if (auto ok = show_last_until({}, time_after(last_->begin, end_seconds)); !ok) return ok;
    json root = {{"asset", {{"version", "2.0"}, {"generator", "htvm"}}}, {"scene", 0}};
    if (!options_.rights.empty()) root["asset"]["copyright"] = options_.rights;
    json scene = json::object();
    if (!nodes_.empty()) {
        json all = {{"name", options_.title.empty() ? "capture" : options_.title}, {"rotation", upright(options_.up)}};
        for (std::size_t n = 0; n < nodes_.size(); ++n) all["children"].push_back(n);
        if (options_.global_shift != GlobalShift{}) {
            // A node within the one that turns what is up: the shift is of the coordinates before.
            json shifted = {{"children", all["children"]}};
            for (const auto c : options_.global_shift)
                shifted["translation"].push_back(static_cast<double>(c) / options_.millimetres_per_unit);
            all["children"] = {nodes_.size()};
            nodes_.push_back(std::move(shifted));
        }
        nodes_.push_back(std::move(all));
        scene["nodes"].push_back(nodes_.size() - 1);
        root["nodes"] = std::move(nodes_);
        json animation = {{"name", "frames"}, {"samplers", std::move(samplers_)}, {"channels", std::move(channels_)}};
        if (!animation["channels"].empty()) root["animations"].push_back(std::move(animation));
    }
    root["scenes"].push_back(std::move(scene));
    return file_.finish_behind(glb_front(std::move(root), buffer_));
}

}  // namespace htvm
