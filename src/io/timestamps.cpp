#include "io/timestamps.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/mesh_file.h"
#include "io/number_text.h"

namespace htvm {
namespace {

// Years of microseconds, and whole numbers that a double holds.
constexpr double farthest = 9e15;

tl::unexpected<Error> no_time(std::string_view text, const char* what) {
    return fail(ErrorKind::bad_input, "'" + std::string(text.substr(0, 40)) + "' is no " + what);
}

std::string_view trimmed(std::string_view text) {
    constexpr const char* blank = " \t\r\n\"";
    const auto first = text.find_first_not_of(blank);
    if (first == text.npos) return {};
    return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::optional<std::uint64_t> whole(std::string_view text) {
    std::uint64_t out = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), out);
    if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
    return out;
}

Result<std::int64_t> in_microseconds(std::string_view text, double value, double factor) {
    const double out = value * factor;
    if (!(std::abs(out) <= farthest)) return no_time(text, "time within some hundred years");
    return std::llround(out);
}

// hours:minutes:seconds, and a frame behind ':' or ';', or a fraction of the second.
Result<std::int64_t> parse_clock(std::string_view text, const FrameRate& rate) {
    std::array<std::string_view, 4> parts;
    std::size_t count = 0;
    bool drop_frame = false;
    for (std::string_view rest = text; count < parts.size();) {
        const auto end = std::min(rest.find_first_of(":;"), rest.size());
        parts[count++] = rest.substr(0, end);
        if (end == rest.size()) break;
        drop_frame = drop_frame || rest[end] == ';';
        rest.remove_prefix(end + 1);
        if (count == parts.size()) return no_time(text, "time");
    }
    const auto hours = whole(parts[0]), minutes = whole(parts[1]);
    if (count < 3 || !hours || !minutes || *hours > 999 || *minutes > 59) return no_time(text, "time");
    if (count == 3) {
        const auto seconds = parse_number(parts[2]);
        if (drop_frame || !seconds || !(*seconds >= 0 && *seconds < 60)) return no_time(text, "time");
        return in_microseconds(
            text, 3600.0 * static_cast<double>(*hours) + 60.0 * static_cast<double>(*minutes) + *seconds, 1e6);
    }
    const auto seconds = whole(parts[2]), frame = whole(parts[3]);
    if (!seconds || !frame || *seconds > 59) return no_time(text, "timecode");
    if (rate.numerator == 0)
        return fail(ErrorKind::bad_input, "the timecode '" + std::string(text) + "' needs the frame rate: give --fps");
    const auto nominal = static_cast<std::uint64_t>(std::llround(rate.per_second()));
    if (nominal == 0 || *frame >= nominal)
        return fail(ErrorKind::bad_input, "the timecode '" + std::string(text) + "' has a frame number beyond the " +
                                              std::to_string(nominal) + " frames of a second");
    const auto all_minutes = 60 * *hours + *minutes;
    auto frames = (60 * all_minutes + *seconds) * nominal + *frame;
    if (drop_frame) {
        if (nominal % 30 != 0)
            return fail(ErrorKind::bad_input, "drop-frame timecode ('" + std::string(text) +
                                                  "') is of 29.97 or 59.94 frames per second: give --fps 30000/1001");
        frames -= nominal / 15 * (all_minutes - all_minutes / 10);
    }
    return in_microseconds(text, static_cast<double>(frames) * rate.denominator / rate.numerator, 1e6);
}

// The next `digits` digits of a text, which it loses; nothing if they are not there.
std::optional<std::uint64_t> take_digits(std::string_view& text, std::size_t digits) {
    const auto part = text.substr(0, digits);
    if (part.size() < digits) return std::nullopt;
    text.remove_prefix(digits);
    return whole(part);
}

bool take(std::string_view& text, char c) {
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    return true;
}

// From 1970-01-01 on, in the calendar of today, also for earlier days.
std::int64_t days_since_1970(std::int64_t year, std::int64_t month, std::int64_t day) {
    // Years begin in March, so that a leap day is their last.
    if (month <= 2) --year;
    const std::int64_t months = (month + 9) % 12;
    const std::int64_t days_before_month = (153 * months + 2) / 5;
    return 365 * year + year / 4 - year / 100 + year / 400 + days_before_month + day - 1 - 719468;
}

bool looks_like_date(std::string_view text) {
    const auto digits = std::min(text.find_first_not_of("0123456789"), text.size());
    if (digits == 4) return text.size() >= 10 && text[4] == '-' && text[7] == '-';
    return digits == 8 && text.size() > 9 && (text[8] == 'T' || text[8] == 't');
}

// Minutes to take off, of Z, +01:00, +0100 or +01, or nothing.
std::optional<std::int64_t> parse_offset(std::string_view text) {
    if (text.empty() || text == "Z" || text == "z") return 0;
    const bool behind = text[0] == '-';
    if (!behind && text[0] != '+') return std::nullopt;
    text.remove_prefix(1);
    const auto hours = take_digits(text, 2);
    take(text, ':');
    const auto minutes = text.empty() ? std::optional<std::uint64_t>(0) : take_digits(text, 2);
    if (!hours || !minutes || !text.empty() || *hours > 23 || *minutes > 59) return std::nullopt;
    const auto size = static_cast<std::int64_t>(60 * *hours + *minutes);
    return behind ? -size : size;
}

// Microseconds of the hours, minutes and seconds at the beginning of a text, which it loses.
std::optional<std::int64_t> take_time_of_day(std::string_view& text) {
    const auto hours = take_digits(text, 2);
    const bool colons = take(text, ':');
    const auto minutes = take_digits(text, 2);
    if (!hours || !minutes || *hours > 23 || *minutes > 59) return std::nullopt;
    double seconds = 0;
    const bool has_seconds = colons ? take(text, ':') : !text.empty() && text[0] >= '0' && text[0] <= '9';
    if (has_seconds) {
        const auto end = std::min(text.find_first_of("Zz+- "), text.size());
        std::string written(text.substr(0, end));
        std::replace(written.begin(), written.end(), ',', '.');
        text.remove_prefix(end);
        const auto number = parse_number(written);
        if (!number || !(*number >= 0 && *number < 61)) return std::nullopt;
        seconds = *number;
    }
    return static_cast<std::int64_t>(60 * *hours + *minutes) * 60'000'000 + std::llround(seconds * 1e6);
}

Result<std::int64_t> parse_date(std::string_view text) {
    auto rest = text;
    const auto refused = [&] { return no_time(text, "date and time such as 2024-01-31T12:05:01.123Z"); };
    const auto year = take_digits(rest, 4);
    const bool dashes = take(rest, '-');
    const auto month = take_digits(rest, 2);
    if (dashes && !take(rest, '-')) return refused();
    const auto day = take_digits(rest, 2);
    if (!year || !month || !day || *month < 1 || *month > 12 || *day < 1 || *day > 31) return refused();
    std::optional<std::int64_t> time = 0;
    if (!rest.empty()) {
        if (!take(rest, 'T') && !take(rest, 't') && !take(rest, ' ')) return refused();
        time = take_time_of_day(rest);
    }
    const auto offset = parse_offset(trimmed(rest));
    if (!time || !offset) return refused();
    const auto days = days_since_1970(static_cast<std::int64_t>(*year), static_cast<std::int64_t>(*month),
                                      static_cast<std::int64_t>(*day));
    return (1440 * days - *offset) * 60'000'000 + *time;
}

// ---- Files ----------------------------------------------------------------------------------------------------------

struct Column {
    bool is_frame = false, is_time = false;
    std::string_view unit = "";  // put behind its numbers
};

// In lower case, letters and digits alone.
std::string bare(std::string_view name) {
    std::string out;
    for (const char c : name) {
        if (c >= 'A' && c <= 'Z') out += static_cast<char>(c - 'A' + 'a');
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) out += c;
    }
    return out;
}

