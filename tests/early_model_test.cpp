// The first picture of a file that is being read: the viewer shows it from where the model will be seen, and gives it
// up without a trace.
#include "format/pack_writer.h"
#include "proxied_pack.h"
#include "runtime/view/viewer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

namespace trimray {
namespace {

using namespace std::chrono_literals;

bool comes_true(const std::function<bool()>& condition)
{
    for (int tries = 0; tries < 20000; ++tries) {
        if (condition())
            return true;
        std::this_thread::sleep_for(1ms);
    }
    return false;
}

/// Makes CPU tracers once it is let; after 20 s, so that a test that fails ends, too.
class Gate {
public:
    TracerMaker maker()
    {
        return [this](const std::shared_ptr<const Scene>& scene, std::string&) -> Result<std::unique_ptr<Tracer>> {
            ++asked;
            comes_true([this] { return open.load(); });
            ++let;
            if (fails)
                return Error{ErrorCode::NoDevice, "gate", "closed for ever"};
            return make_cpu_tracer(scene);
        };
    }
    std::atomic<bool> open = false, fails = false;
    std::atomic<int> asked = 0, let = 0;
};

class EarlyModelTest : public testing::Test {
protected:
    std::string pack(const PackImage& image, const std::string& name)
    {
        const std::string file = testing::TempDir() + name + ".tray";
        EXPECT_TRUE(write_file_atomically(file, encode_pack(image, WriteOptions{3})).ok());
        return file;
    }
    std::unique_ptr<Viewer> view(const std::string& file)
    {
        Viewer::Start start;
        start.files = {file};
        start.make_tracer = gate.maker();
        start.wake = [] {};
        auto viewer = std::make_unique<Viewer>(std::move(start));
        viewer->set_picture_rect({0, 0, 160, 120});
        return viewer;
    }
    static bool waits_for(Viewer& viewer, const std::function<bool()>& condition)
    {
        return comes_true([&] {
            viewer.update(Viewer::Clock::now());
            return condition();
        });
    }
    static void drag(Viewer& viewer)
    {
        using Kind = InputEvent::Kind;
        viewer.handle({.kind = Kind::Move, .x = 50, .y = 50});
        viewer.handle({.kind = Kind::Button, .code = kLeftButton, .down = true});
        viewer.handle({.kind = Kind::Move, .x = 90, .y = 60});
        viewer.handle({.kind = Kind::Button, .code = kLeftButton, .down = false});
    }
    Gate gate;
};

TEST_F(EarlyModelTest, it_is_seen_from_where_the_model_will_be)
{
    const auto early = view(pack(image_with_proxy(), "early"));
    ASSERT_TRUE(waits_for(*early, [&] { return early->early() != nullptr; }));
    EXPECT_EQ(early->model(), nullptr);
    const Camera seen = early->state().camera;
    PackImage bare = image_with_proxy();
    bare.proxy_draco.clear();
    gate.open = true;
    ASSERT_TRUE(waits_for(*early, [&] { return early->model() && early->shown(); }));
    EXPECT_EQ(early->early(), nullptr) << "the traced picture has taken its place";
    const auto late = view(pack(bare, "late"));
    ASSERT_TRUE(waits_for(*late, [&] { return late->model() != nullptr; }));
    for (const Camera& camera : {early->state().camera, late->state().camera}) {
        EXPECT_EQ(camera.eye, seen.eye);
        EXPECT_EQ(camera.target, seen.target);
    }
}

TEST_F(EarlyModelTest, how_it_was_turned_stays)
{
    const auto viewer = view(pack(image_with_proxy(), "turned"));
    ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->early() != nullptr; }));
    const Camera before = viewer->state().camera;
    drag(*viewer);
    viewer->handle({.kind = InputEvent::Kind::Scroll, .y = 2});
    viewer->act(Action::ToggleParallel);
    const Camera turned = viewer->state().camera;
    EXPECT_NE(turned.eye, before.eye);
    EXPECT_GT(turned.orthographic_mm, 0);
    gate.open = true;
    ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->model() && viewer->shown(); }));
    EXPECT_EQ(viewer->state().camera.eye, turned.eye);
    EXPECT_EQ(viewer->state().camera.orthographic_mm, turned.orthographic_mm);
}

