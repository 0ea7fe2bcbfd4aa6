// Sends a stream to a hub while it is made, for others to watch (docs/live.md). htvm::live has it.
//
//   auto publisher = htvm::Publisher::open("wss://hub.example/publish/anna", {.token = token});  // Result<Publisher>
//   for each frame:
//       encoder->push(mesh, &pose, timestamp_us, publisher->wants_key_frame());
//       while (auto packet = encoder->pull()) publisher->send(*packet);
//   publisher->finish();
//
// The encoder is never held up: what the line does not take is dropped by the rule of dependency.hpp, so that what does
// arrive can be decoded. A lost line or a restarted hub ends nothing: the publisher connects again, to the next of the
// hubs that it knows, and goes on with what the newest frame needs.
//
// Threads and lifetimes. It has a thread of its own, which reads and writes the line, and ends with it. One at a time
// of the caller's threads may use it, but for state() and wants_key_frame(), which any may call at any time. Packets
// that it is given are copied.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct PublisherOptions {
    std::string token{};                    // of whoever may publish this stream; empty: none is sent
    std::vector<std::string> other_hubs{};  // addresses to go on with where the hub is lost; hubs tell of others, too
    std::string certificates{};             // PEM file of those who may vouch for a hub's; empty: the system's
    bool insecure = false;                  // takes any certificate: for tests alone
    std::size_t queue_bytes = std::size_t{4} << 20;  // how much may wait to be sent
    std::chrono::milliseconds queue_time{2000};      // and for how long
    bool stamps = false;                             // whether to send the time of each frame, for measurement
};

struct PublisherState {
    bool connected = false;
    std::string hub;                                      // the address in use, without what is secret
    std::uint64_t connections = 0;                        // made so far
    std::uint64_t sent_packets = 0, sent_bytes = 0;       // handed to the line
    std::uint64_t dropped_frames = 0;                     // not taken by the line in time, or while there was none
    std::size_t queue_bytes = 0;                          // how much waits to be sent
    std::chrono::milliseconds queue_time{};               // how long the first of it has waited
    std::optional<std::chrono::microseconds> round_trip;  // to the hub and back, once it is known
    std::optional<std::uint64_t> viewers;                 // by the hub's last heartbeat
    std::string trouble;                                  // why it is not connected, if so
    bool is_over = false;  // it is not connected and tries no more: the stream ended, or was refused for good
};

class Publisher {
public:
    struct State;  // opaque

    // Connects in the background. url: ws://HOST[:PORT]/publish/NAME, or wss:// for TLS. bad_input if an address is
    // wrong or the certificates cannot be read.
    static Result<Publisher> open(const std::string& url, const PublisherOptions& options = {});
    Publisher(Publisher&&) noexcept;
    Publisher& operator=(Publisher&&) noexcept;
    ~Publisher();  // as leave(), but what waits is lost

    // The stream's next packet: first a sequence header with a session of its own, drawn for this run
    // (EncoderOptions::session). Index packets are passed over. bad_input once the hub has refused the stream for good,
    // as for a wrong token; the sentence says why.
    Result<void> send(const Packet& packet);
    // Whether the next frame should be an I-frame, since somebody cannot go on without one. True once for each time.
    bool wants_key_frame();
    PublisherState state() const;
    // Sends what waits and ends the stream: viewers are told so. limit if the line did not take it all in this time.
    Result<void> finish(std::chrono::milliseconds timeout = std::chrono::seconds(5));
    // Likewise, but the stream does not end: the hub keeps it and its viewers for whoever goes on with it, for 10 s if
    // it was not told otherwise. For a program that is started again.
    Result<void> leave(std::chrono::milliseconds timeout = std::chrono::seconds(5));

private:
    explicit Publisher(std::unique_ptr<State> state);
    Result<void> end(std::string last_words, std::chrono::milliseconds timeout);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
