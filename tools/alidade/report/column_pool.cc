// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/column_pool.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace alidade::internal {
namespace {

static_assert(std::endian::native == std::endian::little);

std::string Base64(std::span<const unsigned char> bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

/// Returns the column of `values` with the type `type` and the further keys `details`.
template <class Value>
Json Binary(const char* type, const std::vector<Value>& values,
            const Json& details = Json::object()) {
  Json column = {{"d", type}, {"n", values.size()}};
  column.update(details);
  const auto* const first = reinterpret_cast<const unsigned char*>(values.data());
  column["b"] = Base64({first, values.size() * sizeof(Value)});
  return column;
}

Json Constant(std::size_t size, const Json& value) {
  return {{"d", "const"}, {"n", size}, {"v", value}};
}

template <class Value>
Json NarrowIntegers(const char* type, std::span<const std::uint32_t> values) {
  return Binary(type, std::vector<Value>(values.begin(), values.end()));
}

/// Returns the largest magnitude among the finite values.
double LargestMagnitude(std::span<const double> values) {
  double largest = 0.0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

/// Returns the float nearest to `value`. A value beyond the range of a float becomes infinite.
float FloatOf(double value) {
  if (std::abs(value) <= std::numeric_limits<float>::max()) return static_cast<float>(value);
  return std::copysign(std::numeric_limits<float>::infinity(),
                       static_cast<float>(std::signbit(value) ? -1 : 1)) +
         (std::isnan(value) ? std::numeric_limits<float>::quiet_NaN() : 0.0F);
}

}  // namespace

int ColumnPool::Add(const Json& column) {
  const auto [entry, is_new] = indices_.try_emplace(column.dump(), std::ssize(columns_));
  if (is_new) columns_.push_back(&entry->first);
  return entry->second;
}

int ColumnPool::AddNumbers(std::span<const double> values) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const auto first = std::ranges::find_if(values, is_finite);
  if (first == values.end()) {
    const bool has_infinity = std::ranges::any_of(values, [](double v) { return std::isinf(v); });
    if (!has_infinity) return Add(Constant(values.size(), {}));
  }
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!is_finite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  if (least == greatest && std::ranges::all_of(values, is_finite)) {
    return Add(Constant(values.size(), least));
  }
  const double range = greatest - least;
  const bool has_offset = range > 0.0 && LargestMagnitude(values) > 1000.0 * range;
  const double offset = has_offset ? *first : 0.0;
  std::vector<float> floats;
  floats.reserve(values.size());
  for (const double value : values) floats.push_back(FloatOf(value - offset));
  return Add(Binary("f4", floats, has_offset ? Json::object({{"o", offset}}) : Json::object()));
}

int ColumnPool::AddSeries(std::span<const double> values) {
  constexpr std::uint16_t kNegative = 0x8000, kLargest = 32765, kInfinite = 32766, kMissing = 32767;
  if (values.size() <= kLongSeries) return AddNumbers(values);
  double least = std::numeric_limits<double>::infinity(), greatest = 0.0;
  for (const double value : values) {
    const double magnitude = std::abs(value);
    if (!std::isfinite(value) || magnitude == 0.0) continue;
    least = std::min(least, magnitude);
    greatest = std::max(greatest, magnitude);
  }
  if (!(greatest > least)) return AddNumbers(values);
  const double start = std::log2(least), step = (std::log2(greatest) - start) / (kLargest - 1);
  const auto code = [&](double value) -> std::uint16_t {
    if (std::isnan(value)) return kMissing;
    if (value == 0.0) return 0;
    const double level = std::isinf(value)
                             ? kInfinite
                             : 1.0 + std::round((std::log2(std::abs(value)) - start) / step);
    return static_cast<std::uint16_t>(level) | (value < 0.0 ? kNegative : 0U);
  };
  std::vector<std::uint16_t> codes(values.size());
  std::ranges::transform(values, codes.begin(), code);
  return Add(Binary("l2", codes, {{"v", start}, {"s", step}}));
}

int ColumnPool::AddCloud(std::span<const double> values, double resolution) {
  constexpr double kSteps = 32000.0;
  constexpr std::int16_t kMissing = -32768;
  const double largest = LargestMagnitude(values);
  const double step = std::max(resolution, (largest > 0.0 ? largest : 1.0) / kSteps);
  std::vector<std::int16_t> numbers;
  numbers.reserve(values.size());
  for (const double value : values) {
    const double steps = std::clamp(std::round(value / step), -32767.0, 32767.0);
    numbers.push_back(std::isnan(value) ? kMissing : static_cast<std::int16_t>(steps));
  }
  return Add(Binary("i2", numbers, {{"s", step}}));
}

int ColumnPool::AddIntegers(std::span<const std::uint32_t> values) {
  const auto [least, greatest] = std::ranges::minmax_element(values);
  if (least == values.end()) return Add(NarrowIntegers<std::uint8_t>("u1", values));
  if (*least == *greatest) return Add(Constant(values.size(), *least));
  if (*greatest <= 0xFF) return Add(NarrowIntegers<std::uint8_t>("u1", values));
  if (*greatest <= 0xFFFF) return Add(NarrowIntegers<std::uint16_t>("u2", values));
  return Add(NarrowIntegers<std::uint32_t>("u4", values));
}

int ColumnPool::AddIds(std::span<const double> values) {
  std::vector<double> ids(values.begin(), values.end());
  std::ranges::replace_if(
      ids, [](double id) { return std::isnan(id); }, 0.0);
  const auto is_small = [](double id) { return id <= std::numeric_limits<std::uint32_t>::max(); };
  if (!std::ranges::all_of(ids, is_small)) return Add(Binary("f8", ids));
  return AddIntegers(std::vector<std::uint32_t>(ids.begin(), ids.end()));
}

int ColumnPool::AddTimes(std::span<const Timestamp> times, Timestamp origin) {
  bool is_regular = times.size() > 1;
  for (std::size_t i = 2; i < times.size(); ++i) {
    is_regular = is_regular && times[i] - times[i - 1] == times[1] - times[0];
  }
  if (is_regular) {
    return Add({{"d", "lin"},
                {"n", times.size()},
                {"v", Seconds(times[0] - origin)},
                {"s", Seconds(times[1] - times[0])}});
  }
  std::vector<double> seconds;
  seconds.reserve(times.size());
  for (const Timestamp time : times) seconds.push_back(Seconds(time - origin));
  return Add(Binary("f8", seconds));
}

int ColumnPool::AddSelection(int source, std::span<const std::uint32_t> indices) {
  const int index_column = AddIntegers(indices);
  return Add({{"d", "take"}, {"n", indices.size()}, {"of", source}, {"i", index_column}});
}

std::string ColumnPool::Text() const {
  std::string text = "[";
  for (const std::string* column : columns_) {
    if (text.size() > 1) text += ',';
    text += *column;
  }
  return text + ']';
}

}  // namespace alidade::internal
