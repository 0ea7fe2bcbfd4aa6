#include "io/recording_manifest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <system_error>
#include <utility>

#include "core/letter_case.h"
#include "io/named_file.h"
#include "io/sequence.h"
#include "io/skeleton_json_value.h"

namespace htvm::internal {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t most_frames = std::uint64_t{1} << 20;

// The text that an object has; empty if there is none.
std::string text_in(const json& object, const char* name) {
    const auto* member = find_member(object, name);
    return member && member->is_string() ? member->get<std::string>() : std::string();
}

bool is_true(const json& object, const char* name) {
    const auto* member = find_member(object, name);
    return member && member->is_boolean() && member->get<bool>();
}

// A number of frames a second, as a number or as text, in thousandths.
FrameRate rate_in(const json& object, const char* name) {
    const auto* member = find_member(object, name);
    if (!member) return {};
    double rate = 0;
    if (member->is_number()) rate = member->get<double>();
    if (member->is_string()) {
        const auto parsed = parse_frame_rate(member->get<std::string>());
        return parsed ? *parsed : FrameRate();
    }
    if (!(rate > 0) || rate > 4e6) return {};
    return {static_cast<std::uint32_t>(std::lround(rate * 1000)), 1000};
}

tl::unexpected<Error> missing(const std::string& name) {
    return fail(ErrorKind::bad_input, "it names \"" + name.substr(0, 200) + "\", which is not in its folder");
}

// ---- Universal Volumetric -------------------------------------------------------------------------------------------

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size())
        text.replace(at, what.size(), by);
    return text;
}

// A template with its [######] replaced by a number of that many digits.
std::string numbered(const std::string& text, std::uint64_t number) {
    const auto begin = text.find("[#");
    const auto end = begin == text.npos ? begin : text.find(']', begin);
    if (end == text.npos) return text;
    auto digits = std::to_string(number);
    if (const auto wanted = end - begin - 1; digits.size() < wanted) digits.insert(0, wanted - digits.size(), '0');
    return text.substr(0, begin) + digits + text.substr(end + 1);
}

std::string extension_of(const std::string& format) { return format == "draco" ? ".drc" : "." + format; }

// What targets there are of a path template; the one of most frames a second that is read.
struct Target {
    std::string path, format;
    FrameRate rate;
    std::uint64_t frames = 0;  // 0: it does not say
};

std::optional<Target> best_target(const json& part, std::initializer_list<std::string_view> formats) {
    const auto* targets = find_member(part, "targets");
    const auto path = text_in(part, "path");
    std::optional<Target> best;
    if (!targets || !targets->is_object()) return best;
    for (const auto& [name, target] : targets->items()) {
        const auto format = lower_case(text_in(target, "format"));
        if (std::ranges::find(formats, std::string_view(format)) == formats.end()) continue;
        Target found;
        found.format = format;
        found.rate = rate_in(target, "frameRate");
        found.path = replaced(replaced(path, "[target]", name), "[ext]", extension_of(format));
        const auto* frames = find_member(target, "frameCount");
        if (frames && frames->is_number_unsigned()) found.frames = frames->get<std::uint64_t>();
        if (!best || found.rate.per_second() > best->rate.per_second()) best = std::move(found);
    }
    return best;
}

// The files of a numbered template, from 0 or 1 on: as many as it says, or as there are.
Result<std::vector<fs::path>> numbered_files(const fs::path& folder, const Target& target) {
    if (target.frames > most_frames)
        return fail(ErrorKind::limit, "it says that it has " + std::to_string(target.frames) + " frames");
    std::vector<fs::path> out;
    const std::uint64_t first = recorded_file(folder, numbered(target.path, 0)) ? 0 : 1;
    for (std::uint64_t n = 0; target.frames == 0 ? n < most_frames : n < target.frames; ++n) {
        const auto name = numbered(target.path, first + n);
        auto path = recorded_file(folder, name);
        if (!path && (target.frames > 0 || n == 0)) return missing(name);
        if (!path) break;
        out.push_back(std::move(*path));
        if (name == numbered(target.path, first + n + 1)) break;  // no number in it
    }
    return out;
}

