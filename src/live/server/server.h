// The web server of `htvm serve`: the player's page, files of streams, and, with a hub, live streams. Which path leads
// where is told in live/files/routing.h. That of `htvm play`, for a person's own browser, is live/files/local_server.h.
//
// The parts, each with a state of its own, which no other reaches into:
//
//   Server           lifecycle: listens, accepts, reads files again, ends
//   HttpConnections  a connection: TLS, one request after the other, the responses     http_connections.h
//   route_of()       which handler a request is for                                     routing.h
//   Site             what the handlers answer from; they carry live streams, too        handlers.h
//   Admission        who may: by address, host, origin, token and link                  admission.h
//   Refusals         who was refused, counted by cause and told the log                 refusals.h
//
// Threads. run() is one thread: every connection, handler and timer runs on it, the hub is called on it, and so is the
// log; nothing here is locked. What a handler does without waiting holds up all others, so it must be short. With
// line_threads, what the kernel and TLS do for a connection is spread over these (live/client/line.h): they read,
// encrypt and write bytes that run() lends them, packets that all viewers share among these, and know nothing else.
// Each recording has a thread of its own, which writes to the disk (recorder.h), and so have NATS and its library,
// which only hand messages over (live/hub/nats_peering.h). stop() may be called on any thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/files/served_files.h"
#include "live/hub/hub.h"
#include "live/hub/nats_peering.h"
#include "live/server/admission.h"
#include "live/server/authority.h"

namespace htvm::live {

class LiveSegments;
class Recorder;

struct ServerOptions {
    std::string address = "127.0.0.1";  // to listen on
    std::uint16_t port = 0;             // 0: a free one
    // Others may listen there too (SO_REUSEPORT), such as the server that shall take over.
    bool share_port = false;
    // A socket that listens already, as systemd hands over; then address and port are its own. -1: none.
    int listening_socket = -1;
    // Threads, beside that of run(), over which what connections read, encrypt and write is spread. 0: run() does it.
    unsigned line_threads = 0;
    // TCP's congestion control, by the kernel's name for it; the kernel's own choice if it has none of this name.
    std::string congestion_control{};
    // PEM files, for TLS; both "": without. They are read again on SIGHUP together with those of AdmissionOptions: all
    // of them, or none if one is not as it should be.
    std::string certificate{}, private_key{};

    std::string folder{};            // what is below /files/: its .htvm, .png and .jpg files ("": nothing),
    std::vector<NamedFile> files{};  // or, if there are any, these, in this order
    Hub* hub = nullptr;              // of live streams; null: there are none. It must outlive the server
    NatsOptions nats{};              // joins the hub with those of other machines
    Recorder* recorder = nullptr;    // keeps the live streams as files; null: none. It must outlive the server

    // Offers the live streams as segments and playlists; null: not. It must outlive the server, and listens to the hub.
    LiveSegments* segments = nullptr;

    AdmissionOptions admission{};  // but for its .authority: that is there if it has an address
    AuthorityOptions authority{};  // who else says who may publish and watch
    // Addresses and networks whose word is taken for whom a connection or request is from (live/server/
    // trusted_proxies.h): in X-Forwarded-For, and, with proxy_protocol, in a header before everything else.
    std::vector<std::string> trusted_proxies{};
    bool proxy_protocol = false;
    std::chrono::seconds header_time{10};  // for a whole request header, from the end of the response before
    std::chrono::seconds stall_time{30};   // for a client to take the next 64 KB
    std::chrono::seconds drain_time{5};    // for connections to end, once the server is told to
    Log log{};                             // of what happens; run() calls it
    Log access_log{};                      // likewise of every request that was answered; empty: none
    std::function<void()> reload{};        // likewise on SIGHUP, before the files are read again
};

class Server {
public:
    struct State;  // opaque

    // Listens; answers nothing before run(). bad_input if the folder or one of the files cannot be read, or the address
    // is taken.
    static Result<Server> open(const ServerOptions& options);
    Server(Server&&) noexcept;
    Server& operator=(Server&&) noexcept;
    ~Server();

    std::uint16_t port() const;
    // TCP's congestion control for the connections that follow: what was asked for, or the kernel's own choice.
    std::string congestion_control() const;
    // Serves until stop() is called or the process is sent SIGINT or SIGTERM. Then publishers and viewers are told, and
    // no more let in, /readyz says so, and what others are being sent has drain_time to arrive; a second signal ends it
    // at once. Who connects meanwhile is answered here, unless the port is shared: then by whoever takes over.
    void run();
    // Ends run() at once, from any thread; only between open() and the end of run().
    void stop();

private:
    explicit Server(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
