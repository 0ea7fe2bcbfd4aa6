#include "entropy/range_coder.h"

namespace htvm::internal {

void RangeEncoder::shift_low() {
    const bool carry = low_ > 0xFFFFFFFFu;
    if (low_ < 0xFF000000u || carry) {
        if (started_) bytes_.push_back(static_cast<std::uint8_t>(pending_ + carry));
        for (; pending_ones_ > 0; --pending_ones_) bytes_.push_back(static_cast<std::uint8_t>(0xFF + carry));
        pending_ = static_cast<std::uint8_t>(low_ >> 24);
        started_ = true;
    } else {
        ++pending_ones_;
    }
    low_ = (low_ & 0x00FFFFFFu) << 8;
}

void RangeEncoder::raw(std::uint32_t value, int n) {
    used_ = used_ || n > 0;
    while (n > 0) {
        const int now = n < 16 ? n : 16;
        n -= now;
        range_ >>= now;
        low_ += std::uint64_t{range_} * ((value >> n) & ((1u << now) - 1));
        while (range_ < (1u << 24)) {
            range_ <<= 8;
            shift_low();
        }
    }
}

std::vector<std::uint8_t> RangeEncoder::finish() {
    if (!used_) return {};
    // Any value in [low, low + range) would do: take the one that ends in the most zero bytes.
    for (int zeros = 24; zeros > 0; zeros -= 8) {
        const std::uint64_t mask = (std::uint64_t{1} << zeros) - 1;
        const std::uint64_t value = (low_ + mask) & ~mask;
        if (value < low_ + range_) {
            low_ = value;
            break;
        }
    }
    for (int i = 0; i < 5; ++i) shift_low();
    // The decoder reads zeros past the end, so up to four trailing zeros need not be sent.
    for (int i = 0; i < 4 && !bytes_.empty() && bytes_.back() == 0; ++i) bytes_.pop_back();
    return std::move(bytes_);
}

}  // namespace htvm::internal
