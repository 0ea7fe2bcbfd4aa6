// Bjontegaard's rate difference: how many more or fewer bits one coder takes than another for the same quality
// (Bjontegaard: Calculation of average PSNR differences between RD-curves, VCEG-M33, 2001), and where two
// rate-distortion curves cross.
//
// Both curves are log(rate) over quality, interpolated by monotone piecewise cubics (Fritsch and Carlson; "pchip"),
// which do not oscillate between points like the single cubic of Bjontegaard's paper. The difference is averaged over
// the qualities that both curves reach.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace htvm {

// One point of a curve. rate: > 0, in any unit (bits per vertex, Mbit/s). quality: larger is better: a PSNR in dB, or
// quality_of_error() of an error.
struct RatePoint {
    double rate = 0;
    double quality = 0;
};

// Puts an error on the quality axis: -ln(error), so that halving the error always counts the same. An error of 0 gives
// infinity, and such a point is left out of every curve.
double quality_of_error(double error);

// The mean ratio of the rate of `tested` to that of `reference` at equal quality, minus 1: 0 for the same curve, 1 for
// twice the bits, -0.5 for half. Points that are not finite, or whose rate is <= 0, are left out; of points with the
// same quality, the cheapest counts. Nothing if fewer than two points of a curve remain, or if the curves have no
// common range of qualities.
std::optional<double> bjontegaard_rate_difference(std::span<const RatePoint> reference,
                                                  std::span<const RatePoint> tested);

// The quality of a curve at a rate (pchip over log(rate)); nothing outside the range of its rates.
std::optional<double> quality_at_rate(std::span<const RatePoint> curve, double rate);

struct CurveCrossing {
    double rate = 0, quality = 0;
    bool first_ahead_below = false;  // the first curve has the better quality at rates below, the second above
};

// Where the curves cross, within the rates that both cover, by increasing rate. Curves that only touch do not cross.
std::vector<CurveCrossing> curve_crossings(std::span<const RatePoint> first, std::span<const RatePoint> second);

}  // namespace htvm
