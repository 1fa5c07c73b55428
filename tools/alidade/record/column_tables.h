// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem.h"
#include "alidade/experiment/frame_innovation.h"
#include "alidade/experiment/joint_nees.h"
#include "alidade/experiment/source.h"
#include "alidade/record/columns.h"
#include "alidade/record/recorded_run.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/element_names.h"

/// Columns of the csv files of a run folder. There is one table for each file. To add a column to a
/// file, add an entry to the table of that file.
namespace alidade::internal {

/// Returns `count` columns. The name of a column is `letter` followed by the index: `v0`, `v1`, ...
inline std::vector<Column> NumberedColumns(const std::string& letter, std::size_t count) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < count; ++i) columns.push_back({letter + std::to_string(i), "", ""});
  return columns;
}

/// Writes a number, or an empty cell if the number is not finite.
inline void WriteFinite(double value, CsvFile& file) {
  std::isfinite(value) ? file.Number(value) : file.Empty();
}

// Columns of measurements.csv.

struct MeasurementLayout {
  /// Numbers of columns `v`, `known` and `R` for the widest stream.
  std::size_t width, known_width, covariance_width;
};
struct MeasurementRow {
  const Measurement& measurement;
  const std::string& stream;
};
inline constexpr std::array kMeasurementColumns = std::to_array<
    ColumnInfo<MeasurementLayout, MeasurementRow>>({
    {"t_s", "s", "timestamp of the measurement",
     [](const auto&, const MeasurementRow& row, CsvFile& file) {
       file.Time(row.measurement.timestamp);
     }},
    {"stream", "", "stream of the source",
     [](const auto&, const MeasurementRow& row, CsvFile& file) { file.Text(row.stream); }},
    {"landmark", "", "id of the landmark; empty if the measurement has no id",
     [](const auto&, const MeasurementRow& row, CsvFile& file) {
       file.Landmark(row.measurement.landmark);
     }},
    {"v", "unit of the stream",
     "values of the measurement; the widest stream determines the number of columns",
     [](const MeasurementLayout& layout, const MeasurementRow& row, CsvFile& file) {
       file.Numbers(row.measurement.values.data(), row.measurement.values.size(), layout.width);
     },
     [](const MeasurementLayout& layout) { return NumberedColumns("v", layout.width); },
     "`v0`, `v1`, ..."},
    {"known", "unit of the stream",
     "numbers that accompany the measurement and are not estimated, such as the position of a "
     "satellite; the columns exist only if a stream has such numbers",
     [](const MeasurementLayout& layout, const MeasurementRow& row, CsvFile& file) {
       file.Numbers(row.measurement.known.data(), row.measurement.known.size(), layout.known_width);
     },
     [](const MeasurementLayout& layout) { return NumberedColumns("known", layout.known_width); },
     "`known0`, `known1`, ..."},
    {"R", "product of the units of the stream",
     "covariance of the measurement, row by row; empty if the measurement has none; the columns "
     "exist only if a stream has covariances",
     [](const MeasurementLayout& layout, const MeasurementRow& row, CsvFile& file) {
       file.Numbers(row.measurement.covariance.data(), row.measurement.covariance.size(),
                    layout.covariance_width);
     },
     [](const MeasurementLayout& layout) { return NumberedColumns("R", layout.covariance_width); },
     "`R0`, `R1`, ..."},
});

// Columns of truth.csv.

struct TruthLayout {
  std::vector<StreamInfo> truths;
  std::vector<std::vector<std::string>> names;  ///< element names of each truth
};
inline constexpr std::array kTruthColumns = std::to_array<ColumnInfo<TruthLayout, SourceFrame>>({
    {"t_s", "s", "timestamp of the frame",
     [](const auto&, const SourceFrame& frame, CsvFile& file) { file.Time(frame.timestamp); }},
    {"truth", "unit of the block",
     "each element of each true value; the source names the true values",
     [](const TruthLayout& layout, const SourceFrame& frame, CsvFile& file) {
       for (std::size_t t = 0; t < layout.truths.size(); ++t) {
         const auto size = static_cast<std::size_t>(layout.truths[t].size);
         const bool is_known = t < frame.truth.size() && !frame.truth[t].empty();
         file.Numbers(is_known ? frame.truth[t].data() : nullptr, is_known ? size : 0, size);
       }
     },
     [](const TruthLayout& layout) {
       std::vector<Column> columns;
       for (std::size_t t = 0; t < layout.truths.size(); ++t) {
         for (const std::string& name : layout.names[t]) {
           columns.push_back({name, "", "", layout.truths[t].name});
         }
       }
       return columns;
     },
     "`block.element`"},
});

