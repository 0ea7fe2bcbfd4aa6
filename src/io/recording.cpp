#include "io/recording.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/letter_case.h"
#include "io/drc.h"
#include "io/recording_manifest.h"
#include "io/sequence.h"
#include "io/skeleton_json_value.h"
#include "io/texture_video.h"

namespace htvm {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t most_manifest_bytes = std::uint64_t{1} << 26;
constexpr std::size_t most_manifests = 16;  // in a folder: more JSON files than this are of frames

tl::unexpected<Error> fail_at(const fs::path& path, const Error& error) {
    return fail(error.kind, path.string() + ": " + error.message);
}

// ---- Volograms ------------------------------------------------------------------------------------------------------

// The number in "texture_2048_h264.mp4", by which the largest of several videos is found.
std::uint64_t size_in_name(const fs::path& path) {
    std::uint64_t out = 0;
    for (const char c : path.stem().string()) {
        if (c >= '0' && c <= '9' && out < 100000)
            out = out * 10 + static_cast<std::uint64_t>(c - '0');
        else if (out > 0)
            break;
    }
    return out;
}

std::optional<fs::path> largest_video(const fs::path& folder) {
    std::optional<fs::path> out;
    for (auto& video : files_with(folder, {".mp4", ".m4v", ".mov", ".webm", ".mkv"}))
        if (!out || size_in_name(video) > size_in_name(*out)) out = std::move(video);
    return out;
}

MaybeRecording vologram_recording(const fs::path& header) {
    const auto folder = header.has_parent_path() ? header.parent_path() : fs::path(".");
    auto source = byte_source(header);
    if (!source) return tl::unexpected(source.error());
    std::vector<ByteSource> sequences;
    if (header.stem() != header.filename() && lower_case(header.stem().string()) == "header")
        for (const auto& path : files_with(folder, {".vols"})) {
            if (!path.stem().string().starts_with("sequence_")) continue;
            auto sequence = byte_source(path);
            if (!sequence) return tl::unexpected(sequence.error());
            sequences.push_back(std::move(*sequence));
        }
    auto vologram = open_vologram(std::move(*source), std::move(sequences));
    if (!vologram) return fail_at(header, vologram.error());
    Recording out;
    out.format = "vologram";
    out.unit = LengthUnit::metre;
    const auto rate = vologram->frames_per_second > 0 ? vologram->frames_per_second : 30;
    out.rate = {static_cast<std::uint32_t>(rate * 1000 + 0.5), 1000};
    out.video = largest_video(folder);
    if (vologram->has_pictures && !out.video)
        out.unread_texture =
            "its pictures are compressed inside of it (Basis), which is not read; name an image or a video";
    out.vologram = std::make_shared<const Vologram>(std::move(*vologram));
    return out;
}

// ---- Manifests ------------------------------------------------------------------------------------------------------

MaybeRecording recording_of_manifest(const fs::path& path) {
    const auto bytes = read_file(path, most_manifest_bytes);
    if (!bytes) return std::nullopt;
    const auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
    if (!json || !json->is_object()) return std::nullopt;
    const auto folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    for (const auto read : {scandy_recording, universal_recording, geometry_sequence_recording, depthkit_recording}) {
        auto found = read(*json, folder);
        if (!found) return fail_at(path, found.error());
        if (*found) return found;
    }
    return std::nullopt;
}

// What files are that other programs wrote and that hold no mesh that is read here; empty: nothing is known of them.
std::string_view why_not(const std::string& extension) {
    if (extension == ".uvol" || extension == ".drcs" || extension == ".crt")
        return "this is Universal Volumetric of version 1, whose meshes (Corto) are not read; encode it again as "
               "version "
               "2, or give the meshes that it was made of";
    if (extension == ".r3d")
        return "this is a recording of Record3D, which holds depth images and no mesh; export it there as OBJ or GLB "
               "files";
    return {};
}

MaybeRecording recording_of_file(const fs::path& path) {
    const auto extension = lower_case(path.extension().string());
    if (extension == ".json" || extension == ".txt") return recording_of_manifest(path);
    if (extension == ".manifest") return recording_of_manifest(path);
    if (extension == ".vols") return vologram_recording(path);
    if (const auto why = why_not(extension); !why.empty())
        return fail(ErrorKind::unsupported, path.string() + ": " + std::string(why));
    return std::nullopt;
}

MaybeRecording recording_of_folder(const fs::path& folder) {
    std::error_code error;
    for (const char* name : {"scvv_animation.json", "sequence.json", "header.vols"})
        if (fs::is_regular_file(folder / name, error)) {
            auto found = recording_of_file(folder / name);
            if (!found || *found) return found;
        }
    if (const auto volograms = files_with(folder, {".vols"}); volograms.size() == 1)
        return vologram_recording(volograms[0]);
    const auto manifests = files_with(folder, {".json", ".manifest", ".txt"});
    if (manifests.size() > most_manifests) return std::nullopt;
    for (const auto& manifest : manifests) {
        auto found = recording_of_manifest(manifest);
        if (!found || *found) return found;
    }
    return std::nullopt;
}

}  // namespace

