// The options that say what the commands that read a stream accept of it.
#pragma once

#include "htvm/decoder.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

// -M/--max-memory, --max-vertices, --max-triangles, --max-bones, --max-packet; into the options' limits.
void add_decoder_limits(CLI::App& command, DecoderOptions& limits);
// Where frames are not decoded: --max-bones and --max-packet alone.
void add_packet_limits(CLI::App& command, DecoderOptions& limits);

}  // namespace htvm::app
