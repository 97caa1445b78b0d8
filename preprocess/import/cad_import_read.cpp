// Files -> the kernel's documents: format detection, readers, units, and the kernel's global settings put back after.
#include "format/cad_names.h"
#include "preprocess/import/cad_import_kernel.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BinTools.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <IGESCAFControl_Reader.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Check.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message_ProgressIndicator.hxx>
#include <STEPCAFControl_ExternFile.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <StepData_StepModel.hxx>
#include <StepShape_FaceSurface.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TDocStd_Document.hxx>
#include <TransferBRep.hxx>
#include <Transfer_Binder.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XCAFApp_Application.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <optional>

namespace trimray::kernel {
namespace {

constexpr size_t kHeadBytes = 64 * 1024; // holds every STEP header seen; longer ones lose their schema's name only

/// First bytes of a file, and last ones, for the question what it is.
struct FileEnds {
    std::string head, tail;
    uint64_t size = 0;
};

Result<FileEnds> read_ends(const std::string& path)
{
    std::error_code failure;
    const std::filesystem::file_status status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status))
        return Error{ErrorCode::FileNotFound, path, "there is no such file; check the path"};
    if (!std::filesystem::is_regular_file(status))
        return Error{ErrorCode::FileNotReadable, path, "is not a regular file; give the path of a CAD file"};
    std::ifstream stream(path, std::ios::binary);
    if (!stream)
        return Error{ErrorCode::FileNotReadable, path,
                     fmt::format("cannot be opened ({}); check its permissions", std::strerror(errno))};
    FileEnds ends;
    ends.head.resize(kHeadBytes);
    stream.read(ends.head.data(), static_cast<std::streamsize>(ends.head.size()));
    ends.head.resize(static_cast<size_t>(stream.gcount()));
    stream.clear();
    stream.seekg(0, std::ios::end);
    ends.size = static_cast<uint64_t>(stream.tellg());
    const uint64_t tail_size = std::min<uint64_t>(ends.size, 4096);
    stream.seekg(static_cast<std::streamoff>(ends.size - tail_size));
    ends.tail.resize(tail_size);
    stream.read(ends.tail.data(), static_cast<std::streamsize>(tail_size));
    if (!stream)
        return Error{ErrorCode::FileNotReadable, path, "could not be read to its end; check the disk"};
    return ends;
}

std::string upper(std::string_view text)
{
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return result;
}

/// The first bytes for a message: printable, short.
std::string sample_of(const std::string& head)
{
    std::string sample;
    for (const char c : head.substr(0, 24))
        sample += std::isprint(static_cast<unsigned char>(c)) ? c : '.';
    return sample;
}

/// A family's name, and what a file of it lacks that is not recognised.
const char* signs_of(CadFamily family)
{
    switch (family) {
    case CadFamily::Step:
        return "STEP (no ISO-10303-21 at its start)";
    case CadFamily::Iges:
        return "IGES (no 80-column start section)";
    case CadFamily::Brep:
        break;
    }
    return "BREP (no CASCADE Topology line)";
}

bool looks_like_iges(const std::string& head)
{
    // fixed 80-column cards: column 73 names the section, 74-80 hold the card's number
    const size_t line_end = head.find_first_of("\r\n");
    const std::string card = head.substr(0, std::min<size_t>(line_end, 80));
    if (card.size() < 80 || (card[72] != 'S' && card[72] != 'G' && card[72] != 'C'))
        return false;
    const std::string number = card.substr(73, 7);
    return number.find_first_not_of(" 0123456789") == std::string::npos &&
           number.find_first_of("0123456789") != std::string::npos;
}

/// "STEP AP214" from FILE_SCHEMA(('AUTOMOTIVE_DESIGN { ... }')).
std::string step_schema(const std::string& head)
{
    const std::string text = upper(head);
    const size_t at = text.find("FILE_SCHEMA");
    const size_t open = at == std::string::npos ? at : text.find('\'', at);
    const size_t close = open == std::string::npos ? open : text.find('\'', open + 1);
    if (close == std::string::npos)
        return "STEP";
    const std::string schema = text.substr(open + 1, close - open - 1);
    struct Known {
        const char* prefix;
        const char* name;
    };
    constexpr Known kKnown[] = {
        {"AP242", "AP242"},
        {"AP203_CONFIGURATION_CONTROLLED_3D_DESIGN_OF_MECHANICAL", "AP203e2"},
        {"CONFIG_CONTROL_DESIGN", "AP203"},
        {"CONFIGURATION_CONTROL_3D_DESIGN", "AP203e2"},
        {"AUTOMOTIVE_DESIGN", "AP214"},
        {"AP209", "AP209"},
        {"STRUCTURAL_ANALYSIS_DESIGN", "AP209"},
        {"AP210", "AP210"},
        {"AP238", "AP238"},
        {"INTEGRATED_CNC_SCHEMA", "AP238"},
        {"ASSOCIATIVE_DRAUGHTING", "AP202"},
        {"AP203", "AP203"},
    };
    for (const Known& known : kKnown)
        if (schema.rfind(known.prefix, 0) == 0)
            return std::string("STEP ") + known.name;
    return "STEP " + schema.substr(0, schema.find_first_of(" {"));
}

