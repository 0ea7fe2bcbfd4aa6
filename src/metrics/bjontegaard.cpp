#include "metrics/bjontegaard.h"

#include <algorithm>
#include <cmath>

namespace htvm {
namespace {

// y as a function of x, x strictly increasing, with the slope at each knot.
struct Pchip {
    std::vector<double> x, y, slope;
};

// The slope at an end from the two pieces next to it (three-point formula), limited so that it does not overshoot.
double end_slope(double h0, double h1, double d0, double d1) {
    const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if (slope * d0 <= 0) return 0;
    if (d0 * d1 <= 0 && std::abs(slope) > 3 * std::abs(d0)) return 3 * d0;
    return slope;
}

void set_slopes(Pchip& curve) {
    const std::size_t n = curve.x.size();
    std::vector<double> h(n - 1), d(n - 1);
    for (std::size_t i = 0; i + 1 < n; ++i) {
        h[i] = curve.x[i + 1] - curve.x[i];
        d[i] = (curve.y[i + 1] - curve.y[i]) / h[i];
    }
    if (n == 2) {
        curve.slope = {d[0], d[0]};
        return;
    }
    curve.slope.assign(n, 0);
    curve.slope[0] = end_slope(h[0], h[1], d[0], d[1]);
    curve.slope[n - 1] = end_slope(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        if (d[i - 1] * d[i] <= 0) continue;  // a peak or a valley: flat
        const double w0 = 2 * h[i] + h[i - 1], w1 = h[i] + 2 * h[i - 1];
        curve.slope[i] = (w0 + w1) / (w0 / d[i - 1] + w1 / d[i]);
    }
}

double value_at(const Pchip& curve, double x) {
    const auto after = std::upper_bound(curve.x.begin() + 1, curve.x.end() - 1, x);
    const auto i = static_cast<std::size_t>(after - curve.x.begin()) - 1;
    const double h = curve.x[i + 1] - curve.x[i], t = (x - curve.x[i]) / h, u = 1 - t;
    return u * u * (1 + 2 * t) * curve.y[i] + t * t * (1 + 2 * u) * curve.y[i + 1] +
           h * t * u * (u * curve.slope[i] - t * curve.slope[i + 1]);
}

// Simpson's rule is exact for the cubic of each piece.
double integral(const Pchip& curve, double low, double high) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < curve.x.size(); ++i) {
        const double from = std::max(low, curve.x[i]), to = std::min(high, curve.x[i + 1]);
        if (from >= to) continue;
        sum += (to - from) / 6 * (value_at(curve, from) + 4 * value_at(curve, (from + to) / 2) + value_at(curve, to));
    }
    return sum;
}

struct Knot {
    double x, y;
};

// Through the knots by increasing x; of knots with equal x, the first in the order of `before` is kept. Nothing for
// fewer than two.
template <class Before>
std::optional<Pchip> through(std::vector<Knot> knots, const Before& before) {
    std::sort(knots.begin(), knots.end(),
              [&](const Knot& a, const Knot& b) { return a.x != b.x ? a.x < b.x : before(a, b); });
    Pchip curve;
    for (const auto& knot : knots) {
        if (!curve.x.empty() && !(knot.x > curve.x.back())) continue;
        curve.x.push_back(knot.x);
        curve.y.push_back(knot.y);
    }
    if (curve.x.size() < 2) return std::nullopt;
    set_slopes(curve);
    return curve;
}

bool usable(const RatePoint& p) { return std::isfinite(p.rate) && p.rate > 0 && std::isfinite(p.quality); }

std::optional<Pchip> log_rate_over_quality(std::span<const RatePoint> points) {
    std::vector<Knot> knots;
    for (const auto& p : points)
        if (usable(p)) knots.push_back({p.quality, std::log(p.rate)});
    return through(std::move(knots), [](const Knot& a, const Knot& b) { return a.y < b.y; });
}

std::optional<Pchip> quality_over_log_rate(std::span<const RatePoint> points) {
    std::vector<Knot> knots;
    for (const auto& p : points)
        if (usable(p)) knots.push_back({std::log(p.rate), p.quality});
    return through(std::move(knots), [](const Knot& a, const Knot& b) { return a.y > b.y; });
}

}  // namespace

double quality_of_error(double error) { return -std::log(error); }

std::optional<double> bjontegaard_rate_difference(std::span<const RatePoint> reference,
                                                  std::span<const RatePoint> tested) {
    const auto a = log_rate_over_quality(reference), b = log_rate_over_quality(tested);
    if (!a || !b) return std::nullopt;
    const double low = std::max(a->x.front(), b->x.front()), high = std::min(a->x.back(), b->x.back());
    if (!(low < high)) return std::nullopt;
    return std::exp((integral(*b, low, high) - integral(*a, low, high)) / (high - low)) - 1;
}

std::optional<double> quality_at_rate(std::span<const RatePoint> points, double rate) {
    const auto curve = quality_over_log_rate(points);
    if (!curve || !(rate > 0)) return std::nullopt;
    const double x = std::log(rate);
    if (!(x >= curve->x.front() && x <= curve->x.back())) return std::nullopt;
    return value_at(*curve, x);
}

std::vector<CurveCrossing> curve_crossings(std::span<const RatePoint> first, std::span<const RatePoint> second) {
    const auto a = quality_over_log_rate(first), b = quality_over_log_rate(second);
    if (!a || !b) return {};
    const double low = std::max(a->x.front(), b->x.front()), high = std::min(a->x.back(), b->x.back());
    if (!(low < high)) return {};
    auto lead = [&](double x) { return value_at(*a, x) - value_at(*b, x); };
    std::vector<CurveCrossing> out;
    constexpr int steps = 4096;
    double last_x = low, last = lead(low);
    for (int i = 1; i <= steps; ++i) {
        const double x = low + (high - low) * i / steps, now = lead(x);
        if (now == 0) continue;
        if (last * now < 0) {
            double left = last_x, right = x;
            for (int k = 0; k < 60; ++k) {
                const double middle = (left + right) / 2;
                (lead(middle) * last > 0 ? left : right) = middle;
            }
            out.push_back({std::exp(right), value_at(*a, right), last > 0});
        }
        last_x = x;
        last = now;
    }
    return out;
}

}  // namespace htvm
