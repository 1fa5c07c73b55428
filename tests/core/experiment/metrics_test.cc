// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metrics.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "alidade/base/random.h"
#include "alidade/base/statistics.h"
#include "sensors/stereo_disparity.h"
#include "support/systems.h"

namespace alidade {
namespace {

constexpr double kPi = std::numbers::pi;

Space SpaceOf(const std::string& name, const std::string& unit, const Geometry& geometry) {
  Space space;
  space.name = name;
  space.unit = unit;
  space.elements.assign(geometry.ambient, "");
  for (int i = 0; geometry.ambient > 1 && i < geometry.ambient; ++i) {
    space.elements[i] = std::string(1, static_cast<char>('x' + i));
  }
  space.geometry = geometry;
  return space;
}

class FakeSource : public Source {
 public:
  explicit FakeSource(std::vector<StreamInfo> truths) : truths_(std::move(truths)) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame&) override { return false; }

 private:
  std::vector<StreamInfo> streams_, truths_;
};

/// Computes the metrics of one estimator. The test sets the states of the estimator.
class MetricsOf {
 public:
  /// `prior_sigma` is the sigma of the prior of block 0; 0: it has no prior.
  MetricsOf(const StateLayout& layout, const std::vector<StreamInfo>& truths, int segments = 0,
            double prior_sigma = 0.0)
      : source_(truths), state_(layout) {
    named_.problem.layout = layout;
    if (prior_sigma > 0.0) {
      named_.problem.priors.push_back(
          {0, {0.0}, Eigen::MatrixXd::Constant(1, 1, prior_sigma * prior_sigma), ""});
    }
    const SharedSensor sensor = MakeSensor(StereoDisparity(400.0, 0.065, 1.0), "stereo_disparity");
    named_.problem.sensors.push_back({"stereo", "disparity", sensor, {}});
    std::vector<Segment> list;
    for (int i = 0; i < segments; ++i) list.push_back({"s" + std::to_string(i), 0, true, sensor});
    in_segment_.assign(segments, false);
    metrics_.emplace(named_, source_.truths(), list);
  }

  State& state() { return state_; }
  std::vector<bool>& in_segment() { return in_segment_; }
  /// Adds the current state as the estimate at the next timestamp, which is 0.1 s later.
  void Add(const std::vector<std::vector<double>>& truth, const UpdateReport& report = {}) {
    SourceFrame frame;
    frame.timestamp = timestamp_;
    frame.truth = truth;
    metrics_->Add(frame, in_segment_, state_, report);
    timestamp_ += 100'000'000;
  }
  void Skip(Timestamp dt) { timestamp_ += dt; }
  std::map<std::string, double> Finish() const { return metrics_->Finish(); }
  const Metrics& metrics() const { return *metrics_; }

 private:
  EstimatorSpec named_;
  FakeSource source_;
  State state_;
  std::vector<bool> in_segment_;
  std::optional<Metrics> metrics_;
  Timestamp timestamp_ = 0;
};

StateLayout Scalars(const std::vector<std::string>& names) {
  StateLayout layout;
  for (const std::string& name : names) {
    layout.Declare(name, name.substr(0, name.find('.')), SpaceOf(name, "m", Geometry::Vector(1)));
  }
  return layout;
}

/// Returns the metrics of a state with one scalar `a.x`, whose variance is 4 m^2.
MetricsOf OneScalar(int segments = 0) {
  MetricsOf one(Scalars({"a.x"}), {{"x", 1}}, segments);
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Constant(1, 1, 4.0));
  return one;
}

