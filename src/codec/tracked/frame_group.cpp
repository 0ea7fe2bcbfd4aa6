#include "codec/tracked/frame_group.h"

#include <algorithm>
#include <string>

#include "codec/tracked/presence.h"
#include "core/bytes.h"
#include "core/lattice.h"

namespace htvm::internal {

std::vector<GroupFrame> path_to(std::size_t frame, std::size_t length) {
    std::vector<GroupFrame> out{{.frame = length}};
    for (std::size_t earlier = 0, later = length; out.back().frame != frame;) {
        const std::size_t middle = (earlier + later) / 2;
        out.push_back({middle, earlier, later, out.back().frame, out.size()});
        (frame <= middle ? later : earlier) = middle;
    }
    return out;
}

// A frame between `earlier` and others is first needed right behind `earlier`.
std::vector<GroupFrame> brought_by(std::size_t frame, std::size_t length) {
    auto out = path_to(frame, length);
    std::erase_if(out, [&](const GroupFrame& needed) { return needed.earlier + 1 != frame; });
    return out;
}

std::size_t needed_by(std::size_t frame, std::size_t length) {
    std::size_t out = 0;
    for (const auto& needed : path_to(frame, length))
        if (needed.earlier + 1 < frame) out = needed.earlier + 1;
    return out;
}

bool is_needed(std::size_t frame, std::size_t length) {
    if (frame == 1) return true;
    for (std::size_t behind = frame + 1; behind <= length; ++behind)
        if (needed_by(behind, length) == frame) return true;
    return false;
}

// ---- The payload ----------------------------------------------------------------------------------------------------

namespace {

constexpr unsigned length_bits = 3;

tl::unexpected<Error> corrupt(const std::string& what) {
    return fail(ErrorKind::corrupt_stream, "tracked frame: " + what);
}

}  // namespace

std::vector<std::uint8_t> write_group_payload(GroupPlace place, std::span<const std::vector<std::uint8_t>> frames) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>((place.length - 1) | (place.frame - 1) << length_bits));
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) out.varint(frames[i].size());
    for (const auto& frame : frames) out.bytes(frame);
    return out.take();
}

Result<GroupPlace> read_group_place(std::span<const std::uint8_t> payload) {
    if (payload.empty()) return corrupt("it does not say which of its group it is");
    const std::size_t length = (payload[0] & 7u) + 1, frame = (payload[0] >> length_bits) + 1u;
    if (frame > length)
        return corrupt("it is said to be frame " + std::to_string(frame) + " of a group of " + std::to_string(length));
    return GroupPlace{length, frame};
}

Result<GroupPayload> read_group_payload(std::span<const std::uint8_t> payload) {
    const auto place = read_group_place(payload);
    if (!place) return tl::unexpected(place.error());
    GroupPayload out{*place, {}};
    out.frames.resize(brought_by(place->frame, place->length).size());
    ByteReader reader(payload.subspan(1));
    std::vector<std::uint64_t> sizes;
    for (std::size_t i = 0; i + 1 < out.frames.size(); ++i) sizes.push_back(reader.varint());
    for (std::size_t i = 0; i < sizes.size() && reader.ok(); ++i) {
        if (sizes[i] > reader.remaining()) return corrupt("a hidden frame is longer than the packet");
        out.frames[i] = reader.bytes(static_cast<std::size_t>(sizes[i]));
    }
    if (!reader.ok()) return corrupt("the sizes of the hidden frames are cut short");
    if (!out.frames.empty())
        out.frames.back() = reader.bytes(reader.remaining());
    else if (reader.remaining() > 0)
        return corrupt("it brings a frame that an earlier packet of its group brought");
    return out;
}

// ---- Between two frames ---------------------------------------------------------------------------------------------

std::uint32_t coarser_step(std::uint32_t step) {
    return static_cast<std::uint32_t>(
        std::min<std::int64_t>(divide_rounded(6 * std::int64_t{step}, 5), FieldSteps::most));
}

