// SPDX-License-Identifier: Apache-2.0
// Models for the plugin ABI whose functions throw, although the ABI forbids exceptions.
#include <stdexcept>

#include "alidade/model/plugin.h"
#include "probe.h"

namespace {

[[noreturn]] void Throw() { throw std::runtime_error("the dog ate it"); }

using Seen = AlidadeObservation;

struct Inverse : Probe {
  using Probe::Probe;
  static constexpr int kInitialises = 0;
  template <class T>
  bool Initialise(const T* z, T* x) const {
    x[0] = 0.5 * z[0];
    return true;
  }
  bool Valid(const double*) const { return true; }
};

struct Walk : alidade::Motion<1, alidade::Vec<1>> {
  static constexpr std::array kBlocks{alidade::Quantity{"x", "m"}};
  explicit Walk(alidade::Params&) {}
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
  void SqrtQ(double dt_s, alidade::MatrixRef l) const { l(0, 0) = std::sqrt(dt_s); }
};

/// Creates the model Inverse with one faulty function, which kSpoil sets.
template <void (*kSpoil)(AlidadeSensor&)>
void MakeSensor(alidade::Params& p, AlidadeInstance* instance) {
  static AlidadeSensor calls = alidade::detail::SensorCalls<Inverse>::kCalls;
  kSpoil(calls);
  alidade::EmplaceSensor<Inverse>(p, instance);
  instance->sensor = &calls;
}
void ThrowInEval(AlidadeSensor& calls) {
  calls.eval = [](const void*, const Seen*, const double* const*, double*, double* const*,
                  const std::int32_t*) -> std::int32_t { Throw(); };
}
void ThrowInNoise(AlidadeSensor& calls) {
  calls.sqrt_noise = [](const void*, const Seen*, const double* const*, double*,
                        std::int32_t) -> std::int32_t { Throw(); };
}
void ThrowInValid(AlidadeSensor& calls) {
  calls.valid = [](const void*, const Seen*) -> std::int32_t { throw 42; };
}
void ThrowInInitialise(AlidadeSensor& calls) {
  calls.initialise = [](const void*, const Seen*, const double* const*, const double*, double*,
                        double* const*, const std::int32_t*, double*, std::int32_t, double*,
                        std::int32_t) -> std::int32_t { Throw(); };
}
/// Throws at x = 0 and returns an error for x < 0.
void ThrowAtZero(AlidadeSensor& calls) {
  calls.eval = [](const void*, const Seen*, const double* const* x, double* z, double* const*,
                  const std::int32_t*) -> std::int32_t {
    if (x[0][0] == 0.0) Throw();
    z[0] = x[0][0];
    return x[0][0] < 0.0 ? ALIDADE_ERROR : ALIDADE_OK;
  };
}

void ThrowInErrorText(alidade::Params& p, AlidadeInstance* instance) {
  MakeSensor<ThrowAtZero>(p, instance);
  instance->error_text = [](const void*) -> const char* { Throw(); };
}
void ThrowInDestroy(alidade::Params& p, AlidadeInstance* instance) {
  alidade::EmplaceSensor<Inverse>(p, instance);
  instance->destroy = [](void* self) {
    delete static_cast<alidade::detail::Holder<Inverse>*>(self);
    Throw();
  };
}

template <void (*kSpoil)(AlidadeMotion&)>
void MakeMotion(alidade::Params& p, AlidadeInstance* instance) {
  static AlidadeMotion calls = alidade::detail::MotionCalls<Walk>::kCalls;
  kSpoil(calls);
  alidade::EmplaceMotion<Walk>(p, instance);
  instance->motion = &calls;
}
void ThrowInStep(AlidadeMotion& calls) {
  calls.step = [](const void*, const double* const*, const double* const*, const double*, double,
                  double* const*, double*, std::int32_t, double*, std::int32_t, double*,
                  std::int32_t) -> std::int32_t { Throw(); };
}
void ThrowInSqrtQ(AlidadeMotion& calls) {
  calls.sqrt_q = [](const void*, const double* const*, const double* const*, double, double*,
                    std::int32_t) -> std::int32_t { Throw(); };
}

/// Returns an entry whose `create` does not catch exceptions.
template <int kWhat>
constexpr AlidadeEntry ThrowingCreate(const char* name) {
  AlidadeEntry entry = ALIDADE_SENSOR(Probe, name, "", "");
  entry.create = [](const AlidadeHost*, AlidadeInstance*) -> std::int32_t {
    if (kWhat == 1) throw 42;
    Throw();
  };
  return entry;
}

}  // namespace

#define SENSOR(spoil, name) ALIDADE_SENSOR_BY(MakeSensor<spoil>, name, "", "")
#define MOTION(spoil, name) ALIDADE_MOTION_BY(MakeMotion<spoil>, name, "", "")

ALIDADE_PLUGIN(ThrowingCreate<0>("throws_in_create"), ThrowingCreate<1>("throws_int_in_create"),
               SENSOR(ThrowInEval, "throws_in_eval"), SENSOR(ThrowInNoise, "throws_in_sqrt_noise"),
               SENSOR(ThrowInValid, "throws_in_valid"),
               SENSOR(ThrowInInitialise, "throws_in_initialise"),
               SENSOR(ThrowAtZero, "throws_at_zero"),
               ALIDADE_SENSOR_BY(ThrowInErrorText, "throws_in_error_text", "", ""),
               ALIDADE_SENSOR_BY(ThrowInDestroy, "throws_in_destroy_too", "", ""),
               MOTION(ThrowInStep, "throws_in_step"), MOTION(ThrowInSqrtQ, "throws_in_sqrt_q"))
