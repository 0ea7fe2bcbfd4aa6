// What the programs say to a person: notes, warnings and progress, all on stderr, so that stdout stays for data.
#pragma once

#include <cstddef>
#include <string>

namespace htvm::app {

// The program's name, in front of every note and warning; "htvm" before the first call.
void speak_as(const std::string& program);
void note(const std::string& line);
void warn(const std::string& line);

// One line that is rewritten in place, at most ten times a second, on a terminal; silent elsewhere.
class Progress {
public:
    Progress(std::string what, std::size_t total);  // total 0: not known
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    void step(const std::string& detail = {});

private:
    std::string what_;
    std::size_t total_, done_ = 0;
    long long last_ms_ = 0, start_ms_ = 0;
    bool shown_ = false;
};

}  // namespace htvm::app
