// htvm play: a stream or a capture in a web browser, by the server and the player that the program carries inside.
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

#include "command_line/terminal.h"
#include "commands.h"
#include "encode.h"
#include "live/file_server.h"

extern char** environ;

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

struct PlayOptions {
    std::vector<std::string> inputs;
    std::uint16_t port = 0;
    bool no_open = false;
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
        auto name = (fs::temp_directory_path(error) / "htvm-XXXXXX").string();
        if (error || !mkdtemp(name.data())) return false;
        path = name;
        return true;
    }
};

// Encodes a capture by the default options.
Result<fs::path> encode_capture(const std::vector<std::string>& inputs, TemporaryFolder& folder) {
    if (!folder.make()) return fail(ErrorKind::bad_input, "there is no place for a temporary file (TMPDIR)");
    auto capture = fs::absolute(inputs[0]).lexically_normal();
    if (capture.filename().empty()) capture = capture.parent_path();
    auto stream = folder.path / capture.filename().replace_extension(".htvm");
    note(fmt::format("{} is not a stream: encoding it first", inputs[0]));
    EncodeOptions options;
    options.capture.inputs = inputs;
    options.output = stream.string();
    options.keep_partial = false;
    if (auto encoded = encode(options); !encoded) return tl::unexpected(encoded.error());
    return stream;
}

bool holds_streams(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        if (it->path().extension() == ".htvm") return true;
    return false;
}

// It may run as long as the browser does, and says nothing.
void open_browser(std::string url) {
    if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY") && !std::getenv("BROWSER")) return;
    std::string program = "xdg-open";
    std::array<char*, 3> arguments = {program.data(), url.data(), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
}

Result<void> play(const PlayOptions& options) {
    if (!live::has_player())
        return fail(ErrorKind::unsupported,
                    "this htvm was built without the web player: ./dev web builds it, then configure and build again");
    std::error_code error;
    const fs::path input = options.inputs[0];
    live::FileServerOptions server;
    server.port = options.port;
    server.loopback_names = true;
    TemporaryFolder temporary;
    const bool one = options.inputs.size() == 1;
    if (one && fs::is_directory(input, error) && holds_streams(input)) {
        server.folder = input.string();
    } else {
        fs::path stream = input;
        if (!one || input.extension() != ".htvm") {
            auto encoded = encode_capture(options.inputs, temporary);
            if (!encoded) return tl::unexpected(encoded.error());
            stream = *encoded;
        }
        // The link itself may be a symbolic one: the server follows none.
        stream = fs::canonical(stream, error);
        if (error) return fail(ErrorKind::bad_input, fmt::format("there is no file {}", input.string()));
        server.folder = stream.parent_path().string();
        server.only = {stream.filename().string()};
    }
    auto opened = live::FileServer::open(server);
    if (!opened) return tl::unexpected(opened.error());
    const auto url = fmt::format("http://127.0.0.1:{}/", opened->port());
    fmt::print("{}\n", url);
    std::fflush(stdout);
    note("Open this address in a browser. Ctrl-C ends.");
    if (!options.no_open) open_browser(url);
    opened->run();
    return {};
}

}  // namespace

void add_play(CLI::App& app, Run& run) {
    auto options = std::make_shared<PlayOptions>();
    auto* command = app.add_subcommand("play", "Look at a stream or a capture in a web browser");
    command
        ->add_option("input", options->inputs,
                     "A stream (.htvm), a folder of streams, or a capture as htvm encode takes it (a folder, a "
                     "pattern, meshes), which is encoded first")
        ->expected(1, -1)
        ->required();
    command->add_option("--port", options->port, "Port on this machine's loopback address (default: a free one)");
    command->add_flag("--no-open", options->no_open, "Print the address, but do not open a browser");
    command->footer(
        "Prints the address to open and runs until Ctrl-C. Only this machine can reach it.\n"
        "Examples:\n"
        "  htvm play person.htvm\n"
        "  htvm play capture/");
    command->callback([options, &run] { run = [options] { return play(*options); }; });
}

}  // namespace htvm::app
