#include "core/disjoint_sets.h"

#include <gtest/gtest.h>

namespace htvm::internal {
namespace {

TEST(DisjointSets, AreNamedByTheirLowestNumberInWhateverOrderTheyWereJoined) {
    DisjointSets sets(6);
    EXPECT_TRUE(sets.join(4, 5));
    EXPECT_TRUE(sets.join(5, 2));
    EXPECT_TRUE(sets.join(3, 1));
    EXPECT_FALSE(sets.join(2, 4));
    EXPECT_EQ(sets.of(0), 0u);
    for (const std::uint32_t i : {2, 4, 5}) EXPECT_EQ(sets.of(i), 2u);
    for (const std::uint32_t i : {1, 3}) EXPECT_EQ(sets.of(i), 1u);
}

}  // namespace
}  // namespace htvm::internal
