// The arithmetic encoder: a byte-wise range coder with carry, after Martin (1979).
#pragma once

#include <cstdint>
#include <vector>

#include "entropy/models.h"

namespace htvm::internal {

class RangeEncoder {
public:
    void bit(BinaryModel& model, bool bit);
    void raw(std::uint32_t value, int n);
    // Flushes and hands over the bytes; the encoder is then spent. An encoder that coded nothing gives no bytes.
    std::vector<std::uint8_t> finish();

private:
    void shift_low();
    std::uint64_t low_ = 0;
    std::uint32_t range_ = 0xFFFFFFFFu;
    std::uint8_t pending_ = 0;        // the last byte, which a carry may still change
    std::uint64_t pending_ones_ = 0;  // 0xFF bytes that wait behind it
    bool started_ = false;
    bool used_ = false;
    std::vector<std::uint8_t> bytes_;
};

inline void RangeEncoder::bit(BinaryModel& model, bool bit) {
    const std::uint32_t bound = (range_ >> 16) * model.one;
    if (bit) {
        range_ = bound;
    } else {
        low_ += bound;
        range_ -= bound;
    }
    model.update(bit);
    used_ = true;
    while (range_ < (1u << 24)) {
        range_ <<= 8;
        shift_low();
    }
}

}  // namespace htvm::internal
