// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/parameter_tests.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/accepted_data.h"
#include "alidade/experiment/build_estimator.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/filter_parameters.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/score_test.h"
#include "alidade/experiment/short_forms.h"

namespace alidade {
namespace {

using internal::FilterParameter;

constexpr const char* kOrigin = "diagnose";

/// Observer that stores the measurements that one estimator accepted.
class AcceptedFrames : public RunObserver {
 public:
  explicit AcceptedFrames(std::string estimator) : estimator_(std::move(estimator)) {}

  void Begin(const Experiment& experiment) override { experiment_ = &experiment; }
  void OnEstimate(int estimator, const SourceFrame& frame, const State& /*state*/,
                  const UpdateReport& report) override {
    const EstimatorSpec& spec = experiment_->estimators[static_cast<std::size_t>(estimator)];
    if (spec.name != estimator_) return;
    frames_.push_back(internal::AcceptedMeasurements(frame, experiment_->source->streams(),
                                                     spec.problem, report));
    measurements_ += std::ranges::count_if(report.measurements(), [](const MeasurementReport& m) {
      return InfoOf(m.outcome).is_used;
    });
  }
  bool is_full() const { return measurements_ >= kMaxTestedMeasurements; }
  const std::vector<Frame>& frames() const { return frames_; }

 private:
  std::string estimator_;
  const Experiment* experiment_ = nullptr;
  std::vector<Frame> frames_;
  std::int64_t measurements_ = 0;
};

/// Returns the reason why the estimator cannot be tested, or "".
std::string WhyNotTested(const EstimatorSpec& spec) {
  if (internal::FindEstimatorType(spec.type) == nullptr || spec.kind != EstimatorKind::kFilter) {
    return "an estimator of type '" + spec.type +
           "' has no innovations of predictions; only recursive filters are tested";
  }
  if (spec.accepted_by >= 0) {
    return "it uses only measurements that another estimator accepted; test that estimator";
  }
  for (const SensorBinding& sensor : spec.problem.sensors) {
    if (!sensor.outlier_rejection) continue;
    return "sensor '" + sensor.name +
           "' has `outlier_rejection`, which needs several measurements in one update; only a "
           "filter without it is tested";
  }
  const bool is_scored = std::ranges::any_of(
      spec.problem.sensors, [](const SensorBinding& s) { return s.loss.kind == LossKind::kNone; });
  return is_scored ? "" : "all of its sensors have a robust `loss`, whose weights distort z";
}

/// Runs of one filter with the same data and different parameters.
class FilterRuns {
 public:
  /// Builds the experiment of the config. Error: kBadConfig if it has no estimator `name`.
  FilterRuns(const Config& config, const PluginHost& host, const std::string& name)
      : config_(config.Copy()),
        host_(host),
        name_(name),
        experiment_(BuildExperiment(config_, host)),
        data_(name) {
    config_ = *experiment_.config;
    const auto& estimators = experiment_.estimators;
    if (std::ranges::find(estimators, name, &EstimatorSpec::name) != estimators.end()) return;
    config_.root()
        .At("estimators")
        .Fail("estimator '" + name + "' does not exist",
              internal::Join(internal::NamesOf(estimators)));
  }

  const EstimatorSpec& spec() const {
    return *std::ranges::find(experiment_.estimators, name_, &EstimatorSpec::name);
  }
  std::vector<FilterParameter> Parameters() const {
    const Config calibrated = internal::WithCalibration(config_.Copy(), *experiment_.source);
    const auto overrides = calibrated.root().At("estimators").At(name_).Find("overrides");
    Config merged = overrides ? calibrated.Merged(*overrides) : calibrated;
    ExpandShortForms(merged, host_);
    return internal::FilterParametersOf(merged.root(), spec().problem);
  }
  /// Returns the probability of the gate of the filter; 1 without a gate.
  double gate() const {
    const Config copy = config_.Copy();
    const Node entry = copy.root().At("estimators").At(name_);
    return internal::FindEstimatorType(spec().type)->describe(entry).common.gate;
  }

  /// Runs the filter as configured, and stores the measurements that it accepts. Errors: the error
  /// that ended the run.
  void ReadData(const std::function<bool()>& stop) {
    if (experiment_.guide == nullptr) {  // another filter may guide the source
      std::erase_if(experiment_.estimators,
                    [&](const EstimatorSpec& spec) { return spec.name != name_; });
      experiment_.reference = -1;
    }
    RunOptions options;
    options.observers = {&data_};
    options.stop = [&] { return data_.is_full() || (stop && stop()); };
    const RunResult result = alidade::Run(experiment_, options);
    if (result.status == RunStatus::kFailed && result.code != ExitCode::kDiverged) {
      throw Error(result.code, result.reason);
    }
  }