TEST_F(EarlyModelTest, given_up_it_leaves_the_model_before_as_it_was)
{
    gate.open = true;
    const std::string first = pack(image_with_proxy(), "first");
    PackImage other = image_with_proxy();
    other.instances.resize(1);
    other.top_nodes = {synthetic_node(1)};
    const std::string second = pack(other, "second");
    const auto viewer = view(first);
    ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->shown() != nullptr; }));
    drag(*viewer);
    const Camera before = viewer->state().camera;
    for (const bool fails : {false, true}) {
        gate.open = false;
        gate.fails = fails;
        const int asked = gate.asked;
        viewer->open({second});
        EXPECT_NE(viewer->shown(), nullptr) << "the old picture stays until there is another";
        ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->early() != nullptr && gate.asked > asked; }));
        EXPECT_EQ(viewer->model(), nullptr);
        EXPECT_NE(viewer->state().camera.eye, before.eye);
        if (!fails)
            viewer->cancel_load();
        gate.open = true;
        ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->model() != nullptr; }));
        EXPECT_EQ(viewer->model()->file, first);
        EXPECT_EQ(viewer->early(), nullptr);
        EXPECT_EQ(viewer->state().camera.eye, before.eye);
        ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->shown() != nullptr; }));
        ASSERT_TRUE(comes_true([&] { return gate.let == gate.asked; })) << "else it is closed on what was given up";
    }
}

TEST_F(EarlyModelTest, a_file_that_is_read_again_stays_as_it_was_until_it_is_there)
{
    gate.open = true;
    const auto viewer = view(pack(image_with_proxy(), "again"));
    ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->shown() != nullptr; }));
    drag(*viewer);
    const Camera before = viewer->state().camera;
    const int asked = gate.asked;
    gate.open = false;
    viewer->act(Action::Reload);
    ASSERT_TRUE(waits_for(*viewer, [&] { return gate.asked > asked; }));
    for (int i = 0; i < 50; ++i) { // the first picture of it is ready, too
        viewer->update(Viewer::Clock::now());
        EXPECT_TRUE(viewer->model() && viewer->shown());
        std::this_thread::sleep_for(1ms);
    }
    gate.open = true;
    ASSERT_TRUE(waits_for(*viewer, [&] { return !viewer->loader().busy(); }));
    ASSERT_TRUE(waits_for(*viewer, [&] { return viewer->shown() != nullptr; }));
    EXPECT_EQ(viewer->state().camera.eye, before.eye);
}

TEST_F(EarlyModelTest, a_load_that_is_given_up_keeps_nobody_waiting)
{
    const std::string file = pack(image_with_proxy(), "kept");
    ModelLoader loader(gate.maker(), [] {});
    loader.start(file);
    ASSERT_TRUE(comes_true([&] { return gate.asked == 1; }));
    ASSERT_TRUE(comes_true([&] { return loader.take_early() != nullptr; }));
    const auto start = std::chrono::steady_clock::now();
    loader.cancel();
    loader.start(file);
    loader.start(file);
    EXPECT_LT(std::chrono::steady_clock::now() - start, 1s) << "the first is still being made, and would be for ever";
    EXPECT_EQ(gate.asked, 1) << "one after the other";
    EXPECT_FALSE(loader.take());
    EXPECT_TRUE(loader.busy());
    gate.open = true;
    std::optional<Result<LoadedModel>> done;
    ASSERT_TRUE(comes_true([&] { return (done = loader.take()).has_value(); }));
    EXPECT_TRUE(done->ok());
    EXPECT_EQ(gate.asked, 2) << "the second was given up before it began";
    EXPECT_FALSE(loader.busy());
}

} // namespace
} // namespace trimray
