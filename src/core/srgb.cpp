#include "core/srgb.h"

#include <array>
#include <cmath>

namespace htvm::internal {
namespace {

double light_of_share(double share) {
    return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

struct Tables {
    std::array<float, 256> light;
    std::array<float, 255> border;  // from this light on the next level is the nearer one
    // At light i / steps: a level that is not above the nearest one, and at most a few below it.
    static constexpr std::size_t steps = 4096;
    std::array<std::uint8_t, steps + 1> start;

    Tables() {
        for (std::size_t i = 0; i < 256; ++i)
            light[i] = static_cast<float>(light_of_share(static_cast<double>(i) / 255));
        for (std::size_t i = 0; i < 255; ++i)
            border[i] = static_cast<float>(light_of_share((static_cast<double>(i) + 0.5) / 255));
        std::uint8_t level = 0;
        for (std::size_t i = 0; i <= steps; ++i) {
            while (level < 255 && static_cast<float>(i) / steps >= border[level]) ++level;
            start[i] = level;
        }
    }
};

const Tables& tables() {
    static const Tables made;
    return made;
}

}  // namespace

float light_of(std::uint8_t level) { return tables().light[level]; }

std::uint8_t level_of(float light) {
    if (!(light > 0)) return 0;
    if (light >= 1) return 255;
    const Tables& t = tables();
    std::uint8_t level = t.start[static_cast<std::size_t>(light * Tables::steps)];
    while (level < 255 && light >= t.border[level]) ++level;
    return level;
}

}  // namespace htvm::internal
