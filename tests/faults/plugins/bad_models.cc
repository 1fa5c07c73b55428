// SPDX-License-Identifier: Apache-2.0
// Models for tests/plugins/host/check_test.cc. Seven of these models have no fault, and the check
// `angles` only warns of two. Each of the other models has one fault.
#include <unistd.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "alidade/model/plugin.h"

using alidade::Angle;
using alidade::MatrixRef;
using alidade::Params;
using alidade::Quantity;
using alidade::UnitQuaternion;
using alidade::Vec;

namespace {

volatile int g_calls = 0;  // counts calls in the models with hidden state
// These variables are volatile, so the compiler cannot evaluate the faults at compile time.
volatile double g_zero = 0.0;
volatile int g_first = 0;

/// The correct model: z = (2 x, x y), defined for y > 0.
struct Right : alidade::Sensor<Vec<2>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x", "m"}, Quantity{"y", "m"}};
  static constexpr Quantity kMeasurement{"z", "m", "", "first,second"};
  Right() = default;
  explicit Right(Params&) {}
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!(y[0] > T(0.0))) return false;
    z[0] = 2.0 * x[0];
    z[1] = x[0] * y[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(0.5);
  }
};

/// Measures a heading as a vector, so that its differences are not wrapped.
struct UnwrappedHeading : alidade::Sensor<Vec<1>, Angle> {
  static constexpr std::array kRoles{Quantity{"heading", "rad"}};
  static constexpr Quantity kMeasurement{"z", "rad"};
  explicit UnwrappedHeading(Params&) {}
  template <class T>
  bool Predict(const T* heading, T* z) const {
    z[0] = heading[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.5);
  }
};

/// Measures two angles of a point. Only the bearing jumps.
struct UnwrappedBearing : alidade::Sensor<Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"position", "m"}};
  static constexpr Quantity kMeasurement{"z", "rad", "", "elevation,bearing"};
  explicit UnwrappedBearing(Params&) {}
  template <class T>
  bool Predict(const T* position, T* z) const {
    using std::atan2, std::sqrt;
    const T range = sqrt(position[0] * position[0] + position[1] * position[1]);
    if (!(range > T(0.01))) return false;
    z[0] = atan2(T(1.0), range);
    z[1] = atan2(position[1], position[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(0.5);
  }
};

/// Measures z = x + b if a bias b is bound, and z = x otherwise.
struct MayHaveBias : alidade::Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x", "m"},
                                     Quantity{"bias", "m", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"z", "m"};
  explicit MayHaveBias(Params&) {}
  template <class T>
  bool Predict(const T* x, const T* bias, T* z) const {
    z[0] = bias == nullptr ? x[0] : T(x[0] + bias[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.5);
  }
};

struct WrongJacobian : Right {
  using Right::Right;
  void Jacobian(const double* x, const double* y, MatrixRef by_x, MatrixRef by_y) const {
    by_x(0, 0) = 2.0;
    by_x(1, 0) = 1.001 * y[0];
    by_y(1, 0) = x[0];
  }
};

/// Returns other values for dual numbers than for double.
struct TwoValues : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!Right::Predict(x, y, z)) return false;
    if (!std::is_same<T, double>::value) z[0] = z[0] + 1e-9;
    return true;
  }
};

struct NotDeterministic : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!Right::Predict(x, y, z)) return false;
    g_calls = g_calls + 1;
    z[0] = z[0] + 1e-12 * g_calls;
    return true;
  }
};

/// Adds a part of the previous argument to the result.
struct HiddenState : Right {
  using Right::Right;
  mutable double last = 0.0;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!Right::Predict(x, y, z)) return false;
    // Reads the value part of x[0], even if x[0] is a dual number.
    const double now = *reinterpret_cast<const double*>(x);
    if (now != last) {
      before = last;
      last = now;
    }
    z[0] = z[0] + 1e-3 * before;
    return true;
  }
  mutable double before = 0.0;
};

struct Unwritten : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!(y[0] > T(0.0))) return false;
    z[0] = 2.0 * x[0];
    z[g_first] = 2.0 * x[0];
    return true;
  }
};

