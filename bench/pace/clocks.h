// The clocks of the pace programs: processor time hardly depends on what else the machine does; real time does.
#pragma once

#include <sys/resource.h>

#include <chrono>

namespace htvm::pace {

// The processor time of all threads of this process, since it began.
inline double processor_milliseconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto of = [](const timeval& t) { return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * double(t.tv_usec); };
    return of(usage.ru_utime) + of(usage.ru_stime);
}

// Since some moment of the past.
inline double milliseconds() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace htvm::pace
