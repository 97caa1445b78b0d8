// The C++ side of language.h: 16 lanes over Highway vectors. Included once per target by language.h.
#if defined(TRIMRAY_SHARED_LANGUAGE_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LANGUAGE_LANES_H
#undef TRIMRAY_SHARED_LANGUAGE_LANES_H
#else
#define TRIMRAY_SHARED_LANGUAGE_LANES_H
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#undef SHARED_OPEN
#undef SHARED_CLOSE
#undef FN
#undef FN_LARGE
#define SHARED_OPEN                                                                                                    \
    HWY_BEFORE_NAMESPACE();                                                                                            \
    namespace trimray {                                                                                                \
    namespace HWY_NAMESPACE {
#define SHARED_CLOSE                                                                                                   \
    }                                                                                                                  \
    }                                                                                                                  \
    HWY_AFTER_NAMESPACE();
#define FN [[maybe_unused]] static HWY_INLINE HWY_ATTR
#define FN_LARGE [[maybe_unused]] static HWY_NOINLINE HWY_ATTR
#ifndef PRECISE
#define PRECISE // the C++ side is compiled with -ffp-contract=off
#define STOP_PAST_DEGREES(i)
#define FETCH_PARAM const FetchSource &source,
#define FETCH_PASS source,
#define INOUT_ARRAY(name, count) real(&name)[count]
#define TRIMRAY_EACH_PART _Pragma("GCC unroll 16") for (int i = 0; i < kParts; ++i)
#endif

SHARED_OPEN

using uint = std::uint32_t;
using scalar = float;
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kLanes = 16;
using RealTag = hn::CappedTag<float, kLanes>;
using IntegerTag = hn::RebindToUnsigned<RealTag>;
using SignedTag = hn::RebindToSigned<RealTag>;
constexpr int kPartLanes = static_cast<int>(hn::MaxLanes(RealTag()));
constexpr int kParts = kLanes / kPartLanes; // registers for the 16 lanes

struct mask {
    hn::Mask<RealTag> v[kParts];
    HWY_INLINE mask() = default;
    HWY_INLINE explicit mask(bool all)
    {
        TRIMRAY_EACH_PART v[i] =
            hn::RebindMask(RealTag(), all ? hn::Eq(hn::Zero(IntegerTag()), hn::Zero(IntegerTag()))
                                          : hn::Ne(hn::Zero(IntegerTag()), hn::Zero(IntegerTag())));
    }
};

struct real {
    hn::Vec<RealTag> v[kParts];
    HWY_INLINE real() = default;
    HWY_INLINE real(float x) { TRIMRAY_EACH_PART v[i] = hn::Set(RealTag(), x); }
};

struct integer {
    hn::Vec<IntegerTag> v[kParts];
    HWY_INLINE integer() = default;
    HWY_INLINE integer(uint x) { TRIMRAY_EACH_PART v[i] = hn::Set(IntegerTag(), x); }
};

#define TRIMRAY_BINARY(type, op, function)                                                                             \
    FN type operator op(type a, type b)                                                                                \
    {                                                                                                                  \
        type r;                                                                                                        \
        TRIMRAY_EACH_PART r.v[i] = hn::function(a.v[i], b.v[i]);                                                       \
        return r;                                                                                                      \
    }
TRIMRAY_BINARY(real, +, Add)
TRIMRAY_BINARY(real, -, Sub)
TRIMRAY_BINARY(real, *, Mul)
TRIMRAY_BINARY(real, /, Div)
TRIMRAY_BINARY(integer, +, Add)
TRIMRAY_BINARY(integer, -, Sub)
TRIMRAY_BINARY(integer, *, Mul)
TRIMRAY_BINARY(integer, &, And)
TRIMRAY_BINARY(integer, |, Or)
TRIMRAY_BINARY(mask, &&, And)
TRIMRAY_BINARY(mask, ||, Or)
#undef TRIMRAY_BINARY

