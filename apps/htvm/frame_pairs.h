// Which decoded frame belongs to which original, by the numbers in the names of their files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace htvm::app {

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
