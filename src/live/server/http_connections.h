// The connections of the server, each from its first byte to its end: TLS, then one request after the other and its
// response, until the client or a time limit ends it, or a request makes it carry a live stream.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <optional>
#include <set>

#include "live/client/line.h"
#include "live/server/handlers.h"

namespace htvm::live {

class HttpConnections {
public:
    // header_time: for a whole request header, from the end of the response before, and for agreeing on TLS. The site
    // must outlive the connections.
    HttpConnections(const Site& site, std::chrono::seconds header_time) : site_(site), header_time_(header_time) {}
    HttpConnections(const HttpConnections&) = delete;
    HttpConnections& operator=(const HttpConnections&) = delete;

    // Runs until the connection has ended. address: of the other side.
    boost::asio::awaitable<void> serve(Line line, boost::asio::ip::address address);
    // Ends connections that wait for a request now, and those that are being sent a response when they have it.
    void drain();

private:
    struct LiveRequest {
        Request request;
        Route route;
    };
    boost::asio::awaitable<std::optional<LiveRequest>> answer_requests(Line& line,
                                                                       const boost::asio::ip::address& address);
    void tell_too_slow(const boost::asio::ip::address& address);

    const Site& site_;
    std::chrono::seconds header_time_;
    std::set<Line*> idle_;  // that wait for a request
    bool draining_ = false;
};

}  // namespace htvm::live