namespace {

// Weighted by how near each is: one by how far the other is away.
struct Mean {
    std::int64_t earlier = 1, later = 1;
    std::int64_t of(std::int64_t a, std::int64_t b) const {
        return divide_rounded(earlier * a + later * b, earlier + later);
    }
};

// In the middle of both, where most frames are, there is nothing to divide.
template <class Value>
std::vector<Value> mean_of(const Mean& mean, std::span<const Value> a, std::span<const Value> b) {
    std::vector<Value> out(b.size());
    if (mean.earlier == mean.later) {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const std::int64_t sum = std::int64_t{a[i]} + b[i];
            out[i] = static_cast<Value>((sum + (sum >= 0 ? 1 : 0)) >> 1);
        }
        return out;
    }
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<Value>(mean.of(a[i], b[i]));
    return out;
}

template <class Value>
std::vector<std::vector<Value>> mean_of(const Mean& mean, const std::vector<std::vector<Value>>* a,
                                        const std::vector<std::vector<Value>>& b) {
    std::vector<std::vector<Value>> out;
    out.reserve(b.size());
    for (std::size_t k = 0; k < b.size(); ++k) {
        const std::vector<Value> none(a ? 0 : b[k].size());
        out.push_back(mean_of<Value>(mean, a ? (*a)[k] : none, b[k]));
    }
    return out;
}

FieldHistory mean_of(const Mean& mean, const FieldHistory* a, const FieldHistory& b) {
    FieldHistory out;
    out.turned = b.turned;
    for (std::size_t c = 0; c < b.planes.size(); ++c) {
        const auto* before = a ? &a->planes[c] : nullptr;
        const auto& behind = b.planes[c];
        out.planes.push_back({mean_of(mean, before ? &before->mean : nullptr, behind.mean),
                              mean_of(mean, before ? &before->slope : nullptr, behind.slope),
                              mean_of(mean, before ? &before->magnitude : nullptr, behind.magnitude)});
    }
    return out;
}

LatticePoint mean_of(const Mean& mean, LatticePoint a, LatticePoint b) {
    const auto of = [&](std::int32_t x, std::int32_t y) { return static_cast<std::int32_t>(mean.of(x, y)); };
    return {of(a.x, b.x), of(a.y, b.y), of(a.z, b.z)};
}

// The mean of two turns; where their largest components differ, the turn of the nearer frame.
QuantisedRotation mean_of(const Mean& mean, const QuantisedRotation& a, const QuantisedRotation& b) {
    if (a.largest != b.largest) return mean.earlier >= mean.later ? a : b;
    QuantisedRotation out = a;
    for (std::size_t c = 0; c < 3; ++c) out.others[c] = static_cast<std::int16_t>(mean.of(a.others[c], b.others[c]));
    return out;
}

FieldSteps coarser(FieldSteps steps) {
    for (auto& step : steps.step) step = coarser_step(step);
    return steps;
}

}  // namespace

TrackedState state_between(const NodeReference& reference, const FramesAround& around, const GroupFrame& frame) {
    const Mean mean{static_cast<std::int64_t>(frame.later - frame.frame),
                    static_cast<std::int64_t>(frame.frame - frame.earlier)};
    const auto* earlier = around.earlier;
    const auto& later = *around.later;
    const auto captured = earlier ? earlier->head.captured : reference.captured;
    const auto count = [&](std::uint32_t a, std::uint32_t b) { return static_cast<std::uint32_t>(mean.of(a, b)); };
    TrackedState out;
    if (reference.has_presence)
        out.presence = presence_between(earlier ? earlier->presence : reference.presence, later.presence);
    out.head.captured = {count(captured.vertices, later.head.captured.vertices),
                         count(captured.triangles, later.head.captured.triangles)};
    if (reference.projection) out.head.projection = earlier ? earlier->head.projection : *reference.projection;
    out.head.motion = around.above->motion;
    out.head.displacement = coarser(around.above->displacement);
    out.head.colour = coarser(around.above->colour);
    out.transforms.resize(later.transforms.size());
    for (std::size_t node = 0; node < out.transforms.size(); ++node) {
        const auto a = earlier ? earlier->transforms[node] : QuantisedTransform{};
        const auto& b = later.transforms[node];
        out.transforms[node] = {mean_of(mean, a.rotation, b.rotation), mean_of(mean, a.shift, b.shift)};
    }
    out.displacement = mean_of(mean, earlier ? &earlier->displacement : nullptr, later.displacement);
    out.colour = mean_of(mean, earlier ? &earlier->colour : nullptr, later.colour);
    return out;
}

}  // namespace htvm::internal
