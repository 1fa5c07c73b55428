// SPDX-License-Identifier: Apache-2.0
//
// Tests plugins that do not write every element of their outputs. The output memory is initialised
// with NaN, so an element that is never written is NaN at every measurement. `alidade check`
// reports all unwritten elements.
#include <gtest/gtest.h>

#include "alidade/plugin/plugin_models.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Selects the output that is left incomplete. In an L, the elements above the diagonal are not
/// written. In h, the last element is not written. In other outputs, the off-diagonal elements are
/// not written.
enum class Left { kNothing, kPrediction, kSensorL, kSensorH, kMotionL, kF, kG };

void WriteDiagonal(double value, bool zeros_too, double* j, int stride) {
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      if (row == column) j[row * stride + column] = value;
      if (row != column && zeros_too) j[row * stride + column] = 0.0;
    }
  }
}
void WriteLower(double value, bool zeros_too, double* l, int stride) {
  l[0] = l[stride + 1] = value;
  l[stride] = 0.0;
  if (zeros_too) l[1] = 0.0;
}
bool Leaves(const void* self, Left what) { return *static_cast<const Left*>(self) == what; }

/// Sensor z = x + n and motion model x' = x + w, each of two elements, written directly against the
/// C header.
struct HandWritten {
  explicit HandWritten(Left left_out) : left(left_out) {
    space.struct_size = sizeof(space);
    space.geometry = ALIDADE_VECTOR;
    space.ambient = space.tangent = 2;
    space.name = "x";
    space.elements = "a,b";
    seen.struct_size = moves.struct_size = sizeof(AlidadeDescription);
    seen.role_count = moves.role_count = 1;
    seen.role_stride = moves.role_stride = sizeof(AlidadeSpace);
    seen.roles = moves.roles = seen.output = &space;
    moves.noise_count = 2;
    sensor.struct_size = sizeof(sensor);
    sensor.eval = [](const void* self, const AlidadeObservation*, const double* const* roles,
                     double* z, double* const* jacobians, const std::int32_t* strides) {
      for (int i = 0; i < (Leaves(self, Left::kPrediction) ? 1 : 2); ++i) z[i] = roles[0][i];
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        WriteDiagonal(1.0, !Leaves(self, Left::kSensorH), jacobians[0], strides[0]);
      }
      return std::int32_t{ALIDADE_OK};
    };
    sensor.sqrt_noise = [](const void* self, const AlidadeObservation*, const double* const*,
                           double* l, std::int32_t stride) {
      WriteLower(0.5, !Leaves(self, Left::kSensorL), l, stride);
      return std::int32_t{ALIDADE_OK};
    };
    motion.struct_size = sizeof(motion);
    motion.step = [](const void* self, const double* const* blocks, const double* const*,
                     const double* w, double, double* const* next, double* f, std::int32_t f_stride,
                     double* g, std::int32_t g_stride, double*, std::int32_t) {
      for (int i = 0; i < 2; ++i) next[0][i] = blocks[0][i] + (w == nullptr ? 0.0 : w[i]);
      if (f != nullptr) WriteDiagonal(1.0, !Leaves(self, Left::kF), f, f_stride);
      if (g != nullptr) WriteDiagonal(1.0, !Leaves(self, Left::kG), g, g_stride);
      return std::int32_t{ALIDADE_OK};
    };
    motion.sqrt_q = [](const void* self, const double* const*, const double* const*, double,
                       double* l, std::int32_t stride) {
      WriteLower(0.1, !Leaves(self, Left::kMotionL), l, stride);
      return std::int32_t{ALIDADE_OK};
    };
  }
  HandWritten(const HandWritten&) = delete;

  std::shared_ptr<const ModelInstance> Make(std::uint32_t kind) {
    AlidadeInstance instance{};
    instance.struct_size = sizeof(instance);
    instance.kind = kind;
    instance.self = &left;
    instance.destroy = [](void*) {};
    instance.description = kind == ALIDADE_KIND_SENSOR ? &seen : &moves;
    if (kind == ALIDADE_KIND_SENSOR) instance.sensor = &sensor;
    if (kind == ALIDADE_KIND_MOTION) instance.motion = &motion;
    return std::make_shared<const ModelInstance>(instance, "hand", "by hand");
  }

  Left left;
  AlidadeSpace space{};
  AlidadeDescription seen{}, moves{};
  AlidadeSensor sensor{};
  AlidadeMotion motion{};
};

/// Returns a problem with the state `a.x`, measured by the sensor `direct`. If `aside` is true, the
/// problem also has a constant block.
Problem Direct(HandWritten& hand, bool aside) {
  Problem problem;
  const auto model = std::make_shared<PluginMotion>(hand.Make(ALIDADE_KIND_MOTION));
  const BlockId x = problem.layout.Declare("a.x", "a", model->blocks()[0]);
  problem.motions.push_back({"a", model, {x}});
  problem.priors.push_back({x, {1.0, 2.0}, Eigen::Matrix2d::Identity(), ""});
  if (aside) {
    const BlockId id =
        problem.layout.Declare("aside.x", "aside", model->blocks()[0], BlockStatus::kConstant);
    problem.priors.push_back({id, {0.0, 0.0}, Eigen::Matrix2d::Zero(), ""});
  }
  AddSensor(problem, "direct", std::make_shared<PluginSensor>(hand.Make(ALIDADE_KIND_SENSOR)),
            {"a.x"});
  return problem;
}

class Unwritten : public ::testing::TestWithParam<bool> {};

TEST_P(Unwritten, OutputOfASensorIsNotFiniteAtEveryMeasurement) {
  for (const Left left : {Left::kNothing, Left::kPrediction, Left::kSensorL, Left::kSensorH}) {
    HandWritten hand(left);
    const Problem problem = Direct(hand, GetParam());
    Ekf ekf(problem, {}, StreamsOf(problem));
    ekf.Start(0);
    for (int k = 0; k < 4; ++k) {
      Frame frame = FrameAt(0.1 * k, {});
      frame.measurements.push_back({frame.timestamp, 0, -1, {1.5, 2.5}, {}});
      const UpdateReport& report = ekf.Process(frame);
      EXPECT_EQ(report.measurements()[0].outcome,
                left == Left::kNothing ? Outcome::kAccepted : Outcome::kNotFinite)
          << static_cast<int>(left) << ' ' << k;
    }
  }
}

TEST_P(Unwritten, OutputOfAMotionModelEndsTheFilterAtItsFirstStep) {
  for (const Left left : {Left::kNothing, Left::kMotionL, Left::kF, Left::kG}) {
    HandWritten hand(left);
    const Problem problem = Direct(hand, GetParam());
    Ekf ekf(problem, {}, StreamsOf(problem));
    ekf.Start(0);
    const UpdateReport& report = ekf.Process(FrameAt(0.1, {}));
    EXPECT_EQ(HasEvent(report, EventKind::kNotFinite), left != Left::kNothing)
        << static_cast<int>(left);
    EXPECT_EQ(ekf.failed(), left != Left::kNothing) << static_cast<int>(left);
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, Unwritten, ::testing::Bool(),
                         [](const auto& one) { return one.param ? "constant_too" : "estimated"; });

}  // namespace
}  // namespace alidade
