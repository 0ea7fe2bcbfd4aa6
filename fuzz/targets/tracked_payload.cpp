// The payload of T-frames on any mesh: heads come back; frames after frames of any bytes give meshes on the lattice, or
// an error; so do the parts of a group's packet, and frames between two others.
#include "codec/tracked/tracked_payload.h"

#include <cstdlib>

#include "codec/tracked/frame_group.h"
#include "codec/tracked/tracked_frame.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

std::uint32_t any_count(fuzz::FuzzInput& input) { return input.u32() >> (1 + input.below(31)); }

FieldSteps any_steps(fuzz::FuzzInput& input, std::size_t components, bool turned) {
    FieldSteps out;
    out.turned = turned;
    for (std::size_t c = 0; c < components; ++c)
        out.step[c] = std::min(input.u32() >> input.below(32), FieldSteps::most);
    return out;
}

void check_head(const KnownOfHead& known, fuzz::FuzzInput& input) {
    TrackedHead head;
    if (known.before && input.flag()) head = *known.before;
    if (input.flag()) head.captured = {any_count(input), any_count(input)};
    if (input.flag()) head.motion = {static_cast<int>(input.below(11)), static_cast<int>(input.below(21))};
    if (input.flag()) head.displacement = any_steps(input, 1, false);
    if (known.colours && input.flag())
        head.colour = any_steps(input, 3, known.before ? known.before->colour.turned : input.flag());
    if (known.before) head.colour.turned = known.before->colour.turned;
    if (known.projection) {
        head.projection = known.before ? known.before->projection : *known.projection;
        if (input.flag())
            for (auto& c : head.projection.rows) c = static_cast<float>(static_cast<std::int32_t>(input.u32()));
    }
    head.colour_run = known.colours && input.flag() ? any_count(input) : 0;
    RangeEncoder encoder;
    write_tracked_head(encoder, head, known);
    const auto position = encoder.position();
    const auto bytes = encoder.finish();
    RangeDecoder decoder(bytes);
    const auto again = read_tracked_head(decoder, known);
    require(again && *again == head, "a head comes back");
    require(decoder.position() == position, "both sides say where it ends");
}

void check_group(std::span<const std::uint8_t> bytes) {
    const auto payload = read_group_payload(bytes);
    if (!payload) return;
    require(payload->frames.size() == brought_by(payload->place.frame, payload->place.length).size(),
            "as many frames as it brings");
    std::vector<std::vector<std::uint8_t>> frames;
    for (const auto& frame : payload->frames) frames.emplace_back(frame.begin(), frame.end());
    const auto again = write_group_payload(payload->place, frames);
    const auto read = read_group_payload(again);
    require(read && read->frames.size() == frames.size(), "a group's payload comes back");
    for (std::size_t i = 0; i < frames.size(); ++i)
        require(std::equal(frames[i].begin(), frames[i].end(), read->frames[i].begin(), read->frames[i].end()),
                "and so do its frames");
}

// The first frame of a group of two, between the reference and its last.
void check_between(const NodeReference& reference, const TrackedState& last, std::span<const std::uint8_t> payload) {
    const auto state = state_between(reference, {nullptr, &last, &last.head}, path_to(1, 2).back());
    DecodedTrackedFrame between;
    if (!decode_tracked_frame(payload, reference, &state, {}, between)) return;
    require(fuzz::all_on_lattice(between.positions), "positions between are on the lattice");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto small = fuzz::small_mesh(input);
    LatticeMesh mesh;
    mesh.positions = small.positions;
    mesh.triangles = small.triangles;
    if (input.flag()) mesh.colours.resize(mesh.positions.size());
    if (input.flag()) mesh.normals.resize(mesh.positions.size());
    auto reference = make_node_reference(mesh, 1 + static_cast<std::int32_t>(input.below(2000)), 16);
    require(reference.has_value(), "any mesh can be a reference");
    reference->captured = {any_count(input), any_count(input)};
    if (reference->captured.triangles % 2 == 1) {
        reference->has_presence = true;
        reference->around = vertices_around(mesh.positions.size(), mesh.triangles);
        if (reference->captured.vertices % 2 == 1) reference->presence.resize(mesh.positions.size());
    }
    if (reference->captured.triangles % 3 == 1) {
        reference->projection.emplace();
        for (auto& c : reference->projection->rows) c = static_cast<float>(static_cast<std::int32_t>(input.u32()));
    }
    DecodedTrackedFrame last, next;
    const TrackedState* before = nullptr;
    for (int frame = 0; frame < 4; ++frame) {
        check_head({before ? &before->head : nullptr, reference->captured, !mesh.colours.empty(),
                    reference->projection ? &*reference->projection : nullptr},
                   input);
        const auto payload = frame < 3 ? input.take(input.u16() % 512) : input.rest();
        check_group(payload);
        if (before) check_between(*reference, *before, payload);
        if (!decode_tracked_frame(payload, *reference, before, {}, next)) continue;
        require(next.positions.size() == mesh.positions.size() && next.colours.size() == mesh.colours.size() &&
                    next.normals.size() == mesh.normals.size(),
                "the reference's counts and attributes");
        require(fuzz::all_on_lattice(next.positions), "positions are on the lattice");
        require(next.state.presence.size() == (reference->has_presence ? mesh.positions.size() : 0),
                "presence of each vertex, where it is told");
        std::vector<QuantisedTexcoord> places;
        project(next.state.head.projection, next.positions, places);
        for (const auto& [u, v] : places)
            require(u >= 0 && u <= 65536 && v >= 0 && v <= 65536, "places are in the film");
        require(next.shares.total() <= payload.size(), "shares of what there is");
        std::swap(last, next);
        before = &last.state;
    }
    return 0;
}
