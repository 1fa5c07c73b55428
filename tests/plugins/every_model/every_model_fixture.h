// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <set>

#include "alidade/model/camera.h"
#include "alidade/model/static_ekf.h"
#include "plugins/host/host_fixture.h"
#include "support/manifold_models.h"
#include "support/systems.h"

/// Tests of a shipped model, which one struct defines. The model runs as a plugin in the engine and
/// in the batch, and compiled into the program.
namespace alidade::testing {

/// Motion model of a block that the tested sensor uses.
template <class G>
using Wander = ManifoldWalk<G, 0.01>;
/// Sensor of a block of the tested motion model.
template <class G>
using Seen = ManifoldSensor<G, 0.05>;

using Means = std::vector<std::vector<double>>;

/// Adds the state entry `name`. The priors of its blocks have the means `means`, and a sigma of
/// 0.05 for each element. The stream of the control input is `NAME.input`.
inline void AddMotion(Problem& problem, const std::string& name, const SharedMotion& model,
                      const Means& means) {
  MotionBinding binding{name, model, {}};
  if (model->has_input()) binding.input = {name + ".input"};
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Space& space = model->blocks()[i];
    Prior prior;
    prior.block = problem.layout.Declare(name + "." + space.name, name, space);
    prior.mean = means[i];
    const int n = space.geometry.tangent;
    prior.covariance = 0.0025 * Eigen::MatrixXd::Identity(n, n);
    binding.blocks.push_back(prior.block);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(binding);
}

template <class G>
void AddSeen(Problem& problem) {
  const std::string number = std::to_string(problem.sensors.size());
  AddSensor(problem, "seen" + number, MakeSensor(Seen<G>(), "seen"),
            {problem.layout.blocks()[problem.sensors.size()].name});
}
template <class... G>
void AddAllSeen(Problem& problem, std::tuple<G...>*) {
  (AddSeen<G>(problem), ...);
}

/// Returns the streams of the sensors, followed by those of the control inputs.
inline std::vector<StreamInfo> AllStreams(const Problem& problem) {
  std::vector<StreamInfo> streams = StreamsOf(problem);
  for (const MotionBinding& motion : problem.motions) {
    if (!motion.model->has_input()) continue;
    streams.push_back({motion.input.stream, motion.model->input().geometry.ambient});
  }
  return streams;
}

/// Returns a constant control input of `size` elements.
inline std::vector<double> InputOf(int size) {
  std::vector<double> u;
  for (int i = 0; i < size; ++i) u.push_back(0.03 - 0.01 * i);
  return u;
}

/// Returns frames in which every sensor measures the means of the priors. The errors are about as
/// large as the noise of the sensor. The frames also contain the control inputs.
inline std::vector<Frame> FramesOf(const Problem& problem, int count) {
  std::vector<Frame> frames(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    Frame& frame = frames[static_cast<std::size_t>(k)];
    frame.timestamp = TimestampFromSeconds(0.1 * k);
    for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
      const SensorBinding& sensor = problem.sensors[s];
      std::vector<const double*> roles;
      for (const RoleBinding& role : sensor.roles) {
        roles.push_back(problem.priors[static_cast<std::size_t>(role.block)].mean.data());
      }
      const Geometry& geometry = sensor.model->measurement().geometry;
      const int m = geometry.tangent;
      std::vector<double> z(static_cast<std::size_t>(geometry.ambient)), l(m * m), d(m);
      std::vector<double> known;
      for (int i = 0; i < sensor.model->known_size(); ++i) {
        known.push_back(8.0 * std::sin(0.9 * k + 2.0 * i));
      }
      EXPECT_EQ(sensor.model->Predict(roles.data(), z.data(), known.data()), Status::kOk);
      EXPECT_EQ(sensor.model->SqrtNoise(roles.data(), z.data(), l.data(), known.data()),
                Status::kOk);
      for (int r = 0; r < m; ++r) {
        for (int c = 0; c <= r; ++c)
          d[r] += l[r * m + c] * std::sin(1.7 * k + 2.0 * static_cast<double>(s) + c);
      }
      geometry.Plus(z.data(), d.data(), z.data());
      frame.measurements.push_back({frame.timestamp, static_cast<int>(s), -1, z, {}, known});
    }
    const std::vector<StreamInfo> streams = AllStreams(problem);
    for (std::size_t s = problem.sensors.size(); s < streams.size(); ++s) {
      frame.measurements.push_back(
          {frame.timestamp, static_cast<int>(s), -1, InputOf(streams[s].size), {}});
    }
  }
  return frames;
}

