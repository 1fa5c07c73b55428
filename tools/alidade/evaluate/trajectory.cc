// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/trajectory.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/trajectory_format.h"
#include "alidade/io/number_rows.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

using Format = TrajectoryFormat;

/// Unit of time in which TUM timestamps may be written by mistake.
struct TimeUnit {
  const char* name;
  std::size_t digits;  ///< the unit is 10^digits ns

  double seconds() const { return std::pow(10.0, static_cast<double>(digits) - 9.0); }
};

/// Returns the lower median. Returns 0 if there are no values.
double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto median = values.begin() + (std::ssize(values) - 1) / 2;
  std::nth_element(values.begin(), median, values.end());
  return *median;
}

/// Determines the unit of timestamps from the median t of their values and the median d of their
/// differences. The unit is the first of s, ms, us and ns that is plausible for a clock that counts
/// from 1970. If no unit is plausible for such a clock, the unit is the first that is plausible for
/// a clock that counts from any start:
///
///   from 1970        1e9 s <= t < 9.2e9 s,  d < 1000 s
///   from any start           t < 9.2e9 s,   d < 1000 s for the unit s, otherwise d < 2 s
TimeUnit UnitOf(const std::vector<double>& timestamps) {
  constexpr TimeUnit kUnits[] = {{"s", 9}, {"ms", 6}, {"us", 3}, {"ns", 0}};
  std::vector<double> sizes, steps;
  for (std::size_t i = 0; i < timestamps.size(); ++i) {
    sizes.push_back(std::abs(timestamps[i]));
    if (i > 0) steps.push_back(std::abs(timestamps[i] - timestamps[i - 1]));
  }
  const double size = Median(sizes), step = Median(steps);
  for (const bool since_1970 : {true, false}) {
    for (const TimeUnit& unit : kUnits) {
      const double t_s = size * unit.seconds();
      const double max_step_s = since_1970 || unit.digits == 9 ? 1000.0 : 2.0;
      if (since_1970 && t_s < 1e9) continue;
      if (t_s < cell::kTimeLimit && step * unit.seconds() < max_step_s) return unit;
    }
  }
  return kUnits[3];
}

/// Reader of one pose file.
class TrajectoryReader {
 public:
  TrajectoryReader(const std::filesystem::path& file, Format format, NonFiniteRows non_finite)
      : rows_(file, {}, {}, NumberRows::kCommaOrBlanks), non_finite_(non_finite) {
    trajectory_.format = format;
  }

  /// Reads the file. If the format was detected, an error in the data names it.
  Trajectory Read() {
    try {
      return ReadRows();
    } catch (const Error& error) {
      if (error.code() != ExitCode::kBadData) throw;
      throw Error(error.code(), error.what() + assumption_);
    }
  }

