#include "codec/paper/coded_bones.h"

namespace htvm::internal {

std::vector<std::uint8_t> write_coded_bones(const std::vector<bool>& coded) {
    std::vector<std::uint8_t> out((coded.size() + 7) / 8, 0);
    for (std::size_t i = 0; i < coded.size(); ++i)
        if (coded[i]) out[i / 8] = static_cast<std::uint8_t>(out[i / 8] | (1u << (i % 8)));
    return out;
}

Result<std::vector<bool>> read_coded_bones(std::span<const std::uint8_t> bytes, std::size_t bones) {
    if (bytes.size() != (bones + 7) / 8)
        return fail(ErrorKind::corrupt_stream, "coded bones: not one bit for every bone");
    std::vector<bool> out(bones);
    for (std::size_t i = 0; i < bones; ++i) out[i] = ((bytes[i / 8] >> (i % 8)) & 1) != 0;
    return out;
}

std::vector<std::uint8_t> vertices_of_coded_bones(const ReferenceMesh& reference, const std::vector<bool>& coded) {
    std::vector<std::uint8_t> out;
    out.reserve(reference.bone_of_vertex.size());
    for (const auto bone : reference.bone_of_vertex) out.push_back(coded[bone] ? 1 : 0);
    return out;
}

std::vector<std::uint8_t> still_vertices(const ReferenceMesh& reference, const std::vector<bool>& coded) {
    auto out = vertices_of_coded_bones(reference, coded);
    for (auto& v : out) v = v ? 0 : 1;
    return out;
}

}  // namespace htvm::internal
