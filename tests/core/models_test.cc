// SPDX-License-Identifier: Apache-2.0
#include "alidade/models.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/error.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/model_maker.h"
#include "support/numeric_jacobian.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::Filled;
using testing::MakeMotion;
using testing::MakeSensor;
using testing::MapHost;
using testing::NumericJacobian;
using testing::Pointers;

constexpr double kPoison = 1e302;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Of numeric Jacobians: h^4 = 1e-12 times derivatives of order 1e2, and rounding / h = 1e-13.
constexpr double kNumeric = 1e-9;

/// Jacobians by all roles side by side, m x n.
std::vector<double> Linearised(const SensorModel& sensor, const Blocks& roles) {
  const int m = sensor.measurement().geometry.tangent, n = testing::TangentSize(sensor.roles());
  std::vector<double> z(sensor.measurement().geometry.ambient), j(m * n, kPoison);
  std::vector<double*> blocks;
  int column = 0;
  for (const Space& role : sensor.roles()) {
    blocks.push_back(j.data() + column);
    column += role.geometry.tangent;
  }
  const std::vector<int> strides(blocks.size(), n);
  EXPECT_EQ(sensor.Linearise(Pointers(roles).data(), z.data(), blocks.data(), strides.data()),
            Status::kOk);
  return j;
}

std::vector<double> NumericallyLinearised(const SensorModel& sensor, const Blocks& roles) {
  const auto predict = [&](const Blocks& x) {
    Blocks z = Filled({sensor.measurement()}, kPoison);
    EXPECT_EQ(sensor.Predict(Pointers(x).data(), z[0].data()), Status::kOk);
    return z;
  };
  return NumericJacobian(sensor.roles(), roles, {sensor.measurement()}, predict);
}

void ExpectSame(const std::vector<double>& a, const std::vector<double>& b, double relative) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i], b[i], relative * (1.0 + std::abs(b[i]))) << "entry " << i;
  }
}

struct Stepped {
  Blocks next;
  std::vector<double> f, g;
};

Stepped Step(const MotionModel& motion, const Blocks& x, const double* u, const double* w,
             double dt_s) {
  const int n = motion.tangent_size();
  Stepped out{Filled(motion.blocks(), kPoison), std::vector<double>(n * n, kPoison),
              std::vector<double>(n * motion.noise_size(), kPoison)};
  EXPECT_EQ(motion.Step(Pointers(x).data(), u, w, dt_s, Pointers(out.next).data(), out.f.data(),
                        out.g.data()),
            Status::kOk);
  return out;
}

/// Checks F and G of a step at noise w against numeric ones.
void ExpectTrueJacobians(const MotionModel& motion, const Blocks& x, const double* u,
                         const std::vector<double>& w, double dt_s) {
  const auto value = [&](const Blocks& blocks, const std::vector<double>& noise) {
    Blocks next = Filled(motion.blocks(), kPoison);
    EXPECT_EQ(motion.Step(Pointers(blocks).data(), u, noise.data(), dt_s, Pointers(next).data(),
                          nullptr, nullptr),
              Status::kOk);
    return next;
  };
  const Stepped out = Step(motion, x, u, w.data(), dt_s);
  EXPECT_EQ(out.next, value(x, w)) << "the value is the same with and without Jacobians";
  ExpectSame(out.f,
             NumericJacobian(motion.blocks(), x, motion.blocks(),
                             [&](const Blocks& blocks) { return value(blocks, w); }),
             kNumeric);
  Space noise;
  noise.geometry = Geometry::Vector(motion.noise_size());
  ExpectSame(out.g,
             NumericJacobian({noise}, {w}, motion.blocks(),
                             [&](const Blocks& blocks) { return value(x, blocks[0]); }),
             kNumeric);
}