/// Returns NaN at x = 0.
struct NanOutput : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (!Right::Predict(x, y, z)) return false;
    z[1] = x[0] / x[0];
    return true;
  }
};

struct NanNoise : Right {
  using Right::Right;
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(std::numeric_limits<double>::quiet_NaN());
  }
};

struct SingularNoise : Right {
  using Right::Right;
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[2] = T(0.5);
  }
};

struct NoNoise : Right {
  using Right::Right;
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.5);
  }
};

/// The inverse model multiplies z by a wrong factor.
struct WrongInverse : Right {
  using Right::Right;
  static constexpr int kInitialises = 0;
  template <class T>
  bool Initialise(const T*, const T* z, T* x) const {
    x[0] = 0.49 * z[0];
    return true;
  }
};

struct ThrowsInt : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (g_zero == 0.0) throw 42;
    return Right::Predict(x, y, z);
  }
};
struct ThrowsInNoise : Right {
  using Right::Right;
  template <class T>
  void SqrtNoise(const T*, const T*, T*) const {
    throw std::runtime_error("the dog ate it");
  }
};
struct HangsInNoise : Right {
  using Right::Right;
  template <class T>
  void SqrtNoise(const T*, const T*, T*) const {
    while (g_zero == 0.0) ::pause();
  }
};
struct ThrowsInDestroy : Right {
  using Right::Right;
  ~ThrowsInDestroy() noexcept(false) {
    if (owner) throw std::runtime_error("never let go");
  }
  ThrowsInDestroy(ThrowsInDestroy&& other) noexcept : owner(other.owner) { other.owner = false; }
  explicit ThrowsInDestroy(Params&) {}
  bool owner = true;
};
struct ThrowsInCreate : Right {
  explicit ThrowsInCreate(Params&) { throw std::runtime_error("the dog ate it"); }
};

/// A sensor whose Predict misbehaves; kWhat selects how.
template <int kWhat>
struct Misbehaves : Right {
  using Right::Right;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    if (kWhat == 1) std::exit(0);
    if (kWhat == 2) std::raise(SIGSEGV);
    while (kWhat == 3) ::pause();
    if (kWhat == 4) Eat();
    if (kWhat == 5) std::fesetround(FE_UPWARD);
    if (kWhat == 6) std::setlocale(LC_ALL, "C.UTF-8");
    if (kWhat == 7) static_cast<void>(!new std::string(1000, 'x'));
    if (kWhat == 8) static_cast<void>(::dup(0));
    if (kWhat == 9) std::puts("hello");
    if (kWhat == 10) ::_exit(0);
    if (kWhat == 11) std::raise(SIGSTOP);
    return Right::Predict(x, y, z);
  }
  static void Eat() {
    for (std::vector<double*> all;;) all.push_back(new double[1 << 16]());
  }
};
struct CrashesInCreate : Right {
  explicit CrashesInCreate(Params&) {
    if (g_zero == 0.0) std::raise(SIGSEGV);
  }
};
struct HangsInCreate : Right {
  explicit HangsInCreate(Params&) {
    while (g_zero == 0.0) ::pause();
  }
};
struct HangsInDestroy : Right {
  explicit HangsInDestroy(Params&) {}
  HangsInDestroy(HangsInDestroy&& other) noexcept : owner(std::exchange(other.owner, false)) {}
  ~HangsInDestroy() {
    while (owner) ::pause();
  }
  bool owner = true;
};
struct LosesItself : Right {
  explicit LosesItself(Params&) { static_cast<void>(!new std::string(500, 'x')); }
};

// ---- written against the plugin ABI ------------------------------------------------------------

using Seen = AlidadeObservation;
using Eval = decltype(AlidadeSensor::eval);

/// Creates the correct model with another evaluation function.
template <Eval kEval>
void MakeRaw(Params& p, AlidadeInstance* instance) {
  static AlidadeSensor calls = alidade::detail::SensorCalls<Right>::kCalls;
  calls.eval = kEval;
  alidade::EmplaceSensor<Right>(p, instance);
  instance->sensor = &calls;
}

