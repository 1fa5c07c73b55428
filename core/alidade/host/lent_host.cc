// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/lent_host.h"

#include <atomic>
#include <deque>
#include <mutex>

namespace alidade::internal {
namespace {

std::atomic<std::int64_t> late_calls = 0;

}  // namespace

void LentHost::NoteLateCall() { ++late_calls; }
std::int64_t LentHost::LateCalls() { return late_calls; }

/// Blocks that nobody uses, for so long that a late call is likely to find them so.
struct LentHost::Idle {
  std::mutex mutex;
  std::deque<Block*> blocks;
};

LentHost::Idle& LentHost::IdleBlocks() {
  static Idle& idle = *new Idle;  // plugins may call while the program ends
  return idle;
}

LentHost::Block* LentHost::Take() {
  constexpr std::size_t kKept = 64;
  Idle& idle = IdleBlocks();
  const std::lock_guard lock(idle.mutex);
  if (idle.blocks.size() <= kKept) return new Block;
  Block* const oldest = idle.blocks.front();
  idle.blocks.pop_front();
  return oldest;
}

LentHost::LentHost(void* reader) : block_(Take()) {
  block_->reader = reader;
  block_->host = {};
  block_->host.struct_size = sizeof(AlidadeHost);
  block_->host.abi_major = ALIDADE_ABI_MAJOR;
  block_->host.abi_minor = ALIDADE_ABI_MINOR;
  block_->host.context = block_;
}

LentHost::~LentHost() {
  block_->reader = nullptr;
  Idle& idle = IdleBlocks();
  const std::lock_guard lock(idle.mutex);
  idle.blocks.push_back(block_);
}

}  // namespace alidade::internal
