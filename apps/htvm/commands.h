// The shape of the command line: one file per subcommand, each with one function that adds it to the parser.
#pragma once

#include <functional>

#include "htvm/result.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

// What the chosen subcommand does once its options are parsed; an error becomes a line on stderr and an exit code.
using Run = std::function<Result<void>()>;

void add_encode(CLI::App& app, Run& run);
void add_decode(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);
void add_synth(CLI::App& app, Run& run);
void add_calibrate(CLI::App& app, Run& run);
void add_rd(CLI::App& app, Run& run);

}  // namespace htvm::app
