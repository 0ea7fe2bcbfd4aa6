// Meshes from standard input, PLY after PLY, as a rig sends them.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

struct PipedMesh {
    Mesh mesh;
    std::size_t place = 0;  // among all that came, dropped ones too
    std::string timestamp;  // as its header says; empty: it does not
    std::string texture;    // likewise: the image's name
};

class MeshPipe {
public:
    // drop_late: reads on while the caller is at work, and of more than a few meshes that wait drops the oldest. Else
    // the sender waits.
    explicit MeshPipe(bool drop_late);
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
