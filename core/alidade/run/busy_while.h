// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace alidade::internal {

/// Tells RunOptions::busy that an estimator or an observer works, for as long as this lives.
class BusyWhile {
 public:
  explicit BusyWhile(const std::function<void(bool)>& busy) : busy_(busy) {
    if (busy_) busy_(true);
  }
  ~BusyWhile() {
    if (busy_) busy_(false);
  }
  BusyWhile(const BusyWhile&) = delete;
  BusyWhile& operator=(const BusyWhile&) = delete;

 private:
  const std::function<void(bool)>& busy_;
};

}  // namespace alidade::internal
