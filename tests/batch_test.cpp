// Batches with planted workers: what hangs, crashes or eats the machine costs one file, and nothing is lost or done
// twice, whoever is killed.
#include "preprocess/batch/convert_file.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/resume.h"
#include "preprocess/batch/store.h"
#include "preprocess/batch/supervisor.h"
#include "preprocess/worker/process_tree.h"

#include "format/pack_reader.h"
#include "format/pack_writer.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {

using namespace trimray;
namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

constexpr const char* kGoldenPack = TRIMRAY_TESTS_DIR "/golden/synthetic.tray";
constexpr auto kForever = std::chrono::hours(1);

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

class Quiet : public BatchWatcher {
public:
    void ended(const FileEnd& end) override { seconds[end.file.name] += end.seconds; }
    void working(const std::vector<FileAtWork>&, size_t) override {}
    std::map<std::string, double> seconds;
};

/// A folder with model files, whose content says what their worker does, and a folder to convert into.
class batch : public testing::Test {
protected:
    batch()
    {
        std::string name = (fs::temp_directory_path() / "trimray-batch-test-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
        models_ = folder_ / "models";
        fs::create_directories(models_);
    }
    ~batch() override { fs::remove_all(folder_); }

    void add(const std::string& name, const std::string& content) const
    {
        fs::create_directories((models_ / name).parent_path());
        std::ofstream(models_ / name, std::ios::binary) << content;
    }

    std::vector<BatchFile> files(const InputOptions& more = {}) const
    {
        InputOptions options = more;
        if (options.inputs.empty())
            options.inputs = {models_.string()};
        const Result<InputList> list = list_inputs(options);
        EXPECT_TRUE(list.ok()) << list.error().detail;
        return list.ok() ? list->files : std::vector<BatchFile>();
    }

    /// Its name without the folder of the test.
    std::string short_name(const std::string& name) const
    {
        const std::string prefix = models_.relative_path().string() + "/";
        return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
    }

    fs::path out(const std::string& name = "out") const { return folder_ / name; }

    /// Appends a line for every pack that is made, whoever makes it.
    void note_made(const std::string& model) const
    {
        const int fd = ::open((folder_ / "made").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
        const std::string line = model + "\n";
        EXPECT_EQ(::write(fd, line.data(), line.size()), static_cast<ssize_t>(line.size()));
        ::close(fd);
    }

    std::vector<std::string> made() const
    {
        std::vector<std::string> lines;
        std::ifstream file(folder_ / "made");
        for (std::string line; std::getline(file, line);)
            lines.push_back(line);
        return lines;
    }

    /// Does what the model's first word says.
    PackMaker planted() const
    {
        return [this](const SourceFile& source, const std::string& model, const std::string& output, bool other_healing,
                      const WorkerProgress& progress) -> Result<nlohmann::ordered_json> {
            std::ifstream file(source.path);
            std::string what;
            file >> what;
            progress("convert", -1);
            if (what == "invalid")
                return Error{ErrorCode::InvalidCad, model, "is no model"};
            if (what == "unsupported")
                return Error{ErrorCode::UnsupportedFormat, model, "is not supported"};
            if (what == "io")
                return Error{ErrorCode::FileNotWritable, output, "no room"};
            if (what == "crash" || (what == "heals" && !other_healing)) {
                std::signal(SIGSEGV, SIG_DFL); // sanitizers have their own handlers
                raise(SIGSEGV);
            }
            if (what == "throws")
                throw std::runtime_error("lost");
            if (what == "hang")
                std::this_thread::sleep_for(kForever);
            if (what == "deaf") {
                for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGXCPU})
                    std::signal(signal, SIG_IGN);
                for (;;) { // busy as well
                }
            }
            if (what == "forks" || what == "escapes") { // escapes: out of its group, and away from its parent
                if (fork() == 0) {
                    if (what == "escapes") {
                        setsid();
                        if (fork() != 0)
                            _exit(0);
                    }
                    std::this_thread::sleep_for(kForever);
                }
                std::this_thread::sleep_for(kForever);
            }
            if (what == "eats") {
                std::vector<std::vector<char>> hoard;
                for (;;) {
                    hoard.emplace_back(4u << 20, 'x');
                    std::this_thread::sleep_for(std::chrono::milliseconds(1));
                }
            }
            if (what == "children_eat") {
                for (int i = 0; i < 4; ++i)
                    if (fork() == 0) {
                        const std::vector<char> share(100u << 20, 'x');
                        std::this_thread::sleep_for(kForever);
                    }
                std::this_thread::sleep_for(kForever);
            }
            if (what == "fills") {
                const std::vector<char> block(1u << 20, 'x');
                for (int i = 0;; ++i) { // many files, each below the limit
                    std::ofstream(fs::path(output).parent_path() / std::to_string(i)).write(block.data(), 1 << 20);
                    std::this_thread::sleep_for(std::chrono::milliseconds(1));
                }
            }
            if (what == "slow")
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
            LoadedPack pack = read_pack(kGoldenPack, {}).value();
            nlohmann::ordered_json dropped = nlohmann::ordered_json::array();
            if (what != "loses")
                pack.image.dropped.clear();
            else
                dropped.push_back({{"face", 3}, {"part", 0}, {"reason", "no area"}});
            if (const Status written = write_file_atomically(output, encode_pack(pack.image, {})); !written)
                return written.error();
            note_made(model);
            return nlohmann::ordered_json{
                {"bytes", fs::file_size(output)},  {"faces", 5},
                {"converted", 5 - dropped.size()}, {"dropped", dropped},
                {"seconds", {{"convert", 0.1}}},   {"warnings", nlohmann::ordered_json::array()}};
        };
    }

