// The one list of the encoder's options, and what users of the list derive from it: ranges, texts, names.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "core/edit_distance.h"
#include "htvm/option_list.hpp"

namespace htvm {
namespace {

constexpr std::array<const char*, 2> tracked_references = {"intra", "previous"};
constexpr std::array<const char*, 2> denoising = {"off", "auto"};
constexpr std::array<const char*, 2> hole_filling = {"off", "auto"};
constexpr std::array<const char*, 2> specks = {"keep", "auto"};
constexpr std::array<const char*, 3> reference_levels = {"auto", "off", "on"};
constexpr std::array<const char*, 3> surface_presence = {"auto", "off", "on"};
constexpr std::array<const char*, 3> captured_normals = {"auto", "keep", "none"};
constexpr std::array<const char*, 4> frame_choices = {"fixed", "motion", "rd", "cheaper"};
constexpr std::array<const char*, 7> up_axes = {"unknown", "x", "-x", "y", "-y", "z", "-z"};
constexpr std::array<const char*, 2> reference_vertices = {"bone", "any"};
constexpr std::array<const char*, 2> bone_registrations = {"point", "plane"};

// Within each group, the options that people need most come first.
constexpr Option list[] = {
    {.name = "quality",
     .group = OptionGroup::common,
     .kind = OptionKind::number,
     .least = 0,
     .most = 100,
     .meaning = "how fine positions and colours are: the steps of positions are 16 mm at 0, 2 mm at 50, 0.25 mm at "
                "100; of colours 32, 5.7 and 1 of 255 levels",
     .get = [](const EncoderOptions& o) -> double { return o.quality; },
     .set = [](EncoderOptions& o, double value) { o.quality = value; },
     .flag = "--quality"},
    {.name = "geometry_step",
     .group = OptionGroup::common,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 1.0 / 65536,
     .most = 1000,
     .zero = "by the quality",
     .meaning = "step of the positions; errors are about half of it",
     .get = [](const EncoderOptions& o) -> double { return o.geometry_step; },
     .set = [](EncoderOptions& o, double value) { o.geometry_step = value; },
     .flag = "--geometry-step"},
    {.name = "colour_step",
     .group = OptionGroup::common,
     .kind = OptionKind::number,
     .unit = "levels",
     .least = 1,
     .most = 255,
     .zero = "by the quality",
     .meaning = "step of the colours, of 255 levels",
     .get = [](const EncoderOptions& o) -> double { return o.colour_step; },
     .set = [](EncoderOptions& o, double value) { o.colour_step = value; },
     .flag = "--colour-step"},
    {.name = "normals",
     .group = OptionGroup::common,
     .kind = OptionKind::word,
     .meaning = "normals that meshes come with; auto: left out with the tracked profile, since its frames between "
                "I-frames could not keep them and players compute them, and kept by the others",
     .words = captured_normals,
     .get = [](const EncoderOptions& o) -> double { return static_cast<double>(o.normals); },
     .set = [](EncoderOptions& o, double value) { o.normals = static_cast<CapturedNormals>(value); },
     .flag = "--normals"},
    {.name = "lambda",
     .group = OptionGroup::common,
     .kind = OptionKind::number,
     .unit = "steps squared",
     .least = 0,
     .most = 1000,
     .zero = "the nearest codeword is taken",
     .meaning = "squared error that is worth one bit; more saves bits",
     .get = [](const EncoderOptions& o) -> double { return o.lambda; },
     .set = [](EncoderOptions& o, double value) { o.lambda = value; },
     .flag = "--lambda"},
    {.name = "key_interval",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .unit = "frames",
     .least = 1,
     .most = 1000000,
     .meaning = "largest number of frames from one I-frame to the next; 1: I-frames only",
     .get = [](const EncoderOptions& o) -> double { return o.key_interval; },
     .set = [](EncoderOptions& o, double value) { o.key_interval = static_cast<int>(value); },
     .flag = "--keyint"},
    {.name = "least_key_interval",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .unit = "frames",
     .least = 1,
     .most = 1000000,
     .meaning = "smallest number of frames from one I-frame to the next, unless the frame cannot refer to the I-frame "
                "or the scene changes",
     .get = [](const EncoderOptions& o) -> double { return o.least_key_interval; },
     .set = [](EncoderOptions& o, double value) { o.least_key_interval = static_cast<int>(value); },
     .flag = "--min-keyint"},
    {.name = "threads",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 1024,
     .zero = "one per core",
     .meaning = "threads that work at the same time; the bytes do not depend on it",
     .get = [](const EncoderOptions& o) -> double { return o.threads; },
     .set = [](EncoderOptions& o, double value) { o.threads = static_cast<unsigned>(value); },
     .flag = "--threads"},
    {.name = "latency_frames",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .unit = "frames",
     .least = 0,
     .most = 2,
     .meaning =
         "frames that wait, 0 to 2: a frame is coded once so many more are there, and work of all goes side by side on "
         "several threads; the bytes do not depend on it",
     .get = [](const EncoderOptions& o) -> double { return o.latency_frames; },
     .set = [](EncoderOptions& o, double value) { o.latency_frames = static_cast<int>(value); },
     .flag = "--latency-frames"},
    {.name = "subject_size",
     .group = OptionGroup::common,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 1,
     .most = 1e6,
     .zero = "measured on the first mesh",
     .meaning = "longest side of the subject, to which reaches, spacings and thresholds are scaled; they are tuned for "
                "adults, 1100 to 2500 mm",
     .get = [](const EncoderOptions& o) -> double { return o.subject_size; },
     .set = [](EncoderOptions& o, double value) { o.subject_size = value; },
     .flag = "--subject-size"},
    {.name = "lattice_bits",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .unit = "bits",
     .least = 1,
     .most = 16,
     .zero = "4, or more if the step needs it",
     .meaning = "decoded positions are multiples of 2^-bits mm",
     .get = [](const EncoderOptions& o) -> double { return o.lattice_bits; },
     .set = [](EncoderOptions& o, double value) { o.lattice_bits = static_cast<int>(value); }},
    {.name = "fps_numerator",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 4294967295,
     .meaning = "frames per second, for players and rate control, times fps_denominator",
     .get = [](const EncoderOptions& o) -> double { return o.fps_numerator; },
     .set = [](EncoderOptions& o, double value) { o.fps_numerator = static_cast<std::uint32_t>(value); }},
    {.name = "fps_denominator",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 4294967295,
     .meaning = "divisor of fps_numerator",
     .get = [](const EncoderOptions& o) -> double { return o.fps_denominator; },
     .set = [](EncoderOptions& o, double value) { o.fps_denominator = static_cast<std::uint32_t>(value); }},
    {.name = "unit_micrometres",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .unit = "micrometres",
     .least = 1,
     .most = 4294967295,
     .meaning = "the capture's own unit, kept so that a decoder can restore it; meshes are passed in mm in any case",
     .get = [](const EncoderOptions& o) -> double { return o.unit_micrometres; },
     .set = [](EncoderOptions& o, double value) { o.unit_micrometres = static_cast<std::uint32_t>(value); }},
    {.name = "session",
     .group = OptionGroup::common,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 9007199254740991,  // 2^53 - 1: what a double and JSON hold
     .zero = "none, which makes files that are the same each time",
     .meaning = "random number in the sequence header, new each time a live publisher starts, so that viewers do not "
                "mistake its packets for those of an earlier run",
     .get = [](const EncoderOptions& o) -> double { return static_cast<double>(o.session); },
     .set = [](EncoderOptions& o, double value) { o.session = static_cast<std::uint64_t>(value); },
     .flag = "--session"},
    {.name = "up",
     .group = OptionGroup::common,
     .kind = OptionKind::word,
     .meaning = "the direction of the subject's head, for players",
     .words = up_axes,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.up); },
     .set = [](EncoderOptions& o, double value) { o.up = static_cast<UpAxis>(value); }},

