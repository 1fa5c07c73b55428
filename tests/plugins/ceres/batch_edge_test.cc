// SPDX-License-Identifier: Apache-2.0
#include "batch_landmarks_fixture.h"

/// Tests landmarks whose optimum in a sparse batch is at the boundary of the domain of their model.
namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Found;

constexpr double kOffsetSigma = 0.1, kFirstSigma = 0.3, kPeriod = 0.1, kEdgeSlope = 0.5;
constexpr int kViews = 4;

/// Sensor z = p - r. A landmark is initialised only if z_z > z_x / 2.
struct OffsetBeyond : testing::Offset {
  OffsetBeyond() : Offset(kOffsetSigma) {}
  template <class T>
  bool Initialise(const T* r, const T* z, T* p) const {
    if (!(z[2] - kEdgeSlope * z[0] > T(0.0))) return false;
    for (int i = 0; i < 3; ++i) p[i] = r[i] + z[i];
    return true;
  }
};

/// Returns the measurements of landmarks 7 and 8. If `inside` is true, landmark 7 stays inside its
/// domain. Otherwise its measurements imply a position outside the domain.
std::vector<std::array<Vector3d, 2>> OffsetsOf(bool inside) {
  std::vector<std::array<Vector3d, 2>> seen;
  for (int k = 0; k < kViews; ++k) {
    const double out = k == 0 || inside ? 0.0 : 0.6;
    seen.push_back({Vector3d(0.3 - 0.02 * k, 0.1, 0.2 + 0.01 * k - out),
                    Vector3d(-1.0 + 0.03 * k, 0.2 * k, 2.0 - 0.05 * k)});
  }
  return seen;
}

/// Computes A and b of the linear problem A x = b, x = (r_0 .. r_3, p_7, p_8).
void WriteOut(const std::vector<std::array<Vector3d, 2>>& seen, MatrixXd& a, VectorXd& b) {
  constexpr int kSize = 3 * (kViews + 2);
  a.setZero(kSize, kSize);
  b.setZero(kSize);
  const auto add = [&](int plus, int minus, const Vector3d& z, double sigma) {
    MatrixXd j = MatrixXd::Zero(3, kSize);
    j.middleCols(3 * plus, 3).setIdentity();
    if (minus >= 0) j.middleCols(3 * minus, 3) -= MatrixXd::Identity(3, 3);
    a += j.transpose() * j / (sigma * sigma);
    b += j.transpose() * z / (sigma * sigma);
  };
  add(0, -1, Vector3d::Zero(), kFirstSigma);
  for (int k = 0; k < kViews; ++k) {
    if (k > 0) add(k, k - 1, Vector3d::Zero(), testing::kWalk * std::sqrt(kPeriod));
    for (int i = 0; i < 2; ++i) {
      add(kViews + i, k, seen[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)],
          kOffsetSigma);
    }
  }
}

Problem EdgeSystem() { return testing::MapSystem(OffsetBeyond(), {}, kFirstSigma); }

