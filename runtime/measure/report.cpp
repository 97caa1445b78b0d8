#include "runtime/measure/report.h"

#include "format/page.h"
#include "runtime/measure/csv.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>
#include <span>
#include <string_view>
#include <thread>

namespace trimray {
namespace {

constexpr int kSchema = 2;

const char kPage[] =
#include "report.html.inc"
    ;

/// "model name" of /proc/cpuinfo.
std::string cpu_name()
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            if (const size_t colon = line.find(':'); colon != std::string::npos && colon + 2 <= line.size())
                return line.substr(colon + 2);
    return "unknown";
}

const char* compiler()
{
#ifdef __clang__
    return "clang " __clang_version__;
#else
    return "gcc " __VERSION__;
#endif
}

Json number(double value) // JSON has no infinity: an equal picture has null decibels
{
    return std::isfinite(value) ? Json(value) : Json();
}

double per_ray(uint64_t count, const WorkCounts& work)
{
    return work.rays > 0 ? double(count) / double(work.rays) : 0;
}

/// The numbers of a point by column: JSON and CSV have them from here.
std::vector<std::pair<const char*, double>> numbers(const AccuracyPoint& point, const AccuracyOptions& options,
                                                    bool smooth)
{
    const PictureErrors& e = point.errors;
    const double ms = median(point.picture_ms);
    const double pixels = double(options.width) * options.height;
    std::vector<std::pair<const char*, double>> all{{"picture_ms", ms},
                                                    {"picture_ms_spread", relative_spread(point.picture_ms)},
                                                    {"time_to_default", point.time_to_default},
                                                    {"rays_per_second", pixels / (ms * 1e-3)},
                                                    {"bytes", double(point.bytes)},
                                                    {"node_visits", per_ray(point.work.node_visits, point.work)},
                                                    {"leaf_visits", per_ray(point.work.leaf_visits, point.work)},
                                                    {"newton_steps", per_ray(point.work.newton_steps, point.work)},
                                                    {"curve_tests", per_ray(point.work.curve_tests, point.work)},
                                                    {"uncertified_pixels", double(point.work.uncertified_pixels)},
                                                    {"psnr_db", e.answers.psnr_db},
                                                    {"ssim", e.ssim}};
    if (smooth)
        return all;
    all.insert(all.end(), {{"wrong_per_million", e.wrong_per_million()},
                           {"missing", double(e.answers.missing)},
                           {"extra", double(e.answers.extra)},
                           {"wrong_depth", double(e.answers.wrong_depth)},
                           {"tangent", double(e.answers.tangent)},
                           {"ties", double(e.answers.ties.size())},
                           {"leaks", double(e.leaks)},
                           {"depth_mm_mean", e.depth_mm.mean},
                           {"depth_mm_largest", e.depth_mm.largest},
                           {"depth_px_mean", e.depth_px.mean},
                           {"depth_px_at_99", e.depth_px.at_99},
                           {"depth_px_largest", e.depth_px.largest},
                           {"normal_deg_mean", e.normal_deg.mean},
                           {"normal_deg_at_99", e.normal_deg.at_99},
                           {"normal_deg_largest", e.normal_deg.largest},
                           {"outline_px_mean", e.outline_px.mean},
                           {"outline_px_largest", e.outline_px.largest}});
    return all;
}

Json to_json(const Camera& camera)
{
    return {{"eye", camera.eye}, {"target", camera.target}, {"up", camera.up}, {"fov", camera.fov_deg}};
}

Json to_json(const ReportedContender& contender)
{
    Json object{{"dial", contender.dial},
                {"name", contender.name},
                {"paper", contender.paper.empty() ? Json() : Json(contender.paper)}};
    if (const auto& made = contender.preparation) {
        object["make_seconds"] = made->make_seconds;
        object["file_bytes"] = made->file_bytes;
        object["first_picture_ms"] = made->first_picture_ms > 0 ? Json(made->first_picture_ms) : Json();
        object["triangles"] = made->triangles ? Json(*made->triangles) : Json();
    }
    return object;
}

Json to_json(const ModelReport& model, const AccuracyOptions& options)
{
    Json object{{"model", model.name},
                {"faces", model.faces},
                {"instances", model.instances},
                {"pack_options", model.pack_options},
                {"notes", model.notes}};
    if (const auto& paper = model.paper)
        object["paper"] = {{"nurbs_surfaces", paper->nurbs_surfaces},
                           {"nurbs_curves", paper->nurbs_curves},
                           {"bezier_surfaces", paper->bezier_surfaces},
                           {"bezier_curves", paper->bezier_curves},
                           {"bytes", paper->bytes}};
    object["contenders"] = Json::array();
    for (const ReportedContender& contender : model.contenders)
        object["contenders"].push_back(to_json(contender));
    object["views"] = Json::array();
    for (const AccuracyView& view : model.views) {
        Json of_view{{"view", view.name}, {"camera", to_json(view.camera)}, {"points", Json::array()}};
        for (size_t i = 0; i < view.points.size(); ++i) {
            Json row;
            for (const auto& [name, value] : numbers(view.points[i], options, model.contenders[i].smooth))
                row[name] = number(value);
            of_view["points"].push_back(std::move(row));
        }
        object["views"].push_back(std::move(of_view));
    }
    return object;
}

/// Pictures by number: many contenders make the same.
class PictureList {
public:
    size_t number_of(std::span<const std::byte> png)
    {
        std::string uri = data_uri(png);
        const auto [found, is_new] = numbers_.try_emplace(uri, uris_.size());
        if (is_new)
            uris_.push_back(std::move(uri));
        return found->second;
    }
    const Json& uris() const { return uris_; }

private:
    std::map<std::string, size_t> numbers_;
    Json uris_ = Json::array();
};

/// Each contender's pictures from the view where it is worst, as numbers in `uris`; null: its pictures are equal to the
/// reference's, or it is a smooth one.
Json pictures_json(const AccuracyReport& report)
{
    Json object{{"steps", Json::array()}, {"wrong", kWrongAnswer}, {"models", Json::array()}};
    PictureList list;
    for (const ErrorStep& step : error_steps())
        object["steps"].push_back({{"depth_px", step.depth_px}, {"srgb", step.srgb}});
    for (const ModelReport& model : report.models) {
        Json of_model = Json::array();
        for (size_t i = 0; i < model.contenders.size(); ++i) {
            const AccuracyView* worst = nullptr;
            for (const AccuracyView& view : model.views)
                if (!worst || view.points[i].pictures.place.difference > worst->points[i].pictures.place.difference)
                    worst = &view;
            const ErrorPictures& pictures = worst->points[i].pictures;
            if (pictures.place.difference == 0) {
                of_model.push_back(Json());
                continue;
            }
            of_model.push_back({{"view", worst->name},
                                {"x", pictures.place.x},
                                {"y", pictures.place.y},
                                {"width", pictures.place.width},
                                {"height", pictures.place.height},
                                {"seen", list.number_of(pictures.seen)},
                                {"right", list.number_of(pictures.right)},
                                {"map", list.number_of(pictures.map)}});
        }
        object["models"].push_back(std::move(of_model));
    }
    object["uris"] = list.uris();
    return object;
}

} // namespace

