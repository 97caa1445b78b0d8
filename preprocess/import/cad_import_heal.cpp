// What the kernel does to shapes between transfer and us. Its own healing takes half of a transfer; the steps that make
// 3D curves, tolerances and shells agree are left out by default, since only surfaces and pcurves go on from here.
#include "preprocess/import/cad_import_kernel.h"

#include <ShapeExtend_MsgRegistrator.hxx>
#include <ShapeFix_Shape.hxx>
#include <ShapeFix_Shell.hxx>
#include <ShapeFix_Solid.hxx>
#include <ShapeFix_Wire.hxx>
#include <ShapeProcess_ShapeContext.hxx>
#include <XSAlgo.hxx>
#include <XSAlgo_AlgoContainer.hxx>

namespace trimray::kernel {
namespace {

class FastHealing : public XSAlgo_AlgoContainer {
public:
    TopoDS_Shape ProcessShape(const TopoDS_Shape& shape, const Standard_Real precision,
                              const Standard_Real max_tolerance, const Standard_CString resource,
                              const Standard_CString, Handle(Standard_Transient) & info,
                              const Message_ProgressRange& progress, const Standard_Boolean non_manifold) const override
    {
        if (shape.IsNull())
            return shape;
        const Handle(ShapeProcess_ShapeContext) context = new ShapeProcess_ShapeContext(shape, resource);
        context->SetDetalisation(TopAbs_EDGE);
        context->SetNonManifold(non_manifold);
        info = context;

        const Handle(ShapeExtend_MsgRegistrator) messages = new ShapeExtend_MsgRegistrator;
        const Handle(ShapeFix_Shape) fix = new ShapeFix_Shape(shape);
        fix->SetMsgRegistrator(messages);
        fix->SetPrecision(precision);
        fix->SetMinTolerance(1e-7);
        fix->SetMaxTolerance(max_tolerance);
        fix->FixSameParameterMode() = 0; // 3D curves are not used, only pcurves
        fix->FixVertexTolMode() = 0;
        fix->FixSolidTool()->FixShellOrientationMode() = 0; // faces are shaded from both sides
        fix->FixSolidTool()->CreateOpenSolidMode() = false;
        fix->FixShellTool()->FixOrientationMode() = 0;
        // self-intersections and loops that touch themselves stay in: they cost a fifth of the transfer and split faces
        const Handle(ShapeFix_Wire) wire = fix->FixWireTool();
        wire->FixNotchedEdgesMode() = 0;
        wire->FixTailMode() = 0;
        wire->FixSameParameterMode() = 0;
        wire->FixVertexToleranceMode() = 0;
        fix->Perform(progress);
        if (!fix->Shape().IsNull() && !fix->Shape().IsSame(shape)) {
            context->RecordModification(fix->Context(), messages);
            context->SetResult(fix->Shape());
        }
        return context->Result();
    }
};

} // namespace

HealingPolicy::HealingPolicy(bool full) : saved_(XSAlgo::AlgoContainer())
{
    if (!full)
        XSAlgo::SetAlgoContainer(new FastHealing);
}

HealingPolicy::~HealingPolicy()
{
    XSAlgo::SetAlgoContainer(saved_);
}

} // namespace trimray::kernel