  /// Returns the runs of the same filter with the number of a parameter, without data.
  FilterRuns With(const FilterParameter& parameter) const {
    return {ConfigWith(parameter, parameter.value()), host_, name_};
  }
  /// Returns the setting that changes a parameter for this filter only.
  std::string SettingOf(const FilterParameter& parameter, double value) const {
    return KeyOf(parameter) + '=' + parameter.YamlOf(value);
  }

  /// Returns the innovations of the filter with `value` for the parameter, or with the numbers of
  /// the config if `parameter` is null. Errors: kBadConfig if the filter does not support the
  /// value.
  InnovationRows Run(const FilterParameter* parameter, double value) const {
    Config config = parameter == nullptr ? config_.Copy() : ConfigWith(*parameter, value);
    const std::string entry = "estimators." + name_;
    config.Set(entry + ".fuse", "per_measurement", kOrigin);
    config.Set(entry + ".gate", "none", kOrigin);
    // `use` rejects a filter that reads a stream by two sensors: AcceptedMeasurements cannot
    // distinguish their measurements.
    config.Set(entry + ".use", "{accepted_by: " + name_ + '}', kOrigin);
    const Config calibrated = internal::WithCalibration(config, *experiment_.source);
    const EstimatorSpec filter = internal::BuildEstimator(
        name_ + "-varied", calibrated.root().At("estimators").At(name_), calibrated, host_,
        &experiment_.source->streams(), experiment_.estimators);
    InnovationRows rows;
    for (const Frame& frame : data_.frames()) {
      for (const MeasurementReport& m : filter.estimator->Process(frame).measurements()) {
        const auto& sensor = filter.problem.sensors[static_cast<std::size_t>(m.sensor)];
        rows.Add(m, sensor.loss.kind == LossKind::kNone);
      }
      if (filter.estimator->failed()) break;
    }
    return rows;
  }

 private:
  std::string KeyOf(const FilterParameter& parameter) const {
    return "estimators." + name_ + ".overrides." + parameter.key;
  }

  /// Returns the config, changed by the setting of a parameter.
  Config ConfigWith(const FilterParameter& parameter, double value) const {
    Config config = config_.Copy();
    config.Set(KeyOf(parameter), parameter.YamlOf(value), kOrigin);
    return config;
  }

  Config config_;
  const PluginHost& host_;
  std::string name_;
  Experiment experiment_;
  AcceptedFrames data_;
};

/// Step of a parameter for the central difference: of its logarithm, or of the number itself.
double StepOf(const FilterParameter& parameter) {
  constexpr double kLogStep = 1e-3, kStep = 1e-4;
  return parameter.is_deviation ? kLogStep : kStep * std::max(1.0, std::abs(parameter.value()));
}

double Shifted(const FilterParameter& parameter, double step) {
  return parameter.is_deviation ? parameter.value() * std::exp(step) : parameter.value() + step;
}

/// Completes a test from the score of its parameter.
void AddResult(const FilterParameter& parameter, const Score& score, ParameterTest& test) {
  constexpr double kSmallestVarianceRatio = 0.01;
  test.z = score.z();
  test.gain = score.gain();
  test.sigma = 1.0 / std::sqrt(score.information);
  if (parameter.is_deviation) {
    const double ratio = std::max(kSmallestVarianceRatio, 1.0 + 2.0 * score.step());
    test.better = parameter.value() * std::sqrt(ratio);
    test.sigma *= test.better;
  } else {
    test.better = parameter.value() + score.step();
  }
}

/// Returns the estimate, rounded to about a tenth of its standard deviation.
double RoundedEstimate(const ParameterTest& test) {
  constexpr int kMinDigits = 3, kMaxDigits = 15;
  const double digits = 1.0 + std::ceil(std::log10(std::abs(test.better) / test.sigma));
  const int count = static_cast<int>(std::clamp<double>(digits, kMinDigits, kMaxDigits));
  const std::string text = internal::RoundedText(test.better, count);
  double rounded = test.better;
  std::from_chars(text.data(), text.data() + text.size(), rounded);
  return rounded;
}

/// Test of a parameter, with its score.
struct ScoredTest {
  ParameterTest test;
  Score score = {};
};

ScoredTest TestParameter(const FilterRuns& runs, const FilterParameter& parameter,
                         const InnovationRows& center) {
  ScoredTest result;
  ParameterTest& test = result.test;
  test.key = parameter.name();
  test.value = parameter.value();
  if (parameter.is_deviation && !(parameter.value() > 0.0)) {
    test.not_tested = "the standard deviation is 0";
    return result;
  }
  const double h = StepOf(parameter);
  try {
    const InnovationRows minus = runs.Run(&parameter, Shifted(parameter, -h)),
                         plus = runs.Run(&parameter, Shifted(parameter, h));
    if (auto score = ComputeScore(center, minus, plus, h, runs.gate())) {
      result.score = *std::move(score);
      AddResult(parameter, result.score, test);
      test.setting = runs.SettingOf(parameter, RoundedEstimate(test));
    } else {
      test.not_tested = "the innovations do not depend on it, or not smoothly";
    }
  } catch (const Error& e) {  // for example, a time offset that the motion model does not support
    test.not_tested = e.what();
  }
  return result;
}

/// Sorts the tests by descending |z|, and finds those that are alternatives to an earlier one.
std::vector<ParameterTest> Ordered(std::vector<ScoredTest> results) {
  constexpr double kSameEffect = 0.9;
  std::ranges::stable_sort(results, std::greater<>(), [](const ScoredTest& result) {
    return result.test.not_tested.empty() ? std::abs(result.test.z) : -1.0;
  });
  std::vector<ParameterTest> tests;
  for (const ScoredTest& result : results) {
    tests.push_back(result.test);
    if (!result.test.not_tested.empty()) continue;
    for (const ScoredTest& earlier : results) {
      if (&earlier == &result) break;
      if (std::abs(Correlation(earlier.score, result.score)) < kSameEffect) continue;
      tests.back().alternative_to = earlier.test.key;
      break;
    }
  }
  return tests;
}

/// Number of runs of the filter, for the progress.
class RunCounter {
 public:
  RunCounter(const ParameterTestOptions& options, std::int64_t total)
      : options_(options), total_(total) {}

