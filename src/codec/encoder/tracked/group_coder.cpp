#include "codec/encoder/tracked/group_coder.h"

#include <bit>
#include <cmath>
#include <optional>

#include "codec/encoder/frame_coders.h"
#include "codec/tracked/frame_group.h"

namespace htvm::internal {
namespace {

// How much finer than asked for the frames are that a group's others are predicted from, so that with steps a fifth
// coarser from level to level the whole has about the error asked for: see docs/algorithm.md.
double finer_anchor(int group) {
    constexpr double a_level = 1.2, levels = 3;
    return std::pow(a_level, -static_cast<double>(std::bit_width(static_cast<unsigned>(group - 1))) / levels);
}

class GroupCoder {
public:
    GroupCoder(const Configuration& configuration, const ReferenceInUse& reference, const TrackedState* before,
               std::span<const HeldFrame> held, std::vector<StageTime>& stages)
        : configuration_(configuration),
          reference_(*reference.decoded.tracked),
          before_(before),
          held_(held),
          stages_(stages),
          coded(held.size()) {}

    Result<void> code(const GroupFrame& frame) {
        const auto& held = held_[frame.frame - 1];
        auto options = tracked_frame_options(configuration_, held.steps);
        options.noise = &held.noise;
        std::optional<TrackedState> between;
        if (frame.later > 0) {
            between = state_between(
                reference_, {state_of(frame.earlier), state_of(frame.later), &state_of(frame.above)->head}, frame);
            const auto& head = between->head;
            constexpr double one = 256;
            options.geometry_step = head.displacement.step[0] / one;
            options.colour_step = head.colour.step[0] / one;
            options.motion = head.motion;
        } else {
            const double finer = finer_anchor(configuration_.options.tracked.group);
            options.geometry_step *= finer;
            options.colour_step *= finer;
        }
        auto encoded = encode_tracked_frame(held.work.mesh, held.work.surface, reference_, held.work.registered,
                                            between ? &*between : before_, {}, options, stages_);
        if (!encoded) return tl::unexpected(encoded.error());
        coded[frame.frame - 1] = std::move(*encoded);
        return {};
    }

private:
    const TrackedState* state_of(std::size_t frame) const { return frame == 0 ? before_ : &coded[frame - 1].state; }

    const Configuration& configuration_;
    const TrackedReference& reference_;
    const TrackedState* before_;
    std::span<const HeldFrame> held_;
    std::vector<StageTime>& stages_;

public:
    std::vector<EncodedTrackedFrame> coded;  // by frame, from the first
};

}  // namespace

Result<CodedGroup> code_group(const Configuration& configuration, const ReferenceInUse& reference,
                              const GroupAnchor* before, std::span<const HeldFrame> held,
                              std::vector<StageTime>& stages) {
    using namespace packet_flag;
    const std::size_t length = held.size();
    GroupCoder coder(configuration, reference, before ? &before->state : nullptr, held, stages);
    CodedGroup out;
    for (std::size_t frame = 1; frame <= length; ++frame) {
        std::vector<std::vector<std::uint8_t>> payloads;
        GroupedFrame grouped;
        for (const auto& brought : brought_by(frame, length)) {
            if (auto ok = coder.code(brought); !ok) return tl::unexpected(ok.error());
            auto& runs = coder.coded[brought.frame - 1].runs;
            grouped.shares += runs.shares;
            payloads.push_back(std::move(runs.payload));
        }
        auto& packet = grouped.packet;
        packet.kind = PacketKind::tracked;
        packet.payload = write_group_payload({length, frame}, payloads);
        const bool alone = frame == 1 && !before;
        packet.flags = static_cast<std::uint8_t>(flags_valid | (is_needed(frame, length) ? referred : droppable) |
                                                 (alone ? access : 0));
        packet.frame = held[frame - 1].number;
        packet.reference = frame > 1 ? held[needed_by(frame, length) - 1].number
                           : before  ? before->frame
                                     : reference.decoded.number;
        packet.timestamp_us = held[frame - 1].timestamp_us;
        out.frames.push_back(std::move(grouped));
    }
    for (std::size_t i = 0; i < length; ++i) out.frames[i].decoded = std::move(coder.coded[i].mesh);
    out.anchor = {held.front().number, std::move(coder.coded.back().state)};
    return out;
}

}  // namespace htvm::internal