// Columns of expected.csv.

struct ExpectedLayout {
  std::size_t width;
};
struct ExpectedRow {
  Timestamp timestamp;
  const std::string& stream;
  const std::vector<double>& values;
};
inline constexpr std::array kExpectedColumns =
    std::to_array<ColumnInfo<ExpectedLayout, ExpectedRow>>({
        {"t_s", "s", "timestamp of the measurement",
         [](const auto&, const ExpectedRow& row, CsvFile& file) { file.Time(row.timestamp); }},
        {"stream", "", "stream of the source",
         [](const auto&, const ExpectedRow& row, CsvFile& file) { file.Text(row.stream); }},
        {"v", "unit of the stream", "predicted measurement h at the true state",
         [](const ExpectedLayout& layout, const ExpectedRow& row, CsvFile& file) {
           file.Numbers(row.values.data(), row.values.size(), layout.width);
         },
         [](const ExpectedLayout& layout) { return NumberedColumns("v", layout.width); },
         "`v0`, `v1`, ..."},
    });

// Columns of implied_states.csv.

struct ImpliedLayout {
  std::vector<Column> blocks;  ///< one column for each block
};
struct ImpliedRow {
  Timestamp timestamp;
  const std::string& sensor;
  std::size_t block;  ///< index into ImpliedLayout::blocks
  double value;
};
inline constexpr std::array kImpliedColumns = std::to_array<ColumnInfo<ImpliedLayout, ImpliedRow>>({
    {"t_s", "s", "timestamp of the measurement",
     [](const auto&, const ImpliedRow& row, CsvFile& file) { file.Time(row.timestamp); }},
    {"sensor", "", "sensor of the measurement",
     [](const auto&, const ImpliedRow& row, CsvFile& file) { file.Text(row.sensor); }},
    {"value", "unit of the block", "value of the block that the measurement implies",
     [](const ImpliedLayout& layout, const ImpliedRow& row, CsvFile& file) {
       file.Empty(row.block).Number(row.value).Empty(layout.blocks.size() - row.block - 1);
     },
     [](const ImpliedLayout& layout) { return layout.blocks; }, "`block`"},
});

// Columns of NAME/estimates.csv and NAME/errors.csv: the timestamp, then the columns below for each
// block.

inline const Column kTimeColumn{"t_s", "s", "t_s"};

struct BlockLayout {
  BlockId id;
  Space space;
  std::string name, unit;
  int truth;                    ///< index into SourceFrame::truth; -1: the block has no truth
  double truth_variance = 0.0;  ///< variance of each element of the truth
  double prior_sigma = 0.0;     ///< result of LargestPriorSigma

  std::string owner() const { return name.substr(0, name.find('.')); }
  std::size_t ambient() const { return static_cast<std::size_t>(space.geometry.ambient); }
  std::size_t tangent() const { return static_cast<std::size_t>(space.geometry.tangent); }
};
struct BlockRow {
  const SourceFrame& frame;
  const State& state;

  /// Returns the truth of a block. Returns null if the truth is unknown.
  const double* TruthOf(const BlockLayout& block) const {
    const auto truth = static_cast<std::size_t>(block.truth);
    const bool is_known = truth < frame.truth.size() && !frame.truth[truth].empty();
    return is_known ? frame.truth[truth].data() : nullptr;
  }
  /// Returns the value of a block. The result is empty if the block has no value.
  std::vector<double> ValuesOf(const BlockLayout& block) const {
    if (!state.layout()[block.id].present) return {};
    const double* const values = state.value(block.id);
    return {values, values + block.ambient()};
  }
  /// Returns e = x (-) x_true in the tangent space at x. The result is empty if x or x_true is
  /// unknown.
  std::vector<double> ErrorOf(const BlockLayout& block) const {
    const double* const truth = TruthOf(block);
    if (truth == nullptr || !state.layout()[block.id].present) return {};
    std::vector<double> error(block.tangent());
    block.space.geometry.Minus(truth, state.value(block.id), error.data());
    for (double& element : error) element = 0.0 - element;
    return error;
  }
  /// Returns sqrt(P_ii) of each tangent element. The result is empty if the block has no
  /// covariance.
  std::vector<double> SigmasOf(const BlockLayout& block) const {
    const Block& state_block = state.layout()[block.id];
    std::vector<double> sigmas;
    for (int i = 0; state_block.has_covariance() && i < block.space.geometry.tangent; ++i) {
      sigmas.push_back(std::sqrt(state.covariance().Variance(state_block.tangent_offset + i)));
    }
    return sigmas;
  }
};