    BatchResult run(const std::vector<BatchFile>& files, int jobs = 2, const fs::path& out_folder = {},
                    const WorkerLimits& limits = {})
    {
        const fs::path folder = out_folder.empty() ? out() : out_folder;
        const Result<Store> store = Store::open(folder);
        EXPECT_TRUE(store.ok());
        const Result<LedgerWriter> ledger = LedgerWriter::open(*store, "0-of-1");
        EXPECT_TRUE(ledger.ok());
        BatchOptions options;
        options.jobs = jobs;
        options.limits = limits;
        options.basis = "{}";
        options.run = "test";
        EXPECT_TRUE(ledger->append("run", {{"run", options.run}, {"basis", options.basis}}).ok());
        const Result<BatchResult> result = run_batch(files, *store, *ledger, planted(), options, watcher_, wish_);
        EXPECT_TRUE(result.ok()) << result.error().detail;
        return result.ok() ? *result : BatchResult{};
    }

    std::map<std::string, std::string> classes(const fs::path& out_folder = {}) const
    {
        const auto states = read_states((out_folder.empty() ? out() : out_folder) / "ledger");
        EXPECT_TRUE(states.ok());
        std::map<std::string, std::string> names;
        for (const auto& [name, state] : *states)
            names[short_name(name)] = state.ended ? class_name(state.kind) : "begun";
        return names;
    }

    /// Events of one kind of one file.
    std::vector<Json> events(const std::string& kind, const std::string& file, const fs::path& out_folder = {}) const
    {
        std::vector<Json> found;
        const auto read = read_ledger((out_folder.empty() ? out() : out_folder) / "ledger", [&](const Json& event) {
            if (event["event"] == kind && short_name(event.value("file", "")) == file)
                found.push_back(event);
        });
        EXPECT_TRUE(read.ok());
        return found;
    }

    fs::path folder_, models_;
    Quiet watcher_;
    volatile std::sig_atomic_t wish_ = 0;
};

bool no_children()
{
    return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
}

