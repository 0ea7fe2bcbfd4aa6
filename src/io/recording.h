// Captures as other programs publish them: a folder with a manifest that says which meshes, images and times belong
// together, or one file with all frames in it. Recognised:
//
// - Scandy's SCVV: scvv_animation.json, which lists a mesh, an image and a delay for each frame;
// - Universal Volumetric, version 2: a manifest of path templates, with Draco or OBJ files for each frame and a video
// or
//   images; not version 1 (.uvol, .drcs: Corto), and no KTX2 textures;
// - the Geometry Sequence Player for Unity: sequence.json beside PLY files and DDS textures; not its compressed files;
// - Depthkit's textured geometry: its metadata beside meshes; not its combined-per-pixel videos, which hold no mesh;
// - Volograms: header.vols and sequence_0.vols, or one file (vologram.h), with the largest texture video beside them.
//
// Anything else is a sequence of files (sequence.h). Record3D's exported meshes are that; its .r3d files hold none.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "io/mesh_file.h"
#include "io/mesh_reading.h"
#include "io/sequence.h"
#include "io/timestamps.h"
#include "io/vologram.h"

namespace htvm {

struct Recording {
    std::string format;                          // for messages: "SCVV (Scandy)"
    std::vector<std::filesystem::path> meshes;   // one per frame, in order; empty if there is a vologram
    std::shared_ptr<const Vologram> vologram;    // nullptr: there is none
    std::vector<std::filesystem::path> images;   // one for all, or one per frame; empty: what the meshes name, if any
    std::optional<std::filesystem::path> video;  // whose pictures are those of the frames, instead of images
    std::optional<std::filesystem::path> sound;  // a file of its own
    std::vector<std::int64_t> microseconds;      // when each frame is; empty: by the rate
    FrameRate rate;                              // numerator 0: it is not said
    std::optional<LengthUnit> unit;              // where the format prescribes one
    std::string title;                           // empty: none
    std::string unread_texture;  // a clause: why its texture cannot be read, which is an error unless another is named
    std::vector<MeshRemark> remarks;
};

// The recording that a folder, a manifest or a file is; nothing if it is none of those that are known here. Errors:
// bad_input if it is damaged or its files are not there, unsupported if it is of a kind that is not read, with what to
// do instead. All names of files are looked for in the manifest's folder and those in it, nowhere else.
Result<std::optional<Recording>> find_recording(const std::filesystem::path& path);

// The frames that names refer to: of a recording, if one of these is named, else files (sequence.h). The paths of a
// recording that is one file are that file's, each with its frame's number, for messages.
Result<SequenceFiles> find_frames(std::span<const std::string> names, const SequenceOptions& options = {});

// The mesh of the frame at that place of the list, from the recording or its own file, as read_mesh does it.
Result<Mesh> read_mesh_of(const SequenceFiles& frames, std::size_t place, const MeshFileOptions& options = {},
                          MeshFindings* findings = nullptr);

// The unit that the frames' format prescribes; nothing if none does.
std::optional<LengthUnit> unit_of_frames(const SequenceFiles& frames, std::size_t place);

std::size_t frame_count(const Recording& recording);

// The mesh of a frame, scaled to millimetres as read_mesh does it. Errors as there.
Result<Mesh> read_frame(const Recording& recording, std::size_t frame, const MeshFileOptions& options = {},
                        MeshFindings* findings = nullptr);

}  // namespace htvm
