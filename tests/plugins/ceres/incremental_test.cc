// SPDX-License-Identifier: Apache-2.0
#include "batch_landmarks_fixture.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using testing::MakeBatch;
using testing::MapProblem;

/// Distance of two estimates, in sigmas, and relative distance of their covariances.
struct Apart {
  double state = 0.0, covariance = 0.0;
  std::ptrdiff_t whole = 0;  ///< number of frames that were solved from scratch
};
Apart Compare(const Estimator& found, const Estimator& expected) {
  const MatrixXd p = expected.state().covariance().Dense().topLeftCorner(3, 3);
  const MatrixXd its = found.state().covariance().Dense().topLeftCorner(3, 3);
  if (p.trace() == 0.0) return {0.0, its.norm(), 0};
  const Vector3d d = testing::PositionOf(found) - testing::PositionOf(expected);
  return {d.norm() / std::sqrt(p.trace()), (its - p).norm() / p.norm(), 0};
}

/// Returns the largest distances from the filtering batch, over all frames and the landmarks of the
/// final map.
Apart LargestOf(const Problem& problem, const std::vector<Frame>& frames,
                const std::string& above) {
  const auto incremental =
      MakeBatch(problem, "mode: incremental\nrelinearise_above: " + above + "\n");
  const auto whole = MakeBatch(problem, "mode: filtering\nsolver: sparse\n");
  Apart largest;
  for (const Frame& frame : frames) {
    const UpdateReport& report = incremental->Process(frame);
    largest.whole += std::ranges::count(report.events, EventKind::kSolvedAsAWhole, &Event::kind);
    whole->Process(frame);
    const Apart apart = Compare(*incremental, *whole);
    largest.state = std::max(largest.state, apart.state);
    largest.covariance = std::max(largest.covariance, apart.covariance);
  }
  EXPECT_FALSE(incremental->failed());
  const std::vector<LandmarkEstimate> map = incremental->landmarks();
  EXPECT_EQ(map.size(), whole->landmarks().size());
  for (const LandmarkEstimate& expected : whole->landmarks()) {
    const LandmarkEstimate* const landmark = testing::Find(map, expected.id);
    if (landmark == nullptr) {
      ADD_FAILURE() << "the map does not contain landmark " << expected.id;
      continue;
    }
    const double sigma = std::sqrt(expected.covariance.trace());
    largest.state =
        std::max(largest.state, (landmark->position - expected.position).norm() / sigma);
    largest.covariance =
        std::max(largest.covariance,
                 (landmark->covariance - expected.covariance).norm() / expected.covariance.norm());
  }
  return largest;
}

Apart LargestOf(const MapProblem& map, const std::string& above) {
  return LargestOf(map.Filter(), map.frames, above);
}

// Every change leads to a relinearisation. The result therefore equals the batch of the data so
// far.
TEST(IncrementalBatch, IsTheBatchOfTheDataSoFar) {
  const Apart apart = LargestOf(MapProblem(20, 12), "1e-10");
  EXPECT_LT(apart.state, 1e-7);
  EXPECT_LT(apart.covariance, 1e-6);
  EXPECT_EQ(apart.whole, 0);
}

// In the first frames the weights settle slowly, so these frames are solved from scratch.
TEST(IncrementalBatch, OfARobustLossToo) {
  MapProblem map(16, 12, 20);
  map.loss = {LossKind::kHuber, 1.345};
  const Apart apart = LargestOf(map, "1e-10");
  EXPECT_LT(apart.state, 1e-7);
  EXPECT_LT(apart.covariance, 1e-6);
  EXPECT_LE(apart.whole, 2);
}

// Blocks that moved by less than 0.03 sigma are not relinearised. The result is therefore close to
// that of the batch, but not equal.
TEST(IncrementalBatch, IsNearWhereItIsLinearisedNear) {
  const Apart apart = LargestOf(MapProblem(20, 12), "0.03");
  EXPECT_LT(apart.state, 0.1);
  EXPECT_LT(apart.covariance, 0.05);
  EXPECT_GT(apart.state, 1e-7);
  EXPECT_EQ(apart.whole, 0);
}

