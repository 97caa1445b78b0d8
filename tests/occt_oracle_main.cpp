// occt_oracle: casts the rays of a picture with the CAD kernel and, given our EXR of the same view, says how far they
// agree. Prints one JSON object; disagreements come as a list with their causes.
#include "tests/occt_oracle.h"

#include <CLI/CLI.hpp>
#include <OpenImageIO/imageio.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <fstream>

namespace {

using namespace trimray::oracle;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Channel `name` of an EXR as floats, row 0 first. Empty where there is none.
std::vector<float> read_channel(const std::string& path, const std::string& name, uint32_t& width, uint32_t& height)
{
    auto input = OIIO::ImageInput::open(path);
    if (!input)
        return {};
    const OIIO::ImageSpec& spec = input->spec();
    const int channel = spec.channelindex(name);
    if (channel < 0)
        return {};
    width = uint32_t(spec.width);
    height = uint32_t(spec.height);
    std::vector<float> values(size_t(width) * height);
    if (!input->read_image(0, 0, channel, channel + 1, OIIO::TypeDesc::FLOAT, values.data()))
        return {};
    return values;
}

nlohmann::json to_json(const Agreement& agreement, uint32_t width, size_t listed)
{
    nlohmann::json causes, list = nlohmann::json::array();
    for (size_t c = 0; c < kCauseCount; ++c)
        causes[cause_name(Cause(c))] = agreement.by_cause[c];
    // the unexplained come first: they are what matters
    for (const bool unexplained : {true, false})
        for (const Disagreement& d : agreement.disagreements) {
            if ((d.cause == Cause::Unexplained) != unexplained || list.size() >= listed)
                continue;
            const auto depth = [](double mm) { return std::isfinite(mm) ? nlohmann::json(mm) : nlohmann::json(); };
            list.push_back({{"x", d.ray % width},
                            {"y", d.ray / width},
                            {"ours_mm", depth(d.ours_mm)},
                            {"oracle_mm", depth(d.oracle_mm)},
                            {"cause", cause_name(d.cause)},
                            {"why", d.why},
                            {"face", d.face},
                            {"surface", d.surface},
                            {"cos_incidence", d.cos_incidence},
                            {"edge_distance_mm", depth(d.edge_distance_mm)},
                            {"edge_tolerance_mm", depth(d.edge_tolerance_mm)}});
        }
    return {{"rays", agreement.rays},
            {"both_hit", agreement.both_hit},
            {"both_miss", agreement.both_miss},
            {"agree", agreement.agree},
            {"share", agreement.share()},
            {"causes", causes},
            {"worst_agreeing_error", agreement.worst_agreeing_error},
            {"disagreements", list}};
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app{"Rays against the CAD kernel"};
    std::string model, exr, depth_out;
    std::vector<double> eye, target, up{0, 0, 1};
    double fov = 35;
    uint32_t width = 160, height = 120;
    size_t listed = 50;
    bool no_boundary_tolerance = false;
    OracleOptions options;
    app.add_option("model", model, "STEP, IGES or BREP file")->required();
    app.add_option("--exr", exr, "our picture of the same view; its channel Z is compared");
    app.add_option("--eye", eye, "camera position, mm")->delimiter(',')->expected(3)->required();
    app.add_option("--target", target, "point looked at, mm")->delimiter(',')->expected(3)->required();
    app.add_option("--up", up, "up direction")->delimiter(',')->expected(3);
    app.add_option("--fov", fov, "vertical field of view, degrees");
    app.add_option("--width", width, "pixels, without --exr");
    app.add_option("--height", height, "pixels, without --exr");
    app.add_option("--depth-out", depth_out, "writes the oracle's depths as raw little-endian floats, row by row");
    app.add_option("--list", listed, "disagreements listed at most");
    app.add_option("--threads", options.threads, "0: all cores");
    app.add_flag("--no-boundary-tolerance", no_boundary_tolerance, "faces end at their curves, tolerances ignored");
    CLI11_PARSE(app, argc, argv);
    options.boundary_tolerance = !no_boundary_tolerance;

    const auto read_start = Clock::now();
    std::string error;
    const auto oracle = Oracle::load(model, options, error);
    if (!oracle) {
        fmt::print(stderr, "occt_oracle: {}: {}\n", model, error);
        return 3;
    }
    const double read_seconds = seconds_since(read_start);

    std::vector<float> ours;
    if (!exr.empty()) {
        ours = read_channel(exr, "Z", width, height);
        if (ours.empty()) {
            fmt::print(stderr, "occt_oracle: {}: no channel Z can be read\n", exr);
            return 2;
        }
    }
    const View view{{eye[0], eye[1], eye[2]}, {target[0], target[1], target[2]}, {up[0], up[1], up[2]}, fov};
    const std::vector<Ray> rays = view_rays(view, width, height);
    const auto cast_start = Clock::now();
    const std::vector<OracleHit> hits = oracle->cast(rays);
    const double cast_seconds = seconds_since(cast_start);

    if (!depth_out.empty()) {
        std::ofstream out(depth_out, std::ios::binary);
        for (const OracleHit& hit : hits) {
            const float depth = float(hit.distance_mm);
            out.write(reinterpret_cast<const char*>(&depth), sizeof depth);
        }
        if (!out.flush()) {
            fmt::print(stderr, "occt_oracle: {}: cannot be written\n", depth_out);
            return 2;
        }
    }
    nlohmann::json report{{"faces_unique", oracle->unique_faces()},
                          {"faces_placed", oracle->placed_faces()},
                          {"diagonal_mm", oracle->diagonal_mm()},
                          {"bounds_mm", {oracle->lo_mm(), oracle->hi_mm()}},
                          {"read_seconds", read_seconds},
                          {"cast_seconds", cast_seconds},
                          {"rays_per_second", double(rays.size()) / cast_seconds}};
    if (!ours.empty())
        report["agreement"] = to_json(oracle->compare(rays, ours, hits), width, listed);
    fmt::print("{}\n", report.dump(1));
    return 0;
}