/// Returns the layouts of the blocks of a problem.
std::vector<BlockLayout> BlockLayoutsOf(const Problem& problem,
                                        const std::vector<StreamInfo>& truths);

/// Columns of one quantity, such as `sigma`, in a file that repeats these columns for each block.
struct BlockColumnInfo {
  const char* quantity;
  const char* names;                         ///< names of the columns, for the documentation
  const char* unit;                          ///< unit, for the documentation
  const char* meaning;                       ///< meaning, for the documentation, in Markdown
  std::size_t (BlockLayout::*size)() const;  ///< number of columns
  std::vector<Column> (*columns)(const BlockLayout& block);
  std::vector<double> (*numbers)(const BlockLayout& block,
                                 const BlockRow& row);  ///< values of the cells; empty: no values
};

/// Returns a column for each tangent element of a block. The name of a column is `prefix` followed
/// by the name of the element.
inline std::vector<Column> TangentColumns(const BlockLayout& block, const std::string& prefix) {
  std::vector<Column> columns;
  for (const std::string& name : TangentNames(block.name, block.space)) {
    const bool is_angular = block.space.geometry.IsAngular(static_cast<int>(columns.size()));
    columns.push_back({prefix + name, is_angular ? "rad" : block.unit, "", block.name});
  }
  return columns;
}

inline constexpr BlockColumnInfo kSigmaColumns{
    "sigma",
    "`sigma:block.element`",
    "unit of the block; rad for an angle or rotation",
    "sqrt(P_ii) of each tangent element; empty if the block has no covariance",
    &BlockLayout::tangent,
    [](const BlockLayout& block) { return TangentColumns(block, "sigma:"); },
    [](const BlockLayout& block, const BlockRow& row) { return row.SigmasOf(block); }};

inline constexpr std::array kEstimateColumns{
    BlockColumnInfo{
        "value", "`block.element`", "unit of the block",
        "value of each ambient element; empty until the block is initialised",
        &BlockLayout::ambient,
        [](const BlockLayout& block) {
          std::vector<Column> columns;
          for (const std::string& name : AmbientNames(block.name, block.space)) {
            columns.push_back({name, block.unit, "", block.name});
          }
          return columns;
        },
        [](const BlockLayout& block, const BlockRow& row) { return row.ValuesOf(block); }},
    kSigmaColumns};

inline constexpr std::array kErrorColumns{
    BlockColumnInfo{
        "error", "`block.element`", "unit of the block; rad for an angle or rotation",
        "e = x (-) x_true of each tangent element; empty if the truth is unknown",
        &BlockLayout::tangent, [](const BlockLayout& block) { return TangentColumns(block, ""); },
        [](const BlockLayout& block, const BlockRow& row) { return row.ErrorOf(block); }},
    kSigmaColumns};

/// Owner of blocks with truth, and a row of these blocks.
struct OwnerLayout {
  std::string name;
  std::vector<BlockLayout> blocks;
};
/// Columns of errors.csv for each owner, after those of the blocks.
inline constexpr std::array kOwnerColumns = std::to_array<ColumnInfo<OwnerLayout, BlockRow>>({
    {"nees", "",
     "NEES of the blocks of the owner, divided by its degrees of freedom; empty if the NEES is "
     "unknown. The mean is the metric `nees.mean:OWNER`",
     [](const OwnerLayout& owner, const BlockRow& row, CsvFile& file) {
       std::vector<Eigen::VectorXd> errors;
       errors.reserve(owner.blocks.size());  // BlockError refers to the elements
       std::vector<BlockError> known;
       for (const BlockLayout& block : owner.blocks) {
         const std::vector<double> error = row.ErrorOf(block);
         if (error.empty()) continue;
         errors.emplace_back(Eigen::Map<const Eigen::VectorXd>(error.data(), std::ssize(error)));
         known.push_back({block.id, &errors.back(), block.truth_variance, block.prior_sigma});
       }
       const Nees nees = JointNees(row.state, known);
       nees.dof > 0 ? WriteFinite(nees.value / nees.dof, file) : (void)file.Empty();
     },
     [](const OwnerLayout& owner) {
       return std::vector<Column>{{"nees:" + owner.name, "", "", owner.name}};
     },
     "`nees:OWNER`"},
});

