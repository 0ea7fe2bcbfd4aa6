#include "codec/format/frame_kinds.h"

namespace htvm {
namespace internal {

using enum Layer;

// Memory limits: about one and a half times what was measured on the worst meshes (tests/memory), in bytes per coded
// vertex and triangle, and per vertex and triangle of the reference.
constexpr std::array<FrameRules, frame_type_count> frame_rules = {{
    {.type = FrameType::intra,
     .packet = PacketKind::intra,
     .layers = {pose, geometry, colour, normals, texcoords, fans, external_intra, charts, presence, reason, levels,
                level_colours},
     .refers_to = RefersTo::nothing,
     .codebooks = false,
     .referred = true,
     .renews = true,
     .codes_mesh = true,
     .memory = {384, 368, 0, 0},
     .reference_work = 0,
     .rate = RateClass::intra},
    {.type = FrameType::enhanced,
     .packet = PacketKind::enhanced,
     .layers = {transforms, geometry, colour, normals, texcoords, mapping, fans, distance_orders, coded_bones},
     .refers_to = RefersTo::reference,
     .codebooks = true,
     .referred = false,
     .codes_mesh = true,
     .memory = {384, 320, 256, 96},
     .reference_work = 4,
     .rate = RateClass::between},
    {.type = FrameType::predicted,
     .packet = PacketKind::predicted,
     .layers = {transforms},
     .refers_to = RefersTo::reference,
     .codebooks = false,
     .referred = false,
     .codes_mesh = false,
     .memory = {0, 0, 224, 32},
     .reference_work = 1,
     .rate = RateClass::moved},
    {.type = FrameType::tracked,
     .packet = PacketKind::tracked,
     .layers = {transforms, geometry, colour, presence},
     .is_run = true,
     .refers_to = RefersTo::reference_or_before,
     .codebooks = false,
     .referred = true,
     .codes_mesh = false,
     .memory = {0, 0, 384, 192},
     .reference_work = 4,
     .rate = RateClass::between},
    {.type = FrameType::patched,
     .packet = PacketKind::patched,
     .layers = {pose, tracked, removed, border, fans, geometry, colour, charts, reason},
     .refers_to = RefersTo::reference,
     .codebooks = false,
     .referred = true,
     .renews = true,
     .codes_mesh = true,
     .memory = {384, 368, 768, 384},
     .reference_work = 16,
     .rate = RateClass::between},
}};

namespace {

// Rows are indexed by FrameType, and those of frame_reasons by FrameReason.
constexpr bool in_order() {
    for (std::size_t i = 0; i < frame_type_count; ++i)
        if (frame_kinds[i].type != static_cast<FrameType>(i) || frame_rules[i].type != static_cast<FrameType>(i))
            return false;
    for (std::size_t i = 0; i < frame_reasons.size(); ++i)
        if (frame_reasons[i].reason != static_cast<FrameReason>(i)) return false;
    return true;
}
static_assert(in_order());

}  // namespace

Result<void> check_default_limits(FrameType type, MeshCounts shown) {
    const auto& rules = rules_of(type);
    const auto reference = stands_alone(type) ? MeshCounts{} : shown;
    return check_limits(rules.memory, shown, reference, memory_of_reference(reference), DecoderOptions{});
}

}  // namespace internal

std::optional<FrameType> frame_type(PacketKind kind) {
    for (const auto& rules : internal::frame_rules)
        if (rules.packet == kind) return rules.type;
    return std::nullopt;
}

}  // namespace htvm
