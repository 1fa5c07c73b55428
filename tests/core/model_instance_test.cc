// SPDX-License-Identifier: Apache-2.0
// What stands between models and the engine: dual numbers, thunks, and the checks of what a plugin
// says of itself.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "alidade/error.h"
#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::ExpectSame;
using testing::ExpectTrueJacobians;
using testing::Filled;
using testing::kNumeric;
using testing::kPoison;
using testing::Linearised;
using testing::MakeMotion;
using testing::MakeSensor;
using testing::NumericallyLinearised;
using testing::Pointers;
using testing::Step;
using testing::Stepped;

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

/// x' = x + w, with a closed form that throws once it has written.
struct Faulty : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  explicit Faulty(Params&) {}
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
  void StepJacobian(const double*, const double*, double, MatrixRef f, MatrixRef g) const {
    f(0, 0) = g(0, 0) = 1.0;
    throw std::runtime_error("faulty");
  }
  void SqrtQ(double, MatrixRef l) const {
    l(0, 0) = 1.0;
    throw std::runtime_error("faulty");
  }
};

TEST(AutodiffMotion, AClosedFormThatThrowsWritesNothing) {
  const MotionModel faulty = MakeMotion<Faulty>();
  const Blocks x{{1.0}};
  Blocks next = Filled(faulty.blocks(), kPoison);
  double f = kPoison, g = kPoison, l = kPoison;
  EXPECT_EQ(faulty.Step(Pointers(x).data(), nullptr, nullptr, 0.1, Pointers(next).data(), &f, &g),
            Status::kError);
  EXPECT_EQ(faulty.SqrtQ(Pointers(x).data(), 0.1, &l), Status::kError);
  EXPECT_EQ(next, Filled(faulty.blocks(), kPoison));
  EXPECT_EQ(f, kPoison);
  EXPECT_EQ(g, kPoison);
  EXPECT_EQ(l, kPoison);
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

/// z = x, with a closed form that throws once it has written, where x < 0.
struct FaultySensor : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"y"}};
  static constexpr Quantity kMeasurement{"z"};
  explicit FaultySensor(Params&) {}
  template <class T>
  bool Predict(const T* x, const T*, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
  void Jacobian(const double* x, const double*, MatrixRef by_x, MatrixRef) const {
    by_x(0, 0) = 1.0;
    if (x[0] < 0.0) throw std::runtime_error("faulty");
  }
};

TEST(AutodiffSensor, AClosedFormThatThrowsWritesNothing) {
  const SensorModel faulty = MakeSensor<FaultySensor>();
  const int strides[] = {1, 1};
  double x = -1.0, y = 0.0, z = kPoison, by_x = kPoison, by_y = kPoison;
  const double* roles[] = {&x, &y};
  double* jacobians[] = {&by_x, &by_y};
  EXPECT_EQ(faulty.Linearise(roles, &z, jacobians, strides), Status::kError);
  EXPECT_EQ(z, kPoison);
  EXPECT_EQ(by_x, kPoison);
  EXPECT_EQ(by_y, kPoison);
  x = 2.0;
  jacobians[0] = nullptr;
  EXPECT_EQ(faulty.Linearise(roles, &z, jacobians, strides), Status::kOk);
  EXPECT_EQ(z, 2.0);
  EXPECT_EQ(by_y, 0.0);
}

/// Inverse observation of a point at a known position: roles of different sizes.
struct Displacement : Sensor<Vec<2>, Vec<2>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"point", "m", "", "x,y"},
                                     Quantity{"camera", "m", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "m", "", "x,y"};
  static constexpr int kInitialises = 0;
  explicit Displacement(Params&) {}
  template <class T>
  bool Predict(const T* point, const T* camera, T* z) const {
    for (int i = 0; i < 2; ++i) z[i] = (point[i] - camera[i]) / camera[2];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
  template <class T>
  bool Initialise(const T* camera, const T* z, T* point) const {
    for (int i = 0; i < 2; ++i) point[i] = camera[i] + z[i] * camera[2];
    return true;
  }
};

TEST(AutodiffSensor, InitialisesWithDenseJacobians) {
  const SensorModel sensor = MakeSensor<Displacement>();
  const double camera[3] = {1, 2, 4}, z[2] = {0.5, 0.25};
  const double* roles[] = {nullptr, camera};
  std::vector<double> point(2, kPoison), by_camera(6, kPoison), by_z(4, kPoison);
  double* jx[] = {nullptr, by_camera.data()};
  ASSERT_EQ(sensor.Initialise(roles, z, point.data(), jx, by_z.data()), Status::kOk);
  EXPECT_EQ(point, (std::vector<double>{3, 3}));
  EXPECT_EQ(by_camera, (std::vector<double>{1, 0, 0.5, 0, 1, 0.25}));
  EXPECT_EQ(by_z, (std::vector<double>{4, 0, 0, 4}));
}

// ---- descriptions that break the rules ----------------------------------------------------------

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

TEST(MotionModel, PassesZerosWhereNoNoiseIsGiven) {
  // A plugin of another language may not know null.
  HandWritten hand;
  AlidadeMotion motion{};
  motion.struct_size = sizeof(motion);
  motion.step = [](const void*, const double* const*, const double*, const double* w, double,
                   double* const*, double*, std::int32_t, double*, std::int32_t) {
    return std::int32_t{w != nullptr && w[0] == 0.0 && w[1] == 0.0 ? ALIDADE_OK : ALIDADE_ERROR};
  };
  motion.sqrt_q = [](const void*, const double* const*, double, double*, std::int32_t) {
    return std::int32_t{ALIDADE_OK};
  };
  hand.instance.kind = ALIDADE_KIND_MOTION;
  hand.instance.motion = &motion;
  hand.description.output = nullptr;
  hand.description.noise_count = 2;
  const MotionModel model(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_FALSE(model.has_input());
  EXPECT_EQ(model.Step(nullptr, nullptr, nullptr, 0.1, nullptr, nullptr, nullptr), Status::kOk);
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
      {"eval, sqrt_noise",
       [](HandWritten& h) {
         h.sensor.sqrt_noise = nullptr;
         h.sensor.residual = [](const void*, const double* const*, const double*, double*,
                                double* const*, const std::int32_t*) { return std::int32_t{0}; };
       }},
      {"step, sqrt_q",
       [](HandWritten& h) {
         static constexpr AlidadeMotion kNoStep{sizeof(AlidadeMotion), 0, nullptr, nullptr, {}};
         h.instance.kind = ALIDADE_KIND_MOTION;
         h.instance.motion = &kNoStep;
       }},
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
