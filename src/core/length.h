// Lengths by what they are counted in, so that they cannot be mixed: on the lattice of coded positions, in space, and
// in space on an adult. Reaches, spacings and thresholds are known for adults; on a doll or a giant they follow from
// the subject's size, which is what a Scale says.
//
//     constexpr AdultMillimetres reach(30);
//     const LatticeUnits here = scale.on_lattice(reach);
//
// Sums, multiples and comparisons stay within a unit, and the ratio of two lengths is a number. Only a Scale leads from
// one unit to another. A length is a double and costs what a double does.
#pragma once

#include <compare>

namespace htvm::internal {

template <class Unit>
struct Length {
    double value = 0;

    constexpr Length() = default;
    constexpr explicit Length(double count) : value(count) {}

    constexpr Length operator-() const { return Length(-value); }
    constexpr Length& operator+=(Length other) { return value += other.value, *this; }
    constexpr Length& operator-=(Length other) { return value -= other.value, *this; }
    constexpr Length& operator*=(double factor) { return value *= factor, *this; }
    constexpr Length& operator/=(double divisor) { return value /= divisor, *this; }
    friend constexpr Length operator+(Length a, Length b) { return Length(a.value + b.value); }
    friend constexpr Length operator-(Length a, Length b) { return Length(a.value - b.value); }
    friend constexpr Length operator*(Length a, double factor) { return Length(a.value * factor); }
    friend constexpr Length operator*(double factor, Length a) { return Length(factor * a.value); }
    friend constexpr Length operator/(Length a, double divisor) { return Length(a.value / divisor); }
    friend constexpr double operator/(Length a, Length b) { return a.value / b.value; }
    friend constexpr auto operator<=>(Length a, Length b) = default;
};

struct OnLattice;
struct InSpace;
struct OnAdult;
using LatticeUnits = Length<OnLattice>;    // distances of LatticePoints
using Millimetres = Length<InSpace>;       // of the subject as it was captured
using AdultMillimetres = Length<OnAdult>;  // of the same part of an adult

// How long lengths are on a stream's lattice. The defaults are those of an adult at the default quality.
struct Scale {
    double units = 16;                     // lattice units per millimetre, > 0
    LatticeUnits adult_millimetre{units};  // the length on this subject that corresponds to a millimetre on an adult

    constexpr LatticeUnits on_lattice(Millimetres length) const { return LatticeUnits(length.value * units); }
    constexpr LatticeUnits on_lattice(AdultMillimetres length) const { return length.value * adult_millimetre; }
    constexpr Millimetres in_space(LatticeUnits length) const { return Millimetres(length.value / units); }
};

}  // namespace htvm::internal
