// How unlike two words are, to guess what a mistyped one was to be.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace htvm::internal {

// How many characters must be put in, taken out or changed to make one word of the other.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t changed = diagonal + (a[i] != b[j]);
            diagonal = row[j + 1];
            row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

// The known word that a mistyped one was to be: the one spelt most alike, where it is alike at all, else the first of
// which the beginning was typed; empty where there is none. known: a range of texts.
template <typename Words>
std::string meant_word(std::string_view typed, const Words& known) {
    const std::string_view word = typed.substr(0, 100);
    const std::size_t most = word.size() < 2 ? 0 : word.size() < 4 ? 1 : std::max<std::size_t>(word.size() / 3, 2);
    std::string_view nearest, begun;
    std::size_t least = most + 1;
    for (const std::string_view other : known) {
        if (const auto distance = edit_distance(word, other); distance < least) {
            least = distance;
            nearest = other;
        }
        if (begun.empty() && word.size() > 1 && other.starts_with(word)) begun = other;
    }
    return std::string(nearest.empty() ? begun : nearest);
}

}  // namespace htvm::internal
