#include "htvm/frame_numbers.hpp"

#include <algorithm>

#include "htvm/decoder.hpp"

namespace htvm {

void FrameNumbers::push(const PacketHeader& header) {
    dependencies_.push(header);
    begins_ = false;
    if (!frame_type(header.kind)) return;
    begins_ = !any_ || dependencies_.sequences() != in_force_;
    if (begins_ && any_ && header.frame <= highest_) {
        offset_ += highest_ + 1;
        highest_ = 0;
    }
    any_ = true;
    in_force_ = dependencies_.sequences();
    highest_ = std::max(highest_, header.frame);
}

}  // namespace htvm
