#include "endurance.h"

#include <gtest/gtest.h>

namespace htvm::lab {
namespace {

std::vector<EnduranceRow> rows_of(std::initializer_list<double> megabits) {
    std::vector<EnduranceRow> out;
    for (const double value : megabits) {
        out.emplace_back();
        out.back().megabits = value;
    }
    return out;
}

const EnduranceMeasure& bits = endurance_measures[0];

TEST(Growth, is_that_of_the_last_fifth_over_the_second) {
    EXPECT_DOUBLE_EQ(*growth(rows_of({90, 2, 50, 60, 3}), bits), 1.5);
    EXPECT_DOUBLE_EQ(*growth(rows_of({90, 90, 1, 3, 0, 0, 0, 0, 4, 4}), bits), 2);
    EXPECT_DOUBLE_EQ(*growth(rows_of({9, 4, 4, 4, 4}), bits), 1);
}

TEST(Growth, of_what_is_never_there_is_flat_and_of_what_comes_is_not_known) {
    EXPECT_EQ(growth(rows_of({0, 0, 0, 0, 0}), bits), 1.0);
    EXPECT_FALSE(growth(rows_of({0, 0, 0, 0, 1}), bits));
    EXPECT_FALSE(growth(rows_of({1, 1, 1, 1}), bits));
}

TEST(ResidentBytes, are_the_second_number_in_pages) {
    EXPECT_EQ(resident_bytes("100 25 7 1 0 60 0\n", 4096), 25u * 4096);
    EXPECT_EQ(resident_bytes("", 4096), 0u);
}

}  // namespace
}  // namespace htvm::lab