/// L L' of the process noise.
std::vector<double> Covariance(const MotionModel& motion, const Blocks& x, double dt_s) {
  const int n = motion.noise_size();
  std::vector<double> l(n * n, kPoison), q(n * n, 0.0);
  EXPECT_EQ(motion.SqrtQ(Pointers(x).data(), dt_s, l.data()), Status::kOk);
  for (int i = 0; i < n * n * n; ++i)
    q[i / n] += l[i / (n * n) * n + i % n] * l[i / n % n * n + i % n];
  return q;
}

// ---- stereo_disparity: f = 400 px, B = 0.065 m, Z = 0.5 m: d = 400 0.065 / 0.5 = 52 px ----------

const MapHost::Values kStereo{
    {"focal_px", {400}}, {"baseline_m", {0.065}}, {"sigma_px", {1.5}}, {"near_m", {0.2}}};

TEST(StereoDisparity, PredictsWorkedNumbers) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  double disparity_px = kPoison, sigma_px = kPoison;
  const double depth_m = 0.5;
  const double* roles[] = {&depth_m};
  ASSERT_EQ(stereo.Predict(roles, &disparity_px), Status::kOk);
  EXPECT_DOUBLE_EQ(disparity_px, 52.0);
  // -f B / Z^2 = -26 / 0.25
  EXPECT_DOUBLE_EQ(Linearised(stereo, {{0.5}})[0], -104.0);
  ASSERT_EQ(stereo.SqrtNoise(roles, &disparity_px, &sigma_px), Status::kOk);
  EXPECT_EQ(sigma_px, 1.5);
}

TEST(StereoDisparity, JacobianIsTrue) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.3, 0.5, 2.0, 10.0}) {
    const Blocks roles{{depth_m}};
    ExpectSame(Linearised(stereo, roles), NumericallyLinearised(stereo, roles), 3e-9);
  }
}

TEST(StereoDisparity, BehindTheCameraIsOutOfDomainAndWritesNothing) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.0, -0.5, kNaN}) {
    double z = kPoison, j = kPoison;
    const double* roles[] = {&depth_m};
    double* jacobians[] = {&j};
    const int stride = 1;
    EXPECT_EQ(stereo.Linearise(roles, &z, jacobians, &stride), Status::kOutOfDomain);
    EXPECT_EQ(stereo.Predict(roles, &z), Status::kOutOfDomain);
    EXPECT_EQ(z, kPoison);
    EXPECT_EQ(j, kPoison);
  }
}

TEST(StereoDisparity, IsInvalidNearerThanTheLimit) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  // f B / near = 26 / 0.2 = 130 px
  for (const double ok : {1e-9, 52.0, 129.999}) EXPECT_EQ(stereo.Valid(&ok), Status::kOk) << ok;
  for (const double bad : {0.0, -1.0, 130.001, kNaN}) {
    EXPECT_EQ(stereo.Valid(&bad), Status::kInvalid) << bad;
  }
}

TEST(StereoDisparity, InitialisesTheDepth) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo.initialised_role(), 0);
  const double disparity_px = 52.0, negative_px = -1.0;
  const double* roles[] = {nullptr};
  double* jx[] = {nullptr};
  double depth_m = kPoison, j_depth_disparity = kPoison;
  ASSERT_EQ(stereo.Initialise(roles, &disparity_px, &depth_m, jx, &j_depth_disparity), Status::kOk);
  EXPECT_DOUBLE_EQ(depth_m, 0.5);
  EXPECT_DOUBLE_EQ(j_depth_disparity, -26.0 / (52.0 * 52.0));
  depth_m = kPoison;
  EXPECT_EQ(stereo.Initialise(roles, &negative_px, &depth_m, jx, nullptr), Status::kOutOfDomain);
  EXPECT_EQ(depth_m, kPoison);
}

TEST(StereoDisparity, DescribesItself) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo.roles().size(), 1u);
  EXPECT_EQ(stereo.roles()[0].name, "depth");
  EXPECT_EQ(stereo.roles()[0].unit, "m");
  EXPECT_EQ(stereo.roles()[0].geometry, Geometry::Vector(1));
  EXPECT_EQ(stereo.measurement().name, "disparity");
  EXPECT_EQ(stereo.measurement().elements, std::vector<std::string>{""});
}

