#include "frame_pairs.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <optional>

namespace htvm::app {
namespace {

struct NameParts {
    std::string before, after;
    std::uint64_t number = 0;
};

std::optional<NameParts> parts_of(const std::filesystem::path& path) {
    constexpr const char* digits = "0123456789";
    const std::string stem = path.stem().string();
    const auto last = stem.find_last_of(digits);
    if (last == std::string::npos) return std::nullopt;
    const auto other = stem.find_last_not_of(digits, last);
    const auto first = other == std::string::npos ? 0 : other + 1;
    NameParts out{stem.substr(0, first), stem.substr(last + 1), 0};
    if (std::from_chars(stem.data() + first, stem.data() + last + 1, out.number).ec != std::errc()) return std::nullopt;
    return out;
}

// The place of a number, if it is there.
std::optional<std::size_t> place_of(std::span<const std::uint64_t> ascending, std::uint64_t number) {
    const auto at = std::lower_bound(ascending.begin(), ascending.end(), number);
    if (at == ascending.end() || *at != number) return std::nullopt;
    return static_cast<std::size_t>(at - ascending.begin());
}

}  // namespace

std::vector<std::uint64_t> numbers_in_names(std::span<const std::filesystem::path> paths) {
    std::vector<std::uint64_t> out;
    std::optional<NameParts> first;
    for (const auto& path : paths) {
        const auto parts = parts_of(path);
        if (!parts || (first && (parts->before != first->before || parts->after != first->after))) return {};
        if (!first) first = parts;
        if (!out.empty() && parts->number <= out.back()) return {};
        out.push_back(parts->number);
    }
    return out;
}

std::vector<FramePair> pair_by_number(std::span<const std::uint64_t> original, std::span<const std::uint64_t> decoded) {
    std::vector<FramePair> best;
    if (original.empty() || decoded.empty()) return best;
    using Reading = std::function<std::optional<std::size_t>(std::uint64_t)>;
    const std::vector<Reading> readings = {
        [&](std::uint64_t n) { return place_of(original, n); },
        [&](std::uint64_t n) {
            return n < original.size() ? std::optional(static_cast<std::size_t>(n)) : std::nullopt;
        },
        [&](std::uint64_t n) { return place_of(original, original[0] + (n - decoded[0])); }};
    for (const auto& reading : readings) {
        std::vector<FramePair> pairs;
        for (std::size_t k = 0; k < decoded.size(); ++k)
            if (const auto place = reading(decoded[k])) pairs.push_back({*place, k});
        if (pairs.size() > best.size()) best = std::move(pairs);
    }
    return best;
}

std::string frames_left_out(std::span<const std::uint64_t> numbers, std::span<const std::size_t> paired) {
    std::string list;
    std::size_t next = 0, left_out = 0;
    for (std::size_t k = 0; k < numbers.size();) {
        if (next < paired.size() && paired[next] == k) {
            ++next;
            ++k;
            continue;
        }
        const std::size_t first = k, end = next < paired.size() ? paired[next] : numbers.size();
        k = end;
        left_out += end - first;
        if (!list.empty()) list += ", ";
        list += end - first == 1 ? fmt::format("{}", numbers[first])
                                 : fmt::format("{} to {}", numbers[first], numbers[end - 1]);
    }
    if (left_out == 0) return {};
    return (left_out == 1 ? "frame " : "frames ") + list;
}

}  // namespace htvm::app