#define TRIMRAY_COMPARE(op, function, first, second)                                                                   \
    FN mask operator op(real a, real b)                                                                                \
    {                                                                                                                  \
        mask r;                                                                                                        \
        TRIMRAY_EACH_PART r.v[i] = hn::function(first.v[i], second.v[i]);                                              \
        return r;                                                                                                      \
    }
TRIMRAY_COMPARE(<, Lt, a, b)
TRIMRAY_COMPARE(<=, Le, a, b)
TRIMRAY_COMPARE(>, Lt, b, a)
TRIMRAY_COMPARE(>=, Le, b, a)
TRIMRAY_COMPARE(==, Eq, a, b)
#undef TRIMRAY_COMPARE

FN mask operator==(integer a, integer b)
{
    mask r;
    TRIMRAY_EACH_PART r.v[i] = hn::RebindMask(RealTag(), hn::Eq(a.v[i], b.v[i]));
    return r;
}
FN mask operator<(integer a, integer b)
{
    mask r;
    TRIMRAY_EACH_PART r.v[i] = hn::RebindMask(RealTag(), hn::Lt(a.v[i], b.v[i]));
    return r;
}
FN mask operator!(mask a)
{
    mask r;
    TRIMRAY_EACH_PART r.v[i] = hn::Not(a.v[i]);
    return r;
}
FN mask operator!=(integer a, integer b)
{
    return !(a == b);
}
FN mask differ(mask a, mask b)
{
    mask r;
    TRIMRAY_EACH_PART r.v[i] = hn::Xor(a.v[i], b.v[i]);
    return r;
}
FN bool any_lane(mask a)
{
    hn::Mask<RealTag> any = a.v[0];
    for (int i = 1; i < kParts; ++i)
        any = hn::Or(any, a.v[i]);
    return !hn::AllFalse(RealTag(), any);
}

FN scalar largest_lane(real a)
{
    hn::Vec<RealTag> largest = a.v[0];
    for (int i = 1; i < kParts; ++i)
        largest = hn::Max(largest, a.v[i]);
    return hn::GetLane(hn::MaxOfLanes(RealTag(), largest));
}

/// Bit i is lane i.
FN uint lane_bits(mask a)
{
    uint bits = 0;
    TRIMRAY_EACH_PART
    {
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(RealTag(), a.v[i], bytes);
        std::uint16_t part;
        std::memcpy(&part, bytes, sizeof part);
        bits |= static_cast<uint>(part & ((1u << kPartLanes) - 1u)) << (i * kPartLanes);
    }
    return bits;
}
FN integer lane_numbers()
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::Iota(IntegerTag(), static_cast<uint>(i * kPartLanes));
    return r;
}

#define TRIMRAY_UNARY(name, function)                                                                                  \
    FN real name(real a)                                                                                               \
    {                                                                                                                  \
        real r;                                                                                                        \
        TRIMRAY_EACH_PART r.v[i] = hn::function(a.v[i]);                                                               \
        return r;                                                                                                      \
    }
TRIMRAY_UNARY(operator-, Neg)
TRIMRAY_UNARY(abs, Abs)
TRIMRAY_UNARY(sqrt, Sqrt)
TRIMRAY_UNARY(floor, Floor)
#undef TRIMRAY_UNARY

// of NaN and a number: the second argument, on every instruction set
FN real min(real a, real b)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::IfThenElse(hn::Lt(a.v[i], b.v[i]), a.v[i], b.v[i]);
    return r;
}
FN real max(real a, real b)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::IfThenElse(hn::Lt(b.v[i], a.v[i]), a.v[i], b.v[i]);
    return r;
}
FN scalar min(scalar a, scalar b)
{
    return a < b ? a : b;
}
FN scalar max(scalar a, scalar b)
{
    return a > b ? a : b;
}
FN real clamp(real x, real lo, real hi)
{
    return min(max(x, lo), hi);
}