Result<void> add_universal_texture(const json& manifest, const fs::path& folder, Recording& out) {
    const auto* texture = find_member(manifest, "texture");
    const auto* colour = texture ? find_member(*texture, "baseColor") : nullptr;
    if (colour) texture = colour;
    if (!texture || !find_member(*texture, "targets")) return {};
    if (auto target = best_target(*texture, {"mp4", "webm", "mov", "png", "jpg", "jpeg", "webp"})) {
        target->path = replaced(replaced(target->path, "[type]", "baseColor"), "[tag]", "default");
        target->frames = 0;
        auto files = numbered_files(folder, *target);
        if (!files) return tl::unexpected(files.error());
        const bool is_video = target->format == "mp4" || target->format == "webm" || target->format == "mov";
        if (is_video)
            out.video = files->front();
        else
            out.images = std::move(*files);
        return {};
    }
    out.unread_texture =
        "its textures are KTX2 with Basis, which is not read; name the images or the video that they were "
        "made of";
    return {};
}

}  // namespace

std::optional<fs::path> recorded_file(const fs::path& folder, std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    if (name.find('\0') != name.npos) return std::nullopt;
    while (!name.empty()) {
        if (named_place(folder, folder / name) == NamedPlace::inside) return folder / name;
        const auto slash = name.find('/');
        if (slash == name.npos) break;
        name.erase(0, slash + 1);
    }
    return std::nullopt;
}

std::vector<fs::path> files_with(const fs::path& folder, std::initializer_list<std::string_view> extensions) {
    std::vector<fs::path> out;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const auto extension = lower_case(entry.path().extension().string());
        const bool is_wanted = std::ranges::find(extensions, std::string_view(extension)) != extensions.end();
        if (is_wanted && entry.is_regular_file(error) && !entry.path().filename().string().starts_with("."))
            out.push_back(entry.path());
    }
    std::ranges::sort(
        out, [](const auto& a, const auto& b) { return natural_less(a.filename().string(), b.filename().string()); });
    return out;
}

// {"frames": [{"mesh_path": "...", "texture_path": "...", "delay_us": 66128}, ...], "average_fps": "15"}
MaybeRecording scandy_recording(const json& manifest, const fs::path& folder) {
    const auto* frames = find_member(manifest, "frames");
    if (!frames || !frames->is_array() || frames->empty() || text_in((*frames)[0], "mesh_path").empty())
        return std::nullopt;
    Recording out;
    out.format = "SCVV (Scandy)";
    std::int64_t time = 0;
    constexpr double longest_delay = 1e12;
    for (const auto& frame : *frames) {
        const auto mesh_name = text_in(frame, "mesh_path"), image_name = text_in(frame, "texture_path");
        auto mesh = recorded_file(folder, mesh_name);
        if (!mesh) return missing(mesh_name);
        out.meshes.push_back(std::move(*mesh));
        if (!image_name.empty()) {
            auto image = recorded_file(folder, image_name);
            if (!image) return missing(image_name);
            out.images.push_back(std::move(*image));
        }
        const auto* said = find_member(frame, "delay_us");
        const double delay = said && said->is_number() ? said->get<double>() : 0;
        if (!(delay >= 0) || delay > longest_delay) return fail(ErrorKind::bad_input, "it has a delay that is no time");
        // The first frame begins the recording, whatever it is to wait for.
        time += out.microseconds.empty() ? 0 : std::max<std::int64_t>(1, static_cast<std::int64_t>(delay));
        out.microseconds.push_back(time);
    }
    if (!out.images.empty() && out.images.size() != out.meshes.size())
        return fail(ErrorKind::bad_input, "it names images for some of its frames and not for others");
    out.rate = rate_in(manifest, "average_fps");
    if (const auto sound = text_in(manifest, "audio"); !sound.empty()) out.sound = recorded_file(folder, sound);
    return out;
}

