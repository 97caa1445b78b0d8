// Where a process was when a signal ended it: the worker sends the functions on its stack as it dies, and its
// supervisor picks the CAD kernel's, which tells faults of the kernel apart.
#pragma once

#include <string>

namespace trimray {

/// From now on a fault (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) sends the signal and then the stack's functions to
/// `descriptor` (worker_message.h) before it ends this process as it would have.
void report_crashes(int descriptor);

/// The innermost function of the CAD kernel, "TKShHealing: ShapeFix_Face::FixOrientation", of what was sent; empty
/// where the stack has none.
std::string kernel_frame(const std::string& frames);

} // namespace trimray
