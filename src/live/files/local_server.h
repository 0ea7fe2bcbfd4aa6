// The web server of `htvm play`: the player's page and files of streams, for this machine's own browser. It listens on
// the loopback address alone, and answers nobody who calls it by another name.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/files/served_files.h"

namespace htvm::live {

struct LocalServerOptions {
    std::uint16_t port = 0;          // 0: a free one
    std::string folder{};            // what is below /files/: its .htvm, .png and .jpg files ("": nothing),
    std::vector<NamedFile> files{};  // or, if there are any, these, in this order
};

class LocalServer {
public:
    // Listens; answers nothing before run(). bad_input if the folder cannot be read, or the port is taken.
    static Result<LocalServer> open(const LocalServerOptions& options);
    LocalServer(LocalServer&&) noexcept;
    LocalServer& operator=(LocalServer&&) noexcept;
    ~LocalServer();

    std::uint16_t port() const;
    // Serves until stop() is called or the process is sent SIGINT or SIGTERM.
    void run();
    // Ends run() at once, from any thread; only between open() and the end of run().
    void stop();

private:
    struct State;
    explicit LocalServer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
