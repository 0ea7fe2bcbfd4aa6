// Counts the bits that a RangeEncoder would write, for decisions by rate and distortion. Encoder only: the counts are
// doubles from std::log2, and nothing in a stream requires their last digits to be the same on every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

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
