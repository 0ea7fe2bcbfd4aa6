// A live encoder's rate follows a line that is slower than asked for, and comes back.
#include "line_rate.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace htvm::app {
namespace {

using namespace std::chrono_literals;

// An encoder that makes exactly its rate at 30 frames a second, and a line before which its packets wait.
struct Simulation {
    explicit Simulation(double wanted) : rate(wanted) {}

    // Plays seconds over a line of so many bits a second; returns the longest wait.
    std::chrono::milliseconds play(double seconds, double line_bits_per_second) {
        std::chrono::milliseconds longest{};
        for (int frame = 0; frame < static_cast<int>(seconds * 30); ++frame) {
            now += 33333us;
            made += rate.bits_per_second() / 30 / 8;
            sent = std::min(made, sent + line_bits_per_second / 30 / 8);
            const double wait = line_bits_per_second > 0 ? (made - sent) * 8 / line_bits_per_second : 10;
            const std::chrono::milliseconds waits(static_cast<int>(1000 * wait));
            longest = std::max(longest, waits);
            if (rate.follow({now, connected, waits, static_cast<std::uint64_t>(sent)})) ++changes;
        }
        return longest;
    }

    LineRate rate;
    std::chrono::steady_clock::time_point now{1h};
    double made = 0, sent = 0;  // bytes
    bool connected = true;
    int changes = 0;
};

TEST(LineRate, StaysWhereTheLineCarriesWhatWasAskedFor) {
    Simulation simulation(2e6);
    simulation.play(30, 2.1e6);
    EXPECT_EQ(simulation.changes, 0);
}

TEST(LineRate, FallsBelowASlowerLineBeforeTwoSecondsWaitAndThenNothingWaits) {
    Simulation simulation(2e6);
    simulation.play(5, 3e6);
    EXPECT_LT(simulation.play(10, 1e6), 2000ms) << "the publisher's queue would drop frames";
    EXPECT_LT(simulation.rate.bits_per_second(), 1.2e6);
    EXPECT_GT(simulation.rate.bits_per_second(), 0.5e6) << "most of the line is used";
    EXPECT_LT(simulation.play(60, 1e6), 600ms) << "though the rate keeps trying for more";
}

TEST(LineRate, ComesBackOnceTheLineIsFaster) {
    Simulation simulation(2e6);
    simulation.play(20, 0.8e6);
    ASSERT_LT(simulation.rate.bits_per_second(), 1e6);
    simulation.play(30, 5e6);
    EXPECT_EQ(simulation.rate.bits_per_second(), 2e6);
}

TEST(LineRate, NeverFallsBelowASixteenthNorRisesAboveWhatWasAskedFor) {
    Simulation simulation(1.6e6);
    simulation.play(60, 1000);
    EXPECT_EQ(simulation.rate.bits_per_second(), 0.1e6);
}

TEST(LineRate, DoesNotTakeALostHubForASlowLine) {
    Simulation simulation(2e6);
    simulation.connected = false;
    simulation.play(10, 0);
    EXPECT_EQ(simulation.changes, 0);
}

}  // namespace
}  // namespace htvm::app
