// The connections of the server, each from its first byte to its end: whom a proxy says it is for, TLS, then one
// request after the other and its response, until the client or a time limit ends it, or a request makes it carry a
// live stream.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/status.hpp>
#include <chrono>
#include <optional>
#include <set>
#include <string_view>

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

    // Runs until the connection has ended, which is counted by why. address: of the other side.
    boost::asio::awaitable<void> serve(Line line, boost::asio::ip::address address);
    // Ends connections that wait for a request now, and those that are being sent a response when they have it.
    void drain();

private:
    struct LiveRequest {
        Request request;
        Route route;
    };
    struct RequestRead {
        std::optional<Request> request;  // none: the connection is of no use any more,
        boost::beast::http::status status = boost::beast::http::status::ok;  // which is said so, unless this is ok
        const char* why = "";
    };
    boost::asio::awaitable<std::optional<Client>> read_proxy_header(Line& line,
                                                                    const boost::asio::ip::address& address);
    boost::asio::awaitable<RequestRead> read_request(Line& line, boost::beast::flat_buffer& buffer,
                                                     const boost::asio::ip::address& address);
    boost::asio::awaitable<std::optional<LiveRequest>> answer_requests(Line& line, const Client& connected);
    boost::asio::awaitable<void> carry_live(Line line, LiveRequest live, Client client, bool has_place);
    void tell_access(const Request& request, const Client& client, std::uint64_t status, std::string_view bytes,
                     std::chrono::steady_clock::time_point since) const;
    void tell_too_slow(const boost::asio::ip::address& address);
    void closed(const char* why) { ++site_.traffic.closed[why]; }

    const Site& site_;
    std::chrono::seconds header_time_;
    std::set<Line*> idle_;  // that wait for a request
    bool draining_ = false;
};

}  // namespace htvm::live
