// The encoder: push a mesh and a pose a frame, pull packets.
//
//   auto encoder = htvm::Encoder::create(options);        // Result<Encoder>
//   encoder->push(mesh, &pose, timestamp_us);             // Result<void>
//   while (auto packet = encoder->pull()) send(htvm::write_packet(*packet));
//   encoder->finish();                                    // then pull the rest
//
// Memory is bounded by a few frames, whatever the sequence's length.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/intra_coder.hpp"
#include "htvm/mesh.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"

namespace htvm {

enum class ReferenceVertices : std::uint8_t {
    bone,  // the paper's: the nearest vertex of the same bone's predicted sub-mesh
    any,   // the nearest vertex of the whole predicted mesh
};

enum class FrameChoice : std::uint8_t {
    fixed,            // an I-frame every key_interval frames, EP-frames between
    motion,           // the paper's (section III-B): by skeletal motion since the last I-frame
    rate_distortion,  // by measured bits and errors: the fewest bits among those no worse than an I-frame
};

enum class TrackedReferences : std::uint8_t {
    intra,     // T-frames refer to the I-frame alone: any may be lost
    previous,  // to the frame before: fewer bits; a lost one costs those up to the next I-frame
};

struct EncoderOptions {
    double geometry_step = 2.0;  // mm, > 0: cell of the position quantiser; errors are about half of it
    double colour_step = 6.0;    // levels of 255, >= 1: cell of the colour quantiser
    double lambda = 0.12;        // EP: squared error worth one bit, in units of step^2; 0 takes the nearest codeword
    int key_interval = 30;       // most frames from one I-frame to the next; 1: I-frames only
    int least_key_interval = 1;  // fewest, unless the frame cannot refer to the I-frame or the scene changes
    bool scene_changes = true;   // an I-frame where much of the mesh is nowhere near the reference's
    FrameChoice frame_choice = FrameChoice::fixed;
    bool tracked = false;  // T-frames between I-frames, where they fit the capture: the I-frame's connectivity instead
                           // of the frame's own, for a fraction of the bits
    TrackedReferences tracked_references = TrackedReferences::previous;
    double simplify =
        0.4;  // tracked: how far the I-frames' meshes, which the T-frames take over, may be simplified: error
              // of their surface, in geometry steps; 0: they keep every vertex and their connectivity
    double node_spacing = 80;      // mm, T-frames: between the nodes of the deformation graph
    double predicted_below = 400;  // mm, choice by motion: with less skeletal motion since the I-frame, a P-frame
    double intra_above = 0;        // mm, choice by motion: with more, an I-frame; 0: never
    double still_below = 0;        // mm, motion-based coding (section V): bones that moved less since the I-frame are
                                   // animated, not coded; 0: all are coded
    double animation_error = 2;  // mm: what is animated is coded after all where it is farther (root mean square, bone
                                 // by bone) from the capture's surface; 0: unchecked, as in the paper
    double bits_per_second = 0;  // > 0: quality follows from it, instead of from the steps
    double buffer_seconds = 1;   // of the receiver: what a frame may come late against a constant rate
    std::vector<FrameCost> first_pass;  // with bits_per_second: last_cost() of every frame of a first run over the same
                                        // capture; the quality then stays as even as the buffer allows
    double target_error = 0;            // mm (M2), > 0: quality follows from it, instead of from the steps
    bool merge_duplicates = true;       // merge vertices that decode to the same, drop triangles that collapse
    int nearest_vertices = 16;          // m of the distance order, 1..64 (paper: 8, 16, 32)
    ReferenceVertices reference_vertices = ReferenceVertices::any;  // measured better than the paper's, see docs
    double weight_width = 30;    // mm, 0..1000: borders between bones blend over it; 0: rigid, as in the paper
    bool point_to_plane = true;  // register bones by distances to planes; false: to points, as in the paper
    int lattice_bits = 0;        // decoded positions are multiples of 2^-lattice_bits mm; 0: 4, or finer if the step is
    unsigned threads = 0;        // 0: one a core; the bytes are the same for any number
    std::uint32_t fps_numerator = 30, fps_denominator = 1;  // frames a second, for players
    std::uint32_t unit_micrometres = 1000;  // the capture's own unit, kept so that a decoder can give it back
    Skeleton skeleton;          // no bones: the capture has no skeleton, and one bone that spans the mesh serves
    std::vector<double> radii;  // mm, one a bone, from calibrate(); empty: calibrated on the first frame
    std::optional<ExternalIntraCoder> intra_coder;  // codes I-frames; none: TFAN
};

// The two steps of a quality knob, 0..100, that means about the same error whatever the capture, with T-frames or
// without (these and their I-frames take finer positions and coarser colours than said): positions step by
// 16 mm at 0, 2 mm at 50, 0.25 mm at 100 (halved every 16.7), colours by 32, 5.7 and 1 levels (halved every 20).
struct QualitySteps {
    double geometry_step, colour_step;
};
QualitySteps quality_steps(double quality);

struct CalibrationOptions {
    double percentile = 70;  // of the distances of a bone's vertices; the paper takes their maximum, 100, which one
                             // stray vertex can triple: 50 to 80 measured best, up to a third fewer bits
};
// Skinning calibration (paper, section IV-A, eq. 3): the radius r^i of each bone's cylinder, mm, from a mesh in T-pose
// and its skeleton. Bones to which no vertex projects get 0.
Result<std::vector<double>> calibrate(const Mesh& mesh, const Skeleton& skeleton, const Pose& pose,
                                      const CalibrationOptions& options = {});

// How long the stages of a frame took, milliseconds.
struct StageTime {
    const char* stage;
    double milliseconds;
};

class Encoder {
public:
    struct State;  // opaque
    // bad_input where an option is out of its range or contradicts another.
    static Result<Encoder> create(const EncoderOptions& options);
    Encoder(Encoder&&) noexcept;
    Encoder& operator=(Encoder&&) noexcept;
    ~Encoder();

    // Codes one frame. pose: of the options' skeleton; null where the tracker lost it, the last one is then kept.
    // Timestamps must ascend. After an error the frame is not part of the stream; the next may be pushed. Under rate
    // control a frame that the buffer cannot hold at the lowest quality is a limit error.
    Result<void> push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra = false);
    // Ends the sequence: queues the index of I-frames.
    void finish();
    // The next packet in stream order, or nothing until more is pushed.
    std::optional<Packet> pull();

    // Of the last frame pushed: what it is, what the decoder will show for it, and how long its stages took.
    const FrameInfo& last_frame() const;
    FrameCost last_cost() const;
    Mesh reconstruction() const;
    const std::vector<StageTime>& stage_times() const;
    // Of the last EP-frame: how often each distance order was coded, the escapes last (paper, Fig. 23).
    const std::vector<std::uint32_t>& distance_order_counts() const;

private:
    explicit Encoder(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
