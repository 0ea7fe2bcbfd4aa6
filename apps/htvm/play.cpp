// htvm play: a stream or a capture in a web browser, by the server and the player that the program carries inside.
// htvm demo: the same of a stream that the program carries inside, too.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>
#include <vector>

#include "browser.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "demo_stream.h"
#include "encode.h"
#include "io/number_text.h"
#include "io/output_file.h"
#include "io/recording.h"
#include "io/system_file.h"
#include "live/files/local_server.h"
#include "live/files/player_files.h"
#include "picture_options.h"
#include "sequences.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

struct PlayOptions {
    std::vector<std::string> inputs;
    std::string beside;  // empty: none
    std::uint16_t port = 0;
    bool no_open = false;
    std::string orbit;       // as the player's attribute; empty: the first view
    std::size_t frames = 0;  // of captures; 0: all
    double quality = default_quality;
};

// A folder of its own for what is encoded only to be played; removed at the end.
struct TemporaryFolder {
    fs::path path;
    TemporaryFolder() = default;
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code ignored;
        if (!path.empty()) fs::remove_all(path, ignored);
    }
    bool make() {
        std::error_code error;
        const auto place = fs::temp_directory_path(error);
        if (error) return false;
        auto made = make_own_folder(place / "htvm-");
        if (!made) return false;
        path = std::move(*made);
        return true;
    }
};

Result<fs::path> encode_capture(const std::vector<std::string>& inputs, EncodeRequest request,
                                TemporaryFolder& folder) {
    if (const auto files = find_frames(inputs, {request.capture.ignored}); !files) return tl::unexpected(files.error());
    if (!folder.make()) return fail(ErrorKind::bad_input, "there is no place for a temporary file (TMPDIR)");
    auto capture = fs::absolute(inputs[0]).lexically_normal();
    if (capture.filename().empty()) capture = capture.parent_path();
    auto stream = folder.path / capture.filename().replace_extension(".htvm");
    note(fmt::format("{} is not a stream: encoding it first, into a temporary file", inputs[0]));
    request.capture.inputs = inputs;
    request.output = stream.string();
    request.keep_partial = false;
    const auto plan = plan_of(request);
    if (!plan) return tl::unexpected(plan.error());
    if (auto encoded = encode(*plan); !encoded) return tl::unexpected(encoded.error());
    return stream;
}

