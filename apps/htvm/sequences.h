// Two sequences to compare: meshes one after the other, wherever they come from, and which decoded frame belongs to
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
    std::size_t frames = 0;              // 0: not known beforehand
    std::vector<std::uint64_t> numbers;  // of the frames, where the names carry them
    double millimetres_per_unit = 1;     // that the files' coordinates were taken for; known after the first frame
    // The next frame's mesh in mm, or nothing at the end.
    std::function<Result<std::optional<Mesh>>(MeshSource&)> next;
};

// An .htvm stream, decoded frame by frame, or the files that `name` means (io/sequence.h). unit, of files: mm, cm, m,
// or auto, which guesses from the first frame's size. limits: of what a stream may hold.
Result<MeshSource> open_meshes(const std::string& name, const std::string& unit, const DecoderOptions& limits = {});

// ---- Which belong together ------------------------------------------------------------------------------------------

// The last number in each name, where the names are the same but for it; else empty.
std::vector<std::uint64_t> numbers_in_names(std::span<const std::filesystem::path> paths);

struct FramePair {
    std::size_t original, decoded;  // places in their sequences
};

// Ascending numbers on both sides. A decoded number is that of an original, or its place in the sequence (as `htvm
// decode` counts, from 0), or counted on from the first pair: the first of the three readings that pairs the most.
// Frames without counterpart are left out. Pairs ascend on both sides.
std::vector<FramePair> pair_by_number(std::span<const std::uint64_t> original, std::span<const std::uint64_t> decoded);

// "frame 3", "frames 3, 5 to 9" of the places 0..count-1 that are not in `paired` (ascending), each by its number;
// empty where all are.
std::string frames_left_out(std::span<const std::uint64_t> numbers, std::span<const std::size_t> paired);

}  // namespace htvm::app