MaybeRecording find_recording(const fs::path& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) return recording_of_folder(path);
    if (fs::is_regular_file(path, error)) return recording_of_file(path);
    return std::nullopt;
}

std::size_t frame_count(const Recording& recording) {
    return recording.vologram ? recording.vologram->frames.size() : recording.meshes.size();
}

Result<Mesh> read_frame(const Recording& recording, std::size_t frame, const MeshFileOptions& options,
                        MeshFindings* findings) {
    if (frame >= frame_count(recording))
        return fail(ErrorKind::bad_input, "the recording has no frame " + std::to_string(frame));
    const bool is_draco = !recording.vologram &&
                          lower_case(recording.meshes[frame].extension().string()) == ".draco";  // as Scandy names it
    if (!recording.vologram && !is_draco) return read_mesh(recording.meshes[frame], options, findings);
    const auto place = recording.vologram ? "frame " + std::to_string(frame) : recording.meshes[frame].string();
    Result<Mesh> mesh;
    if (is_draco) {
        const auto bytes = read_file(recording.meshes[frame]);
        if (!bytes) return tl::unexpected(bytes.error());
        mesh = read_drc(*bytes, options.reading, findings);
    } else {
        mesh = read_vologram_frame(*recording.vologram, frame, options.reading, findings);
    }
    if (!mesh) return fail_at(place, mesh.error());
    if (auto scaled = scale_positions(*mesh, options.millimetres_per_unit); !scaled)
        return fail_at(place, scaled.error());
    return mesh;
}

Result<SequenceFiles> find_frames(std::span<const std::string> names, const SequenceOptions& options) {
    if (names.size() != 1) return find_sequence(names, options);
    auto found = find_recording(names[0]);
    if (!found) return tl::unexpected(found.error());
    if (!*found) return find_sequence(names, options);
    SequenceFiles out;
    out.paths = (*found)->meshes;
    for (std::size_t k = 0; (*found)->vologram && k < frame_count(**found); ++k)
        out.paths.emplace_back(names[0] + " frame " + std::to_string(k));
    if (out.paths.empty()) return fail(ErrorKind::bad_input, names[0] + ": the recording has no frames");
    out.remarks = (*found)->remarks;
    out.recording = std::make_shared<const Recording>(std::move(**found));
    return out;
}

Result<Mesh> read_mesh_of(const SequenceFiles& frames, std::size_t place, const MeshFileOptions& options,
                          MeshFindings* findings) {
    if (frames.recording) return read_frame(*frames.recording, place, options, findings);
    return read_mesh(frames.paths[place], options, findings);
}

std::optional<LengthUnit> unit_of_frames(const SequenceFiles& frames, std::size_t place) {
    if (frames.recording && frames.recording->unit) return frames.recording->unit;
    return unit_of_format(frames.paths[place]);
}

}  // namespace htvm
