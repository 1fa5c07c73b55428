// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/covariance_file.h"

#include <algorithm>
#include <cmath>

#include "alidade/record/estimate_series.h"

namespace alidade::internal {

CovarianceFile::CovarianceFile(const std::vector<BlockLayout>& blocks) : blocks_(blocks.size()) {
  for (const BlockLayout& block : blocks) {
    for (const std::string& name : TangentNames(block.name, block.space)) names_.push_back(name);
  }
}

void CovarianceFile::Set(const State& state) {
  lower_.clear();
  AppendCovariance(state, blocks_, lower_);
  // Elements without covariance are NaN. An infinite element means that P is invalid.
  const auto is_infinite = [](double value) { return std::isinf(value); };
  const auto is_nan = [](double value) { return std::isnan(value); };
  if (std::ranges::any_of(lower_, is_infinite) || std::ranges::all_of(lower_, is_nan)) return;
  std::swap(lower_, last_finite_);
}

void CovarianceFile::Write(const OutputFolder& folder, const std::string& estimator,
                           RunColumns& run_columns) {
  if (last_finite_.empty()) return;
  const auto element = [&](std::size_t i, std::size_t j) {
    const std::size_t row = std::max(i, j), column = std::min(i, j);
    return last_finite_[row * (row + 1) / 2 + column];
  };
  CovarianceLayout layout;
  std::vector<std::size_t> places;  // of the elements with a variance above zero
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (!(element(i, i) > 0.0)) continue;
    layout.names.push_back(names_[i]);
    places.push_back(i);
  }
  if (places.empty()) return;
  const auto size = static_cast<Eigen::Index>(places.size());
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::NullaryExpr(size, size, [&](Eigen::Index i, Eigen::Index j) {
        return element(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]);
      });
  std::vector<Column> columns;
  AppendColumns(kCovarianceColumns, layout, columns);
  CsvFile file =
      CreateCsv(folder, estimator + "/final_covariance.csv", std::move(columns), run_columns);
  for (std::size_t i = 0; i < places.size(); ++i) {
    WriteCells(kCovarianceColumns, layout, {i, covariance}, file);
    file.EndRow();
  }
  file.Close();
}

}  // namespace alidade::internal