 private:
  Trajectory ReadRows() {
    trajectory_.name = rows_.name();
    while (rows_.Next()) {
      const bool is_first = trajectory_.row_count == 0;
      if (is_first && !has_header_ && internal::IsHeader(rows_)) {
        has_header_ = true;
        header_order_ = internal::QuaternionOrder(rows_);
        continue;
      }
      if (is_first) ChooseFormat();
      AddRow();
      ++trajectory_.row_count;
    }
    if (lines_.empty()) FailEmpty();
    WarnOfSkippedRows();
    WarnOfRoundedQuaternions();
    trajectory_.first_line = lines_.front();
    trajectory_.positions.resize(3, std::ssize(positions_));
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      trajectory_.positions.col(static_cast<Eigen::Index>(i)) = positions_[i];
    }
    if (trajectory_.format == Format::kTum) ConvertTumTimestamps();
    CheckFirstQuaternion();
    if (trajectory_.format == Format::kKitti) return std::move(trajectory_);
    return Sorted();
  }

  void ChooseFormat() {
    if (trajectory_.format == Format::kDetect) {
      const internal::DetectedFormat detected = internal::DetectFormat(rows_, header_order_);
      row_format_ = detected.row_format;
      assumption_ = detected.assumption;
    } else {
      row_format_ = internal::RowFormatOf(trajectory_.format, rows_);
    }
    trajectory_.format = row_format_.format;
  }

  void AddRow() {
    rows_.ExpectColumns(row_format_.columns, row_format_.description);
    if (IsSkipped()) return;
    switch (row_format_.format) {
      case Format::kKitti:
        AddKitti();
        break;
      case Format::kEuroc:
        trajectory_.timestamps.push_back(rows_.Index(0, "t"));
        if (!(Seconds(trajectory_.timestamps.back()) < cell::kTimeLimit))
          rows_.FailCell(0, "t", "is beyond 292 years", "ns, as in EuRoC");
        AddPose();
        break;
      default:
        AddTum();
    }
    lines_.push_back(rows_.line());
    trajectory_.rows.push_back(trajectory_.row_count);
  }

  /// Returns true if the row is left out, because a value in it is not finite.
  bool IsSkipped() {
    const std::span<const char* const> names = row_format_.names;
    for (std::size_t i = 0; i < names.size(); ++i) {
      double value = 0.0;
      if (cell::ParseNumber(rows_.text(i), value) == nullptr || std::isfinite(value)) continue;
      if (non_finite_ == NonFiniteRows::kRefuse) {
        rows_.FailCell(i, names[i], "is not finite",
                       "a finite number, or --skip-nan to leave out such rows");
      }
      skipped_.Add(rows_.line());
      return true;
    }
    return false;
  }

  void AddTum() {
    seconds_.push_back(rows_.Number(0, "t"));
    timestamp_texts_.emplace_back(rows_.text(0));
    AddPose();
    if (row_format_.names.size() != 20) return;
    double upper[12];
    for (std::size_t i = 0; i < 12; ++i) upper[i] = rows_.Number(8 + i, row_format_.names[8 + i]);
    trajectory_.orientation_covariances.push_back(Covariance(upper, "orientation"));
    trajectory_.position_covariances.push_back(Covariance(upper + 6, "position"));
  }

  /// Converts a row-wise upper triangle to a symmetric matrix. The numbers may be rounded to six
  /// digits. A negative eigenvalue is an error only if it exceeds this rounding error.
  Eigen::Matrix3d Covariance(const double* upper, const char* quantity) const {
    constexpr double kRounding = 1e-5;
    Eigen::Matrix3d matrix;
    matrix << upper[0], upper[1], upper[2], upper[1], upper[3], upper[4], upper[2], upper[4],
        upper[5];
    const Eigen::VectorXd eigenvalues = internal::EigenvaluesOf(matrix);
    if (eigenvalues[0] >= -kRounding * eigenvalues.cwiseAbs().maxCoeff()) return matrix;
    rows_.FailLine(std::string("the covariance of the ") + quantity +
                       " is not positive semi-definite: its smallest eigenvalue is " +
                       internal::RoundedText(eigenvalues[0]),
                   "a positive semi-definite matrix");
  }

  /// Appends the pose in columns 1 to 7.
  void AddPose() {
    constexpr double kTolerance = 1e-3;
    constexpr double kRounding = 0.01;  // by 0.005 of each of four elements
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < 7; ++i) v[i] = rows_.Number(i + 1, row_format_.names[i + 1]);
    AddPosition({v[0], v[1], v[2]});
    const Eigen::Quaterniond q = row_format_.w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                                     : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
    const double error = std::abs(q.norm() - 1.0);
    if (!(error <= kRounding)) {
      rows_.FailLine("quaternion of length " + std::to_string(q.norm()),
                     "a length within 0.01 of 1");
    }
    if (error > kTolerance) rounded_.Add(rows_.line());
    trajectory_.orientations.push_back(q.normalized());
  }

  void AddPosition(const Eigen::Vector3d& position) {
    constexpr double kMaxCoordinate = 1e15;  // m; the distance of adjacent doubles is then 0.1 m
    if (!(position.cwiseAbs().maxCoeff() <= kMaxCoordinate))
      rows_.FailLine("a coordinate is beyond 1e15 m", "a position in metres");
    positions_.push_back(position);
  }

  void AddKitti() {
    constexpr double kTolerance = 1e-3;
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> pose;
    for (std::size_t i = 0; i < 12; ++i) {
      pose.data()[i] = rows_.Number(i, row_format_.names[i]);
    }
    const Eigen::Matrix3d rotation = pose.leftCols<3>();
    const double defect =
        (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(defect <= kTolerance) || !(rotation.determinant() > 0.0)) {
      rows_.FailLine("columns 1-3, 5-7, 9-11 are not a rotation matrix",
                     "R with R R' = 1 to within 1e-3, and det R = 1");
    }
    AddPosition(pose.col(3));
    trajectory_.orientations.push_back(Eigen::Quaterniond(rotation).normalized());
  }

  [[noreturn]] void FailEmpty() const {
    if (skipped_.count == 0)
      rows_.FailLine("the file contains no poses", internal::kDetectedFormats);
    rows_.FailLine("the file contains no poses: each of " + std::to_string(skipped_.count) +
                       " rows has a value that is not finite",
                   "a row of finite numbers");
  }

  void WarnOfSkippedRows() {
    if (skipped_.count == 0) return;
    Warn(skipped_.first_line, "",
         std::to_string(skipped_.count) + " of " + std::to_string(trajectory_.row_count) +
             " rows have a value that is not finite; they are left out",
         "");
  }

  void WarnOfRoundedQuaternions() {
    if (rounded_.count == 0) return;
    Warn(rounded_.first_line, row_format_.names[4],
         std::to_string(rounded_.count) + " of " + std::to_string(trajectory_.row_count) +
             " quaternions have a length that differs from 1 by more than 1e-3",
         "more decimals; they are normalised");
  }

  void ConvertTumTimestamps() {
    const TimeUnit unit = UnitOf(seconds_);
    const char* const expected = "seconds, as in TUM";
    if (unit.digits != 9) {
      Warn(lines_.front(), "t",
           '\'' + timestamp_texts_.front() +
               "' and the following timestamps are not plausible as seconds; they are read as " +
               unit.name,
           expected);
    }
    for (std::size_t i = 0; i < seconds_.size(); ++i) {
      if (!(std::abs(seconds_[i]) * unit.seconds() < cell::kTimeLimit)) {
        throw Error(ExitCode::kBadData, ErrorLine({rows_.name(), lines_[i], 0}, "t",
                                                  '\'' + cell::PrintableStart(timestamp_texts_[i]) +
                                                      "' is beyond 292 years",
                                                  expected));
      }
      trajectory_.timestamps.push_back(
          cell::ParseTimestamp(timestamp_texts_[i], seconds_[i], unit.digits));
    }
  }

  /// Warns if the trajectory starts at the origin, and the first orientation is the identity only
  /// in the other order of quaternions.
  void CheckFirstQuaternion() {
    if (!positions_.front().isZero(0.0) || trajectory_.format == Format::kKitti) return;
    const Trajectory reordered = trajectory_.Select({0}).WithOtherQuaternionOrder();
    if (reordered.orientations[0].vec() != Eigen::Vector3d::Zero()) return;
    const bool w_first = row_format_.w_first;
    Warn(lines_.front(), w_first ? "qw" : "qx",
         std::string("the first pose is the identity if the quaternion is read with w ") +
             (w_first ? "last" : "first"),
         w_first ? "qw qx qy qz, as in EuRoC" : "qx qy qz qw, as in TUM");
  }

  /// Sorts the poses by timestamp. Poses with equal timestamps keep the order of the file.
  Trajectory Sorted() {
    const std::vector<Timestamp>& timestamps = trajectory_.timestamps;
    std::vector<int> order(timestamps.size());
    std::iota(order.begin(), order.end(), 0);
    const auto earlier = [&](int a, int b) { return At(timestamps, a) < At(timestamps, b); };
    const auto first_unsorted = std::is_sorted_until(order.begin(), order.end(), earlier);
    const bool is_sorted = first_unsorted == order.end();
    if (!is_sorted) {
      Warn(At(lines_, *first_unsorted), "t",
           internal::SecondsText(At(timestamps, *first_unsorted)) +
               " is earlier than the previous timestamp",
           "poses in the order of their timestamps; the poses are sorted");
      std::stable_sort(order.begin(), order.end(), earlier);
    }
    WarnOfDuplicates(order);
    return is_sorted ? std::move(trajectory_) : trajectory_.Select(order);
  }

  /// Warns of duplicate timestamps. `order` sorts the timestamps.
  void WarnOfDuplicates(const std::vector<int>& order) {
    const std::vector<Timestamp>& timestamps = trajectory_.timestamps;
    int first = -1, count = 0;
    for (std::size_t k = 1; k < order.size(); ++k) {
      if (At(timestamps, order[k]) == At(timestamps, order[k - 1]) && count++ == 0)
        first = order[k];
    }
    if (count == 0) return;
    std::string text = internal::SecondsText(At(timestamps, first)) + " is a duplicate timestamp";
    if (count > 1) text += ", the first of " + std::to_string(count) + " duplicate timestamps";
    Warn(At(lines_, first), "t", text, "each timestamp once; all poses are retained");
  }

  template <class T>
  static const T& At(const std::vector<T>& values, int i) {
    return values[static_cast<std::size_t>(i)];
  }
  void Warn(int line, const char* key, const std::string& problem, const std::string& expected) {
    trajectory_.warnings.push_back(ErrorLine({rows_.name(), line, 0}, key, problem, expected));
  }

  /// Number of rows with the same defect.
  struct DefectCount {
    int count = 0, first_line = 0;

    void Add(int line) {
      if (count++ == 0) first_line = line;
    }
  };

  NumberRows rows_;
  NonFiniteRows non_finite_;
  Trajectory trajectory_;
  bool has_header_ = false;
  internal::HeaderOrder header_order_;
  internal::RowFormat row_format_;
  std::string assumption_;  ///< end of a message; "" if the format is given
  DefectCount skipped_, rounded_;
  std::vector<int> lines_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<double> seconds_;               ///< TUM timestamps before their unit is known
  std::vector<std::string> timestamp_texts_;  ///< texts of the TUM timestamps
};

