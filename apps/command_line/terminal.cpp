#include "command_line/terminal.h"

#include <fmt/core.h>

#include <chrono>
#include <cstdio>
#include <system_error>

#include "command_line/console.h"
#include "command_line/visible.h"

namespace htvm::app {
namespace {

long long now_ms() {
    using namespace std::chrono;
    return duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count();
}

std::string speaker = "htvm";
bool quiet = false;

void say(const std::string& text) {
    try {
        fmt::print(stderr, "{}", text);
        std::fflush(stderr);
    } catch (const std::system_error&) {  // told nobody
    }
}

void say_line(const std::string& kind, const std::string& line) {
    say(fmt::format("{}: {}{}\n", speaker, kind, visible_lines(line)));
}

}  // namespace

void speak_as(const std::string& program) { speaker = program; }
void quieten() { quiet = true; }
void note(const std::string& line) {
    if (!quiet) say_line("", line);
}
void tell(const std::string& lines) {
    if (!quiet) say(lines);
}
void warn(const std::string& line) { say_line("warning: ", line); }
void tell_error(const std::string& line) { say_line("error: ", line); }

std::string counted(std::size_t count, const std::string& what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

Progress::Progress(std::string what, std::size_t total) : what_(std::move(what)), total_(total), start_ms_(now_ms()) {}

void Progress::step(const std::string& detail) {
    ++done_;
    const long long now = now_ms();
    if (quiet || !errors_go_to_terminal() || (now - last_ms_ < 100 && done_ != total_)) return;
    last_ms_ = now;
    shown_ = true;
    const double seconds = static_cast<double>(now - start_ms_) / 1000.0;
    const double rate = seconds > 0 ? static_cast<double>(done_) / seconds : 0;
    std::string line = total_ > 0 ? fmt::format("{} {}/{}", what_, done_, total_) : fmt::format("{} {}", what_, done_);
    line += fmt::format("  {:.1f}/s", rate);
    if (total_ > done_ && rate > 0) line += fmt::format("  {:.0f} s left", static_cast<double>(total_ - done_) / rate);
    if (!detail.empty()) line += "  " + detail;
    say("\r\033[K" + line);
}

Progress::~Progress() {
    if (shown_) say("\r\033[K");
}

}  // namespace htvm::app