double times_spread(const AccuracyReport& report)
{
    std::vector<double> spreads;
    for (const ModelReport& model : report.models)
        for (const AccuracyView& view : model.views)
            for (const AccuracyPoint& point : view.points)
                if (point.picture_ms.size() >= 3)
                    spreads.push_back(relative_spread(point.picture_ms));
    return spreads.empty() ? 0 : median(std::move(spreads));
}

Json report_json(const AccuracyReport& report)
{
    const AccuracyOptions& options = report.options;
    const double spread = times_spread(report);
    Json object{{"schema", kSchema},
                {"program", "trimray " TRIMRAY_VERSION},
                {"compiler", compiler()},
                {"command", report.command},
                {"date", report.date},
                {"machine", {{"cpu", cpu_name()}, {"threads", std::thread::hardware_concurrency()}}},
                {"device", report.device},
                {"width", options.width},
                {"height", options.height},
                {"threads", options.threads},
                {"rounds", options.rounds},
                {"times_spread", spread},
                {"busy", spread > kBusySpread},
                {"models", Json::array()}};
    for (const ModelReport& model : report.models)
        object["models"].push_back(to_json(model, options));
    return object;
}

std::string report_html(const AccuracyReport& report)
{
    std::string page = page_of(kPage);
    fill_in("@REPORT@", report_json(report), page);
    fill_in("@PICTURES@", pictures_json(report), page);
    return page;
}

std::string report_csv(const AccuracyReport& report)
{
    std::string csv = "model,view,dial,contender";
    AccuracyPoint any;
    any.picture_ms = {1};
    const auto columns = numbers(any, report.options, false);
    for (const auto& [name, value] : columns)
        csv += fmt::format(",{}", name);
    csv += '\n';
    for (const ModelReport& model : report.models)
        for (const AccuracyView& view : model.views)
            for (size_t i = 0; i < view.points.size(); ++i) {
                csv += fmt::format("{},{},{},{}", csv_quoted(model.name), csv_quoted(view.name),
                                   csv_quoted(model.contenders[i].dial), csv_quoted(model.contenders[i].name));
                const auto row = numbers(view.points[i], report.options, model.contenders[i].smooth);
                for (const auto& [name, value] : row)
                    csv += std::isfinite(value) ? fmt::format(",{}", value) : ",";
                csv += std::string(columns.size() - row.size(), ',') + '\n';
            }
    return csv;
}

} // namespace trimray
