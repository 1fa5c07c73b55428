// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "alidade/model/plugin_abi.h"

namespace alidade::internal {

/// The AlidadeHost that is lent to a plugin while it creates a model. It lies in memory that is
/// never given back: a plugin that keeps the pointer, against the rules, finds nobody there.
class LentHost {
 public:
  /// `reader` is who answers; the caller sets the functions of c(), which ask ReaderOf first.
  explicit LentHost(void* reader);
  /// Reads give -1 from now on.
  ~LentHost();
  LentHost(const LentHost&) = delete;
  LentHost& operator=(const LentHost&) = delete;

  AlidadeHost& c() { return block_->host; }
  const AlidadeHost& c() const { return block_->host; }
  /// Who answers calls with this context; null: nobody does any more.
  template <class Reader>
  static Reader* ReaderOf(void* context) {
    auto* const reader = static_cast<Reader*>(static_cast<Block*>(context)->reader);
    if (reader == nullptr) NoteLateCall();
    return reader;
  }
  /// How many found nobody, in this process.
  static std::int64_t LateCalls();

 private:
  struct Block {
    AlidadeHost host{};
    void* reader = nullptr;
  };
  struct Idle;
  static void NoteLateCall();
  static Idle& IdleBlocks();
  static Block* Take();

  Block* block_;
};

}  // namespace alidade::internal