    {.name = "rate.bits_per_second",
     .group = OptionGroup::rate,
     .kind = OptionKind::number,
     .unit = "bit/s",
     .least = 1000,
     .most = 1e12,
     .zero = "none",
     .meaning = "rate that the stream keeps; quality follows from it, and of frames that do not fit the buffer even at "
                "the lowest quality only the motion is sent, or they are dropped",
     .get = [](const EncoderOptions& o) -> double { return o.rate.bits_per_second; },
     .set = [](EncoderOptions& o, double value) { o.rate.bits_per_second = value; },
     .flag = "--bitrate",
     .flag_unit = "Mbit/s",
     .flag_factor = 1e6},
    {.name = "rate.buffer_seconds",
     .group = OptionGroup::rate,
     .kind = OptionKind::number,
     .unit = "s",
     .least = 0.01,
     .most = 3600,
     .meaning = "length of the receiver's buffer for a stream with a bitrate, which is the delay that a live receiver "
                "needs; a short capture may exceed the bitrate by this much",
     .get = [](const EncoderOptions& o) -> double { return o.rate.buffer_seconds; },
     .set = [](EncoderOptions& o, double value) { o.rate.buffer_seconds = value; },
     .flag = "--buffer"},
    {.name = "rate.target_error",
     .group = OptionGroup::rate,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0.001,
     .most = 1000,
     .zero = "none",
     .meaning = "error that every frame should have, RMS distance between the surfaces (M2); if no quality reaches it, "
                "the nearest is taken, and T-frames may stay well above it",
     .get = [](const EncoderOptions& o) -> double { return o.rate.target_error; },
     .set = [](EncoderOptions& o, double value) { o.rate.target_error = value; },
     .flag = "--target-error"},

