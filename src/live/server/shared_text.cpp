#include "live/server/shared_text.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

namespace htvm::live {

namespace net = boost::asio;

constexpr auto awaited = net::as_tuple(net::use_awaitable);

SharedText::SharedText(net::any_io_executor executor, std::chrono::milliseconds pause, Make make)
    : pause_(pause), make_(std::move(make)), news_(std::move(executor), std::chrono::steady_clock::time_point::max()) {}

net::awaitable<SharedText::Text> SharedText::fresh() {
    const auto wanted = begun_ + 1;
    while (made_ < wanted) {
        if (making_) {
            co_await news_.async_wait(awaited);
            continue;
        }
        making_ = true;
        net::steady_timer pause(news_.get_executor(), next_);
        co_await pause.async_wait(awaited);
        ++begun_;
        try {
            text_ = std::make_shared<const std::string>(co_await make_());
        } catch (...) {
            // Whoever waits is told; who asks later has it tried again.
            text_.reset();
        }
        made_ = begun_;
        making_ = false;
        next_ = std::chrono::steady_clock::now() + pause_;
        news_.cancel();
    }
    co_return text_;
}

}  // namespace htvm::live
