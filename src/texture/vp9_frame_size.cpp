#include "texture/vp9_frame_size.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace htvm::internal {
namespace {

// Most significant bit first. Past the end: zeros, and ok is false.
struct Bits {
    std::span<const std::uint8_t> bytes;
    std::size_t at = 0;
    bool ok = true;
    std::uint32_t take(int count) {
        std::uint32_t out = 0;
        for (; count > 0; --count, ++at) {
            const bool there = at / 8 < bytes.size();
            ok = ok && there;
            out = out << 1 | (there ? bytes[at / 8] >> (7 - at % 8) & 1u : 0u);
        }
        return out;
    }
};

constexpr std::uint32_t sync_code = 0x498342;

std::optional<std::uint32_t> longest_side_of_frame(std::span<const std::uint8_t> frame) {
    Bits in{frame};
    if (in.take(2) != 2) return std::nullopt;                              // frame_marker
    if (in.take(2) != 0) return std::nullopt;                              // profile 0
    if (in.take(1) == 1) return in.ok ? std::optional(0u) : std::nullopt;  // show_existing_frame
    const bool between = in.take(1) == 1, shown = in.take(1) == 1, resilient = in.take(1) == 1;
    const auto sides = [&]() -> std::optional<std::uint32_t> {
        const auto width = in.take(16) + 1, height = in.take(16) + 1;
        return in.ok ? std::optional(std::max(width, height)) : std::nullopt;
    };
    if (!between) {
        if (in.take(24) != sync_code) return std::nullopt;
        constexpr std::uint32_t rgb = 7;
        if (in.take(3) == rgb) return std::nullopt;  // not of profile 0
        in.take(1);                                  // range
        return sides();
    }
    const bool intra = !shown && in.take(1) == 1;
    if (!resilient) in.take(2);  // reset_frame_context
    if (intra) {
        if (in.take(24) != sync_code) return std::nullopt;
        in.take(8);  // refresh_frame_flags
        return sides();
    }
    in.take(8);
    constexpr int references = 3;
    for (int i = 0; i < references; ++i) in.take(3 + 1);
    for (int i = 0; i < references; ++i)
        if (in.take(1) == 1) return in.ok ? std::optional(0u) : std::nullopt;  // as large as that one
    return sides();
}

}  // namespace

std::optional<std::uint32_t> longest_vp9_side(std::span<const std::uint8_t> packet) {
    if (packet.empty()) return std::nullopt;
    // A superframe ends with an index, whose first byte is its last, too.
    std::vector<std::span<const std::uint8_t>> frames;
    const auto marker = packet.back();
    const std::size_t of_size = (marker >> 3 & 3u) + 1, count = (marker & 7u) + 1, index = 2 + of_size * count;
    if ((marker & 0xe0u) == 0xc0 && packet.size() >= index && packet[packet.size() - index] == marker) {
        auto rest = packet.first(packet.size() - index);
        const auto sizes = packet.subspan(packet.size() - index + 1);
        for (std::size_t i = 0; i < count; ++i) {
            std::size_t size = 0;
            for (std::size_t b = 0; b < of_size; ++b) size |= std::size_t{sizes[i * of_size + b]} << (8 * b);
            if (size > rest.size()) return std::nullopt;
            if (size > 0) frames.push_back(rest.first(size));
            rest = rest.subspan(size);
        }
    } else {
        frames.push_back(packet);
    }
    std::uint32_t longest = 0;
    for (const auto frame : frames) {
        const auto side = longest_side_of_frame(frame);
        if (!side) return std::nullopt;
        longest = std::max(longest, *side);
    }
    return longest;
}

}  // namespace htvm::internal
