// SPDX-License-Identifier: Apache-2.0
//
// An EKF whose landmarks are postponed while they are not measured, beside one that carries all of
// them in each frame: the same up to rounding.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "alidade/base/error.h"
#include "alidade/estimation/compression.h"
#include "alidade/estimation/iekf.h"
#include "support/landmark_models.h"

namespace alidade::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Rounding of some hundred updates, of x and P as a whole; a point far away, which is a quotient of
// them, has fewer digits.
constexpr double kRoundingOfARun = 1e-12, kRoundingOfAPoint = 1e-10;

/// A camera that goes along a wall of points and back, measures those before it, and is wrong now
/// and then.
class WallRun {
 public:
  WallRun(const LandmarkOptions& options, const EkfOptions& of_full, CovarianceForm form,
          const std::function<void(System&)>& change = {})
      : system_(MapSystem(InverseDepthPixels(0.01), options, 0.01)) {
    if (change) change(system_);
    EkfOptions of_other = of_full;
    of_other.covariance = form;
    full_ = std::make_unique<Ekf>(EkfOf(system_, of_full));
    other_ = std::make_unique<Ekf>(EkfOf(system_, of_other));
  }
  Frame Next() {
    const double x = 4.0 * std::sin(0.02 * frame_);
    std::vector<Observation> seen;
    for (int id = 0; id < 120; ++id) {
      const double px = 0.1 * id - 6.0, py = 0.5 * std::cos(1.7 * id), pz = 2.0 + 0.1 * (id % 5);
      if (std::abs(px - x) > 0.6 || random_.Uniform() < 0.1) continue;
      const double wild = random_.Uniform() < 0.02 ? 0.5 : 0.0;
      seen.push_back(
          {id,
           {(px - x) / pz + wild + 0.01 * random_.Normal(), py / pz + 0.01 * random_.Normal()}});
    }
    return FrameOf(0.1 * frame_++, seen);
  }
  /// Both filters go through so many frames.
  void Go(int frames) {
    for (int k = 0; k < frames; ++k) {
      const Frame frame = Next();
      const UpdateReport& a = full_->Process(frame);
      const UpdateReport& b = other_->Process(frame);
      ASSERT_EQ(a.measurements().size(), b.measurements().size());
      for (std::size_t i = 0; i < a.measurements().size(); ++i) {
        ASSERT_EQ(a.measurements()[i].outcome, b.measurements()[i].outcome) << "frame " << frame_;
        EXPECT_NEAR(a.measurements()[i].nis, b.measurements()[i].nis, 1e-7);
      }
      ASSERT_EQ(a.landmarks.initialised, b.landmarks.initialised);
      ASSERT_EQ(a.landmarks.converted, b.landmarks.converted);
      ASSERT_EQ(a.removed_landmarks.size(), b.removed_landmarks.size());
      for (std::size_t i = 0; i < a.removed_landmarks.size(); ++i) {
        ExpectSame(a.removed_landmarks[i], b.removed_landmarks[i]);
      }
      counts_.deleted += b.landmarks.deleted;
      counts_.converted += b.landmarks.converted;
      counts_.rescued += b.landmarks.rescued;
      least_ = std::min(least_, SizeOfOther() / SizeOfFull());
    }
  }
  void ExpectSame(const LandmarkEstimate& a, const LandmarkEstimate& b) {
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.generation, b.generation);
    EXPECT_EQ(a.accepted, b.accepted);
    ASSERT_EQ(a.position.allFinite(), b.position.allFinite());
    if (!a.position.allFinite()) return;
    EXPECT_LT((a.position - b.position).norm(), kRoundingOfAPoint * (1.0 + a.position.norm()));
    EXPECT_LT((a.covariance - b.covariance).norm(), kRoundingOfAPoint * a.covariance.norm());
  }
  /// All of x and P, and the landmarks.
  void ExpectSame() {
    const State &a = full_->state(), b = other_->At(other_->timestamp());
    ASSERT_EQ(a.layout().blocks().size(), b.layout().blocks().size());
    std::vector<double> x, y;
    std::vector<int> rows, other_rows;
    for (std::size_t i = 0; i < a.layout().blocks().size(); ++i) {
      const auto id = static_cast<BlockId>(i);
      const Block &of_a = a.layout()[id], &of_b = b.layout()[id];
      ASSERT_EQ(of_a.name, of_b.name);
      ASSERT_EQ(of_a.present, of_b.present);
      if (!of_a.present) continue;
      x.insert(x.end(), a.value(id), a.value(id) + of_a.geometry().ambient);
      y.insert(y.end(), b.value(id), b.value(id) + of_b.geometry().ambient);
      for (int k = 0; k < of_a.geometry().tangent; ++k) {
        rows.push_back(of_a.tangent_offset + k);
        other_rows.push_back(of_b.tangent_offset + k);
      }
    }
    const auto size = std::ssize(x);
    const Eigen::Map<const VectorXd> values(x.data(), size), others(y.data(), size);
    EXPECT_LT((values - others).norm(), kRoundingOfARun * values.norm());
    const MatrixXd p = a.covariance().Dense()(rows, rows),
                   q = b.covariance().Dense()(other_rows, other_rows);
    EXPECT_LT((p - q).norm(), kRoundingOfARun * p.norm());
    const std::vector<LandmarkEstimate> map = full_->landmarks(), other = other_->landmarks();
    ASSERT_EQ(map.size(), other.size());
    for (std::size_t i = 0; i < map.size(); ++i) ExpectSame(map[i], other[i]);
  }
  double SizeOfFull() const { return full_->state().covariance().size(); }
  double SizeOfOther() const { return other_->state().covariance().size(); }

  System system_;
  std::unique_ptr<Ekf> full_, other_;
  LandmarkCounts counts_;
  double least_ = 1.0;  ///< of the active rows, a share of all

 private:
  Random random_{5};
  int frame_ = 0;
};