// What a column, or a member of a JSON object, of that name holds.
Column column_of(std::string_view written) {
    constexpr std::array<std::string_view, 7> frames = {"frame",      "number",  "index",  "framenumber",
                                                        "frameindex", "frameid", "frameno"};
    constexpr std::array<std::string_view, 14> times = {"timestamp", "timestamps", "time",     "times", "timecode",
                                                        "date",      "datetime",   "unixtime", "unix",  "t",
                                                        "elapsed",   "clock",      "utc",      "timein"};
    // Longer ones before those that they end with.
    constexpr std::array<std::pair<std::string_view, std::string_view>, 14> units = {{{"nanoseconds", "ns"},
                                                                                      {"microseconds", "us"},
                                                                                      {"milliseconds", "ms"},
                                                                                      {"seconds", ""},
                                                                                      {"nsec", "ns"},
                                                                                      {"usec", "us"},
                                                                                      {"msec", "ms"},
                                                                                      {"secs", ""},
                                                                                      {"sec", ""},
                                                                                      {"millis", "ms"},
                                                                                      {"ns", "ns"},
                                                                                      {"us", "us"},
                                                                                      {"ms", "ms"},
                                                                                      {"s", ""}}};
    const auto is_one_of = [](const auto& names, std::string_view name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    const std::string name = bare(written);
    if (is_one_of(frames, name)) return {.is_frame = true};
    if (is_one_of(times, name)) return {.is_time = true};
    for (const auto& [unit, symbol] : units) {
        if (!name.ends_with(unit)) continue;
        const auto before = std::string_view(name).substr(0, name.size() - unit.size());
        if (before.empty() || is_one_of(times, before)) return {.is_time = true, .unit = symbol};
    }
    return {};
}

// The next line, which the text loses; lines end with \n, \r\n or \r.
std::string_view take_line(std::string_view& text) {
    const auto end = std::min(text.find_first_of("\r\n"), text.size());
    const auto line = text.substr(0, end);
    text.remove_prefix(end);
    if (text.starts_with("\r\n")) text.remove_prefix(1);
    if (!text.empty()) text.remove_prefix(1);
    return line;
}

bool is_comment(std::string_view line) { return trimmed(line).empty() || trimmed(line).front() == '#'; }

// A ';' behind hours, minutes and seconds is part of drop-frame timecode and separates nothing.
bool has_semicolon(std::string_view line) {
    for (auto at = line.find(';'); at != line.npos; at = line.find(';', at + 1)) {
        const bool in_timecode = at >= 6 && line[at - 3] == ':' && line[at - 6] == ':';
        if (!in_timecode) return true;
    }
    return false;
}

// What separates the cells of a file, by the first of its lines that separates any.
char separator_of(std::string_view text) {
    while (!text.empty()) {
        const auto line = take_line(text);
        if (is_comment(line)) continue;
        if (line.find('\t') != line.npos) return '\t';
        if (has_semicolon(line)) return ';';
        if (line.find(',') != line.npos) return ',';
        const auto cells = trimmed(line);
        const auto blank = std::min(cells.find(' '), cells.size());
        if (parse_number(cells.substr(0, blank)) && parse_number(trimmed(cells.substr(blank)))) return ' ';
    }
    return ',';
}

std::vector<std::string> cells_of(std::string_view line, char separator) {
    std::vector<std::string> out;
    bool in_quotes = false;
    std::size_t begin = 0;
    for (std::size_t at = 0; at <= line.size(); ++at) {
        if (at < line.size() && line[at] == '"') in_quotes = !in_quotes;
        if (at < line.size() && (in_quotes || line[at] != separator)) continue;
        std::string cell(trimmed(line.substr(begin, at - begin)));
        begin = at + 1;
        if (separator == ' ' && cell.empty()) continue;
        if (separator != ',') std::replace(cell.begin(), cell.end(), ',', '.');
        out.push_back(std::move(cell));
    }
    return out;
}

Result<void> add(FrameTimes& times, std::string_view number, std::string_view time, const FrameRate& rate) {
    const auto microseconds = parse_time(time, rate);
    if (!microseconds) return tl::unexpected(microseconds.error());
    // Dates may lie beyond what a number of microseconds is exact to.
    if (std::abs(static_cast<double>(*microseconds)) > farthest) return no_time(time, "time within some hundred years");
    if (!times.microseconds.empty() && *microseconds <= times.microseconds.back())
        return fail(ErrorKind::bad_input,
                    "the time " + std::string(time) + " is not above the one before; times must ascend");
    times.microseconds.push_back(*microseconds);
    if (number.empty()) return {};
    const auto n = whole(number);
    if (!n) return no_time(number, "frame number");
    if (!times.numbers.empty() && *n <= times.numbers.back())
        return fail(ErrorKind::bad_input, "frame " + std::string(number) + " does not come behind the one before");
    times.numbers.push_back(*n);
    return {};
}

// By the first line with cells; true if it names them.
Result<bool> find_columns(const std::vector<std::string>& cells, std::vector<Column>& columns) {
    for (const auto& cell : cells) columns.push_back(column_of(cell));
    if (std::any_of(columns.begin(), columns.end(), [](const Column& c) { return c.is_time; })) return true;
    if (cells.size() > 2)
        return fail(ErrorKind::bad_input, "of more than two columns, a first line must name them: frame,timestamp");
    columns = cells.size() == 2 ? std::vector<Column>{{.is_frame = true}, {.is_time = true}}
                                : std::vector<Column>{{.is_time = true}};
    // Names in whatever language.
    return std::none_of(cells.begin(), cells.end(),
                        [](const std::string& cell) { return cell.find_first_of("0123456789") != cell.npos; });
}

Result<FrameTimes> from_csv(std::string_view text, const FrameRate& rate) {
    FrameTimes out;
    std::vector<Column> columns;
    char separator = separator_of(text);
    for (std::size_t line_number = 1; !text.empty(); ++line_number) {
        const auto line = take_line(text);
        if (is_comment(line)) continue;
        if (line_number == 1 && line.size() == 5 && line.starts_with("sep=")) {  // as spreadsheets write it
            separator = line[4];
            continue;
        }
        const auto cells = cells_of(line, separator);
        const auto at = [&](const std::string& message) {
            return fail(ErrorKind::bad_input, "line " + std::to_string(line_number) + ": " + message);
        };
        if (columns.empty()) {
            const auto named = find_columns(cells, columns);
            if (!named) return at(named.error().message);
            if (*named) continue;
        }
        std::string number, time;
        for (std::size_t c = 0; c < std::min(cells.size(), columns.size()); ++c) {
            if (columns[c].is_frame && number.empty()) number = cells[c];
            if (columns[c].is_time && time.empty() && !cells[c].empty()) time = cells[c] + std::string(columns[c].unit);
        }
        if (auto added = add(out, number, time, rate); !added) return at(added.error().message);
    }
    return out;
}

// A JSON time: a number, of the unit, or a text.
std::string text_of(const nlohmann::json& value, std::string_view unit) {
    if (value.is_number_integer()) return std::to_string(value.get<std::int64_t>()) + std::string(unit);
    if (value.is_number()) {
        std::array<char, 40> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), value.get<double>()).ptr;
        return std::string(text.data(), end) + std::string(unit);
    }
    return value.is_string() ? value.get<std::string>() : std::string("nothing");
}