TEST_F(batch, every_file_ends_in_exactly_one_class)
{
    const std::map<std::string, std::string> expected = {
        {"a.step", "done"},       {"b.step", "incomplete"}, {"c.step", "invalid"},
        {"d.stp", "unsupported"}, {"e.igs", "io"},          {"f.step", "crash"},
        {"sub/g.step", "crash"},  {"h.step.gz", "invalid"}, {"i.step", "done"}};
    add("a.step", "fine");
    add("b.step", "loses");
    add("c.step", "invalid");
    add("d.stp", "unsupported");
    add("e.igs", "io");
    add("f.step", "crash");
    add("sub/g.step", "throws");
    add("h.step.gz", "\x1f\x8b\x08 no gzip");
    add("i.step", "heals");
    add("notes.txt", "no model");
    const BatchResult result = run(files());
    EXPECT_EQ(classes(), expected);
    EXPECT_THAT(result.counts, UnorderedElementsAre(Pair(FileClass::Done, 2), Pair(FileClass::Incomplete, 1),
                                                    Pair(FileClass::Invalid, 2), Pair(FileClass::Unsupported, 1),
                                                    Pair(FileClass::Io, 1), Pair(FileClass::Crash, 2)));
    EXPECT_EQ(result.left, 0u);
    for (const auto& [name, kind] : expected) {
        const std::vector<Json> ends = events("end", name);
        const bool retried = kind == "crash" || name == "i.step";
        ASSERT_EQ(ends.size(), retried ? 2u : 1u) << name;
        EXPECT_TRUE(ends.back()["final"].get<bool>());
        EXPECT_EQ(events("start", name).size(), ends.size());
        EXPECT_EQ(ends.back().contains("error"), kind != "done" && kind != "incomplete") << name;
    }
    EXPECT_EQ(events("end", "f.step")[0]["error"]["signal"], "SIGSEGV");
    EXPECT_EQ(events("end", "f.step")[0]["error"]["phase"], "convert");
    EXPECT_TRUE(no_children());
    EXPECT_TRUE(fs::is_empty(out() / "tmp"));
    EXPECT_TRUE(fs::is_empty(out() / "claims"));
}

TEST_F(batch, a_pack_is_found_under_its_files_name_and_is_whole)
{
    add("deep/er/a.step", "fine");
    run(files());
    const fs::path link = out() / "packs" / (models_.relative_path() / "deep/er/a.step.tray");
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_TRUE(read_pack(link.string(), {}).ok());
    const Json end = events("end", "deep/er/a.step").at(0);
    EXPECT_TRUE(fs::equivalent(link, Store::open(out())->pack_path(end["key"])));
    EXPECT_EQ(end["pack_bytes"], fs::file_size(link));
}

TEST_F(batch, what_does_not_end_is_ended_with_all_it_started_and_others_are_unharmed)
{
    constexpr double kSeconds = 1.0, kSlack = 1.0;
    const std::map<std::string, std::string> expected = {
        {"hang.step", "timeout"}, {"deaf.step", "timeout"}, {"forks.step", "timeout"}, {"escapes.step", "timeout"},
        {"fills.step", "io"},     {"a.step", "done"},       {"b.step", "done"}};
    for (const char* what : {"hang", "deaf", "forks", "escapes", "fills"})
        add(std::string(what) + ".step", what);
    add("a.step", "slow");
    add("b.step", "slow b");
    WorkerLimits limits;
    limits.wall_seconds = kSeconds;
    limits.written_bytes = 20u << 20;
    run(files(), 7, {}, limits);
    EXPECT_EQ(classes(), expected);
    for (const auto& [name, kind] : expected)
        for (const Json& end : events("end", name))
            EXPECT_LT(end["seconds"]["wall"].get<double>(), kSeconds + kSlack) << name;
    EXPECT_TRUE(no_children());
}

TEST_F(batch, memory_is_limited_for_a_worker_and_its_children_together)
{
    if (kSanitized)
        GTEST_SKIP() << "shadow memory is above any limit, so workers have none";
    add("eats.step", "eats");
    add("children.step", "children_eat");
    add("a.step", "fine");
    WorkerLimits limits;
    limits.memory_bytes = 200u << 20;
    limits.wall_seconds = 20;
    run(files(), 3, {}, limits);
    EXPECT_THAT(classes(), UnorderedElementsAre(Pair("eats.step", "memory"), Pair("children.step", "memory"),
                                                Pair("a.step", "done")));
    EXPECT_TRUE(no_children());
}

