// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/innovation_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/statistics.h"

namespace alidade::internal {
namespace {

/// Largest share of rejections that may be due to chance.
constexpr double kChanceShare = 0.05;

}  // namespace

InnovationView::InnovationView(const InnovationSeries& series) : series_(&series) {
  for (std::size_t i = 0; i < size(); ++i) {
    const bool is_new = i > 0 && series.timestamps[i] != series.timestamps[i - 1];
    frames_.push_back(i == 0 ? 0 : frames_.back() + (is_new ? 1 : 0));
    if (!is_accepted(i)) rejected_.push_back(i);
  }
  for (std::size_t i = 0; i < size(); ++i) {
    if (frame(i) < kFirstFrames) continue;
    if (is_accepted(i) || rejected_share() >= kChanceShare) tested_.push_back(i);
  }
  if (size() > 0) FindOutliers();
  for (const std::size_t i : tested_) {
    if (!has_outliers_ || nis(i) <= outlier_nis_) inliers_.push_back(i);
  }
}

double InnovationView::rejected_share() const {
  return static_cast<double>(rejected_.size()) /
         static_cast<double>(std::max<std::size_t>(size(), 1));
}

/// Compares the number of frames with an outlier with a Poisson distribution. The probability of k
/// or more frames, of which f are expected, is P(chi2(2 k) <= 2 f).
void InnovationView::FindOutliers() {
  constexpr double kTail = 1e-4, kFalseAlarm = 1e-6, kMinShare = 0.004, kMaxNormal = 2.4;
  constexpr std::size_t kMinFrames = 3;
  std::vector<double> nis_values = series_->nis;
  std::ranges::sort(nis_values);
  const double median = ChiSquareQuantile(0.5, series_->dof);
  median_ratio_ = Quantile(nis_values, 0.5) / median;
  // The rank of the median is uncertain by sqrt(n) / 2.
  const double upper =
      std::min(1.0, 0.5 + 0.5 * kMaxNormal / std::sqrt(static_cast<double>(size())));
  outlier_nis_ = ChiSquareQuantile(1.0 - kTail, series_->dof) *
                 std::max(Quantile(nis_values, upper) / median, std::numeric_limits<double>::min());
  Rows outliers;
  for (std::size_t i = 0; i < size(); ++i) {
    if (nis(i) > outlier_nis_) outliers.push_back(i);
  }
  outlier_share_ = static_cast<double>(outliers.size()) / static_cast<double>(size());
  const std::size_t count = CountFrames(*this, outliers);
  if (count < kMinFrames || outlier_share_ <= kMinShare) return;
  const auto frames = static_cast<double>(frame_count());
  const double per_frame = static_cast<double>(size()) / frames;
  const double expected = frames * (1.0 - std::pow(1.0 - kTail, per_frame));
  has_outliers_ = 2.0 * expected < ChiSquareQuantile(kFalseAlarm, 2.0 * static_cast<double>(count));
}

double InnovationView::expected_nis() const {
  if (rejected_.empty() || rejected_share() >= kChanceShare) return 1.0;
  double largest_accepted = 0.0, smallest_rejected = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size(); ++i) {
    if (is_accepted(i)) {
      largest_accepted = std::max(largest_accepted, nis(i));
    } else {
      smallest_rejected = std::min(smallest_rejected, nis(i));
    }
  }
  const double cut = std::max(largest_accepted, smallest_rejected);
  return cut > 0.0 ? TruncatedMean(series_->dof, cut) : 1.0;
}

}  // namespace alidade::internal