// A list of times is called like a column of them, or "frames".
Result<FrameTimes> from_json(const nlohmann::json& document, const FrameRate& rate) {
    const nlohmann::json* list = &document;
    std::string_view unit;
    if (document.is_object())
        for (const auto& [name, value] : document.items()) {
            const auto column = column_of(name);
            if (!value.is_array() || (!column.is_time && bare(name) != "frames")) continue;
            list = &value;
            unit = column.unit;
            if (column.is_time) break;
        }
    if (!list->is_array())
        return fail(ErrorKind::bad_input, "holds no list \"timestamps\", \"timestamps_us\" or \"frames\"");
    FrameTimes out;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const auto& entry = (*list)[i];
        std::string number, time;
        if (!entry.is_object()) time = text_of(entry, unit);
        if (entry.is_object())
            for (const auto& [name, value] : entry.items()) {
                const auto column = column_of(name);
                // One that says its unit goes before one that does not.
                if (column.is_time && (time.empty() || !column.unit.empty())) time = text_of(value, column.unit);
                if (column.is_frame && number.empty()) number = text_of(value, "");
            }
        if (auto added = add(out, number, time, rate); !added)
            return fail(ErrorKind::bad_input, "entry " + std::to_string(i) + ": " + added.error().message);
    }
    return out;
}

}  // namespace

