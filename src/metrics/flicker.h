// Flicker: how the pictures of a decoded sequence change from frame to frame, beside how those of the original change.
// Both frames of both sequences are drawn from the same cameras; what moved between them changes the pictures of both
// sequences alike, and what comes on top is the decoded sequence's own: a surface or texture that is another one in
// each frame, or jumps where a frame refers to no other.
//
// The ratio of the two changes takes the motion out as a scale: where much moves, a jump hides in it. So the change is
// also taken at still pixels alone, which both of the original's pictures cover and where they hardly differ, as
// measures of flicker in video do: what changes there in the decoded pictures is seen as flicker.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "core/thread.h"
#include "htvm/frame.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"
#include "metrics/render.h"

namespace htvm {

inline constexpr int still_levels = 8;

// Sums over views and frames, of one shading; several can be added up.
struct ChangeSums {
    std::uint64_t pixels = 0;        // covered in any of the four pictures
    std::uint64_t still_pixels = 0;  // of them: where no channel of the original differs by more than still_levels
    // Squared differences between the two frames, of red, green and blue, exact:
    std::uint64_t original = 0, decoded = 0;
    std::uint64_t decoded_still = 0;  // at still pixels
};
ChangeSums& operator+=(ChangeSums& sums, const ChangeSums& more);

// RMS over the pixels and channels, levels (0..255); 0 if there is no pixel.
double original_change(const ChangeSums& sums);
double decoded_change(const ChangeSums& sums);
double still_change(const ChangeSums& sums);  // of the decoded sequence, at still pixels

// The decoded sequence's change over the original's: 1 if they change alike. Infinity if only the decoded one changes;
// 1 if none does.
double flicker_ratio(const ChangeSums& sums);

// From the frame before to this one.
struct FrameFlicker {
    ChangeSums lit;    // as FlickerOptions::render says
    ChangeSums unlit;  // the colours alone; zero unless all four meshes have some
};

struct FlickerOptions {
    // Half the size of M3's pictures in each direction: a pixel is a sample of what its centre sees, so fewer of them
    // give the same mean.
    ViewOptions views{.width = 640, .height = 512};
    RenderOptions render;            // colours and textures are drawn only if all four meshes have some
    std::optional<Box> view_box;     // what the cameras look at; empty: the box around both frames of the original
    internal::Threads threads = {};  // their number does not change the results
};

class FlickerMeter {
public:
    explicit FlickerMeter(FlickerOptions options = {}) : options_(std::move(options)) {}

    // The next frame; nothing for the first. Fails (bad_input) if a mesh cannot be measured (check_measurable) or an
    // option is out of range.
    Result<std::optional<FrameFlicker>> add(TexturedMesh original, TexturedMesh decoded);
    // The next frame does not follow the one before.
    void begin_anew() { before_.reset(); }

private:
    struct Pair {
        TexturedMesh original, decoded;
    };
    FlickerOptions options_;
    std::unique_ptr<const Pair> before_;
};

// By how much a frame stands out from the T-frames beside it: its ratio (or still change) over the median of those of
// the nearest two T-frames before it and two behind it, none more than 6 frames away. One kind and one value for each
// frame of the sequence; a value that is not finite stands for a frame that has none. Nothing if the frame has none, or
// no T-frame is beside it.
std::optional<double> flicker_beside_tracked(std::span<const FrameType> kinds, std::span<const double> values,
                                             std::size_t frame);

}  // namespace htvm