// The player reads .htvm: a stream in another kind of file is unpacked, which encodes nothing.
Result<fs::path> unpack(const std::string& packed, TemporaryFolder& folder) {
    if (!folder.make()) return fail(ErrorKind::bad_input, "there is no place for a temporary file (TMPDIR)");
    const auto stream = folder.path / fs::path(packed).filename().replace_extension(".htvm");
    auto input = StreamInput::open(packed, DecoderOptions().max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    if (input->is_live())
        return fail(ErrorKind::bad_input,
                    packed + " is a live stream: its hub has a page that shows it, and 'htvm pack' keeps it in a file");
    auto output = StreamOutput::open(stream.string());
    if (!output) return tl::unexpected(output.error());
    while (const auto packet = input->next()) {
        output->add_bounds_of(*packet);
        if (packet->kind == PacketKind::front_index) continue;
        if (auto written = output->write(*packet); !written) return tl::unexpected(written.error());
    }
    if (auto fine = check_whole(*input, packed); !fine) return tl::unexpected(fine.error());
    if (auto finished = output->finish(); !finished) return tl::unexpected(finished.error());
    return stream;
}

// A stream that can be served; a capture is encoded first. The server follows no symbolic link, but this may be one.
Result<fs::path> stream_of(const std::vector<std::string>& inputs, const EncodeRequest& encoding,
                           TemporaryFolder& folder) {
    fs::path stream = inputs[0];
    if (inputs.size() > 1 && is_stream_name(inputs[0]))
        return fail(ErrorKind::bad_input, "only one stream is shown at a time; name the folder that they are in");
    if (is_stream_name(inputs[0]) && stream.extension() != ".htvm") {
        auto unpacked = unpack(inputs[0], folder);
        if (!unpacked) return unpacked;
        stream = *unpacked;
    } else if (stream.extension() != ".htvm") {
        auto encoded = encode_capture(inputs, encoding, folder);
        if (!encoded) return encoded;
        stream = *encoded;
    }
    std::error_code error;
    stream = fs::canonical(stream, error);
    if (error) return fail(ErrorKind::bad_input, fmt::format("there is no file {}", inputs[0]));
    return stream;
}

bool holds_streams(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        if (it->path().extension() == ".htvm") return true;
    return false;
}

// For captures that streams are compared with: every vertex and triangle, each frame by itself.
EncodeRequest nearly_lossless() {
    EncodeRequest out;
    out.encoding.profile = Profile::topology;
    out.encoding.quality = 100;
    out.encoding.given = {{find_option("key_interval"), 1}, {find_option("topology.merge_duplicates"), 0}};
    return out;
}

std::string percent_encoded(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += std::isalnum(static_cast<unsigned char>(c)) ? std::string(1, c)
                                                           : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    return out;
}

// What is wrong with a place to look from, or nothing: one to three numbers.
std::string check_orbit(const std::string& text) {
    std::string numbers = text;
    std::replace(numbers.begin(), numbers.end(), ',', ' ');
    std::istringstream words(numbers);
    std::vector<double> found;
    for (std::string word; words >> word;) {
        const auto number = parse_number(word);
        if (!number) return fmt::format("{} is not a number", word);
        found.push_back(*number);
    }
    const bool fits = !found.empty() && found.size() <= 3 && (found.size() < 3 || found[2] > 0);
    return fits ? "" : "give degrees to the right and, if you like, degrees up and a distance above 0";
}

// Where the head is, as the player's attribute, where the stream does not say it and the player's y is wrong: by the
// first mesh, as htvm still judges it, whichever frame is shown first. Empty: nothing is to be said.
std::string up_of(const std::string& stream) {
    auto source = open_meshes({stream}, {});
    if (!source || source->frames == 0 || source->up != UpAxis::unknown) return {};
    const auto first = source->mesh_at(*source, 0);
    return first && likely_up(first->mesh) == UpAxis::plus_z ? "z" : "";
}

void add_to(std::string& query, const char* name, const std::string& value) {
    if (!value.empty()) query += fmt::format("{}{}={}", query.empty() ? "?" : "&", name, percent_encoded(value));
}

// Streams for browsers that do not decode the pictures of these (htvm transcode).
void add_siblings(std::vector<live::NamedFile>& files) {
    for (std::size_t i = files.size(); i-- > 0;)
        for (const auto& coder : live::sibling_coders) {
            const auto beside = [&](const fs::path& stream) {
                return fs::path(stream).replace_extension(std::string(coder) + stream.extension().string()).string();
            };
            std::error_code error;
            if (const auto path = beside(files[i].path); fs::is_regular_file(path, error))
                files.push_back({beside(files[i].name), path});
        }
}

Result<void> play(const PlayOptions& options) {
    if (!live::has_player())
        return fail(ErrorKind::unsupported,
                    "this htvm was built without the web player: ./dev web builds it, then configure and build again");
    std::error_code error;
    const auto& inputs = options.inputs;
    live::LocalServerOptions server;
    server.port = options.port;
    TemporaryFolder temporary, beside_temporary;
    std::string query;
    if (options.beside.empty() && inputs.size() == 1 && fs::is_directory(inputs[0], error) &&
        holds_streams(inputs[0])) {
        server.folder = inputs[0];
    } else {
        auto encoding = options.beside.empty() ? EncodeRequest() : nearly_lossless();
        if (options.beside.empty()) encoding.encoding.quality = options.quality;
        encoding.capture.frames = options.frames;
        const auto stream = stream_of(inputs, encoding, temporary);
        if (!stream) return tl::unexpected(stream.error());
        server.files = {{stream->filename().string(), stream->string()}};
    }
    if (!options.beside.empty()) {
        auto encoding = nearly_lossless();
        encoding.capture.frames = options.frames;
        const auto stream = stream_of({options.beside}, encoding, beside_temporary);
        if (!stream) return tl::unexpected(stream.error());
        server.files.push_back({"beside/" + stream->filename().string(), stream->string()});
        add_to(query, "file", server.files[0].name);
        add_to(query, "beside", server.files[1].name);
    }
    add_siblings(server.files);
    if (!server.files.empty()) add_to(query, "up", up_of(server.files[0].path));
    add_to(query, "orbit", options.orbit);
    auto opened = live::LocalServer::open(server);
    if (!opened) return tl::unexpected(opened.error());
    const auto url = fmt::format("http://127.0.0.1:{}/{}", opened->port(), query);
    fmt::print("{}\n", url);
    std::fflush(stdout);
    note("Open this address in a browser. Ctrl-C ends.");
    if (!options.no_open) open_in_browser(url);
    opened->run();
    return {};
}

struct DemoOptions {
    std::string output;  // empty: played
    PlayOptions playing;
};

Result<void> demo(const DemoOptions& options) {
    if (!options.output.empty()) return write_file(options.output, demo_stream());
    TemporaryFolder folder;
    if (!folder.make()) return fail(ErrorKind::bad_input, "there is no place for a temporary file (TMPDIR)");
    auto playing = options.playing;
    playing.inputs = {(folder.path / "demo.htvm").string()};
    if (auto written = write_file(playing.inputs[0], demo_stream()); !written) return written;
    return play(playing);
}

// What playing a capture and the stream inside have in common.
void add_place(CLI::App& command, PlayOptions& options) {
    command.add_option("--port", options.port, "Port on this machine's loopback address (default: a free one)")
        ->check(CLI::Range(0, 65535));
    command.add_flag("--no-open", options.no_open, "Print the address, but do not open a browser");
}

}  // namespace

