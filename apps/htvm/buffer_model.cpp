#include "buffer_model.h"

#include <algorithm>

namespace htvm::app {

BufferModel::BufferModel(double bits_per_second, double buffer_seconds)
    : bits_per_second_(bits_per_second), capacity_(bits_per_second * buffer_seconds) {}

void BufferModel::add(const Packet& packet) {
    if (packet.kind == PacketKind::index) return;
    if (last_us_ && packet.timestamp_us > *last_us_) {
        const double elapsed = static_cast<double>(packet.timestamp_us - *last_us_) / 1e6;
        held_ = std::max(0.0, held_ - bits_per_second_ * elapsed);
    }
    if (!last_us_ || packet.timestamp_us > *last_us_) last_us_ = packet.timestamp_us;
    held_ += 8.0 * static_cast<double>(packet.payload.size() + packet_overhead);
    if (held_ > peak_) peak_ = held_, peak_frame_ = packet.frame;
    // Timestamps are whole microseconds: two of them may be lost since the buffer was last empty.
    if (!overflows_ && held_ > capacity_ + 2e-6 * bits_per_second_) overflows_ = true, first_overflow_ = packet.frame;
}

}  // namespace htvm::app
