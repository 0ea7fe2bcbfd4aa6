// What comes and goes between frames: the area that appears and vanishes from one frame to the next, in a capture and
// in what is shown of it. Borders that flicker are seen as flicker; what only moves is not.
//
// Frames are held against each other as surfaces, whatever their vertices: what of this frame is absent in the frame
// before (counterpart.h) has appeared, and what of the frame before is absent in this one has vanished. So a surface
// that moves across itself changes nothing, but what moves along itself, past its border, appears on one side and
// vanishes on the other: a fast arm of an open sheet does. It does so in the capture as well; read the two side by
// side. Changes at a border that are smaller than the distance are not seen.
//
// Beside it: how much of a frame's area the frame before covers, motion and all. It says how far apart the frames of a
// capture are, which what is shown need not be nearer to it than.
#pragma once

#include <memory>
#include <optional>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/coverage.h"

namespace htvm {

// mm^2, of one frame since the one before, or sums over frames.
struct AreaChange {
    double area = 0;                    // of the frame
    double appeared = 0, vanished = 0;  // vanished: of the frame before
    double covered_before = 0;          // of the area: what the frame before covers
};
AreaChange& operator+=(AreaChange& sums, const AreaChange& more);
double changed_share(const AreaChange& change);         // appeared and vanished, over the area; may exceed 1
double covered_before_share(const AreaChange& change);  // 0..1

struct PresenceChange {
    AreaChange captured, shown;
};
PresenceChange& operator+=(PresenceChange& sums, const PresenceChange& more);

class PresenceMeter {
public:
    explicit PresenceMeter(CoverageOptions options = {});
    PresenceMeter(PresenceMeter&&) noexcept;
    PresenceMeter& operator=(PresenceMeter&&) noexcept;
    ~PresenceMeter();

    // The next frame; nothing for the first. Errors: bad_input if a mesh is not measurable, limit if memory
    // runs out.
    Result<std::optional<PresenceChange>> add(const Mesh& captured, const Mesh& shown);
    // The next frame does not follow the one before.
    void begin_anew();

private:
    struct Frame;
    CoverageOptions options_;
    std::unique_ptr<const Frame> before_;
};

}  // namespace htvm