  const std::function<bool()>& stop() const { return options_.stop; }
  void Expect(std::int64_t runs) { total_ += runs; }
  /// Adds finished runs. Error: kStopped.
  void Add(std::int64_t runs) {
    done_ += runs;
    if (options_.progress) options_.progress(done_, total_);
    if (options_.stop && options_.stop()) throw Error(ExitCode::kStopped, "the tests were stopped");
  }

 private:
  const ParameterTestOptions& options_;
  std::int64_t done_ = 0, total_;
};

/// Tests a parameter whose number is the estimate of `test`. The filter reads the data again,
/// because its gate then accepts other measurements.
ParameterTest TestEstimate(const ParameterTest& test, FilterParameter parameter,
                           const FilterRuns& runs, const std::function<bool()>& stop) {
  parameter.values[parameter.element] = test.better;
  FilterRuns changed = runs.With(parameter);
  changed.ReadData(stop);
  return TestParameter(changed, parameter, changed.Run(nullptr, 0.0)).test;
}

/// Replaces the estimate of a test by that of further scoring steps, each from the last estimate.
/// Ends if a step is shorter than 5 % of the estimate or than its standard deviation, if it cannot
/// be computed, or after kMaxSteps.
void Refine(const FilterParameter& parameter, const FilterRuns& runs, RunCounter& counter,
            ParameterTest& test) {
  constexpr int kMaxSteps = 3;
  constexpr std::int64_t kRunsOfStep = 4;
  constexpr double kMaxChange = 0.05;
  for (int step = 0; step < kMaxSteps; ++step) {
    counter.Expect(kRunsOfStep);
    ParameterTest next;
    try {
      next = TestEstimate(test, parameter, runs, counter.stop());
    } catch (const Error& e) {  // for example, a run that diverges with this number
      next.not_tested = e.what();
    }
    counter.Add(kRunsOfStep);
    if (!next.not_tested.empty()) return;
    const double change = std::abs(next.better - test.better);
    test.better = next.better;
    test.sigma = next.sigma;
    test.setting = next.setting;
    if (change < std::max(test.sigma, kMaxChange * std::abs(test.better))) return;
  }
}

}  // namespace

bool ParameterTest::is_alarm() const { return std::abs(z) > kParameterAlarm; }

ParameterTests TestParameters(const Config& config, const PluginHost& host, const std::string& name,
                              const ParameterTestOptions& options) {
  FilterRuns runs(config, host, name);
  ParameterTests tests{name, WhyNotTested(runs.spec())};
  if (!tests.not_tested.empty()) return tests;
  const std::vector<FilterParameter> parameters = runs.Parameters();
  RunCounter counter(options, 2 + 2 * std::ssize(parameters));
  runs.ReadData(options.stop);
  counter.Add(1);
  InnovationRows center;
  try {
    center = runs.Run(nullptr, 0.0);
  } catch (const Error& e) {  // for example, two sensors that read the same stream
    tests.not_tested = e.what();
    return tests;
  }
  counter.Add(1);
  std::vector<ScoredTest> results;
  for (const FilterParameter& parameter : parameters) {
    results.push_back(TestParameter(runs, parameter, center));
    counter.Add(2);
  }
  tests.parameters = Ordered(std::move(results));
  if (!tests.parameters.empty() && tests.parameters.front().is_alarm()) {
    ParameterTest& first = tests.parameters.front();
    Refine(*std::ranges::find(parameters, first.key, &FilterParameter::name), runs, counter, first);
  }
  return tests;
}

}  // namespace alidade