Result<FrameRate> parse_frame_rate(std::string_view text) {
    const auto slash = text.find('/');
    const auto refused = [&] { return no_time(text, "frame rate: write it as 30, 29.97 or 30000/1001"); };
    if (slash != text.npos) {
        const auto numerator = whole(text.substr(0, slash)), denominator = whole(text.substr(slash + 1));
        constexpr auto most = std::numeric_limits<std::uint32_t>::max();
        if (!numerator || !denominator || *numerator == 0 || *denominator == 0 || *numerator > most ||
            *denominator > most)
            return refused();
        return FrameRate{static_cast<std::uint32_t>(*numerator), static_cast<std::uint32_t>(*denominator)};
    }
    const auto rate = parse_number(text);
    if (!rate || !(*rate >= 0.001 && *rate < 4e6)) return refused();
    return FrameRate{static_cast<std::uint32_t>(std::lround(*rate * 1000)), 1000};
}

Result<std::int64_t> parse_time(std::string_view text, const FrameRate& rate) {
    text = trimmed(text);
    if (looks_like_date(text)) return parse_date(text);
    if (text.find(':') != text.npos) return parse_clock(text, rate);
    std::string_view number = text;
    double factor = 1e6;
    bool has_unit = false;
    for (const auto& [unit, microseconds] : {std::pair{"ns", 1e-3}, {"us", 1.0}, {"ms", 1e3}, {"s", 1e6}})
        if (number.ends_with(unit)) {
            number = trimmed(number.substr(0, number.size() - std::string_view(unit).size()));
            factor = microseconds;
            has_unit = true;
            break;
        }
    const auto value = parse_number(number);
    if (!value) return no_time(text, "time: write seconds, or 1250ms, 1250000us, 00:00:01.25 or 00:00:01:06");
    // As seconds they would lie centuries ahead.
    for (const double finer : {1e3, 1.0, 1e-3})
        if (!has_unit && std::abs(*value) * factor > farthest) factor = finer;
    return in_microseconds(text, *value, factor);
}

