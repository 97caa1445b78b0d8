#include "tests/occt_oracle_impl.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <Bnd_Box.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Lin.hxx>
#include <gp_Torus.hxx>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace trimray::oracle {

namespace {

constexpr double kPi = 3.14159265358979323846;
// The kernel's boxes hold the face and its tolerances; this much of the box's size more costs nothing and is safe.
constexpr double kBoxPadding = 1e-2;
// What the kernel itself takes for the tolerance of a point (Precision::Confusion), in local mm.
constexpr double kIntersectorTolerance = 1e-7;

Point sub(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point cross(const Point& a, const Point& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point unit(const Point& a)
{
    const double n = std::sqrt(dot(a, a));
    return {a[0] / n, a[1] / n, a[2] / n};
}

void grow(Box& box, const Box& other)
{
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::min(box.lo[k], other.lo[k]);
        box.hi[k] = std::max(box.hi[k], other.hi[k]);
    }
}

/// The ray's way through the box, clipped to [0, inf). False: it misses.
bool clip(const Box& box, const Ray& ray, double& enter, double& leave)
{
    enter = 0;
    leave = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (ray.direction[k] == 0) {
            if (ray.origin[k] < box.lo[k] || ray.origin[k] > box.hi[k])
                return false;
            continue;
        }
        double t0 = (box.lo[k] - ray.origin[k]) / ray.direction[k];
        double t1 = (box.hi[k] - ray.origin[k]) / ray.direction[k];
        if (t0 > t1)
            std::swap(t0, t1);
        enter = std::max(enter, t0);
        leave = std::min(leave, t1);
    }
    return enter <= leave;
}

std::string lower_ending(const std::string& path)
{
    const size_t dot_at = path.rfind('.');
    std::string ending = dot_at == std::string::npos ? "" : path.substr(dot_at + 1);
    for (char& c : ending)
        c = char(std::tolower(static_cast<unsigned char>(c)));
    return ending;
}

} // namespace

TopoDS_Shape read_shape(const std::string& path, std::string& error)
{
    const std::string ending = lower_ending(path);
    if (ending == "brep" || ending == "brp") {
        TopoDS_Shape shape;
        if (!BRepTools::Read(shape, path.c_str(), BRep_Builder()))
            error = "the kernel cannot read the BREP file";
        return shape;
    }
    const auto transferred = [&](XSControl_Reader& reader) {
        Interface_Static::SetCVal("xstep.cascade.unit", "MM");
        if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
            error = "the kernel cannot read the file";
            return TopoDS_Shape();
        }
        reader.TransferRoots();
        return reader.OneShape();
    };
    if (ending == "igs" || ending == "iges") {
        IGESControl_Reader reader;
        return transferred(reader);
    }
    STEPControl_Reader reader;
    return transferred(reader);
}

namespace {

/// The whole torus: the kernel's box of a torus over negative v can lack half of it.
void add_torus(const gp_Torus& torus, Bnd_Box& box)
{
    const gp_XYZ center = torus.Location().XYZ(), axis = torus.Axis().Direction().XYZ();
    gp_XYZ half;
    for (int k = 1; k <= 3; ++k)
        half.SetCoord(k, torus.MajorRadius() * std::sqrt(std::max(0.0, 1 - axis.Coord(k) * axis.Coord(k))) +
                             torus.MinorRadius());
    box.Add(gp_Pnt(center - half));
    box.Add(gp_Pnt(center + half));
}

/// Points of splines, sweeps and offsets, at knots and between: the kernel's box cuts corners of low degree.
void add_samples(const BRepAdaptor_Surface& surface, Bnd_Box& box)
{
    constexpr int kLeastSpans = 8, kMostSpans = 64; // a direction
    const auto parameters = [&](bool along_u) {
        const GeomAbs_Shape smooth = GeomAbs_C1;
        const int spans = along_u ? surface.NbUIntervals(smooth) : surface.NbVIntervals(smooth);
        TColStd_Array1OfReal breaks(1, spans + 1);
        if (along_u)
            surface.UIntervals(breaks, smooth);
        else
            surface.VIntervals(breaks, smooth);
        const int pieces = spans >= kLeastSpans ? 1 : kLeastSpans;
        std::vector<double> values;
        for (int i = 1; i <= std::min(spans, kMostSpans); ++i)
            for (int k = 0; k <= pieces; ++k)
                values.push_back(breaks(i) + (breaks(i + 1) - breaks(i)) * k / pieces);
        return values;
    };
    for (const double u : parameters(true))
        for (const double v : parameters(false))
            box.Add(surface.Value(u, v));
}

/// The box of a face with its tolerances, in the world; all inside out for a face without points.
Box face_box(const TopoDS_Face& face, const gp_Trsf& to_world)
{
    Bnd_Box kernel_box;
    BRepBndLib::Add(face, kernel_box, false);
    const BRepAdaptor_Surface surface(face);
    if (surface.GetType() == GeomAbs_Torus)
        add_torus(surface.Torus(), kernel_box);
    else if (surface.GetType() > GeomAbs_Torus)
        add_samples(surface, kernel_box);
    if (kernel_box.IsVoid())
        return {};
    kernel_box = kernel_box.Transformed(to_world);
    Box box;
    kernel_box.Get(box.lo[0], box.lo[1], box.lo[2], box.hi[0], box.hi[1], box.hi[2]);
    return box;
}

Box padded(Box box)
{
    const double pad = kBoxPadding * diagonal(box);
    for (int k = 0; k < 3; ++k) {
        box.lo[k] -= pad;
        box.hi[k] += pad;
    }
    return box;
}

} // namespace

