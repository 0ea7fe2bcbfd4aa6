// What the person who runs a hub may want to know, as values. Whoever has something to tell makes one; the program
// decides where it is written, and in which form.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace htvm::live {

struct Event {
    std::string name;       // what happened, for machines: words joined by underscores, such as "published"
    std::string text;       // the same for people, without stream and address: "a publisher is connected"
    std::string stream{};   // which one it concerns; "": none
    std::string address{};  // of the other side; "": none
    std::vector<std::pair<std::string, std::int64_t>>
        numbers{};                                             // by name, for machines; the text has those for people
    bool warning = false;                                      // the person may have to do something
    std::vector<std::pair<std::string, std::string>> words{};  // likewise by name, for machines
};

// Where events go; an empty one: nowhere. Called on the server's thread, so it must not block for long.
using Log = std::function<void(const Event&)>;

// Passes on at most so many events of a name in a second, so that nobody can fill a disk by being refused; at the next
// event of the name behind that second it says how many there were besides.
Log limited(Log log, std::uint64_t each_second);

// One line without its end. As JSON: {"time": "2026-11-22T13:05:51.123Z", "event": name, "text": ..., and the others if
// there are any, the numbers by their own names}. For people: "13:05:51Z anna: a publisher is connected (192.0.2.1)".
// Bytes that are no text are replaced, so that nobody can write lines or control a terminal by a name.
std::string json_line(const Event& event, std::chrono::system_clock::time_point time);
std::string text_line(const Event& event, std::chrono::system_clock::time_point time);

}  // namespace htvm::live
