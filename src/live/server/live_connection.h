// The connections over which live streams come and go. One binary message of a WebSocket is one packet as it stands in
// a file (subprotocol htvm.1), text messages are those of live/client/control.h; an endless HTTP body is the same
// packets one after the other, for proxies that block WebSockets. Each coroutine runs until its connection ends, and
// all run on one thread.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <string>

#include "live/client/control.h"
#include "live/client/line.h"
#include "live/files/http_request.h"
#include "live/files/response.h"
#include "live/hub/hub.h"

namespace htvm::live {

// The request asks for a WebSocket; `name` is the stream's.
boost::asio::awaitable<void> publish_by_socket(Line line, Request request, std::string name, Hub& hub);
boost::asio::awaitable<void> watch_by_socket(Line line, Request request, std::string name, Hub& hub);
// Opens a WebSocket, which the request asks for, only to close it with this code and reason.
boost::asio::awaitable<void> refuse_socket(Line line, Request request, CloseCode code, std::string why);
// Sends response and body. header: what every response has; the status is 404 or 503 if the stream cannot be watched.
boost::asio::awaitable<void> watch_by_body(Line& line, ResponseHeader header, std::string name, Hub& hub);

}  // namespace htvm::live
