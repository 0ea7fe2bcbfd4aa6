// Two sequences to compare: their meshes one after another, from whatever source, and which decoded frame belongs to
// which original, by the numbers in the names of their files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "htvm/decoder.hpp"
#include "htvm/frame.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "io/mesh_file.h"
#include "io/texture_file.h"
#include "io/timestamps.h"
#include "metrics/drift.h"

namespace htvm::app {

struct MeshSource {
    std::string name;
    std::size_t frames = 0;
    std::vector<std::uint64_t> numbers;  // of the frames, ascending; empty if the files' names have none
    std::vector<std::int64_t> times_us;  // of the frames, ascending; empty if they are known for none
    bool is_stream = false;
    std::vector<FrameType> kinds;       // of the frames of a stream
    FrameRate rate;                     // of a stream
    UpAxis up = UpAxis::unknown;        // of a stream that says so
    std::optional<Point3> front;        // likewise: the direction from the subject to who sees it from the front
    std::optional<SpaceBounds> bounds;  // mm, of all frames of a stream that says so
    double millimetres_per_unit = 1;    // the unit that files are in, or that a stream's capture was in
    bool guesses_unit = false;          // of files: from the first one that is read
    GlobalShift global_shift{};  // mm: off the capture's coordinates, of files what is taken off as they are read
    bool finds_shift = false;    // of files: from the first one that is read
    ShownVertices shown;         // of a stream: of the mesh that was read last
    // The mesh in mm of the frame at this position of the sequence, with its texture if it has one, and then with the
    // texture's colours at its vertices too. Positions must ascend from call to call.
    std::function<Result<TexturedMesh>(MeshSource&, std::size_t position)> mesh_at;
};

struct MeshSourceOptions {
    std::optional<LengthUnit> unit;         // of files; not given: guessed from the first one
    std::string timestamps;                 // of files: a file of times (io/timestamps.h); empty: as PLY files say
    DecoderOptions limits;                  // of streams
    TextureOptions texture;                 // of files
    std::vector<std::string> ignored = {};  // of files: as SequenceOptions has it
};

// An .htvm stream, or the files that the names refer to (io/sequence.h).
Result<MeshSource> open_meshes(const std::vector<std::string>& names, const MeshSourceOptions& options);

// ---- Which frames belong together -----------------------------------------------------------------------------------

struct FramePair {
    std::size_t original, decoded;  // positions in their sequences
};

// Numbers ascend on both sides. A decoded number may be that of an original, or its position in the sequence (`htvm
// decode` counts from 0), or count on from the first pair: of these three readings, the first that pairs the most
// frames is taken. Frames without a counterpart are left out. Pairs ascend on both sides.
std::vector<FramePair> pair_by_number(std::span<const std::uint64_t> original, std::span<const std::uint64_t> decoded);

// Times ascend on both sides, in microseconds: frames within half a millisecond of each other are pairs.
std::vector<FramePair> pair_by_time(std::span<const std::int64_t> original, std::span<const std::int64_t> decoded);

// The frames that originals are, from 0, by the numbers in their names, beside so many decoded ones. Where more were
// decoded, and as many as the numbers tell, the originals are some of those that were encoded, and each number is a
// frame; else as places_in_time() has it, of every tenth file as well.
std::vector<std::uint64_t> places_beside(const MeshSource& original, std::size_t decoded_frames);

// Pairs files on both sides: by time where both tell it, or where the decoded ones do, as htvm decode writes and
// numbers them, and are regular: then the originals' numbers give theirs, at the shortest interval of the decoded ones.
// By number where that pairs more.
std::vector<FramePair> pair_files(const MeshSource& original, const MeshSource& decoded);

// Whether frames that were left out while encoding would go unnoticed: fewer decoded files than originals, which count
// from 0 without a gap, as `htvm decode` numbers them, and tell no times.
bool may_be_out_of_step(const MeshSource& original, const MeshSource& decoded);

// "frame 3", "frames 3, 5 to 9": the positions 0..count-1 that are not in `paired` (ascending), each given by its
// number; empty if all are.
std::string frames_left_out(std::span<const std::uint64_t> numbers, std::span<const std::size_t> paired);

}  // namespace htvm::app
