// Meshes from standard input, PLY after PLY, as a rig sends them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm::app {

struct PipedMesh {
    Mesh mesh;
    std::size_t place = 0;  // among all that came, dropped ones too
    std::string timestamp;  // as its header says; empty: it does not
    std::string fps;        // likewise: how many a second are to come
    MeshFindings findings;  // what was found besides
    // When it was there in whole; where the sender waits, not before it was asked for.
    std::chrono::steady_clock::time_point came{};
};

// What becomes of meshes that come while the caller is at work.
enum class WhileBusy : std::uint8_t {
    wait,     // one is read, then the sender waits
    read_on,  // a few are read, each at the time it comes; then the sender waits
    drop,     // a few are read, and of more the oldest are dropped
};

class MeshPipe {
public:
    explicit MeshPipe(WhileBusy while_busy);
    MeshPipe(MeshPipe&&) noexcept;
    ~MeshPipe();
    // The next mesh; nothing at the end, and where the program was interrupted. After an error there is no next one.
    Result<std::optional<PipedMesh>> next();
    std::size_t dropped() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace htvm::app
