// SPDX-License-Identifier: Apache-2.0
#include "body_velocity.h"

#include <string>

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

template <int D, int M>
void Emplace(const std::string& letters, Params& p, AlidadeInstance* instance) {
  std::array<int, M> axes{};
  for (std::size_t i = 0; i < axes.size(); ++i) axes[i] = letters[i] - 'x';
  using Model = BodyVelocity<D, M>;
  EmplaceSensor(Model(axes, p), instance);
}

/// Returns true if the letters are distinct axes of D dimensions in their order.
template <int D>
bool AreAxes(const std::string& letters) {
  for (std::size_t i = 0; i < letters.size(); ++i) {
    if (letters[i] < 'x' || letters[i] >= 'x' + D || (i > 0 && letters[i] <= letters[i - 1]))
      return false;
  }
  return !letters.empty();
}

void Make(Params& p, AlidadeInstance* instance) {
  BoundRoles(p).VisitSize<2, 3>("velocity", [&](auto size) {
    constexpr int kDimensions = size();
    const std::string all = std::string("xyz").substr(0, kDimensions);
    const std::string axes = p.Text("axes", "measured axes of the sensor, such as x or xy", all);
    if (!AreAxes<kDimensions>(axes)) {
      p.Fail("axes", ("is '" + axes + "'; expected letters of " + all + " in their order").c_str());
    } else if (axes.size() == 1) {
      Emplace<kDimensions, 1>(axes, p, instance);
    } else if (axes.size() == 2) {
      Emplace<kDimensions, 2>(axes, p, instance);
    } else if constexpr (kDimensions == 3) {
      Emplace<3, 3>(axes, p, instance);
    }
  });
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "body_velocity",
                                 "velocity of a point on a body, in the frame of the sensor",
                                 "[Groves2013] sec. 6.4, 15.4.1"))
