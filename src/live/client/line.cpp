#include "live/client/line.h"

#include <netinet/tcp.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <optional>
#include <variant>

namespace htvm::live {

namespace net = boost::asio;
namespace beast = boost::beast;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::chrono::seconds leave_time{1};

struct Line::State : std::enable_shared_from_this<Line::State> {
    std::variant<beast::tcp_stream, Secure> stream;
    executor_type home;
    bool elsewhere;  // the stream's thread is another one than its home: then it alone touches the stream
    // The time limit of what begins next, if it is another one than that of what began before: the home's.
    std::optional<std::chrono::steady_clock::time_point> expires{};

    State(beast::tcp_stream tcp, net::ssl::context* context, executor_type its_home)
        : stream(context ? decltype(stream)(std::in_place_type<Secure>, std::move(tcp), *context)
                         : decltype(stream)(std::in_place_type<beast::tcp_stream>, std::move(tcp))),
          home(std::move(its_home)),
          elsewhere(this->tcp().get_executor() != home) {}

    Secure* secure() { return std::get_if<Secure>(&stream); }
    beast::tcp_stream& tcp() {
        if (auto* tls = secure()) return tls->next_layer();
        return std::get<beast::tcp_stream>(stream);
    }
    void limit(std::chrono::steady_clock::time_point time) {
        if (time == std::chrono::steady_clock::time_point::max())
            tcp().expires_never();
        else
            tcp().expires_at(time);
    }

    // On the stream's thread.
    template <class Act>
    void act(Act what) {
        if (!elsewhere) return what(*this);
        net::post(tcp().get_executor(), [self = shared_from_this(), what = std::move(what)] { what(*self); });
    }
    // Begins an operation by start(state, done) on the stream's thread; its end comes back to the home. Without
    // an executor of its own, what it does in between stays on the stream's.
    template <class Start, class Done>
    void begin(Start start, Done done) {
        const auto limit_of_it = std::exchange(expires, std::nullopt);
        if (!elsewhere) {
            if (limit_of_it) limit(*limit_of_it);
            // Boost.Beast asks its executor for more than that of the given one can do.
            return start(*this, net::bind_executor(home, std::move(done)));
        }
        net::post(tcp().get_executor(), [self = shared_from_this(), limit_of_it, start = std::move(start),
                                         done = std::move(done)]() mutable {
            auto& state = *self;
            if (limit_of_it) state.limit(*limit_of_it);
            start(state, [self = std::move(self), done = std::move(done)](auto... results) mutable {
                net::post(self->home, [done = std::move(done), results...]() mutable { std::move(done)(results...); });
            });
        });
    }
};

Line::Line(beast::tcp_stream tcp) {
    auto home = tcp.get_executor();
    state_ = std::make_shared<State>(std::move(tcp), nullptr, std::move(home));
}

Line::Line(beast::tcp_stream tcp, net::ssl::context& context) {
    auto home = tcp.get_executor();
    state_ = std::make_shared<State>(std::move(tcp), &context, std::move(home));
}

Line::Line(beast::tcp_stream tcp, net::ssl::context* context, executor_type home)
    : state_(std::make_shared<State>(std::move(tcp), context, std::move(home))) {}

// The stream ends on its own thread, where its timers are.
Line::~Line() {
    if (!state_ || !state_->elsewhere) return;
    auto executor = state_->tcp().get_executor();
    net::post(executor, [state = std::move(state_)] {});
}

Line::executor_type Line::get_executor() const { return state_->home; }
Line::Secure* Line::secure() { return state_->secure(); }

net::awaitable<beast::error_code> Line::handshake(net::ssl::stream_base::handshake_type side) {
    if (!state_->secure()) co_return beast::error_code();
    const auto shake = [this, side](Ended done) {
        state_->begin([side](State& state, auto then) { state.secure()->async_handshake(side, std::move(then)); },
                      std::move(done));
    };
    const auto [error] = co_await net::async_initiate<decltype(awaited), void(beast::error_code)>(shake, awaited);
    co_return error;
}

net::awaitable<void> Line::close() {
    if (state_->secure()) {
        expires_after(leave_time);
        const auto leave = [this](Ended done) {
            state_->begin([](State& state, auto then) { state.secure()->async_shutdown(std::move(then)); },
                          std::move(done));
        };
        co_await net::async_initiate<decltype(awaited), void(beast::error_code)>(leave, awaited);
    }
    state_->act([](State& state) {
        beast::error_code ignored;
        state.tcp().socket().shutdown(net::ip::tcp::socket::shutdown_both, ignored);
    });
}

void Line::cut() {
    state_->act([](State& state) { state.tcp().close(); });
}

void Line::cancel() {
    state_->act([](State& state) { state.tcp().cancel(); });
}

void Line::expires_after(std::chrono::steady_clock::duration time) {
    state_->expires = std::chrono::steady_clock::now() + time;
}

void Line::expires_never() { state_->expires = std::chrono::steady_clock::time_point::max(); }

void Line::read_some(const Buffers<net::mutable_buffer>& buffers, Done done) {
    state_->begin(
        [buffers](State& state, auto then) {
            if (auto* tls = state.secure()) return tls->async_read_some(buffers, std::move(then));
            state.tcp().async_read_some(buffers, std::move(then));
        },
        std::move(done));
}

void Line::read_below_tls(const Buffers<net::mutable_buffer>& buffers, Done done) {
    state_->begin([buffers](State& state, auto then) { state.tcp().async_read_some(buffers, std::move(then)); },
                  std::move(done));
}

void Line::write_some(const Buffers<net::const_buffer>& buffers, Done done) {
    state_->begin(
        [buffers](State& state, auto then) {
            if (auto* tls = state.secure()) return tls->async_write_some(buffers, std::move(then));
            state.tcp().async_write_some(buffers, std::move(then));
        },
        std::move(done));
}

void Line::end(beast::role_type role, Ended ended) {
    state_->begin(
        [role](State& state, auto then) {
            using beast::websocket::async_teardown;
            if (auto* tls = state.secure()) return async_teardown(role, *tls, std::move(then));
            async_teardown(role, state.tcp().socket(), std::move(then));
        },
        std::move(ended));
}

void Line::keep_kernel_buffers_small() {
    constexpr int unsent = 16384, sent = 131072;
    auto& socket = state_->tcp().socket();
    beast::error_code ignored;
    socket.set_option(net::ip::tcp::no_delay(true), ignored);
    socket.set_option(net::socket_base::send_buffer_size(sent), ignored);
    ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
}

}  // namespace htvm::live