// Without relinearisation, a landmark moves with the camera of its first observation. For a linear
// map this motion is exact, except for changes that are too small to be propagated to earlier
// frames.
TEST(IncrementalBatch, OfALinearMapTheLandmarksFollowTheirCameras) {
  Random random(3);
  std::vector<Frame> frames;
  for (int k = 0; k < 12; ++k) {
    std::vector<testing::Observation> seen;
    for (int i = k / 3; i < k / 3 + 3; ++i) {
      const auto n = [&] { return 0.3 * random.Normal(); };
      seen.push_back({i, {0.4 * i - 0.1 * k + n(), n(), 2.0 + n()}});
    }
    frames.push_back(testing::FrameOf(0.1 * k, seen));
  }
  const Problem problem = testing::MapSystem(testing::Offset(0.2), LandmarkOptions(), 0.5);
  const Apart apart = LargestOf(problem, frames, "3");
  EXPECT_LT(apart.state, 0.01);
  EXPECT_LT(apart.covariance, 1e-8);
  EXPECT_EQ(apart.whole, 0);
}

// Landmarks that were not seen for a while leave the last matrix. These landmarks return to the
// matrix when they are seen again.
TEST(IncrementalBatch, TakesLandmarksBackThatWereGone) {
  MapProblem map(45, 9);
  for (std::size_t k = 12; k < map.frames.size(); ++k) {
    const bool gone = k < 32;
    std::erase_if(map.frames[k].measurements, [&](const Measurement& m) {
      return gone == (m.landmark < 5) && (gone || m.landmark > 6);
    });
  }
  const Apart apart = LargestOf(map, "1e-10");
  EXPECT_LT(apart.state, 1e-7);
  EXPECT_LT(apart.covariance, 1e-6);
  EXPECT_EQ(apart.whole, 0);
  // The part of the matrix to which the landmarks return is eliminated again.
  EXPECT_LT(LargestOf(map, "0.3").state, 0.5);
}

// In a linear system the full-information filter equals the Kalman filter at every frame.
TEST(IncrementalBatch, OfALinearSystemIsTheKalmanFilter) {
  const Problem problem = testing::LinearSystem();
  for (const char* mode : {"filtering", "incremental"}) {
    SCOPED_TRACE(mode);
    const auto batch = MakeBatch(problem, std::string("mode: ") + mode + '\n');
    Ekf filter(problem, {}, testing::StreamsOf(problem));
    for (int k = 0; k < 300; ++k) {
      const Frame frame = testing::FrameAt(0.1 * k, {{0, std::sin(0.1 * k)}});
      const UpdateReport& report = batch->Process(frame);
      EXPECT_EQ(std::ranges::count(report.events, EventKind::kSolvedAsAWhole, &Event::kind), 0)
          << k;
      filter.Process(frame);
      ASSERT_FALSE(batch->failed());
      const MatrixXd p = filter.state().covariance().Dense();
      EXPECT_LT((batch->state().covariance().Dense() - p).norm(), 1e-9 * p.norm()) << k;
      for (std::size_t i = 0; i < filter.state().values().size(); ++i) {
        EXPECT_NEAR(batch->state().values()[i], filter.state().values()[i], 1e-9) << k;
      }
    }
  }
}

