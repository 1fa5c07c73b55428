// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "alidade/model/plugin_abi.h"

namespace alidade::testing {

/// Values of y = x (+) d, computed with 40 digits from the formulas of plugin_abi.h. These values
/// fix the formulas, which are compiled into every plugin. A host with other formulas would
/// misinterpret the tangents of a plugin.
struct PlusOfGeometry {
  std::uint32_t geometry;
  std::array<double, 4> x;
  std::array<double, 3> d;
  std::array<double, 4> y;
};

inline constexpr PlusOfGeometry kPlusOfGeometries[] = {
    {ALIDADE_VECTOR, {1.5, -2.0, 0.25}, {0.5, 0.125, -0.25}, {2.0, -1.875, 0.0}},
    {ALIDADE_VECTOR, {0.1}, {0.2}, {0.30000000000000004}},
    {ALIDADE_VECTOR, {-1e300}, {1.0}, {-1e300}},
    {ALIDADE_VECTOR, {0.0, 1.0}, {1.0, -1.0}, {1.0, 0.0}},
    {ALIDADE_ANGLE, {3.0}, {0.5}, {-2.7831853071795867}},
    {ALIDADE_ANGLE, {-3.0}, {-0.5}, {2.7831853071795867}},
    {ALIDADE_ANGLE, {0.25}, {0.125}, {0.375}},
    {ALIDADE_ANGLE, {1.0}, {3.0}, {-2.2831853071795867}},
    {ALIDADE_UNIT_QUATERNION,
     {1.0, 0.0, 0.0, 0.0},
     {0.1, -0.2, 0.3},
     {0.9825509821552589, 0.04970884332485948, -0.09941768664971896, 0.14912652997457843}},
    {ALIDADE_UNIT_QUATERNION,
     {0.18257418583505536, 0.3651483716701107, 0.5477225575051661, 0.7302967433402214},
     {0.5, 0.25, -1.0},
     {0.3477769646923754, 0.004545150451266228, 0.8273906506604122, 0.44097078773596027}},
    {ALIDADE_UNIT_QUATERNION,
     {-0.3077935056255462, 0.10259783520851541, -0.9233805168766387, 0.20519567041703082},
     {3.0, 0.2, -0.1},
     {-0.054523763254083576, -0.2824147820282337, 0.12567508493132173, 0.9494602799275297}},
    {ALIDADE_UNIT_QUATERNION,
     {0.0, 0.0, 1.0, 0.0},
     {0.001, 0.002, -0.001},
     {-0.0009999997500000188, -0.0004999998750000094, 0.9999992500000937, -0.0004999998750000094}},
    {ALIDADE_UNIT_VECTOR,
     {0.0, 0.0, 1.0},
     {0.1, -0.2},
     {0.09916874752156282, -0.19833749504312564, 0.9751039932104794}},
    {ALIDADE_UNIT_VECTOR,
     {0.0, 0.0, -1.0},
     {0.1, -0.2},
     {0.09916874752156282, 0.19833749504312564, -0.9751039932104794}},
    {ALIDADE_UNIT_VECTOR,
     {0.2672612419124244, 0.5345224838248488, -0.8017837257372732},
     {1.5, 0.5},
     {0.9333328309890276, -0.346810310006811, 0.09280320830115105}},
    {ALIDADE_UNIT_VECTOR,
     {0.9486832980505138, -0.31622776601683794, -0.0},
     {-0.7, 2.0},
     {-0.28090527336826654, 0.805218379383703, 0.5222217813310571}},
};

}  // namespace alidade::testing