FN integer min(integer a, integer b)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::Min(a.v[i], b.v[i]);
    return r;
}
FN integer max(integer a, integer b)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::Max(a.v[i], b.v[i]);
    return r;
}
FN integer operator>>(integer a, integer b)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::Shr(a.v[i], b.v[i]);
    return r;
}
FN integer operator<<(integer a, integer b)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::Shl(a.v[i], b.v[i]);
    return r;
}
/// The lanes whose bits are set.
FN mask lanes_of(uint bits)
{
    return ((integer(bits) >> lane_numbers()) & integer(1u)) == integer(1u);
}
FN integer to_integer(real x)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::BitCast(IntegerTag(), hn::ConvertTo(SignedTag(), x.v[i]));
    return r;
}
FN real to_real(integer x)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::ConvertTo(RealTag(), hn::BitCast(SignedTag(), x.v[i]));
    return r;
}

FN real select(mask m, real a, real b)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::IfThenElse(m.v[i], a.v[i], b.v[i]);
    return r;
}
FN integer select(mask m, integer a, integer b)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::IfThenElse(hn::RebindMask(IntegerTag(), m.v[i]), a.v[i], b.v[i]);
    return r;
}
FN mask select(mask m, mask a, mask b)
{
    return (m && a) || (!m && b);
}

FN real load(const float* p)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::LoadU(RealTag(), p + i * kPartLanes);
    return r;
}
FN integer load(const uint* p)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::LoadU(IntegerTag(), p + i * kPartLanes);
    return r;
}
FN void store(real a, float* p)
{
    TRIMRAY_EACH_PART hn::StoreU(a.v[i], RealTag(), p + i * kPartLanes);
}
FN void store(integer a, uint* p)
{
    TRIMRAY_EACH_PART hn::StoreU(a.v[i], IntegerTag(), p + i * kPartLanes);
}
/// Lane by lane, its values beside each other.
FN void store_interleaved(real a, real b, float* p)
{
    TRIMRAY_EACH_PART hn::StoreInterleaved2(a.v[i], b.v[i], RealTag(), p + 2 * i * kPartLanes);
}
FN void store_interleaved(real a, real b, real c, float* p)
{
    TRIMRAY_EACH_PART hn::StoreInterleaved3(a.v[i], b.v[i], c.v[i], RealTag(), p + 3 * i * kPartLanes);
}
FN void store_interleaved(real a, real b, real c, real d, float* p)
{
    TRIMRAY_EACH_PART hn::StoreInterleaved4(a.v[i], b.v[i], c.v[i], d.v[i], RealTag(), p + 4 * i * kPartLanes);
}
/// Elements base[index]; every lane's index must be in range and below 2^31.
FN real gather(const float* base, integer index)
{
    real r;
    TRIMRAY_EACH_PART r.v[i] = hn::GatherIndex(RealTag(), base, hn::BitCast(SignedTag(), index.v[i]));
    return r;
}
FN integer gather(const uint* base, integer index)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::GatherIndex(IntegerTag(), base, hn::BitCast(SignedTag(), index.v[i]));
    return r;
}

/// Words whose lowest byte is byte `at` from base on, at any offset.
FN integer gather_bytes(const uint* base, integer at)
{
    integer r;
    TRIMRAY_EACH_PART r.v[i] = hn::GatherOffset(IntegerTag(), base, hn::BitCast(SignedTag(), at.v[i]));
    return r;
}

/// Lane i is lane `from` of i of `values`; every lane of `from` must be below kLanes.
FN real lanes_from(real values, integer from)
{
    real r;
    TRIMRAY_EACH_PART
    {
        const auto within = hn::And(from.v[i], hn::Set(IntegerTag(), static_cast<uint>(kPartLanes - 1)));
        const auto lane = hn::IndicesFromVec(RealTag(), within);
        r.v[i] = hn::TableLookupLanes(values.v[0], lane);
        for (int part = 1; part < kParts; ++part) {
            const auto there =
                hn::Eq(hn::Sub(from.v[i], within), hn::Set(IntegerTag(), static_cast<uint>(part * kPartLanes)));
            r.v[i] =
                hn::IfThenElse(hn::RebindMask(RealTag(), there), hn::TableLookupLanes(values.v[part], lane), r.v[i]);
        }
    }
    return r;
}