TEST(StereoDisparity, AsksForWhatIsMissing) {
  const MapHost host({{"focal_px", {400}}});
  static_cast<void>(testing::MakeInstance(&EmplaceSensor<StereoDisparity>, host));
  std::vector<std::string> missing = host.missing();
  std::sort(missing.begin(), missing.end());
  EXPECT_EQ(missing, (std::vector<std::string>{"baseline_m", "sigma_px"}));
}

// ---- scale_2d: lambda = 3 1/m, Z = 0.5 m: s = 1.5 -----------------------------------------------

const MapHost::Values kScale{{"noise", {0}}, {"template_px", {300}}, {"sigma_px", {1}}};
const Blocks kScaleRoles{{0.5}, {3.0}};

TEST(Scale2d, PredictsWorkedNumbers) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  double s = kPoison, sigma = kPoison;
  const auto roles = Pointers(kScaleRoles);
  ASSERT_EQ(scale.Predict(roles.data(), &s), Status::kOk);
  EXPECT_DOUBLE_EQ(s, 1.5);
  EXPECT_EQ(Linearised(scale, kScaleRoles), (std::vector<double>{3.0, 0.5}));
  ExpectSame(Linearised(scale, kScaleRoles), NumericallyLinearised(scale, kScaleRoles), kNumeric);
  // (2 1 / 300) 1.5^3 = 0.0225
  ASSERT_EQ(scale.SqrtNoise(roles.data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.0225);
}

TEST(Scale2d, NoiseMayBeFixed) {
  const SensorModel scale = MakeSensor<Scale2d>({{"noise", {1}}, {"variance", {4e-4}}});
  double s = 1.5, sigma = kPoison;
  ASSERT_EQ(scale.SqrtNoise(Pointers(kScaleRoles).data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.02);
}

TEST(Scale2d, IsDefinedForPositiveDepthAndInverseDepth) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  for (const Blocks& roles : {Blocks{{0.0}, {3.0}}, Blocks{{0.5}, {0.0}}, Blocks{{-1.0}, {-3.0}},
                              Blocks{{kNaN}, {3.0}}, Blocks{{0.5}, {kNaN}}}) {
    double s = kPoison;
    EXPECT_EQ(scale.Predict(Pointers(roles).data(), &s), Status::kOutOfDomain);
    EXPECT_EQ(s, kPoison);
  }
  for (const double bad : {0.0, -1.5, kNaN}) EXPECT_EQ(scale.Valid(&bad), Status::kInvalid);
}

TEST(Scale2d, InitialisesTheInverseDistance) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  ASSERT_EQ(scale.initialised_role(), 1);
  const double depth_m = 0.5, s = 1.5;
  const double* roles[] = {&depth_m, nullptr};
  double y = kPoison, j_depth = kPoison, untouched = kPoison, j_s = kPoison;
  double* jx[] = {&j_depth, &untouched};
  ASSERT_EQ(scale.Initialise(roles, &s, &y, jx, &j_s), Status::kOk);
  EXPECT_DOUBLE_EQ(y, 3.0);
  EXPECT_DOUBLE_EQ(j_depth, -6.0);  // -s / Z^2
  EXPECT_DOUBLE_EQ(j_s, 2.0);       // 1 / Z
  EXPECT_EQ(untouched, kPoison);
}

// ---- constant --------------------------------------------------------------------------------

TEST(Constant, StaysAndHasNoNoise) {
  const MotionModel constant = MakeMotion<Constant<>>();
  EXPECT_EQ(constant.noise_size(), 0);
  const Stepped out = Step(constant, {{3.3}}, nullptr, nullptr, 0.1);
  EXPECT_EQ(out.next[0][0], 3.3);
  EXPECT_EQ(out.f[0], 1.0);
}

