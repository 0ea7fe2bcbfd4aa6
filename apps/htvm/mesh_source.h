// Meshes one after the other, wherever they come from.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
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

}  // namespace htvm::app