    {.name = "tracked.references",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning = "what T-frames refer to: the previous frame, or only the I-frame, so that any of them may be lost, for "
                "a few more bits",
     .words = tracked_references,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.references); },
     .set = [](EncoderOptions& o, double value) { o.tracked.references = static_cast<TrackedReferences>(value); },
     .flag = "--tracked-from"},
    {.name = "tracked.access_interval",
     .group = OptionGroup::tracked,
     .kind = OptionKind::whole_number,
     .unit = "frames",
     .least = 1,
     .most = 1000000,
     .meaning =
         "largest number of frames between places to start from, for seeking and for viewers that join: I-frames, "
         "and T-frames that refer to nothing but the I-frame and its patches",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.access_interval; },
     .set = [](EncoderOptions& o, double value) { o.tracked.access_interval = static_cast<int>(value); },
     .flag = "--access-interval"},
    {.name = "tracked.effort",
     .group = OptionGroup::tracked,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 9,
     .meaning = "how much is searched for a frame: less is faster; more takes longer and, from 6 on, fewer bits for "
                "the same error, as T-frames are then coded in groups, for files",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.effort; },
     .set = [](EncoderOptions& o, double value) { o.tracked.effort = static_cast<int>(value); },
     .flag = "--effort"},
    {.name = "tracked.group",
     .group = OptionGroup::tracked,
     .kind = OptionKind::whole_number,
     .unit = "frames",
     .least = 1,
     .most = 8,
     .zero = "by the effort: up to 5 each frame alone, at 6, 7, 8 and above groups of 2, 4 and 8, where groups may be; "
             "htvm "
             "encode takes 8 for files from effort 3 on",
     .meaning =
         "T-frames that are coded as a group, the last one first, the others from two around them each: fewer bits "
         "for files; packets come up to so many frames late, and encoding takes longer",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.group; },
     .set = [](EncoderOptions& o, double value) { o.tracked.group = static_cast<int>(value); },
     .flag = "--group"},
    {.name = "tracked.simplify",
     .group = OptionGroup::tracked,
     .kind = OptionKind::number,
     .unit = "geometry steps",
     .least = 0,
     .most = 10,
     .zero = "it keeps all vertices and its connectivity",
     .meaning = "how far the mesh of an I-frame, which T-frames take over, may be simplified: error of its surface",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.simplify; },
     .set = [](EncoderOptions& o, double value) { o.tracked.simplify = value; },
     .flag = "--simplify"},
    {.name = "tracked.patch_share",
     .group = OptionGroup::tracked,
     .kind = OptionKind::number,
     .unit = "of the surface",
     .least = 0,
     .most = 1,
     .zero = "always an I-frame",
     .meaning =
         "where tracking is lost, the largest share of the mesh that a patch may replace; where more is lost, an "
         "I-frame is sent",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.patch_share; },
     .set = [](EncoderOptions& o, double value) { o.tracked.patch_share = value; },
     .flag = "--patch-share"},
    {.name = "tracked.denoise",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning = "noise of the capture: auto, it is measured, and where there is any, T-frames leave it out, for fewer "
                "bits and a calmer picture; off, they follow it",
     .words = denoising,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.denoise); },
     .set = [](EncoderOptions& o, double value) { o.tracked.denoise = static_cast<Denoising>(value); },
     .flag = "--denoise"},
    {.name = "tracked.levels",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning =
         "the meshes that T-frames refer to as a base mesh, subdivided, with detail as displacements: about half the "
         "bits, for a second or more of encoding each; auto, from effort 3 on where that costs less, surface does not "
         "come and go, nobody watches live and meshes have no texture coordinates of their own; on, at any effort; "
         "off, all vertices are coded "
         "alike",
     .words = reference_levels,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.levels); },
     .set = [](EncoderOptions& o, double value) { o.tracked.levels = static_cast<ReferenceLevels>(value); },
     .flag = "--levels"},
    {.name = "tracked.presence",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning =
         "surface that comes and goes, as where depth cameras see a person from some sides: auto, frames say what "
         "is there if the first mesh has borders; on, they do; off, all of a reference is always there",
     .words = surface_presence,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.presence); },
     .set = [](EncoderOptions& o, double value) { o.tracked.presence = static_cast<SurfacePresence>(value); },
     .flag = "--presence"},
    {.name = "tracked.fill",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning =
         "where surface comes and goes, holes that open for a moment in what was seen around them: auto, they are "
         "filled by what is known; off, they are shown",
     .words = hole_filling,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.fill); },
     .set = [](EncoderOptions& o, double value) { o.tracked.fill = static_cast<HoleFilling>(value); },
     .flag = "--fill-holes"},
    {.name = "tracked.specks",
     .group = OptionGroup::tracked,
     .kind = OptionKind::word,
     .meaning =
         "where surface comes and goes, small parts that hang on nothing: auto, they are left out; keep, they are "
         "shown",
     .words = specks,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.tracked.specks); },
     .set = [](EncoderOptions& o, double value) { o.tracked.specks = static_cast<Specks>(value); },
     .flag = "--specks"},
    {.name = "tracked.node_spacing",
     .group = OptionGroup::tracked,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 1,
     .most = 10000,
     .zero = "80 on an adult, in proportion to size on other subjects",
     .meaning = "distance between the nodes that move the mesh",
     .get = [](const EncoderOptions& o) -> double { return o.tracked.node_spacing; },
     .set = [](EncoderOptions& o, double value) { o.tracked.node_spacing = value; },
     .flag = "--node-spacing"},

    {.name = "topology.frame_choice",
     .group = OptionGroup::topology,
     .kind = OptionKind::word,
     .meaning = "choice of frames: fixed, an I-frame every key interval and EP-frames between; motion, by how far the "
                "skeleton's bones are from the last I-frame; rd, by measured bits and errors (slow); cheaper, like "
                "fixed, but an I-frame wherever an EP-frame takes more bits",
     .words = frame_choices,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.topology.frame_choice); },
     .set = [](EncoderOptions& o, double value) { o.topology.frame_choice = static_cast<FrameChoice>(value); },
     .flag = "--decide"},
    {.name = "topology.predicted_below",
     .group = OptionGroup::topology,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0,
     .most = 1e6,
     .meaning = "choice by motion: frames whose bones moved less than this in total become P-frames (the I-frame's "
                "mesh, moved) if that fits the capture",
     .get = [](const EncoderOptions& o) -> double { return o.topology.predicted_below; },
     .set = [](EncoderOptions& o, double value) { o.topology.predicted_below = value; },
     .flag = "--predicted-below"},
    {.name = "topology.intra_above",
     .group = OptionGroup::topology,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0,
     .most = 1e6,
     .zero = "never",
     .meaning = "choice by motion: frames whose bones moved more than this in total become I-frames",
     .get = [](const EncoderOptions& o) -> double { return o.topology.intra_above; },
     .set = [](EncoderOptions& o, double value) { o.topology.intra_above = value; },
     .flag = "--intra-above"},
    {.name = "topology.still_below",
     .group = OptionGroup::topology,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0,
     .most = 1e6,
     .zero = "all are coded",
     .meaning = "motion-based coding: the sub-meshes of bones that moved less than this since the I-frame are "
                "animated, the others coded, and both zippered",
     .get = [](const EncoderOptions& o) -> double { return o.topology.still_below; },
     .set = [](EncoderOptions& o, double value) { o.topology.still_below = value; },
     .flag = "--still-below"},
    {.name = "topology.animation_error",
     .group = OptionGroup::topology,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0,
     .most = 1e6,
     .zero = "not checked, as in the paper",
     .meaning = "a part that would be animated is coded after all if it is farther than this from the captured surface "
                "(RMS, bone by bone)",
     .get = [](const EncoderOptions& o) -> double { return o.topology.animation_error; },
     .set = [](EncoderOptions& o, double value) { o.topology.animation_error = value; },
     .flag = "--animation-error"},
    {.name = "topology.scene_changes",
     .group = OptionGroup::topology,
     .kind = OptionKind::on_or_off,
     .meaning = "an I-frame if much of the mesh is far from the reference's",
     .get = [](const EncoderOptions& o) -> double { return o.topology.scene_changes; },
     .set = [](EncoderOptions& o, double value) { o.topology.scene_changes = value != 0; },
     .flag = "--no-scene-changes",
     .flag_off = true},
    {.name = "topology.merge_duplicates",
     .group = OptionGroup::topology,
     .kind = OptionKind::on_or_off,
     .meaning = "merging vertices that decode to the same point and attributes, and dropping triangles that collapse; "
                "without it the decoded triangle set is exactly the input's",
     .get = [](const EncoderOptions& o) -> double { return o.topology.merge_duplicates; },
     .set = [](EncoderOptions& o, double value) { o.topology.merge_duplicates = value != 0; },
     .flag = "--keep-duplicates",
     .flag_off = true},
    {.name = "topology.nearest_vertices",
     .group = OptionGroup::topology,
     .kind = OptionKind::whole_number,
     .least = 1,
     .most = 64,
     .meaning = "number of nearest vertices that the distance order covers",
     .get = [](const EncoderOptions& o) -> double { return o.topology.nearest_vertices; },
     .set = [](EncoderOptions& o, double value) { o.topology.nearest_vertices = static_cast<int>(value); },
     .flag = "--nearest"},
    {.name = "topology.reference_vertices",
     .group = OptionGroup::topology,
     .kind = OptionKind::word,
     .meaning = "reference vertex of a residual: any, the nearest of the predicted mesh, or bone, the nearest of the "
                "same bone",
     .words = reference_vertices,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.topology.reference_vertices); },
     .set = [](EncoderOptions& o,
               double value) { o.topology.reference_vertices = static_cast<ReferenceVertices>(value); },
     .flag = "--reference"},
    {.name = "topology.registration",
     .group = OptionGroup::topology,
     .kind = OptionKind::word,
     .meaning = "registration of the bones, by distances from point to plane, or from point to point",
     .words = bone_registrations,
     .get = [](const EncoderOptions& o) -> double { return static_cast<int>(o.topology.registration); },
     .set = [](EncoderOptions& o, double value) { o.topology.registration = static_cast<BoneRegistration>(value); },
     .flag = "--registration"},
    {.name = "topology.weight_width",
     .group = OptionGroup::topology,
     .kind = OptionKind::number,
     .unit = "mm",
     .least = 0,
     .most = 1000,
     .zero = "rigid, each vertex moves with one bone",
     .meaning = "width of the borders between bones, over which their motions blend",
     .get = [](const EncoderOptions& o) -> double { return o.topology.weight_width; },
     .set = [](EncoderOptions& o, double value) { o.topology.weight_width = value; },
     .flag = "--weights"},
};

