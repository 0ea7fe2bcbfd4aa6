// Who was refused, and why: counted by cause for /metrics, and told the log, but not more often than somebody can read.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <boost/beast/http/status.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "live/client/control.h"
#include "live/files/response.h"
#include "live/hub/event.h"

namespace htvm::live {

// Why a request is not answered as its sender wishes.
struct Refusal {
    std::string cause;  // a word, to count by
    std::string why;    // a sentence for the other side
    boost::beast::http::status status = boost::beast::http::status::forbidden;
    CloseCode code = CloseCode::refused;  // instead, of a WebSocket that is opened only to say why
    std::chrono::seconds delay{};         // before it is said
    bool may_be_asked = false;            // the authority may say otherwise (live/server/authority.h)
};
// The sentence that says why.
Response refusing_response(const Refusal& refusal, ResponseHeader header);

class Refusals {
public:
    explicit Refusals(Log log) : log_(std::move(log)) {}

    // Counts one.
    void count(const std::string& cause) { ++by_cause_[cause]; }
    // Counts one and logs it. Among very many in a second only the first are logged, and how many there were.
    // stream: the one that was asked for, whatever its name is; "": none.
    void tell(const Refusal& refusal, const std::string& stream, const boost::asio::ip::address& address);
    // To be called each second.
    void end_second();

    const std::map<std::string, std::uint64_t>& by_cause() const { return by_cause_; }

private:
    Log log_;
    std::map<std::string, std::uint64_t> by_cause_{{"connections", 0}};
    std::uint64_t in_second_ = 0;  // those for the log
};

}  // namespace htvm::live