TEST(Metrics, TakesErrorsByHand) {
  MetricsOf one = OneScalar();
  one.Add({{3.0}});   // error -3 m, sigma 2 m: within 1.96 sigma
  one.Add({{-4.0}});  // error 4 m: more than 1.96 sigma, which is 3.92 m
  one.Add({{}});      // the truth is unknown
  const auto metrics = one.Finish();
  EXPECT_DOUBLE_EQ(metrics.at("rmse:a.x"), std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(metrics.at("final_error:a.x"), 4.0);
  EXPECT_DOUBLE_EQ(metrics.at("coverage95:a.x"), 0.5);
  EXPECT_DOUBLE_EQ(metrics.at("nees.mean:a"), (9.0 / 4.0 + 16.0 / 4.0) / 2.0);
  EXPECT_DOUBLE_EQ(metrics.at("nees.within95:a"), 0.5);  // 2.25 <= chi2(0.95, 1) = 3.84 < 4
  EXPECT_EQ(metrics.count("lag_ms:a.x"), 0u);
  EXPECT_EQ(one.metrics().units().at("a.x"), "m");
}

// The elements of an orientation and of a direction have no unit. The errors of both blocks are in
// rad.
TEST(Metrics, ErrorsOfRotationsAreInRad) {
  StateLayout layout;
  layout.Declare("a.q", "a", SpaceOf("q", "", Geometry::UnitQuaternion()));
  layout.Declare("a.m", "a", SpaceOf("m", "", Geometry::UnitVector()));
  layout.Declare("a.share", "a", SpaceOf("share", "", Geometry::Vector(2)));
  const MetricsOf one(layout, {{"q", 4}, {"m", 3}, {"share", 2}}, 0);
  const std::map<std::string, std::string> units = one.metrics().units();
  EXPECT_EQ(units.at("a.q"), "rad");
  EXPECT_EQ(units.at("a.m"), "rad");
  EXPECT_FALSE(units.contains("a.share"));
}

TEST(Metrics, TakesSegmentsApart) {
  MetricsOf one = OneScalar(2);
  one.in_segment() = {true, false};
  one.Add({{1.0}});
  one.in_segment() = {false, false};
  one.Add({{2.0}});
  const auto metrics = one.Finish();
  EXPECT_DOUBLE_EQ(metrics.at("rmse:a.x"), std::sqrt(2.5));
  EXPECT_DOUBLE_EQ(metrics.at("rmse:a.x@s0"), 1.0);
  EXPECT_DOUBLE_EQ(metrics.at("nees.mean:a@s0"), 0.25);
  EXPECT_EQ(metrics.count("rmse:a.x@s1"), 0u);
}

TEST(Metrics, TakesErrorsOnTheManifold) {
  StateLayout layout;
  layout.Declare("a.heading", "a", SpaceOf("heading", "rad", Geometry::Angle()));
  layout.Declare("a.attitude", "a", SpaceOf("attitude", "rad", Geometry::UnitQuaternion()));
  MetricsOf one(layout, {{"heading", 1}, {"attitude", 4}});
  const double heading = -kPi + 0.02;
  // The quaternion is negative and describes a rotation by 0.2 rad about x.
  const double attitude[4] = {-std::cos(0.1), -std::sin(0.1), 0.0, 0.0};
  one.state().Add(0, &heading, Eigen::MatrixXd::Identity(1, 1));
  one.state().Add(1, attitude, Eigen::MatrixXd::Identity(3, 3));
  one.Add({{kPi - 0.03}, {1.0, 0.0, 0.0, 0.0}});
  const auto metrics = one.Finish();
  EXPECT_NEAR(metrics.at("rmse:a.heading"), 0.05, 1e-12);
  EXPECT_NEAR(metrics.at("rmse:a.attitude"), 0.2, 1e-12);
  EXPECT_NEAR(metrics.at("nees.mean:a"), (0.05 * 0.05 + 0.2 * 0.2) / 4.0, 1e-12);
}

TEST(Metrics, TakesTheErrorWhereTheCovarianceIs) {
  // The basis of the tangent space differs from point to point. The error e must use the basis at
  // the estimate.
  StateLayout layout;
  layout.Declare("a.bearing", "a", SpaceOf("bearing", "", Geometry::UnitVector()));
  MetricsOf one(layout, {{"bearing", 3}});
  const double estimate[3] = {0.48, 0.6, 0.64}, error[2] = {0.3, 0.0};
  double truth[3];
  Geometry::UnitVector().Plus(estimate, error, truth);
  one.state().Add(0, estimate, Eigen::Vector2d(0.09, 1e-6).asDiagonal().toDenseMatrix());
  one.Add({{truth[0], truth[1], truth[2]}});
  EXPECT_NEAR(one.Finish().at("nees.mean:a"), 0.5, 1e-9);
}

/// Sets every truth to 1 and every state to 0. Returns the blocks that have a metric.
std::vector<std::string> Matched(const std::vector<std::string>& blocks,
                                 const std::vector<StreamInfo>& truths) {
  MetricsOf one(Scalars(blocks), truths);
  std::vector<std::vector<double>> truth;
  for (const StreamInfo& info : truths) truth.emplace_back(info.size, 1.0);
  const double zero = 0.0;
  for (int id = 0; id < static_cast<int>(blocks.size()); ++id) {
    one.state().Add(id, &zero, Eigen::MatrixXd::Identity(1, 1));
  }
  one.Add(truth);
  std::vector<std::string> names;
  for (const auto& [key, value] : one.Finish()) {
    if (key.starts_with("rmse:")) names.push_back(key.substr(5));
  }
  return names;
}

TEST(Metrics, MatchesTruthsByName) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(Matched({"a.x", "b.y"}, {{"x", 1}, {"b.y", 1}}), (Names{"a.x", "b.y"}));
  // Ambiguous: x may belong to both blocks.
  EXPECT_EQ(Matched({"a.x", "b.x"}, {{"x", 1}}), Names{});
  EXPECT_EQ(Matched({"a.x", "b.x"}, {{"x", 1}, {"b.x", 1}}), Names{"b.x"});
  EXPECT_EQ(Matched({"a.x"}, {{"x", 2}}), Names{});  // truth and block differ in size
  EXPECT_EQ(Matched({"a.x"}, {{"a", 1}, {"ax", 1}}), Names{});
}