/// Appends the columns of one block.
template <std::size_t kCount>
void AppendColumns(const std::array<BlockColumnInfo, kCount>& table, const BlockLayout& block,
                   std::vector<Column>& columns) {
  for (const BlockColumnInfo& info : table) {
    for (Column& column : info.columns(block)) {
      column.quantity = info.quantity;
      columns.push_back(std::move(column));
    }
  }
}

/// Writes the cells of one block.
template <std::size_t kCount>
void WriteCells(const std::array<BlockColumnInfo, kCount>& table, const BlockLayout& block,
                const BlockRow& row, CsvFile& file) {
  for (const BlockColumnInfo& info : table) {
    const std::vector<double> numbers = info.numbers(block, row);
    file.Numbers(numbers.data(), numbers.size(), (block.*info.size)());
  }
}

// Columns of NAME/final_covariance.csv.

struct CovarianceLayout {
  std::vector<std::string> names;  ///< tangent elements whose variance is above zero
};
struct CovarianceRow {
  std::size_t index;                  ///< row of P
  const Eigen::MatrixXd& covariance;  ///< P of the elements
};
inline constexpr std::array kCovarianceColumns =
    std::to_array<ColumnInfo<CovarianceLayout, CovarianceRow>>({
        {"element", "", "tangent element of the row",
         [](const CovarianceLayout& layout, const CovarianceRow& row, CsvFile& file) {
           file.Text(layout.names[row.index]);
         }},
        {"covariance", "unit of the row * unit of the column",
         "covariance of the element of the row and the element of the column",
         [](const CovarianceLayout& layout, const CovarianceRow& row, CsvFile& file) {
           for (std::size_t i = 0; i < layout.names.size(); ++i) {
             file.Number(row.covariance(static_cast<Eigen::Index>(row.index),
                                        static_cast<Eigen::Index>(i)));
           }
         },
         [](const CovarianceLayout& layout) {
           std::vector<Column> columns;
           for (const std::string& name : layout.names) columns.push_back({name, "", ""});
           return columns;
         },
         "`block.element`"},
    });

// Columns of NAME/innovations.csv.

struct InnovationLayout {
  std::size_t width;  ///< size of the widest measurement
};
struct InnovationRow {
  Timestamp timestamp;
  const RecordedSensor& sensor;
  const MeasurementReport& report;

