// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/data_hash.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace alidade::internal {
namespace {

void Append(std::string& bytes, std::uint64_t number) {
  for (int shift = 0; shift < 64; shift += 8) bytes += static_cast<char>(number >> shift & 0xff);
}

void Append(std::string& bytes, const std::string& text) {
  Append(bytes, text.size());
  bytes += text;
}

void Append(std::string& bytes, const std::vector<double>& values) {
  Append(bytes, values.size());
  for (const double value : values) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Append(bytes, std::bit_cast<std::uint64_t>(std::isnan(value) ? nan : value + 0.0));
  }
}

}  // namespace

DataHash::DataHash(std::vector<StreamInfo> streams, std::vector<StreamInfo> truths)
    : streams_(std::move(streams)), truths_(std::move(truths)) {}

void DataHash::Add(const SourceFrame& frame) {
  const auto name_of = [&](const Measurement* m) -> const std::string& {
    return streams_[static_cast<std::size_t>(m->stream)].name;
  };
  std::vector<const Measurement*> sorted;
  for (const Measurement& m : frame.measurements) sorted.push_back(&m);
  std::ranges::stable_sort(sorted, {}, name_of);
  bytes_.clear();
  Append(bytes_, static_cast<std::uint64_t>(frame.timestamp));
  Append(bytes_, sorted.size());
  for (const Measurement* const m : sorted) {
    Append(bytes_, static_cast<std::uint64_t>(m->timestamp));
    Append(bytes_, name_of(m));
    Append(bytes_, static_cast<std::uint64_t>(m->landmark));
    Append(bytes_, m->values);
    Append(bytes_, m->covariance);
    if (!m->known.empty()) Append(bytes_, m->known);
  }
  measurements_.Add(bytes_);

  bytes_.clear();
  for (std::size_t t = 0; t < std::min(frame.truth.size(), truths_.size()); ++t) {
    if (frame.truth[t].empty()) continue;
    Append(bytes_, static_cast<std::uint64_t>(frame.timestamp));
    Append(bytes_, truths_[t].name);
    Append(bytes_, frame.truth[t]);
  }
  has_truth_ = has_truth_ || !bytes_.empty();
  truth_.Add(bytes_);
}

}  // namespace alidade::internal
