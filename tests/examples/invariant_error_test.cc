// SPDX-License-Identifier: Apache-2.0
//
// Runs the config of an invariant error with every type of estimator.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "alidade/experiment/experiment.h"
#include "alidade/experiment/run.h"

namespace alidade {
namespace {

#ifdef ALIDADE_WITHOUT_CERES
constexpr const char* kTypes[] = {"ekf", "iekf", "square_root_ekf", "ukf", "rts"};
#else
constexpr const char* kTypes[] = {"ekf", "iekf",      "square_root_ekf", "ukf",
                                  "rts", "fixed_lag", "ceres_batch"};
#endif

// The key is not ignored: the estimate differs from that of the plain error. Only the minimum of
// the batch does not depend on the error in which its models are linearised.
TEST(InvariantError, SuitsEveryTypeOfEstimator) {
  const PluginHost host;
  for (const std::string type : kTypes) {
    Config config = Config::FromFile(std::string(ALIDADE_SOURCE_DIR) +
                                     "/examples/34_invariant_error/config.yaml");
    config.Set("source.duration_s", "3", "test");
    const std::string lag = type == "fixed_lag" ? ", lag_s: 0.3" : "";
    config.Set("estimators",
               "{plain: {type: " + type + lag + "}, invariant: {type: " + type + lag +
                   ", invariant_error: {side: left, blocks: [body.position, body.orientation, "
                   "body.velocity]}}}",
               "test");
    Experiment experiment = BuildExperiment(config, host);
    const RunResult result = alidade::Run(experiment, {});
    ASSERT_EQ(result.status, RunStatus::kOk) << type << ": " << result.reason;
    const auto nees = [&](std::size_t i) {
      return result.estimators[i].metrics.at("nees.mean:body");
    };
    EXPECT_LT(nees(1), 3.0) << type;
    const double least_difference = type == "ceres_batch" ? 0.0 : 1e-6;
    EXPECT_GE(std::abs(nees(1) - nees(0)), least_difference) << type;
  }
}

}  // namespace
}  // namespace alidade
