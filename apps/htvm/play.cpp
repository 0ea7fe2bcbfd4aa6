// htvm play: a stream or a capture in a web browser, by the server and the player that the program carries inside.
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "command_line/terminal.h"
#include "commands.h"
#include "live/file_server.h"

extern char** environ;

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

struct PlayOptions {
    std::string input;
    std::uint16_t port = 0;
    bool no_open = false;
};

// Starts a program, which Ctrl-C ends even if this one ignores it; 0 if it cannot be started. quiet: without output.
pid_t start_program(std::vector<std::string> words, bool quiet) {
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    if (quiet)
        for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
            posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t interrupts;
    sigemptyset(&interrupts);
    sigaddset(&interrupts, SIGINT);
    posix_spawnattr_setsigdefault(&attributes, &interrupts);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    pid_t child = 0;
    const int error = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return error == 0 ? child : 0;
}

// Whether the program ended, and without an error. Ctrl-C meanwhile ends it, but not this one, which has to clean up.
bool succeeds(const std::vector<std::string>& words) {
    const auto before = std::signal(SIGINT, SIG_IGN);
    const pid_t child = start_program(words, false);
    int status = 0;
    const bool waited = child != 0 && waitpid(child, &status, 0) == child;
    std::signal(SIGINT, before);
    return waited && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

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

// Encodes a capture by the default options, with the progress line of htvm encode.
Result<fs::path> encode_capture(const fs::path& input, TemporaryFolder& folder) {
    if (!folder.make()) return fail(ErrorKind::bad_input, "there is no place for a temporary file (TMPDIR)");
    auto capture = fs::absolute(input).lexically_normal();
    if (capture.filename().empty()) capture = capture.parent_path();
    auto stream = folder.path / capture.filename().replace_extension(".htvm");
    std::error_code error;
    const auto self = fs::read_symlink("/proc/self/exe", error).string();
    if (error) return fail(ErrorKind::bad_input, "cannot find this program; encode the capture with htvm encode first");
    note(fmt::format("{} is not a stream: encoding it first", input.string()));
    if (!succeeds({self, "encode", input.string(), "-o", stream.string()}))
        return fail(ErrorKind::bad_input, fmt::format("{} could not be encoded", input.string()));
    return stream;
}

bool holds_streams(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        if (it->path().extension() == ".htvm") return true;
    return false;
}

void open_browser(const std::string& url) {
    const bool screen = std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY") || std::getenv("BROWSER");
    if (screen) start_program({"xdg-open", url}, true);  // it may run as long as the browser
}

Result<void> play(const PlayOptions& options) {
    if (!live::has_player())
        return fail(ErrorKind::unsupported,
                    "this htvm was built without the web player: ./dev web builds it, then configure and build again");
    std::error_code error;
    const fs::path input = options.input;
    live::FileServerOptions server;
    server.port = options.port;
    server.loopback_names = true;
    TemporaryFolder temporary;
    if (fs::is_directory(input, error) && holds_streams(input)) {
        server.folder = input.string();
    } else {
        fs::path stream = input;
        if (input.extension() != ".htvm") {
            auto encoded = encode_capture(input, temporary);
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
        ->add_option("input", options->input,
                     "A stream (.htvm), a folder of streams, or a capture as htvm encode takes it (a folder, a "
                     "pattern, one mesh), which is encoded first")
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
