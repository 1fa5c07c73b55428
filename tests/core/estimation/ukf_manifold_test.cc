// SPDX-License-Identifier: Apache-2.0
//
// Tests the unscented filter on blocks of every geometry, and on a state without a covariance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "alidade/base/random.h"
#include "alidade/estimation/ukf.h"
#include "support/manifold_models.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr double kPriorSigma = 0.02, kWalkSigma = 0.01, kSensorSigma = 0.02;

/// Motion model x' = x (+) w, w ~ N(0, kWalkSigma^2 I).
template <class G>
struct Wandering : Motion<G::kTangent, G> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    G::Plus(x, w, next);
  }
  void SqrtQ(double, MatrixRef l) const {
    for (int i = 0; i < G::kTangent; ++i) l(i, i) = kWalkSigma;
  }
};

/// Returns a problem with `n` tangent elements in blocks of the geometry G, or with one block if G
/// has more elements. Each block has its own sensor.
template <class G>
Problem Wanderers(int n) {
  Problem problem;
  const SharedMotion model = MakeMotion(Wandering<G>(), "wandering");
  for (int i = 0; i < std::max(1, n / G::kTangent); ++i) {
    const std::string name = "b" + std::to_string(i);
    const BlockId id = problem.layout.Declare(name + ".x", name, model->blocks()[0]);
    problem.motions.push_back({name, model, {id}});
    Prior prior;
    prior.block = id;
    prior.mean = model->blocks()[0].geometry.Identity();
    prior.covariance =
        kPriorSigma * kPriorSigma * Eigen::MatrixXd::Identity(G::kTangent, G::kTangent);
    problem.priors.push_back(prior);
    AddSensor(problem, name, MakeSensor(ManifoldSensor<G, kSensorSigma>(), "itself"),
              {name + ".x"});
  }
  return problem;
}

Problem WanderersOf(std::uint32_t geometry, int n) {
  if (geometry == ALIDADE_VECTOR) return Wanderers<Vec<3>>(n);
  Problem problem;
  EXPECT_TRUE(VisitGeometry(geometry, [&]<class G>(G) { problem = Wanderers<G>(n); }));
  return problem;
}

/// Returns x (+) n, n ~ N(0, sigma^2 I).
std::vector<double> Disturbed(const Geometry& geometry, const std::vector<double>& x, double sigma,
                              Random& random) {
  std::vector<double> d(static_cast<std::size_t>(geometry.tangent)), moved(x.size());
  for (double& element : d) element = sigma * random.Normal();
  geometry.Plus(x.data(), d.data(), moved.data());
  return moved;
}

using GeometryAlphaSize = std::tuple<std::uint32_t, double, int>;
class UkfOf : public ::testing::TestWithParam<GeometryAlphaSize> {};

