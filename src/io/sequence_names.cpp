#include "io/sequence_names.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "core/letter_case.h"

namespace htvm {

using internal::lower_case;
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
// ---- Numbers in names -----------------------------------------------------------------------------------------------

struct NumberInName {
    bool is_negative = false;
    std::string digits;    // as written
    std::string fraction;  // digits behind a point
};

std::string_view without_zeros(std::string_view digits) {
    return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

// Below, at or above 0 as the size of a is below, equal to or above that of b.
int compare_sizes(const NumberInName& a, const NumberInName& b) {
    const auto x = without_zeros(a.digits), y = without_zeros(b.digits);
    if (x.size() != y.size()) return x.size() < y.size() ? -1 : 1;
    if (const int by_digits = x.compare(y); by_digits != 0) return by_digits;
    const std::size_t width = std::max(a.fraction.size(), b.fraction.size());
    const auto padded = [&](std::string fraction) {
        fraction.resize(width, '0');
        return fraction;
    };
    return padded(a.fraction).compare(padded(b.fraction));
}

int compare(const NumberInName& a, const NumberInName& b) {
    if (a.is_negative != b.is_negative) return a.is_negative ? -1 : 1;
    return a.is_negative ? compare_sizes(b, a) : compare_sizes(a, b);
}

struct NumberLess {
    bool operator()(const NumberInName& a, const NumberInName& b) const { return compare(a, b) < 0; }
};

// In units of the last of `decimals` digits behind the point; nothing if 64 bits do not hold it.
std::optional<std::int64_t> value_of(const NumberInName& number, std::size_t decimals) {
    std::string digits = number.digits + number.fraction;
    digits.append(decimals - number.fraction.size(), '0');
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
    return number.is_negative ? -value : value;
}

// A name as numbers and the texts before, between and behind them.
struct SplitName {
    std::vector<std::string> texts;
    std::vector<NumberInName> numbers;  // one fewer
};

SplitName split(std::string_view name) {
    SplitName out;
    out.texts.emplace_back();
    for (std::size_t i = 0; i < name.size(); ++i) {
        if (!is_digit(name[i])) {
            out.texts.back() += name[i];
            continue;
        }
        if (i == 0 || !is_digit(name[i - 1])) {
            out.numbers.emplace_back();
            out.texts.emplace_back();
        }
        out.numbers.back().digits += name[i];
    }
    return out;
}

// The same for names of one kind alone.
std::string key_of(const SplitName& name) {
    std::string key;
    for (const auto& text : name.texts) key += std::to_string(text.size()) + ":" + lower_case(text);
    return key;
}

// Whether a '-' before a number of the names `with`, which those of `without` lack, is a sign: two captures, one with
// a dash in its names, would have the same numbers, and there is no negative zero.
bool are_signs(const std::vector<SplitName>& names, const std::vector<std::size_t>& with,
               const std::vector<std::size_t>& without, std::size_t number) {
    const auto values = [&](const std::vector<std::size_t>& places) {
        std::set<std::string_view> out;
        for (const auto place : places) out.insert(without_zeros(names[place].numbers[number].digits));
        return out;
    };
    const auto negative = values(with);
    return negative.count({}) == 0 && negative != values(without);
}

std::vector<SplitName> split_names(std::span<const std::string> names) {
    std::vector<SplitName> out;
    std::map<std::string, std::vector<std::size_t>> kinds;
    for (const auto& name : names) {
        out.push_back(split(name));
        kinds[key_of(out.back())].push_back(out.size() - 1);
    }
    for (const auto& [key, places] : kinds)
        for (std::size_t n = 0; n < out[places[0]].numbers.size(); ++n) {
            auto unsigned_name = out[places[0]];
            if (!unsigned_name.texts[n].ends_with('-')) continue;
            unsigned_name.texts[n].pop_back();
            const auto other = kinds.find(key_of(unsigned_name));
            if (other == kinds.end() || !are_signs(out, places, other->second, n)) continue;
            for (const auto place : places) {
                out[place].texts[n].pop_back();
                out[place].numbers[n].is_negative = true;
            }
            break;
        }
    return out;
}

std::size_t distinct(const std::vector<SplitName>& names, std::span<const std::size_t> places, std::size_t number) {
    std::set<NumberInName, NumberLess> values;
    for (const auto place : places) values.insert(names[place].numbers[number]);
    return values.size();
}

std::vector<std::size_t> all_places(std::size_t count) {
    std::vector<std::size_t> out(count);
    std::iota(out.begin(), out.end(), std::size_t{0});
    return out;
}

std::string text_of(const NumberInName& number) {
    return (number.is_negative ? "-" : "") + number.digits + (number.fraction.empty() ? "" : "." + number.fraction);
}

// The name with `mark` in place of some of its numbers.
std::string marked(const SplitName& name, const std::vector<std::size_t>& numbers, std::string_view mark) {
    std::string out = name.texts[0];
    for (std::size_t n = 0; n < name.numbers.size(); ++n) {
        const bool is_marked = std::find(numbers.begin(), numbers.end(), n) != numbers.end();
        out += is_marked ? std::string(mark) : text_of(name.numbers[n]);
        out += name.texts[n + 1];
    }
    return out;
}

std::string with_percent_doubled(const std::string& name) {
    std::string out;
    for (const char c : name) out += c == '%' ? "%%" : std::string(1, c);
    return out;
}

// ---- Decimal numbers ------------------------------------------------------------------------------------------------

// Whether the numbers n and n + 1 of all names, with a point between them, are one decimal number.
bool is_decimal(const std::vector<SplitName>& names, std::size_t n) {
    constexpr std::size_t digits_of_unix_time = 10;
    const auto& texts = names[0].texts;
    const bool more_points = texts[n] == "." || texts[n + 2] == ".";
    if (texts[n + 1] != "." || more_points) return false;
    bool unix_times = true, widths_differ = false, counts = false;
    for (const auto& name : names) {
        const auto &whole = name.numbers[n].digits, &fraction = name.numbers[n + 1].digits;
        unix_times = unix_times && without_zeros(whole).size() >= digits_of_unix_time;
        widths_differ = widths_differ || fraction.size() != names[0].numbers[n + 1].digits.size();
        counts = counts || (fraction.size() > 1 && fraction.back() == '0');  // 1.10 comes behind 1.9
    }
    const bool whole_varies = distinct(names, all_places(names.size()), n) > 1;
    return unix_times || (widths_differ && whole_varies && !counts);
}

// Joins the first two numbers that are one decimal number; false if there are none.
bool join_decimals(std::vector<SplitName>& names) {
    for (std::size_t n = 0; n + 1 < names[0].numbers.size(); ++n) {
        if (!is_decimal(names, n)) continue;
        for (auto& name : names) {
            const auto at = static_cast<std::ptrdiff_t>(n + 1);
            name.numbers[n].fraction = name.numbers[n + 1].digits;
            name.numbers.erase(name.numbers.begin() + at);
            name.texts.erase(name.texts.begin() + at);
        }
        return true;
    }
    return false;
}

// ---- Which number is the frame's ------------------------------------------------------------------------------------

// Names of one kind, by their numbers.
struct NumberedNames {
    std::vector<SplitName> names;
    std::vector<std::size_t> varying;   // the numbers that are not the same in all
    std::vector<std::size_t> in_order;  // places in the order of all numbers
    std::string_view ending;

    std::string text(std::size_t place) const { return marked(names[place], {}, "") + std::string(ending); }
    std::string pattern(std::size_t place, const std::vector<std::size_t>& numbers) const {
        return marked(names[place], numbers, "*") + std::string(ending);
    }
};

int compare_all(const SplitName& a, const SplitName& b) {
    for (std::size_t n = 0; n < a.numbers.size(); ++n)
        if (const int by_number = compare(a.numbers[n], b.numbers[n]); by_number != 0) return by_number;
    return 0;
}

// A number that could be the frame's: another in each name.
struct Counter {
    std::size_t number = 0;
    bool counts_frames = false, by_ones = false, agrees = false;
    std::vector<std::size_t> places;     // in its order
    std::vector<std::uint64_t> numbers;  // in that order

    auto rank() const { return std::tuple(counts_frames, by_ones, agrees, number); }
};

std::optional<Counter> counter_of(const NumberedNames& all, std::size_t number) {
    const auto& names = all.names;
    std::size_t decimals = 0;
    for (const auto& name : names) decimals = std::max(decimals, name.numbers[number].fraction.size());
    std::vector<std::pair<std::int64_t, std::size_t>> values;
    for (std::size_t place = 0; place < names.size(); ++place) {
        const auto value = value_of(names[place].numbers[number], decimals);
        if (!value) return std::nullopt;
        values.emplace_back(*value, place);
    }
    std::sort(values.begin(), values.end());
    Counter out;
    out.number = number;
    const std::int64_t from = std::min<std::int64_t>(values[0].first, 0);
    for (const auto& [value, place] : values) {
        const auto counted = static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(from);
        if (!out.numbers.empty() && counted == out.numbers.back()) return std::nullopt;
        out.numbers.push_back(counted);
        out.places.push_back(place);
    }
    const auto step = frame_step(out.numbers);
    out.counts_frames = step.has_value();
    out.by_ones = step == 1;
    out.agrees = out.places == all.in_order;
    if (out.agrees) return out;
    // Against the order of what stands before it a number counts only if that is another in most names, as numbers of
    // vertices are; it does not begin anew with every take or minute.
    for (const auto before : all.varying)
        if (before < number && 2 * distinct(names, out.places, before) <= names.size()) return std::nullopt;
    return out.counts_frames ? std::optional(out) : std::nullopt;
}

// Whether the number is a fraction of a second with all its digits: 3, 6 or 9, over most of their range.
bool is_fraction_of_second(const std::vector<SplitName>& names, std::size_t number) {
    const std::size_t width = names[0].numbers[number].digits.size();
    if (width != 3 && width != 6 && width != 9) return false;
    std::string largest;
    for (const auto& name : names) {
        if (name.numbers[number].digits.size() != width) return false;
        largest = std::max(largest, name.numbers[number].digits);
    }
    return largest[0] >= '5';
}

// Names of which several have each number, as those of several levels of detail or cameras: what tells these apart.
Result<void> refuse_several_of_each(const NumberedNames& all, std::size_t main) {
    std::vector<std::size_t> behind, others;
    for (const auto number : all.varying) {
        if (number > main && !is_fraction_of_second(all.names, number)) behind.push_back(number);
        if (number <= main) others.push_back(number);
    }
    if (behind.empty()) return {};
    std::map<std::string, std::size_t> sets;
    for (const auto place : all.in_order) ++sets[all.pattern(place, others)];
    constexpr std::size_t most_sets = 16;
    if (sets.size() > most_sets || 2 * sets.size() > all.names.size()) {
        for (std::size_t k = 1; k < all.in_order.size(); ++k) {
            const auto a = all.in_order[k - 1], b = all.in_order[k];
            if (compare(all.names[a].numbers[main], all.names[b].numbers[main]) == 0)
                return fail(ErrorKind::bad_input,
                            all.text(a) + " and " + all.text(b) + " have the same number; leave one out with --ignore");
        }
        return {};
    }
    std::string list;
    for (const auto& [pattern, count] : sets)
        list += (list.empty() ? "" : ", ") + std::to_string(count) + " \"" + pattern + "\"";
    // One of a kind that is not the largest.
    const auto largest =
        std::max_element(sets.begin(), sets.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto& other = largest == sets.begin() ? std::next(sets.begin())->first : sets.begin()->first;
    return fail(ErrorKind::bad_input, "there are several files of each number: " + list +
                                          "; leave out all but one kind, as with --ignore \"" + other + "\"");
}

// The order of names in which no number counts the frames.
Result<FrameOrder> order_by_all(const NumberedNames& all) {
    const auto& names = all.names;
    std::size_t main = all.varying[0], most = 0;
    for (const auto number : all.varying)
        if (const auto count = distinct(names, all.in_order, number); count >= most) main = number, most = count;
    if (auto several = refuse_several_of_each(all, main); !several) return tl::unexpected(several.error());
    std::size_t by_ones = 0, anew = 0;
    std::string where;
    for (std::size_t k = 1; k < all.in_order.size(); ++k) {
        const auto &before = names[all.in_order[k - 1]].numbers[main], &number = names[all.in_order[k]].numbers[main];
        const auto from = value_of(before, before.fraction.size()), to = value_of(number, number.fraction.size());
        by_ones += from && to && number.fraction.empty() && *to - 1 == *from;
        if (compare(number, before) > 0) continue;
        if (anew++ == 0) where = all.text(all.in_order[k]);
    }
    FrameOrder out{all.in_order, {}, {}};
    if (2 * by_ones >= names.size() && anew > 0)
        out.remarks.push_back({"numbers-anew",
                               "the numbers in the names begin anew at " + where +
                                   ": the files are taken one after the other; if they are several captures, name one",
                               true});
    else if (all.varying.size() > 1)
        out.remarks.push_back(
            {"numbers-vary",
             "several numbers in the names vary, as those of a date and a time: the frames are in the order of all, "
             "and their times are not taken from it (see --timestamps)",
             false});
    return out;
}

// Names that give the same numbers: they differ in leading zeros, or in the case of letters.
Result<void> refuse_same_numbers(const NumberedNames& all) {
    for (std::size_t k = 1; k < all.in_order.size(); ++k) {
        const auto a = all.in_order[k - 1], b = all.in_order[k];
        if (compare_all(all.names[a], all.names[b]) == 0)
            return fail(ErrorKind::bad_input,
                        all.text(a) + " and " + all.text(b) + " have the same number; leave one out with --ignore");
    }
    return {};
}

void remark_on(FrameOrder& order, const NumberedNames& all, const Counter& counter) {
    const auto& first = all.names[counter.places[0]];
    if (all.varying.size() > 1)
        order.remarks.push_back(
            {"numbers-vary",
             "several numbers in the names vary: the frames are counted by the one in place of * in " +
                 all.pattern(counter.places[0], {counter.number}),
             false});
    if (first.numbers[counter.number].is_negative)
        order.remarks.push_back({"negative-numbers",
                                 "the numbers in the names begin below zero, at " +
                                     text_of(first.numbers[counter.number]) + ": frames are counted from there",
                                 false});
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
    std::size_t i = 0;
    std::size_t j = 0;
    int zeros = 0;  // leading zeros, decides last
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
            ++i;
            ++j;
            continue;
        }
        const auto number = [](std::string_view text, std::size_t& at, std::size_t& leading) {
            const std::size_t begin = at;
            while (at < text.size() && text[at] == '0') ++at;
            leading = at - begin;
            const std::size_t first = at;
            while (at < text.size() && is_digit(text[at])) ++at;
            return text.substr(first, at - first);
        };
        std::size_t zeros_a = 0;
        std::size_t zeros_b = 0;
        const std::string_view number_a = number(a, i, zeros_a);
        const std::string_view number_b = number(b, j, zeros_b);
        if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
        if (number_a != number_b) return number_a < number_b;
        if (zeros == 0 && zeros_a != zeros_b) zeros = zeros_a < zeros_b ? -1 : 1;
    }
    if (i < a.size() || j < b.size()) return j < b.size();
    return zeros < 0;
}

bool is_text_order(std::span<const std::string> names) {
    if (std::is_sorted(names.begin(), names.end())) return true;
    std::vector<std::string> collated;
    for (const auto& name : names) {
        auto& out = collated.emplace_back();
        for (const char c : name)
            if (is_digit(c) || is_letter(c) || static_cast<unsigned char>(c) >= 0x80) out += lower_case(c);
    }
    return std::is_sorted(collated.begin(), collated.end());
}

std::vector<KindOfNames> kinds_of_names(std::span<const std::string> names, std::string_view ending) {
    const auto split_up = split_names(names);
    std::map<std::string, KindOfNames> kinds;
    for (std::size_t place = 0; place < names.size(); ++place) kinds[key_of(split_up[place])].places.push_back(place);
    std::vector<KindOfNames> out;
    for (auto& [key, kind] : kinds) {
        const auto& first = split_up[kind.places[0]];
        std::vector<std::size_t> varying;
        for (std::size_t n = 0; n < first.numbers.size(); ++n)
            if (distinct(split_up, kind.places, n) > 1) varying.push_back(n);
        kind.varying_numbers = varying.size();
        auto shown = first;
        for (auto& text : shown.texts) text = varying.size() == 1 ? with_percent_doubled(text) : text;
        kind.pattern = marked(shown, varying, varying.size() == 1 ? "%d" : "*") + std::string(ending);
        out.push_back(std::move(kind));
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) {
        return a.places.size() != b.places.size() ? a.places.size() > b.places.size() : a.places[0] < b.places[0];
    });
    return out;
}

