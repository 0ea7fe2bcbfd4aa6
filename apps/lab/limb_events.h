// Whether a decoded stream follows the hands and feet of a synthetic capture through what they do: fast moves, touches,
// releases, occlusions (synth/truth.h).
//
// A limb is *right* in a frame if 95 % of it is within 10 mm, in both directions: of the marks on the limb that the
// capture shows, from the decoded surface; and of the decoded vertices that lay on the limb when the mesh's triangles
// were new, from the true surface. The first alone would be content with a limb that is covered by another part of the
// mesh while its own is left behind.
//
// An event is judged over its frames and the five behind:
//   followed  the limb is right in each, by T-frames, or by an I-frame that is made of the tracked mesh
//   patched   a TP-frame replaced at least 5 % of what is shown of it, and it is right from the last such frame on
//   I-frame   an I-frame of the capture came, and it is right from then on
//   lost      it is wrong in a frame, and not mended behind that
//   hidden    the capture shows too little of it in each frame to tell; such events are not counted
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "htvm/result.hpp"
#include "synth/truth.h"
#include "synthetic_stream.h"

namespace htvm::lab {

struct LimbRule {
    double near_mm = 10;            // how far the surfaces may be apart where a limb is right
    double least_share = 0.95;      // of a limb: how much of it must be that near
    double shown_mm = 5;            // a mark farther from the captured mesh is not shown by it
    std::size_t fewest_marks = 10;  // a limb of which fewer are shown is hidden
    double least_patched = 0.05;    // share of the marks shown that a patch of the limb replaces
    int frames_after = 5;           // behind an event that are judged with it
};

struct LimbInFrame {
    std::size_t part = 0;  // of the scene
    bool hidden = false;
    double right = 1;    // share, of the worse direction
    double renewed = 0;  // TP: share of the marks shown that lie on the patch
};

struct FrameOfLimbs {
    int number = 0;
    FrameType type = FrameType::tracked;
    bool renewal = false;  // SyntheticFrame::renewal
    std::vector<LimbInFrame> limbs;
};

class LimbMeter {
public:
    // marks: those of the stream, whatever they are on; limbs without marks are not measured.
    LimbMeter(std::vector<SurfaceMark> marks, const LimbRule& rule = {}) : marks_(std::move(marks)), rule_(rule) {}
    // The next frame.
    Result<FrameOfLimbs> add(const SyntheticFrame& frame);

private:
    std::vector<SurfaceMark> marks_;
    LimbRule rule_;
    std::uint32_t topology_ = 0;
    std::map<std::size_t, std::vector<std::uint32_t>> vertices_;  // of the decoded mesh, by limb
};

enum class LimbOutcome : std::uint8_t { followed, patched, intra, lost, hidden };
inline constexpr std::array<const char*, 5> limb_outcomes = {"followed", "patched", "I-frame", "lost", "hidden"};

struct JudgedEvent {
    LimbEvent event;
    LimbOutcome outcome = LimbOutcome::followed;
    double least_right = 1;  // the smallest share
    int worst_frame = 0;     // where
};

// frames: consecutive. The first one begins the stream: no I-frame that anything was lost for.
std::vector<JudgedEvent> judge_events(std::span<const LimbEvent> events, std::span<const FrameOfLimbs> frames,
                                      const LimbRule& rule = {});

struct OutcomeCounts {
    std::array<std::size_t, limb_outcomes.size()> of{};
    std::size_t operator[](LimbOutcome outcome) const { return of[static_cast<std::size_t>(outcome)]; }
    std::size_t counted() const;    // all but the hidden
    double followed_share() const;  // of those; 1 if there are none
};
void add(OutcomeCounts& counts, const JudgedEvent& event);

}  // namespace htvm::lab
