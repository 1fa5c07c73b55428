// SPDX-License-Identifier: Apache-2.0
//
// Every shipped model, from its one struct: as a plugin under the engine and the batch, composed at
// compile time, and under the checker. A model without a row fails.
#include <algorithm>
#include <functional>
#include <set>

#include "alidade/check.h"
#include "alidade/static_ekf.h"
#include "host_fixture.h"
#include "motion_models/odometry_pose.h"
#include "motion_models/quaternion_pose.h"
#include "sensors/depth_feature.h"
#include "sensors/inverse_depth_feature.h"
#include "sensors/self_calibrating_feature.h"
#include "sensors/stereo_feature.h"
#include "support/systems.h"

namespace alidade {
namespace {

using testing::AddSensor;
using testing::StreamsOf;
namespace fs = std::filesystem;

/// x' = x (+) w: moves the roles of a sensor.
template <class G>
struct Wander : Motion<G::kTangent, G> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    G::Plus(x, w, next);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < G::kTangent; ++i) l(i, i) = 0.01 * std::sqrt(dt_s);
  }
};

/// z = x (+) n: sees the blocks of a motion model.
template <class G>
struct Seen : Sensor<G, G> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::copy_n(x, G::kAmbient, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < G::kTangent; ++i) l[i * (G::kTangent + 1)] = T(0.05);
  }
};

using Means = std::vector<std::vector<double>>;

/// Adds the state entry `name`, whose blocks start at `means`, each element known to 0.05. A
/// control input comes on the stream `NAME.input`.
void AddMotion(System& system, const std::string& name, const MotionModel& model,
               const Means& means) {
  MotionBinding binding{name, model, {}};
  if (model.has_input()) binding.input = {name + ".input"};
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Space& space = model.blocks()[i];
    Prior prior;
    prior.block = system.layout.Declare(name + "." + space.name, name, space);
    prior.mean = means[i];
    const int n = space.geometry.tangent;
    prior.covariance = 0.0025 * Eigen::MatrixXd::Identity(n, n);
    binding.blocks.push_back(prior.block);
    system.priors.push_back(prior);
  }
  system.motions.push_back(binding);
}

template <class G>
void AddSeen(System& system) {
  const std::string number = std::to_string(system.sensors.size());
  AddSensor(system, "seen" + number, InProcessSensor(Seen<G>(), "seen"),
            {system.layout.blocks()[system.sensors.size()].name});
}
template <class... G>
void AddAllSeen(System& system, std::tuple<G...>*) {
  (AddSeen<G>(system), ...);
}

/// The streams of the sensors, then those of the control inputs.
std::vector<StreamInfo> AllStreams(const System& system) {
  std::vector<StreamInfo> streams = StreamsOf(system);
  for (const MotionBinding& motion : system.motions) {
    if (!motion.model.has_input()) continue;
    streams.push_back({motion.input.stream, motion.model.input().geometry.ambient});
  }
  return streams;
}

/// A control input of `size` elements that goes on for ever.
std::vector<double> InputOf(int size) {
  std::vector<double> u;
  for (int i = 0; i < size; ++i) u.push_back(0.03 - 0.01 * i);
  return u;
}

/// Frames in which every sensor sees the means of the priors, with noise of about its own size, and
/// the control inputs come.
std::vector<Frame> FramesOf(const System& system, int count) {
  std::vector<Frame> frames(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    Frame& frame = frames[static_cast<std::size_t>(k)];
    frame.stamp = StampFromSeconds(0.1 * k);
    for (std::size_t s = 0; s < system.sensors.size(); ++s) {
      const SensorBinding& sensor = system.sensors[s];
      std::vector<const double*> roles;
      for (const RoleBinding& role : sensor.roles) {
        roles.push_back(system.priors[static_cast<std::size_t>(role.block)].mean.data());
      }
      const Geometry& geometry = sensor.model.measurement().geometry;
      const int m = geometry.tangent;
      std::vector<double> z(static_cast<std::size_t>(geometry.ambient)), l(m * m), d(m);
      EXPECT_EQ(sensor.model.Predict(roles.data(), z.data()), Status::kOk);
      EXPECT_EQ(sensor.model.SqrtNoise(roles.data(), z.data(), l.data()), Status::kOk);
      for (int r = 0; r < m; ++r) {
        for (int c = 0; c <= r; ++c)
          d[r] += l[r * m + c] * std::sin(1.7 * k + 2.0 * static_cast<double>(s) + c);
      }
      geometry.Plus(z.data(), d.data(), z.data());
      frame.measurements.push_back({frame.stamp, static_cast<int>(s), -1, z, {}});
    }
    const std::vector<StreamInfo> streams = AllStreams(system);
    for (std::size_t s = system.sensors.size(); s < streams.size(); ++s) {
      frame.measurements.push_back(
          {frame.stamp, static_cast<int>(s), -1, InputOf(streams[s].size), {}});
    }
  }
  return frames;
}