  bool is_predicted() const { return !report.s.empty(); }
};
inline constexpr std::array kInnovationColumns =
    std::to_array<ColumnInfo<InnovationLayout, InnovationRow>>({
        {"t_s", "s", "timestamp of the frame",
         [](const auto&, const InnovationRow& row, CsvFile& file) { file.Time(row.timestamp); }},
        {"stream", "", "stream of the source",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           file.Text(row.sensor.stream);
         }},
        {"sensor", "", "sensor of the estimator",
         [](const auto&, const InnovationRow& row, CsvFile& file) { file.Text(row.sensor.name); }},
        {"landmark", "", "id of the landmark; empty if the measurement has no id",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           file.Landmark(row.report.landmark);
         }},
        {"outcome", "", "outcome of the measurement, see [Outcomes](run_folder.md#outcomes)",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           file.Text(ToString(row.report.outcome));
         }},
        {"dof", "", "degrees of freedom of the measurement",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           file.Integer(row.report.dof);
         }},
        {"nis", "", "r' S^-1 r, not divided by `dof`; empty if S was not computed",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           row.is_predicted() ? file.Number(row.report.nis) : file.Empty();
         }},
        {"log_det_s", "", "log det S; empty if S was not computed or is not positive definite",
         [](const auto&, const InnovationRow& row, CsvFile& file) {
           WriteFinite(LogDeterminant(row.report.s, row.report.dof), file);
         }},
        {"z", "unit of the sensor", "each ambient element of the measurement z",
         [](const InnovationLayout& layout, const InnovationRow& row, CsvFile& file) {
           file.Numbers(row.report.z.data(), row.report.z.size(), layout.width);
         },
         [](const InnovationLayout& layout) { return NumberedColumns("z", layout.width); },
         "`z0`, `z1`, ..."},
        {"h", "unit of the sensor", "each ambient element of the prediction h(x)",
         [](const InnovationLayout& layout, const InnovationRow& row, CsvFile& file) {
           file.Numbers(row.report.h.data(), row.report.h.size(), layout.width);
         },
         [](const InnovationLayout& layout) { return NumberedColumns("h", layout.width); },
         "`h0`, `h1`, ..."},
        {"s", "unit of the sensor",
         "sqrt(S_ii) of each tangent element; S = H P H' + R, or H P H' + R / w with a robust loss",
         [](const InnovationLayout& layout, const InnovationRow& row, CsvFile& file) {
           std::vector<double> sigmas;
           const auto m = static_cast<std::size_t>(row.report.dof);
           for (std::size_t i = 0; i < m && row.is_predicted(); ++i) {
             sigmas.push_back(std::sqrt(row.report.s[i * m + i]));
           }
           file.Numbers(sigmas.data(), sigmas.size(), layout.width);
         },
         [](const InnovationLayout& layout) { return NumberedColumns("s", layout.width); },
         "`s0`, `s1`, ..."},
        {"r", "unit of the sensor", "each tangent element of the innovation z (-) h",
         [](const InnovationLayout& layout, const InnovationRow& row, CsvFile& file) {
           file.Numbers(row.report.innovation.data(), row.report.innovation.size(), layout.width);
         },
         [](const InnovationLayout& layout) { return NumberedColumns("r", layout.width); },
         "`r0`, `r1`, ..."},
    });

// Columns of NAME/gains.csv.

struct GainLayout {
  std::vector<Column> elements;  ///< names such as `target.depth<-disparity`
};
struct GainRow {
  Timestamp timestamp;
  const std::string& sensor;
  const std::vector<const double*>&
      cells;  ///< elements of K; null if the column belongs to another sensor
};
inline constexpr std::array kGainColumns = std::to_array<ColumnInfo<GainLayout, GainRow>>({
    {"t_s", "s", "timestamp of the frame",
     [](const auto&, const GainRow& row, CsvFile& file) { file.Time(row.timestamp); }},
    {"sensor", "", "sensor of the estimator",
     [](const auto&, const GainRow& row, CsvFile& file) { file.Text(row.sensor); }},
    {"gain", "unit of the block / unit of the sensor",
     "element of the gain K from a measured element to a block element; empty for other sensors",
     [](const auto&, const GainRow& row, CsvFile& file) {
       for (const double* const cell : row.cells) {
         cell != nullptr ? file.Number(*cell) : file.Empty();
       }
     },
     [](const GainLayout& layout) { return layout.elements; }, "`block.element<-measured`"},
});

// Columns of NAME/reprojection.csv, NAME/events.csv, NAME/landmarks.csv and timing.csv.

struct NoLayout {};

struct ReprojectionRow {
  Timestamp timestamp;
  const std::string& sensor;
  const FrameInnovation& innovation;
};
inline constexpr std::array kReprojectionColumns =
    std::to_array<ColumnInfo<NoLayout, ReprojectionRow>>({
        {"t_s", "s", "timestamp of the frame",
         [](const auto&, const ReprojectionRow& row, CsvFile& file) { file.Time(row.timestamp); }},
        {"sensor", "", "sensor that observes landmarks",
         [](const auto&, const ReprojectionRow& row, CsvFile& file) { file.Text(row.sensor); }},
        {"landmarks", "", "number of accepted measurements",
         [](const auto&, const ReprojectionRow& row, CsvFile& file) {
           file.Integer(row.innovation.measurements);
         }},
        {"rms", "",
         "sqrt(mean r_i^2) over the elements of all accepted innovations, unit of the sensor",
         [](const auto&, const ReprojectionRow& row, CsvFile& file) {
           file.Number(row.innovation.rms);
         }},
    });

