#include "live/hub/event.h"

#include <array>
#include <ctime>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace htvm::live {
namespace {

// In UTC. format: as strftime has it.
std::string time_text(std::chrono::system_clock::time_point time, const char* format) {
    const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
    std::tm parts{};
    gmtime_r(&seconds, &parts);
    std::array<char, 32> text{};
    return std::string(text.data(), std::strftime(text.data(), text.size(), format, &parts));
}

std::string without_control(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    return text;
}

}  // namespace

std::string json_line(const Event& event, std::chrono::system_clock::time_point time) {
    const auto since_second = time - std::chrono::floor<std::chrono::seconds>(time);
    auto milliseconds = std::to_string(std::chrono::floor<std::chrono::milliseconds>(since_second).count());
    milliseconds.insert(0, 3 - milliseconds.size(), '0');
    nlohmann::ordered_json out = {{"time", time_text(time, "%Y-%m-%dT%H:%M:%S.") + milliseconds + 'Z'},
                                  {"event", event.name},
                                  {"text", event.text}};
    if (!event.stream.empty()) out["stream"] = event.stream;
    if (!event.address.empty()) out["address"] = event.address;
    if (event.warning) out["warning"] = true;
    for (const auto& [name, value] : event.words) out[name] = value;
    for (const auto& [name, value] : event.numbers) out[name] = value;
    return out.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string text_line(const Event& event, std::chrono::system_clock::time_point time) {
    std::string out = time_text(time, "%H:%M:%SZ ");
    if (!event.stream.empty()) out += event.stream + ": ";
    out += event.text;
    if (!event.address.empty()) out += " (" + event.address + ')';
    return without_control(std::move(out));
}

Log limited(Log log, std::uint64_t each_second) {
    using Clock = std::chrono::steady_clock;
    struct Second {
        Clock::time_point since{};
        std::uint64_t events = 0;
    };
    return [log = std::move(log), each_second, seconds = std::map<std::string, Second>()](const Event& event) mutable {
        auto& second = seconds[event.name];
        const auto now = Clock::now();
        if (now - second.since >= std::chrono::seconds(1)) {
            const auto events = std::exchange(second, {now, 0}).events;
            if (events > each_second)
                log({.name = event.name,
                     .text = std::to_string(events - each_second) + " more of these were not told"});
        }
        if (++second.events <= each_second) log(event);
    };
}

}  // namespace htvm::live