/// The engine and `filter`, whose blocks are seen one by one, then by `last`, over the same frames;
/// `inputs` are the control inputs that `filter` takes.
template <class Filter, class Last, class... Inputs>
void ExpectSame(const System& system, Filter filter, const Last& last, Inputs... inputs) {
  EkfOptions options;
  options.fuse = Fuse::kPerMeasurement;
  Ekf engine(system, options, AllStreams(system));
  constexpr std::make_index_sequence<static_cast<std::size_t>(Filter::kBlocks)> blocks{};
  const auto set = [&](auto b) {
    const Prior& prior = system.priors[b];
    filter.template Set<b>(prior.mean.data(), prior.covariance);
  };
  detail::ForEach(set, blocks);
  Stamp before = 0;
  for (const Frame& frame : FramesOf(system, 100)) {
    for (const MeasurementReport& m : engine.Process(frame).measurements()) {
      ASSERT_EQ(m.outcome, Outcome::kAccepted);
    }
    if (frame.stamp > 0) {
      ASSERT_EQ(filter.Predict(Seconds(frame.stamp - before), inputs...), Status::kOk);
    }
    before = frame.stamp;
    const auto see = [&](auto b) {
      const Seen<typename Filter::template Space<b>> seen;
      ASSERT_EQ(filter.template Update<b>(seen, frame.measurements[b].values.data()),
                StaticOutcome::kAccepted);
    };
    detail::ForEach(see, blocks);
    last(filter, frame);
    const auto compare = [&](auto b) {
      const double* expected = engine.state().value(b);
      for (int i = 0; i < Filter::template Space<b>::kAmbient; ++i) {
        ASSERT_NEAR(filter.template value<b>()[i], expected[i], 1e-12) << "block " << b;
      }
    };
    detail::ForEach(compare, blocks);
    ASSERT_LT((filter.covariance() - engine.state().covariance().Dense()).norm(), 1e-12);
  }
}

/// A model with parameters, and what the tests below need of it.
struct Row {
  std::string model, parameters;
  /// Around the plugin.
  std::function<System(const PluginHost&, const Node&)> system;
  std::function<void(const System&)> expect_static_is_engine;
  double nonlinearity;  ///< by which batch and filter may differ at the end, in sigmas
};

template <class Model>
Row MotionRow(const std::string& name, const std::string& parameters, const Model& model,
              const Means& means, double nonlinearity = 1e-9) {
  const auto system = [=](const PluginHost& host, const Node& entry) {
    System result;
    AddMotion(result, "m", host.CreateMotion(name, entry), means);
    AddAllSeen(result, static_cast<typename Model::Spaces*>(nullptr));
    return result;
  };
  const auto expect = [=](const System& around) {
    const auto nothing = [](auto&, const Frame&) {};
    if constexpr (Model::Input::kAmbient > 0) {
      const std::vector<double> u = InputOf(Model::Input::kAmbient);
      ExpectSame(around, StaticEkf<Model>(model), nothing, u.data());
    } else {
      ExpectSame(around, StaticEkf<Model>(model), nothing);
    }
  };
  return {name, parameters, system, expect, nonlinearity};
}

template <class... G>
StaticEkf<Wander<G>...> FilterOf(std::tuple<G...>*) {
  return StaticEkf<Wander<G>...>(Wander<G>()...);
}
template <class... G>
void AddWanders(System& system, const Means& means, std::tuple<G...>*) {
  std::size_t i = 0;
  const auto add = [&](const MotionModel& model) {
    AddMotion(system, "w" + std::to_string(i), model, {means[i]});
    ++i;
  };
  (add(InProcessMotion(Wander<G>(), "wander")), ...);
}
template <class Filter, class Model, std::size_t... I>
StaticOutcome UpdateAll(Filter& filter, const Model& model, const double* z,
                        std::index_sequence<I...>) {
  return filter.template Update<static_cast<int>(I)...>(model, z);
}