double diagonal(const Box& box)
{
    const Point d = sub(box.hi, box.lo);
    return std::sqrt(dot(d, d));
}

const char* cause_name(Cause cause)
{
    switch (cause) {
    case Cause::Edge:
        return "edge";
    case Cause::Tangent:
        return "tangent";
    case Cause::Oracle:
        return "oracle";
    default:
        return "unexplained";
    }
}

std::vector<Ray> view_rays(const View& view, uint32_t width, uint32_t height)
{
    const Point forward = unit(sub(view.target, view.eye));
    const Point right = unit(cross(forward, view.up));
    const Point up = cross(right, forward);
    const double half_height = std::tan(view.fov_deg * kPi / 360);
    const double half_width = half_height * width / height;
    std::vector<Ray> rays;
    rays.reserve(size_t(width) * height);
    for (uint32_t row = 0; row < height; ++row)
        for (uint32_t column = 0; column < width; ++column) {
            const double x = half_width * (2 * (column + 0.5) / width - 1);
            const double y = half_height * (1 - 2 * (row + 0.5) / height);
            Point d;
            for (int k = 0; k < 3; ++k)
                d[k] = forward[k] + x * right[k] + y * up[k];
            rays.push_back({view.eye, unit(d)});
        }
    return rays;
}

View frame_box(const Point& lo_mm, const Point& hi_mm, const Point& direction, const Point& up, double aspect,
               double fov_deg)
{
    const double half_fov = fov_deg * kPi / 360;
    const double narrow = std::min(half_fov, std::atan(std::tan(half_fov) * aspect));
    const double radius = diagonal({lo_mm, hi_mm}) / 2;
    const Point towards = unit(direction);
    View view;
    view.fov_deg = fov_deg;
    view.up = up;
    for (int k = 0; k < 3; ++k) {
        view.target[k] = (lo_mm[k] + hi_mm[k]) / 2;
        view.eye[k] = view.target[k] + towards[k] * radius / std::sin(narrow);
    }
    return view;
}

