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
//   /publish/NAME    packets from a publisher: one with the stream's token, or, where no publishers are known, a
//   program
//                    on this machine
//   /watch/NAME      packets for viewers
//   /api/streams     the live streams as JSON; null where there is no hub
//   /play/NAME       the page, which plays the live stream of that name
//
// For those who run it:
//   /healthz         "ok", or 503 once the server is ending
//   /metrics         what it counts (live/server/metrics.h)
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/hub/hub.h"
#include "live/hub/nats_link.h"

namespace htvm::live {

class Recorder;

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
    bool other_sites = false;           // whether pages of any other site may read the streams (CORS, WebSockets),
    std::vector<std::string> origins;   // or, if there are any, those of these sites alone: "https://a.example"
    bool loopback_names = false;        // refuse requests whose Host is not this machine's loopback address
    unsigned connections = 512;         // at once; more are closed
    unsigned connections_per_address = 64;
    std::chrono::seconds header_time{10};   // for a whole request header, from the end of the response before
    std::chrono::seconds stall_time{30};    // for a client to take the next 64 KB
    unsigned viewers_per_address = 64;      // of live streams
    std::chrono::seconds refusal_delay{1};  // for who publishes by a wrong token, so that many cannot be tried
    std::chrono::seconds drain_time{5};     // for connections to end, once the server is told to
    // Of TCP, by the kernel's name for it; the kernel's own choice if it has none of this name.
    std::string congestion_control{};
    NatsOptions nats{};  // joins the hub with those of other machines
    // Files by which to decide; all are read again on SIGHUP, or none of them if one is not as it should be.
    std::string certificate, private_key;  // PEM: with TLS; both "": without
    std::string publishers;                // who may publish what; "": programs on this machine, anything
    std::string link_keys;         // of links (live/server/access.h), without which nothing can be watched; "": anyone
    Hub* hub = nullptr;            // of live streams; null: there are none. It must outlive the server
    Recorder* recorder = nullptr;  // keeps the live streams as files; null: none. It must outlive the server
    bool metrics_anyone = false;   // /metrics for everybody, not for programs on this machine alone
    Log log{};                     // of what happens; run() calls it
};

class FileServer {
public:
    struct State;  // opaque

    // Listens; answers nothing before run(). bad_input if the folder or one of the files cannot be read, or the address
    // is taken.
    static Result<FileServer> open(const FileServerOptions& options);
    FileServer(FileServer&&) noexcept;
    FileServer& operator=(FileServer&&) noexcept;
    ~FileServer();

    std::uint16_t port() const;
    // Of TCP, for connections from now on: what was asked for, or the kernel's own choice.
    std::string congestion_control() const;
    // Serves until stop() is called or the process is sent SIGINT or SIGTERM. Then nobody is let in any more, viewers
    // and publishers are told, and what others are being sent has drain_time to arrive; a second signal ends it at
    // once.
    void run();
    // At once, from any thread; only between open() and the end of run().
    void stop();

private:
    explicit FileServer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

// Whether the player was built into this program.
bool has_player();

}  // namespace htvm::live
