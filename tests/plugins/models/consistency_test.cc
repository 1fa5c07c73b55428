// SPDX-License-Identifier: Apache-2.0
//
// Runs every shipped model and every test model with `source: {type: models}`, in the problems of
// tests/plugins/models/consistent. Each problem is linear, or linear to the accuracy that its
// comment states. The estimator `ekf` has the true models, so its NEES and NIS are chi-square. Each
// other estimator has a wrong h, f or noise, and the test must detect this fault.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/run.h"
#include "alidade/plugin/create.h"
#include "alidade/state/dense_algebra.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr int kRuns = testing::kSanitized ? 10 : 200, kFirstSeed = 1;
// The bounds that all sums must satisfy after half of the runs, and after all runs.
constexpr double kProbabilityOfHalf = 0.999, kProbability = 0.99;
constexpr const char* kProblems = ALIDADE_SOURCE_DIR "/tests/plugins/models/consistent";
constexpr const char* kShippedPlugins = ALIDADE_BINARY_DIR "/lib/alidade/plugins";

/// Returns the host of the shipped plugins, and of the test plugins that are not deliberately
/// faulty.
const PluginHost& AllModels() {
  const auto places = [] {
    std::vector<fs::path> paths{kShippedPlugins};
    for (const char* name :
         {"driven", "planar", "range_rate", "echo_time", "matrix_baseline", "good"}) {
      paths.push_back(fs::path(ALIDADE_TEST_PLUGINS) / (std::string(name) + ".so"));
    }
    return paths;
  };
  static const PluginHost host(places());
  return host;
}

/// Sum of e' P^-1 e over independent e ~ N(0, P). All vectors e together have `dof` elements.
struct ChiSquare {
  double sum = 0.0, dof = 0.0;

  void Add(double square, int elements) {
    sum += square;
    dof += elements;
  }
  /// Returns the interval that contains sum / dof with the given probability.
  Interval Bounds(double probability) const {
    const double tail = 0.5 * (1.0 - probability);
    return {ChiSquareQuantile(tail, dof) / dof, ChiSquareQuantile(1.0 - tail, dof) / dof};
  }
  bool IsWithin(double probability) const {
    const Interval bounds = Bounds(probability);
    return bounds.low <= sum / dof && sum / dof <= bounds.high;
  }
};
void PrintTo(const ChiSquare& x, std::ostream* out) {
  const Interval bounds = x.Bounds(0.99);
  *out << x.sum / x.dof << ", 99 % in [" << bounds.low << ", " << bounds.high << "]";
}

/// NEES and NIS of each estimator over many runs. The terms of each sum are independent. NEES
/// contains the errors at the last frame of each run: of all blocks jointly, and of a landmark. NIS
/// contains all innovations of a sensor. Innovations are white over frames. Within a frame they are
/// white because each measurement is a separate update.
class Tally : public RunObserver {
 public:
  using Sums = std::map<std::string, ChiSquare>;

  const std::map<std::string, Sums>& sums() const { return sums_; }