TEST(Constant, WalksWithTheRootOfTime) {
  const MotionModel walk = MakeMotion<Constant<>>({{"size", {3}}, {"noise.random_walk", {0.2}}});
  ASSERT_EQ(walk.noise_size(), 3);
  EXPECT_EQ(walk.blocks()[0].elements, (std::vector<std::string>{"0", "1", "2"}));
  const Blocks x{{1, 2, 3}};
  EXPECT_EQ(Step(walk, x, nullptr, nullptr, 0.25).next, x) << "no noise given is zero noise";
  ExpectTrueJacobians(walk, x, nullptr, {0.1, -0.2, 0.3}, 0.25);
  // 0.2^2 0.25 = 0.01
  ExpectSame(Covariance(walk, x, 0.25), {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01}, 1e-15);
}

// ---- constant_velocity -------------------------------------------------------------------------

template <int D, bool kWhite>
void CheckConstantVelocity() {
  const double sigma = 0.7, dt_s = 0.2;
  const MotionModel motion =
      MakeMotion<ConstantVelocity<D, kWhite>>({{"noise.acceleration", {sigma}}});
  ASSERT_EQ(motion.noise_size(), kWhite ? 2 * D : D);
  Blocks x{std::vector<double>(D), std::vector<double>(D)};
  std::vector<double> w(motion.noise_size());
  for (int i = 0; i < D; ++i) x[0][i] = 1.0 + i, x[1][i] = -0.5 * i + 0.25;
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.3 - 0.1 * static_cast<double>(i);
  const Stepped out = Step(motion, x, nullptr, nullptr, dt_s);
  for (int i = 0; i < D; ++i) {
    EXPECT_DOUBLE_EQ(out.next[0][i], x[0][i] + dt_s * x[1][i]);
    EXPECT_EQ(out.next[1][i], x[1][i]);
  }
  ExpectTrueJacobians(motion, x, nullptr, w, dt_s);
  // G Qw G' per axis: piecewise sigma^2 [dt^4/4 dt^3/2; . dt^2], white sigma^2 [dt^3/3 dt^2/2; . dt]
  const double s2 = sigma * sigma, t = dt_s;
  const double pp = kWhite ? t * t * t / 3 : t * t * t * t / 4;
  const double pv = kWhite ? t * t / 2 : t * t * t / 2;
  const double vv = kWhite ? t : t * t;
  const std::vector<double> q = Covariance(motion, x, dt_s);
  const int n = 2 * D, m = motion.noise_size();
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      double sum = 0.0;
      for (int i = 0; i < m * m; ++i) {
        sum += out.g[r * m + i / m] * q[i] * out.g[c * m + i % m];
      }
      const double axis = r < D && c < D ? pp : r >= D && c >= D ? vv : pv;
      EXPECT_NEAR(sum, r % D == c % D ? s2 * axis : 0.0, 1e-16) << r << ' ' << c;
    }
  }
}

TEST(ConstantVelocity, MovesAndSpreadsAsItsEquationsSay) {
  CheckConstantVelocity<1, false>();
  CheckConstantVelocity<2, false>();
  CheckConstantVelocity<3, false>();
  CheckConstantVelocity<1, true>();
  CheckConstantVelocity<2, true>();
  CheckConstantVelocity<3, true>();
}

// ---- the machinery, on models made for it --------------------------------------------------------

/// q' = q Exp((u + w) dt)
struct Turn : Motion<3, UnitQuaternion> {
  using Input = Vec<3>;
  static constexpr std::array kBlocks{Quantity{"orientation"}};
  static constexpr Quantity kInput{"rate", "rad/s", "angular velocity", "x,y,z"};
  explicit Turn(Params&) {}
  template <class T>
  bool Step(const T* q, const T* u, const T* w, double dt_s, T* next) const {
    if (!(q[0] * q[0] < T(4.0))) return false;
    T d[3];
    for (int i = 0; i < 3; ++i) d[i] = (u[i] + w[i]) * dt_s;
    UnitQuaternion::Plus(q, d, next);
    return true;
  }
  void SqrtQ(const double*, double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = 0.1 / std::sqrt(dt_s);
  }
};

