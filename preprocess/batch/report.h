// A batch as a report: JSON, and a page of one file.
#pragma once

#include "preprocess/batch/summary.h"

#include <filesystem>
#include <string>

namespace trimray {

/// Counts by class, groups of failures with the command that repeats one of each, how long conversions took and where,
/// how large packs are, the slowest files, and the failures. Of long lists the first few thousand, and how many there
/// are.
Json report_json(const BatchSummary& summary);

/// The same as a page, with previews of up to `thumbnails` packs of the store in `output`, spread over the files.
std::string report_html(const BatchSummary& summary, const std::filesystem::path& output, size_t thumbnails);

} // namespace trimray
