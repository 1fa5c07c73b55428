// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/experiment/experiment.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Test of one number in the config that a filter assumes to be known.
struct ParameterTest {
  std::string key;      ///< key of the number, as in `sensors.stereo.sigma_px`
  double value = 0.0;   ///< number in the config
  double z = 0.0;       ///< statistic of the score test; N(0, 1) if `value` is right
  double better = 0.0;  ///< estimate of the right number
  double sigma = 0.0;   ///< standard deviation of this estimate
  double gain = 0.0;    ///< expected increase of the log likelihood, z^2 / 2
  /// Setting of the config that changes the number for this filter only, as in
  /// `estimators.ekf.overrides.sensors.stereo.sigma_px=1.5`.
  std::string setting;
  /// Parameter with a larger |z| that has almost the same or the opposite effect on the
  /// innovations, or "". The data do not show which of the two is wrong. An example is the clock
  /// offset of one of two sensors.
  std::string alternative_to;
  std::string not_tested;  ///< reason why there is no result, or ""

  bool is_alarm() const;
};
/// Smallest |z| of an alarm. A consistent filter exceeds it with probability 7e-6.
inline constexpr double kParameterAlarm = 4.5;

/// Tests of the parameters of one estimator.
struct ParameterTests {
  std::string estimator;
  std::string not_tested;  ///< reason why the estimator cannot be tested, or ""
  /// Tests by descending |z|; tests without a result are last.
  std::vector<ParameterTest> parameters = {};
};

struct ParameterTestOptions {
  /// Receives the number of finished runs of the filter and the number of all runs.
  std::function<void(std::int64_t, std::int64_t)> progress;
  std::function<bool()> stop;  ///< if it returns true, the tests end with Error kStopped
};

/// Tests each of the internal::FilterParametersOf() the estimator `name`. The estimator first
/// processes the data of the config. Then it processes the measurements that it accepted, once
/// with the numbers of the config, and twice for each parameter: with a slightly smaller and a
/// slightly larger number. In these runs, each measurement is an update of its own, so that the
/// innovations are independent; the gate is off. The innovations of a sensor with a robust
/// loss are not used. Only the first kMaxTestedMeasurements measurements are used.
///
/// The tested quantity of a standard deviation is log sigma. `better` is sqrt(1 + 2 d) sigma, with
/// d = Score::step(); this is the scoring step of sigma^2, which is exact if S is proportional to
/// sigma^2. If the first test is an alarm, up to three further steps, each from the last estimate,
/// improve `better` and `sigma` of this test. A step is too short if the number is wrong by a large
/// factor, or if the gate rejected the largest innovations.
///
/// Smoothers, batches and estimators of plugins are not tested, because they have no innovations.
/// Errors: kBadConfig if the config has no estimator `name`; those of BuildExperiment; the error
/// that ended the run that reads the data; kStopped.
ParameterTests TestParameters(const Config& config, const PluginHost& host, const std::string& name,
                              const ParameterTestOptions& options);
inline constexpr std::int64_t kMaxTestedMeasurements = 100'000;

}  // namespace alidade