// {"version": "v2", "geometry": {"targets": {"draco": {"frameRate": 30, "frameCount": 2, "format": "draco"}},
//  "path": "geometry_[target]/[######][ext]"}, "texture": {...}, "audio": {...}}
MaybeRecording universal_recording(const json& manifest, const fs::path& folder) {
    const auto* geometry = find_member(manifest, "geometry");
    const bool is_first_version = find_member(manifest, "maxVertices") && find_member(manifest, "frameData");
    if (is_first_version || (geometry && find_member(*geometry, "frameData")))
        return fail(
            ErrorKind::unsupported,
            "this is a manifest of Universal Volumetric of version 1, whose meshes (one .uvol or .drcs file) are "
            "not read; encode it again as version 2, or give the meshes that it was made of");
    if (!geometry || !find_member(*geometry, "targets")) return std::nullopt;
    const auto target = best_target(*geometry, {"draco", "drc", "obj", "glb", "ply"});
    if (!target)
        return fail(ErrorKind::unsupported,
                    "this is a manifest of Universal Volumetric whose meshes are neither Draco, OBJ, GLB nor PLY");
    Recording out;
    out.format = "Universal Volumetric";
    auto meshes = numbered_files(folder, *target);
    if (!meshes) return tl::unexpected(meshes.error());
    out.meshes = std::move(*meshes);
    out.rate = target->rate;
    if (auto ok = add_universal_texture(manifest, folder, out); !ok) return tl::unexpected(ok.error());
    if (out.images.size() > 1 && out.images.size() != out.meshes.size())
        return fail(ErrorKind::unsupported, "it has " + std::to_string(out.images.size()) + " images for " +
                                                std::to_string(out.meshes.size()) + " meshes; one for each is read");
    if (const auto* audio = find_member(manifest, "audio"))
        for (const char* extension : {".mp3", ".wav", ".ogg", ".m4a"})
            if (!out.sound) out.sound = recorded_file(folder, replaced(text_in(*audio, "path"), "[ext]", extension));
    return out;
}

// {"geometryType": 2, "textureMode": 2, "DDS": true, "ASTC": false, "headerSizes": [...], "verticeCounts": [...]}
MaybeRecording geometry_sequence_recording(const json& manifest, const fs::path& folder) {
    const auto* counts = find_member(manifest, "verticeCounts");
    if (!counts || !counts->is_array() || !find_member(manifest, "headerSizes")) return std::nullopt;
    if (is_true(manifest, "useCompression") || is_true(manifest, "halfPrecision"))
        return fail(ErrorKind::unsupported,
                    "this is a sequence of the Geometry Sequence Player with compressed positions, which are not read; "
                    "convert it again without compression");
    Recording out;
    out.format = "Geometry Sequence Player";
    out.meshes = files_with(folder, {".ply"});
    if (out.meshes.empty()) return fail(ErrorKind::bad_input, "there are no PLY files beside it");
    if (out.meshes.size() != counts->size())
        out.remarks.push_back({"frames",
                               "it lists " + std::to_string(counts->size()) + " frames, and there are " +
                                   std::to_string(out.meshes.size()) + " PLY files",
                               out.meshes.size() < counts->size()});
    const auto* mode = find_member(manifest, "textureMode");
    const bool has_texture = mode && mode->is_number() && mode->get<double>() > 0;
    if (!has_texture) return out;
    out.images = files_with(folder, {".dds", ".png", ".jpg", ".jpeg"});
    const bool is_one = mode->get<double>() < 2;
    if (is_one && out.images.size() > 1) out.images.resize(1);
    if (out.images.empty())
        out.unread_texture = "its textures are ASTC, which is not read; convert them as DDS too, or name the images";
    else if (!is_one && out.images.size() != out.meshes.size())
        return fail(ErrorKind::bad_input, "there are " + std::to_string(out.images.size()) + " textures for " +
                                              std::to_string(out.meshes.size()) + " PLY files");
    return out;
}

// {"_versionMajor": 0, "_versionMinor": 5, "perspectives": [...]}, of a clip: only what is beside it can be read.
MaybeRecording depthkit_recording(const json& manifest, const fs::path& folder) {
    const bool is_clip = find_member(manifest, "_versionMajor") &&
                         (find_member(manifest, "perspectives") || find_member(manifest, "depthFocalLength"));
    if (!is_clip) return std::nullopt;
    Recording out;
    out.format = "Depthkit";
    out.unit = LengthUnit::metre;
    out.meshes = files_with(folder, {".obj"});
    if (out.meshes.empty()) out.meshes = files_with(folder, {".ply"});
    if (out.meshes.empty()) out.meshes = files_with(folder, {".glb"});
    if (out.meshes.empty())
        return fail(
            ErrorKind::unsupported,
            "this is a Depthkit clip, combined per pixel: a video of depths, which holds no mesh; export it from "
            "Depthkit as a textured geometry sequence");
    if (const auto videos = files_with(folder, {".mp4", ".mov", ".webm"}); videos.size() == 1) out.video = videos[0];
    out.rate = rate_in(manifest, "frameRate");
    return out;
}

}  // namespace htvm::internal
