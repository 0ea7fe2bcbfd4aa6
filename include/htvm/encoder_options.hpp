// The encoder's options, each with its default and meaning. Their ranges, and their names elsewhere, are in one list
// (option_list.hpp, docs/options.md). A stream made with the defaults is the one that `htvm encode` makes with its own.
//
// Threads and lifetimes. Plain values: copies are independent, but for a runner and a plugged-in coder, which copies
// share.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/intra_coder.hpp"
#include "htvm/scene.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/texture_layout.hpp"
#include "htvm/threads.hpp"

namespace htvm {

// The purpose of the stream: which frames come between the I-frames.
enum class Profile : std::uint8_t {
    tracked,   // the fewest bits: T-frames, where the I-frame's mesh is laid on each frame's surface
    topology,  // every frame keeps its own connectivity: EP-frames, or I-frames if they cost less
    paper,     // the same with the choices of the published method
};

enum class ReferenceVertices : std::uint8_t {
    bone,  // as in the paper: the nearest vertex of the same bone's predicted sub-mesh
    any,   // the nearest vertex of the whole predicted mesh
};

enum class BoneRegistration : std::uint8_t {
    point,  // as in the paper: by distances from point to point
    plane,  // by distances from point to plane
};

enum class FrameChoice : std::uint8_t {
    fixed,            // an I-frame every key_interval frames, EP-frames between
    motion,           // as in the paper (section III-B): by skeletal motion since the last I-frame
    rate_distortion,  // by measured bits and errors: the frame with the fewest bits among those no worse than an
                      // I-frame
    cheaper,          // like fixed, but an I-frame wherever an EP-frame takes more bits
};

enum class TrackedReferences : std::uint8_t {
    intra,     // T-frames refer to the I-frame alone, so any may be lost
    previous,  // T-frames refer to the previous frame: fewer bits, but a lost frame costs those up to the next one that
               // refers to the reference alone
};

// Whether the meshes that T-frames refer to are coded as a base mesh, subdivided, with detail as displacements. They
// take about half the bits, and a second or more of encoding each.
enum class ReferenceLevels : std::uint8_t {
    automatic,  // from effort 3 on, where surface does not come and go and meshes have no texture coordinates of their
                // own
    off,
    on,  // likewise, at any effort
};

// Whether surface comes and goes, as where depth cameras see a person from some sides: then frames say what is there.
enum class SurfacePresence : std::uint8_t {
    automatic,  // by the first mesh: if it has borders
    off,
    on,
};

enum class HoleFilling : std::uint8_t {
    off,        // what is not seen is not shown, but for noise at its rims
    automatic,  // holes that open for a moment, in what was seen around them, are filled by what is known
};

enum class Specks : std::uint8_t {
    keep,       // as captured
    automatic,  // small parts that hang on nothing are left out
};

enum class Denoising : std::uint8_t {
    off,        // T-frames follow the capture, noise and all
    automatic,  // they follow it without the noise that is measured, if any is: fewer bits, and nearer the true surface
};

// For Profile::tracked only; with other profiles, anything but the defaults is refused.
// What becomes of normals that meshes come with.
enum class CapturedNormals : std::uint8_t {
    automatic,  // left out with Profile::tracked, whose T-frames could not keep them: who shows a mesh computes them
    keep,       // coded, with the tracked profile in I-frames alone
    none,       // left out
};

struct TrackedOptions {
    int effort = 5;  // how much is searched for a frame, 1 to 9: less is faster; more takes longer and, from 6 on,
                     // fewer bits for the same error, as frames are then coded in groups, for files
    TrackedReferences references = TrackedReferences::previous;
    int access_interval = 30;  // with `previous`: largest distance, in frames, between places where decoding can start
                               // for whoever has the I-frame and its patches: T-frames that refer to nothing else
    int group = 0;  // T-frames coded in groups of up to so many, 1 to 8: the last first, the others between two each:
                    // fewer bits, but packets come up to so many frames late. 1: each behind the last. 0: by the
                    // effort, from 6 on more than 1, where groups may be
    double simplify = 0.4;     // how far the mesh of an I-frame, which T-frames take over, may be simplified: error of
                               // its surface in geometry steps; 0: it keeps all vertices and its connectivity
    double patch_share = 0.3;  // where tracking is lost, the largest share of the mesh that a patch may replace; where
                               // more is lost, an I-frame is sent; 0: always
    Denoising denoise = Denoising::automatic;  // with a target error always off: that is measured against the capture
    ReferenceLevels levels = ReferenceLevels::automatic;
    SurfacePresence presence = SurfacePresence::automatic;
    HoleFilling fill = HoleFilling::automatic;  // where surface comes and goes
    Specks specks = Specks::automatic;          // likewise
    double node_spacing = 0;  // mm between the nodes of the deformation graph; 0: 80 on an adult, in proportion to size
                              // on other subjects
};

// For Profile::topology and Profile::paper only; with Profile::tracked, anything but the defaults is refused.
struct TopologyOptions {
    FrameChoice frame_choice = FrameChoice::cheaper;  // in Profile::paper: fixed
    double predicted_below = 400;  // mm, for FrameChoice::motion: a P-frame if there was less skeletal motion since the
                                   // I-frame
    double intra_above = 0;        // mm, for FrameChoice::motion: an I-frame if there was more; 0: never
    double still_below = 0;        // mm, motion-based coding (section V): bones that moved less since the I-frame are
                                   // animated instead of coded; 0: all are coded
    double animation_error = 2;    // mm: a part that would be animated is coded after all if it is farther than this
                                   // (RMS, bone by bone) from the captured surface; 0: not checked, as in the paper
    bool scene_changes = true;     // an I-frame if much of the mesh is far from the reference's
    bool merge_duplicates = true;  // merge vertices that decode to the same values, drop triangles that collapse
    int nearest_vertices = 16;     // m of the distance order, 1..64 (paper: 8, 16, 32)
    ReferenceVertices reference_vertices = ReferenceVertices::any;  // measured to be better than the paper's, see
                                                                    // docs/published_method.md
    double weight_width = 30;  // mm, 0..1000: width over which bones blend at their borders; 0: rigid, as in the paper
    BoneRegistration registration = BoneRegistration::plane;
};

// Derives quality from a rate or an error instead of from the steps.
struct RateOptions {
    double bits_per_second = 0;  // > 0: the bitrate to keep
    double buffer_seconds = 1;   // with bits_per_second: the receiver's buffer, i.e. how late a frame may be relative
                                 // to a constant rate
    std::vector<FrameCost> first_pass;  // with bits_per_second: last_cost() of every frame of a first run over the same
                                        // capture; quality then varies as little as the buffer allows
    double target_error = 0;  // mm (M2), > 0: the error that every frame should have; not together with bits_per_second
};

inline constexpr double default_quality = 42;  // about 0.6 mm of surface error (M2)

struct EncoderOptions {
    Profile profile = Profile::tracked;
    double quality = default_quality;  // 0 to 100: the steps of positions and colours, see quality_steps(); higher is
                                       // finer. Under rate control it follows from the rate or the error instead
    double geometry_step = 0;  // mm: cell size of the position quantiser, about twice its errors; 0: by the quality
    double colour_step = 0;    // levels of 255, >= 1: cell size of the colour quantiser; 0: by the quality
    CapturedNormals normals = CapturedNormals::automatic;
    double lambda = 0.12;        // squared error that is worth one bit, in units of step^2; 0: always the nearest
                                 // codeword
    int key_interval = 300;      // largest distance between I-frames, in frames; 1: I-frames only. With EP-frames,
                                 // which drift from their I-frame, 30: see default_options()
    int least_key_interval = 1;  // smallest distance between I-frames, unless the frame cannot refer to the I-frame or
                                 // the scene changes
    int lattice_bits = 0;        // decoded positions are multiples of 2^-lattice_bits mm; 0: automatic, 4 or more if
                                 // the step needs it
    double subject_size = 0;     // mm: the longest side of the subject, to which reaches and thresholds are scaled
                                 // (they are tuned for adults, 1100 to 2500 mm); 0: measured on the first mesh
    unsigned threads = 0;        // that work at the same time; 0: one per core. The bytes are the same for any number
    TaskRunner runner;           // provides the threads; empty: the encoder has a pool of its own
    int latency_frames = 0;  // 0 to 2: a frame is coded once so many more are there, so that work of all goes side by
                             // side: 1 for two threads or more, 2 for more. The bytes are the same
    std::uint32_t fps_numerator = 30, fps_denominator = 1;  // frames per second, for players
    std::uint32_t unit_micrometres = 1000;  // the capture's own unit, kept so that a decoder can restore it
    // A live publisher sets it to a new random number each time it starts, so that viewers do not mistake its packets
    // for those of an earlier run. 0: none, for files that are the same each time. At most 2^53 - 1, which JSON can
    // hold.
    std::uint64_t session = 0;
    UpAxis up = UpAxis::unknown;          // the direction of the subject's head
    std::optional<double> floor;          // mm: the floor's coordinate on the axis that is up, which must be known
    std::vector<MetadataEntry> metadata;  // sent with every sequence header: keep it short in live streams
    GlobalShift global_shift{};           // mm: what the caller took off the capture's coordinates, kept for decoders
    Skeleton skeleton;          // without bones: the capture has no skeleton, and one bone that spans the mesh is used
    std::vector<double> radii;  // mm, one per bone, from calibrate(); empty: calibrated on the first frame
    std::optional<ExternalIntraCoder> intra_coder;  // codes I-frames; none: TFAN
    TrackedOptions tracked;
    TopologyOptions topology;
    RateOptions rate;
    // What the stream says of its pictures, which come beside the encoder's packets. With TextureLayout::charts, for
    // Profile::tracked only, meshes are pushed without texture coordinates and without the seams of any;
    // reconstruction() has coordinates of its own, and the vertices on its seams repeated. Colours then are not coded,
    // but tracking goes by them. With TextureLayout::projection, likewise for that profile, they are pushed with their
    // places in one camera's film as texture coordinates, from which the encoder finds how the camera saw each, and
    // which it refuses where no camera sees it so; those of places that are not known are below 0.
    StreamTexture texture;
};

// The default options of a profile: those of EncoderOptions for Profile::tracked. The others have an I-frame every 30
// frames, and Profile::paper the paper's choices where they differ.
EncoderOptions default_options(Profile profile);

// How many T-frames an encoder with these options codes as a group: TrackedOptions::group, or where that is 0, what
// goes with the effort.
int frames_in_group(const EncoderOptions& options);

// The two steps for a quality from 0 to 100 that means about the same error for every capture, with T-frames or without
// (T-frames and their I-frames use finer positions and coarser colours than this to have that error). Position steps
// are 16 mm at 0, 2 mm at 50, 0.25 mm at 100 (halved every 16.7); colour steps 32, 5.7 and 1 levels (halved every 20).
struct QualitySteps {
    double geometry_step, colour_step;
};
QualitySteps quality_steps(double quality);
// The steps of an encoder with these options: its own, or where they are 0, those of its quality.
QualitySteps quality_steps(const EncoderOptions& options);

}  // namespace htvm
