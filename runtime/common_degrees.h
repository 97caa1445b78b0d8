// The degrees that models' Bezier patches are made of, for which loops over control points are compiled apart.
#pragma once

#include "format/pack_layout.h"

namespace trimray {

/// `of`<degree_u, degree_v, rational>() for a patch of this shape (PatchRecord) if its degrees are common, else with
/// both degrees 0.
template <class Of>
auto by_common_degrees(uint shape, Of of)
{
    const auto of_degrees = [&]<bool rational>() {
        switch ((shape & 0xff00u) | (shape >> 16 & 0xffu)) { // u, v
        case 0x0101:
            return of.template operator()<1, 1, rational>();
        case 0x0102:
            return of.template operator()<1, 2, rational>();
        case 0x0201:
            return of.template operator()<2, 1, rational>();
        case 0x0103:
            return of.template operator()<1, 3, rational>();
        case 0x0301:
            return of.template operator()<3, 1, rational>();
        case 0x0202:
            return of.template operator()<2, 2, rational>();
        case 0x0203:
            return of.template operator()<2, 3, rational>();
        case 0x0302:
            return of.template operator()<3, 2, rational>();
        case 0x0303:
            return of.template operator()<3, 3, rational>();
        default:
            return of.template operator()<0, 0, rational>();
        }
    };
    return (shape & kShapeRational) != 0 ? of_degrees.template operator()<true>()
                                         : of_degrees.template operator()<false>();
}

} // namespace trimray
