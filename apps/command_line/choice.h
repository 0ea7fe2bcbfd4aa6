// Options whose values are words: the parser turns a word into its value, and nothing behind it compares texts.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "core/edit_distance.h"

namespace htvm::app {

// Which word was meant by one that is none of them; empty: nobody knows.
using Meant = std::function<std::string(const std::string& word)>;

// "cover is none of m1, m2, coverage; did you mean coverage?" By default a word is meant that is spelt alike.
inline std::string none_of(const std::string& word, const std::vector<std::string>& known, const Meant& by = {}) {
    const auto meant = by ? by(word) : internal::meant_word(word, known);
    return fmt::format("{} is none of {}{}", word.empty() ? "''" : word, fmt::join(known, ", "),
                       meant.empty() ? "" : "; did you mean " + meant + "?");
}

// The check of an option whose values are words.
inline CLI::Validator one_of(const std::vector<std::string>& words, const Meant& meant = {}) {
    return CLI::Validator(
        [words, meant](const std::string& word) {
            return std::find(words.begin(), words.end(), word) == words.end() ? none_of(word, words, meant)
                                                                              : std::string();
        },
        fmt::format("{{{}}}", fmt::join(words, ",")));
}

template <typename Value>
struct Choice {
    const char* word;
    Value value;
};

// Adds an option that takes one of the words and stores its value. choices: a range of Choice, which is copied.
template <typename Target, typename Choices>
CLI::Option* add_choice(CLI::App& command, const std::string& flags, Target& target, const Choices& choices,
                        const std::string& meaning, const Meant& meant = {}) {
    std::vector<std::string> words;
    for (const auto& choice : choices) words.emplace_back(choice.word);
    return command
        .add_option_function<std::string>(
            flags,
            [&target, choices](const std::string& word) {
                for (const auto& choice : choices)
                    if (word == choice.word) target = choice.value;
            },
            meaning)
        ->check(one_of(words, meant));
}

// The word of a value; empty if it has none.
template <typename Value, typename Choices>
const char* word_of(const Value& value, const Choices& choices) {
    const auto found =
        std::find_if(std::begin(choices), std::end(choices), [&](const auto& choice) { return choice.value == value; });
    return found == std::end(choices) ? "" : found->word;
}

}  // namespace htvm::app
