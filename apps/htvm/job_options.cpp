#include "job_options.h"

#include <CLI/CLI.hpp>
#include <cmath>

#include "io/number_text.h"
#include "live/client/hub_address.h"

namespace htvm::app {
namespace {

constexpr int most = 1024;  // encoders

Job parse_job(const std::string& text) {
    const auto slash = text.find('/');
    const auto number = parse_number(text.substr(0, slash));
    const auto of = slash == std::string::npos ? std::nullopt : parse_number(text.substr(slash + 1));
    const auto is_count = [](double x) { return x >= 1 && x <= 1e6 && x == std::floor(x); };
    if (!number || !of || !is_count(*number) || !is_count(*of) || *number > *of)
        throw CLI::ValidationError("--job", "'" + text + "' is not I/N: job I of N, from 1/N to N/N");
    return {static_cast<std::size_t>(*number), static_cast<std::size_t>(*of)};
}

}  // namespace

void add_job_options(CLI::App& command, EncodeOptions& options) {
    constexpr const char* group = "Many processors, many machines";
    command
        .add_option(
            "--chunks", options.chunks,
            "Cut the capture into so many chunks of equal length, each encoded by itself from an I-frame on,\n"
            "side by side on the cores there are (see --threads); 0: one chunk per core (default: 1, not cut).\n"
            "The stream depends on the number of chunks alone, not on cores or threads, and takes a few bits\n"
            "more than one that is not cut. For files; not with --bitrate")
        ->check(CLI::Range(0, most))
        ->type_name("N")
        ->group(group);
    command
        .add_option(
            "--jobs", options.jobs,
            "Encode so many groups of frames at a time, each from one I-frame to the next (--keyint) by itself,\n"
            "or, where --keyint is below ten, to the first I-frame that makes ten frames or more.\n"
            "The stream is the same for any number, but not the one without --jobs, where what an encoder\n"
            "has learned goes from group to group and I-frames may move. Not with --bitrate")
        ->check(CLI::Range(1, most))
        ->type_name("N")
        ->group(group);
    command
        .add_option_function<std::string>(
            "--job", [&options](const std::string& text) { options.job = parse_job(text); },
            "Encode the Ith of N parts of the groups alone, on any machine. 'htvm join' of the parts, in order, gives\n"
            "the stream of --jobs, byte by byte")
        ->type_name("I/N")
        ->excludes("--jobs")
        ->group(group);
}

const char* job_option(const EncodeOptions& options) {
    return options.chunks != 1 ? "--chunks" : options.jobs > 0 ? "--jobs" : "--job";
}

void check_jobs(const EncodeOptions& options, bool random_session) {
    if (!options.in_groups()) return;
    const char* flag = job_option(options);
    if (options.chunks != 1 && (options.jobs > 0 || options.job.of > 0))
        throw CLI::ValidationError(flag,
                                   "says where the capture is cut, and --jobs and --job cut it by --keyint: give one "
                                   "of them");
    if (is_piped(options.capture))
        throw CLI::ValidationError(flag,
                                   "takes frames from many places at once, which needs files, not standard input");
    if (live::looks_like_hub_address(options.output))
        throw CLI::ValidationError(flag, "encodes groups of frames at once: for files, not for what is live");
    if (is_given(options.encoding, "rate.bits_per_second"))
        throw CLI::ValidationError(flag,
                                   "encodes groups of frames that do not know what the others take, so they cannot "
                                   "share a --bitrate; -q and --target-error go with it");
    if (!options.audio.file.empty() && options.job.of > 0)
        throw CLI::ValidationError("--audio", "is for the whole: give it to the htvm join of the parts");
    if (random_session && options.job.of > 0)
        throw CLI::ValidationError("--session",
                                   "is random, so the parts of several jobs would not be of one stream: give "
                                   "all the same number");
}

}  // namespace htvm::app
