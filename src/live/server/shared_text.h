// A text that is work to make, such as the list of a folder's streams, for all who ask for it at about the same time.
// Whoever asks is given one that was begun after they asked, so it is never old; and however many ask, it is made no
// more often than the pause between two allows.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace htvm::live {

class SharedText {
public:
    using Text = std::shared_ptr<const std::string>;
    using Make = std::function<boost::asio::awaitable<std::string>()>;

    // make: called on the executor's thread, where fresh() must be called too; it may wait for another thread.
    // pause: from the end of one to the begin of the next.
    SharedText(boost::asio::any_io_executor executor, std::chrono::milliseconds pause, Make make);

    // Null if making it failed by an exception, such as for want of memory. It must live until the text has come.
    boost::asio::awaitable<Text> fresh();

private:
    std::chrono::milliseconds pause_;
    Make make_;
    boost::asio::steady_timer news_;                // cancelled, and so over, when a text has been made
    std::uint64_t begun_ = 0, made_ = 0;            // how many
    bool making_ = false;                           // or waiting until the pause is over
    std::chrono::steady_clock::time_point next_{};  // not before
    Text text_;
};

}  // namespace htvm::live
