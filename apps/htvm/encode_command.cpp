// htvm encode on the command line: its options, from which the request is made that encode_plan.h checks.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "command_line/headings.h"
#include "commands.h"
#include "encode.h"
#include "encode_ladder.h"
#include "io/number_text.h"

namespace htvm::app {
namespace {

void add_output(CLI::App& command, EncodeRequest& request) {
    command
        .add_option(
            "-o,--output", request.output,
            "The stream: a file (.htvm, .mp4, or .m3u8 for segments and their playlist), - for standard output,\n"
            "or a hub, for others to watch it while it is encoded:\n"
            "ws://HOST:PORT/publish/NAME, or wss:// with TLS")
        ->type_name("FILE")
        ->required()
        ->group(heading::output);
    command
        .add_option("--segment", request.segment_seconds,
                    "Of a playlist, -o NAME.m3u8: seconds that a segment lasts at least; it ends where players can\n"
                    "start (default 2). A ladder that goes to a hub has a place to start so often")
        ->check(CLI::Range(0.1, 60.0))
        ->type_name("SECONDS")
        ->group(heading::output);
    command
        .add_option(
            "--ladder", request.ladder,
            "Several qualities at once, from which players choose by their line, as segments that are cut at\n"
            "the same frames in all: -o NAME.m3u8 becomes the list of their playlists, NAME-1.m3u8 and so on,\n"
            "the coarsest first. To a hub, -o ws://HOST:PORT/publish/NAME, they go as the streams NAME~1 and so\n"
            "on, of which it makes the list (htvm serve --segments). Rates in Mbit/s, 0.3,0.8,2, or qualities, "
            "q35,q50,q65, or web (q30,q42,q60).\n"
            "The capture is read once, and the finest rung's tracking serves the others")
        ->type_name("RUNGS")
        ->group(heading::output);
}

void add_trouble_options(CLI::App& command, EncodeRequest& request) {
    add_choice(command, "--on-bad-frame", request.bad_frames, bad_frame_uses,
               "What becomes of a frame that cannot be read or coded: stop (default), skip, or repeat, the frame\n"
               "before once more. Its time is kept. With skip and repeat, frames without triangles are bad too, each\n"
               "is told, and the exit code is 0. On standard input only behind a mesh that came whole")
        ->group(heading::input);
    command
        .add_flag("--fill", request.fill,
                  "Where the numbers of the files leave some out, repeat the frame before (default: a gap in time)")
        ->group(heading::input);
}

void add_live_options(CLI::App& command, EncodeRequest& request) {
    command
        .add_option("--other-hub", request.publishing.other_hubs,
                    "Where to go on if the hub is lost, another address (repeatable)")
        ->type_name("URL")
        ->allow_extra_args(false)
        ->group(heading::live);
    add_publishing_options(command, request.publishing);
    command
        .add_flag("--fixed-bitrate", request.publishing.fixed_bitrate,
                  "Keep to --bitrate where the hub's line does not carry it, and drop frames instead (default: less\n"
                  "is sent while it does not)")
        ->group(heading::live);
    command
        .add_flag("--drop-late", request.drop_late,
                  "Of meshes on standard input that come faster than they are encoded, drop the oldest that wait,\n"
                  "so that a camera never has to (default: the sender waits). A warning says how many were, and\n"
                  "the exit code is 0, as they were dropped by wish")
        ->group(heading::live);
    command
        .add_option("--deadline", request.deadline,
                    "Milliseconds from when a mesh is there to when its packet is: where a frame would be late, less\n"
                    "is searched for it (see --effort), at last its motion alone is coded, and lost tracking is\n"
                    "repaired in a later one; no frame is left out. How many were late or got less is said at the\n"
                    "end, and --effort-log has it all. Frames are then coded one by one: not with --latency-frames,\n"
                    "--group, --passes 2, --chunks, --jobs or another --profile")
        ->check(CLI::Range(1.0, 60000.0))
        ->type_name("MS")
        ->group(heading::live);
}

Job parse_job(const std::string& text) {
    const auto slash = text.find('/');
    const auto number = parse_number(text.substr(0, slash));
    const auto of = slash == std::string::npos ? std::nullopt : parse_number(text.substr(slash + 1));
    const auto is_count = [](double x) { return x >= 1 && x <= 1e6 && x == std::floor(x); };
    if (!number || !of || !is_count(*number) || !is_count(*of) || *number > *of)
        throw CLI::ValidationError("--job", "'" + text + "' is not I/N: job I of N, from 1/N to N/N");
    return {static_cast<std::size_t>(*number), static_cast<std::size_t>(*of)};
}

void add_job_options(CLI::App& command, EncodeRequest& request) {
    constexpr int most = 1024;  // encoders
    command
        .add_option(
            "--chunks", request.chunks,
            "Cut the capture into so many chunks of equal length, each encoded by itself from an I-frame on,\n"
            "side by side on the cores there are (see --threads); 0: one chunk per core (default: 1, not cut).\n"
            "The stream depends on the number of chunks alone, not on cores or threads, and takes a few bits\n"
            "more than one that is not cut. For files; not with --bitrate")
        ->check(CLI::Range(0, most))
        ->type_name("N")
        ->group(heading::parallel);
    command
        .add_option(
            "--jobs", request.jobs,
            "Encode so many groups of frames at a time, each from one I-frame to the next (--keyint) by itself,\n"
            "or, where --keyint is below ten, to the first I-frame that makes ten frames or more.\n"
            "The stream is the same for any number, but not the one without --jobs, where what an encoder\n"
            "has learned goes from group to group and I-frames may move. Not with --bitrate")
        ->check(CLI::Range(1, most))
        ->type_name("N")
        ->group(heading::parallel);
    command
        .add_option_function<std::string>(
            "--job", [&request](const std::string& text) { request.job = parse_job(text); },
            "Encode the Ith of N parts of the groups alone, on any machine. 'htvm join' of the parts, in order, gives\n"
            "the stream of --jobs, byte by byte")
        ->type_name("I/N")
        ->group(heading::parallel);
}

void add_script_options(CLI::App& command, EncodeRequest& request) {
    command.add_flag("--json", request.json, "Print sizes by frame and layer as JSON on standard output")
        ->group(heading::scripts);
    command
        .add_option("--effort-log", request.effort_log,
                    "Write what was decided of each frame, and how long it took, as lines of CSV, while frames are\n"
                    "encoded: in FILE.partial until all are there, where an encode that ends early leaves them. An\n"
                    "earlier log is replaced, other files are not")
        ->type_name("FILE")
        ->check([](const std::string& file) {
            return file.empty() || file == "-" ? std::string("is a file's name, as efforts.csv") : std::string();
        })
        ->group(heading::scripts);
    command
        .add_option("--repeat-efforts", request.repeat_efforts,
                    "Take the effort of each frame from such a log, not from the clock: the same bytes again, if\n"
                    "the other options are the same. --effort is in the log")
        ->type_name("FILE")
        ->group(heading::scripts);
    command
        .add_flag_callback(
            "--help-options",
            [] {
                fmt::print("{}", options_in_markdown());
                throw CLI::Success();
            },
            "Print all options of the library with their ranges, as docs/options.md has them, and exit")
        ->group(heading::scripts);
}

// Pairs of options that the parser takes together alone, or not together: the help names them. All else that
// contradicts is in contradiction_in().
void add_conditions(CLI::App& command) {
    const auto option = [&](const char* name) { return command.get_option(name); };
    for (const char* of_rate : {"--buffer", "--passes"}) option(of_rate)->needs(option("--bitrate"));
    for (const char* of_axis : {"--floor", "--front"}) option(of_axis)->needs(option("--up"));
    // With a bitrate or a target error, quality follows from it, so options that set the steps directly contradict it.
    option("--bitrate")->excludes(option("--target-error"));
    for (const char* control : {"--bitrate", "--target-error"})
        for (const char* by_hand : {"--quality", "--preset", "--geometry-step", "--colour-step"})
            option(control)->excludes(option(by_hand));
    option("--preset")->excludes(option("--quality"));
    for (const char* of_one :
         {"--quality", "--preset", "--bitrate", "--target-error", "--geometry-step", "--colour-step"})
        option("--ladder")->excludes(option(of_one));
    option("--job")->excludes(option("--jobs"));
    for (const char* chosen : {"--deadline", "--effort"}) option("--repeat-efforts")->excludes(option(chosen));
}

constexpr const char* examples =
    "Examples:\n"
    "  htvm encode capture/ -o person.htvm\n"
    "  htvm encode scan_*.obj -q 60 --keyint 60 -o person.htvm\n"
    "  htvm encode capture/ --profile topology -s capture/skeleton.json -o exact.htvm\n"
    "  htvm encode capture/ --bitrate 6 --buffer 0.5 -o person.htvm\n"
    "  htvm encode capture/ --jobs 8 -o person.htvm\n"
    "  rig --ply | htvm encode - --bitrate 8 --drop-late -o wss://hub.example/publish/person";

FrontPage front_page() {
    return {
        {
            {"input",
             "The meshes, one file per frame (PLY, OBJ, Draco, glTF): a folder, a pattern such as\n"
             "scan_%05d.ply, files in their order, or - for PLY after PLY on standard input"},
            {"--output", "The stream: a file, - for standard output, or a hub, ws://HOST:PORT/publish/NAME"},
            {"--quality", fmt::format("0 to 100 (default {}; --preset studio: {}, master: {}): more is finer",
                                      default_quality, quality_of(Preset::studio), quality_of(Preset::master))},
            {"--bitrate", "Mbit/s to keep to; the quality follows"},
            {"--target-error", "How far each frame's surface may be off, mm (RMS); the quality follows"},
            {"--profile",
             "tracked (default): the fewest bits, on triangles that move along. topology: every\n"
             "frame's own triangles. paper: the same, as published"},
            {"--effort",
             fmt::format("1 to 9 (default {}): more takes longer, and fewer bits", EncoderOptions().tracked.effort)},
            {"--threads", "Threads to use (default: one per core); the stream does not depend on it"},
            {"--fps", "Frames per second of the meshes (default: as files or skeleton say, else 30)"},
            {"--frames", "Use at most so many frames (default: all)"},
            {"--skeleton", "The tracked skeleton, if there is one: JSON or BVH"},
            {"--texture-as",
             "What becomes of a texture: video, which keeps details (default: picture, or projection where it is one "
             "camera's film), or colours at the vertices: less time, fewer bits; others in --help-all"},
            {"--audio", "Sound that begins with the first frame"},
            {"--deadline", "Live: milliseconds that a frame may take; where time is short, less is searched"},
        },
        "Captures of depth cameras are known by their borders; --presence, --fill-holes and --specks in --help-all\n"
        "change what becomes of them.\n"
        "Examples:\n"
        "  htvm encode capture/ -o person.htvm\n"
        "  htvm encode capture/ --bitrate 6 --audio voice.wav -o person.htvm\n"
        "  rig --ply | htvm encode - --deadline 50 -o ws://localhost:8080/publish/person"};
}

}  // namespace

void add_encode(CLI::App& app, Run& run) {
    auto request = std::make_shared<EncodeRequest>();
    auto* command = app.add_subcommand("encode", "Compress a sequence of meshes into an .htvm stream");
    add_capture_options(*command, request->capture);
    add_trouble_options(*command, *request);
    add_texture_picture_options(*command, request->pictures);
    add_audio_options(*command, request->audio);
    add_output(*command, *request);
    add_encoding_options(*command, request->encoding);
    add_live_options(*command, *request);
    add_job_options(*command, *request);
    add_script_options(*command, *request);
    add_conditions(*command);
    command->footer(examples);
    add_front_page(*command, front_page());
    command->callback([request, &run] {
        if (const auto why = contradiction_in(*request); !why.empty()) throw CLI::ValidationError(why);
        run = [request]() -> Result<void> {
            if (!request->ladder.empty()) return encode_ladder(*request);
            const auto plan = plan_of(*request);
            return plan ? encode(*plan) : tl::unexpected(plan.error());
        };
    });
}

}  // namespace htvm::app
