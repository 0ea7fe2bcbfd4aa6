#include "reproduce_findings.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reproduce_chart.h"

namespace htvm::lab {

using namespace app;
namespace {

struct RateRange {
    double low = std::numeric_limits<double>::infinity(), high = 0;
};

RateRange rates_of(std::span<const RdPoint> points, const std::string& coder) {
    RateRange out;
    for (const auto& point : points) {
        if (point.coder != coder) continue;
        out.low = std::min(out.low, bits_per_vertex(point));
        out.high = std::max(out.high, bits_per_vertex(point));
    }
    return out;
}

std::string quality_words(const CurveCrossing& crossing, const Measure& measure) {
    const double value = measure.is_error ? std::exp(-crossing.quality) : crossing.quality;
    return fmt::format("{:.{}f} {}", value, std::min(measure.digits, 2), measure.unit);
}

std::string capitalised(std::string text) {
    if (!text.empty() && text[0] >= 'a' && text[0] <= 'z' && !text.starts_with("htvm"))
        text[0] = static_cast<char>(text[0] - 'a' + 'A');
    return text;
}

}  // namespace

const Measure& measure_of(const std::string& key) {
    const auto all = measures();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Measure& m) { return key == m.key; });
    return found == all.end() ? all.front() : *found;
}

Contest contest(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                const std::string& measure) {
    const auto a = rate_curve(points, first, measure_of(measure)), b = rate_curve(points, second, measure_of(measure));
    Contest out;
    if (a.size() < 2 || b.size() < 2) return out;
    out.rate_difference = bjontegaard_rate_difference(b, a);
    out.crossings = curve_crossings(a, b);
    const auto ra = rates_of(points, first), rb = rates_of(points, second);
    out.low = std::max(ra.low, rb.low);
    out.high = std::min(ra.high, rb.high);
    if (out.low < out.high && out.crossings.empty()) {
        const double middle = std::sqrt(out.low * out.high);
        const auto qa = quality_at_rate(a, middle), qb = quality_at_rate(b, middle);
        if (qa && qb && *qa != *qb) out.leader = *qa > *qb ? 1 : 2;
    }
    return out;
}

std::optional<double> ahead_below(const Contest& c) {
    if (c.crossings.empty()) {
        if (c.leader == 1) return std::numeric_limits<double>::infinity();
        return std::nullopt;
    }
    if (!c.crossings.front().first_ahead_below) return std::nullopt;
    return c.crossings.front().rate;
}

std::string bits_phrase(double difference) {
    const double percent = 100 * std::abs(difference);
    if (percent < 0.05) return "as many bits";
    return fmt::format("{:.1f} % {} bits", percent, difference < 0 ? "fewer" : "more");
}

std::string contest_sentence(const Contest& c, const std::string& first, const std::string& second,
                             const std::string& measure) {
    const std::string a = look_of_coder(first).name, b = look_of_coder(second).name;
    const Measure& m = measure_of(measure);
    std::string out;
    if (!(c.low < c.high)) {
        out = fmt::format("{} and {} share no range of rates here.", capitalised(a), b);
    } else if (c.crossings.empty()) {
        if (c.leader == 0) return fmt::format("{} and {} are level.", capitalised(a), b);
        out = fmt::format("{} is ahead of {} at every rate that both reach ({:.1f} to {:.1f} bpvf).",
                          capitalised(c.leader == 1 ? a : b), c.leader == 1 ? b : a, c.low, c.high);
    } else if (c.crossings.size() == 1) {
        const auto& crossing = c.crossings.front();
        out = fmt::format("{} is ahead of {} below {:.1f} bpvf (at {}), and behind above.",
                          capitalised(crossing.first_ahead_below ? a : b), crossing.first_ahead_below ? b : a,
                          crossing.rate, quality_words(crossing, m));
    } else {
        out = fmt::format("{} and {} cross at", capitalised(a), b);
        for (std::size_t i = 0; i < c.crossings.size(); ++i)
            out += fmt::format("{} {:.1f}",
                               i == 0                        ? ""
                               : i + 1 == c.crossings.size() ? " and"
                                                             : ",",
                               c.crossings[i].rate);
        out += fmt::format(" bpvf; below the first, {} is ahead.", c.crossings.front().first_ahead_below ? a : b);
    }
    if (c.rate_difference)
        out += fmt::format(" Over the range of qualities that both reach, {} takes {} than {}.", a,
                           bits_phrase(*c.rate_difference), b);
    return out;
}

std::string contest_phrase(const Contest& c) {
    if (!(c.low < c.high)) return "no common rates";
    if (c.crossings.empty())
        return c.leader == 0
                   ? "level"
                   : fmt::format("{} from {:.1f} to {:.1f} bpvf", c.leader == 1 ? "ahead" : "behind", c.low, c.high);
    const auto& crossing = c.crossings.front();
    return fmt::format("{} below {:.1f} bpvf{}", crossing.first_ahead_below ? "ahead" : "behind", crossing.rate,
                       c.crossings.size() > 1 ? ", then crossing again" : "");
}

std::optional<double> geometry_step_at_rate(std::span<const RdPoint> points, const std::string& coder, double rate) {
    std::vector<RatePoint> curve;
    for (const auto& point : points)
        if (point.coder == coder && point.geometry_step > 0)
            curve.push_back({bits_per_vertex(point), -std::log(point.geometry_step)});
    const auto at = quality_at_rate(curve, rate);
    if (!at) return std::nullopt;
    return std::exp(-*at);
}

std::vector<double> matched_rates(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                                  int count, double highest) {
    const auto a = rates_of(points, first), b = rates_of(points, second);
    // A little inside, so that both can be interpolated.
    const double low = 1.02 * std::max(a.low, b.low);
    double high = 0.98 * std::min(a.high, b.high);
    if (!(low < high)) return {};
    if (highest > low) high = std::min(high, highest);
    std::vector<double> out;
    for (int i = 0; i < count; ++i)
        out.push_back(count == 1 ? high : low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
    return out;
}

}  // namespace htvm::lab
