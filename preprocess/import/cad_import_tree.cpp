// The document's assembly -> tree, instances and parts, with names and colours. A shape that is used often is one part.
#include "preprocess/import/cad_import_kernel.h"

#include <NCollection_Map.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <TDF_Label.hxx>
#include <TDF_LabelMapHasher.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopTools_MapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Iterator.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace trimray::kernel {
namespace {

constexpr int kMaxTreeDepth = 256;         // deeper is an assembly that holds itself
constexpr size_t kMaxTreeNodes = 1u << 24; // a few small files could otherwise ask for 2^60 placements

std::array<double, 12> matrix_of(const gp_Trsf& transform)
{
    std::array<double, 12> m{};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            m[row * 4 + column] = transform.Value(row + 1, column + 1);
    return m;
}

/// UTF-8 with every byte sequence that is none replaced by U+FFFD.
std::string valid_utf8(const std::string& text)
{
    std::string result;
    for (size_t i = 0; i < text.size();) {
        const auto byte = [&](size_t k) { return static_cast<unsigned char>(text[k]); };
        const unsigned char c = byte(i);
        const size_t size = c < 0x80                ? 1
                            : c >= 0xc2 && c < 0xe0 ? 2
                            : (c & 0xf0) == 0xe0    ? 3
                            : c >= 0xf0 && c < 0xf5 ? 4
                                                    : 0;
        bool good = size > 0 && i + size <= text.size();
        for (size_t k = 1; good && k < size; ++k)
            good = (byte(i + k) & 0xc0) == 0x80;
        if (good && c >= 0x20) {
            result.append(text, i, size);
        } else if (!good) {
            result += "\xef\xbf\xbd";
        } else {
            result += ' '; // control characters have no place in a name
        }
        i += good ? size : 1;
    }
    return result;
}

std::string name_of(const TDF_Label& label)
{
    Handle(TDataStd_Name) attribute;
    if (!label.FindAttribute(TDataStd_Name::GetID(), attribute))
        return {};
    const TCollection_ExtendedString& wide = attribute->Get();
    std::string text(static_cast<size_t>(wide.LengthOfCString()) + 1, '\0');
    Standard_PCharacter buffer = text.data();
    text.resize(static_cast<size_t>(wide.ToUTF8CString(buffer)));
    while (!text.empty() && text.back() == '\0')
        text.pop_back();
    return valid_utf8(text);
}

uint32_t pack_color(const Quantity_ColorRGBA& color)
{
    double r = 0, g = 0, b = 0;
    color.GetRGB().Values(r, g, b, Quantity_TOC_sRGB);
    const auto byte = [](double x) { return static_cast<uint32_t>(std::lround(std::clamp(x, 0.0, 1.0) * 255)); };
    return byte(r) | byte(g) << 8 | byte(b) << 16 | byte(color.Alpha()) << 24;
}

/// The colour of a label itself: of its surface, else the generic one.
std::optional<uint32_t> color_of(const Handle(XCAFDoc_ColorTool) & colors, const TDF_Label& label)
{
    Quantity_ColorRGBA color;
    if (colors->GetColor(label, XCAFDoc_ColorSurf, color) || colors->GetColor(label, XCAFDoc_ColorGen, color))
        return pack_color(color);
    return std::nullopt;
}

/// True if some face of the shape is placed twice: such a shape is cut into its sub-shapes, one part each.
bool repeats_a_face(const TopoDS_Shape& shape)
{
    TopTools_IndexedMapOfShape placed;
    TopExp::MapShapes(shape, TopAbs_FACE, placed);
    TopTools_MapOfShape unplaced;
    for (int i = 1; i <= placed.Extent(); ++i)
        if (!unplaced.Add(placed(i).Located(TopLoc_Location())))
            return true;
    return false;
}

bool has_faces(const TopoDS_Shape& shape)
{
    return TopExp_Explorer(shape, TopAbs_FACE).More();
}

/// What a shape's child inherits: its own colour and name if it has them, and those of its sub-shapes in its own axes.
PartShape look_of_child(const PartShape& look, const TopoDS_Shape& child)
{
    PartShape inner;
    inner.name = look.names.IsBound(child) ? look.names.Find(child) : look.name;
    inner.color_rgba = look.colors.IsBound(child) ? look.colors.Find(child) : look.color_rgba;
    const TopLoc_Location to_child = child.Location().Inverted();
    for (ShapeMap<uint32_t>::Iterator it(look.colors); it.More(); it.Next())
        inner.colors.Bind(it.Key().Located(to_child * it.Key().Location()), it.Value());
    for (ShapeMap<std::string>::Iterator it(look.names); it.More(); it.Next())
        inner.names.Bind(it.Key().Located(to_child * it.Key().Location()), it.Value());
    return inner;
}

/// Parts by the shape they are made of.
class PartTable {
public:
    explicit PartTable(LoadedFile& file) : file_(file) {}

