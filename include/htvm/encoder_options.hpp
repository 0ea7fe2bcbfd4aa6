// What an encoder can be told: every option with its default and meaning. Their ranges, and what they are called
// elsewhere, are in one list (option_list.hpp, docs/options.md).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/intra_coder.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/threads.hpp"

namespace htvm {

// What the stream is for: which frames lie between the I-frames.
enum class Profile : std::uint8_t {
    tracked,   // the fewest bits: T-frames, the I-frame's mesh laid on each frame's surface
    topology,  // every frame's own connectivity: EP-frames, or I-frames where those cost less
    paper,     // the same by the published method's own choices
};

enum class ReferenceVertices : std::uint8_t {
    bone,  // the paper's: the nearest vertex of the same bone's predicted sub-mesh
    any,   // the nearest vertex of the whole predicted mesh
};

enum class BoneRegistration : std::uint8_t {
    point,  // the paper's: by distances from point to point
    plane,  // from point to plane
};

enum class FrameChoice : std::uint8_t {
    fixed,            // an I-frame every key_interval frames, EP-frames between
    motion,           // the paper's (section III-B): by skeletal motion since the last I-frame
    rate_distortion,  // by measured bits and errors: the fewest bits among those no worse than an I-frame
    cheaper,          // as fixed, but an I-frame wherever an EP-frame takes more bits
};

enum class TrackedReferences : std::uint8_t {
    intra,     // T-frames refer to the I-frame alone: any may be lost
    previous,  // to the frame before: fewer bits; a lost one costs those up to the next I-frame
};

// Profile::tracked alone: with others, anything but the defaults is refused.
struct TrackedOptions {
    TrackedReferences references = TrackedReferences::previous;
    double simplify = 0.4;    // how far the I-frames' meshes, which the T-frames take over, may be simplified: error of
                              // their surface, in geometry steps; 0: they keep every vertex and their connectivity
    double node_spacing = 0;  // mm, between the nodes of the deformation graph; 0: 80 on an adult, in proportion on
                              // larger and smaller subjects
};

// Profile::topology and Profile::paper alone, likewise.
struct TopologyOptions {
    FrameChoice frame_choice = FrameChoice::cheaper;  // Profile::paper: fixed
    double predicted_below = 400;  // mm, FrameChoice::motion: with less skeletal motion since the I-frame, a P-frame
    double intra_above = 0;        // mm, FrameChoice::motion: with more, an I-frame; 0: never
    double still_below = 0;        // mm, motion-based coding (section V): bones that moved less since the I-frame are
                                   // animated, not coded; 0: all are coded
    double animation_error = 2;  // mm: what is animated is coded after all where it is farther (root mean square, bone
                                 // by bone) from the capture's surface; 0: unchecked, as in the paper
    bool scene_changes = true;   // an I-frame where much of the mesh is nowhere near the reference's
    bool merge_duplicates = true;  // merge vertices that decode to the same, drop triangles that collapse
    int nearest_vertices = 16;     // m of the distance order, 1..64 (paper: 8, 16, 32)
    ReferenceVertices reference_vertices = ReferenceVertices::any;  // measured better than the paper's, see docs
    double weight_width = 30;  // mm, 0..1000: borders between bones blend over it; 0: rigid, as in the paper
    BoneRegistration registration = BoneRegistration::plane;
};

// Quality that follows from a rate or an error, instead of from the steps.
struct RateOptions {
    double bits_per_second = 0;  // > 0: the rate to keep to
    double buffer_seconds = 1;   // of the receiver, with bits_per_second: what a frame may come late against a constant
                                 // rate
    std::vector<FrameCost> first_pass;  // with bits_per_second: last_cost() of every frame of a first run over the same
                                        // capture; the quality then stays as even as the buffer allows
    double target_error = 0;  // mm (M2), > 0: the error that every frame comes near to; not with bits_per_second
};

struct EncoderOptions {
    Profile profile = Profile::tracked;
    double geometry_step = 2.0;  // mm, > 0: cell of the position quantiser; errors are about half of it
    double colour_step = 6.0;    // levels of 255, >= 1: cell of the colour quantiser
    double lambda = 0.12;        // squared error worth one bit, in units of step^2; 0 takes the nearest codeword
    int key_interval = 30;       // most frames from one I-frame to the next; 1: I-frames only
    int least_key_interval = 1;  // fewest, unless the frame cannot refer to the I-frame or the scene changes
    int lattice_bits = 0;        // decoded positions are multiples of 2^-lattice_bits mm; 0: 4, or finer if the step is
    double subject_size = 0;     // mm: the longest side of the subject, which reaches and thresholds are in proportion
                                 // to (all are known from adults, 1100 to 2500 mm); 0: told from the first mesh
    unsigned threads = 0;        // at work at once; 0: one per core; the bytes are the same for any number
    TaskRunner runner;           // gives the threads; none: a pool of the encoder's own
    std::uint32_t fps_numerator = 30, fps_denominator = 1;  // frames a second, for players
    std::uint32_t unit_micrometres = 1000;  // the capture's own unit, kept so that a decoder can give it back
    Skeleton skeleton;          // no bones: the capture has no skeleton, and one bone that spans the mesh serves
    std::vector<double> radii;  // mm, one per bone, from calibrate(); empty: calibrated on the first frame
    std::optional<ExternalIntraCoder> intra_coder;  // codes I-frames; none: TFAN
    TrackedOptions tracked;
    TopologyOptions topology;
    RateOptions rate;
};

// The options of a profile: EncoderOptions' own defaults, and for Profile::paper the paper's choices where they differ.
EncoderOptions default_options(Profile profile);

// The two steps of a quality knob, 0..100, that means about the same error whatever the capture, with T-frames or
// without (these and their I-frames take finer positions and coarser colours than said): positions step by
// 16 mm at 0, 2 mm at 50, 0.25 mm at 100 (halved every 16.7), colours by 32, 5.7 and 1 levels (halved every 20).
struct QualitySteps {
    double geometry_step, colour_step;
};
QualitySteps quality_steps(double quality);

}  // namespace htvm
