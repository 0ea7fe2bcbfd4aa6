#include "texture/thread_priority.h"

#ifdef __linux__
#include <sched.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <string>
#include <system_error>

namespace htvm {

std::vector<int> threads_before_all_else() {
    std::vector<int> out;
    std::error_code ended;
    for (std::filesystem::directory_iterator at("/proc/self/task", ended), end; !ended && at != end;
         at.increment(ended)) {
        const auto name = at->path().filename().string();
        int number = 0;
        if (std::from_chars(name.data(), name.data() + name.size(), number).ec != std::errc()) continue;
        if (sched_getscheduler(number) == SCHED_FIFO) out.push_back(number);
    }
    return out;
}

void take_back_precedence(const std::vector<int>& but_from) {
    const sched_param usual{};
    for (const int thread : threads_before_all_else())
        if (std::find(but_from.begin(), but_from.end(), thread) == but_from.end())
            sched_setscheduler(thread, SCHED_OTHER, &usual);  // where that is refused, it is as it was
}

}  // namespace htvm
#else
namespace htvm {

std::vector<int> threads_before_all_else() { return {}; }
void take_back_precedence(const std::vector<int>&) {}

}  // namespace htvm
#endif