// The covariances are isotropic. Every step adds Q, and for the measured block 1/P+ = 1/P + 1/R.
// The sigma points are c sigma from the estimate, and c^2 <= 60. This distance changes the moments
// by a fraction c^2 sigma^2 / 12 <= 2e-3. Each correction changes the estimates by this fraction of
// an innovation of 0.04.
TEST_P(UkfOf, FollowsBlocksForAThousandSteps) {
  const auto [number, alpha, n] = GetParam();
  const Problem problem = WanderersOf(number, n);
  const Geometry& geometry = problem.layout[0].geometry();
  const std::size_t count = problem.layout.blocks().size();
  UkfOptions options;
  options.alpha = alpha;
  Ukf ukf(problem, options, StreamsOf(problem));
  Ekf ekf(problem, {}, StreamsOf(problem));
  Random random(41);
  std::vector<std::vector<double>> truth;
  for (const Prior& prior : problem.priors) truth.push_back(prior.mean);
  std::vector<double> p(count, kPriorSigma * kPriorSigma);
  for (int k = 0; k < 1000; ++k) {
    for (std::size_t b = 0; b < count && k > 0; ++b) {
      truth[b] = Disturbed(geometry, truth[b], kWalkSigma, random);
      p[b] += kWalkSigma * kWalkSigma;
    }
    const std::size_t seen = static_cast<std::size_t>(k) % count;
    Frame frame = FrameAt(0.1 * k, {});
    frame.measurements.push_back({frame.timestamp,
                                  static_cast<int>(seen),
                                  -1,
                                  Disturbed(geometry, truth[seen], kSensorSigma, random),
                                  {}});
    const UpdateReport& report = ukf.Process(frame);
    ASSERT_TRUE(report.events.empty()) << k << ": " << report.events[0].text;
    ASSERT_EQ(report.measurements()[0].outcome, Outcome::kAccepted) << k;
    ekf.Process(frame);
    p[seen] = 1.0 / (1.0 / p[seen] + 1.0 / (kSensorSigma * kSensorSigma));
    const Block& block = ukf.state().layout()[static_cast<BlockId>(seen)];
    const Eigen::MatrixXd own = ukf.state().covariance().Block(
        block.tangent_offset, geometry.tangent, block.tangent_offset, geometry.tangent);
    const Eigen::MatrixXd expected =
        p[seen] * Eigen::MatrixXd::Identity(geometry.tangent, geometry.tangent);
    ASSERT_LT((own - expected).norm(), 0.01 * p[seen]) << k;
    std::vector<double> between(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(ukf.state().value(static_cast<BlockId>(seen)),
                   ekf.state().value(static_cast<BlockId>(seen)), between.data());
    for (const double d : between) ASSERT_LT(std::abs(d), 1e-3) << k;
  }
}

std::string NameOf(const ::testing::TestParamInfo<GeometryAlphaSize>& one) {
  return std::string(FindGeometry(std::get<0>(one.param))->name) + "_alpha1e" +
         std::to_string(std::lround(-std::log10(std::get<1>(one.param)))) + "_n" +
         std::to_string(std::get<2>(one.param));
}
/// Returns the numbers of all geometries that a state can have.
std::vector<std::uint32_t> GeometriesOfStates() {
  std::vector<std::uint32_t> numbers;
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->number != ALIDADE_PRODUCT) numbers.push_back(row->number);
  }
  return numbers;
}
INSTANTIATE_TEST_SUITE_P(Few, UkfOf,
                         ::testing::Combine(::testing::ValuesIn(GeometriesOfStates()),
                                            ::testing::Values(1e-4, 1e-3, 0.01, 0.1, 1.0),
                                            ::testing::Values(6)),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(Many, UkfOf,
                         ::testing::Combine(::testing::ValuesIn(GeometriesOfStates()),
                                            ::testing::Values(1e-4, 0.01, 1.0),
                                            ::testing::Values(30)),
                         NameOf);

/// Motion model v' = v - dt k |v| v + w. At v = 0, v' is 0, but the derivative dv'/dv is NaN.
struct Dragged : Motion<2, Vec<2>> {
  static constexpr std::array kBlocks{Quantity{"v", "m/s", "", "x,y"}};
  template <class T>
  void Step(const T* v, const T* w, double dt_s, T* next) const {
    using std::sqrt;
    const T speed = sqrt(v[0] * v[0] + v[1] * v[1]);
    for (int i = 0; i < 2; ++i) next[i] = v[i] - 0.3 * dt_s * speed * v[i] + w[i];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = l(1, 1) = 0.1; }
};

// N = 4, so c = 2: the sigma points of v are 2 sigma away from the estimate. The step multiplies
// them by 1 - 0.3 dt 2 sigma.
TEST(Ukf, NeedsNoDerivativeOfTheMotion) {
  Problem problem;
  const SharedMotion model = MakeMotion(Dragged(), "dragged");
  const BlockId v = problem.layout.Declare("p.v", "p", model->blocks()[0]);
  problem.motions.push_back({"p", model, {v}});
  problem.priors.push_back({v, {0.0, 0.0}, 0.25 * Eigen::Matrix2d::Identity(), ""});
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  ekf.Process(FrameAt(0.1, {}));
  ASSERT_TRUE(ekf.failed()) << "the EKF must fail, because the derivative is NaN";
  UkfOptions options;
  options.alpha = 1.0;
  Ukf ukf(problem, options, {});
  ukf.Start(0);
  const UpdateReport& report = ukf.Process(FrameAt(0.1, {}));
  EXPECT_TRUE(report.events.empty()) << report.events[0].text;
  EXPECT_FALSE(ukf.failed());
  const double slowed = 1.0 - 0.3 * 0.1 * 2.0 * 0.5;
  const Eigen::Matrix2d expected = (0.25 * slowed * slowed + 0.01) * Eigen::Matrix2d::Identity();
  EXPECT_LT((ukf.state().covariance().Dense() - expected).norm(), 1e-14);
  EXPECT_NEAR(ukf.state().value(v)[0], 0.0, 1e-15);
}

/// In steps of more than 1 s, Qw is NaN if `in_noise` is true. Otherwise v' is NaN.
struct Breaking : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"v"}};
  bool in_noise = false;
  explicit Breaking(bool noise) : in_noise(noise) {}
  template <class T>
  void Step(const T* v, const T* w, double dt_s, T* next) const {
    next[0] = v[0] + w[0] + (!in_noise && dt_s > 1.0 ? std::nan("") : 0.0);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    l(0, 0) = in_noise && dt_s > 1.0 ? std::nan("") : 1.0;
  }
};