std::int32_t RightEval(const double* const* x, double* z, double* const* j,
                       const std::int32_t* strides) {
  return static_cast<std::int32_t>(alidade::Evaluate(Right(), x, z, j, strides));
}

std::int32_t PastTheEnd(const void*, const Seen*, const double* const* x, double* z,
                        double* const* j, const std::int32_t* strides) {
  z[2] = 0.0;
  return RightEval(x, z, j, strides);
}
std::int32_t WritesItsInput(const void*, const Seen*, const double* const* x, double* z,
                            double* const* j, const std::int32_t* strides) {
  const std::int32_t code = RightEval(x, z, j, strides);
  const_cast<double*>(x[1])[0] += 1.0;
  return code;
}
/// Ignores the strides: writes the rows of a Jacobian without gaps.
std::int32_t IgnoresStrides(const void*, const Seen*, const double* const* x, double* z,
                            double* const* j, const std::int32_t*) {
  const std::int32_t dense[] = {1, 1};
  return RightEval(x, z, j, dense);
}
std::int32_t WritesAndFails(const void*, const Seen*, const double* const* x, double* z,
                            double* const* j, const std::int32_t* strides) {
  if (!(x[1][0] > 0.0)) z[0] = 2.0 * x[0][0];
  return RightEval(x, z, j, strides);
}
std::int32_t StrangeStatus(const void*, const Seen*, const double* const*, double*, double* const*,
                           const std::int32_t*) {
  return 77;
}
/// Returns ALIDADE_OUT_OF_DOMAIN for every argument.
std::int32_t NowhereDefined(const void*, const Seen*, const double* const*, double*, double* const*,
                            const std::int32_t*) {
  return ALIDADE_OUT_OF_DOMAIN;
}

// ---- landmarks --------------------------------------------------------------------------------

/// Measures z = bearing + rho x, from which rho cannot be determined. kWhat selects a fault of the
/// inverse model.
template <int kWhat>
struct Landmark : alidade::Sensor<Vec<1>, Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x", "m"},
                                     Quantity{"bearing", "", "", "", ALIDADE_ROLE_LANDMARK},
                                     Quantity{"rho", "1/m", "", "", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"z"};
  static constexpr int kInitialises = 1;
  static constexpr int kPrior = 1;
  explicit Landmark(Params&) {}
  template <class T>
  bool Predict(const T* x, const T* bearing, const T* rho, T* z) const {
    z[0] = bearing[0] + rho[0] * x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    l[0] = T(0.1);
  }
  template <class T>
  bool Initialise(const T* x, const T* z, const T* prior, T* y) const {
    if (!(prior[0] > T(0.0))) return false;
    y[0] = z[0] - (kWhat == 1 ? T(0.0) : T(prior[0] * x[0]));
    y[1] = prior[0];
    return true;
  }
};

std::int32_t PastTheLandmark(const void* self, const Seen* seen, const double* const* x,
                             const double* prior, double* y, double* const* jx,
                             const std::int32_t* jx_strides, double* jz, std::int32_t jz_stride,
                             double* jp, std::int32_t jp_stride) {
  y[2] = 0.0;
  return alidade::detail::SensorCalls<Landmark<0>>::Initialise(
      self, seen, x, prior, y, jx, jx_strides, jz, jz_stride, jp, jp_stride);
}
void MakeWildDescription(Params& p, AlidadeInstance* instance) {
  alidade::EmplaceSensor<Right>(p, instance);
  instance->description = reinterpret_cast<const AlidadeDescription*>(16);
}
void MakePastTheLandmark(Params& p, AlidadeInstance* instance) {
  static AlidadeSensor calls;
  alidade::EmplaceSensor<Landmark<0>>(p, instance);
  calls = *instance->sensor;
  calls.initialise = PastTheLandmark;
  instance->sensor = &calls;
}

// ---- with rotations, motion --------------------------------------------------------------------

