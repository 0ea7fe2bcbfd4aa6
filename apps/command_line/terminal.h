// What the programs tell the user: notes, warnings, errors and progress, all on stderr, so that stdout is left for
// data. Where nobody can be told, as stderr is closed or its disk is full, the work goes on.
#pragma once

#include <cstddef>
#include <string>

namespace htvm::app {

// Sets the program's name, which precedes every note and warning; "htvm" before the first call.
void speak_as(const std::string& program);
// From here on notes, tables and progress are left out; warnings stay.
void quieten();
void note(const std::string& line);
void warn(const std::string& line);
void tell_error(const std::string& line);
// Lines of their own, as they are: a table.
void tell(const std::string& lines);

// "1 frame", "2 frames".
std::string counted(std::size_t count, const std::string& what);

// A line that is rewritten in place, at most ten times per second; only on a terminal.
class Progress {
public:
    Progress(std::string what, std::size_t total);  // total 0: unknown
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
