// How large the frames of a VP9 packet say that they are, told from their headers alone.
#include "texture/vp9_frame_size.h"

#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto longest = htvm::internal::longest_vp9_side({data, size});
    htvm::fuzz::require(!longest || *longest <= 65536, "sides have 16 bits");
    return 0;
}