/// Returns the name of the file that contains the timestamps of only one KITTI file.
std::filesystem::path DedicatedTimes(const std::filesystem::path& file) {
  return file.stem().string() + "_times.txt";
}

/// Finds the timestamp file in the folder of a KITTI file. Returns an empty path if it does not
/// exist.
std::filesystem::path FindTimes(const std::filesystem::path& file) {
  for (const std::filesystem::path& name :
       {DedicatedTimes(file), std::filesystem::path("times.txt")}) {
    const std::filesystem::path candidate = file.parent_path() / name;
    std::error_code error;
    if (std::filesystem::is_regular_file(candidate, error)) return candidate;
  }
  return {};
}

/// Reads the timestamps of all rows of a KITTI file, and adds those of its poses.
void ReadTimes(const std::filesystem::path& file, Trajectory& trajectory) {
  NumberRows rows(file, {}, {}, ' ');
  std::vector<Timestamp> times;
  while (rows.Next()) {
    rows.ExpectColumns(1, "t");
    times.push_back(rows.Time(0, "t"));
    const std::size_t n = times.size();
    if (n > 1 && times[n - 2] >= times[n - 1]) {
      rows.FailCell(0, "t", "is not after the previous time", "times that increase");
    }
  }
  if (std::ssize(times) == trajectory.row_count) {
    for (const int row : trajectory.rows) {
      trajectory.timestamps.push_back(times[static_cast<std::size_t>(row)]);
    }
    return;
  }
  const std::filesystem::path dedicated = DedicatedTimes(trajectory.name);
  const bool shared = file.filename() != dedicated;
  rows.FailLine("the number of times is " + std::to_string(times.size()) +
                    ", but the number of poses in " + trajectory.name + " is " +
                    std::to_string(trajectory.row_count),
                "one time for each pose" +
                    (shared ? ", or a file " + dedicated.string() + " in the same folder" : ""));
}

}  // namespace

