// A web service of the operator's that says who may publish and who may watch. It is sent a POST of JSON:
//
//   {"action": "publish" | "watch", "stream": NAME, "address": OF THE CLIENT, "token": TEXT, "" IF NONE}
//
// and answers 200, which is yes, or 403, no. Whatever else it does, take too long, cannot be reached, or redirects, is
// no answer, and lets nobody in. An answer holds for as long as its header Cache-Control says by max-age (an hour at
// most, no time without), for the same question.
#pragma once

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "htvm/result.hpp"
#include "live/client/hub_address.h"

namespace htvm::live {

struct AuthorityOptions {
    std::string url{};                     // http:// or https://, by the system's certificates; "": nobody is asked
    std::chrono::milliseconds time{5000};  // from a question to its answer, waiting for others included
    std::size_t at_once = 16;              // questions that are on their way,
    std::size_t waiting = 256;             // and that wait for those; there is no answer to what comes beyond
    std::size_t remembered = 4096;         // answers
};

struct Question {
    std::string action, stream, address, token;
};

enum class Answer : std::uint8_t { yes, no, none };

struct AuthorityCounters {
    std::uint64_t asked = 0, remembered = 0;  // that were sent, and that were not, since the answer was known
    std::uint64_t yes = 0, no = 0, none = 0;  // answers to those that were sent, or had to be
};

// One thread's.
class Authority {
public:
    // bad_input: the address is none.
    static Result<Authority> open(const AuthorityOptions& options);

    // It must live until the answer has come.
    boost::asio::awaitable<Answer> ask(Question question);
    const AuthorityCounters& counters() const { return counters_; }

private:
    using Clock = std::chrono::steady_clock;
    using Hash = std::array<std::uint8_t, 32>;
    struct Known {
        Answer answer = Answer::none;
        Clock::time_point until{};
    };
    struct Reply {
        Answer answer = Answer::none;
        std::chrono::seconds holds{0};
    };
    Authority(AuthorityOptions options, HubAddress address);
    struct Turn;
    boost::asio::awaitable<Reply> ask_in_turn(const std::string& text);
    boost::asio::awaitable<Reply> exchange(const std::string& text, Clock::time_point deadline);
    void remember(const Hash& question, const Reply& reply);

    AuthorityOptions options_;
    HubAddress address_;
    boost::asio::ssl::context tls_;
    std::map<Hash, Known> known_{};
    std::size_t asking_ = 0, waiting_ = 0;
    std::shared_ptr<boost::asio::steady_timer> turn_{};  // one who waits for it is woken when another has an answer
    AuthorityCounters counters_{};
};

// For how long an answer holds whose header Cache-Control is this.
std::chrono::seconds max_age(std::string_view cache_control);

}  // namespace htvm::live
