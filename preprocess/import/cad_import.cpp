#include "preprocess/import/cad_import.h"

#include "preprocess/import/cad_import_kernel.h"

#include <BRepBndLib.hxx>
#include <Bnd_Box.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <OSD.hxx>
#include <Standard_ErrorHandler.hxx>
#include <Standard_Failure.hxx>
#include <Standard_Version.hxx>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fmt/format.h>
#include <limits>

namespace trimray {
namespace kernel {
namespace {

/// Silences the kernel's messages while it lives.
class QuietKernel {
public:
    QuietKernel() : saved_(Message::DefaultMessenger()->Printers())
    {
        Message::DefaultMessenger()->ChangePrinters().Clear();
    }
    ~QuietKernel() { Message::DefaultMessenger()->ChangePrinters() = saved_; }
    QuietKernel(const QuietKernel&) = delete;
    QuietKernel& operator=(const QuietKernel&) = delete;

private:
    Message_SequenceOfPrinters saved_;
};

/// Lets the kernel turn its faults (bad access, bad arithmetic) into exceptions while it lives; everything else keeps
/// the handlers it had.
class FaultsAsExceptions {
public:
    FaultsAsExceptions()
    {
        for (size_t i = 0; i < kAll.size(); ++i)
            sigaction(kAll[i], nullptr, &saved_[i]);
        OSD::SetSignal(false);
        for (size_t i = kFaults; i < kAll.size(); ++i)
            sigaction(kAll[i], &saved_[i], nullptr);
    }
    ~FaultsAsExceptions()
    {
        for (size_t i = 0; i < kAll.size(); ++i)
            sigaction(kAll[i], &saved_[i], nullptr);
    }
    FaultsAsExceptions(const FaultsAsExceptions&) = delete;
    FaultsAsExceptions& operator=(const FaultsAsExceptions&) = delete;

private:
    static constexpr size_t kFaults = 4;
    static constexpr std::array kAll{SIGSEGV, SIGBUS,  SIGFPE,  SIGILL, SIGHUP,
                                     SIGINT,  SIGQUIT, SIGTERM, SIGSYS, SIGPIPE};
    std::array<struct sigaction, kAll.size()> saved_{};
};

std::string trimmed_message(const char* text)
{
    std::string message = text ? text : "";
    if (message.size() > 200)
        message.resize(200);
    return message;
}

double diagonal(const std::array<double, 3>& lo, const std::array<double, 3>& hi)
{
    const double x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
    return std::sqrt(x * x + y * y + z * z);
}

} // namespace

std::optional<std::string> failure_of(const std::function<void()>& action)
{
    try {
        OCC_CATCH_SIGNALS
        action();
        return std::nullopt;
    } catch (const Standard_Failure& failure) {
        return fmt::format("the kernel gave up: {} {}", failure.DynamicType()->Name(),
                           trimmed_message(failure.GetMessageString()));
    } catch (const std::exception& failure) {
        return fmt::format("the kernel gave up: {}", trimmed_message(failure.what()));
    } catch (...) {
        return "the kernel gave up without a reason";
    }
}

std::optional<ShapeBox> box_of(const TopoDS_Shape& shape)
{
    Bnd_Box box;
    BRepBndLib::AddClose(shape, box); // of vertices and poles: cheap, and large enough
    if (box.IsVoid())
        BRepBndLib::Add(shape, box, false);
    if (box.IsVoid() || box.IsOpen())
        return std::nullopt;
    const gp_Pnt lo = box.CornerMin(), hi = box.CornerMax();
    return ShapeBox{{lo.X(), lo.Y(), lo.Z()}, {hi.X(), hi.Y(), hi.Z()}};
}

double diagonal_mm(const TopoDS_Shape& shape)
{
    const std::optional<ShapeBox> box = box_of(shape);
    return box ? diagonal(box->lo, box->hi) : 0;
}

/// Diagonal of the box around the placed parts' boxes, mm.
double diagonal_mm(const std::vector<PartShape>& parts, const std::vector<CadInstance>& instances)
{
    constexpr double kInf = std::numeric_limits<double>::infinity();
    std::vector<std::optional<ShapeBox>> boxes;
    for (const PartShape& part : parts)
        boxes.push_back(box_of(part.shape));
    std::array<double, 3> lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
    for (const CadInstance& instance : instances) {
        const std::optional<ShapeBox>& box = boxes[instance.part];
        for (int corner = 0; box && corner < 8; ++corner)
            for (size_t row = 0; row < 3; ++row) {
                const double* m = &instance.transform[4 * row];
                double x = m[3];
                for (size_t c = 0; c < 3; ++c)
                    x += m[c] * (corner >> c & 1 ? box->hi : box->lo)[c];
                lo[row] = std::min(lo[row], x);
                hi[row] = std::max(hi[row], x);
            }
    }
    return lo[0] <= hi[0] ? diagonal(lo, hi) : 0;
}

/// Fills the parts' meshes.
void mesh_parts(const std::vector<PartShape>& parts, const ImportOptions& options, const Progress& progress,
                CadModel& model)
{
    constexpr double kProxyAngle = 0.6; // ten segments a circle
    constexpr double kMeshAngle = 0.5;
    const auto start = std::chrono::steady_clock::now();
    const bool is_proxy = !(options.mesh_deflection > 0);
    if (!is_proxy)
        model.mesh_deflection_mm = options.mesh_deflection * diagonal_mm(parts, model.instances);
    for (size_t i = 0; i < parts.size(); ++i) {
        const TopoDS_Shape& shape = parts[i].shape;
        const MeshDetail detail = is_proxy
                                      ? MeshDetail{options.proxy_deflection * diagonal_mm(shape), kProxyAngle, false}
                                      : MeshDetail{model.mesh_deflection_mm, kMeshAngle, true};
        mesh_part(shape, detail, model.parts[i], model.warnings);
        if (progress)
            progress("mesh", static_cast<double>(i + 1) / static_cast<double>(parts.size()));
    }
    model.mesh_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace kernel

std::string kernel_version()
{
    return fmt::format("OpenCASCADE {}", OCC_VERSION_COMPLETE);
}

Result<CadModel> import_cad(const std::string& path, const ImportOptions& options, const Progress& progress)
{
    const Result<kernel::CadFormat> format = kernel::detect_format(path, options.file_name);
    if (!format)
        return format.error();
    const kernel::QuietKernel quiet;
    // a fault while it reads ends the process: the kernel's own data cannot be trusted after it, and where it happened
    // is worth knowing. Faults of single faces, below, cost that face alone.
    std::optional<Result<kernel::LoadedFile>> loaded;
    if (const auto failure = kernel::failure_of([&] { loaded = kernel::load_file(path, *format, options, progress); }))
        return Error{ErrorCode::InvalidCad, path, *failure + "; the file is damaged, export it again"};
    if (!*loaded)
        return loaded->error();
    kernel::LoadedFile& file = **loaded;
    const kernel::FaultsAsExceptions faults;

    CadModel model;
    model.source_format = file.source_format;
    model.source_unit = file.source_unit;
    model.read_seconds = file.read_seconds;
    model.transfer_seconds = file.transfer_seconds;
    model.warnings = std::move(file.warnings);
    if (file.parts.empty()) {
        std::string detail =
            file.source_faces > 0
                ? fmt::format("the kernel made no shape of the {} faces in this {} file; export it again",
                              file.source_faces, file.source_format)
                : fmt::format("this {} file holds no faces, only wires, points, annotations or other data; export "
                              "solids or surfaces",
                              file.source_format);
        if (!file.lost_faces.empty())
            detail += fmt::format("; {}: {}", file.lost_faces.front().name, file.lost_faces.front().reason);
        for (const std::string& warning : model.warnings)
            detail += "; " + warning;
        return Error{ErrorCode::EmptyCad, path, detail};
    }
    model.instances = std::move(file.instances);
    model.tree = std::move(file.tree);
    const auto faces_start = std::chrono::steady_clock::now();
    for (size_t i = 0; i < file.parts.size(); ++i) {
        const auto part = static_cast<uint32_t>(i);
        model.parts.push_back(kernel::convert_part(file.parts[i], part, options, model.dropped, progress));
        if (progress)
            progress("faces", static_cast<double>(i + 1) / static_cast<double>(file.parts.size()));
    }
    uint32_t next_face = static_cast<uint32_t>(model.parts.front().faces.size());
    for (const CadDroppedFace& face : model.dropped)
        next_face += face.part == 0 ? 1 : 0;
    for (kernel::LoadedFile::LostFace& lost : file.lost_faces) // of no part that exists: named with the first
        model.dropped.push_back({0, next_face++, std::move(lost.name), std::move(lost.reason)});
    model.faces_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - faces_start).count();
    if (options.proxy_deflection > 0 || options.mesh_deflection > 0)
        kernel::mesh_parts(file.parts, options, progress, model);
    return model;
}

} // namespace trimray