const char* ToString(TrajectoryFormat format) {
  constexpr const char* kNames[] = {"detect", "tum", "kitti", "euroc"};
  return kNames[static_cast<std::size_t>(format)];
}

double Trajectory::Length(int first, int last) const {
  double length = 0.0;
  for (int i = first + 1; i <= last; ++i) {
    length += (positions.col(i) - positions.col(i - 1)).norm();
  }
  return length;
}

Trajectory Trajectory::Select(const std::vector<int>& indices) const {
  Trajectory part;
  part.name = name;
  part.format = format;
  part.row_count = row_count;
  part.first_line = first_line;
  part.warnings = warnings;
  part.positions.resize(3, std::ssize(indices));
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const auto i = static_cast<std::size_t>(indices[k]);
    part.positions.col(static_cast<Eigen::Index>(k)) = positions.col(indices[k]);
    part.orientations.push_back(orientations[i]);
    if (!rows.empty()) part.rows.push_back(rows[i]);
    if (has_timestamps()) part.timestamps.push_back(timestamps[i]);
    if (!has_covariances()) continue;
    part.position_covariances.push_back(position_covariances[i]);
    part.orientation_covariances.push_back(orientation_covariances[i]);
  }
  return part;
}

Trajectory Trajectory::WithOtherQuaternionOrder() const {
  Trajectory reordered = *this;
  for (Eigen::Quaterniond& q : reordered.orientations) {
    q = format == TrajectoryFormat::kEuroc ? Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y())
                                           : Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  }
  return reordered;
}

Trajectory ReadTrajectory(const std::filesystem::path& file, TrajectoryFormat format,
                          NonFiniteRows non_finite) {
  Trajectory trajectory = TrajectoryReader(file, format, non_finite).Read();
  if (trajectory.format == TrajectoryFormat::kKitti) {
    const std::filesystem::path times = FindTimes(file);
    if (!times.empty()) ReadTimes(times, trajectory);
  }
  const std::vector<Timestamp>& timestamps = trajectory.timestamps;
  if (timestamps.empty() ||
      Seconds(timestamps.back()) - Seconds(timestamps.front()) < cell::kTimeLimit) {
    return trajectory;
  }
  throw Error(ExitCode::kBadData,
              ErrorLine({trajectory.name}, "t", "the timestamps span more than 292 years",
                        "timestamps of one clock"));
}

}  // namespace alidade
