// SPDX-License-Identifier: Apache-2.0
//
// Tests every shipped model: as a plugin in the engine and in the batch, compiled into the program,
// and with the checker. A shipped model without a row is an error.
#include "alidade/check/check.h"
#include "alidade/estimation/iekf.h"
#include "alidade/experiment/estimator_plugin.h"
#include "every_model_fixture.h"

namespace alidade::testing {
namespace fs = std::filesystem;

TEST_P(EveryModel, IsTheSameAsAPluginAndCompiledIn) {
  const Problem compiled = row_.compiled_problem();
  Ekf of_plugin(system_, {}, AllStreams(system_)), of_struct(compiled, {}, AllStreams(compiled));
  for (const Frame& frame : FramesOf(system_, 100)) {
    for (const MeasurementReport& m : of_plugin.Process(frame).measurements()) {
      ASSERT_EQ(m.outcome, Outcome::kAccepted);
    }
    of_struct.Process(frame);
    const State &a = of_plugin.state(), &b = of_struct.state();
    for (std::size_t i = 0; i < a.values().size(); ++i) {
      ASSERT_NEAR(a.values()[i], b.values()[i], 1e-12) << i;
    }
    ASSERT_LT((a.covariance().Dense() - b.covariance().Dense()).norm(), 1e-12);
  }
  if (row_.expect_static_is_engine) row_.expect_static_is_engine(system_);
}

// If all models are linear, the last estimate of the batch equals that of the filter. The filter
// iterates its updates, so that it linearises a sensor near the estimate of the batch. Without the
// measurements of the sensor the batch would be off by 0.1 to 0.6 sigma.
TEST_P(EveryModel, GivesTheBatchItsFactors) {
  const auto& entries = Shipped().entries();
  if (std::none_of(entries.begin(), entries.end(),
                   [](const PluginEntry& entry) { return entry.name == "ceres_batch"; })) {
    GTEST_SKIP() << "this build does not contain the Ceres solver";
  }
  const Config config = Config::FromText("type: ceres_batch", "batch.yaml");
  const std::unique_ptr<Estimator> batch =
      CreateEstimator(Shipped(), "ceres_batch", config.root())(system_, AllStreams(system_));
  Iekf filter(system_, {}, AllStreams(system_));
  const std::vector<Frame> frames = FramesOf(system_, 20);
  for (const Frame& frame : frames) {
    batch->Process(frame);
    filter.Process(frame);
  }
  std::size_t emitted = 0;
  batch->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    ++emitted;
    if (k + 1 < frames.size()) return;
    for (const Block& block : state.layout().blocks()) {
      const int n = block.geometry().tangent;
      std::vector<double> d(static_cast<std::size_t>(n));
      const BlockId id = state.layout().Find(block.name);
      block.geometry().Minus(state.value(id), filter.state().value(id), d.data());
      for (int i = 0; i < n; ++i) {
        const double variance = filter.state().covariance().Variance(block.tangent_offset + i);
        EXPECT_LT(std::abs(d[i]), row_.nonlinearity * std::sqrt(variance)) << block.name;
      }
    }
  });
  EXPECT_FALSE(batch->failed());
  EXPECT_EQ(emitted, frames.size());
}

TEST_P(EveryModel, PassesTheChecker) {
  // A sensor and a motion model can have the same name. The tested sensor of a row is named `s`.
  const bool is_sensor = system_.sensors.back().name == "s";
  int checked = 0;
  for (const PluginEntry& entry : Shipped().entries()) {
    if (entry.name != row_.model || (entry.kind == kSensorKind) != is_sensor) continue;
    ++checked;
    CheckOptions options;
    options.timeout_s = 300.0;  // long enough for a busy machine and for sanitizers
    const std::vector<CheckResult> findings = CheckModel(entry, parameters_.root(), options);
    EXPECT_FALSE(AnyFailure(findings)) << CheckText(entry, findings);
  }
  EXPECT_EQ(checked, 1);
}

// The names of the tests contain the rows, such as
// `Scalars/EveryModel.PassesTheChecker/constant_0`.
TEST(Models, HaveARow) {
  std::set<std::string> rows, shipped;
  const ::testing::UnitTest& all = *::testing::UnitTest::GetInstance();
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const ::testing::TestSuite& suite = *all.GetTestSuite(s);
    if (!std::string(suite.name()).ends_with("/EveryModel")) continue;
    for (int i = 0; i < suite.total_test_count(); ++i) {
      const std::string name = suite.GetTestInfo(i)->name();
      const std::size_t model = name.find('/') + 1;
      rows.insert(name.substr(model, name.rfind('_') - model));
    }
  }
  for (const char* folder : {"motion_models", "sensors"}) {
    for (const auto& file : fs::directory_iterator(fs::path(ALIDADE_SOURCE_DIR) / folder)) {
      if (file.path().extension() == ".cc") shipped.insert(file.path().stem().string());
    }
  }
  for (const PluginEntry& entry : Shipped().entries()) {
    if (entry.is_model() && fs::equivalent(entry.plugin.parent_path(), ShippedFolder()))
      shipped.insert(entry.name);
  }
  EXPECT_EQ(rows, shipped) << "each shipped model needs a row in tests/plugins/every_model";
}

}  // namespace alidade::testing
