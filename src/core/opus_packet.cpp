#include "core/opus_packet.h"

#include <array>

namespace htvm::internal {

std::optional<std::uint32_t> opus_samples(std::span<const std::uint8_t> packet) {
    if (packet.empty()) return std::nullopt;
    // The first byte: five bits of configuration, one for stereo, two that tell how many frames of equal length follow.
    constexpr std::array<std::uint32_t, 4> speech = {480, 960, 1920, 2880}, hybrid = {480, 960, 480, 960},
                                           music = {120, 240, 480, 960};
    const unsigned configuration = packet[0] >> 3;
    const auto& lengths = configuration < 12 ? speech : configuration < 16 ? hybrid : music;
    std::uint32_t frames = 2;
    if ((packet[0] & 3) == 0) frames = 1;
    if ((packet[0] & 3) == 3) frames = packet.size() > 1 ? packet[1] & 63 : 0;
    constexpr std::uint32_t most = 5760;
    const auto samples = lengths[configuration % 4] * frames;
    if (samples == 0 || samples > most) return std::nullopt;
    return samples;
}

}  // namespace htvm::internal