  void Begin(const Experiment& experiment) override {
    experiment_ = &experiment;
    frames_ = 0;
  }
  void OnFrame(const SourceFrame& /*frame*/) override { ++frames_; }
  void OnEstimate(int index, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override {
    const EstimatorSpec& named = experiment_->estimators[static_cast<std::size_t>(index)];
    Sums& sums = sums_[named.name];
    for (const MeasurementReport& m : report.measurements()) {
      if (m.outcome == Outcome::kInitialised) continue;
      const auto sensor = static_cast<std::size_t>(m.sensor);
      EXPECT_EQ(m.outcome, Outcome::kAccepted) << named.name;
      sums["NIS of " + named.problem.sensors[sensor].name].Add(m.nis, m.dof);
    }
    if (frames_ < experiment_->source->size()) return;
    AddState(frame, state, sums["NEES"]);
    AddPlanarLandmarks(state, sums);
    const std::vector<LandmarkEstimate> landmarks = named.estimator->landmarks();
    // A landmark with zero covariance is known exactly. One in the plane has no position in space.
    if (landmarks.empty() || landmarks[0].covariance.isZero() ||
        !landmarks[0].covariance.allFinite()) {
      return;
    }
    AddLandmark(landmarks.front(), sums[kFirstLandmark]);
    AddLandmark(landmarks.back(), sums[kLastLandmark]);
  }

 private:
  void AddState(const SourceFrame& frame, const State& state, ChiSquare& nees) const {
    const std::vector<StreamInfo>& truths = experiment_->source->truths();
    std::vector<int> rows;
    std::vector<double> errors;
    for (std::size_t t = 0; t < truths.size(); ++t) {
      const BlockId id = state.layout().Find(truths[t].name);
      const Block& block = state.layout()[id];
      if (!block.has_covariance()) continue;
      std::vector<double> e(static_cast<std::size_t>(block.geometry().tangent));
      block.geometry().Minus(frame.truth[t].data(), state.value(id), e.data());
      for (std::size_t i = 0; i < e.size(); ++i) {
        rows.push_back(block.tangent_offset + static_cast<int>(i));
        errors.push_back(e[i]);
      }
    }
    Add(state.covariance().Dense()(rows, rows),
        Eigen::VectorXd::Map(errors.data(), std::ssize(errors)), nees);
  }
  void AddLandmark(const LandmarkEstimate& landmark, ChiSquare& nees) const {
    const auto place = experiment_->source->TrueLandmark(landmark.id);
    ASSERT_TRUE(place);
    Add(landmark.covariance, Eigen::Vector3d::Map(place->data()) - landmark.position, nees);
  }
  void AddPlanarLandmarks(const State& state, Sums& sums) const {
    std::vector<Block> planar = state.layout().blocks();
    std::erase_if(planar, [](const Block& block) {
      return block.owner != "landmarks" ||
             !(block.geometry() == Geometry::Vector(2) || block.geometry() == Geometry::Vector(4));
    });
    if (planar.empty()) return;
    AddPlanarLandmark(state, planar.front(), sums[kFirstLandmark]);
    AddPlanarLandmark(state, planar.back(), sums[kLastLandmark]);
  }
  /// Adds a landmark, whose block has the name `landmarks.ID.ROLE`. The block contains the point m,
  /// or (a, theta, rho) with m = a + (cos theta, sin theta) / rho.
  void AddPlanarLandmark(const State& state, const Block& block, ChiSquare& nees) const {
    const auto place =
        experiment_->source->TrueLandmark(std::stoll(block.name.substr(block.owner.size() + 1)));
    ASSERT_TRUE(place);
    const double* const y = state.value(state.layout().Find(block.name));
    const int n = block.geometry().tangent, row = block.tangent_offset;
    Eigen::Vector2d point(y[0], y[1]);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Identity(2, n);
    if (n == 4) {
      const Eigen::Vector2d ray = Eigen::Vector2d(std::cos(y[2]), std::sin(y[2])) / y[3];
      point += ray;
      jacobian.col(2) << -ray[1], ray[0];
      jacobian.col(3) = -ray / y[3];
    }
    Add(jacobian * state.covariance().Dense().block(row, row, n, n) * jacobian.transpose(),
        Eigen::Vector2d::Map(place->data()) - point, nees);
  }
  static void Add(const Eigen::MatrixXd& p, const Eigen::VectorXd& error, ChiSquare& nees) {
    const double square = internal::SquaredMahalanobis(p, error);
    ASSERT_GE(square, 0.0);  // holds because P is positive definite
    nees.Add(square, static_cast<int>(error.size()));
  }

  static constexpr const char* kFirstLandmark = "NEES of the first landmark";
  static constexpr const char* kLastLandmark = "NEES of the last landmark";

  const Experiment* experiment_ = nullptr;
  std::int64_t frames_ = 0;
  std::map<std::string, Sums> sums_;
};

std::vector<std::string> Problems() {
  std::vector<std::string> names;
  for (const auto& file : fs::directory_iterator(kProblems))
    names.push_back(file.path().stem().string());
  std::ranges::sort(names);
  return names;
}
Config ReadProblem(const std::string& name) {
  return Config::FromFile(fs::path(kProblems) / (name + ".yaml"));
}

/// Expects that all sums of the estimator `ekf`, which has the true models, are within their
/// bounds.
void ExpectConsistent(const Tally& tally, double probability) {
  ASSERT_TRUE(tally.sums().contains("ekf"));
  for (const auto& [name, sum] : tally.sums().at("ekf")) {
    EXPECT_TRUE(sum.IsWithin(probability)) << name << ": " << ::testing::PrintToString(sum);
  }
}

class ModelsProblem : public ::testing::TestWithParam<std::string> {};

TEST_P(ModelsProblem, OnlyTheFilterOfTheModelsIsConsistent) {
  Config config = ReadProblem(GetParam());
  Tally tally;
  RunOptions options;
  options.observers = {&tally};
  for (int run = 0; run < kRuns; ++run) {
    config.Set("source.seed", std::to_string(kFirstSeed + run), "the test");
    Experiment experiment = BuildExperiment(config, AllModels());
    const RunResult result = alidade::Run(experiment, options);
    ASSERT_EQ(result.status, RunStatus::kOk) << result.reason;
    if (run + 1 == kRuns / 2) ExpectConsistent(tally, kProbabilityOfHalf);
  }
  ExpectConsistent(tally, kProbability);
  EXPECT_GE(tally.sums().size(), 2u) << "the problem needs an estimator with a wrong model";
  if (testing::kSanitized) return;  // a sanitizer build has too few runs
  for (const auto& [name, sums] : tally.sums()) {
    if (name == "ekf") continue;
    // A correct estimator is outside this interval once in 1e9 runs of the test, by chance.
    const auto far = [](const auto& sum) { return !sum.second.IsWithin(1.0 - 1e-9); };
    EXPECT_TRUE(std::ranges::any_of(sums, far))
        << name << " has a wrong model, but no sum shows it";
  }
}

INSTANTIATE_TEST_SUITE_P(Models, ModelsProblem, ::testing::ValuesIn(Problems()),
                         [](const auto& problem) { return problem.param; });

/// Returns the value of the dotted key `key` in the map, if it exists.
std::optional<std::string> TextAt(const Node& map, const std::string& key) {
  const std::size_t dot = key.find('.');
  const auto child = map.Find(key.substr(0, dot));
  if (!child || dot == std::string::npos)
    return child ? std::optional(child->Text()) : std::nullopt;
  return child->is_map() ? TextAt(*child, key.substr(dot + 1)) : std::nullopt;
}

/// Returns the name of a model with one of its choices, such as
/// `scale_2d with noise_model: constant`.
std::string With(const PluginEntry& model, const ParamInfo& param, const std::string& choice) {
  return model.name + " with " + param.key + ": " + choice;
}

/// Returns the parameters of a model that are choices. Omits the parameters of the camera, which
/// all models share.
std::vector<ParamInfo> ChoicesOf(const PluginEntry& model) {
  std::vector<ParamInfo> choices = ModelSchema(model);
  std::erase_if(choices, [](const ParamInfo& param) {
    return param.choices.empty() || param.key.starts_with("camera.");
  });
  return choices;
}

/// Returns the models that a problem uses, and these models with the choices that it uses.
std::set<std::string> UsedBy(const Config& config) {
  std::set<std::string> used;
  for (const char* kind : {"state", "sensors"}) {
    for (const auto& [name, node] : config.root().At(kind).Entries()) {
      const std::string model = node.At("model").Text();
      used.insert(model);
      for (const PluginEntry& entry : AllModels().entries()) {
        if (!entry.is_model() || entry.name != model) continue;
        for (const ParamInfo& param : ChoicesOf(entry)) {
          const auto own = TextAt(node, param.key);
          const auto shared = own ? own : TextAt(config.root(), param.key);
          used.insert(With(entry, param, shared.value_or(param.fallback)));
        }
      }
    }
  }
  return used;
}

TEST(ModelsProblems, AreThereForEveryModelAndChoice) {
  std::set<std::string> used, needed;
  for (const std::string& name : Problems()) used.merge(UsedBy(ReadProblem(name)));
  for (const PluginEntry& entry : AllModels().entries()) {
    const fs::path folder = entry.plugin.parent_path();
    const bool ours =
        fs::equivalent(folder, kShippedPlugins) || fs::equivalent(folder, ALIDADE_TEST_PLUGINS);
    if (!entry.is_model() || !ours) continue;
    needed.insert(entry.name);
    for (const ParamInfo& param : ChoicesOf(entry)) {
      for (const std::string& choice : param.choices) needed.insert(With(entry, param, choice));
    }
  }
  EXPECT_TRUE(needed.contains("constant_velocity with noise.kind: discrete"));
  for (const std::string& model : needed) {
    EXPECT_TRUE(used.contains(model))
        << "no problem for " << model << ": add tests/plugins/models/consistent/NAME.yaml, a "
        << "config with `source: {type: models}`, an estimator `ekf` and one with a wrong model";
  }
}

}  // namespace
}  // namespace alidade
