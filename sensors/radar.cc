// SPDX-License-Identifier: Apache-2.0
#include "radar.h"

#include <optional>

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

/// Standard deviations of the measured quantities.
struct Sigmas {
  std::optional<double> range, azimuth, elevation, rate;
};

template <int D, bool kRange, bool kAngles, bool kRate>
void Emplace(const Sigmas& sigmas, AlidadeInstance* instance) {
  using Model = Radar<D, kRange, kAngles, kRate>;
  std::array<double, Model::kSize> sigma{};
  std::size_t i = 0;
  for (const auto& value : {sigmas.range, sigmas.azimuth, sigmas.elevation, sigmas.rate}) {
    if (value && i < sigma.size()) sigma[i++] = *value;
  }
  EmplaceSensor(Model(sigma), instance);
}

template <int D>
void Select(const Sigmas& sigmas, Params& p, AlidadeInstance* instance) {
  const bool has_range = sigmas.range.has_value(), has_rate = sigmas.rate.has_value();
  if (D == 3 && sigmas.azimuth.has_value() != sigmas.elevation.has_value()) {
    p.Fail("",
           "in space, azimuth and elevation are measured together; expected both of "
           "sigma_azimuth_rad and sigma_elevation_rad, or neither");
  } else if (sigmas.azimuth) {
    if (has_range && has_rate) return Emplace<D, true, true, true>(sigmas, instance);
    if (has_range) return Emplace<D, true, true, false>(sigmas, instance);
    if (has_rate) return Emplace<D, false, true, true>(sigmas, instance);
    Emplace<D, false, true, false>(sigmas, instance);
  } else if (has_range && has_rate) {
    Emplace<D, true, false, true>(sigmas, instance);
  } else if (has_range) {
    Emplace<D, true, false, false>(sigmas, instance);
  } else if (has_rate) {
    Emplace<D, false, false, true>(sigmas, instance);
  } else {
    p.Fail("",
           "the radar measures nothing; expected sigma_range_m, sigma_azimuth_rad or "
           "sigma_range_rate_m_s");
    // An instance of all quantities, from which the host reads the roles.
    Emplace<D, true, true, true>(sigmas, instance);
  }
}

void Make(Params& p, AlidadeInstance* instance) {
  const auto sigma = [&](const char* key, const char* unit, const char* doc) {
    return p.NumberOrNone(key, unit, doc, kPositive);
  };
  BoundRoles(p).VisitSize<2, 3>("position", [&](auto size) {
    Sigmas sigmas;
    sigmas.range = sigma("sigma_range_m", "m", "standard deviation of the range; none: no range");
    sigmas.azimuth =
        sigma("sigma_azimuth_rad", "rad", "standard deviation of the azimuth; none: no azimuth");
    if (size() == 3) {
      sigmas.elevation = sigma("sigma_elevation_rad", "rad",
                               "standard deviation of the elevation; none: no elevation");
    }
    sigmas.rate = sigma("sigma_range_rate_m_s", "m/s",
                        "standard deviation of the range rate; none: no range rate");
    Select<size()>(sigmas, p, instance);
  });
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "radar",
                                 "range, direction and range rate of a target",
                                 "[BarShalom2001] sec. 10.4"))
