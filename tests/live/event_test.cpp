// Events as the lines that people and machines read.
#include "live/hub/event.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace htvm::live {
namespace {

// 2026-11-22 13:05:51.007 UTC
const auto time = std::chrono::system_clock::time_point(std::chrono::milliseconds(1795352751007));

TEST(Event, IsOneLineForPeopleAndOneObjectForMachines) {
    const Event left{"left", "the publisher left after 12 packets", "anna", "192.0.2.1", {{"packets", 12}}, false};
    EXPECT_EQ(text_line(left, time), "13:05:51Z anna: the publisher left after 12 packets (192.0.2.1)");
    EXPECT_EQ(json_line(left, time),
              R"({"time":"2026-11-22T13:05:51.007Z","event":"left","text":"the publisher left after 12 packets",)"
              R"("stream":"anna","address":"192.0.2.1","packets":12})");
    const Event full{.name = "disk_full", .text = "recording stops", .warning = true};
    EXPECT_EQ(text_line(full, time), "13:05:51Z recording stops");
    EXPECT_EQ(json_line(full, time), R"({"time":"2026-11-22T13:05:51.007Z","event":"disk_full",)"
                                     R"("text":"recording stops","warning":true})");
}

TEST(Event, ANameCannotWriteLinesOrControlATerminal) {
    const Event hostile{.name = "refused", .text = "refused", .stream = "a\n\x1b[2J\xff"};
    EXPECT_EQ(text_line(hostile, time), "13:05:51Z a??[2J?: refused");
    EXPECT_EQ(json_line(hostile, time), R"({"time":"2026-11-22T13:05:51.007Z","event":"refused","text":"refused",)"
                                        R"("stream":"a\n\u001b[2J\ufffd"})");
}

TEST(Event, OfANameOnlySoManyAreToldInASecond) {
    std::vector<std::string> told;
    const auto log = limited([&](const Event& event) { told.push_back(event.name + ' ' + event.text); }, 2);
    for (int i = 0; i < 100; ++i) log({.name = "refused", .text = "no"});
    log({.name = "published", .text = "yes"});
    EXPECT_EQ(told, (std::vector<std::string>{"refused no", "refused no", "published yes"}));
}

}  // namespace
}  // namespace htvm::live