Result<FrameOrder> order_of_frames(std::span<const std::string> names, std::string_view ending) {
    NumberedNames all{split_names(names), {}, all_places(names.size()), ending};
    if (names.empty() || all.names[0].numbers.empty()) return FrameOrder{all.in_order, {}, {}};
    const bool decimal = names.size() > 1 && join_decimals(all.names);
    std::stable_sort(all.in_order.begin(), all.in_order.end(),
                     [&](std::size_t a, std::size_t b) { return compare_all(all.names[a], all.names[b]) < 0; });
    if (auto same = refuse_same_numbers(all); !same) return tl::unexpected(same.error());
    const std::size_t numbers = all.names[0].numbers.size();
    for (std::size_t n = 0; n < numbers; ++n)
        if (distinct(all.names, all.in_order, n) > 1) all.varying.push_back(n);
    std::optional<Counter> best;
    if (names.size() == 1) best = counter_of(all, numbers - 1);
    for (const auto number : all.varying)
        if (const auto counter = counter_of(all, number); counter && (!best || counter->rank() > best->rank()))
            best = counter;
    if (!best && names.size() == 1) return FrameOrder{all.in_order, {}, {}};
    FrameOrder out;
    if (!best) {
        auto by_all = order_by_all(all);
        if (!by_all) return by_all;
        out = std::move(*by_all);
    } else {
        out = {best->places, best->numbers, {}};
        remark_on(out, all, *best);
    }
    if (decimal)
        out.remarks.push_back(
            {"decimal-numbers",
             "the numbers in the names are decimal, as times are (" + all.text(out.places[0]) +
                 "): the frames are in their order, but their times are not taken from it (see --timestamps)",
             false});
    return out;
}