inline constexpr std::array kEventColumns = std::to_array<ColumnInfo<NoLayout, Event>>({
    {"t_s", "s", "timestamp of the frame; empty if the event concerns the whole run",
     [](const auto&, const Event& event, CsvFile& file) { file.Time(event.timestamp); }},
    {"kind", "", "kind of the event, see [Events](run_folder.md#events)",
     [](const auto&, const Event& event, CsvFile& file) { file.Text(ToString(event.kind)); }},
    {"text", "", "description of the event",
     [](const auto&, const Event& event, CsvFile& file) { file.Text(event.text); }},
});

inline constexpr std::array kLandmarkColumns =
    std::to_array<ColumnInfo<NoLayout, LandmarkEstimate>>({
        {"id", "", "id of the landmark",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Integer(landmark.id); }},
        {"generation", "", "number of earlier landmarks that had this id and were removed",
         [](const auto&, const auto& landmark, CsvFile& file) {
           file.Integer(landmark.generation);
         }},
        {"representation", "",
         "representation in the state; empty if the sensor defines its own representation",
         [](const auto&, const auto& landmark, CsvFile& file) {
           file.Text(landmark.representation ? ToString(*landmark.representation) : "");
         }},
        {"x", "m", "position in the world frame",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.position[0], file); }},
        {"y", "m", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.position[1], file); }},
        {"z", "m", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.position[2], file); }},
        {"sigma_x", "m", "standard deviation of the position",
         [](const auto&, const auto& l, CsvFile& file) {
           WriteFinite(std::sqrt(l.covariance(0, 0)), file);
         }},
        {"sigma_y", "m", "",
         [](const auto&, const auto& l,
            CsvFile& file) { WriteFinite(std::sqrt(l.covariance(1, 1)), file); }},
        {"sigma_z", "m", "",
         [](const auto&, const auto& l,
            CsvFile& file) { WriteFinite(std::sqrt(l.covariance(2, 2)), file); }},
        {"inverse_distance", "1/m",
         "inverse distance from the camera position at the first observation; empty for xyz",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.inverse_distance, file); }},
        {"sigma_inverse_distance", "1/m", "standard deviation of the inverse distance",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.sigma, file); }},
        {"first_s", "s", "timestamp of the first observation",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Time(landmark.first); }},
        {"last_s", "s", "timestamp of the last observation",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Time(landmark.last); }},
        {"tried", "", "number of measurements of the landmark",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Integer(landmark.tried); }},
        {"accepted", "", "number of accepted measurements",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Integer(landmark.accepted); }},
        {"true_x", "m", "true position; empty if the source does not provide it",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.true_position[0], file); }},
        {"true_y", "m", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.true_position[1], file); }},
        {"true_z", "m", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.true_position[2], file); }},
        {"cov_xy", "m^2", "off-diagonal elements of the covariance of the position",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.covariance(0, 1), file); }},
        {"cov_xz", "m^2", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.covariance(0, 2), file); }},
        {"cov_yz", "m^2", "",
         [](const auto&, const auto& l, CsvFile& file) { WriteFinite(l.covariance(1, 2), file); }},
        {"status", "",
         "`kept` if the landmark is in the final state; `removed` if it was removed during the run",
         [](const auto&, const auto& landmark, CsvFile& file) {
           file.Text(landmark.removed == kNoTimestamp ? "kept" : "removed");
         }},
        {"removed_s", "s", "timestamp of the removal; empty if the landmark was not removed",
         [](const auto&, const auto& landmark, CsvFile& file) { file.Time(landmark.removed); }},
    });

struct TimingLayout {
  std::vector<std::string> estimators;
};
struct TimingRow {
  Timestamp timestamp;
  const std::vector<std::optional<double>>& wall_s;  ///< time of each estimator; empty if unknown
};
inline constexpr std::array kTimingColumns = std::to_array<ColumnInfo<TimingLayout, TimingRow>>({
    {"t_s", "s", "timestamp of the frame",
     [](const auto&, const TimingRow& row, CsvFile& file) { file.Time(row.timestamp); }},
    {"wall", "s", "wall-clock time of each online estimator for the frame",
     [](const auto&, const TimingRow& row, CsvFile& file) {
       for (const std::optional<double>& cell : row.wall_s) {
         cell ? file.Number(*cell) : file.Empty();
       }
     },
     [](const TimingLayout& layout) {
       std::vector<Column> columns;
       for (const std::string& name : layout.estimators) columns.push_back({name, "s", "", name});
       return columns;
     },
     "`NAME`"},
});

}  // namespace alidade::internal
