// SPDX-License-Identifier: Apache-2.0
// Models that fail while they are created.
#include <stdexcept>

#include "alidade/plugin.h"
#include "probe.h"

struct Throws : Probe {
  explicit Throws(alidade::Params& p) : Probe(p) { throw std::runtime_error("the dog ate it"); }
};
struct ThrowsInt : Probe {
  explicit ThrowsInt(alidade::Params& p) : Probe(p) { throw 42; }
};
struct Misfit : Probe {
  explicit Misfit(alidade::Params& p) : Probe(p) {
    const double near_m = p.Positive("near_m", "m", ""), far_m = p.Positive("far_m", "m", "");
    if (!(near_m < far_m)) p.Fail("far_m", "is not beyond near_m");
    if (near_m == 13.0) p.Fail("", "near and far are unlucky together");
  }
};

namespace {

void MakeWrongKind(alidade::Params& p, AlidadeInstance* instance) {
  alidade::EmplaceSensor<Probe>(p, instance);
  instance->kind = ALIDADE_KIND_MOTION;
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Throws, "throws", "", ""),
               ALIDADE_SENSOR(ThrowsInt, "throws_int", "", ""),
               ALIDADE_SENSOR(Misfit, "misfit", "", ""),
               ALIDADE_SENSOR_BY(MakeWrongKind, "wrong_kind", "", ""))
