// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "alidade/diagnosis/innovation_series.h"
#include "alidade/model/geometry.h"

/// Statistics that the rules of Diagnose share. The measurements of a frame, which have the same
/// timestamp, depend on the same prediction. The statistics therefore count frames, not
/// measurements.
namespace alidade::internal {

/// Number of frames that depend on the prior more than on the noise.
inline constexpr std::size_t kFirstFrames = 3;

/// Indices of measurements, in ascending order.
using Rows = std::vector<std::size_t>;

/// Sum over the measurements of a frame.
struct FrameSum {
  std::size_t frame;
  double sum = 0.0;
  double count = 0.0;

  double mean() const { return sum / count; }
};

/// Innovations of one sensor, prepared for the rules.
class InnovationView {
 public:
  /// `series` must outlive the view.
  explicit InnovationView(const InnovationSeries& series);

  const InnovationSeries& series() const { return *series_; }
  std::size_t size() const { return series_->size(); }
  std::size_t dof() const { return static_cast<std::size_t>(series_->dof); }
  bool is_accepted(std::size_t i) const { return series_->accepted[i] != 0; }
  double time_s(std::size_t i) const { return Seconds(series_->timestamps[i]); }
  double nis(std::size_t i) const { return series_->nis[i]; }
  /// Return element k of r, of sqrt(S_kk), and of u = r / sqrt(S_kk) of measurement i.
  double r(std::size_t i, std::size_t k) const { return series_->innovation[i * dof() + k]; }
  double s(std::size_t i, std::size_t k) const { return series_->sigma[i * dof() + k]; }
  double u(std::size_t i, std::size_t k) const { return r(i, k) / s(i, k); }
  /// Returns whether an element of z and h corresponds to element k of r.
  bool has_z(std::size_t k) const { return series_->z_index[k] >= 0; }
  /// Return the elements of z and h that correspond to element k of r, and their unit.
  double z(std::size_t i, std::size_t k) const { return series_->z[i * ambient() + z_index(k)]; }
  double h(std::size_t i, std::size_t k) const { return series_->h[i * ambient() + z_index(k)]; }
  /// Returns a - b for two values of element k of z or h, as an angle in (-pi, pi] for an angle.
  double Difference(double a, double b, std::size_t k) const {
    return is_angle(k) ? Angle::Wrap(a - b) : a - b;
  }
  bool is_angle(std::size_t k) const { return series_->is_angle[k] != 0; }
  const std::string& unit(std::size_t k) const { return series_->units[z_index(k)]; }
  /// Returns the unit of element k of r. Elements without an element of z are angles.
  std::string innovation_unit(std::size_t k) const { return has_z(k) ? unit(k) : "rad"; }

  /// Returns the index of the frame of measurement i. frame_count() is the number of frames.
  std::size_t frame(std::size_t i) const { return frames_[i]; }
  std::size_t frame_count() const { return frames_.empty() ? 0 : frames_.back() + 1; }

  /// Rejected measurements, and their share.
  const Rows& rejected() const { return rejected_; }
  double rejected_share() const;
  /// Measurements of the statistical tests, without the first frames. If at least 5 % were
  /// rejected, rejections are not due to chance; the tests then use the rejected measurements too.
  const Rows& tested() const { return tested_; }
  /// Tested measurements without outliers.
  const Rows& inliers() const { return inliers_; }

  /// Returns the median of NIS, divided by that of a consistent filter.
  double median_ratio() const { return median_ratio_; }
  /// Returns the share of outliers. The NIS of an outlier exceeds a threshold that a Gaussian
  /// innovation exceeds with probability 1e-4, scaled by an upper bound of the median ratio.
  double outlier_share() const { return outlier_share_; }
  /// Returns whether there are more outliers than chance explains.
  bool has_outliers() const { return has_outliers_; }

  /// Returns the mean of NIS / dof of a consistent filter over the accepted measurements. It is
  /// below 1 if the gate truncates the distribution. The threshold of the gate is unknown; the
  /// larger of the largest accepted and the smallest rejected NIS is used.
  double expected_nis() const;

 private:
  std::size_t ambient() const { return static_cast<std::size_t>(series_->ambient); }
  std::size_t z_index(std::size_t k) const { return static_cast<std::size_t>(series_->z_index[k]); }
  void FindOutliers();

  const InnovationSeries* series_;
  std::vector<std::size_t> frames_;
  Rows rejected_, tested_, inliers_;
  double median_ratio_ = 1.0, outlier_nis_ = 0.0, outlier_share_ = 0.0;
  bool has_outliers_ = false;
};

/// Returns the sum of value(i) over the rows of each frame. Omits frames without a row.
template <class Value>
std::vector<FrameSum> SumFrames(const InnovationView& view, const Rows& rows, const Value& value) {
  std::vector<FrameSum> frames;
  for (const std::size_t i : rows) {
    if (frames.empty() || frames.back().frame != view.frame(i)) frames.push_back({view.frame(i)});
    frames.back().sum += value(i);
    ++frames.back().count;
  }
  return frames;
}

/// Returns the number of frames with at least one of the rows.
inline std::size_t CountFrames(const InnovationView& view, const Rows& rows) {
  return SumFrames(view, rows, [](std::size_t) { return 0.0; }).size();
}

/// Returns the mean of value(i) over the rows of each frame. Omits frames without a row.
template <class Value>
std::vector<double> FrameMeans(const InnovationView& view, const Rows& rows, const Value& value) {
  std::vector<double> means;
  for (const FrameSum& frame : SumFrames(view, rows, value)) means.push_back(frame.mean());
  return means;
}

}  // namespace alidade::internal
