// The processor time of the calling thread: a clock that stands still while other programs run.
#pragma once

#include <ctime>

namespace trimray {

/// Seconds since an arbitrary moment.
inline double thread_cpu_seconds()
{
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

} // namespace trimray
