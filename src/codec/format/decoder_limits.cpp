#include "codec/format/decoder_limits.h"

#include <algorithm>
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
// Every corner of a triangle may be a vertex of its own.
std::uint64_t memory_of_charts(MeshCounts mesh) { return each(mesh, 32, 360); }
std::uint64_t memory_of_tracking(MeshCounts mesh) { return each(mesh, 416, 48); }
// What is measured for tracking has two of them.
std::uint64_t memory_of_tracked_frame(MeshCounts mesh) { return memory_of_tracking(mesh) / 2; }

// The vertices around each vertex, and the triangles that are shown.
std::uint64_t memory_of_presence(MeshCounts mesh) { return each(mesh, 24, 56); }

std::uint64_t memory_of_frame(const MemoryBound& bound, MeshCounts coded, MeshCounts reference) {
    return memory_of_models + each(coded, bound.coded_vertex, bound.coded_triangle) +
           each(reference, bound.reference_vertex, bound.reference_triangle);
}

std::uint64_t work_of_frames(MeshCounts reference, MeshCounts shown, std::uint64_t weight, std::uint64_t frames) {
    const auto size = [](MeshCounts mesh) { return std::max(mesh.vertices, mesh.triangles / 2); };
    return frames * (size(shown) + weight * size(reference));
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

Result<void> check_limits(const MemoryBound& bound, MeshCounts coded, MeshCounts reference, std::uint64_t kept,
                          const DecoderOptions& options) {
    if (coded.vertices > options.max_vertices || coded.triangles > options.max_triangles)
        return fail(ErrorKind::limit, "the frame has " + std::to_string(coded.vertices) + " vertices and " +
                                          std::to_string(coded.triangles) +
                                          " triangles, more than this decoder accepts; raise its max_vertices or "
                                          "max_triangles");
    const auto needed = kept + memory_of_frame(bound, coded, reference);
    if (needed <= options.max_memory) return {};
    return fail(ErrorKind::limit, "the frame has " + std::to_string(coded.vertices) + " vertices and " +
                                      std::to_string(coded.triangles) + " triangles and may need " + megabytes(needed) +
                                      ", more than this decoder may take; raise its max_memory");
}

Result<void> allow_work(ReceivedWork& received, std::uint64_t work, const DecoderOptions& options) {
    // Neither bytes nor work come near 2^64, but their product might.
    const auto allowed = static_cast<double>(received.bytes) * static_cast<double>(options.max_vertices_per_byte);
    if (static_cast<double>(received.work + work) > allowed)
        return fail(ErrorKind::limit, "it asks for more work than the " + std::to_string(received.bytes) +
                                          " bytes of the stream so far may; raise this decoder's "
                                          "max_vertices_per_byte");
    received.work += work;
    return {};
}

}  // namespace htvm::internal