TEST(AutodiffMotion, TakesControlInputAndTurnsQuaternions) {
  const MotionModel turn = MakeMotion<Turn>();
  EXPECT_TRUE(turn.has_input());
  EXPECT_EQ(turn.instance().space().name, "rate");
  const Blocks x{{0.5, -0.5, 0.5, 0.5}};
  const double rate[3] = {0.3, -1.0, 2.0};
  ExpectTrueJacobians(turn, x, rate, {0.05, 0.02, -0.1}, 0.1);
}

TEST(AutodiffMotion, GivesFOrGAlone) {
  const MotionModel turn = MakeMotion<Turn>();
  const Blocks x{{0.5, -0.5, 0.5, 0.5}};
  const double rate[3] = {0.3, -1.0, 2.0};
  const Stepped both = Step(turn, x, rate, nullptr, 0.1);
  Blocks next = Filled(turn.blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  const auto blocks = Pointers(x);
  auto out = Pointers(next);
  ASSERT_EQ(turn.Step(blocks.data(), rate, nullptr, 0.1, out.data(), f.data(), nullptr),
            Status::kOk);
  ASSERT_EQ(turn.Step(blocks.data(), rate, nullptr, 0.1, out.data(), nullptr, g.data()),
            Status::kOk);
  EXPECT_EQ(f, both.f);
  EXPECT_EQ(g, both.g);
}

TEST(AutodiffMotion, OutOfDomainWritesNothing) {
  const MotionModel turn = MakeMotion<Turn>();
  const Blocks x{{3.0, 0, 0, 0}};
  const double rate[3] = {0, 0, 0};
  Blocks next = Filled(turn.blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  for (double* jacobian : {f.data(), static_cast<double*>(nullptr)}) {
    EXPECT_EQ(turn.Step(Pointers(x).data(), rate, nullptr, 0.1, Pointers(next).data(), jacobian,
                        jacobian == nullptr ? nullptr : g.data()),
              Status::kOutOfDomain);
  }
  EXPECT_EQ(next, Filled(turn.blocks(), kPoison));
  EXPECT_EQ(f, std::vector<double>(9, kPoison));
  EXPECT_EQ(g, std::vector<double>(9, kPoison));
}

TEST(AutodiffMotion, NullNoiseIsZeroInThePluginItself) {
  // The host passes zeros; another host may pass null, as the ABI allows.
  const MotionModel turn = MakeMotion<Turn>();
  const AlidadeInstance& c = turn.instance().c();
  const Blocks x{{1, 0, 0, 0}};
  const double rate[3] = {0, 0, 1};
  Blocks next = Filled(turn.blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  EXPECT_EQ(c.motion->step(c.self, Pointers(x).data(), rate, nullptr, 0.1, Pointers(next).data(),
                           f.data(), 3, g.data(), 3),
            ALIDADE_OK);
  EXPECT_NEAR(next[0][3], std::sin(0.05), 1e-16);
}

/// Bearing of a point from a pose: an angle measured, an optional bias role.
struct Bearing : Sensor<Angle, Vec<2>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"point", "m", "", "x,y"},
                                     Quantity{"bias", "rad", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"bearing", "rad"};
  explicit Bearing(Params&) {}
  template <class T>
  bool Predict(const T* point, const T* bias, T* z) const {
    using std::atan2;
    if (point[0] == T(13.0)) throw std::runtime_error("unlucky");
    if (point[0] == T(14.0)) throw 14;
    z[0] = atan2(point[1], point[0]);
    if (bias != nullptr) z[0] = Angle::Wrap(T(z[0] + bias[0]));
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.01);
  }
};

TEST(AutodiffSensor, JacobianOfAnAngleIsTrueAcrossTheWrap) {
  const SensorModel bearing = MakeSensor<Bearing>();
  for (const double y : {0.5, 1e-4, -1e-4}) {
    const Blocks roles{{-2.0, y}, {0.1}};
    ExpectSame(Linearised(bearing, roles), NumericallyLinearised(bearing, roles), kNumeric);
  }
}

