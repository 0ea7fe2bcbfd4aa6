#include "core/lattice.h"

#include <gtest/gtest.h>

namespace htvm::internal {
namespace {

TEST(Lattice, QuotientsRoundToTheNearestAndHalvesAwayFromZero) {
    EXPECT_EQ(divide_rounded(0, 7), 0);
    EXPECT_EQ(divide_rounded(3, 2), 2);
    EXPECT_EQ(divide_rounded(-3, 2), -2);
    EXPECT_EQ(divide_rounded(1, 3), 0);
    EXPECT_EQ(divide_rounded(2, 3), 1);
    EXPECT_EQ(divide_rounded(-2, 3), -1);
    for (std::int64_t denominator = 1; denominator < 40; ++denominator)
        for (std::int64_t numerator = -200; numerator <= 200; ++numerator) {
            const double exact = static_cast<double>(numerator) / static_cast<double>(denominator);
            EXPECT_EQ(divide_rounded(numerator, denominator), std::llround(exact));
            EXPECT_EQ(divide_rounded(-numerator, denominator), -divide_rounded(numerator, denominator));
        }
}

TEST(Lattice, TheLimitItselfIsOnTheLattice) {
    EXPECT_TRUE(on_lattice({lattice_limit, -lattice_limit, 0}));
    EXPECT_FALSE(on_lattice({lattice_limit + 1, 0, 0}));
    EXPECT_FALSE(on_lattice({0, -lattice_limit - 1, 0}));
    EXPECT_FALSE(on_lattice({0, 0, lattice_limit + 1}));
}

TEST(Lattice, SquaredDistancesAreExactFromCornerToCorner) {
    const LatticePoint low{-lattice_limit, -lattice_limit, -lattice_limit};
    const LatticePoint high{lattice_limit, lattice_limit, lattice_limit};
    EXPECT_EQ(squared_distance(low, high), 3 * (std::int64_t{1} << 50));
    EXPECT_EQ(squared_distance(low, high + LatticePoint{-1, 0, 0}),
              3 * (std::int64_t{1} << 50) - (std::int64_t{1} << 26) + 1);
    EXPECT_EQ(squared_distance({1, 2, 3}, {4, 6, 3}), 25);
    EXPECT_EQ(static_cast<std::int64_t>(static_cast<double>(squared_distance(low, high) - 1)),
              squared_distance(low, high) - 1);
}

TEST(Lattice, PointsAddAndCompareByComponents) {
    EXPECT_EQ((LatticePoint{1, 2, 3} + LatticePoint{-4, 5, 6}), (LatticePoint{-3, 7, 9}));
    EXPECT_EQ((LatticePoint{1, 2, 3} - LatticePoint{-4, 5, 6}), (LatticePoint{5, -3, -3}));
    EXPECT_LT((LatticePoint{1, 9, 9}), (LatticePoint{2, 0, 0}));
    EXPECT_LT((LatticePoint{1, 1, 0}), (LatticePoint{1, 1, 1}));
}

}  // namespace
}  // namespace htvm::internal
