// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/errors_file.h"

#include <cmath>

#include "alidade/state/element_names.h"

namespace alidade::internal {

std::vector<bool> AreAngles(const Geometry& geometry) {
  std::vector<bool> angles;
  for (int i = 0; i < geometry.tangent; ++i) angles.push_back(geometry.IsAngular(i));
  return angles;
}

ErrorsFile::ErrorsFile(const OutputFolder& folder, const std::string& estimator,
                       const Problem& problem, const std::vector<int>& truth_of) {
  std::vector<std::string> header = {"t_s"};
  for (BlockId id = 0; id < static_cast<int>(problem.layout.blocks().size()); ++id) {
    const int truth = truth_of[static_cast<std::size_t>(id)];
    if (truth < 0) continue;
    const Block& block = problem.layout[id];
    const std::vector<std::string> names = TangentNames(block.name, block.space);
    const std::vector<bool> angles = AreAngles(block.geometry());
    blocks_.push_back({id, static_cast<std::size_t>(truth), elements_.size()});
    for (std::size_t i = 0; i < names.size(); ++i) {
      elements_.push_back({names[i], UnitOf(problem, id), truth, static_cast<int>(i), angles[i]});
      header.push_back(names[i]);
    }
    for (const std::string& name : names) header.push_back("sigma:" + name);
  }
  if (!blocks_.empty()) file_.emplace(folder, estimator + "/errors.csv", header);
}

void ErrorsFile::Add(const SourceFrame& frame, const State& state) {
  if (!file_) return;
  file_->Time(frame.timestamp);
  std::vector<double> error, sigma;
  for (const Tracked& tracked : blocks_) {
    const Block& block = state.layout()[tracked.id];
    const Geometry& geometry = block.geometry();
    const auto size = static_cast<std::size_t>(geometry.tangent);
    error.clear();
    sigma.clear();
    if (block.present && tracked.truth < frame.truth.size() &&
        !frame.truth[tracked.truth].empty()) {
      error.resize(size);
      geometry.Minus(frame.truth[tracked.truth].data(), state.value(tracked.id), error.data());
    }
    for (std::size_t i = 0; i < error.size(); ++i) {
      error[i] = 0.0 - error[i];
      RecordedError& element = elements_[tracked.first + i];
      element.is_known = element.is_known || std::isfinite(error[i]);
    }
    for (std::size_t i = 0; block.has_covariance() && i < size; ++i) {
      const int row = block.tangent_offset + static_cast<int>(i);
      sigma.push_back(std::sqrt(state.covariance().Variance(row)));
      RecordedError& element = elements_[tracked.first + i];
      element.is_random = element.is_random || (std::isfinite(sigma[i]) && sigma[i] > 0.0);
    }
    file_->Numbers(error.data(), error.size(), size).Numbers(sigma.data(), sigma.size(), size);
  }
  file_->EndRow();
}

void ErrorsFile::Close() {
  if (file_) file_->Close();
}

}  // namespace alidade::internal