EkfOptions WithGate() {
  EkfOptions options;
  options.gate = 0.9999;
  return options;
}

TEST(CompressedEkf, IsTheFullOne) {
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kCompressed);
  for (int k = 0; k < 10; ++k) {
    ASSERT_NO_FATAL_FAILURE(run.Go(37));
    ASSERT_NO_FATAL_FAILURE(run.ExpectSame());
  }
  EXPECT_LT(run.least_, 0.25);
}

TEST(CompressedEkf, IsTheFullOneWhereLandmarksAreConvertedAndForgotten) {
  LandmarkOptions options = WithPrior(0.45, 0.1);
  options.max_linearity_index = 1.0;
  options.max_missed_frames = 60;
  options.min_match_ratio = 0.3;
  WallRun run(options, WithGate(), CovarianceForm::kCompressed);
  for (int k = 0; k < 10; ++k) {
    ASSERT_NO_FATAL_FAILURE(run.Go(37));
    ASSERT_NO_FATAL_FAILURE(run.ExpectSame());
  }
  EXPECT_GT(run.counts_.converted, 20);
  EXPECT_GT(run.counts_.deleted, 20);
  EXPECT_LT(run.least_, 0.4);
}

TEST(CompressedEkf, IsTheFullOneWithAConsensusAndLosses) {
  const auto change = [](System& system) {
    system.sensors[0].outlier_rejection = OnePointRansac{};
    system.sensors[0].loss = {LossKind::kHuber, 2.0};
  };
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kCompressed, change);
  ASSERT_NO_FATAL_FAILURE(run.Go(150));
  run.ExpectSame();
  EXPECT_GT(run.counts_.rescued, 0);
}

// Later the filter goes astray, and rounding grows tenfold every few frames: after 80 of them the
// sums of |x| by two sets of kernels differ by 1e-11, and so do the two forms.
TEST(CompressedEkf, IsTheFullOneWithAConsiderRole) {
  const auto change = [](System& system) { system.sensors[0].roles[0].mode = RoleMode::kConsider; };
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kCompressed, change);
  ASSERT_NO_FATAL_FAILURE(run.Go(60));
  EXPECT_LT(run.least_, 0.3);
  run.ExpectSame();
}

TEST(CompressedEkf, ExpectsWhatTheFullOneExpects) {
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kCompressed);
  ASSERT_NO_FATAL_FAILURE(run.Go(70));
  const Timestamp later = run.full_->timestamp() + 100'000'000;
  int postponed = 0;
  for (const LandmarkEstimate& one : run.full_->landmarks()) {
    const auto a = run.full_->Expect("tracks", later, one.id);
    const auto b = run.other_->Expect("tracks", later, one.id);
    ASSERT_TRUE(a && b);
    EXPECT_LT((a->s - b->s).norm(), kRoundingOfAPoint * a->s.norm());
    EXPECT_NEAR(a->z[0], b->z[0], kRoundingOfAPoint * (1.0 + std::abs(a->z[0])));
    ++postponed;
  }
  EXPECT_GT(postponed, 50);
}

TEST(CompressedEkf, GoesOnFromASnapshotWithTheSameBits) {
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kCompressed);
  ASSERT_NO_FATAL_FAILURE(run.Go(40));
  const std::unique_ptr<Estimator> copy = run.other_->Clone();
  for (int k = 0; k < 60; ++k) {
    const Frame frame = run.Next();
    run.other_->Process(frame);
    copy->Process(frame);
  }
  EXPECT_EQ(run.other_->state().values(), copy->state().values());
  EXPECT_EQ(run.other_->state().covariance().Dense(), copy->state().covariance().Dense());
}

TEST(CompressedEkf, ChoosesByItself) {
  WallRun run(WithPrior(0.45, 0.1), WithGate(), CovarianceForm::kAuto);
  ASSERT_NO_FATAL_FAILURE(run.Go(10));  // most of what there is is measured
  EXPECT_EQ(run.least_, 1.0);
  ASSERT_NO_FATAL_FAILURE(run.Go(300));
  EXPECT_LT(run.least_, 0.3);
  run.ExpectSame();
}

TEST(CompressedEkf, RefusesByNameWhatItCannotDoExactly) {
  EXPECT_EQ(internal::WhyNotCompressed(MapSystem(InverseDepthPixels(0.01), WithPrior())), "");
  LandmarkOptions options = WithPrior();
  options.negative_depth = LandmarkOptions::NegativeDepth::kDelete;
  const System deletes = MapSystem(InverseDepthPixels(0.01), options);
  EXPECT_NE(internal::WhyNotCompressed(deletes).find("negative_depth: delete"), std::string::npos);
  const System anchored = MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), WithPrior());
  EXPECT_NE(internal::WhyNotCompressed(anchored).find("unit_vector"), std::string::npos);
  EkfOptions compressed;
  compressed.covariance = CovarianceForm::kCompressed;
  EXPECT_THROW(EkfOf(anchored, compressed), ContractViolation);
  const System plain = MapSystem(InverseDepthPixels(0.01), WithPrior());
  EXPECT_THROW(Iekf(plain, {compressed}, {{"tracks", 2}}), ContractViolation);
  compressed.covariance = CovarianceForm::kAuto;
  EkfOf(anchored, compressed);  // stays full
}

}  // namespace
}  // namespace alidade::testing
