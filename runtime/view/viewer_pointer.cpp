// The pointer: what lies under it, what it picks and drags, and the events that move it.
#include "runtime/view/viewer.h"

#include "runtime/camera_frame.h"

#include <cmath>
#include <utility>

namespace trimray {
namespace {
using namespace std::chrono_literals;

constexpr auto kDoubleClick = 350ms;      // at most between two clicks
constexpr double kClickPixels = 4;        // that the pointer may move in a click
constexpr double kZoomStep = 1.0 / 1.2;   // of distances, a step of the wheel
constexpr double kZoomDragPixels = 150.0; // of a drag that makes distances e times as long

reference::Vec3 to_vector(const std::array<double, 3>& v)
{
    return {v[0], v[1], v[2]};
}

} // namespace

std::optional<PickedPoint> Viewer::pick(double x, double y) const
{
    const auto [px, py] = in_picture(x, y);
    if (!hits_ || px < 0 || py < 0 || px >= rect_.width || py >= rect_.height)
        return std::nullopt;
    const Frame& frame = hits_->frame;
    const auto column = std::min(uint32_t(px * frame.width / rect_.width), frame.width - 1),
               row = std::min(uint32_t(py * frame.height / rect_.height), frame.height - 1);
    const size_t at = size_t(row) * frame.width + column;
    if (frame.instance[at] < 0 && frame.face[at] < 0)
        return std::nullopt;
    const CameraRays rays = camera_rays(hits_->traced.camera, frame.width, frame.height);
    using namespace camera_math;
    const Vec3 along = normalised(rays.corner + rays.step_x * (column + 0.5) + rays.step_y * (row + 0.5), {0, 0, -1});
    PickedPoint picked;
    picked.face = frame.face[at];
    picked.instance = frame.instance[at];
    picked.uv = {frame.uv[2 * at], frame.uv[2 * at + 1]};
    picked.eye_mm = rays.eye;
    picked.along = along;
    double distance = frame.depth_mm[at];
    if (rays.plane_mm > 0) // depth counts from the plane, along the middle of the view
        distance += rays.plane_mm / dot(along, camera_axes(hits_->traced.camera).forward);
    picked.point_mm = rays.eye + along * distance;
    return picked;
}

std::optional<PickedPoint> Viewer::hovered() const
{
    return buttons_ == 0 ? pick(pointer_x_, pointer_y_) : std::nullopt;
}

std::vector<SectionHandle> Viewer::section_handles()
{
    constexpr double kArrowPixels = 80;
    if (!has_view() || !panels.handles || series_ || state_.look.look.section.planes.empty())
        return {};
    return trimray::section_handles(state_.look.look.section, placed(), state_.camera, size(), kArrowPixels * scale);
}

std::optional<GrippedSection> Viewer::section_grip()
{
    constexpr double kReachPixels = 7;
    if (grip_)
        return grip_;
    if (buttons_ != 0)
        return std::nullopt;
    const auto [x, y] = in_picture(pointer_x_, pointer_y_);
    if (x < 0 || y < 0 || x >= rect_.width || y >= rect_.height)
        return std::nullopt; // rims reach out of the picture
    return grip_at(section_handles(), x, y, kReachPixels * scale);
}

void Viewer::drag_section_to(double x, double y)
{
    std::vector<SectionPlane>& planes = state_.look.look.section.planes;
    if (grip_->handle.plane >= planes.size())
        return; // taken away meanwhile
    planes[grip_->handle.plane] =
        dragged(*grip_, state_.camera, size(), in_picture(press_x_, press_y_), in_picture(x, y));
    changed(true);
}

// On the surface that is seen there now, though the picture may lag behind; else as far away as the target.
std::array<double, 3> Viewer::point_under(double x, double y) const
{
    const auto [px, py] = in_picture(x, y);
    if (!model())
        return point_at_target(state_.camera, px, py, size());
    if (state_.look.look.arrangement.any() || !state_.look.look.section.planes.empty()) { // one ray meets all there is
        if (const std::optional<PickedPoint> picked = pick(x, y))
            return picked->point_mm;
    } else {
        using namespace camera_math;
        const CameraRays rays = camera_rays(state_.camera, size().width, size().height);
        const Vec3 along = normalised(rays.corner + rays.step_x * px + rays.step_y * py, {0, 0, -1});
        const double from = rays.plane_mm > 0 ? rays.plane_mm / dot(along, camera_axes(state_.camera).forward) : 0;
        const Vec3 start = rays.eye + along * from;
        if (const RayHit hit = trace_ray(*model_->scene, start, along); hit.hit)
            return start + along * hit.distance_mm;
    }
    return point_at_target(state_.camera, px, py, size());
}

void Viewer::set_selection(Selection selection)
{
    selection_ = std::move(selection);
    ++selection_count_;
    ++shown_count_; // its overlay is another
}

void Viewer::select_at(const std::optional<PickedPoint>& picked, bool adds)
{
    const std::optional<uint32_t> placement =
        picked && picked->instance >= 0 ? std::optional(uint32_t(picked->instance)) : std::nullopt;
    if (adds) {
        if (placement)
            select({*placement}, true);
        return;
    }
    Selection selection;
    if (placement)
        selection.placements = {*placement};
    if (placement && picked->face >= 0)
        selection.face = uint32_t(picked->face);
    selection.place = picked;
    set_selection(std::move(selection));
    measured_.before = std::exchange(measured_.last, std::nullopt);
    measured_.edge.reset();
    if (!selection_.face) {
        measured_ = {};
        return;
    }
    measured_.last = surface_facts(image(), {*selection_.face,
                                             selection_.placements.front(),
                                             {picked->uv[0], picked->uv[1]},
                                             reference::Ray{to_vector(picked->eye_mm), to_vector(picked->along)}});
    measured_.edge = picked_edge(image(), *measured_.last);
}

void Viewer::select(std::vector<uint32_t> placements, bool adds)
{
    if (adds)
        placements = toggled(selection_.placements, placements);
    set_selection({.placements = std::move(placements), .face = {}, .place = {}});
    measured_ = {};
}

void Viewer::select_face(uint32_t placement, uint32_t face)
{
    set_selection({.placements = {placement}, .face = face, .place = {}});
    measured_ = {};
}

void Viewer::show(std::span<const uint32_t> placements, bool shown)
{
    set_shown(state_.look.look.arrangement, visible(), image().instances.size(), placements, shown);
    changed();
}

void Viewer::click(double x, double y, bool adds)
{
    const auto now = Clock::now();
    const bool is_double = now - last_click_ < kDoubleClick && std::hypot(x - click_x_, y - click_y_) <= kClickPixels;
    last_click_ = is_double ? Clock::time_point{} : now;
    click_x_ = x;
    click_y_ = y;
    if (is_double)
        recenter(x, y);
    else
        select_at(pick(x, y), adds);
}

// Turns go about the point from now on; it comes into the picture's middle.
void Viewer::recenter(double x, double y)
{
    const std::optional<PickedPoint> picked = pick(x, y);
    if (!picked)
        return;
    using namespace camera_math;
    Camera camera = state_.camera;
    const CameraAxes axes = camera_axes(camera);
    const Vec3 way = picked->point_mm - camera.target;
    const Vec3 across = way - axes.forward * dot(way, axes.forward);
    camera.eye = camera.eye + across; // at the same distance
    camera.target = picked->point_mm;
    look_along(camera);
}

void Viewer::zoom_at(double x, double y, double scale)
{
    zoom_point_ = point_under(x, y);
    state_.camera = zoom_about(state_.camera, zoom_point_, scale);
    changed(true);
}

void Viewer::drag_to(double x, double y)
{
    if (grip_)
        return drag_section_to(x, y);
    const double dx = x - pointer_x_, dy = y - pointer_y_;
    switch (drag_of(*preset_, buttons_, drag_mods_)) {
    case Drag::Orbit:
        state_.camera = orbit(state_.camera, dx, dy, size(), turning_, {0, 0, 1});
        break;
    case Drag::Pan:
        state_.camera = pan(state_.camera, dx, dy, size());
        break;
    case Drag::Zoom:
        state_.camera = zoom_about(state_.camera, zoom_point_, std::exp(dy / kZoomDragPixels));
        break;
    case Drag::None:
        return;
    }
    changed(true);
}

void Viewer::handle(const InputEvent& event)
{
    using Kind = InputEvent::Kind;
    if (series_ && (event.kind == Kind::Button || event.kind == Kind::Scroll))
        return; // the view is the turn's
    switch (event.kind) {
    case Kind::Move:
        if (buttons_ != 0 && std::hypot(event.x - press_x_, event.y - press_y_) > kClickPixels)
            dragged_ = true;
        if (buttons_ != 0 && dragged_ && has_view())
            drag_to(event.x, event.y);
        pointer_x_ = event.x;
        pointer_y_ = event.y;
        break;
    case Kind::Leave:
        pointer_x_ = pointer_y_ = -1;
        break;
    case Kind::Button:
        if (event.down) {
            if (buttons_ == 0) {
                press_x_ = pointer_x_;
                press_y_ = pointer_y_;
                dragged_ = false;
                grip_ = event.code == kLeftButton && event.mods == 0 ? section_grip() : std::nullopt;
                if (has_view())
                    zoom_point_ = point_under(pointer_x_, pointer_y_);
            }
            buttons_ |= 1u << event.code;
            drag_mods_ = event.mods;
        } else if ((buttons_ & 1u << event.code) != 0) {
            buttons_ &= ~(1u << event.code);
            if (event.code == kLeftButton && !dragged_ && buttons_ == 0)
                click(pointer_x_, pointer_y_, (drag_mods_ & kModControl) != 0);
            if (dragged_)
                changed(true); // rests from now on
            if (buttons_ == 0)
                grip_.reset();
        }
        break;
    case Kind::Scroll:
        if (has_view() && event.y != 0)
            zoom_at(pointer_x_, pointer_y_, std::pow(kZoomStep, event.y));
        break;
    case Kind::Key:
        if (event.down)
            if (const std::optional<Action> action = action_of(*preset_, {event.code, event.mods}))
                act(*action);
        break;
    case Kind::Drop:
        open(event.paths);
        break;
    case Kind::Close:
        quits_ = true;
        break;
    case Kind::Text:
    case Kind::Resize:
        break;
    }
}

} // namespace trimray
