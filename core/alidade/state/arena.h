// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <new>
#include <numeric>
#include <vector>

namespace alidade {

/// Allocates whole cache lines.
template <class T>
struct CacheLines {
  using value_type = T;  // NOLINT(readability-identifier-naming): of an allocator
  static constexpr std::align_val_t kLine{64};

  CacheLines() = default;
  template <class U>
  CacheLines(const CacheLines<U>& /*other*/) {}  // NOLINT(google-explicit-constructor): as well
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kLine));
  }
  void deallocate(T* data, std::size_t /*count*/) { ::operator delete(data, kLine); }
  friend bool operator==(const CacheLines& /*a*/, const CacheLines& /*b*/) { return true; }
};

/// Numbers in whole cache lines.
using AlignedNumbers = std::vector<double, CacheLines<double>>;

/// Memory for the numbers of a frame: taken piece by piece, given back at once, kept for the next
/// frame. A piece stays where it is until Reset. A copy has no pieces.
class Arena {
 public:
  Arena() = default;
  Arena(const Arena& /*other*/) {}
  Arena(Arena&&) = default;
  Arena& operator=(const Arena& other) {
    if (this != &other) Reset();
    return *this;
  }
  Arena& operator=(Arena&&) = default;

  /// `count` numbers of any value.
  double* Take(std::size_t count) {
    if (chunks_.empty() || count > chunks_.back().size() - used_) Grow(count);
    double* const piece = chunks_.back().data() + used_;
    used_ += count;
    return piece;
  }
  /// Ends all pieces.
  void Reset() {
    used_ = 0;
    if (chunks_.size() > 1) Merge();
  }

 private:
  std::size_t capacity() const {
    return std::accumulate(chunks_.begin(), chunks_.end(), std::size_t{0},
                           [](std::size_t sum, const auto& chunk) { return sum + chunk.size(); });
  }
  [[gnu::noinline]] void Grow(std::size_t count) {
    constexpr std::size_t kLeast = 64;
    chunks_.emplace_back(std::max({count, capacity(), kLeast}));
    used_ = 0;
  }
  [[gnu::noinline]] void Merge() {
    const std::size_t all = capacity();
    chunks_.clear();
    chunks_.emplace_back(all);
  }

  std::vector<std::vector<double>> chunks_;
  std::size_t used_ = 0;  ///< of the last chunk
};

}  // namespace alidade
