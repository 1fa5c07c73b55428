// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/errors_file.h"

#include <algorithm>
#include <cmath>

namespace alidade::internal {

ErrorsFile::ErrorsFile(const OutputFolder& folder, const std::string& estimator,
                       const std::vector<BlockLayout>& blocks, RunColumns& run_columns) {
  std::vector<Column> columns = {kTimeColumn};
  for (const BlockLayout& block : blocks) {
    if (block.truth < 0) continue;
    blocks_.push_back(block);
    AddOwner(block);
    AppendColumns(kErrorColumns, block, columns);
  }
  if (blocks_.empty()) return;
  for (const OwnerLayout& owner : owners_) AppendColumns(kOwnerColumns, owner, columns);
  file_ = CreateCsv(folder, estimator + "/errors.csv", std::move(columns), run_columns);
}

/// Adds a block to its owner.
void ErrorsFile::AddOwner(const BlockLayout& block) {
  auto owner = std::ranges::find(owners_, block.owner(), &OwnerLayout::name);
  if (owner == owners_.end()) owner = owners_.insert(owner, {block.owner(), {}});
  owner->blocks.push_back(block);
}

void ErrorsFile::Add(const SourceFrame& frame, const State& state) {
  if (!file_) return;
  const BlockRow row{frame, state};
  file_->Time(frame.timestamp);
  for (const BlockLayout& block : blocks_) WriteCells(kErrorColumns, block, row, *file_);
  for (const OwnerLayout& owner : owners_) WriteCells(kOwnerColumns, owner, row, *file_);
  file_->EndRow();
}

void ErrorsFile::Close() {
  if (file_) file_->Close();
}

}  // namespace alidade::internal
