#include "stream_limits.h"

#include <CLI/CLI.hpp>
#include <cstdint>

namespace htvm::app {
namespace {

// What a number with a sign, or beyond 64 bits, would be taken for is far above it.
constexpr std::uint64_t most_bytes = std::uint64_t{1} << 60;

const char* const group = "Limits, for streams that may be hostile";

}  // namespace

void add_decoder_limits(CLI::App& command, DecoderOptions& limits) {
    command
        .add_option("-M,--max-memory", limits.max_memory,
                    "Most memory that decoding may take: bytes, or a number with K, M or G (default 4G)")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::Range(std::uint64_t{1}, most_bytes, "from 1 to 2^60 bytes"))
        ->group(group);
    command.add_option("--max-vertices", limits.max_vertices, "Most vertices of a frame (default 4194304)")
        ->group(group);
    command.add_option("--max-triangles", limits.max_triangles, "Most triangles of a frame (default 8388608)")
        ->group(group);
    add_packet_limits(command, limits);
}

void add_packet_limits(CLI::App& command, DecoderOptions& limits) {
    command.add_option("--max-bones", limits.max_bones, "Most bones of the skeleton (default 1024, the format's most)")
        ->group(group);
    command
        .add_option("--max-packet", limits.max_packet_bytes,
                    "Most bytes of a packet, likewise with K, M or G (default 256M); larger ones are passed over")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::Range(std::uint64_t{1}, most_bytes, "from 1 to 2^60 bytes"))
        ->group(group);
}

}  // namespace htvm::app