std::string time_text(std::int64_t microseconds) {
    const std::uint64_t size =
        microseconds < 0 ? 0 - static_cast<std::uint64_t>(microseconds) : static_cast<std::uint64_t>(microseconds);
    std::string fraction = std::to_string(1000000 + size % 1000000).substr(1);
    fraction.erase(fraction.find_last_not_of('0') + 1);
    std::string out = (microseconds < 0 ? "-" : "") + std::to_string(size / 1000000);
    return fraction.empty() ? out : out + "." + fraction;
}

Result<FrameTimes> parse_frame_times(std::string_view text, const FrameRate& rate) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    const auto start = trimmed(text);
    if (start.starts_with('[') || start.starts_with('{')) {
        const auto document = nlohmann::json::parse(text, nullptr, false);
        if (document.is_discarded()) return fail(ErrorKind::bad_input, "is no valid JSON");
        return from_json(document, rate);
    }
    return from_csv(text, rate);
}

Result<FrameTimes> read_frame_times(const std::filesystem::path& path, const FrameRate& rate) {
    constexpr std::uint64_t most_bytes = std::uint64_t{1} << 30;
    const auto bytes = read_file(path, most_bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    auto out = parse_frame_times({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, rate);
    if (!out) return fail(out.error().kind, path.string() + ": " + out.error().message);
    if (out->microseconds.empty()) return fail(ErrorKind::bad_input, path.string() + " holds no times");
    if (!out->numbers.empty() && out->numbers.size() != out->microseconds.size())
        return fail(ErrorKind::bad_input, path.string() + " gives the number of some frames and not of others");
    return out;
}

std::string frame_times_csv(const FrameTimes& times) {
    std::string out = "frame,timestamp_us\n";
    for (std::size_t i = 0; i < times.microseconds.size(); ++i) {
        const auto number = times.numbers.empty() ? i : times.numbers[i];
        out += std::to_string(number) + "," + std::to_string(times.microseconds[i]) + "\n";
    }
    return out;
}

}  // namespace htvm
