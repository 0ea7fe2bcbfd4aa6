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

#include "htvm/decoder.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

struct MeshSource {
    std::string name;
    std::size_t frames = 0;              // 0: not known in advance
    std::vector<std::uint64_t> numbers;  // the numbers of the frames, if their names contain any
    double millimetres_per_unit = 1;     // the unit that was assumed for the files; known after the first frame
    // The next frame's mesh in mm; nothing at the end.
    std::function<Result<std::optional<Mesh>>(MeshSource&)> next;
};

// An .htvm stream, decoded frame by frame, or the files that `name` refers to (io/sequence.h). unit, for files: mm, cm,
// m, or auto, which guesses from the size of the first frame. limits: for streams.
Result<MeshSource> open_meshes(const std::string& name, const std::string& unit, const DecoderOptions& limits = {});

// ---- Which frames belong together -----------------------------------------------------------------------------------

struct FramePair {
    std::size_t original, decoded;  // positions in their sequences
};

// Numbers ascend on both sides. A decoded number may be that of an original, or its position in the sequence (`htvm
// decode` counts from 0), or count on from the first pair: of these three readings, the first that pairs the most
// frames is taken. Frames without a counterpart are left out. Pairs ascend on both sides.
std::vector<FramePair> pair_by_number(std::span<const std::uint64_t> original, std::span<const std::uint64_t> decoded);

// "frame 3", "frames 3, 5 to 9": the positions 0..count-1 that are not in `paired` (ascending), each given by its
// number; empty if all are.
std::string frames_left_out(std::span<const std::uint64_t> numbers, std::span<const std::size_t> paired);

}  // namespace htvm::app
