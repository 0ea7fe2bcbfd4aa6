// Waiting for what other threads do, whose time is theirs.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>

namespace htvm::live {

inline ::testing::AssertionResult soon(const std::function<bool()>& is_so) {
    for (int i = 0; i < 2000; ++i) {
        if (is_so()) return ::testing::AssertionSuccess();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return ::testing::AssertionFailure() << "not within ten seconds";
}

}  // namespace htvm::live