std::vector<Frame> FramesOf(const std::vector<std::array<Vector3d, 2>>& seen) {
  std::vector<Frame> frames;
  for (int k = 0; k < kViews; ++k) {
    std::vector<testing::Observation> observations;
    for (int i = 0; i < 2; ++i) {
      const Vector3d& z = seen[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
      observations.push_back({7 + i, {z[0], z[1], z[2]}});
    }
    frames.push_back(testing::FrameOf(kPeriod * k, observations));
  }
  return frames;
}

Found SolveSparse(const std::vector<std::array<Vector3d, 2>>& seen) {
  return testing::Solve(EdgeSystem(), FramesOf(seen), "solver: sparse\n");
}

void ExpectSolution(const Found& found, const VectorXd& x, const MatrixXd& p) {
  ASSERT_FALSE(found.failed);
  // The tolerance is relative to positions of about 0.1 m. Landmark 7 stays 1e-9 sigma from the
  // boundary.
  constexpr double kNear = 1e-8;
  for (int k = 0; k < kViews; ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_LT((found.Camera(at) - x.segment<3>(3 * k)).norm(), kNear) << k;
    const MatrixXd own = found.states[at].covariance().Dense(),
                   expected = p.block(3 * k, 3 * k, 3, 3);
    EXPECT_LT((own - expected).norm(), kNear * expected.norm()) << k;
  }
  for (int i = 0; i < 2; ++i) {
    const int at = 3 * (kViews + i);
    EXPECT_LT((found.Landmark(7 + i).position - x.segment<3>(at)).norm(), kNear) << i;
    const MatrixXd expected = p.block(at, at, 3, 3);
    EXPECT_LT((found.Landmark(7 + i).covariance - expected).norm(), kNear * expected.norm()) << i;
  }
}

// Expects the minimum under the constraint  p_z - r_0z = (p_x - r_0x) / 2  of landmark 7. The
// landmark slides along the boundary, so its x still changes after it has reached the boundary. The
// covariances are those without the boundary.
TEST(CeresBatchEdge, OneLandmarkAtTheEdgeKeepsNoOtherFromItsOptimum) {
  const auto seen = OffsetsOf(false);
  MatrixXd a;
  VectorXd b;
  WriteOut(seen, a, b);
  const Eigen::Index n = b.size();
  MatrixXd bordered = MatrixXd::Zero(n + 1, n + 1);
  bordered.topLeftCorner(n, n) = a;
  for (const auto& [at, value] : {std::pair(3 * kViews + 2, 1.0), std::pair(2, -1.0),
                                  std::pair(3 * kViews, -kEdgeSlope), std::pair(0, kEdgeSlope)}) {
    bordered(n, at) = bordered(at, n) = value;
  }
  VectorXd right = VectorXd::Zero(n + 1);
  right.head(n) = b;
  const VectorXd x = bordered.partialPivLu().solve(right).head(n);
  EXPECT_GT((x - a.llt().solve(b)).norm(), 0.1);
  const Found found = SolveSparse(seen);
  ExpectSolution(found, x, a.inverse());
  const std::string& said = found.events.back().text;
  EXPECT_NE(said.find(": converged, 1 landmark at the edge of its domain: 7; sparse"),
            std::string::npos)
      << said;
}

// Landmark 7 reaches the boundary in the second frame and stays there.
TEST(CeresBatchEdge, WindowsAndFullInformationNameItOnce) {
  const auto seen = OffsetsOf(false);
  const Found batch = SolveSparse(seen);
  const Problem problem = EdgeSystem();
  const auto window = testing::MakeFixedLag(problem, "lag_s: 10\n");
  const auto filter = testing::MakeBatch(problem, "solver: sparse\nmode: filtering\n");
  for (Estimator* const estimator : {window.get(), filter.get()}) {
    std::vector<std::string> said;
    for (const Frame& frame : FramesOf(seen)) {
      for (const Event& event : estimator->Process(frame).events) {
        if (event.kind != EventKind::kEdgeOfDomain) continue;
        said.push_back(std::to_string(event.timestamp / 100'000'000) + ": " + event.text);
      }
    }
    ASSERT_FALSE(estimator->failed());
    EXPECT_EQ(said, (std::vector<std::string>{"1: 1 landmark at the edge of its domain: 7"}));
    for (const LandmarkEstimate& one : estimator->landmarks()) {
      EXPECT_LT((one.position - batch.Landmark(one.id).position).norm(), 1e-8) << one.id;
    }
  }
}

/// Sensor z = exp(-r_z). The first Gauss-Newton step is much too long. Each of the next steps goes
/// back by 1 m.
struct Exponential : Sensor<Vec<1>, Vec<3>> {
  static constexpr std::array kRoles{testing::kPosition};
  static constexpr Quantity kMeasurement{"z", "", "", ""};
  template <class T>
  bool Predict(const T* r, T* z) const {
    using std::exp;
    z[0] = exp(-r[2]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.01);
  }
};

// During the iterations the camera is very far back. The landmark, 4 m ahead of this camera, then
// tends to a place behind the first camera. At the optimum the landmark is 1 m ahead, as with the
// dense solver.
TEST(CeresBatchEdge, ALandmarkIsLetGoOnceItCostsLessInside) {
  Problem problem = testing::MapSystem(OffsetBeyond(), {});
  testing::AddSensor(problem, "e", MakeSensor(Exponential(), "exponential"), {"cam.position"});
  std::vector<Frame> frames;
  for (int k = 0; k < kViews; ++k) {
    const double z = k == 0 ? 1.0 : 4.0;
    frames.push_back(testing::FrameOf(kPeriod * k, {{7, {0.0, 0.0, z}}}));
    if (k == 0) continue;
    frames.back().measurements.push_back({frames.back().timestamp, 1, -1, {std::exp(3.0)}, {}});
  }
  const Found found = testing::Solve(problem, frames, "solver: sparse\n"),
              expected = testing::Solve(problem, frames, "solver: dense\n");
  const std::string& said = found.events.back().text;
  ASSERT_FALSE(found.failed) << said;
  ASSERT_FALSE(expected.failed) << expected.events.back().text;
  EXPECT_NE(said.find(": converged; sparse"), std::string::npos) << said;
  EXPECT_NEAR(found.Landmark(7).position[2], expected.Landmark(7).position[2], 1e-7);
  EXPECT_NEAR(found.Landmark(7).position[2], 1.0, 0.2);
  for (std::size_t k = 0; k < kViews; ++k) {
    EXPECT_NEAR(found.Camera(k)[2], expected.Camera(k)[2], 1e-7) << k;
  }
}

TEST(CeresBatchEdge, NoneIsNamedWhereTheOptimumIsInside) {
  const auto seen = OffsetsOf(true);
  MatrixXd a;
  VectorXd b;
  WriteOut(seen, a, b);
  const Found found = SolveSparse(seen);
  ExpectSolution(found, a.llt().solve(b), a.inverse());
  EXPECT_NE(found.events.back().text.find(": converged; sparse"), std::string::npos);
}

}  // namespace
}  // namespace alidade
