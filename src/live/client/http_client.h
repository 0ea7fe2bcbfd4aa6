// Fetches files by HTTP and HTTPS, one after another: the playlists and segments of a stream. The connection stays for
// the next file of the same host. Servers may say anything.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/client/hub_address.h"

namespace htvm::live {

struct HttpClientOptions {
    std::string token{};                       // sent as Authorization: Bearer to the host asked first; empty: none
    std::string certificates{};                // PEM file of those who may vouch for a server; empty: the system's
    bool insecure = false;                     // takes any certificate
    std::chrono::milliseconds patience{8000};  // with each step: connecting, and waiting for more of the answer
    std::function<bool()> is_stopped{};        // asked ten times a second: whether to give up
};

struct HttpAnswer {
    unsigned status = 0;
    std::vector<std::uint8_t> body{};  // of a status from 200 to 299 alone
    std::string said{};                // of another status: the first line of what it says, for people
    HubAddress address{};              // that answered: where redirects led
};

class HttpClient {
public:
    // bad_input if the certificates cannot be read.
    static Result<HttpClient> create(const HttpClientOptions& options);
    HttpClient(HttpClient&&) noexcept;
    HttpClient& operator=(HttpClient&&) noexcept;
    ~HttpClient();

    // Follows at most five redirects, and none from https to http. corrupt_stream if no answer comes, or not all of
    // it; limit if it is larger than most_bytes, for which no more memory is taken.
    Result<HttpAnswer> get(const HubAddress& address, std::size_t most_bytes);

private:
    struct State;
    explicit HttpClient(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