TEST_F(batch, a_pack_that_is_there_is_not_made_again)
{
    add("a.step", "fine 1");
    add("b.step", "fine 2");
    add("same_as_a.step", "fine 1");
    EXPECT_EQ(run(files()).found, 1u);
    EXPECT_EQ(made().size(), 2u);
    EXPECT_EQ(run(files()).found, 3u);
    EXPECT_EQ(made().size(), 2u);
    add("b.step", "fine 3");
    EXPECT_EQ(run(files()).found, 2u);
    EXPECT_EQ(made().size(), 3u);
    const fs::path pack = Store::open(out())->pack_path(events("end", "a.step").back()["key"]);
    fs::resize_file(pack, fs::file_size(pack) - 1);
    EXPECT_EQ(run(files()).found, 2u); // a damaged one is made again, once for both names
    EXPECT_EQ(made().size(), 4u);
    EXPECT_TRUE(read_pack(pack.string(), {}).ok());
}

TEST_F(batch, the_key_depends_on_content_and_basis_alone)
{
    const std::string key = pack_key("xxh3-128:0", "{}");
    EXPECT_EQ(key.size(), 32u);
    EXPECT_EQ(key, pack_key("xxh3-128:0", "{}"));
    EXPECT_NE(key, pack_key("xxh3-128:1", "{}"));
    EXPECT_NE(key, pack_key("xxh3-128:0", "{1}"));
}

TEST_F(batch, going_on_skips_what_is_settled_and_unchanged)
{
    add("a.step", "fine 1");
    add("b.step", "invalid");
    add("c.step", "crash");
    run(files());
    const Store store = *Store::open(out());
    const auto left = [&](const std::string& basis, const std::set<FileClass>& retry) {
        std::vector<std::string> names;
        for (const BatchFile& file : unsettled(files(), store, basis, retry, *read_states(store.ledger_folder())))
            names.push_back(short_name(file.name));
        std::sort(names.begin(), names.end());
        return names;
    };
    EXPECT_THAT(left("{}", {}), IsEmpty());
    EXPECT_THAT(left("{other options}", {}), ElementsAre("a.step", "b.step", "c.step"));
    EXPECT_THAT(left("{}", {FileClass::Crash}), ElementsAre("c.step"));
    add("b.step", "fine now");
    EXPECT_THAT(left("{}", {}), ElementsAre("b.step"));
    fs::remove(store.pack_path(events("end", "a.step")[0]["key"]));
    EXPECT_THAT(left("{}", {}), ElementsAre("a.step", "b.step"));
}

