// What a person sees of a batch at work, on stderr: a line a failure; where stderr is a terminal below them one line
// that is kept up to date, elsewhere a line now and then.
#pragma once

#include "preprocess/batch/supervisor.h"

#include <chrono>
#include <memory>

namespace trimray {

/// `files` are those of this run; `skipped` were done by runs before.
std::unique_ptr<BatchWatcher> make_progress_view(const std::vector<BatchFile>& files, size_t skipped, bool quiet);

/// "1 h 05 min", "3 min 20 s", "12 s"
std::string duration_text(double seconds);

} // namespace trimray
