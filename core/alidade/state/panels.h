// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::internal {

/// A matrix in panels of `height` rows one after the other, each by columns: the kernels take it as
/// it is. What the last panel has below the last row counts for nothing.
struct Panels {
  double* data;
  long rows, columns, height;

  long panel_size() const { return height * columns; }
  long size() const { return (rows + height - 1) / height * panel_size(); }
  double& operator()(long i, long j) const {
    return data[i / height * panel_size() + j * height + i % height];
  }
};

}  // namespace alidade::internal
