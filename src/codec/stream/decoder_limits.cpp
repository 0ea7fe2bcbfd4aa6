#include "codec/stream/decoder_limits.h"

#include <string>

namespace htvm::internal {
namespace {

// Tables of models, the same for every mesh.
constexpr std::uint64_t memory_of_models = std::uint64_t{4} << 20;

std::uint64_t each(MeshCounts mesh, std::uint64_t vertex, std::uint64_t triangle) {
    return mesh.vertices * vertex + mesh.triangles * triangle;
}

std::string megabytes(std::uint64_t bytes) { return std::to_string((bytes >> 20) + 1) + " MiB"; }

}  // namespace

std::uint64_t memory_of_reference(MeshCounts mesh) { return each(mesh, 128, 48); }
std::uint64_t memory_of_tracking(MeshCounts mesh) { return each(mesh, 320, 48); }

std::uint64_t memory_of_frame(FrameType type, MeshCounts coded, MeshCounts reference) {
    switch (type) {
        case FrameType::intra:
            return memory_of_models + each(coded, 256, 320) + memory_of_reference(coded);
        case FrameType::enhanced:
            return memory_of_models + each(coded, 384, 320) + each(reference, 256, 96);
        case FrameType::predicted:
            return memory_of_models + each(reference, 224, 32);
        case FrameType::tracked:
            break;
    }
    return memory_of_models + each(reference, 384, 192);
}

Result<void> check_limits(const Packet& packet, const DecoderOptions& options) {
    if (packet.payload.size() <= options.max_packet_bytes) return {};
    return fail(ErrorKind::limit, "a packet of frame " + std::to_string(packet.frame) + " has " +
                                      std::to_string(packet.payload.size()) +
                                      " bytes, more than this decoder accepts; raise its max_packet_bytes");
}

Result<void> check_limits(const SequenceHeader& header, const DecoderOptions& options) {
    const auto joints = header.skeleton.joint_names.size(), bones = header.skeleton.bones.size();
    if (joints <= options.max_joints && bones <= options.max_bones) return {};
    return fail(ErrorKind::limit, "the skeleton has " + std::to_string(joints) + " joints and " +
                                      std::to_string(bones) +
                                      " bones, more than this decoder accepts; raise its max_joints or max_bones");
}

Result<void> check_limits(FrameType type, const FrameHeader& header, MeshCounts reference, std::uint64_t kept,
                          const DecoderOptions& options) {
    if (header.vertices > options.max_vertices || header.triangles > options.max_triangles)
        return fail(ErrorKind::limit, "the frame has " + std::to_string(header.vertices) + " vertices and " +
                                          std::to_string(header.triangles) +
                                          " triangles, more than this decoder accepts; raise its max_vertices or "
                                          "max_triangles");
    const auto needed = kept + memory_of_frame(type, {header.vertices, header.triangles}, reference);
    if (needed <= options.max_memory) return {};
    return fail(ErrorKind::limit, "the frame has " + std::to_string(header.vertices) + " vertices and " +
                                      std::to_string(header.triangles) + " triangles and may need " +
                                      megabytes(needed) + ", more than this decoder may take; raise its max_memory");
}

}  // namespace htvm::internal
