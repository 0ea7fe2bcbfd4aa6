#include "codec/encoder/tracked/group_coder.h"

#include <bit>
#include <cmath>
#include <optional>

#include "codec/encoder/tracked/tracked_coders.h"
#include "codec/tracked/frame_group.h"

namespace htvm::internal {
namespace {

// How much finer than asked for the frames are that a group's others are predicted from, so that with steps a fifth
// coarser from level to level the whole has about the error asked for: see docs/experiments/groups.md.
double finer_anchor(int group) {
    constexpr double a_level = 1.2, levels = 3;
    return std::pow(a_level, -static_cast<double>(std::bit_width(static_cast<unsigned>(group - 1))) / levels);
}

class GroupCoder {
public:
    GroupCoder(const Configuration& configuration, const TrackedReference& reference, const TrackedState* before,
               std::span<const HeldFrame> held, std::vector<StageTime>& stages)
        : configuration_(configuration),
          reference_(*reference.decoded.by_nodes),
          detail_(&reference.decoded.detail),
          before_(before),
          held_(held),
          stages_(stages),
          coded(held.size()) {}

    Result<void> code(const GroupFrame& frame) {
        const auto& held = held_[frame.frame - 1];
        auto options = tracked_frame_options(configuration_, held.steps);
        options.noise = &held.noise;
        options.presence = held.presence;
        options.projection = held.projection;
        options.detail = detail_;
        std::optional<TrackedState> between;
        if (frame.later > 0) {
            between = state_between(
                reference_, {state_of(frame.earlier), state_of(frame.later), &state_of(frame.above)->head}, frame);
            const auto& head = between->head;
            constexpr double one = 256;
            options.geometry_step = LatticeUnits(head.displacement.step[0] / one);
            options.colour_step = head.colour.step[0] / one;
            options.motion = head.motion;
        } else {
            const double finer = finer_anchor(configuration_.options.tracked.group);
            options.geometry_step *= finer;
            options.colour_step *= finer;
        }
        auto encoded = encode_tracked_frame(held.mesh, *held.surface, reference_, held.registered,
                                            between ? &*between : before_, {}, options, stages_);
        if (!encoded) return tl::unexpected(encoded.error());
        coded[frame.frame - 1] = std::move(*encoded);
        return {};
    }

private:
    const TrackedState* state_of(std::size_t frame) const { return frame == 0 ? before_ : &coded[frame - 1].state; }

    const Configuration& configuration_;
    const NodeReference& reference_;
    const SurfaceDetail* detail_;
    const TrackedState* before_;
    std::span<const HeldFrame> held_;
    std::vector<StageTime>& stages_;

public:
    std::vector<EncodedTrackedFrame> coded;  // by frame, from the first
};

}  // namespace

Result<CodedGroup> code_group(const Configuration& configuration, const TrackedReference& reference,
                              const GroupAnchor* before, std::span<const HeldFrame> held,
                              std::vector<StageTime>& stages) {
    const std::size_t length = held.size();
    GroupCoder coder(configuration, reference, before ? &before->state : nullptr, held, stages);
    std::vector<CodedFrame> frames(length);
    for (std::size_t place = 1; place <= length; ++place) {
        auto& frame = frames[place - 1];
        std::vector<std::vector<std::uint8_t>> payloads;
        for (const auto& brought : brought_by(place, length)) {
            if (auto ok = coder.code(brought); !ok) return tl::unexpected(ok.error());
            auto& runs = coder.coded[brought.frame - 1].runs;
            frame.shares += runs.shares;
            payloads.push_back(std::move(runs.payload));
        }
        frame.type = FrameType::tracked;
        frame.packets.push_back(frame_packet(PacketKind::tracked, write_group_payload({length, place}, payloads)));
        frame.referred = is_needed(place, length);
        frame.access = place == 1 && !before;
        frame.reference = place > 1 ? held[needed_by(place, length) - 1].number
                          : before  ? before->frame
                                    : reference.decoded.number;
        frame.captured = counts_of(held[place - 1].mesh);
        frame.projection = held[place - 1].projection;
    }
    CodedGroup out;
    for (std::size_t i = 0; i < length; ++i) {
        auto& frame = frames[i];
        frame.decoded = std::move(coder.coded[i].mesh);
        FrameCost cost;
        cost.type = frame.type;
        cost.bits = 8.0 * static_cast<double>(frame.bytes());
        out.frames.push_back(
            outgoing(configuration, std::move(frame), &reference.decoded, held[i].number, held[i].timestamp_us, cost));
        out.frames.back().info.group = static_cast<std::uint8_t>(length);
        out.frames.back().info.place = static_cast<std::uint8_t>(i + 1);
    }
    out.anchor = {held.front().number, std::move(coder.coded.back().state)};
    return out;
}

}  // namespace htvm::internal
