#include "io/skeleton_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/output_file.h"
#include "io/skeleton_azure.h"
#include "io/skeleton_json.h"
#include "io/skeleton_json_value.h"

namespace htvm {
namespace {

Result<std::string> read_text(const std::string& path, std::size_t max_bytes) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return fail(ErrorKind::bad_input, "cannot be opened; check the path and its permissions");
    std::string text;
    std::array<char, 1 << 16> block;
    while (file.read(block.data(), block.size()) || file.gcount() > 0) {
        text.append(block.data(), static_cast<std::size_t>(file.gcount()));
        if (text.size() > max_bytes)
            return fail(ErrorKind::limit, "is larger than the limit of " + std::to_string(max_bytes) + " bytes");
    }
    if (file.bad()) return fail(ErrorKind::bad_input, "cannot be read; is it a file?");
    return text;
}

// Without a byte order mark, spaces and lines of comments in front.
std::string_view start_of(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    for (;;) {
        while (!text.empty() && static_cast<unsigned char>(text.front()) <= ' ') text.remove_prefix(1);
        if (!text.starts_with('#') && !text.starts_with("//")) return text;
        text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size()));
    }
}

}  // namespace

Result<SkeletonTrack> parse_skeleton(std::string_view text, const SkeletonReadOptions& options) {
    const auto start = start_of(text);
    if (start.empty()) return fail(ErrorKind::bad_input, "holds nothing");
    if ((start.front() | 0x20) == 'h') return parse_skeleton_bvh(text, options.bvh);
    if (start.front() != '{')
        return fail(ErrorKind::bad_input, "is neither BVH (starts with HIERARCHY) nor skeleton JSON (starts with {)");
    const auto document = parse_json(text);
    if (!document) return tl::unexpected(document.error());
    return looks_like_azure(*document) ? skeleton_from_azure(*document) : skeleton_from_json(*document);
}

Result<SkeletonTrack> read_skeleton(const std::string& path, const SkeletonReadOptions& options) {
    const auto text = read_text(path, options.max_bytes);
    if (!text) return fail_at(path, text.error());
    auto track = parse_skeleton(*text, options);
    if (!track) return fail_at(path, track.error());
    return track;
}

Result<void> write_skeleton(const std::string& path, const SkeletonTrack& track) {
    const auto text = format_skeleton_json(track);
    if (!text) return fail_at(path, text.error());
    return write_file(path, *text);
}

}  // namespace htvm
