// What the commands that connect to hubs share: the options, and what is said of the connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "htvm/packet.hpp"
#include "htvm/publisher.hpp"
#include "htvm/result.hpp"
#include "line_rate.h"

namespace CLI {
class App;
}

namespace htvm::app {

// The token in HTVM_TOKEN, by which a hub knows who publishes or watches; "" if there is none.
Result<std::string> token_of_environment();

// Whose certificates are taken of hubs that speak TLS.
struct HubTrust {
    std::string certificates;  // PEM file; empty: the system's
    bool insecure = false;     // anybody's
};
// Adds --ca and --insecure.
void add_hub_trust(CLI::App& command, HubTrust& trust);

struct PublishingOptions {
    std::string token, token_file;  // neither: what the environment variable HTVM_TOKEN has, if anything
    std::vector<std::string> other_hubs;
    HubTrust trust;
    bool stamps = false;
    bool ends = false;           // viewers are told that the stream has ended, when it has
    bool fixed_bitrate = false;  // while encoding: a full line does not lower the rate
};
// Adds --token, --token-file, --stamps and those of the trust.
void add_publishing_options(CLI::App& command, PublishingOptions& options);

// Where a stream goes.
enum class DestinationKind : std::uint8_t {
    file,             // that is there once it is whole
    standard_output,  // "-"
    hub,              // ws:// or wss://
    pipe,             // or a device: there already, and no file
};
struct Destination {
    std::string place;
    DestinationKind kind = DestinationKind::file;
    bool is_hub() const { return kind == DestinationKind::hub; }
    // Whether somebody may look on while it is written: a session number keeps it apart from a run before.
    bool may_be_live() const { return kind != DestinationKind::file; }
};
Destination destination_of(const std::string& path_or_address);

// A session number, another each time.
std::uint64_t random_session();

// Where a stream goes or comes from, for people: of an address what is not secret.
std::string shown_place(const std::string& path_or_address);

// Where a ladder's rung is published, by where the ladder is: the stream NAME~NUMBER (stream_name.h). Other hubs may be
// named without a stream, and stay as they are.
std::string rung_address(const std::string& address, std::size_t number);

// Publishes, and says on the terminal when the hub is lost and found again.
class Publishing {
public:
    static Result<Publishing> open(const std::string& address, const PublishingOptions& options);
    Result<void> send(const Packet& packet);
    bool wants_key_frame() { return publisher_.wants_key_frame(); }
    PublisherState state() const { return publisher_.state(); }
    LineState line() const;
    // For the line of progress: the rate of the last seconds, viewers, what waits, what was dropped.
    std::string progress();
    // Leaves once the hub has all of it.
    Result<void> finish();

private:
    Publishing(Publisher publisher, bool ends) : publisher_(std::move(publisher)), ends_(ends) {}
    void tell();

    Publisher publisher_;
    bool ends_;
    std::string told_;                                   // trouble, until a connection has stood
    std::uint64_t connections_ = 0;                      // when last looked at
    std::chrono::steady_clock::time_point connected_{};  // when the present connection was first seen
    std::chrono::steady_clock::time_point looked_{};     // when the rate was last measured
    std::uint64_t bytes_then_ = 0;
    double megabits_ = 0;
};

}  // namespace htvm::app
