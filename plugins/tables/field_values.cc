// SPDX-License-Identifier: Apache-2.0
#include "field_values.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "alidade/io/text_cell.h"
#include "known_table.h"

namespace alidade {
namespace {

/// Returns true if both texts are equal, or are equal numbers.
bool AreEqual(std::string_view a, const std::string& b) {
  if (a == b) return true;
  double x = 0.0, y = 0.0;
  return cell::ParseNumber(a, x) == nullptr && cell::ParseNumber(b, y) == nullptr && x == y;
}

/// Returns true if the cell of `valid` is `true`, or a number other than 0.
bool IsValid(const TableRow& row, const TableColumn& valid) {
  if (row.IsMissing(valid)) return false;
  const std::string_view text = row.Text(valid);
  if (text == "true" || text == "True") return true;
  if (text == "false" || text == "False") return false;
  double value = 0.0;
  if (cell::ParseNumber(text, value) != nullptr) {
    row.Fail(valid, "is neither a number nor true or false", "0 or false: not valid");
  }
  return value != 0.0;
}

bool AreMissing(const TableRow& row, const std::vector<TableColumn>& columns) {
  return std::ranges::any_of(columns, [&](const TableColumn& c) { return row.IsMissing(c); });
}

double Converted(const TableRow& row, const TableField& field, std::size_t i) {
  const Conversion& conversion = field.conversions[i];
  const double x = conversion.unit * row.Number(field.columns[i]);
  const double scaled = field.reciprocal ? conversion.gain / x : conversion.gain * x;
  const double value = scaled + conversion.offset;
  if (!std::isfinite(value)) {
    row.Fail(field.columns[i], field.reciprocal ? "has no finite reciprocal"
                                                : "is too large to be multiplied by the gain");
  }
  return value;
}

/// Replaces latitude and longitude, in rad, and perhaps height by east, north and perhaps up.
void ConvertToLocal(const TableRow& row, const TableField& field, LocalFrame& frame,
                    std::vector<double>& values) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  // A position at a pole or at 180 deg may exceed the limit by a rounding error.
  constexpr double kRounding = 1e-9;
  const GeodeticPosition position{values[0] * kDegrees, values[1] * kDegrees,
                                  values.size() > 2 ? values[2] : 0.0};
  const double limits[] = {90.0, 360.0};
  for (std::size_t i = 0; i < 2; ++i) {
    const double degrees = i == 0 ? position.latitude_deg : position.longitude_deg;
    if (std::abs(degrees) <= limits[i] + kRounding) continue;
    row.Fail(field.columns[i], i == 0 ? "is not a latitude" : "is not a longitude",
             (i == 0 ? "-90 to 90 deg" : "-360 to 360 deg") +
                 std::string(", or the unit of the column, as in 'unit: [rad, rad, m]'"));
  }
  const auto enu = frame.FromGeodetic(position);
  std::copy_n(enu.begin(), values.size(), values.begin());
}

/// Sets R to the covariance in the row. Leaves R empty if a cell is missing.
void ReadCovariance(const TableRow& row, const CovarianceColumns& covariance,
                    std::vector<double>& r) {
  using Form = CovarianceColumns::Form;
  if (AreMissing(row, covariance.columns)) return;
  const std::size_t n = covariance.size;
  r.assign(n * n, 0.0);
  const auto element = [&](std::size_t i, std::size_t j) -> double& { return r[i * n + j]; };
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const bool is_diagonal = covariance.form == Form::kSigma || covariance.form == Form::kVariance;
    const std::size_t first = covariance.form == Form::kFull ? 0 : i;
    const std::size_t last = is_diagonal ? i : n - 1;
    for (std::size_t j = first; j <= last; ++j) {
      const TableColumn& column = covariance.columns[next++];
      const double x = row.Number(column);
      if (i == j && x < 0.0) {
        row.Fail(column, "is negative", is_diagonal ? "0 or more" : "a diagonal of 0 or more");
      }
      const double value =
          (covariance.form == Form::kSigma ? x * x : x) * covariance.scale[i] * covariance.scale[j];
      if (!std::isfinite(value)) row.Fail(column, "is too large for a covariance");
      element(i, j) = value;
      if (covariance.form == Form::kUpper) element(j, i) = value;
    }
  }
}

std::int64_t ReadLandmark(const TableRow& row, const TableColumn& column) {
  const double id = row.Number(column, false);
  constexpr double kLimit = 9007199254740992.0;  // 2^53: every integer below it is a double
  if (id < 0.0 || id >= kLimit || id != std::floor(id)) {
    row.Fail(column, "is not the id of a landmark", "a whole number of 0 or more");
  }
  return static_cast<std::int64_t>(id);
}

}  // namespace

bool IsSelected(const TableRow& row, const TableField& field) {
  const auto is_met = [&](const RowCondition& condition) {
    const std::string_view text = row.Text(condition.column);
    return std::ranges::any_of(condition.texts,
                               [&](const std::string& wanted) { return AreEqual(text, wanted); });
  };
  return std::ranges::all_of(field.conditions, is_met) && HasIdOf(row, field);
}

bool ReadValues(const TableRow& row, const TableField& field, LocalFrame& frame,
                std::vector<double>& values) {
  values.clear();
  if (field.valid && !IsValid(row, *field.valid)) return false;
  values = field.constant;
  for (std::size_t i = 0; i < field.columns.size(); ++i) {
    if (!row.IsMissing(field.columns[i])) values.push_back(Converted(row, field, i));
  }
  if (values.size() < field.columns.size()) {
    values.clear();
    return false;
  }
  if (field.geodetic) ConvertToLocal(row, field, frame, values);
  return true;
}

bool ReadMeasurement(const TableRow& row, const TableField& field, LocalFrame& frame,
                     Measurement& measurement) {
  if (!ReadValues(row, field, frame, measurement.values)) return false;
  if (AreMissing(row, field.known)) return false;
  if (field.known_table && row.IsMissing(field.known_table->id)) return false;
  measurement.known.clear();
  if (field.known_table) measurement.known = KnownNumbers(row, *field.known_table);
  for (const TableColumn& column : field.known) measurement.known.push_back(row.Number(column));
  measurement.landmark = -1;
  if (field.landmark && !row.IsMissing(*field.landmark)) {
    measurement.landmark = ReadLandmark(row, *field.landmark);
  }
  measurement.covariance.clear();
  if (field.covariance) ReadCovariance(row, *field.covariance, measurement.covariance);
  return true;
}

}  // namespace alidade