void add_play(CLI::App& app, Run& run) {
    auto options = std::make_shared<PlayOptions>();
    auto* command = app.add_subcommand("play", "Look at a stream or a capture in a web browser");
    command
        ->add_option(
            "input", options->inputs,
            "A stream (.htvm, .mp4 or .m3u8), a folder of streams, or a capture as htvm encode takes it (a folder, a "
            "pattern, meshes), which is encoded first")
        ->type_name("FILE")
        ->expected(1, -1)
        ->required();
    auto* beside =
        command
            ->add_option(
                "--beside", options->beside,
                "Another stream or capture, shown in step with the first in the same window, with a slider between\n"
                "them. Captures are then encoded with hardly any loss, so that streams can be compared with them")
            ->type_name("OTHER");
    command
        ->add_option("--orbit", options->orbit,
                     "Where to look from: degrees to the right of the front, then, if given, degrees up and the\n"
                     "distance in metres; in quotes: \"180\", from behind, or \"30 10\"")
        ->type_name("ANGLES")
        ->check(check_orbit);
    command->add_option("--frames", options->frames,
                        "Of a capture: encode at most this many frames; 0: all (default: all)");
    command
        ->add_option("-q,--quality", options->quality,
                     fmt::format("Of a capture: quality, 0 to 100 (default {:g})", default_quality))
        ->check(CLI::Range(0.0, 100.0))
        ->excludes(beside);
    add_place(*command, *options);
    command->footer(
        "Prints the address to open and runs until Ctrl-C. Only this machine can reach it.\n"
        "Examples:\n"
        "  htvm play person.htvm\n"
        "  htvm play capture/ --frames 50 --orbit 180\n"
        "  htvm play capture/ --beside person.htvm");
    command->callback([options, &run] { run = [options] { return play(*options); }; });
}

void add_demo(CLI::App& app, Run& run) {
    auto options = std::make_shared<DemoOptions>();
    auto* command = app.add_subcommand("demo", "Look at a short stream that is inside the program, in a web browser");
    command->add_option("-o,--output", options->output, "Write the stream to this file, and do not play it")
        ->type_name("FILE.htvm");
    add_place(*command, options->playing);
    command->footer(
        "A synthetic person. Prints the address to open and runs until Ctrl-C. Only this machine can reach it.\n"
        "Examples:\n"
        "  htvm demo\n"
        "  htvm demo -o person.htvm");
    command->callback([options, &run] { run = [options] { return demo(*options); }; });
}

}  // namespace htvm::app