// Whole numbers in full, small powers of two as powers, others as short as possible.
std::string number_text(double value) {
    int exponent = 0;
    if (value > 0 && value < 1e-3 && std::frexp(value, &exponent) == 0.5) return "2^" + std::to_string(exponent - 1);
    std::array<char, 32> text{};
    const bool whole = value == std::trunc(value) && std::abs(value) < 1e15;
    const auto end = whole ? std::to_chars(text.data(), text.data() + text.size(), static_cast<std::int64_t>(value))
                           : std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general);
    return {text.data(), end.ptr};
}

// Joins words as in "bone or any", "fixed, motion or rd".
std::string words_text(const Option& option) {
    std::string out;
    for (std::size_t w = 0; w < option.words.size(); ++w) {
        if (w > 0) out += w + 1 == option.words.size() ? " or " : ", ";
        out += option.words[w];
    }
    return out;
}

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

}  // namespace

EncoderOptions default_options(Profile profile) {
    EncoderOptions out;
    out.profile = profile;
    if (profile != Profile::tracked) out.key_interval = 30;
    if (profile != Profile::paper) return out;
    out.topology.frame_choice = FrameChoice::fixed;
    out.topology.reference_vertices = ReferenceVertices::bone;
    out.topology.registration = BoneRegistration::point;
    out.topology.weight_width = 0;
    return out;
}

