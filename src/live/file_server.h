// A web server for streams and the player: for a person's own browser on the loopback address, and for a folder that
// others may watch.
//
//   /                the player's page; it lists the streams, or plays one: /?file=NAME
//   /player/NAME     the player's scripts, kept in the program
//   /api/files       the streams as JSON: [{"path": ..., "bytes": ..., "poster": ...}, ...]; the poster of NAME.htvm is
//                    NAME.png or NAME.jpg beside it, where there is one
//   /files/PATH      the streams themselves, by ranges too
//
// With a hub, live streams too (WebSockets; /watch/NAME is an endless body where no WebSocket is asked for):
//   /publish/NAME    packets from a publisher: a program on this machine
//   /watch/NAME      packets for viewers
//   /api/streams     the live streams as JSON; null where there is no hub
//   /play/NAME       the page, which plays the live stream of that name
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/hub.h"
#include "live/nats_link.h"

namespace htvm::live {

// A file under a name of its own, wherever it lies.
struct NamedFile {
    std::string name;  // below /files/: segments joined by slashes
    std::string path;
};

struct FileServerOptions {
    std::string address = "127.0.0.1";  // to listen on
    std::uint16_t port = 0;             // 0: a free one
    std::string folder;                 // what is below /files/: its .htvm, .png and .jpg files ("": nothing),
    std::vector<NamedFile> files;       // or, if there are any, these, in this order
    bool other_sites = false;           // whether pages of other sites may read the streams (CORS)
    bool loopback_names = false;        // refuse requests whose Host is not this machine's loopback address
    unsigned connections = 512;         // at once; more are closed
    unsigned connections_per_address = 64;
    std::chrono::seconds header_time{10};  // for a whole request header, from the end of the response before
    std::chrono::seconds stall_time{30};   // for a client to take the next 64 KB
    // Of TCP, by the kernel's name for it; the kernel's own choice if it has none of this name.
    std::string congestion_control;
    NatsOptions nats{};  // joins the hub with those of other machines
    Hub* hub = nullptr;  // of live streams; null: there are none. It must outlive the server
};

class FileServer {
public:
    struct State;  // opaque

    // Listens; answers nothing before run(). bad_input if the folder cannot be read or the address is taken.
    static Result<FileServer> open(const FileServerOptions& options);
    FileServer(FileServer&&) noexcept;
    FileServer& operator=(FileServer&&) noexcept;
    ~FileServer();

    std::uint16_t port() const;
    // Of TCP, for connections from now on: what was asked for, or the kernel's own choice.
    std::string congestion_control() const;
    // Serves until stop() is called or the process is sent SIGINT or SIGTERM.
    void run();
    // From any thread; only between open() and the end of run().
    void stop();

private:
    explicit FileServer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

// Whether the player was built into this program.
bool has_player();

}  // namespace htvm::live
