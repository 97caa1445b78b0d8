// Eight doubles, for what all rays of a block have in common. Included once per target.
#if defined(TRIMRAY_CPU_DOUBLE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_DOUBLE_H
#undef TRIMRAY_CPU_DOUBLE_H
#else
#define TRIMRAY_CPU_DOUBLE_H
#endif

#include "shaders/shared/language.h"

#include <cstdint>

SHARED_OPEN

constexpr int kDoubles = 8;
using DoubleTag = hn::CappedTag<double, kDoubles>;
constexpr int kDoublePartLanes = static_cast<int>(hn::MaxLanes(DoubleTag()));
constexpr int kDoubleParts = kDoubles / kDoublePartLanes;
#define TRIMRAY_EACH_DOUBLE_PART _Pragma("GCC unroll 8") for (int i = 0; i < kDoubleParts; ++i)

struct doubles {
    hn::Vec<DoubleTag> v[kDoubleParts];
    HWY_INLINE doubles() = default;
    HWY_INLINE doubles(double x) { TRIMRAY_EACH_DOUBLE_PART v[i] = hn::Set(DoubleTag(), x); }
};

struct doubles_mask {
    hn::Mask<DoubleTag> v[kDoubleParts];
};

#define TRIMRAY_DOUBLES_BINARY(name, type, function)                                                                   \
    FN type name(type a, type b)                                                                                       \
    {                                                                                                                  \
        type r;                                                                                                        \
        TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::function(a.v[i], b.v[i]);                                                \
        return r;                                                                                                      \
    }
TRIMRAY_DOUBLES_BINARY(operator+, doubles, Add)
TRIMRAY_DOUBLES_BINARY(operator-, doubles, Sub)
TRIMRAY_DOUBLES_BINARY(operator*, doubles, Mul)
TRIMRAY_DOUBLES_BINARY(operator/, doubles, Div)
TRIMRAY_DOUBLES_BINARY(min, doubles, Min)
TRIMRAY_DOUBLES_BINARY(max, doubles, Max)
TRIMRAY_DOUBLES_BINARY(operator&&, doubles_mask, And)
#undef TRIMRAY_DOUBLES_BINARY

FN doubles abs(doubles a)
{
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::Abs(a.v[i]);
    return r;
}
FN doubles_mask operator<(doubles a, doubles b)
{
    doubles_mask r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::Lt(a.v[i], b.v[i]);
    return r;
}
FN doubles_mask operator>(doubles a, doubles b)
{
    return b < a;
}
FN doubles_mask operator>=(doubles a, doubles b)
{
    doubles_mask r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::Le(b.v[i], a.v[i]);
    return r;
}
FN doubles select(doubles_mask m, doubles a, doubles b)
{
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::IfThenElse(m.v[i], a.v[i], b.v[i]);
    return r;
}

/// Bit i is lane i.
FN uint lane_bits(doubles_mask a)
{
    uint bits = 0;
    TRIMRAY_EACH_DOUBLE_PART
    {
        std::uint8_t part[8] = {};
        hn::StoreMaskBits(DoubleTag(), a.v[i], part);
        bits |= (part[0] & ((1u << kDoublePartLanes) - 1u)) << (i * kDoublePartLanes);
    }
    return bits;
}

FN doubles load_floats(const float* p)
{
    const hn::Rebind<float, DoubleTag> floats;
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::PromoteTo(DoubleTag(), hn::LoadU(floats, p + i * kDoublePartLanes));
    return r;
}
FN doubles load_bytes(const std::uint8_t* p)
{
    const hn::Rebind<std::int32_t, DoubleTag> integers;
    const hn::Rebind<std::uint8_t, DoubleTag> bytes;
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] =
        hn::PromoteTo(DoubleTag(), hn::PromoteTo(integers, hn::LoadU(bytes, p + i * kDoublePartLanes)));
    return r;
}
FN void store_floats(doubles a, float* p)
{
    const hn::Rebind<float, DoubleTag> floats;
    TRIMRAY_EACH_DOUBLE_PART hn::StoreU(hn::DemoteTo(floats, a.v[i]), floats, p + i * kDoublePartLanes);
}
/// Each rounded to single precision.
FN doubles as_floats(doubles a)
{
    const hn::Rebind<float, DoubleTag> floats;
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::PromoteTo(DoubleTag(), hn::DemoteTo(floats, a.v[i]));
    return r;
}
/// a in the lower four lanes, b in the upper.
FN doubles halves(double a, double b)
{
    const double both[kDoubles] = {a, a, a, a, b, b, b, b};
    doubles r;
    TRIMRAY_EACH_DOUBLE_PART r.v[i] = hn::LoadU(DoubleTag(), both + i * kDoublePartLanes);
    return r;
}

struct doubles3 {
    doubles x, y, z;
};
FN doubles dot(const double (&a)[3], const doubles3& b)
{
    return a[0] * b.x + a[1] * b.y + a[2] * b.z;
}

#undef TRIMRAY_EACH_DOUBLE_PART

SHARED_CLOSE
#endif
