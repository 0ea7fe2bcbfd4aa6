// Equal values of several floats.
#include "core/equal_floats.h"

#include <gtest/gtest.h>

namespace htvm::internal {
namespace {

TEST(EqualFloats, EachHasTheIndexOfTheFirstThatEqualsIt) {
    const std::vector<std::array<float, 3>> places{{1, 2, 3}, {3, 2, 1}, {1, 2, 3}, {0, 0, 0}, {-0.0f, 0, -0.0f}};
    EXPECT_EQ(first_equal(std::span(places)), (std::vector<std::uint32_t>{0, 1, 0, 3, 3}));
    EXPECT_TRUE(first_equal(std::span<const std::array<float, 2>>()).empty());
}

TEST(EqualFloats, TheSameNumbersInAnotherOrderHaveAnotherHash) {
    EXPECT_NE(FloatsHash()(std::array{1.0f, 2.0f, 3.0f}), FloatsHash()(std::array{3.0f, 2.0f, 1.0f}));
    EXPECT_EQ(FloatsHash()(std::array{0.0f, 1.0f}), FloatsHash()(std::array{-0.0f, 1.0f}));
}

}  // namespace
}  // namespace htvm::internal
