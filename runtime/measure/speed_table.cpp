#include "runtime/measure/speed_table.h"

#include "runtime/measure/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace trimray {
namespace {

struct CountColumn {
    const char* name;
    SpeedCounts::Count SpeedCounts::*value;
};
constexpr CountColumn kCounts[] = {{"width", &SpeedCounts::width},
                                   {"height", &SpeedCounts::height},
                                   {"faces", &SpeedCounts::faces},
                                   {"patches", &SpeedCounts::patches},
                                   {"leaves", &SpeedCounts::leaves},
                                   {"geometry_bytes", &SpeedCounts::geometry_bytes},
                                   {"bvh_bytes", &SpeedCounts::bvh_bytes},
                                   {"trim_exact_bytes", &SpeedCounts::trim_exact_bytes},
                                   {"trim_sdf_bytes", &SpeedCounts::trim_sdf_bytes},
                                   {"file_bytes", &SpeedCounts::file_bytes},
                                   {"pcurve_deviation_nm", &SpeedCounts::pcurve_deviation_nm},
                                   {"rays", &SpeedCounts::rays},
                                   {"node_visits", &SpeedCounts::node_visits},
                                   {"leaf_visits", &SpeedCounts::leaf_visits},
                                   {"newton_steps", &SpeedCounts::newton_steps},
                                   {"curve_tests", &SpeedCounts::curve_tests},
                                   {"uncertified_pixels", &SpeedCounts::uncertified_pixels},
                                   {"missing", &SpeedCounts::missing},
                                   {"extra", &SpeedCounts::extra},
                                   {"wrong_depth", &SpeedCounts::wrong_depth}};

struct TimeColumn {
    const char* name;
    SpeedTimes::Time SpeedTimes::*value;
};
constexpr TimeColumn kTimes[] = {{"picture_ms", &SpeedTimes::picture_ms},
                                 {"picture_ms_spread", &SpeedTimes::picture_ms_spread},
                                 {"speed_to_one_ray", &SpeedTimes::speed_to_one_ray},
                                 {"speed_to_one_ray_spread", &SpeedTimes::speed_to_one_ray_spread},
                                 {"speed_to_mesh", &SpeedTimes::speed_to_mesh},
                                 {"speed_to_mesh_spread", &SpeedTimes::speed_to_mesh_spread}};

std::vector<std::string> column_names()
{
    std::vector<std::string> names{"model", "view"};
    for (const CountColumn& column : kCounts)
        names.emplace_back(column.name);
    names.emplace_back("device");
    for (const TimeColumn& column : kTimes)
        names.emplace_back(column.name);
    return names;
}

Error invalid(size_t line, std::string detail)
{
    return {ErrorCode::InvalidBaseline, fmt::format("line {}", line), std::move(detail)};
}

/// "" is none.
template <class T>
Status read_number(const std::string& text, const char* column, size_t line, std::optional<T>& value)
{
    if (text.empty())
        return Done{};
    T number{};
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (failed != std::errc{} || end != text.data() + text.size() || !(double(number) >= 0) ||
        !std::isfinite(double(number)))
        return invalid(line, fmt::format("{} must be a {} or nothing, and is '{}'", column,
                                         std::is_integral_v<T> ? "whole number" : "number", text));
    value = number;
    return Done{};
}

Result<SpeedLine> read_line(const CsvLine& csv)
{
    SpeedLine line;
    auto field = csv.fields.begin();
    line.model = *field++;
    line.view = *field++;
    for (const CountColumn& column : kCounts)
        if (const Status read = read_number(*field++, column.name, csv.number, line.counts.*column.value); !read.ok())
            return read.error();
    line.device = *field++;
    for (const TimeColumn& column : kTimes)
        if (const Status read = read_number(*field++, column.name, csv.number, line.times.*column.value); !read.ok())
            return read.error();
    if (line.times.speed_to_one_ray == 0 || line.times.speed_to_mesh == 0)
        return invalid(csv.number, "a speed must be above 0");
    return line;
}

void compare_counts(const SpeedLine& stored, const SpeedLine& now, SpeedComparison& comparison)
{
    for (const auto& [name, value] : kCounts) {
        const SpeedCounts::Count was = stored.counts.*value, is = now.counts.*value;
        if (was.has_value() != is.has_value()) {
            if (std::find(comparison.not_compared.begin(), comparison.not_compared.end(), name) ==
                comparison.not_compared.end())
                comparison.not_compared.emplace_back(name);
        } else if (was != is)
            comparison.changed.push_back({now.model, now.view, name, *was, *is});
    }
}

void compare_speed(const SpeedLine& stored, const SpeedLine& now, const char* baseline,
                   SpeedTimes::Time SpeedTimes::*speed, SpeedTimes::Time SpeedTimes::*spread,
                   SpeedComparison& comparison)
{
    const SpeedTimes::Time was = stored.times.*speed, is = now.times.*speed;
    if (!was || !is)
        return;
    ChangedSpeed changed{now.model, now.view, baseline, *was, *is, 0, SpeedVerdict::Open};
    if (stored.times.*spread && now.times.*spread) {
        changed.noise = *(stored.times.*spread) + *(now.times.*spread);
        const double change = std::log(*is / *was); // as far for half as for twice the speed
        changed.verdict = std::abs(change) <= changed.noise ? SpeedVerdict::Same
                          : change > 0                      ? SpeedVerdict::Faster
                                                            : SpeedVerdict::Slower;
    }
    comparison.speeds.push_back(std::move(changed));
}

void compare_times(const SpeedLine& stored, const SpeedLine& now, SpeedComparison& comparison)
{
    if (!stored.times.picture_ms || !now.times.picture_ms)
        return;
    if (stored.device != now.device) { // other lanes, and so other ratios
        comparison.other_device = stored.device;
        return;
    }
    compare_speed(stored, now, "one_ray", &SpeedTimes::speed_to_one_ray, &SpeedTimes::speed_to_one_ray_spread,
                  comparison);
    compare_speed(stored, now, "mesh", &SpeedTimes::speed_to_mesh, &SpeedTimes::speed_to_mesh_spread, comparison);
}

const SpeedLine* find(const SpeedTable& table, const SpeedLine& line)
{
    const auto found = std::find_if(table.begin(), table.end(), [&](const SpeedLine& other) {
        return other.model == line.model && other.view == line.view;
    });
    return found == table.end() ? nullptr : &*found;
}

const char* verdict_name(SpeedVerdict verdict)
{
    constexpr std::array<const char*, 4> kNames{"same", "faster", "slower", "open"};
    return kNames[static_cast<size_t>(verdict)];
}

Json to_json(const std::vector<std::pair<std::string, std::string>>& views)
{
    Json list = Json::array();
    for (const auto& [model, view] : views)
        list.push_back({{"model", model}, {"view", view}});
    return list;
}

} // namespace