TEST(Ukf, AStepThatIsNotFiniteEndsItInTheWordsOfTheEkf) {
  for (const bool in_noise : {false, true}) {
    Problem problem;
    AddMotion(problem, "p", MakeMotion(Breaking(in_noise), "breaking"), {{"v", 1.0, 0.5}});
    Ekf ekf(problem, {}, {});
    Ukf ukf(problem, {}, {});
    for (Estimator* filter : std::initializer_list<Estimator*>{&ekf, &ukf}) {
      filter->Start(0);
      const UpdateReport& report = filter->Process(FrameAt(2.0, {}));
      EXPECT_TRUE(filter->failed());
      ASSERT_EQ(report.events.size(), 1u);
      EXPECT_EQ(report.events[0].kind, EventKind::kNotFinite);
      EXPECT_EQ(report.events[0].text,
                "the motion model of 'p' predicts a state that is not finite; last good state at "
                "0.000000 s: p.v = 1");
    }
  }
}

template <class G>
void ExpectReportsOfTheEkf() {
  const Problem problem = WithStatus(Wanderers<G>(6), "", BlockStatus::kConstant);
  Ekf ekf(problem, {}, StreamsOf(problem));
  Ukf ukf(problem, {}, StreamsOf(problem));  // kappa is 0
  Random random(42);
  for (int k = 0; k < 3; ++k) {
    Frame frame = FrameAt(0.1 * k, {});
    const Prior& prior = problem.priors[0];
    frame.measurements.push_back(
        {frame.timestamp,
         0,
         -1,
         Disturbed(problem.layout[0].geometry(), prior.mean, kSensorSigma, random),
         {}});
    const UpdateReport &expected = ekf.Process(frame), &found = ukf.Process(frame);
    EXPECT_TRUE(found.events.empty());
    const MeasurementReport &a = expected.measurements()[0], &b = found.measurements()[0];
    ASSERT_EQ(a.outcome, Outcome::kAccepted);
    EXPECT_EQ(b.outcome, Outcome::kAccepted);
    EXPECT_EQ(a.h, b.h);
    EXPECT_EQ(a.innovation, b.innovation);
    EXPECT_EQ(a.s, b.s);
    EXPECT_NEAR(a.nis, b.nis, 1e-14 * a.nis);  // S is factored in a different order
    EXPECT_EQ(std::vector<double>(ukf.state().value(0), ukf.state().value(0) + G::kAmbient),
              prior.mean);
  }
}

TEST(Ukf, WithoutACovarianceItReportsWhatTheEkfDoes) {
  ExpectReportsOfTheEkf<Vec<3>>();
  ExpectReportsOfTheEkf<Angle>();
  ExpectReportsOfTheEkf<UnitQuaternion>();
  ExpectReportsOfTheEkf<UnitVector>();
}

}  // namespace
}  // namespace alidade
