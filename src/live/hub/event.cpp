#include "live/hub/event.h"

#include <array>
#include <ctime>
#include <nlohmann/json.hpp>

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

}  // namespace htvm::live
