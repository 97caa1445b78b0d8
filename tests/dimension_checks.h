// What tests of measurements share: a dimension by its kind among those found.
#pragma once

#include "runtime/view/dimensions.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <optional>
#include <vector>

namespace trimray {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRounded_mm = 2e-6; // of a part of 20 mm, single precision

using Placement = std::array<double, 12>;
inline constexpr Placement kWhereItIs{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

inline std::optional<Dimension> find(const std::vector<Dimension>& all, DimensionKind kind)
{
    for (const Dimension& d : all)
        if (d.kind == kind)
            return d;
    return std::nullopt;
}
#define EXPECT_DIMENSION(all, kind_, expected, within)                                                                 \
    do {                                                                                                               \
        const auto found_ = find(all, DimensionKind::kind_);                                                           \
        EXPECT_TRUE(found_) << "no " << name_of(DimensionKind::kind_);                                                 \
        if (found_) {                                                                                                  \
            EXPECT_NEAR(found_->value, expected, within) << name_of(DimensionKind::kind_);                             \
        }                                                                                                              \
    } while (false)
#define EXPECT_NO_DIMENSION(all, kind_) EXPECT_FALSE(find(all, DimensionKind::kind_))

/// It is as long as its anchors are apart.
inline void expect_anchored(const std::optional<Dimension>& d)
{
    ASSERT_TRUE(d);
    ASSERT_EQ(d->anchors_mm.size(), 2u);
    EXPECT_NEAR(reference::length(reference::operator-(d->anchors_mm[1], d->anchors_mm[0])), std::abs(d->value),
                1e-9 * (1 + std::abs(d->value)));
}

} // namespace trimray