TEST_F(batch, a_supervisor_killed_at_any_moment_loses_and_repeats_nothing)
{
    constexpr int kFiles = 12, kKills = 20;
    for (int i = 0; i < kFiles; ++i)
        add(std::to_string(i) + ".step", "slow " + std::to_string(i));
    run(files(), 3, out("undisturbed"));
    fs::remove(folder_ / "made");

    const auto resume = [&] {
        const Store store = *Store::open(out());
        return run(unsettled(files(), store, "{}", {}, *read_states(store.ledger_folder())), 3);
    };
    std::mt19937 random(5);
    for (int i = 0; i < kKills; ++i) {
        const pid_t supervisor = fork();
        if (supervisor == 0) {
            resume();
            _exit(0);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
        kill(supervisor, SIGKILL);
        waitpid(supervisor, nullptr, 0);
    }
    EXPECT_EQ(resume().left, 0u);
    EXPECT_EQ(classes(), classes(out("undisturbed")));
    std::set<std::string> keys;
    for (int i = 0; i < kFiles; ++i) {
        int ends = 0;
        for (const Json& end : events("end", std::to_string(i) + ".step")) {
            ends += end["final"].get<bool>() ? 1 : 0;
            keys.insert(end["key"].get<std::string>());
        }
        EXPECT_EQ(ends, 1) << i;
    }
    EXPECT_EQ(keys.size(), static_cast<size_t>(kFiles));
    for (const std::string& key : keys) {
        const Store store = *Store::open(out()), other = *Store::open(out("undisturbed"));
        std::ifstream a(store.pack_path(key), std::ios::binary), b(other.pack_path(key), std::ios::binary);
        ASSERT_TRUE(a && b) << key;
        EXPECT_TRUE(std::equal(std::istreambuf_iterator<char>(a), {}, std::istreambuf_iterator<char>(b), {}));
    }
    EXPECT_TRUE(fs::is_empty(out() / "tmp")); // of the dead as well
    EXPECT_TRUE(fs::is_empty(out() / "claims"));
}

TEST_F(batch, processes_that_share_a_folder_make_each_pack_once_and_readers_see_only_whole_ones)
{
    constexpr int kFiles = 20;
    const int processes = kSanitized ? 8 : 32;
    for (int i = 0; i < kFiles; ++i)
        add(std::to_string(i) + ".step", "slow " + std::to_string(i));
    const std::vector<BatchFile> all = files();
    std::vector<pid_t> running;
    for (int i = 0; i < processes; ++i)
        if (const pid_t child = fork(); child > 0)
            running.push_back(child);
        else {
            const BatchResult result = run(all, 1);
            _exit(result.left == 0 && result.counts.count(FileClass::Done) && !HasFailure() ? 0 : 1);
        }
    size_t seen = 0;
    while (!running.empty()) {
        std::error_code not_there_yet;
        for (const auto& entry : fs::recursive_directory_iterator(out() / "store", not_there_yet))
            if (entry.path().extension() == ".tray") {
                ++seen;
                EXPECT_TRUE(read_pack(entry.path().string(), {}).ok()) << entry.path();
            }
        std::erase_if(running, [](pid_t child) {
            int status = 0;
            if (waitpid(child, &status, WNOHANG) != child)
                return false;
            EXPECT_EQ(status, 0);
            return true;
        });
    }
    EXPECT_GT(seen, 0u);
    EXPECT_EQ(made().size(), static_cast<size_t>(kFiles));
    for (int i = 0; i < kFiles; ++i)
        EXPECT_EQ(events("end", std::to_string(i) + ".step").size(), static_cast<size_t>(processes));
}

TEST_F(batch, a_wish_to_stop_keeps_what_is_finished_and_starts_nothing_more)
{
    for (int i = 0; i < 6; ++i)
        add(std::to_string(i) + ".step", "slow " + std::to_string(i));
    class Stopper : public BatchWatcher {
    public:
        explicit Stopper(volatile std::sig_atomic_t& wish) : wish_(wish) {}
        void ended(const FileEnd&) override { wish_ = static_cast<int>(StopWish::AfterRunning); }
        void working(const std::vector<FileAtWork>&, size_t) override {}

    private:
        volatile std::sig_atomic_t& wish_;
    };
    const Store store = *Store::open(out());
    const LedgerWriter ledger = LedgerWriter::open(store, "0-of-1").value();
    Stopper stopper(wish_);
    BatchOptions options;
    options.jobs = 2;
    const Result<BatchResult> result = run_batch(files(), store, ledger, planted(), options, stopper, wish_);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->stopped);
    EXPECT_EQ(result->counts.at(FileClass::Done) + result->left, 6u);
    EXPECT_EQ(result->counts.at(FileClass::Done), made().size());
    EXPECT_LE(made().size(), 3u);

    wish_ = static_cast<int>(StopWish::AtOnce);
    EXPECT_EQ(run(files()).left, 6u);
    EXPECT_TRUE(no_children());
}

TEST_F(batch, a_ledger_line_cut_short_is_passed_by_and_nothing_is_added_to_it)
{
    const Store store = *Store::open(out());
    {
        const LedgerWriter ledger = LedgerWriter::open(store, "0-of-1").value();
        ASSERT_TRUE(ledger.append("end", {{"file", "a"}, {"final", true}, {"class", "invalid"}}).ok());
    }
    const fs::path path = store.ledger_folder() / "0-of-1.jsonl";
    std::ofstream(path, std::ios::app) << R"({"event":"end","file":"b)";
    {
        const LedgerWriter ledger = LedgerWriter::open(store, "0-of-1").value();
        ASSERT_TRUE(ledger.append("end", {{"file", "c"}, {"final", true}, {"class", "done"}}).ok());
        EXPECT_EQ(LedgerWriter::open(store, "0-of-1")->path(), store.ledger_folder() / "0-of-1-2.jsonl");
    }
    std::vector<std::string> seen;
    const auto torn = read_ledger(store.ledger_folder(), [&](const Json& event) { seen.push_back(event["file"]); });
    EXPECT_EQ(*torn, 1u);
    EXPECT_THAT(seen, ElementsAre("a", "c"));
}

