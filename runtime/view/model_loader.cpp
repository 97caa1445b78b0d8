#include "runtime/view/model_loader.h"

#include "runtime/command_converter.h"
#include "runtime/pack_names.h"
#include "runtime/view/pack_cache.h"
#include "runtime/watched_load.h"

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
    if (thread_.joinable())
        thread_.join();
}

void ModelLoader::start(const std::string& file)
{
    cancel();
    auto job = std::make_shared<Job>();
    job->file = file;
    {
        const std::lock_guard lock(mutex_);
        job_ = job;
        progress_ = {"opening", -1};
    }
    busy_ = true;
    // one after the other, so that a file that was given up takes nothing from the next
    thread_ = std::thread([this, job, before = std::move(thread_)]() mutable {
        if (before.joinable())
            before.join();
        run(job);
    });
}

void ModelLoader::cancel()
{
    const std::lock_guard lock(mutex_);
    if (job_)
        job_->cancelled = true;
    done_.reset();
    early_.reset();
    busy_ = false;
}

void ModelLoader::run(const std::shared_ptr<Job>& job)
{
    std::thread early;
    Result<LoadedModel> loaded = load(job, early);
    {
        const std::lock_guard lock(mutex_);
        if (!job->cancelled) {
            if (!loaded.ok()) {
                job->cancelled = true; // no first picture of what will not be seen
                early_.reset();
            }
            done_ = std::move(loaded);
        }
    }
    wake_();
    if (early.joinable())
        early.join();
}

void ModelLoader::publish_early(const Job& job, PackImage outline)
{
    if (job.cancelled)
        return;
    Result<ProxyMesh> mesh = decode_proxy(std::exchange(outline.proxy_draco, {}), outline.faces.size());
    if (!mesh.ok() || mesh->triangles.empty())
        return; // no first picture: tracing does without it
    auto early = std::make_shared<EarlyModel>(EarlyModel{job.file, std::move(outline), std::move(*mesh)});
    {
        const std::lock_guard lock(mutex_);
        if (job.cancelled)
            return;
        early_ = std::move(early);
    }
    wake_();
}

std::shared_ptr<const EarlyModel> ModelLoader::take_early()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(early_, nullptr);
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

void ModelLoader::say(const Job& job, const std::string& doing, double share)
{
    {
        const std::lock_guard lock(mutex_);
        if (job.cancelled)
            return;
        progress_ = {doing, share};
    }
    wake_();
}

Result<std::string> ModelLoader::pack_of(const Job& job, LoadedModel& model)
{
    const std::string& file = job.file;
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
        [this, &job](const std::string& phase, double share) { say(job, "converting: " + phase_text(phase), share); },
        [&job] { return job.cancelled.load(); }};
    const Result<Json> report = run_converter(file, *pack, {}, watch);
    if (!report.ok()) {
        if (job.cancelled)
            fs::remove(*pack, failed); // it was there just before it was given up
        return report.error();
    }
    model.convert_seconds = seconds_since(start);
    for (std::string& loss : losses(*report))
        model.notes.push_back(std::move(loss));
    trim_pack_cache(fs::path(*pack).parent_path(), kPackCacheBytes, *pack);
    return *pack;
}

Result<LoadedModel> ModelLoader::load(const std::shared_ptr<Job>& job, std::thread& early)
{
    LoadedModel model;
    model.file = job->file;
    const Result<std::string> pack = pack_of(*job, model);
    if (!pack.ok())
        return pack.error();
    model.pack = *pack;
    const auto start = Clock::now();
    say(*job, "reading the pack", -1);
    // Draco takes about as long as all the rest: beside it
    const LoadWatch watch{[job] { return job->cancelled.load(); },
                          [&](PackImage outline) {
                              early = std::thread([this, job, outline = std::move(outline)]() mutable {
                                  publish_early(*job, std::move(outline));
                              });
                          }};
    Result<std::shared_ptr<const Scene>> scene = load_scene(*pack, watch);
    if (!scene.ok())
        return scene.error();
    if (job->cancelled)
        return given_up();
    model.scene = std::move(*scene);
    const PackImage& image = model.scene->pack.image;
    if (model.convert_seconds == 0 && !image.dropped.empty()) { // else the conversion's report has told it
        const DroppedFace& first = image.dropped.front();
        model.notes.push_back(
            missing_faces(image.dropped.size(), first.part, first.face_in_part, string_at(image, first.reason)));
    }
    say(*job, "getting ready to trace", -1);
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
