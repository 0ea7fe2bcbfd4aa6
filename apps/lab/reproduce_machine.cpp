#include "reproduce_machine.h"

#include <draco/core/draco_version.h>
#include <embree3/rtcore_config.h>
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "rd_peer.h"

namespace htvm::lab {
namespace {

std::string text_of(const char* file) {
    std::ifstream in(file);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
}

std::string output_of(const char* command) {
    std::string out;
    if (FILE* pipe = popen(command, "r")) {
        std::array<char, 256> line{};
        if (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) out = line.data();
        pclose(pipe);
    }
    while (!out.empty() && (out.back() == '\n' || out.back() == ' ')) out.pop_back();
    return out;
}

std::string system_name() {
    std::istringstream lines(text_of("/etc/os-release"));
    const std::string key = "PRETTY_NAME=";
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key)) continue;
        std::string name = line.substr(key.size());
        std::erase(name, '"');
        return name;
    }
    return "unknown";
}

std::string now() {
    const auto time = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm utc{};
    gmtime_r(&time, &utc);
    std::array<char, 64> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc);
    return text.data();
}

}  // namespace

std::string proc_value(const std::string& text, const std::string& key) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key)) continue;
        const auto colon = line.find(':');
        if (colon == std::string::npos) continue;
        const auto begin = line.find_first_not_of(" \t", colon + 1);
        if (begin == std::string::npos) return {};
        return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
    }
    return {};
}

std::vector<std::pair<std::string, std::string>> machine_facts(unsigned threads) {
    const auto cpu = proc_value(text_of("/proc/cpuinfo"), "model name");
    const auto kilobytes = std::strtod(proc_value(text_of("/proc/meminfo"), "MemTotal").c_str(), nullptr);
    const auto gnuplot = output_of("gnuplot --version 2>/dev/null");
#ifdef NDEBUG
    const char* build = "optimised";
#else
    const char* build = "with assertions";
#endif
    return {{"Program", fmt::format("htvm-lab {}, {}", HTVM_VERSION, build)},
            {"Date", now()},
            {"Processor", fmt::format("{}, {} cores, {} threads used", cpu.empty() ? "unknown" : cpu,
                                      std::thread::hardware_concurrency(), threads)},
            {"Memory", fmt::format("{:.1f} GiB", kilobytes / (1024 * 1024))},
            {"System", system_name()},
#ifdef __clang__
            {"Compiler", "clang " __clang_version__},
#else
            {"Compiler", "g++ " __VERSION__},
#endif
            {"Libraries", fmt::format("Draco {}, Embree {}, nlohmann/json {}.{}.{}, fmt {}.{}.{}, CLI11 {}",
                                      draco::kDracoVersion, RTC_VERSION_STRING, NLOHMANN_JSON_VERSION_MAJOR,
                                      NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH, FMT_VERSION / 10000,
                                      FMT_VERSION / 100 % 100, FMT_VERSION % 100, CLI11_VERSION)},
            {"Charts", gnuplot.empty() ? "no gnuplot" : gnuplot}};
}

std::string own_command() {
    std::ifstream in("/proc/self/cmdline", std::ios::binary);
    std::string out;
    for (std::string word; std::getline(in, word, '\0');) {
        if (out.empty()) {
            out = word.substr(word.find_last_of('/') + 1);
            continue;
        }
        const bool plain =
            word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./,=+:@%-") ==
            std::string::npos;
        out += " " + (plain && !word.empty() ? word : quoted_for_shell(word));
    }
    return out;
}

}  // namespace htvm::lab
