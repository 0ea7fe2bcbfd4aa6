// Live streams in C: what is published is watched, and what goes wrong is a status with a sentence.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "htvm/htvm_live.h"
#include "live_packets.h"
#include "server_test.h"

namespace htvm::live {
namespace {

struct End {
    void operator()(htvm_publisher* publisher) const { htvm_publisher_destroy(publisher); }
    void operator()(htvm_watcher* watcher) const { htvm_watcher_destroy(watcher); }
};

class CLiveTest : public ServerTest {
protected:
    CLiveTest() {
        options.hub = &hub;
        options.folder.clear();
    }
    std::string url(const std::string& path) const { return "ws://127.0.0.1:" + std::to_string(server->port()) + path; }
    std::unique_ptr<htvm_publisher, End> publisher() const {
        htvm_publisher* out = nullptr;
        EXPECT_EQ(htvm_publisher_create(url("/publish/anna").c_str(), nullptr, &out, nullptr, 0), HTVM_OK);
        return std::unique_ptr<htvm_publisher, End>(out);
    }
    std::unique_ptr<htvm_watcher, End> watcher() const {
        htvm_watcher* out = nullptr;
        EXPECT_EQ(htvm_watcher_create(url("/watch/anna").c_str(), nullptr, &out, nullptr, 0), HTVM_OK);
        return std::unique_ptr<htvm_watcher, End>(out);
    }
    Hub hub;
};

TEST_F(CLiveTest, WhatIsPublishedIsWatchedByteByByteToTheEnd) {
    start();
    const auto sends = publisher();
    const auto watches = watcher();
    std::vector<std::uint8_t> sent;
    for (const auto& packet : {live_header(7), live_intra(0), live_tracked(1)}) {
        const auto bytes = write_packet(packet);
        sent.insert(sent.end(), bytes.begin(), bytes.end());
    }
    ASSERT_EQ(htvm_publisher_send(sends.get(), sent.data(), sent.size()), HTVM_OK);
    std::vector<std::uint8_t> came;
    const std::uint8_t* bytes = nullptr;
    std::size_t count = 0;
    while (came.size() < sent.size()) {
        ASSERT_EQ(htvm_watcher_receive(watches.get(), 20000, &bytes, &count), HTVM_OK);
        came.insert(came.end(), bytes, bytes + count);
    }
    EXPECT_EQ(came, sent);
    EXPECT_EQ(htvm_watcher_receive(watches.get(), 10, &bytes, &count), HTVM_AGAIN);
    EXPECT_EQ(count, 0u);
    htvm_publisher_state state;
    ASSERT_EQ(htvm_publisher_get_state(sends.get(), &state, sizeof state), HTVM_OK);
    EXPECT_EQ(state.sent_packets, 3u);
    EXPECT_EQ(state.connections, 1u);
    EXPECT_EQ(htvm_publisher_finish(sends.get(), 1, 20000), HTVM_OK);
    EXPECT_EQ(htvm_watcher_receive(watches.get(), 20000, &bytes, &count), HTVM_END);
}

TEST_F(CLiveTest, WrongCallsAreStatusesWithASentence) {
    start();
    char problem[200] = "";
    htvm_watcher* none = nullptr;
    EXPECT_EQ(htvm_watcher_create("http://127.0.0.1/watch/anna", nullptr, &none, problem, sizeof problem),
              HTVM_BAD_INPUT);
    EXPECT_EQ(none, nullptr);
    EXPECT_NE(std::string(problem), "");
    htvm_live_options never_set{};
    EXPECT_EQ(htvm_watcher_create(url("/watch/anna").c_str(), &never_set, &none, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_watcher_create(nullptr, nullptr, &none, nullptr, 0), HTVM_BAD_INPUT);
    const auto sends = publisher();
    const auto bytes = write_packet(live_header(7));
    EXPECT_EQ(htvm_publisher_send(sends.get(), bytes.data(), bytes.size() - 1), HTVM_CORRUPT_STREAM);
    EXPECT_STREQ(htvm_publisher_last_error(sends.get()), "the bytes are not whole packets");
    EXPECT_EQ(htvm_publisher_send(sends.get(), nullptr, 5), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_publisher_send(nullptr, bytes.data(), bytes.size()), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_publisher_wants_key_frame(nullptr), 0);
    htvm_publisher_destroy(nullptr);
    htvm_watcher_destroy(nullptr);
    htvm_watcher_stop(nullptr);
}

TEST_F(CLiveTest, AWatcherThatIsStoppedHasEnded) {
    start();
    const auto watches = watcher();
    std::thread stopping([&] { htvm_watcher_stop(watches.get()); });
    const std::uint8_t* bytes = nullptr;
    std::size_t count = 0;
    EXPECT_EQ(htvm_watcher_receive(watches.get(), 60000, &bytes, &count), HTVM_END);
    stopping.join();
}

}  // namespace
}  // namespace htvm::live
