// What a measurement was made with.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace htvm::lab {

// The value after "key" and a colon in the first line that starts with key, as /proc/cpuinfo and /proc/meminfo write
// it; empty where there is none.
std::string proc_value(const std::string& text, const std::string& key);

// Name and value: processor, cores, memory, system, compiler, libraries, program, date.
std::vector<std::pair<std::string, std::string>> machine_facts(unsigned threads);

// The command that runs, as a person would type it.
std::string own_command();

}  // namespace htvm::lab