/// "MM", "INCH", ...: the short name of a unit as the kernel or the file spells it.
std::string short_unit(const std::string& name)
{
    struct Known {
        const char* spelled;
        const char* short_name;
    };
    constexpr Known kKnown[] = {
        {"MILLIMETRE", "MM"}, {"MILLIMETER", "MM"}, {"MM", "MM"},       {"CENTIMETRE", "CM"}, {"CENTIMETER", "CM"},
        {"CM", "CM"},         {"METRE", "M"},       {"METER", "M"},     {"M", "M"},           {"KILOMETRE", "KM"},
        {"KM", "KM"},         {"MICROMETRE", "UM"}, {"MICRON", "UM"},   {"UM", "UM"},         {"INCH", "INCH"},
        {"INCHES", "INCH"},   {"IN", "INCH"},       {"'INCH'", "INCH"}, {"FOOT", "FT"},       {"FEET", "FT"},
        {"FT", "FT"},         {"MILE", "MI"},       {"MIL", "MIL"},     {"UIN", "UIN"},
    };
    const std::string text = upper(name);
    for (const Known& known : kKnown)
        if (text == known.spelled)
            return known.short_name;
    if (text.empty())
        return "MM";
    return text;
}

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Forwards the kernel's progress to a callback, at most a hundred times a phase.
class ForwardedProgress : public Message_ProgressIndicator {
public:
    ForwardedProgress(const Progress& progress, const char* phase) : progress_(progress), phase_(phase) {}

protected:
    void Show(const Message_ProgressScope&, const Standard_Boolean) override
    {
        const double share = GetPosition();
        if (progress_ && share >= shown_ + 0.01)
            progress_(phase_, shown_ = share);
    }

private:
    const Progress& progress_;
    const char* phase_;
    double shown_ = 0;
};

/// Sets the kernel's global settings for the time of one import.
class KernelSettings {
public:
    ~KernelSettings()
    {
        for (auto it = saved_.rbegin(); it != saved_.rend(); ++it)
            Interface_Static::SetCVal(it->first.c_str(), it->second.c_str());
    }
    void set(const char* name, const char* value)
    {
        if (!Interface_Static::IsPresent(name))
            return;
        saved_.emplace_back(name, Interface_Static::CVal(name));
        Interface_Static::SetCVal(name, value);
    }

private:
    std::vector<std::pair<std::string, std::string>> saved_;
};

opencascade::handle<TDocStd_Document> new_document()
{
    opencascade::handle<TDocStd_Document> document;
    XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
    return document;
}

struct DocumentCloser {
    opencascade::handle<TDocStd_Document> document;
    ~DocumentCloser()
    {
        if (!document.IsNull())
            XCAFApp_Application::GetApplication()->Close(document);
    }
};

/// Counts the file's faces and keeps those that were transferred to nothing, with the kernel's first words about them.
void note_lost_faces(const STEPControl_Reader& reader, LoadedFile& file)
{
    const Handle(Interface_InterfaceModel) model = reader.Model();
    const Handle(Transfer_TransientProcess) transfer = reader.WS()->TransferReader()->TransientProcess();
    if (model.IsNull() || transfer.IsNull())
        return;
    for (int i = 1; i <= model->NbEntities(); ++i) {
        const Handle(Standard_Transient) entity = model->Value(i);
        if (!entity->IsKind(STANDARD_TYPE(StepShape_FaceSurface)))
            continue;
        ++file.source_faces;
        const Handle(Transfer_Binder) binder = transfer->Find(entity);
        if (binder.IsNull() || !TransferBRep::ShapeResult(binder).IsNull())
            continue; // not part of anything that is transferred, or well
        const Handle(Interface_Check) check = binder->Check();
        std::string reason = "the kernel made no face of it";
        if (check->NbFails() > 0)
            reason += std::string(": ") + check->CFail(1);
        else if (check->NbWarnings() > 0)
            reason += std::string(": ") + check->CWarning(1);
        file.lost_faces.push_back(
            {fmt::format("#{}", Handle(StepData_StepModel)::DownCast(model)->IdentLabel(entity)), reason});
    }
}

