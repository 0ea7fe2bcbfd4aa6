// The whole decoder on a file of any bytes: unchanged, and with corrected CRCs.
#include "whole_decoder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    std::vector<std::uint8_t> bytes(data, data + size);
    DecoderOptions options;
    options.threads = 1;
    fuzz::decode_all(fuzz::read_packets(bytes, 4096), options);
    auto repaired = bytes;
    fuzz::repair_checksums(repaired);
    if (repaired != bytes) fuzz::decode_all(fuzz::read_packets(repaired, 4096), options);
    return 0;
}
