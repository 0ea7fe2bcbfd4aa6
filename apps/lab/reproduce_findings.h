// What the numbers say, in words: which coder is ahead where.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "metrics/bjontegaard.h"
#include "rd_result.h"

namespace htvm::lab {

// The measure of that key, which must be one of measures().
const Measure& measure_of(const std::string& key);

// Two coders' curves in one measure.
struct Contest {
    std::optional<double> rate_difference;  // Bjontegaard, of the first against the second
    std::vector<CurveCrossing> crossings;
    double low = 0, high = 0;  // bpvf that both reach; low >= high: none
    int leader = 0;            // where the curves do not cross: 1 the first is ahead, 2 the second, 0 not known
};
Contest contest(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                const std::string& measure);

// Below which rate the first is ahead; nothing where it is not ahead at the lowest rates, infinite where it is ahead at
// all of them.
std::optional<double> ahead_below(const Contest& contest);

// One or two sentences with the numbers in them.
std::string contest_sentence(const Contest& contest, const std::string& first, const std::string& second,
                             const std::string& measure);
// The same in a few words, for a table's cell.
std::string contest_phrase(const Contest& contest);

// "12.3 % fewer bits", "4.0 % more bits", "as many bits", of a rate difference.
std::string bits_phrase(double rate_difference);

// The step of positions at which a coder would have the rate, between the points measured at one colour step; nothing
// outside of them.
std::optional<double> geometry_step_at_rate(std::span<const RdPoint> points, const std::string& coder, double rate);

// `count` rates that both coders reach, in equal factors from the lowest to `highest` at most; empty where they share
// none.
std::vector<double> matched_rates(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                                  int count, double highest);

}  // namespace htvm::lab
