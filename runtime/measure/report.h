// What an accuracy report holds, and its forms.
#pragma once

#include "runtime/command_json.h"
#include "runtime/measure/peers.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// A contender as the report names it.
struct ReportedContender {
    std::string dial, name, paper; // as Contender's
    bool smooth = false;
    std::optional<Preparation> preparation; // of the default, where it was made from a CAD file, and of peers
};

struct ModelReport {
    std::string name; // of the file, without its folder
    uint32_t faces = 0, instances = 0;
    std::string pack_options;       // as the pack tells them
    std::vector<std::string> notes; // what was left out, and why
    std::vector<ReportedContender> contenders;
    std::vector<AccuracyView> views;
    std::optional<PaperCounts> paper; // where there are peers
};

struct AccuracyReport {
    std::string command; // that makes it again
    std::string date;    // UTC, ISO 8601
    std::string device;
    AccuracyOptions options;
    std::vector<ModelReport> models;
};

/// "report.json": `schema` counts up when a key changes its meaning. Documented in runtime/measure/REPORT.md.
Json report_json(const AccuracyReport& report);

/// One line a model, view and contender, after a line of column names; the same numbers as in the JSON.
std::string report_csv(const AccuracyReport& report);

/// "report.html": the same numbers as a page of plots and tables, and each contender's picture where it is worst, alone
/// in its file: it needs no network.
std::string report_html(const AccuracyReport& report);

/// Whether times wobbled: the median over all points of (third quartile - first) / median of a point's times.
/// More than kBusySpread: the machine was busy. 0 with fewer than three rounds.
double times_spread(const AccuracyReport& report);
constexpr double kBusySpread = 0.05;

} // namespace trimray
