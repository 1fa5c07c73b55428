// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/estimate_history.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

bool IsPosition(const BlockLayout& block) {
  const bool is_vector = block.ambient() == block.tangent() && !block.space.geometry.IsAngular(0);
  const bool is_in_space = block.ambient() == 2 || block.ambient() == 3;
  return is_vector && is_in_space && block.name.ends_with("position");
}

/// Returns the length of a vector; NaN if it is empty.
double Length(const std::vector<double>& vector) {
  if (vector.empty()) return std::numeric_limits<double>::quiet_NaN();
  double square = 0.0;
  for (const double element : vector) square += element * element;
  return std::sqrt(square);
}

}  // namespace

EstimateHistory::EstimateHistory(const std::vector<BlockLayout>& blocks)
    : blocks_(blocks), last_(blocks.size()) {
  for (const BlockLayout& block : blocks_) {
    std::vector<ElementHistory>& elements = elements_.emplace_back();
    for (const std::string& name : TangentNames(block.name, block.space)) {
      elements.emplace_back().excursion.element = name;
    }
  }
  const auto position = std::ranges::find_if(blocks_, IsPosition);
  if (position != blocks_.end()) {
    position_ = static_cast<std::size_t>(position - blocks_.begin());
  }
}

void EstimateHistory::AddError(bool is_outside, Timestamp timestamp, ElementHistory& element) {
  if (!is_outside) {
    element.current = 0;
    return;
  }
  ++element.excursion.outside;
  if (element.current++ == 0) element.current_first = timestamp;
  if (element.current <= element.excursion.longest) return;
  element.excursion.longest = element.current;
  element.excursion.first = element.current_first;
  element.excursion.last = timestamp;
}

void EstimateHistory::Add(const SourceFrame& frame, const State& state) {
  constexpr double kBound = 3.0;  // sigmas
  const BlockRow row{frame, state};
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (blocks_[b].truth < 0) {
      last_[b] = {row.ValuesOf(blocks_[b]), row.SigmasOf(blocks_[b])};
      continue;
    }
    const std::vector<double> error = row.ErrorOf(blocks_[b]), sigma = row.SigmasOf(blocks_[b]);
    for (std::size_t i = 0; i < std::min(error.size(), sigma.size()); ++i) {
      const bool is_outside = sigma[i] > 0.0 && std::abs(error[i]) > kBound * sigma[i];
      AddError(is_outside, frame.timestamp, elements_[b][i]);
    }
  }
  if (position_) AddPosition(row, frame.timestamp);
  ++rows_;
}

std::vector<FinalValue> EstimateHistory::FinalValues() const {
  std::vector<FinalValue> final_values;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto& [values, sigmas] = last_[b];
    if (values.size() != sigmas.size()) continue;  // elements of the tangent space have no value
    for (std::size_t i = 0; i < values.size(); ++i) {
      final_values.push_back({elements_[b][i].excursion.element, blocks_[b].owner(),
                              blocks_[b].unit, values[i], sigmas[i]});
    }
  }
  return final_values;
}

void EstimateHistory::AddPosition(const BlockRow& row, Timestamp timestamp) {
  constexpr double kFall = 0.5;
  const BlockLayout& block = blocks_[*position_];
  if (const double* const truth = row.TruthOf(block)) {
    std::vector<double> step(truth, truth + block.ambient());
    std::vector<double> position = step;
    for (std::size_t i = 0; i < last_truth_.size(); ++i) step[i] -= last_truth_[i];
    if (!last_truth_.empty()) path_ += Length(step);
    last_truth_ = std::move(position);
  }
  SigmaFall fall = next_fall_;
  fall.row = rows_;
  fall.timestamp = timestamp;
  fall.sigma_after = Length(row.SigmasOf(block));
  fall.error_after = Length(row.ErrorOf(block));
  next_fall_.sigma_before = fall.sigma_after;
  next_fall_.error_before = fall.error_after;
  if (!(fall.sigma_after < kFall * fall.sigma_before)) return;
  while (!falls_.empty() && falls_.back().ratio() > fall.ratio()) falls_.pop_back();
  falls_.push_back(fall);
}

std::optional<Excursion> EstimateHistory::LongestExcursion() const {
  const Excursion* longest = nullptr;
  for (const std::vector<ElementHistory>& block : elements_) {
    for (const ElementHistory& element : block) {
      const Excursion& excursion = element.excursion;
      if (longest == nullptr || excursion.longest > longest->longest) longest = &excursion;
    }
  }
  if (longest == nullptr || longest->longest == 0) return std::nullopt;
  return *longest;
}

std::optional<SigmaFall> EstimateHistory::LargestFall() const {
  const auto fall = std::ranges::find_if(
      falls_, [this](const SigmaFall& candidate) { return 10 * candidate.row >= rows_; });
  return fall == falls_.end() ? std::nullopt : std::optional(*fall);
}

}  // namespace alidade::internal
