// Lengths are numbers with a unit: they cost no more, and no unit passes for another.
#include "core/length.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <type_traits>

namespace htvm::internal {
namespace {

template <class From, class To>
constexpr bool becomes = std::is_convertible_v<From, To> || std::is_constructible_v<To, From>;

static_assert(!becomes<AdultMillimetres, LatticeUnits> && !becomes<LatticeUnits, AdultMillimetres>);
static_assert(!becomes<Millimetres, LatticeUnits> && !becomes<LatticeUnits, Millimetres>);
static_assert(!becomes<AdultMillimetres, Millimetres> && !becomes<Millimetres, AdultMillimetres>);
static_assert(!becomes<LatticeUnits, double> && !becomes<Millimetres, double> && !becomes<AdultMillimetres, double>);
static_assert(!std::is_convertible_v<double, Millimetres> && !std::is_convertible_v<double, AdultMillimetres>);
static_assert(sizeof(LatticeUnits) == sizeof(double) && std::is_trivially_copyable_v<LatticeUnits>);

TEST(Length, StaysInItsUnitInSumsAndMultiplesAndARatioIsANumber) {
    constexpr Millimetres a(6), b(1.5);
    static_assert(a + b == Millimetres(7.5) && a - b == Millimetres(4.5) && -b == Millimetres(-1.5));
    static_assert(2 * b == b + b && b * 2 == 2 * b && a / 4 == b && a / b == 4.0);
    auto sum = a;
    sum += b;
    sum *= 2;
    EXPECT_EQ(sum, Millimetres(15));
    sum -= a;
    sum /= 3;
    EXPECT_EQ(sum, Millimetres(3));
    EXPECT_EQ(Millimetres(), Millimetres(0));
}

TEST(Length, IsComparedWithThoseOfItsUnit) {
    constexpr AdultMillimetres speck(20), region(100);
    static_assert(speck < region && region > speck && speck <= speck && speck != region);
    EXPECT_EQ(std::max({speck, region, AdultMillimetres(3)}), region);
}

TEST(Scale, LeadsFromOneUnitToAnother) {
    constexpr Scale adult;
    static_assert(adult.on_lattice(Millimetres(2)) == LatticeUnits(32));
    static_assert(adult.on_lattice(AdultMillimetres(30)) == LatticeUnits(480));
    static_assert(adult.in_space(LatticeUnits(24)) == Millimetres(1.5));
    // A doll, on a lattice of 1/64 mm: a sixth of an adult.
    constexpr double size = 1.0 / 6;
    constexpr Scale doll{.units = 64, .adult_millimetre = LatticeUnits(64 * size)};
    EXPECT_EQ(doll.on_lattice(Millimetres(2)), LatticeUnits(128));
    EXPECT_DOUBLE_EQ(doll.on_lattice(AdultMillimetres(30)).value, 320);
}

TEST(Scale, OfAnAdultHasAMillimetreOfItsUnits) {
    constexpr Scale fine{.units = 256};
    EXPECT_EQ(fine.on_lattice(AdultMillimetres(1)), fine.on_lattice(Millimetres(1)));
}

}  // namespace
}  // namespace htvm::internal