QualitySteps quality_steps(double quality) {
    const double q = std::clamp(quality, 0.0, 100.0) / 100;
    return {16 * std::exp2(-6 * q), 32 * std::exp2(-5 * q)};
}

QualitySteps quality_steps(const EncoderOptions& options) {
    const auto usual = quality_steps(options.quality);
    return {options.geometry_step > 0 ? options.geometry_step : usual.geometry_step,
            options.colour_step > 0 ? options.colour_step : usual.colour_step};
}

std::span<const Option> option_list() { return list; }

const Option* find_option(std::string_view name) {
    const auto found = std::find_if(std::begin(list), std::end(list), [&](const Option& o) { return o.name == name; });
    return found == std::end(list) ? nullptr : &*found;
}

const Option& nearest_option(std::string_view name) {
    const auto shown = name.substr(0, 100);
    const auto distance = [&](const Option& option) {
        const std::string_view whole = option.name, flag = option.flag;
        const auto last = whole.substr(whole.find('.') + 1);
        auto out = std::min(internal::edit_distance(shown, whole), internal::edit_distance(shown, last));
        if (!flag.empty())
            out = std::min({out, internal::edit_distance(shown, flag), internal::edit_distance(shown, flag.substr(2))});
        return out;
    };
    return *std::min_element(std::begin(list), std::end(list),
                             [&](const Option& a, const Option& b) { return distance(a) < distance(b); });
}