TEST(Metrics, PrefersTheFullName) {
  MetricsOf one(Scalars({"a.x"}), {{"x", 1}, {"a.x", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Identity(1, 1));
  one.Add({{5.0}, {1.0}});
  EXPECT_DOUBLE_EQ(one.Finish().at("rmse:a.x"), 1.0);
}

TEST(Metrics, LeavesOutBlocksWithoutValueOrCovariance) {
  StateLayout layout = Scalars({"a.waits"});
  layout.Declare("a.fixed", "a", SpaceOf("fixed", "", Geometry::Vector(1)), BlockStatus::kConstant);
  MetricsOf one(layout, {{"waits", 1}, {"fixed", 1}});
  const double zero = 0.0;
  one.state().Add(1, &zero, Eigen::MatrixXd());
  one.Add({{1.0}, {1.0}});
  const auto metrics = one.Finish();
  EXPECT_EQ(metrics.count("rmse:a.waits"), 0u);
  EXPECT_EQ(metrics.at("rmse:a.fixed"), 1.0);
  EXPECT_EQ(metrics.count("coverage95:a.fixed"), 0u);
  EXPECT_EQ(metrics.count("nees.mean:a"), 0u);
}

TEST(Metrics, NeesOfErrorsDrawnFromPIsOne) {
  // The elements are correlated and differ widely in size. The variances are 4 and 1e-6, and the
  // correlation is 0.6.
  Eigen::Matrix2d p;
  p << 4.0, 0.6 * 2.0 * 1e-3, 0.6 * 2.0 * 1e-3, 1e-6;
  const Eigen::Matrix2d root = p.llt().matrixL();
  MetricsOf one(Scalars({"a.x", "a.y"}), {{"x", 1}, {"y", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, p.topLeftCorner(1, 1));
  one.state().Add(1, &zero, p.bottomRightCorner(1, 1));
  one.state().covariance().SetBlock(1, 0, p.block(1, 0, 1, 1));
  Random random(1);
  const int n = 20'000;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d error = root * Eigen::Vector2d(random.Normal(), random.Normal());
    one.Add({{-error[0]}, {-error[1]}});
  }
  const auto metrics = one.Finish();
  // chi2(2) / 2 has the variance 1, and a proportion s has the variance s (1 - s), each divided by
  // n. The tolerance is five standard deviations.
  EXPECT_NEAR(metrics.at("nees.mean:a"), 1.0, 5.0 / std::sqrt(n));
  EXPECT_NEAR(metrics.at("nees.within95:a"), 0.95, 5.0 * std::sqrt(0.95 * 0.05 / n));
  EXPECT_NEAR(metrics.at("coverage95:a.x"), 0.95, 5.0 * std::sqrt(0.95 * 0.05 / n));
}

TEST(Metrics, BoundsOfTheNeesAreThoseOfIndependentErrors) {
  MetricsOf one = OneScalar();
  Random random(1);
  for (int i = 0; i < 2000; ++i) one.Add({{2.0 * random.Normal()}});
  const auto metrics = one.Finish();
  // The errors are white, so tau is 1 except for a sampling error.
  const Interval bounds = ConsistencyBounds(1.0, 2000.0);
  EXPECT_EQ(metrics.at("nees.dof:a"), 1.0);
  EXPECT_NEAR(metrics.at("nees.low:a"), bounds.low, 0.3 * (1.0 - bounds.low));
  EXPECT_NEAR(metrics.at("nees.high:a"), bounds.high, 0.3 * (bounds.high - 1.0));
}

TEST(Metrics, BoundsOfTheNeesAreWideWhereErrorsStay) {
  MetricsOf one = OneScalar();
  for (int i = 0; i < 2000; ++i) one.Add({{4.0}});
  const auto metrics = one.Finish();
  EXPECT_DOUBLE_EQ(metrics.at("nees.mean:a"), 4.0);
  // A constant error counts as one sample: chi2(0.975; 1) = 5.024.
  EXPECT_NEAR(metrics.at("nees.high:a"), ChiSquareQuantile(0.975, 1), 1e-6);
}

TEST(Metrics, NeesIsOfEstimatedBlocksAlone) {
  StateLayout layout = Scalars({"a.x"});
  layout.Declare("a.y", "a", SpaceOf("y", "m", Geometry::Vector(1)), BlockStatus::kConsider);
  MetricsOf one(layout, {{"x", 1}, {"y", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Constant(1, 1, 4.0));
  one.state().Add(1, &zero, Eigen::MatrixXd::Constant(1, 1, 1.0));
  one.Add({{3.0}, {100.0}});
  const auto metrics = one.Finish();
  EXPECT_DOUBLE_EQ(metrics.at("nees.mean:a"), 9.0 / 4.0);
  EXPECT_DOUBLE_EQ(metrics.at("nees.within95:a"), 1.0);  // 2.25 <= chi2(0.95, 1) = 3.84
  EXPECT_DOUBLE_EQ(metrics.at("rmse:a.y"), 100.0);
}

TEST(Metrics, NeesLeavesOutSingularCovariances) {
  const Eigen::Matrix2d singular = Eigen::Matrix2d::Ones();
  MetricsOf one(Scalars({"a.x", "a.y", "b.x"}), {{"a.x", 1}, {"a.y", 1}, {"b.x", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, singular.topLeftCorner(1, 1));
  one.state().Add(1, &zero, singular.topLeftCorner(1, 1));
  one.state().Add(2, &zero, Eigen::MatrixXd::Zero(1, 1));
  one.state().covariance().SetBlock(1, 0, singular.topLeftCorner(1, 1));
  one.Add({{1.0}, {2.0}, {1e-9}});
  EXPECT_EQ(one.Finish().count("nees.mean:a"), 0u);
  EXPECT_EQ(one.Finish().count("nees.mean:b"), 0u);
  one.state().covariance().SetBlock(0, 0, Eigen::MatrixXd::Constant(1, 1, std::nan("")));
  one.Add({{1.0}, {2.0}, {1.0}});
  for (const auto& [key, value] : one.Finish()) EXPECT_FALSE(std::isnan(value)) << key;
}

TEST(Metrics, AnEstimateThatIsNotFiniteSpoilsItsRmse) {
  MetricsOf one = OneScalar();
  one.state().values()[0] = std::nan("");
  one.Add({{1.0}});
  EXPECT_TRUE(std::isinf(one.Finish().at("rmse:a.x")));
}

TEST(Metrics, LagIsInMilliseconds) {
  MetricsOf one = OneScalar();
  for (int i = 0; i < 152; ++i) {  // the delay is 2.5 samples of 100 ms
    one.state().values()[0] = std::sin(0.083 * (i - 2.5));
    one.Add({{std::sin(0.083 * i)}});
  }
  EXPECT_NEAR(one.Finish().at("lag_ms:a.x"), 250.0, 1.0);
  one.Skip(50'000'000);  // after this gap the samples are not evenly spaced
  one.Add({{0.0}});
  EXPECT_EQ(one.Finish().count("lag_ms:a.x"), 0u);
}

TEST(Metrics, LagOfALongRunIsThatOfItsBeginning) {
  MetricsOf one = OneScalar();
  const auto x = [](double i) { return std::sin(0.083 * i + 20.0 * std::sin(0.001 * i)); };
  for (int i = 0; i < 100'000; ++i) {
    one.state().values()[0] = x(i - 1.5);
    one.Add({{x(i)}});
  }
  one.Skip(50'000'000);  // neither the gap nor any later sample has an effect
  for (int i = 0; i < 1000; ++i) one.Add({{0.0}});
  EXPECT_NEAR(one.Finish().at("lag_ms:a.x"), 150.0, 1.0);
}

TEST(Metrics, LagOfAnAngleSeesNoJumps) {
  StateLayout layout;
  layout.Declare("a.heading", "a", SpaceOf("heading", "rad", Geometry::Angle()));
  MetricsOf one(layout, {{"heading", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Identity(1, 1));
  const auto heading = [](double i) { return 4.0 * std::sin(0.083 * i); };
  for (int i = 0; i < 152; ++i) {
    one.state().values()[0] = Angle::Wrap(heading(i - 1.5));
    one.Add({{Angle::Wrap(heading(i))}});
  }
  EXPECT_NEAR(one.Finish().at("lag_ms:a.heading"), 150.0, 1.0);
}

TEST(Metrics, TellsOnceOfErrorsBeyondTenSigma) {
  MetricsOf one = OneScalar();
  for (int i = 0; i < 19; ++i) one.Add({{20.1}});  // sigma is 2 m
  one.Add({{20.0}});                               // exactly 10 sigma counts as inside
  for (int i = 0; i < 19; ++i) one.Add({{20.1}});
  EXPECT_TRUE(one.metrics().events().empty());
  one.Add({{21.0}});
  ASSERT_EQ(one.metrics().events().size(), 1u);
  for (int i = 0; i < 40; ++i) one.Add({{20.1}});
  ASSERT_EQ(one.metrics().events().size(), 1u);
  const Event& event = one.metrics().events()[0];
  EXPECT_EQ(event.kind, EventKind::kLost);
  EXPECT_EQ(event.timestamp, 39 * Timestamp{100'000'000});
  EXPECT_EQ(event.text,
            "a.x: the error, 21 m, exceeded 10 sigma for 20 timestamps in a row; sigma is 2 m");
}

// The truth has a sigma of 3 m and the filter has a sigma of 2 m, so the error has the variance 13
// m^2.
TEST(Metrics, TheUncertaintyOfTheTruthBelongsToTheError) {
  MetricsOf one(Scalars({"a.x"}), {{"x", 1, 3.0}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Constant(1, 1, 4.0));
  for (int i = 0; i < 30; ++i) one.Add({{36.0}});  // 10 sigma are 36.06 m
  EXPECT_TRUE(one.metrics().events().empty());
  EXPECT_NEAR(one.Finish().at("nees.mean:a"), 36.0 * 36.0 / 13.0, 1e-9);
  EXPECT_EQ(one.Finish().at("rmse:a.x"), 36.0);
  for (int i = 0; i < 70; ++i) one.Add({{7.06}});  // 1.96 sigma are 7.067 m
  EXPECT_NEAR(one.Finish().at("coverage95:a.x"), 0.7, 1e-12);
  for (int i = 0; i < 20; ++i) one.Add({{36.1}});
  ASSERT_EQ(one.metrics().events().size(), 1u);
}

// A filter with nearly zero variance is compared with a truth of sigma 0.1 m. Errors beyond 10
// sigma are still found.
TEST(Metrics, AMeasuredTruthTellsOfAFilterThatIsTooSure) {
  MetricsOf one(Scalars({"a.x"}), {{"x", 1, 0.1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Constant(1, 1, 1e-12));
  // The error grows to 1 m at the 20th timestamp.
  for (int i = 0; i < 60; ++i) one.Add({{0.05 * i}});
  ASSERT_EQ(one.metrics().events().size(), 1u);
  EXPECT_EQ(one.metrics().events()[0].kind, EventKind::kLost);
}

TEST(Metrics, AKnownValueIsNotInconsistent) {
  MetricsOf one(Scalars({"a.x"}), {{"x", 1}});
  const double zero = 0.0;
  one.state().Add(0, &zero, Eigen::MatrixXd::Zero(1, 1));
  for (int i = 0; i < 50; ++i) one.Add({{1e-17}});
  EXPECT_TRUE(one.metrics().events().empty());
}

TEST(Metrics, AVarianceOfTheSizeOfItsRoundingErrorsIsZero) {
  for (const double variance : {1e-24, -1e-24}) {
    MetricsOf one(Scalars({"a.x"}), {{"x", 1}}, 0, 1.0);
    const double zero = 0.0;
    one.state().Add(0, &zero, Eigen::MatrixXd::Constant(1, 1, variance));
    for (int i = 0; i < 50; ++i) one.Add({{1e-6}});
    EXPECT_TRUE(one.metrics().events().empty()) << variance;
  }
}

TEST(Metrics, AFrameOlderThanTheStateHasNoError) {
  MetricsOf one = OneScalar(1);
  one.in_segment() = {true};
  UpdateReport stale;
  stale.stale = true;
  one.Add({{99.0}}, stale);
  EXPECT_TRUE(one.Finish().empty());
  one.Add({{1.0}});
  EXPECT_DOUBLE_EQ(one.Finish().at("rmse:a.x@s0"), 1.0);
  EXPECT_DOUBLE_EQ(one.Finish().at("nees.mean:a"), 0.25);
}

MeasurementReport ReportOf(Outcome outcome, double nis, int dof) {
  MeasurementReport report;
  report.sensor = 0;
  report.outcome = outcome;
  report.nis = nis;
  report.dof = dof;
  return report;
}

TEST(Metrics, CountsOutcomesAndTakesNisOfWhatIsAccepted) {
  MetricsOf one = OneScalar();
  UpdateReport report;
  report.Add() = ReportOf(Outcome::kAccepted, 3.0, 2);
  report.Add() = ReportOf(Outcome::kGated, 99.0, 2);
  report.Add() = ReportOf(Outcome::kAccepted, 1.0, 2);
  one.Add({{0.0}}, report);
  one.Add({{0.0}}, report);
  EXPECT_DOUBLE_EQ(one.Finish().at("nis.mean:stereo"), 1.0);
  EXPECT_EQ(one.metrics().counts().at("accepted:stereo"), 4);
  EXPECT_EQ(one.metrics().counts().at("gated:stereo"), 2);
  EXPECT_EQ(one.metrics().counts().size(), 2u);
}

TEST(Metrics, BoundsOfTheNisCountFrames) {
  MetricsOf one = OneScalar();
  UpdateReport report;
  report.Add() = ReportOf(Outcome::kAccepted, 3.0, 2);
  report.Add() = ReportOf(Outcome::kAccepted, 1.0, 2);
  for (int i = 0; i < 50; ++i) one.Add({{0.0}}, report);
  const Interval all = ConsistencyBounds(2.0, 50.0);
  EXPECT_DOUBLE_EQ(one.Finish().at("nis.low:stereo"), all.low);
  EXPECT_DOUBLE_EQ(one.Finish().at("nis.high:stereo"), all.high);
  // A gated measurement had a NIS of at least the threshold, which is 9.
  report.Clear();
  report.Add() = ReportOf(Outcome::kGated, 9.0, 2);
  one.Add({{0.0}}, report);
  EXPECT_DOUBLE_EQ(one.Finish().at("nis.high:stereo"), ConsistencyBounds(2.0, 50.0, 9.0).high);
}

}  // namespace
}  // namespace alidade