std::string model_name(const std::string& path, const ImportOptions& options)
{
    return std::filesystem::path(options.file_name.empty() ? path : options.file_name).stem().string();
}

Result<LoadedFile> load_step(const std::string& path, const ImportOptions& options, const Progress& progress)
{
    const Result<FileEnds> ends = read_ends(path);
    if (!ends)
        return ends.error();
    LoadedFile file;
    file.source_format = step_schema(ends->head);
    const bool has_end = ends->tail.find("END-ISO-10303-21") != std::string::npos;

    STEPCAFControl_Reader reader;
    KernelSettings settings;
    settings.set("xstep.cascade.unit", "MM");
    settings.set("read.step.codepage", "UTF8");
    settings.set("read.precision.mode", "0"); // the file's own tolerance
    const HealingPolicy healing(options.heal);
    reader.SetNameMode(true);
    reader.SetColorMode(true);
    reader.SetLayerMode(false);
    reader.SetPropsMode(false);
    reader.SetGDTMode(false);
    reader.SetMatMode(false);
    reader.SetViewMode(false);
    reader.SetSHUOMode(true);

    if (progress)
        progress("read", -1);
    const auto read_start = std::chrono::steady_clock::now();
    const IFSelect_ReturnStatus status = reader.ReadFile(path.c_str());
    file.read_seconds = seconds_since(read_start);
    if (status != IFSelect_RetDone) {
        if (!has_end)
            return Error{ErrorCode::InvalidCad, path,
                         fmt::format("the STEP file of {} bytes ends without END-ISO-10303-21: it is truncated; get a "
                                     "complete copy",
                                     ends->size)};
        return Error{ErrorCode::InvalidCad, path,
                     "begins as STEP but the kernel's reader finds errors in its structure; export it again"};
    }
    if (!has_end)
        file.warnings.push_back("the file ends without END-ISO-10303-21: it may be truncated");

    TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles);
    const std::string length_unit = lengths.IsEmpty() ? "MM" : lengths.First().ToCString();
    file.source_unit = short_unit(length_unit);
    for (int i = 2; i <= lengths.Length(); ++i)
        if (short_unit(lengths(i).ToCString()) != file.source_unit)
            file.warnings.push_back(fmt::format("the file mixes units: {} and {}; all lengths are converted",
                                                file.source_unit, short_unit(lengths(i).ToCString())));

    const DocumentCloser closer{new_document()};
    const auto transfer_start = std::chrono::steady_clock::now();
    opencascade::handle<ForwardedProgress> indicator = new ForwardedProgress(progress, "transfer");
    opencascade::handle<TDocStd_Document> document = closer.document;
    const bool transferred = reader.Transfer(document, indicator->Start());
    file.transfer_seconds = seconds_since(transfer_start);
    for (NCollection_DataMap<TCollection_AsciiString, Handle(STEPCAFControl_ExternFile)>::Iterator it(
             reader.ExternFiles());
         it.More(); it.Next())
        if (!it.Value()->GetLoadStatus() || !it.Value()->GetTransferStatus())
            file.warnings.push_back(fmt::format(
                "part of the assembly is in another file, {}, which was not found beside it or not readable",
                it.Key().ToCString()));
    note_lost_faces(reader.Reader(), file);
    if (transferred)
        if (const Status walked = walk_document(document, model_name(path, options), file); !walked)
            return walked.error();
    return file;
}

Result<LoadedFile> load_iges(const std::string& path, const ImportOptions& options, const Progress& progress)
{
    LoadedFile file;
    IGESCAFControl_Reader reader;
    KernelSettings settings;
    settings.set("xstep.cascade.unit", "MM");
    settings.set("read.precision.mode", "0");
    const HealingPolicy healing(options.heal);
    reader.SetNameMode(true);
    reader.SetColorMode(true);
    reader.SetLayerMode(false);
    if (progress)
        progress("read", -1);
    const auto read_start = std::chrono::steady_clock::now();
    const IFSelect_ReturnStatus status = reader.ReadFile(path.c_str());
    file.read_seconds = seconds_since(read_start);
    if (status != IFSelect_RetDone)
        return Error{ErrorCode::InvalidCad, path,
                     "begins as IGES but the kernel's reader finds errors in its structure; export it again"};
    const Handle(IGESData_IGESModel) model = reader.IGESModel();
    constexpr const char* kVersions[] = {"",    "1.0", "1.0", "2.0", "3.0", "3.0",
                                         "4.0", "4.0", "5.0", "5.1", "5.2", "5.3"};
    const int version = model->GlobalSection().IGESVersion();
    file.source_format = version >= 1 && version < static_cast<int>(std::size(kVersions))
                             ? std::string("IGES ") + kVersions[version]
                             : "IGES";
    file.source_unit =
        short_unit(model->GlobalSection().UnitName().IsNull() ? "" : model->GlobalSection().UnitName()->ToCString());

    const DocumentCloser closer{new_document()};
    const auto transfer_start = std::chrono::steady_clock::now();
    opencascade::handle<ForwardedProgress> indicator = new ForwardedProgress(progress, "transfer");
    opencascade::handle<TDocStd_Document> document = closer.document;
    const bool transferred = reader.Transfer(document, indicator->Start());
    file.transfer_seconds = seconds_since(transfer_start);

    if (transferred)
        if (const Status walked = walk_document(document, model_name(path, options), file); !walked)
            return walked.error();
    return file;
}