std::optional<FrameOrder> order_by_first_number(std::span<const std::string> names) {
    std::vector<std::string> beginnings;
    for (const auto& name : names) {
        const auto first = split(name);
        if (first.numbers.empty()) return std::nullopt;
        beginnings.push_back(first.texts[0] + first.numbers[0].digits);
    }
    if (kinds_of_names(beginnings, "").size() != 1) return std::nullopt;
    auto order = order_of_frames(beginnings, "");
    if (!order || order->numbers.empty() || !frame_step(order->numbers)) return std::nullopt;
    order->remarks.push_back({"names-differ",
                              "the names differ otherwise than by a number: the frames are counted by the first one in "
                              "each name",
                              false});
    return std::move(*order);
}

std::optional<std::uint64_t> frame_step(std::span<const std::uint64_t> numbers) {
    if (numbers.size() < 2) return std::uint64_t{1};
    std::uint64_t step = 0;
    for (std::size_t k = 1; k < numbers.size(); ++k) step = std::gcd(step, numbers[k] - numbers[k - 1]);
    if (step == 0 || (numbers.back() - numbers[0]) / step >= 2 * numbers.size()) return std::nullopt;
    return step;
}

std::optional<std::string> original_of_copy(std::string_view name) {
    constexpr std::array before = {"copy of ", "kopie von ", "copia de ", "copie de "};
    constexpr std::array behind = {" - copy", "_copy",    "-copy",  " copy",    ".copy",  " - kopie", " kopie",
                                   "_kopie",  " - copia", " copia", " - copie", " copie", "_old",     "_backup",
                                   "_bak",    ".bak",     ".old",   ".orig",    ".backup"};
    const std::string all = lower_case(name);
    for (const std::string_view mark : before)
        if (all.starts_with(mark) && all.size() > mark.size()) return std::string(name.substr(mark.size()));
    // A number behind the mark, "(2)" or "2", and "(2)" without a mark.
    std::size_t end = all.size();
    const bool in_brackets = all.ends_with(')');
    if (in_brackets) --end;
    while (end > 0 && is_digit(all[end - 1])) --end;
    const bool has_number = end < all.size() - (in_brackets ? 1 : 0);
    if (in_brackets && (!has_number || end == 0 || all[end - 1] != '(')) return std::nullopt;
    if (in_brackets) --end;
    while (end > 0 && all[end - 1] == ' ') --end;
    const std::string_view rest = std::string_view(all).substr(0, end);
    for (const std::string_view mark : behind)
        if (rest.ends_with(mark) && rest.size() > mark.size()) return std::string(name.substr(0, end - mark.size()));
    if (in_brackets && end > 0) return std::string(name.substr(0, end));
    return std::nullopt;
}

bool is_unfinished_name(std::string_view name) {
    const std::string all = lower_case(name);
    for (const std::string_view ending : {".tmp", ".temp", ".part", ".partial", "_tmp", "~"})
        if (all.ends_with(ending)) return true;
    return all.starts_with("~") || all.find("conflicted copy") != all.npos || all.find(".sync-conflict-") != all.npos;
}

}  // namespace htvm