/// Measures the direction b = R(q)' (0, 0, 1).
struct Gravity : alidade::Sensor<alidade::UnitVector, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"orientation"}};
  static constexpr Quantity kMeasurement{"down"};
  explicit Gravity(Params&) {}
  template <class T>
  bool Predict(const T* q, T* z) const {
    z[0] = 2.0 * (q[1] * q[3] - q[0] * q[2]);
    z[1] = 2.0 * (q[2] * q[3] + q[0] * q[1]);
    z[2] = q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(0.01);
  }
};

/// Treats q and -q as different rotations.
struct TwoCovers : alidade::Sensor<Vec<1>, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"orientation"}};
  static constexpr Quantity kMeasurement{"x"};
  explicit TwoCovers(Params&) {}
  template <class T>
  bool Predict(const T* q, T* z) const {
    z[0] = 2.0 * q[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.01);
  }
};

/// Measures z = (x, q). -q is the same rotation as q, but the inverse model computes a different x
/// from -q.
struct TwoCoversOfAPart
    : alidade::Sensor<alidade::Product<Vec<1>, UnitQuaternion>, Vec<1>, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"x", "m"}, Quantity{"orientation"}};
  static constexpr Quantity kMeasurement{"pose"};
  static constexpr std::array kParts{Quantity{"x", "m"}, Quantity{"orientation"}};
  static constexpr int kInitialises = 0;
  explicit TwoCoversOfAPart(Params&) {}
  template <class T>
  bool Predict(const T* x, const T* q, T* z) const {
    const double sign = q[0] < T(0.0) ? -1.0 : 1.0;
    z[0] = x[0];
    for (int i = 0; i < 4; ++i) z[1 + i] = sign * q[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 4; ++i) l[5 * i] = T(0.01);
  }
  template <class T>
  bool Initialise(const T*, const T* z, T* x) const {
    x[0] = z[0] + (z[1] < T(0.0) ? 1.0 : 0.0);
    return true;
  }
};

/// A rotating body with a control input. kWhat selects a fault.
template <int kWhat>
struct Turning : alidade::Motion<4, Vec<1>, UnitQuaternion> {
  static constexpr std::array kBlocks{Quantity{"distance", "m"}, Quantity{"orientation"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"speed", "m/s"};
  explicit Turning(Params&) {}
  template <class T>
  void Step(const T* s, const T* q, const T* u, const T* w, double dt_s, T* s1, T* q1) const {
    s1[0] = s[0] + u[0] * (kWhat == 1 ? 0.1 : dt_s) + w[0];
    if (kWhat == 2) s1[0] = s1[0] - 0.3 * s[0] * dt_s;  // an Euler step of s' = u - 0.3 s
    if (kWhat == 3) s1[0] = s1[0] + T(1e-3);
    const T d[3] = {w[1], w[2] + 0.4 * dt_s, w[3]};
    UnitQuaternion::Plus(q, d, q1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 4; ++i) l(i, i) = kWhat == 4 ? std::log(0.0 * dt_s) : 0.1 * std::sqrt(dt_s);
  }
};

/// Performs an Euler step but declares the order kOrder.
template <int kOrder>
struct Declared : Turning<2> {
  using Turning<2>::Turning;
  static constexpr int kStepOrder = kOrder;
};

/// Motion model of a point with noise. kWhat selects the kind of the noise and the declared kind.
enum class Noise { kHeld, kHeldUndeclared, kAddsUpUndeclared, kOfEachStep };
template <Noise kWhat>
struct Noisy : alidade::Motion<1, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"p", "m"}, Quantity{"v", "m/s"}};
  static constexpr bool kAcceleration = kWhat == Noise::kHeld || kWhat == Noise::kHeldUndeclared;
  explicit Noisy(Params&) {}
  alidade::NoiseKind noise_kind() const {
    const bool discrete = kWhat == Noise::kHeld || kWhat == Noise::kAddsUpUndeclared;
    return discrete ? alidade::NoiseKind::kDiscrete : alidade::NoiseKind::kContinuous;
  }
  template <class T>
  void Step(const T* p, const T* v, const T* w, double dt_s, T* p1, T* v1) const {
    p1[0] = p[0] + dt_s * v[0] + (kAcceleration ? 0.5 * dt_s * dt_s : 0.0) * w[0];
    v1[0] = v[0] + (kAcceleration ? dt_s : 1.0) * w[0];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    l(0, 0) = kWhat == Noise::kAddsUpUndeclared ? 0.3 * std::sqrt(dt_s) : 0.3;
  }
};

}  // namespace

