#include "preprocess/batch/report.h"

#include "format/pack_reader.h"
#include "format/page.h"
#include "preprocess/batch/store.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace trimray {
namespace {

const char kPage[] =
#include "report.html.inc"
    ;

constexpr size_t kMostFailures = 5000, kMostSlow = 50;

double mean_of(const std::vector<double>& values)
{
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

Json distribution(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return {{"count", values.size()},         {"mean", mean_of(values)},         {"least", quantile(values, 0)},
            {"10 %", quantile(values, 0.1)},  {"median", quantile(values, 0.5)}, {"90 %", quantile(values, 0.9)},
            {"99 %", quantile(values, 0.99)}, {"most", quantile(values, 1)}};
}

Json row_of(const BatchSummary& summary, const FileSummary& file)
{
    Json row = {{"file", file.file},
                {"class", class_name(file.kind)},
                {"seconds", file.wall_seconds},
                {"peak_memory_bytes", file.peak_memory_bytes},
                {"source_bytes", file.source_bytes},
                {"attempt", file.attempt}};
    if (has_pack(file.kind)) {
        row["pack_bytes"] = file.pack_bytes;
        row["faces"] = file.faces;
    }
    if (file.kind == FileClass::Incomplete)
        row["detail"] = file.dropped_reason;
    else if (file.kind != FileClass::Done)
        row["detail"] = file.detail;
    if (file.kind != FileClass::Done)
        row["repeat"] = repeat_command(summary, file);
    return row;
}

Json groups_json(const BatchSummary& summary)
{
    Json groups = Json::array();
    for (const FailureGroup& group : summary.groups) {
        const FileSummary& example = summary.files[group.files.front()];
        groups.push_back({{"class", class_name(group.kind)},
                          {"reason", group.reason},
                          {"files", group.files.size()},
                          {"example", example.file},
                          {"repeat", repeat_command(summary, example)}});
    }
    return groups;
}

/// Where the time of the conversions that were made went: seconds by phase, all files together.
Json phases_json(const BatchSummary& summary)
{
    std::vector<std::pair<std::string, double>> sums;
    double wall = 0, named = 0;
    for (const FileSummary& file : summary.files) {
        if (!has_pack(file.kind) || file.found)
            continue;
        wall += file.wall_seconds;
        for (const auto& [phase, seconds] : file.phases) {
            auto it = std::find_if(sums.begin(), sums.end(), [&](const auto& sum) { return sum.first == phase; });
            if (it == sums.end())
                it = sums.insert(sums.end(), {phase, 0.0});
            it->second += seconds;
            named += seconds;
        }
    }
    Json phases = Json::object();
    for (const auto& [phase, seconds] : sums)
        phases[phase] = seconds;
    phases["start, hashing and the rest"] = std::max(0.0, wall - named);
    return phases;
}

Json runs_json(const BatchSummary& summary)
{
    Json runs = Json::array();
    for (const RunSummary& run : summary.runs) {
        std::string command;
        for (const std::string& word : run.command)
            command += (command.empty() ? "" : " ") + word;
        Json row = {{"time", run.time},   {"host", run.host},   {"shard", run.shard},
                    {"command", command}, {"basis", run.basis}, {"ended", !run.stop.is_null()}};
        for (const char* key : {"seconds", "files_per_second", "bytes_per_second", "supervisor_seconds_per_file"})
            if (run.stop.is_object() && run.stop.contains(key))
                row[key] = run.stop[key];
        runs.push_back(row);
    }
    return runs;
}

/// Previews of packs, evenly over the files by name: {file, uri}. A pack that cannot be read has none, and says why.
Json thumbnails_json(const BatchSummary& summary, const std::filesystem::path& output, size_t count)
{
    std::vector<const FileSummary*> with_pack;
    for (const FileSummary& file : summary.files)
        if (has_pack(file.kind) && file.key.size() > 2)
            with_pack.push_back(&file);
    Json list = Json::array();
    const Result<Store> store = Store::open(output);
    const size_t shown = std::min(count, with_pack.size());
    for (size_t i = 0; store && i < shown; ++i) {
        const FileSummary& file = *with_pack[i * with_pack.size() / shown];
        const Result<LoadedPack> pack = read_pack(store->pack_path(file.key).string(), {});
        Json card = {{"file", file.file}, {"faces", file.faces}, {"bytes", file.pack_bytes}};
        if (!pack)
            card["missing"] = pack.error().detail;
        else if (pack->image.preview_256_png.empty())
            card["missing"] = "the pack has no preview";
        else
            card["uri"] = data_uri(pack->image.preview_256_png);
        list.push_back(card);
    }
    return list;
}

} // namespace

Json report_json(const BatchSummary& summary)
{
    std::map<FileClass, size_t> counts;
    std::vector<const FileSummary*> failed, made;
    std::vector<double> seconds, pack_bytes, peak_bytes;
    for (const FileSummary& file : summary.files) {
        ++counts[file.kind];
        if (file.kind != FileClass::Done)
            failed.push_back(&file);
        if (has_pack(file.kind))
            pack_bytes.push_back(static_cast<double>(file.pack_bytes));
        if (has_pack(file.kind) && !file.found) {
            made.push_back(&file);
            seconds.push_back(file.wall_seconds);
            peak_bytes.push_back(static_cast<double>(file.peak_memory_bytes));
        }
    }
    std::stable_sort(made.begin(), made.end(),
                     [](const FileSummary* a, const FileSummary* b) { return a->wall_seconds > b->wall_seconds; });
    Json classes = Json::object();
    for (const FileClass kind : kFileClasses)
        classes[class_name(kind)] = counts[kind];
    Json failures = Json::array(), slowest = Json::array();
    for (size_t i = 0; i < std::min(failed.size(), kMostFailures); ++i)
        failures.push_back(row_of(summary, *failed[i]));
    for (size_t i = 0; i < std::min(made.size(), kMostSlow); ++i)
        slowest.push_back(row_of(summary, *made[i]));
    Json begun = Json::array();
    size_t never_ended = 0;
    for (const FileSummary& start : summary.begun) {
        begun.push_back(start.file);
        never_ended += std::binary_search(summary.files.begin(), summary.files.end(), start,
                                          [](const auto& a, const auto& b) { return a.file < b.file; })
                           ? 0
                           : 1;
    }
    return {{"files", summary.files.size() + never_ended},
            {"classes", classes},
            {"begun", begun},
            {"groups", groups_json(summary)},
            {"conversion_seconds", distribution(seconds)},
            {"peak_memory_bytes", distribution(peak_bytes)},
            {"pack_bytes", distribution(pack_bytes)},
            {"phase_seconds", phases_json(summary)},
            {"slowest", slowest},
            {"failures", failures},
            {"failures_in_all", failed.size()},
            {"runs", runs_json(summary)},
            {"torn_lines", summary.torn_lines}};
}

std::string report_html(const BatchSummary& summary, const std::filesystem::path& output, size_t thumbnails)
{
    Json report = report_json(summary);
    report["output"] = output.string();
    report["made"] = time_text();
    // for the plots: every time and size, but no names
    Json seconds = Json::array(), sizes = Json::array();
    for (const FileSummary& file : summary.files)
        if (has_pack(file.kind)) {
            if (!file.found)
                seconds.push_back(file.wall_seconds);
            sizes.push_back(file.pack_bytes);
        }
    report["all_seconds"] = seconds;
    report["all_pack_bytes"] = sizes;
    report["thumbnails"] = thumbnails_json(summary, output, thumbnails);
    std::string page = page_of(kPage);
    fill_in("@REPORT@", report, page);
    return page;
}

} // namespace trimray
