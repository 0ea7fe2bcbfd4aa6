// What is known of a synthetic capture and of no real one: where points that are fixed on the surface are in every
// frame, and when limbs are fast, touch something, come off it, or are hidden.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/thread.h"
#include "synth/synth.h"

namespace htvm {

// A point of the body or of a thing, by the part that it lies on and its place there.
struct SurfaceMark {
    std::size_t part = 0;  // of the scene (synth/scene.h)
    Vector3d rest{};       // mm: its place in the T-pose, or on the thing as it stands at the origin
};

// Points spread evenly over everything that the capture shows, in an order drawn from the seed.
std::vector<SurfaceMark> surface_marks(const SynthOptions& options, std::size_t count);

// "person", "other person", "chair" or "ball"; and "left hand" and so on for people, else the same again.
std::string figure_name(std::size_t part);
std::string part_name(std::size_t part);

// A hand or a foot in one frame.
struct LimbState {
    std::size_t part = 0;
    Vector3d centre{};  // mm
    double gap = 0;     // mm to the nearest part that it does not hang on, dressed surfaces excepted; negative: inside
    std::size_t nearest = 0;  // that part
    double seen = 1;          // how much of it is on the surface, 0 to 1
};

struct TrueFrame {
    std::vector<Vector3f> positions;  // mm, one for each mark; where it was last led to if it is not on the surface
    std::vector<Vector3f> normals;  // unit length; zero if the mark is not on the surface: covered, in a fold, or away
    std::vector<LimbState> limbs;   // of the people who are there
};

TrueFrame true_frame(const SynthOptions& options, std::span<const SurfaceMark> marks, int frame,
                     internal::Threads threads = {});

enum class LimbEventKind : std::uint8_t {
    fast,      // moves by at least fast_step in each of these frames
    touch,     // lies on another part
    release,   // has come off it: the frame before and the first one that it is off
    occluded,  // more than half of it is covered
};

std::string event_name(LimbEventKind kind);  // "fast" and so on

struct LimbEvent {
    LimbEventKind kind = LimbEventKind::fast;
    std::size_t part = 0, other = 0;  // the limb; touch and release: what it touches
    int first = 0, last = 0;          // frames
    double largest_step = 0;          // mm; fast: the longest way within one frame
};

inline constexpr double fast_speed = 6000;  // mm/s: 20 cm in a frame at 30 fps
inline constexpr double touch_gap = 8;      // mm; nearer ones grow together in the capture

// The events of consecutive frames, the first of which is number `first_frame`.
std::vector<LimbEvent> limb_events(std::span<const std::vector<LimbState>> frames, int first_frame, double fps);

}  // namespace htvm