TEST_F(batch, a_full_disk_under_the_ledger_ends_the_batch_with_a_clear_error)
{
    if (::access("/dev/full", W_OK) != 0)
        GTEST_SKIP() << "no /dev/full";
    add("a.step", "fine");
    const Store store = *Store::open(out());
    fs::create_symlink("/dev/full", store.ledger_folder() / "0-of-1.jsonl");
    const LedgerWriter ledger = LedgerWriter::open(store, "0-of-1").value();
    const auto result = run_batch(files(), store, ledger, planted(), {}, watcher_, wish_);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::FileNotWritable);
    EXPECT_THAT(result.error().detail, HasSubstr("--resume"));
}

TEST_F(batch, inputs_are_folders_files_and_patterns_and_each_file_counts_once)
{
    add("a.step", "1");
    add("b.STP", "22");
    add("c.txt", "no model");
    add("sub/d.igs.zst", "4444");
    InputOptions options;
    options.inputs = {models_.string(), (models_ / "a.step").string(), (models_ / "*.STP").string()};
    std::vector<std::string> names;
    for (const BatchFile& file : files(options))
        names.push_back(short_name(file.name));
    EXPECT_THAT(names, ElementsAre("sub/d.igs.zst", "b.STP", "a.step")); // the largest first
    options.include = {"*.st*"};
    EXPECT_EQ(files(options).size(), 1u);
    options.inputs = {(models_ / "missing.step").string()};
    EXPECT_EQ(list_inputs(options).error().code, ErrorCode::FileNotFound);
    options.inputs = {(models_ / "*.brep").string()};
    EXPECT_EQ(list_inputs(options).error().code, ErrorCode::FileNotFound);
}

TEST_F(batch, a_list_names_inputs_a_line)
{
    add("a.step", "1");
    add("b.step", "2");
    std::ofstream(folder_ / "list") << "# two models\n"
                                    << (models_ / "a.step").string() << "\r\n\n"
                                    << (models_ / "b.step").string() << "\n";
    InputOptions options;
    options.list = (folder_ / "list").string();
    EXPECT_EQ(list_inputs(options)->files.size(), 2u);
    options.list = (folder_ / "no list").string();
    EXPECT_EQ(list_inputs(options).error().code, ErrorCode::FileNotReadable);
}

TEST_F(batch, shards_share_the_files_out_and_agree_without_talking)
{
    for (int i = 0; i < 200; ++i)
        add(std::to_string(i) + ".step", std::string(static_cast<size_t>(i), 'x'));
    std::set<std::string> seen;
    for (uint32_t i = 0; i < 4; ++i) {
        InputOptions options;
        options.shard = {i, 4};
        const std::vector<BatchFile> part = files(options);
        EXPECT_GT(part.size(), 15u); // 50, give or take 6; the names, and so the parts, are others each time
        for (const BatchFile& file : part)
            EXPECT_TRUE(seen.insert(file.name).second) << file.name;
    }
    EXPECT_EQ(seen.size(), 200u);
    EXPECT_EQ(parse_shard("3/8")->index, 3u);
    for (const char* wrong : {"8/8", "-1/8", "1", "1/", "/2", "1/0", "a/b", "1/2x"})
        EXPECT_FALSE(parse_shard(wrong).ok()) << wrong;
}

TEST_F(batch, names_stay_inside_the_folder_of_packs)
{
    add("a.step", "1");
    InputOptions options;
    options.inputs = {(models_ / ".." / "models" / "." / "a.step").string()};
    const std::vector<BatchFile> list = files(options);
    ASSERT_EQ(list.size(), 1u);
    EXPECT_EQ(list[0].name, (models_.relative_path() / "a.step").string());
}

} // namespace