Error no_such_option(std::string_view name) {
    return {ErrorKind::bad_input, "there is no option " + quoted(name.substr(0, 60)) + "; the nearest is " +
                                      quoted(nearest_option(name).name)};
}

Result<void> check_value(const Option& option, double value) {
    const bool number = option.kind == OptionKind::number;
    const double least = number || option.kind == OptionKind::whole_number ? option.least : 0;
    const double most = option.kind == OptionKind::word        ? static_cast<double>(option.words.size()) - 1
                        : option.kind == OptionKind::on_or_off ? 1
                                                               : option.most;
    const bool within = (value >= least && value <= most) || (value == 0 && *option.zero != '\0');
    if (within && (number || value == std::trunc(value))) return {};
    return fail(ErrorKind::bad_input,
                std::string(option.name) + " must be " + range_text(option) + ", not " + number_text(value));
}

Result<double> parse_value(const Option& option, std::string_view text) {
    const auto refused = [&] {
        return fail(ErrorKind::bad_input, std::string(option.name) + " must be " + range_text(option) + ", not " +
                                              quoted(text.substr(0, 60)));
    };
    if (option.kind == OptionKind::on_or_off) {
        if (text == "on") return 1.0;
        if (text == "off") return 0.0;
        return refused();
    }
    if (option.kind == OptionKind::word) {
        const auto word = std::find(option.words.begin(), option.words.end(), text);
        if (word == option.words.end()) {
            auto out = refused();
            if (const auto meant = internal::meant_word(text, option.words); !meant.empty())
                out.value().message += "; did you mean " + meant + "?";
            return out;
        }
        return static_cast<double>(word - option.words.begin());
    }
    double value = 0;
    const auto end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value);
    if (read.ec != std::errc{} || read.ptr != end || std::isnan(value)) return refused();
    if (auto fine = check_value(option, value); !fine) return tl::unexpected(fine.error());
    return value;
}