TEST(AutodiffSensor, AnUnboundOptionalRoleIsSkipped) {
  const SensorModel bearing = MakeSensor<Bearing>();
  const double point[2] = {3.0, 4.0};
  const double* roles[] = {point, nullptr};
  double z = kPoison, j[2] = {kPoison, kPoison};
  double* jacobians[] = {j, nullptr};
  const int strides[] = {2, 0};
  ASSERT_EQ(bearing.Linearise(roles, &z, jacobians, strides), Status::kOk);
  EXPECT_NEAR(j[0], -4.0 / 25.0, 1e-16);
  EXPECT_NEAR(j[1], 3.0 / 25.0, 1e-16);
  EXPECT_TRUE(bearing.roles()[1].optional());
}

TEST(AutodiffSensor, AnExceptionIsAnErrorWithItsText) {
  const SensorModel bearing = MakeSensor<Bearing>();
  double z = kPoison;
  const double unlucky[2] = {13.0, 0}, unluckier[2] = {14.0, 0}, bias = 0.0;
  const double* roles[] = {unlucky, &bias};
  EXPECT_EQ(bearing.Predict(roles, &z), Status::kError);
  EXPECT_EQ(bearing.error_text(), "unlucky");
  roles[0] = unluckier;
  EXPECT_EQ(bearing.Predict(roles, &z), Status::kError);
  EXPECT_EQ(bearing.error_text(), "an exception of unknown type");
  EXPECT_EQ(z, kPoison);
}

// ---- descriptions that break the rules -----------------------------------------------------------

/// A sensor written by hand against the C header, right unless a test spoils it.
struct HandWritten {
  HandWritten() {
    role.struct_size = output.struct_size = sizeof(AlidadeSpace);
    role.geometry = output.geometry = ALIDADE_VECTOR;
    role.ambient = role.tangent = output.ambient = output.tangent = 1;
    role.name = "x";
    output.name = "z";
    description.struct_size = sizeof(description);
    description.role_count = 1;
    description.role_stride = sizeof(AlidadeSpace);
    description.roles = &role;
    description.output = &output;
    sensor.struct_size = sizeof(sensor);
    sensor.eval = [](const void*, const double* const*, double*, double* const*,
                     const std::int32_t*) { return std::int32_t{77}; };
    sensor.sqrt_noise = [](const void*, const double* const*, const double*, double*,
                           std::int32_t) { return std::int32_t{-1}; };
    instance.struct_size = sizeof(instance);
    instance.kind = ALIDADE_KIND_SENSOR;
    instance.self = &destroyed;
    instance.destroy = [](void* self) { ++*static_cast<int*>(self); };
    instance.description = &description;
    instance.sensor = &sensor;
  }
  AlidadeSpace role{}, output{};
  AlidadeDescription description{};
  AlidadeSensor sensor{};
  AlidadeInstance instance{};
  int destroyed = 0;
};

TEST(ModelInstance, AcceptsAHandWrittenSensorAndDestroysItOnce) {
  HandWritten hand;
  {
    const SensorModel sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
    EXPECT_EQ(hand.destroyed, 0);
    double z = 0.0;
    EXPECT_EQ(sensor.Predict(nullptr, &z), Status::kError) << "77 is no code of the ABI";
    EXPECT_EQ(sensor.SqrtNoise(nullptr, &z, &z), Status::kError);
  }
  EXPECT_EQ(hand.destroyed, 1);
}

TEST(ModelInstance, WalksRolesByTheirStride) {
  struct LaterSpace {
    AlidadeSpace known;
    double unknown_to_this_version[4];
  };
  LaterSpace roles[2] = {};
  HandWritten hand;
  roles[0].known = roles[1].known = hand.role;
  roles[1].known.name = "y";
  roles[0].known.struct_size = roles[1].known.struct_size = sizeof(LaterSpace);
  hand.description.roles = &roles[0].known;
  hand.description.role_count = 2;
  hand.description.role_stride = sizeof(LaterSpace);
  const ModelInstance instance(hand.instance, "m", "p.so");
  ASSERT_EQ(instance.spaces().size(), 2u);
  EXPECT_EQ(instance.spaces()[1].name, "y");
}