/// Expects equal results of the engine and of `filter` for the same frames. The sensors of the
/// single blocks are used first, then the sensor `last`. `inputs` are the control inputs of
/// `filter`.
template <class Filter, class Last, class... Inputs>
void ExpectSame(const Problem& problem, Filter filter, const Last& last, Inputs... inputs) {
  EkfOptions options;
  options.fuse = Fuse::kPerMeasurement;
  Ekf engine(problem, options, AllStreams(problem));
  constexpr std::make_index_sequence<static_cast<std::size_t>(Filter::kBlocks)> blocks{};
  const auto set = [&](auto b) {
    const Prior& prior = problem.priors[b];
    filter.template Set<b>(prior.mean.data(), prior.covariance);
  };
  detail::ForEach(set, blocks);
  Timestamp before = 0;
  for (const Frame& frame : FramesOf(problem, 100)) {
    for (const MeasurementReport& m : engine.Process(frame).measurements()) {
      ASSERT_EQ(m.outcome, Outcome::kAccepted);
    }
    if (frame.timestamp > 0) {
      ASSERT_EQ(filter.Predict(Seconds(frame.timestamp - before), inputs...), Status::kOk);
    }
    before = frame.timestamp;
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

/// Model, with its parameters and the data that the tests need.
struct Row {
  std::string model, parameters;
  std::function<Problem(const PluginHost&, const Node&)> plugin_problem;
  std::function<Problem()> compiled_problem;
  double nonlinearity;  ///< allowed final difference between batch and filter, in sigmas
  /// Null: the row has no filter composed at compile time, which takes seconds to compile.
  std::function<void(const Problem&)> expect_static_is_engine = {};
};
inline void PrintTo(const Row& row, std::ostream* out) { *out << row.model << row.parameters; }

template <class Model>
Row MotionRow(const std::string& name, const std::string& parameters, const Model& model,
              const Means& means, double nonlinearity = 1e-9) {
  const auto problem = [=](const SharedMotion& motion) {
    Problem result;
    AddMotion(result, "m", motion, means);
    AddAllSeen(result, static_cast<typename Model::Spaces*>(nullptr));
    return result;
  };
  return {name, parameters,
          [=](const PluginHost& host, const Node& entry) {
            return problem(host.CreateMotion(name, entry));
          },
          [=] { return problem(MakeMotion(model, name)); }, nonlinearity};
}
/// Row that also tests a filter composed at compile time.
template <class Model>
Row StaticMotionRow(const std::string& name, const std::string& parameters, const Model& model,
                    const Means& means, double nonlinearity = 1e-9) {
  Row row = MotionRow(name, parameters, model, means, nonlinearity);
  row.expect_static_is_engine = [=](const Problem& around) {
    const auto nothing = [](auto&, const Frame&) {};
    if constexpr (Model::Input::kAmbient > 0) {
      const std::vector<double> u = InputOf(Model::Input::kAmbient);
      ExpectSame(around, StaticEkf<Model>(model), nothing, u.data());
    } else {
      ExpectSame(around, StaticEkf<Model>(model), nothing);
    }
  };
  return row;
}

template <class... G>
StaticEkf<Wander<G>...> FilterOf(std::tuple<G...>*) {
  return StaticEkf<Wander<G>...>(Wander<G>()...);
}
template <class... G>
void AddWanders(Problem& problem, const Means& means, std::tuple<G...>*) {
  std::size_t i = 0;
  const auto add = [&](const SharedMotion& model) {
    AddMotion(problem, "w" + std::to_string(i), model, {means[i]});
    ++i;
  };
  (add(MakeMotion(Wander<G>(), "wander")), ...);
}
template <class Filter, class Model, std::size_t... I>
StaticOutcome UpdateAll(Filter& filter, const Model& model, const double* z,
                        std::index_sequence<I...>) {
  return filter.template Update<static_cast<int>(I)...>(model, z);
}

template <class Model>
Row SensorRow(const std::string& name, const std::string& parameters, const Model& model,
              const Means& means) {
  const auto problem = [=](const SharedSensor& sensor) {
    const auto spaces = static_cast<typename Model::Spaces*>(nullptr);
    Problem result;
    AddWanders(result, means, spaces);
    AddAllSeen(result, spaces);
    std::vector<std::string> roles;
    for (const Block& block : result.layout.blocks()) roles.push_back(block.name);
    AddSensor(result, "s", sensor, roles);
    return result;
  };
  return {name, parameters,
          [=](const PluginHost& host, const Node& entry) {
            return problem(host.CreateSensor(name, entry));
          },
          [=] { return problem(MakeSensor(model, name)); }, 0.05};
}
/// Row that also tests a filter composed at compile time.
template <class Model>
Row StaticSensorRow(const std::string& name, const std::string& parameters, const Model& model,
                    const Means& means) {
  Row row = SensorRow(name, parameters, model, means);
  row.expect_static_is_engine = [=](const Problem& around) {
    const auto spaces = static_cast<typename Model::Spaces*>(nullptr);
    ExpectSame(around, FilterOf(spaces), [&](auto& filter, const Frame& frame) {
      std::vector<double> z = frame.measurements.back().values;
      const std::vector<double>& known = frame.measurements.back().known;
      z.insert(z.end(), known.begin(), known.end());
      ASSERT_EQ(UpdateAll(filter, model, z.data(), typename detail::Blocks<Model>::Indices{}),
                StaticOutcome::kAccepted);
    });
  };
  return row;
}

/// Camera with large pixels. For a landmark 2 m ahead, an uncertainty of 0.05 corresponds to about
/// a pixel.
inline const std::string kSmallCameraKeys = "width: 32, height: 24, fx: 20, fy: 20, cx: 16, cy: 12";
inline const std::string kSmallCameraText = "camera: {" + kSmallCameraKeys + '}';
inline const Camera kSmallCamera(32, 24, 20, 20, 16, 12);
inline const std::vector<double> kPosition{0.1, -0.1, 0.2}, kOrientation{1, 0, 0, 0};

/// Returns the folder of the plugins of this build.
inline const std::filesystem::path& ShippedFolder() {
  static const std::filesystem::path folder =
      std::filesystem::path(ALIDADE_BINARY_DIR) / "lib/alidade/plugins";
  return folder;
}
inline const PluginHost& Shipped() {
  static const PluginHost host({ShippedFolder()});
  return host;
}

/// Test of one row. The tests are in every_model_test.cc, and the rows are in the other *_test.cc
/// of this folder.
class EveryModel : public ::testing::TestWithParam<Row> {
 protected:
  const Row& row_ = GetParam();
  Config parameters_ = Config::FromText(row_.parameters, row_.model);
  void SetUp() override { system_ = row_.plugin_problem(Shipped(), parameters_.root()); }
  Problem system_;
};

/// Returns the name of a row, such as `stereo_disparity_0`: the model, and the index of the row in
/// its source.
inline std::string RowName(const ::testing::TestParamInfo<Row>& row) {
  return row.param.model + '_' + std::to_string(row.index);
}

}  // namespace alidade::testing