#define SENSOR(Model, name) ALIDADE_SENSOR(Model, name, "", "")
#define RAW(eval, name) ALIDADE_SENSOR_BY(MakeRaw<eval>, name, "", "")
#define MOTION(Model, name) ALIDADE_MOTION(Model, name, "", "")

ALIDADE_PLUGIN(SENSOR(Right, "right"), SENSOR(MayHaveBias, "may_have_bias"),
               SENSOR(UnwrappedHeading, "unwrapped_heading"),
               SENSOR(UnwrappedBearing, "unwrapped_bearing"), SENSOR(Gravity, "gravity"),
               MOTION(Turning<0>, "turning"), SENSOR(WrongJacobian, "wrong_jacobian"),
               SENSOR(TwoValues, "two_values"), SENSOR(NotDeterministic, "not_deterministic"),
               SENSOR(HiddenState, "hidden_state"), SENSOR(Unwritten, "unwritten"),
               SENSOR(NanOutput, "nan_output"), SENSOR(NanNoise, "nan_noise"),
               SENSOR(SingularNoise, "singular_noise"), SENSOR(NoNoise, "no_noise"),
               SENSOR(WrongInverse, "wrong_inverse"), SENSOR(ThrowsInt, "throws_int"),
               SENSOR(ThrowsInNoise, "throws_in_noise"), SENSOR(HangsInNoise, "hangs_in_noise"),
               SENSOR(ThrowsInDestroy, "throws_in_destroy"),
               SENSOR(ThrowsInCreate, "throws_in_create"), SENSOR(Misbehaves<1>, "exits"),
               SENSOR(Misbehaves<2>, "crashes"), SENSOR(Misbehaves<10>, "exits_at_once"),
               SENSOR(Misbehaves<11>, "stops_itself"), SENSOR(Misbehaves<3>, "hangs"),
               SENSOR(Misbehaves<4>, "eats_memory"), SENSOR(Misbehaves<5>, "rounds_upward"),
               SENSOR(Misbehaves<6>, "sets_locale"), SENSOR(Misbehaves<7>, "leaks"),
               SENSOR(Misbehaves<8>, "leaks_files"), SENSOR(Misbehaves<9>, "prints"),
               SENSOR(LosesItself, "loses_itself"), SENSOR(CrashesInCreate, "crashes_in_create"),
               SENSOR(HangsInCreate, "hangs_in_create"), SENSOR(HangsInDestroy, "hangs_in_destroy"),
               ALIDADE_SENSOR_BY(MakeWildDescription, "wild_description", "", ""),
               RAW(PastTheEnd, "past_the_end"), RAW(WritesItsInput, "writes_its_input"),
               RAW(IgnoresStrides, "ignores_strides"), RAW(WritesAndFails, "writes_and_fails"),
               RAW(StrangeStatus, "strange_status"), RAW(NowhereDefined, "nowhere_defined"),
               SENSOR(Landmark<0>, "landmark"), SENSOR(Landmark<1>, "wrong_landmark"),
               ALIDADE_SENSOR_BY(MakePastTheLandmark, "past_the_landmark", "", ""),
               SENSOR(TwoCovers, "two_covers"), SENSOR(TwoCoversOfAPart, "two_covers_of_a_part"),
               MOTION(Turning<1>, "ignores_dt"), MOTION(Turning<2>, "euler"),
               MOTION(Declared<2>, "euler_declared"), MOTION(Declared<3>, "euler_overstated"),
               MOTION(Turning<3>, "drifts"), MOTION(Turning<4>, "infinite_q"),
               MOTION(Noisy<Noise::kHeld>, "held"),
               MOTION(Noisy<Noise::kHeldUndeclared>, "held_undeclared"),
               MOTION(Noisy<Noise::kAddsUpUndeclared>, "adds_up_undeclared"),
               MOTION(Noisy<Noise::kOfEachStep>, "noise_of_each_step"))