template <class Model>
Row SensorRow(const std::string& name, const std::string& parameters, const Model& model,
              const Means& means) {
  const auto spaces = static_cast<typename Model::Spaces*>(nullptr);
  const auto system = [=](const PluginHost& host, const Node& entry) {
    System result;
    AddWanders(result, means, spaces);
    AddAllSeen(result, spaces);
    std::vector<std::string> roles;
    for (const Block& block : result.layout.blocks()) roles.push_back(block.name);
    AddSensor(result, "s", host.CreateSensor(name, entry), roles);
    return result;
  };
  const auto expect = [=](const System& around) {
    ExpectSame(around, FilterOf(spaces), [&](auto& filter, const Frame& frame) {
      ASSERT_EQ(UpdateAll(filter, model, frame.measurements.back().values.data(),
                          typename detail::Blocks<Model>::Indices{}),
                StaticOutcome::kAccepted);
    });
  };
  return {name, parameters, system, expect, 0.05};
}

/// A landmark 2 m before a camera on whose image the uncertainties here, of 0.05, are a pixel.
const std::string kCamera = "camera: {width: 32, height: 24, fx: 20, fy: 20, cx: 16, cy: 12}";
const Camera kSmallCamera(32, 24, 20, 20, 16, 12);
const std::vector<double> kPosition{0.1, -0.1, 0.2}, kOrientation{1, 0, 0, 0}, kOrigin{0, 0, 0};

const std::vector<Row>& Rows() {
  static const std::vector<Row> rows = {
      MotionRow("constant", "{}", Constant<1>(1), {{0.7}}),
      MotionRow("constant", "{size: 2, noise: {random_walk: 0.3}}", Constant<2>(2, 0.3),
                {{0.7, -0.2}}),
      MotionRow("constant_velocity", "{noise: {acceleration: 0.4}}",
                ConstantVelocity<1, false>(0.4), {{1.0}, {0.1}}),
      MotionRow("constant_velocity", "{dimensions: 2, noise: {kind: white, acceleration: 0.4}}",
                ConstantVelocity<2, true>(0.4), {{1.0, 2.0}, {0.1, -0.1}}),
      MotionRow("constant_velocity", "{dimensions: 3, noise: {acceleration: 0.4}}",
                ConstantVelocity<3, false>(0.4), {{1.0, 2.0, 3.0}, {0.1, 0.0, -0.1}}),
      SensorRow("stereo_disparity", "{focal_px: 400, baseline_m: 0.065, sigma_px: 1.0}",
                StereoDisparity(400.0, 0.065, 1.0), {{0.7}}),
      SensorRow("scale_2d", "{template_px: 300, sigma_px: 1.0}", Scale2d::FromPixels(300.0, 1.0),
                {{0.7}, {1.4}}),
      SensorRow("scale_2d", "{noise: fixed, variance: 0.0025}", Scale2d::FromVariance(0.0025),
                {{0.7}, {1.4}}),
      MotionRow("quaternion_pose",
                "{noise: {linear_acceleration: 0.4, angular_acceleration: [0.2, 0.3, 0.4]}}",
                QuaternionPose({0.4, 0.4, 0.4}, {0.2, 0.3, 0.4}),
                {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {0.1, -0.1, 0.0}}, 0.05),
      MotionRow("odometry_pose", "{noise: {linear_velocity: 0.3, angular_velocity: 0.002}}",
                OdometryPose({0.3, 0.3, 0.3}, {0.002, 0.002, 0.002}),
                {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {1, 0, 0, 0}, {0.02}}, 0.05),
      SensorRow("inverse_depth_feature", "{sigma_px: 1, " + kCamera + "}",
                InverseDepthFeature<InverseDepth>(kSmallCamera, 1.0),
                {kPosition, kOrientation, {0, 0, 0, 0.1, -0.2, 0.5}}),
      SensorRow("inverse_depth_feature",
                "{sigma_px: 1, landmarks: {form: anchored}, " + kCamera + "}",
                InverseDepthFeature<Anchored>(kSmallCamera, 1.0),
                {kPosition, kOrientation, kOrigin, {0.0, 0.28, 0.96}, {0.5}}),
      SensorRow("stereo_feature", "{sigma_px: 1, baseline_m: 0.5, " + kCamera + "}",
                StereoFeature<InverseDepth>(kSmallCamera, 0.5, 1.0),
                {kPosition, kOrientation, {0, 0, 0, 0.1, -0.2, 0.5}}),
      SensorRow("depth_feature",
                "{sigma_px: 1, sigma_depth_m: 0.1, landmarks: {form: xyz}, " + kCamera + "}",
                DepthFeature<Xyz>(kSmallCamera, 1.0, 0.1),
                {kPosition, kOrientation, {0.2, 0.4, 2.0}}),
      SensorRow("self_calibrating_feature", "{sigma_px: 1}",
                SelfCalibratingFeature<RadialLens>(1.0),
                {kPosition, kOrientation, {20, -0.1, 0.05}, {0.2, 0.4, 2.0}}),
      SensorRow(
          "self_calibrating_feature", "{lens: radtan, sigma_px: 1}",
          SelfCalibratingFeature<RadtanLens>(1.0),
          {kPosition, kOrientation, {20, 16, 12, -0.1, 0.05, 0.0, 0.0, 0.0}, {0.2, 0.4, 2.0}}),
  };
  return rows;
}