TEST(ModelInstance, ReadsNoFurtherThanAStructSays) {
  HandWritten hand;
  hand.role.struct_size = offsetof(AlidadeSpace, unit);
  hand.role.unit = reinterpret_cast<const char*>(8);
  hand.sensor.struct_size = offsetof(AlidadeSensor, valid);
  hand.sensor.valid = reinterpret_cast<std::int32_t (*)(const void*, const double*)>(8);
  const SensorModel sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_EQ(sensor.roles()[0].unit, "");
  const double z = 0.0;
  EXPECT_EQ(sensor.Valid(&z), Status::kOk);
}

struct Spoiled {
  const char* words;
  void (*spoil)(HandWritten&);
};

TEST(ModelInstance, RefusesByNameWhatBreaksTheRules) {
  const Spoiled cases[] = {
      {"has 0 roles", [](HandWritten& h) { h.description.role_count = 0; }},
      {"has 65 roles", [](HandWritten& h) { h.description.role_count = 65; }},
      {"has 1 roles", [](HandWritten& h) { h.description.roles = nullptr; }},
      {"role stride of 4", [](HandWritten& h) { h.description.role_stride = 4; }},
      {"has no description", [](HandWritten& h) { h.instance.description = nullptr; }},
      {"does not describe its measurement", [](HandWritten& h) { h.description.output = nullptr; }},
      {"role '' has no name", [](HandWritten& h) { h.role.name = nullptr; }},
      {"role 'x' has geometry 9", [](HandWritten& h) { h.role.geometry = 9; }},
      {"role 'x' has geometry 1 with sizes 0", [](HandWritten& h) { h.role.ambient = 0; }},
      {"sizes 1 and 2", [](HandWritten& h) { h.role.tangent = 2; }},
      {"has geometry 3 with sizes 1 and 1", [](HandWritten& h) { h.role.geometry = 3; }},
      {"the measurement has geometry 0", [](HandWritten& h) { h.output.geometry = 0; }},
      {"names its elements 'a,b', but has 1", [](HandWritten& h) { h.role.elements = "a,b"; }},
      {"owned by the sensor", [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_OWNED; }},
      {"is a landmark", [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_LANDMARK; }},
      {"gives a residual alone",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_RESIDUAL_ONLY; }},
      {"can initialise, but not what or how",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_CAN_INITIALISE; }},
      {"eval, sqrt_noise", [](HandWritten& h) { h.sensor.eval = nullptr; }},
      {"eval, sqrt_noise", [](HandWritten& h) { h.sensor.struct_size = 8; }},
      {"lacks the functions of its kind", [](HandWritten& h) { h.instance.sensor = nullptr; }},
      {"is of kind 3", [](HandWritten& h) { h.instance.kind = ALIDADE_KIND_LANDMARK_FORM; }},
  };
  for (const Spoiled& test : cases) {
    HandWritten hand;
    test.spoil(hand);
    try {
      const ModelInstance instance(hand.instance, "bad_model", "/p/bad.so");
      ADD_FAILURE() << "accepted: " << test.words;
    } catch (const Error& e) {
      const std::string text = e.what();
      EXPECT_EQ(e.code(), ExitCode::kPlugin);
      EXPECT_NE(text.find(test.words), std::string::npos) << text;
      EXPECT_NE(text.find("/p/bad.so"), std::string::npos) << text;
      EXPECT_NE(text.find("bad_model"), std::string::npos) << text;
    }
    EXPECT_EQ(hand.destroyed, 1) << "what is refused is destroyed: " << test.words;
  }
}

}  // namespace
}  // namespace alidade
