#include "live/server/shared_text.h"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <new>
#include <string>
#include <vector>

namespace htvm::live {
namespace {

namespace net = boost::asio;

struct SharedTextTest : testing::Test {
    net::io_context context;
    int made = 0;
    bool fails = false;
    std::vector<std::string> got;
    SharedText text{context.get_executor(), std::chrono::milliseconds(1), [this]() -> net::awaitable<std::string> {
                        const auto number = std::to_string(++made);
                        // As one that waits for another thread.
                        co_await net::post(context, net::use_awaitable);
                        if (fails) throw std::bad_alloc();
                        co_return number;
                    }};

    void ask() {
        net::co_spawn(
            context,
            [this]() -> net::awaitable<void> {
                const auto one = co_await text.fresh();
                got.push_back(one ? *one : "none");
            },
            net::detached);
    }
};

TEST_F(SharedTextTest, ThoseWhoAskTogetherShareOne) {
    for (int i = 0; i < 400; ++i) ask();
    context.run();
    EXPECT_EQ(got, std::vector<std::string>(400, "1"));
}

TEST_F(SharedTextTest, WhoAsksWhileOneIsMadeIsGivenTheNext) {
    ask();
    while (made == 0) context.run_one();
    for (int i = 0; i < 3; ++i) ask();
    context.run();
    EXPECT_EQ(got, (std::vector<std::string>{"1", "2", "2", "2"}));
}

TEST_F(SharedTextTest, WhereMakingOneThrowsAllWhoWaitAreToldAndTheNextIsMade) {
    fails = true;
    for (int i = 0; i < 3; ++i) ask();
    context.run();
    EXPECT_EQ(got, std::vector<std::string>(3, "none"));
    fails = false;
    ask();
    context.restart();
    context.run();
    EXPECT_EQ(got.back(), "2");
}

}  // namespace
}  // namespace htvm::live
