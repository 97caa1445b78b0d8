#include "runtime/view/model_loader.h"

#include "runtime/command_converter.h"
#include "runtime/view/pack_cache.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A phase of trimray-pack in words for people.
std::string phase_text(const std::string& phase)
{
    static const std::pair<const char*, const char*> kWords[] = {
        {"read", "reading"},          {"transfer", "translating"}, {"faces", "taking over faces"},
        {"mesh", "making triangles"}, {"convert", "converting"},   {"previews", "making previews"},
        {"write", "writing"},
    };
    for (const auto& [word, text] : kWords)
        if (phase == word)
            return text;
    return phase;
}

} // namespace

ModelLoader::ModelLoader(TracerMaker make, std::function<void()> wake) : make_(std::move(make)), wake_(std::move(wake))
{
}

ModelLoader::~ModelLoader()
{
    cancel();
}

void ModelLoader::start(const std::string& file)
{
    cancel();
    cancelled_ = false;
    busy_ = true;
    say("opening", -1);
    thread_ = std::thread([this, file] {
        Result<LoadedModel> loaded = load(file);
        {
            const std::lock_guard lock(mutex_);
            if (!cancelled_)
                done_ = std::move(loaded);
        }
        wake_();
    });
}

void ModelLoader::cancel()
{
    cancelled_ = true;
    if (thread_.joinable())
        thread_.join();
    const std::lock_guard lock(mutex_);
    done_.reset();
    busy_ = false;
}

LoadProgress ModelLoader::progress() const
{
    const std::lock_guard lock(mutex_);
    return progress_;
}

std::optional<Result<LoadedModel>> ModelLoader::take()
{
    const std::lock_guard lock(mutex_);
    if (done_)
        busy_ = false;
    return std::exchange(done_, std::nullopt);
}

void ModelLoader::say(const std::string& doing, double share)
{
    {
        const std::lock_guard lock(mutex_);
        progress_ = {doing, share};
    }
    wake_();
}

Result<std::string> ModelLoader::pack_of(const std::string& file, LoadedModel& model)
{
    if (!is_cad_file(file))
        return file;
    const Result<std::string> pack = cached_pack_name(file);
    if (!pack.ok())
        return pack.error();
    std::error_code failed;
    if (fs::exists(*pack, failed)) {
        fs::last_write_time(*pack, fs::file_time_type::clock::now(), failed); // read last: it stays longest
        return *pack;
    }
    const auto start = Clock::now();
    const ConverterWatch watch{
        [this](const std::string& phase, double share) { say("converting: " + phase_text(phase), share); },
        [this] { return cancelled_.load(); }};
    const Result<Json> report = run_converter(file, *pack, {}, watch);
    if (!report.ok()) {
        if (cancelled_)
            fs::remove(*pack, failed); // it was there just before it was given up
        return report.error();
    }
    model.convert_seconds = seconds_since(start);
    for (std::string& loss : losses(*report))
        model.notes.push_back(std::move(loss));
    trim_pack_cache(fs::path(*pack).parent_path(), kPackCacheBytes, *pack);
    return *pack;
}

Result<LoadedModel> ModelLoader::load(const std::string& file)
{
    LoadedModel model;
    model.file = file;
    const Result<std::string> pack = pack_of(file, model);
    if (!pack.ok())
        return pack.error();
    model.pack = *pack;
    const auto start = Clock::now();
    say("reading the pack", -1);
    Result<std::shared_ptr<const Scene>> scene = load_scene(*pack);
    if (!scene.ok())
        return scene.error();
    model.scene = std::move(*scene);
    say("getting ready to trace", -1);
    std::string note;
    Result<std::unique_ptr<Tracer>> tracer = make_(model.scene, note);
    if (!tracer.ok())
        return tracer.error();
    model.tracer = std::move(*tracer);
    if (!note.empty())
        model.notes.push_back(note);
    model.load_seconds = seconds_since(start);
    return model;
}

} // namespace trimray
