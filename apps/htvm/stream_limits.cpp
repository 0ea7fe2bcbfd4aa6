#include "stream_limits.h"

#include <CLI/CLI.hpp>

namespace htvm::app {
namespace {

const char* const group = "Limits, for streams that may be hostile";

}  // namespace

void add_decoder_limits(CLI::App& command, DecoderOptions& limits) {
    command
        .add_option("-M,--max-memory", limits.max_memory,
                    "Most memory that decoding may take: bytes, or a number with K, M or G (default 4G)")
        ->transform(CLI::AsSizeValue(false))
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
        ->group(group);
}

}  // namespace htvm::app