Result<LoadedFile> load_brep(const std::string& path, CadFormat format, const ImportOptions& options,
                             const Progress& progress)
{
    LoadedFile file;
    file.source_format = "BREP";
    file.source_unit = short_unit({}); // the format has no unit; the kernel's own is the millimetre
    if (progress)
        progress("read", -1);
    const auto read_start = std::chrono::steady_clock::now();
    TopoDS_Shape shape;
    BRep_Builder builder;
    const bool done = format == CadFormat::BrepBinary ? BinTools::Read(shape, path.c_str())
                                                      : BRepTools::Read(shape, path.c_str(), builder);
    file.read_seconds = seconds_since(read_start);
    if (!done || shape.IsNull())
        return Error{ErrorCode::InvalidCad, path,
                     "begins as BREP but the kernel cannot read it: truncated, or of a newer version; save it again"};
    if (const Status added = add_bare_shape(shape, model_name(path, options), file); !added)
        return added.error();
    return file;
}

} // namespace

Result<CadFormat> detect_format(const std::string& path, const std::string& file_name)
{
    const Result<FileEnds> ends = read_ends(path);
    if (!ends)
        return ends.error();
    const std::string& head = ends->head;
    if (ends->size == 0)
        return Error{ErrorCode::EmptyCad, path, "the file is empty (0 bytes); get a complete copy"};
    if (head.find("ISO-10303-21") < 4096) // white space, a byte-order mark or a comment may come first
        return CadFormat::Step;
    if (head.find("Open CASCADE Topology V") < 64)
        return CadFormat::BrepBinary;
    if (head.find("CASCADE Topology V") < 256)
        return CadFormat::BrepText;
    if (looks_like_iges(head))
        return CadFormat::Iges;

    struct Known {
        const char* magic;
        const char* what;
    };
    using namespace std::literals;
    const std::pair<std::string_view, const char*> kOthers[] = {
        {"PK\x03\x04"sv, "a zip archive; unpack it first"},
        {"\x1f\x8b"sv, "gzip data; unpack it first"},
        {"\x28\xb5\x2f\xfd"sv, "zstd data; unpack it first"},
        {"<?xml"sv, "XML; export as STEP part 21 (.step) instead"},
        {"glTF"sv, "a glTF mesh; a CAD model with surfaces is needed"},
        {"solid "sv, "an STL mesh; a CAD model with surfaces is needed"},
        {"# "sv, "text, perhaps a mesh; a CAD model with surfaces is needed"},
        {"\x7f"
         "ELF"sv,
         "a program"},
        {"\xab"
         "TRAY"sv,
         "a scene pack already; render or view it as it is"},
    };
    for (const auto& [magic, what] : kOthers)
        if (head.compare(0, magic.size(), magic) == 0)
            return Error{ErrorCode::UnsupportedFormat, path, fmt::format("is {}", what)};

    if (const std::optional<CadFamily> claimed = cad_family(file_name.empty() ? path : file_name))
        return Error{
            ErrorCode::InvalidCad, path,
            fmt::format("is not {}: it begins with \"{}\"; export it again", signs_of(*claimed), sample_of(head))};
    return Error{
        ErrorCode::UnsupportedFormat, path,
        fmt::format("is neither STEP, IGES nor BREP: it begins with \"{}\"; export it as STEP", sample_of(head))};
}

Result<LoadedFile> load_file(const std::string& path, CadFormat format, const ImportOptions& options,
                             const Progress& progress)
{
    switch (format) {
    case CadFormat::Step:
        return load_step(path, options, progress);
    case CadFormat::Iges:
        return load_iges(path, options, progress);
    default:
        return load_brep(path, format, options, progress);
    }
}

} // namespace trimray::kernel