FN scalar bits_to_scalar(uint bits)
{
    scalar x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
}
FN scalar scalar_pow(scalar x, scalar y)
{
    return __builtin_powf(x, y);
}
FN scalar sqrt(scalar x)
{
    return __builtin_sqrtf(x);
}

struct scalar2 {
    scalar x, y;
    HWY_INLINE scalar2() = default;
    HWY_INLINE scalar2(scalar x_, scalar y_) : x(x_), y(y_) {}
};
struct scalar3 {
    scalar x, y, z;
    HWY_INLINE scalar3() = default;
    HWY_INLINE scalar3(scalar x_, scalar y_, scalar z_) : x(x_), y(y_), z(z_) {}
};
struct real2 {
    real x, y;
    HWY_INLINE real2() = default;
    HWY_INLINE real2(real x_, real y_) : x(x_), y(y_) {}
    HWY_INLINE real2(scalar2 s) : x(s.x), y(s.y) {}
};
struct real3 {
    real x, y, z;
    HWY_INLINE real3() = default;
    HWY_INLINE real3(real x_, real y_, real z_) : x(x_), y(y_), z(z_) {}
    HWY_INLINE real3(scalar3 s) : x(s.x), y(s.y), z(s.z) {}
};
FN scalar3 first_lane(real3 a)
{
    return scalar3(hn::GetLane(a.x.v[0]), hn::GetLane(a.y.v[0]), hn::GetLane(a.z.v[0]));
}
FN scalar3 operator+(scalar3 a, scalar3 b)
{
    return scalar3(a.x + b.x, a.y + b.y, a.z + b.z);
}
FN scalar3 operator-(scalar3 a, scalar3 b)
{
    return scalar3(a.x - b.x, a.y - b.y, a.z - b.z);
}
FN scalar3 operator*(scalar3 a, scalar b)
{
    return scalar3(a.x * b, a.y * b, a.z * b);
}
FN scalar3 operator*(scalar b, scalar3 a)
{
    return a * b;
}
FN scalar dot(scalar3 a, scalar3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
FN scalar3 cross(scalar3 a, scalar3 b)
{
    return scalar3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
FN real2 operator+(real2 a, real2 b)
{
    return real2(a.x + b.x, a.y + b.y);
}
FN real2 operator-(real2 a, real2 b)
{
    return real2(a.x - b.x, a.y - b.y);
}
FN real2 operator*(real2 a, real b)
{
    return real2(a.x * b, a.y * b);
}
FN real2 operator*(real2 a, real2 b)
{
    return real2(a.x * b.x, a.y * b.y);
}
FN real3 operator+(real3 a, real3 b)
{
    return real3(a.x + b.x, a.y + b.y, a.z + b.z);
}
FN real3 operator-(real3 a, real3 b)
{
    return real3(a.x - b.x, a.y - b.y, a.z - b.z);
}
FN real3 operator-(real3 a)
{
    return real3(-a.x, -a.y, -a.z);
}
FN real3 operator*(real3 a, real b)
{
    return real3(a.x * b, a.y * b, a.z * b);
}
FN real3 operator*(real a, real3 b)
{
    return b * a;
}
FN real dot(real3 a, real3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
FN real dot(real2 a, real2 b)
{
    return a.x * b.x + a.y * b.y;
}
FN real length(real3 a)
{
    return sqrt(dot(a, a));
}
FN real length(real2 a)
{
    return sqrt(dot(a, a));
}
FN real3 cross(real3 a, real3 b)
{
    return real3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
FN real3 lanes_from(real3 values, integer from)
{
    return real3(lanes_from(values.x, from), lanes_from(values.y, from), lanes_from(values.z, from));
}
FN real2 select(mask m, real2 a, real2 b)
{
    return real2(select(m, a.x, b.x), select(m, a.y, b.y));
}
FN real3 select(mask m, real3 a, real3 b)
{
    return real3(select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z));
}

SHARED_CLOSE
#endif
