// Counts the bits that a RangeEncoder would write, for decisions by rate and distortion. Encoder only: the counts are
// doubles from std::log2, and nothing in a stream requires their last digits to be the same on every machine.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "entropy/mixing.h"
#include "entropy/models.h"

namespace htvm::internal {

// The bits of a decision under a model, which is not adapted.
inline double decision_cost(const BinaryModel& model, bool bit) {
    static const auto table = [] {
        std::array<float, 4097> t{};
        for (std::size_t i = 0; i < t.size(); ++i)
            t[i] = static_cast<float>(-std::log2((i == 0 ? 0.5 : static_cast<double>(i)) / 4096.0));
        return t;
    }();
    const std::uint32_t p = bit ? model.one : 65536u - model.one;
    return static_cast<double>(table[(p + 8) >> 4]);
}

// The log odds of a decision predicted from several contexts (entropy/mixing.h), from -2047 to 2047; nothing is
// adapted.
template <std::size_t N>
std::int32_t mixed_log_odds(const Mixer<N>& mixer, const std::array<BinaryModel*, N>& models) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < N; ++i) sum += std::int64_t{log_odds_table[models[i]->one >> 4]} * mixer.weights[i];
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -2047, 2047));
}

class CostCounter {
public:
    void bit(BinaryModel& model, bool bit) {
        bits_ += decision_cost(model, bit);
        model.update(bit);
    }
    void raw(std::uint32_t, int n) { bits_ += n; }
    double bits() const { return bits_; }

private:
    double bits_ = 0;
};

// The same for one symbol as the next: no model is adapted.
class CostOfNext {
public:
    void bit(const BinaryModel& model, bool bit) { bits_ += decision_cost(model, bit); }
    void raw(std::uint32_t, int n) { bits_ += n; }
    double bits() const { return bits_; }

private:
    double bits_ = 0;
};

}  // namespace htvm::internal