// An exactly known landmark is not a variable, but its measurements are still used and reported.
TEST(IncrementalBatch, TellsWhatIsMeasuredOfALandmarkThatIsKnown) {
  LandmarkOptions options;
  options.known = {{0, {0.5, -0.2, 2.0}, 0.0}, {1, {-0.4, 0.1, 1.5}, 0.1}};
  const Problem problem = testing::MapSystem(testing::Offset(0.2), options, 0.5);
  const auto batch = MakeBatch(problem, "mode: incremental\n");
  const auto whole = MakeBatch(problem, "mode: filtering\nsolver: sparse\n");
  for (int k = 0; k < 5; ++k) {
    const double n = 0.1 * std::sin(37.0 * k);
    const Frame frame =
        testing::FrameOf(0.1 * k, {{0, {0.5 + n, -0.2, 2.0 - n}}, {1, {-0.4, 0.1 - n, 1.5}}});
    const UpdateReport& found = batch->Process(frame);
    const UpdateReport& expected = whole->Process(frame);
    EXPECT_LT(Compare(*batch, *whole).state, 1e-3);
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(found.measurements()[i].h.size(), 3u);
      for (std::size_t e = 0; e < 3; ++e) {
        EXPECT_NEAR(found.measurements()[i].h[e], expected.measurements()[i].h[e], 1e-4) << k;
      }
    }
  }
}

// The variance of an exactly known value is exactly zero, not a rounding error.
TEST(IncrementalBatch, OfWhatIsKnownExactlyThereIsNoVariance) {
  Problem problem = testing::DepthFilter();
  for (Prior& prior : problem.priors) {
    if (problem.layout[prior.block].name == "template.inverse_distance") prior.covariance.setZero();
  }
  const auto batch = MakeBatch(problem, "mode: filtering\n");
  for (int k = 0; k < 5; ++k) {
    batch->Process(testing::FrameAt(0.1 * k, {{0, 26.0 / 0.3 + 0.1 * k}, {1, 1.0}}));
    ASSERT_FALSE(batch->failed());
    const MatrixXd p = batch->state().covariance().Dense();
    EXPECT_EQ(p.row(2).norm(), 0.0);
    EXPECT_GT(p(0, 0), 0.0);
  }
}

// Steps forward in time would lose digits, so all frames are solved from scratch.
TEST(IncrementalBatch, OfAVaguePriorIsSolvedAsAWhole) {
  Problem problem = testing::LinearSystem();
  for (Prior& prior : problem.priors) prior.covariance *= 1e10;
  const auto batch = MakeBatch(problem, "mode: incremental\nrelinearise_above: 1e-9\n");
  const auto dense = MakeBatch(problem, "mode: filtering\nsolver: dense\n");
  std::string said;
  for (int k = 0; k < 20; ++k) {
    const Frame frame = testing::FrameAt(0.1 * k, {{0, std::sin(0.1 * k)}});
    for (const Event& event : batch->Process(frame).events)
      said += std::string(ToString(event.kind)) + ": " + event.text;
    dense->Process(frame);
    ASSERT_FALSE(batch->failed() || dense->failed());
    const MatrixXd p = dense->state().covariance().Dense();
    for (Eigen::Index i = 0; i < p.rows(); ++i) {
      const auto v = static_cast<std::size_t>(i);
      EXPECT_NEAR(batch->state().values()[v], dense->state().values()[v],
                  1e-6 * std::sqrt(p(i, i)));
    }
  }
  EXPECT_EQ(
      said,
      "solved_as_a_whole: the prior is so vague beside what is measured that steps forward in "
      "time lose digits; so are all frames from here on");
}

// A stopped batch has no map, and it does not return the map of its filter.
TEST(CeresBatchEnds, AStoppedBatchHasNoMap) {
  const MapProblem map(6, 8);
  for (const char* solver : {"sparse", "dense"}) {
    const auto batch = MakeBatch(map.Filter(), std::string("solver: ") + solver + '\n');
    batch->StopWhen([] { return true; });
    for (const Frame& frame : map.frames) batch->Process(frame);
    EXPECT_THROW(batch->Smooth([](std::size_t, const State&, const UpdateReport&) {}), Error);
    EXPECT_TRUE(batch->landmarks().empty()) << solver;
  }
}

}  // namespace
}  // namespace alidade