    /// Places `shape` (with its location) under `node`; sub-shapes' colours and names are those of `look`.
    void place(const TopoDS_Shape& shape, const gp_Trsf& outer, const PartShape& look, const std::string& instance_name,
               const std::optional<uint32_t>& instance_color, uint32_t node)
    {
        if (!has_faces(shape))
            return;
        const gp_Trsf transform = outer * shape.Location().Transformation();
        const TopoDS_Shape bare = shape.Located(TopLoc_Location());
        const bool divisible = bare.ShapeType() == TopAbs_COMPOUND || bare.ShapeType() == TopAbs_COMPSOLID ||
                               bare.ShapeType() == TopAbs_SOLID || bare.ShapeType() == TopAbs_SHELL;
        if (divisible && !index_.IsBound(bare) && repeats_a_face(bare)) {
            for (TopoDS_Iterator it(bare, false); it.More(); it.Next()) {
                const PartShape inner = look_of_child(look, it.Value());
                place(it.Value(), transform, inner, instance_name, instance_color, node);
            }
            return;
        }
        uint32_t part = 0;
        if (!index_.Find(bare, part)) {
            part = static_cast<uint32_t>(file_.parts.size());
            index_.Bind(bare, part);
            PartShape added = look;
            added.shape = bare.Oriented(TopAbs_FORWARD);
            file_.parts.push_back(std::move(added));
        }
        CadInstance instance;
        instance.part = part;
        instance.transform = matrix_of(transform);
        instance.name = instance_name;
        instance.color_rgba = instance_color;
        instance.tree_node = node;
        file_.instances.push_back(std::move(instance));
    }

private:
    LoadedFile& file_;
    ShapeMap<uint32_t> index_;
};

/// The walk itself: one frame a label.
class Walker {
public:
    Walker(const Handle(TDocStd_Document) & document, LoadedFile& file)
        : shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
          colors_(XCAFDoc_DocumentTool::ColorTool(document->Main())), file_(file), parts_(file)
    {
    }

    Status run(const std::string& root_name)
    {
        TDF_LabelSequence roots;
        shapes_->GetFreeShapes(roots);
        file_.tree.push_back({0, root_name, std::nullopt});
        const bool single = roots.Length() == 1;
        if (single && !name_of(roots.First()).empty())
            file_.tree.front().name = name_of(roots.First());
        for (TDF_LabelSequence::Iterator it(roots); it.More(); it.Next()) {
            const uint32_t node = single ? 0 : add_node(0, name_of(it.Value()));
            walk(it.Value(), gp_Trsf(), node, std::nullopt, 0);
            if (failure_)
                return *failure_;
        }
        return Done{};
    }

private:
    uint32_t add_node(uint32_t parent, std::string name)
    {
        file_.tree.push_back({parent, std::move(name), std::nullopt});
        return static_cast<uint32_t>(file_.tree.size() - 1);
    }

    void walk(const TDF_Label& label, const gp_Trsf& transform, uint32_t node, std::optional<uint32_t> color, int depth)
    {
        if (depth > kMaxTreeDepth || file_.tree.size() > kMaxTreeNodes) {
            failure_ = Error{ErrorCode::InvalidCad, name_of(label),
                             fmt::format("the assembly is deeper than {} levels or has more than {} placements; it "
                                         "may hold itself",
                                         kMaxTreeDepth, kMaxTreeNodes)};
            return;
        }
        if (!XCAFDoc_ShapeTool::IsAssembly(label)) {
            place_simple(label, transform, node, color);
            return;
        }
        // an assembly's own colour is for what has none below it
        if (const std::optional<uint32_t> own = color_of(colors_, label); own && !color)
            color = file_.tree[node].color_rgba = own;
        TDF_LabelSequence components;
        XCAFDoc_ShapeTool::GetComponents(label, components);
        for (TDF_LabelSequence::Iterator it(components); it.More() && !failure_; it.Next()) {
            TDF_Label referred;
            if (!XCAFDoc_ShapeTool::GetReferredShape(it.Value(), referred))
                continue;
            std::string name = name_of(it.Value());
            if (name.empty())
                name = name_of(referred);
            const uint32_t child = add_node(node, std::move(name));
            const std::optional<uint32_t> own = color_of(colors_, it.Value());
            file_.tree[child].color_rgba = own;
            walk(referred, transform * XCAFDoc_ShapeTool::GetLocation(it.Value()).Transformation(), child,
                 own ? own : color, depth + 1);
        }
    }

    void place_simple(const TDF_Label& label, const gp_Trsf& transform, uint32_t node,
                      const std::optional<uint32_t>& color)
    {
        const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(label);
        if (shape.IsNull())
            return;
        PartShape look;
        look.name = name_of(label);
        look.color_rgba = color_of(colors_, label);
        TDF_LabelSequence subshapes;
        XCAFDoc_ShapeTool::GetSubShapes(label, subshapes);
        const TopLoc_Location to_part = shape.Location().Inverted();
        for (TDF_LabelSequence::Iterator it(subshapes); it.More(); it.Next()) {
            TopoDS_Shape sub = XCAFDoc_ShapeTool::GetShape(it.Value());
            if (sub.IsNull())
                continue;
            if (!to_part.IsIdentity())
                sub.Location(to_part * sub.Location());
            if (const std::optional<uint32_t> own = color_of(colors_, it.Value()))
                look.colors.Bind(sub, *own);
            if (std::string name = name_of(it.Value()); !name.empty())
                look.names.Bind(sub, std::move(name));
        }
        parts_.place(shape, transform, look, file_.tree[node].name, color, node);
    }

    Handle(XCAFDoc_ShapeTool) shapes_;
    Handle(XCAFDoc_ColorTool) colors_;
    LoadedFile& file_;
    PartTable parts_;
    std::optional<Error> failure_;
};

} // namespace

Status walk_document(const Handle(TDocStd_Document) & document, const std::string& root_name, LoadedFile& file)
{
    return Walker(document, file).run(root_name);
}

Status add_bare_shape(const TopoDS_Shape& shape, const std::string& name, LoadedFile& file)
{
    file.tree.push_back({0, name, std::nullopt});
    PartShape look;
    look.name = name;
    PartTable(file).place(shape, gp_Trsf(), look, name, std::nullopt, 0);
    return Done{};
}

} // namespace trimray::kernel