Oracle::Oracle(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Oracle::~Oracle() = default;

std::unique_ptr<Oracle> Oracle::load(const std::string& path, const OracleOptions& options, std::string& error)
{
    Message::DefaultMessenger()->ChangePrinters().Clear(); // the kernel talks to stdout
    error.clear();
    try {
        const TopoDS_Shape shape = read_shape(path, error);
        if (!error.empty())
            return nullptr;
        auto impl = std::make_unique<Impl>();
        impl->options = options;
        impl->gather_faces(shape);
        if (impl->placed.empty()) {
            error = "the kernel finds no face in the file";
            return nullptr;
        }
        impl->build_tree();
        return std::unique_ptr<Oracle>(new Oracle(std::move(impl)));
    } catch (const Standard_Failure& failure) {
        error = failure.GetMessageString();
        return nullptr;
    }
}

size_t Oracle::unique_faces() const
{
    return impl_->unique.size();
}
size_t Oracle::placed_faces() const
{
    return impl_->placed.size();
}
const Point& Oracle::lo_mm() const
{
    return impl_->bounds.lo;
}
const Point& Oracle::hi_mm() const
{
    return impl_->bounds.hi;
}
double Oracle::diagonal_mm() const
{
    return diagonal(impl_->bounds);
}

void Oracle::Impl::gather_faces(const TopoDS_Shape& shape)
{
    std::map<const void*, uint32_t> seen;
    std::map<const void*, std::vector<TopLoc_Location>> placements; // a face shared by two solids stands once
    if (shape.IsNull())
        return;
    for (TopExp_Explorer explorer(shape, TopAbs_FACE); explorer.More(); explorer.Next()) {
        const TopoDS_Face& face = TopoDS::Face(explorer.Current());
        const void* body = face.TShape().get();
        auto& known = placements[body];
        if (std::any_of(known.begin(), known.end(),
                        [&](const TopLoc_Location& location) { return location.IsEqual(face.Location()); }))
            continue;
        known.push_back(face.Location());
        const auto [at, is_new] = seen.try_emplace(body, uint32_t(unique.size()));
        if (is_new)
            unique.push_back(TopoDS::Face(face.Located(TopLoc_Location())));
        PlacedFace added;
        added.unique = at->second;
        added.to_world = face.Location().Transformation();
        added.to_local = added.to_world.Inverted();
        added.local_scale = std::abs(added.to_local.ScaleFactor());
        const Box box = face_box(unique[added.unique], added.to_world);
        grow(bounds, box);
        added.box = padded(box);
        placed.push_back(added);
    }
}

void Oracle::Impl::build_tree()
{
    constexpr uint32_t kLeafFaces = 2;
    order.resize(placed.size());
    std::iota(order.begin(), order.end(), 0u);
    nodes.assign(1, {});
    nodes[0].count = uint32_t(order.size());
    for (size_t n = 0; n < nodes.size(); ++n) {
        Box box;
        const uint32_t first = nodes[n].first, count = nodes[n].count;
        for (uint32_t i = first; i < first + count; ++i)
            grow(box, placed[order[i]].box);
        nodes[n].box = box;
        if (count <= kLeafFaces)
            continue;
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (box.hi[k] - box.lo[k] > box.hi[axis] - box.lo[axis])
                axis = k;
        const auto middle = [&](uint32_t f) { return placed[f].box.lo[axis] + placed[f].box.hi[axis]; };
        const uint32_t half = count / 2;
        std::nth_element(order.begin() + first, order.begin() + first + half, order.begin() + first + count,
                         [&](uint32_t a, uint32_t b) { return middle(a) < middle(b); });
        const uint32_t child = uint32_t(nodes.size());
        nodes[n].first = child;
        nodes[n].count = 0;
        nodes.resize(nodes.size() + 2);
        nodes[child].first = first;
        nodes[child].count = half;
        nodes[child + 1].first = first + half;
        nodes[child + 1].count = count - half;
    }
}

OracleHit Oracle::Impl::closest(const Ray& ray) const
{
    Intersectors& mine = intersectors.local();
    mine.resize(unique.size());
    OracleHit best;
    std::vector<std::pair<double, uint32_t>> open; // entry distance, node; nearest at the back
    double enter = 0, leave = 0;
    if (clip(nodes[0].box, ray, enter, leave))
        open.emplace_back(enter, 0u);
    while (!open.empty()) {
        const auto [entry, n] = open.back();
        open.pop_back();
        if (entry > best.distance_mm)
            continue;
        const TreeNode& node = nodes[n];
        if (node.count == 0) {
            double enter_a = 0, enter_b = 0;
            const bool a = clip(nodes[node.first].box, ray, enter_a, leave);
            const bool b = clip(nodes[node.first + 1].box, ray, enter_b, leave);
            const bool a_first = enter_a <= enter_b;
            if (b && a_first)
                open.emplace_back(enter_b, node.first + 1);
            if (a)
                open.emplace_back(enter_a, node.first);
            if (b && !a_first)
                open.emplace_back(enter_b, node.first + 1);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; ++i) {
            const PlacedFace& face = placed[order[i]];
            if (!clip(face.box, ray, enter, leave) || enter > best.distance_mm)
                continue;
            try {
                auto& intersector = mine[face.unique];
                if (!intersector)
                    intersector = std::make_unique<IntCurvesFace_Intersector>(
                        unique[face.unique], kIntersectorTolerance, true, options.boundary_tolerance);
                gp_Pnt p(ray.origin[0], ray.origin[1], ray.origin[2]);
                p.Transform(face.to_local);
                gp_Dir d(ray.direction[0], ray.direction[1], ray.direction[2]);
                d.Transform(face.to_local);
                intersector->Perform(gp_Lin(p, d), 0, leave * face.local_scale);
                if (!intersector->IsDone())
                    continue;
                for (int k = 1; k <= intersector->NbPnt(); ++k) {
                    const double t = intersector->WParameter(k) / face.local_scale;
                    if (t < 0 || t >= best.distance_mm)
                        continue;
                    best.distance_mm = t;
                    best.face = int32_t(order[i]);
                    best.u = intersector->UParameter(k);
                    best.v = intersector->VParameter(k);
                }
            } catch (const Standard_Failure&) {
                best.failed = true;
            }
        }
    }
    return best;
}

std::vector<uint32_t> Oracle::Impl::faces_around(const Point& p, double margin) const
{
    const auto holds = [&](const Box& box) {
        for (int k = 0; k < 3; ++k)
            if (p[k] < box.lo[k] - margin || p[k] > box.hi[k] + margin)
                return false;
        return true;
    };
    std::vector<uint32_t> found, open{0};
    while (!open.empty()) {
        const TreeNode& node = nodes[open.back()];
        open.pop_back();
        if (!holds(node.box))
            continue;
        if (node.count == 0) {
            open.push_back(node.first);
            open.push_back(node.first + 1);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; ++i)
            if (holds(placed[order[i]].box))
                found.push_back(order[i]);
    }
    return found;
}

std::vector<OracleHit> Oracle::cast(std::span<const Ray> rays) const
{
    std::unique_ptr<tbb::global_control> limit;
    if (impl_->options.threads > 0)
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      size_t(impl_->options.threads));
    std::vector<OracleHit> hits(rays.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, rays.size(), 64), [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i != range.end(); ++i)
            hits[i] = impl_->closest(rays[i]);
    });
    return hits;
}

} // namespace trimray::oracle