const fs::path kShipped = fs::path(ALIDADE_BINARY_DIR) / "lib/alidade/plugins";
const PluginHost& Shipped() {
  static const PluginHost host({kShipped});
  return host;
}

class EveryModel : public ::testing::TestWithParam<std::size_t> {
 protected:
  const Row& row_ = Rows()[GetParam()];
  Config parameters_ = Config::FromText(row_.parameters, row_.model);
  void SetUp() override { system_ = row_.system(Shipped(), parameters_.root()); }
  System system_;
};

TEST_P(EveryModel, IsTheSameAsAPluginAndComposedAtCompileTime) {
  row_.expect_static_is_engine(system_);
}

// The last estimate of the batch is the filter's where models are linear, as motions are here.
// Without the measurements of its sensor a batch would be off by 0.1 to 0.6 sigma.
TEST_P(EveryModel, GivesTheBatchItsFactors) {
  const auto& entries = Shipped().entries();
  if (std::none_of(entries.begin(), entries.end(),
                   [](const PluginEntry& entry) { return entry.name == "ceres_batch"; })) {
    GTEST_SKIP() << "built without the Ceres solver";
  }
  const Config config = Config::FromText("type: ceres_batch", "batch.yaml");
  const std::unique_ptr<Estimator> batch =
      Shipped().CreateEstimator("ceres_batch", config.root())(system_, AllStreams(system_));
  Ekf ekf(system_, {}, AllStreams(system_));
  const std::vector<Frame> frames = FramesOf(system_, 20);
  for (const Frame& frame : frames) {
    batch->Process(frame);
    ekf.Process(frame);
  }
  std::size_t emitted = 0;
  batch->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    ++emitted;
    if (k + 1 < frames.size()) return;
    for (const Block& block : state.layout().blocks()) {
      const int n = block.geometry().tangent;
      std::vector<double> d(static_cast<std::size_t>(n));
      const BlockId id = state.layout().Find(block.name);
      block.geometry().Minus(state.value(id), ekf.state().value(id), d.data());
      for (int i = 0; i < n; ++i) {
        const double variance = ekf.state().covariance().Variance(block.tangent_offset + i);
        EXPECT_LT(std::abs(d[i]), row_.nonlinearity * std::sqrt(variance)) << block.name;
      }
    }
  });
  EXPECT_FALSE(batch->failed());
  EXPECT_EQ(emitted, frames.size());
}

TEST_P(EveryModel, PassesTheChecker) {
  for (const PluginEntry& entry : FindModels(Shipped(), row_.model)) {
    const std::vector<Finding> findings = CheckModel(Shipped(), entry, parameters_.root());
    EXPECT_FALSE(AnyFailure(findings)) << CheckText(entry, findings);
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, EveryModel, ::testing::Range(std::size_t{0}, Rows().size()),
                         [](const ::testing::TestParamInfo<std::size_t>& row) {
                           return Rows()[row.param].model + '_' + std::to_string(row.param);
                         });

TEST(EveryModel, HasARow) {
  std::set<std::string> rows, shipped;
  for (const Row& row : Rows()) rows.insert(row.model);
  for (const char* folder : {"motion_models", "sensors"}) {
    for (const auto& file : fs::directory_iterator(fs::path(ALIDADE_SOURCE_DIR) / folder)) {
      if (file.path().extension() == ".h") shipped.insert(file.path().stem().string());
    }
  }
  for (const PluginEntry& entry : Shipped().entries()) {
    const bool model =
        entry.kind == PluginEntry::Kind::kSensor || entry.kind == PluginEntry::Kind::kMotion;
    if (model && fs::equivalent(entry.plugin.parent_path(), kShipped)) shipped.insert(entry.name);
  }
  EXPECT_EQ(rows, shipped) << "a row above for each model that is shipped";
}

}  // namespace
}  // namespace alidade
