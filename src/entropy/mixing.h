// Predicts one decision from several contexts at once: the adaptive probability of each context votes with its log
// odds, weighted by how well it has predicted so far (logistic mixing; Mahoney 2005). Integers only, so every machine
// gets the same result.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "entropy/models.h"

namespace htvm::internal {

// 65536 / (1 + exp(-x / 256)) for x = -2048, -1920, ..., 2048. Log odds are natural logarithms in units of 1/256, from
// -2047 to 2047; probabilities are in units of 1/65536.
inline constexpr std::array<std::int32_t, 33> logistic_knots = {
    22,    36,    60,    98,    162,   267,   439,   720,   1179,  1921,  3108,
    4971,  7812,  11955, 17625, 24743, 32768, 40793, 47911, 53581, 57724, 60565,
    62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514};

constexpr std::int32_t probability_of_log_odds(std::int32_t log_odds) {
    const std::int32_t x = std::clamp(log_odds, -2047, 2047) + 2048;
    const std::size_t knot = static_cast<std::size_t>(x >> 7);
    const std::int32_t part = x & 127;
    return (logistic_knots[knot] * (128 - part) + logistic_knots[knot + 1] * part) >> 7;
}

// A mixed probability as it is learnt from, and as it is coded by: no nearer to 0 and 1 than a model's.
struct MixedProbability {
    std::uint16_t learnt = 0, coded = 0;
};

// For every log odds from -2047 to 2047: decoding asks once for each decision, and waits for the answer.
inline constexpr auto probability_table = [] {
    std::array<MixedProbability, 4095> table{};
    for (std::int32_t x = 0; x < 4095; ++x) {
        const std::int32_t probability = probability_of_log_odds(x - 2047);
        table[static_cast<std::size_t>(x)] = {static_cast<std::uint16_t>(probability),
                                              static_cast<std::uint16_t>(std::clamp(probability, 48, 65535 - 48))};
    }
    return table;
}();

// The inverse of the above, indexed by probability / 16.
inline constexpr auto log_odds_table = [] {
    std::array<std::int16_t, 4096> table{};
    std::int32_t log_odds = -2047;
    for (std::int32_t p = 0; p < 4096; ++p) {
        while (log_odds < 2047 && probability_of_log_odds(log_odds) < p * 16 + 8) ++log_odds;
        table[static_cast<std::size_t>(p)] = static_cast<std::int16_t>(log_odds);
    }
    return table;
}();

// Weights of N votes, in units of 1/65536.
template <std::size_t N>
struct Mixer {
    std::array<std::int32_t, N> weights = [] {
        std::array<std::int32_t, N> equal{};
        equal.fill(static_cast<std::int32_t>(65536 * 5 / (4 * N)));
        return equal;
    }();
};

inline constexpr std::int32_t mixing_rate = 5, most_weight = 1 << 20;

// Codes one decision; the models and the mixer adapt.
template <class Coder, std::size_t N>
[[gnu::always_inline]] inline bool code_mixed(Coder& coder, Mixer<N>& mixer, const std::array<BinaryModel*, N>& models,
                                              bool wanted) {
    std::array<std::int32_t, N> votes;
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < N; ++i) {
        votes[i] = log_odds_table[models[i]->one >> 4];
        sum += std::int64_t{votes[i]} * mixer.weights[i];
    }
    const MixedProbability probability =
        probability_table[static_cast<std::size_t>(std::clamp<std::int64_t>(sum >> 16, -2047, 2047) + 2047)];
    // Only carries the probability to the coder; what it learns is not used.
    BinaryModel mixed{probability.coded, model_seen_limit};
    const bool bit = coder.bit(mixed, wanted);
    const std::int32_t error = mixing_rate * ((bit ? 65536 : 0) - probability.learnt);  // below 2^19; a vote below 2^11
    // Whether any is out of bounds, which is seldom: one of them has a bit above the largest's, or is near it.
    std::uint32_t beyond = 0;
    for (std::size_t i = 0; i < N; ++i) {
        const std::int32_t weight = mixer.weights[i] + ((votes[i] * error) >> 18);
        beyond |= static_cast<std::uint32_t>(weight + most_weight);
        mixer.weights[i] = weight;
    }
    if (beyond > 2u * most_weight - 1)
        for (auto& weight : mixer.weights) weight = std::clamp(weight, -most_weight, most_weight);
    for (BinaryModel* model : models) model->update(bit);
    return bit;
}

}  // namespace htvm::internal
