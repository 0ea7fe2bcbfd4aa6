// How a capture is cut and shared out (encode_jobs.h), on the command line.
#pragma once

#include "encode.h"

namespace CLI {
class App;
}

namespace htvm::app {

// Adds --chunks, --jobs and --job to a command.
void add_job_options(CLI::App& command, EncodeOptions& options);

// The one that was given, where the capture is encoded in groups.
const char* job_option(const EncodeOptions& options);

// Throws the command line's errors for what groups cannot do, as they do not know of each other.
void check_jobs(const EncodeOptions& options, bool random_session);

}  // namespace htvm::app