Result<void> set_option(EncoderOptions& options, std::string_view name, double value) {
    const auto* option = find_option(name);
    if (!option) return tl::unexpected(no_such_option(name));
    if (auto fine = check_value(*option, value); !fine) return fine;
    option->set(options, value);
    return {};
}

Result<void> set_option(EncoderOptions& options, std::string_view name, std::string_view text) {
    const auto* option = find_option(name);
    if (!option) return tl::unexpected(no_such_option(name));
    const auto value = parse_value(*option, text);
    if (!value) return tl::unexpected(value.error());
    option->set(options, *value);
    return {};
}

std::string value_text(const Option& option, double value) {
    if (option.kind == OptionKind::on_or_off) return value != 0 ? "on" : "off";
    if (option.kind != OptionKind::word) return number_text(value);
    const bool known = value >= 0 && value < static_cast<double>(option.words.size());
    return known ? option.words[static_cast<std::size_t>(value)] : number_text(value);
}

std::string range_text(const Option& option) {
    if (option.kind == OptionKind::on_or_off) return "on or off";
    if (option.kind == OptionKind::word) return words_text(option);
    std::string out = *option.zero && option.least > 0 ? "0, or " : "";
    out += number_text(option.least) + " to " + number_text(option.most);
    if (*option.unit) out += std::string(" ") + option.unit;
    return out;
}

std::string meaning_text(const Option& option) {
    return *option.zero ? std::string(option.meaning) + "; 0: " + option.zero : option.meaning;
}

bool serves(OptionGroup group, Profile profile) {
    if (group == OptionGroup::tracked) return profile == Profile::tracked;
    if (group == OptionGroup::topology) return profile != Profile::tracked;
    return true;
}

const char* group_name(OptionGroup group) {
    constexpr std::array<const char*, 4> names = {"common", "rate", "tracked", "topology"};
    return names[static_cast<std::size_t>(group)];
}

const char* profile_name(Profile profile) {
    constexpr std::array<const char*, 3> names = {"tracked", "topology", "paper"};
    return names[static_cast<std::size_t>(profile)];
}

}  // namespace htvm