Json to_json(const SpeedLine& line)
{
    Json object{{"view", line.view}};
    for (const auto& [name, value] : kCounts)
        object[name] = line.counts.*value ? Json(*(line.counts.*value)) : Json();
    for (const auto& [name, value] : kTimes)
        object[name] = line.times.*value ? Json(*(line.times.*value)) : Json();
    return object;
}

std::string speed_csv(const SpeedTable& table)
{
    std::string csv = fmt::format("{}\n", fmt::join(column_names(), ","));
    for (const SpeedLine& line : table) {
        csv += csv_quoted(line.model) + ',' + csv_quoted(line.view);
        for (const auto& [name, value] : kCounts)
            csv += line.counts.*value ? fmt::format(",{}", *(line.counts.*value)) : ",";
        csv += ',' + csv_quoted(line.device);
        for (const auto& [name, value] : kTimes)
            csv += line.times.*value ? fmt::format(",{:.4g}", *(line.times.*value)) : ",";
        csv += '\n';
    }
    return csv;
}

Result<SpeedTable> parse_speed_csv(std::string_view text)
{
    const Result<std::vector<CsvLine>> lines = parse_csv(text);
    if (!lines.ok())
        return lines.error();
    const std::vector<std::string> columns = column_names();
    if (lines->empty() || lines->front().fields != columns)
        return invalid(lines->empty() ? 1 : lines->front().number,
                       "these are not the columns that this version stores; write the file anew with "
                       "--write-baseline");
    SpeedTable table;
    for (size_t i = 1; i < lines->size(); ++i) {
        const CsvLine& csv = (*lines)[i];
        if (csv.fields.size() != columns.size())
            return invalid(csv.number, fmt::format("expected {} fields, found {}", columns.size(), csv.fields.size()));
        Result<SpeedLine> line = read_line(csv);
        if (!line.ok())
            return line.error();
        if (find(table, *line) != nullptr)
            return invalid(csv.number, fmt::format("{}, {} is there twice", line->model, line->view));
        table.push_back(std::move(*line));
    }
    return table;
}

std::optional<double> SpeedComparison::mean_change(const std::string& baseline) const
{
    double log_sum = 0;
    size_t count = 0;
    for (const ChangedSpeed& speed : speeds)
        if (speed.baseline == baseline) {
            log_sum += std::log(speed.now / speed.stored);
            ++count;
        }
    return count > 0 ? std::optional(std::exp(log_sum / double(count))) : std::nullopt;
}

SpeedComparison compare_speeds(const SpeedTable& stored, const SpeedTable& now)
{
    SpeedComparison comparison;
    for (const SpeedLine& line : now)
        if (const SpeedLine* other = find(stored, line)) {
            compare_counts(*other, line, comparison);
            compare_times(*other, line, comparison);
        } else
            comparison.not_stored.emplace_back(line.model, line.view);
    for (const SpeedLine& line : stored)
        if (find(now, line) == nullptr)
            comparison.not_run.emplace_back(line.model, line.view);
    return comparison;
}

Json to_json(const SpeedComparison& comparison)
{
    Json object{{"agrees", comparison.agrees()}, {"changed", Json::array()}};
    for (const ChangedCount& changed : comparison.changed)
        object["changed"].push_back({{"model", changed.model},
                                     {"view", changed.view},
                                     {"count", changed.count},
                                     {"stored", changed.stored},
                                     {"now", changed.now}});
    object["not_compared"] = comparison.not_compared;
    object["not_stored"] = to_json(comparison.not_stored);
    object["not_run"] = to_json(comparison.not_run);
    object["speeds"] = Json::array();
    for (const ChangedSpeed& speed : comparison.speeds)
        object["speeds"].push_back({{"model", speed.model},
                                    {"view", speed.view},
                                    {"baseline", speed.baseline},
                                    {"stored", speed.stored},
                                    {"now", speed.now},
                                    {"noise", speed.noise},
                                    {"verdict", verdict_name(speed.verdict)}});
    for (const char* baseline : {"one_ray", "mesh"}) {
        const std::optional<double> change = comparison.mean_change(baseline);
        object[fmt::format("speed_to_{}_now_to_stored", baseline)] = change ? Json(*change) : Json();
    }
    return object;
}

} // namespace trimray
