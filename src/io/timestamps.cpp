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

// ---- Files ----------------------------------------------------------------------------------------------------------

struct Column {
    bool is_frame = false, is_time = false;
    const char* unit = "";  // put behind its numbers
};

// What a column of that name holds.
Column column_of(std::string_view name) {
    if (name == "frame" || name == "number") return {.is_frame = true};
    if (name == "timestamp" || name == "time" || name == "seconds" || name == "timecode") return {.is_time = true};
    if (name == "timestamp_us" || name == "microseconds") return {.is_time = true, .unit = "us"};
    if (name == "timestamp_ms" || name == "milliseconds") return {.is_time = true, .unit = "ms"};
    return {};
}

// A ';' is part of drop-frame timecode and separates nothing.
std::vector<std::string_view> cells_of(std::string_view line) {
    std::vector<std::string_view> out;
    for (;;) {
        const auto end = std::min(line.find_first_of(",\t"), line.size());
        out.push_back(trimmed(line.substr(0, end)));
        if (end == line.size()) return out;
        line.remove_prefix(end + 1);
    }
}

Result<void> add(FrameTimes& times, std::string_view number, std::string_view time, const FrameRate& rate) {
    const auto microseconds = parse_time(time, rate);
    if (!microseconds) return tl::unexpected(microseconds.error());
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

Result<FrameTimes> from_csv(std::string_view text, const FrameRate& rate) {
    FrameTimes out;
    std::vector<Column> columns;
    for (std::size_t line_number = 1; !text.empty(); ++line_number) {
        const auto end = std::min(text.find('\n'), text.size());
        const auto line = trimmed(text.substr(0, end));
        text.remove_prefix(std::min(text.size(), end + 1));
        if (line.empty() || line.front() == '#') continue;
        const auto cells = cells_of(line);
        const auto at = [&](const std::string& message) {
            return fail(ErrorKind::bad_input, "line " + std::to_string(line_number) + ": " + message);
        };
        if (columns.empty()) {
            for (const auto cell : cells) columns.push_back(column_of(cell));
            const bool named = std::any_of(columns.begin(), columns.end(), [](const Column& c) { return c.is_time; });
            if (named) continue;
            if (cells.size() > 2) return at("of more than two columns, a first line must name them: frame,timestamp");
            columns = cells.size() == 2 ? std::vector<Column>{{.is_frame = true}, {.is_time = true}}
                                        : std::vector<Column>{{.is_time = true}};
        }
        std::string number, time;
        for (std::size_t c = 0; c < std::min(cells.size(), columns.size()); ++c) {
            if (columns[c].is_frame) number = cells[c];
            if (columns[c].is_time && time.empty()) time = std::string(cells[c]) + columns[c].unit;
        }
        if (auto added = add(out, number, time, rate); !added) return at(added.error().message);
    }
    return out;
}

// A JSON time: a number, of the unit, or a text.
std::string text_of(const nlohmann::json& value, const char* unit) {
    if (value.is_number_integer()) return std::to_string(value.get<std::int64_t>()) + unit;
    if (value.is_number()) {
        std::array<char, 40> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), value.get<double>()).ptr;
        return std::string(text.data(), end) + unit;
    }
    return value.is_string() ? value.get<std::string>() : std::string("nothing");
}

Result<FrameTimes> from_json(const nlohmann::json& document, const FrameRate& rate) {
    const nlohmann::json* list = &document;
    const char* unit = "";
    if (document.is_object())
        for (const char* name : {"timestamps", "timestamps_us", "frames"})
            if (document.contains(name)) {
                list = &document[name];
                if (std::string_view(name).ends_with("_us")) unit = "us";
            }
    if (!list->is_array())
        return fail(ErrorKind::bad_input, "holds no list \"timestamps\", \"timestamps_us\" or \"frames\"");
    FrameTimes out;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const auto& entry = (*list)[i];
        std::string number, time;
        if (!entry.is_object()) {
            time = text_of(entry, unit);
        } else if (entry.contains("timestamp_us")) {
            time = text_of(entry["timestamp_us"], "us");
        } else if (entry.contains("timestamp")) {
            time = text_of(entry["timestamp"], "");
        }
        if (entry.is_object() && entry.contains("frame")) number = text_of(entry["frame"], "");
        if (auto added = add(out, number, time, rate); !added)
            return fail(ErrorKind::bad_input, "entry " + std::to_string(i) + ": " + added.error().message);
    }
    return out;
}

Result<FrameTimes> parse_frame_times(std::string_view text, const FrameRate& rate) {
    const auto start = trimmed(text);
    if (start.starts_with('[') || start.starts_with('{')) {
        const auto document = nlohmann::json::parse(text, nullptr, false);
        if (document.is_discarded()) return fail(ErrorKind::bad_input, "is no valid JSON");
        return from_json(document, rate);
    }
    return from_csv(text, rate);
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
    if (text.find(':') != text.npos) return parse_clock(text, rate);
    std::string_view number = text;
    double factor = 1e6;
    for (const auto& [unit, microseconds] : {std::pair{"us", 1.0}, {"ms", 1e3}, {"s", 1e6}})
        if (number.ends_with(unit)) {
            number = trimmed(number.substr(0, number.size() - std::string_view(unit).size()));
            factor = microseconds;
            break;
        }
    const auto value = parse_number(number);
    if (!value) return no_time(text, "time: write seconds, or 1250ms, 1250000us, 00:00:01.25 or 00:00:01:06");
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
