// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"

namespace alidade {

/// Range of a parameter. The range does not contain an open bound.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;
};

inline constexpr Range kPositive{0.0, std::numeric_limits<double>::infinity(), true, false};
inline constexpr Range kNonNegative{0.0, std::numeric_limits<double>::infinity(), false, false};

/// Parameters of a model, which are read from the entry of the model in the config. Each read also
/// declares the parameter. The keys, units, ranges, defaults and docs of all reads form the schema
/// of the model (`alidade plugins info`). Other keys are rejected. An invalid value does not stop
/// the constructor of the model. Instead, the read returns a valid substitute. Afterwards the host
/// rejects the model and reports all errors at once.
class Params {
 public:
  explicit Params(const AlidadeHost* host) : host_(host) {}

  /// Returns the value of `key`, or a substitute within `range` if the value is invalid. The key is
  /// optional if `fallback` has a value.
  double Number(const char* key, const char* unit, const char* doc, Range range = {},
                std::optional<double> fallback = std::nullopt) {
    double value = fallback.value_or(StandIn(range));
    Read(ALIDADE_PARAM_NUMBER, key, unit, doc, range, 1, fallback ? &*fallback : nullptr, &value,
         1);
    return value;
  }
  /// Returns the value of `key`, or nullopt if the value is the word `none`. The default is `none`.
  std::optional<double> NumberOrNone(const char* key, const char* unit, const char* doc,
                                     Range range) {
    const double infinity = std::numeric_limits<double>::infinity();
    double value = infinity;
    AlidadeParam param = Describe(ALIDADE_PARAM_NUMBER, key, unit, doc, range, 1, &infinity);
    param.flags |= ALIDADE_PARAM_OR_NONE;
    host_->read(host_->context, &param, &value, 1);
    return value < infinity ? std::optional(value) : std::nullopt;
  }
  double Positive(const char* key, const char* unit, const char* doc,
                  std::optional<double> fallback = std::nullopt) {
    return Number(key, unit, doc, kPositive, fallback);
  }
  double NonNegative(const char* key, const char* unit, const char* doc,
                     std::optional<double> fallback = std::nullopt) {
    return Number(key, unit, doc, kNonNegative, fallback);
  }
  int Integer(const char* key, const char* doc, int low, int high,
              std::optional<int> fallback = std::nullopt) {
    double value = fallback.value_or(low);
    const double default_value = value;
    Read(ALIDADE_PARAM_INTEGER, key, "", doc, {double(low), double(high)}, 1,
         fallback ? &default_value : nullptr, &value, 1);
    return static_cast<int>(value);
  }
  bool Flag(const char* key, const char* doc, std::optional<bool> fallback = std::nullopt) {
    double value = fallback.value_or(false) ? 1.0 : 0.0;
    const double default_value = value;
    Read(ALIDADE_PARAM_FLAG, key, "", doc, {0.0, 1.0}, 1, fallback ? &default_value : nullptr,
         &value, 1);
    return value != 0.0;
  }
  /// Returns the index in `choices` of the chosen name. `fallback` is also an index.
  template <class Names = std::initializer_list<const char*>>
  int Choice(const char* key, const Names& choices, const char* doc,
             std::optional<int> fallback = std::nullopt) {
    double value = fallback.value_or(0);
    const double default_value = value;
    AlidadeParam param =
        Describe(ALIDADE_PARAM_CHOICE, key, "", doc, {}, 1, fallback ? &default_value : nullptr);
    param.choices = std::data(choices);
    param.choice_count = static_cast<std::int32_t>(choices.size());
    host_->read(host_->context, &param, &value, 1);
    return static_cast<int>(value);
  }
  /// Returns the text of `key` unchanged. The text has at most 4096 bytes.
  std::string Text(const char* key, const char* doc,
                   const std::optional<std::string>& fallback = std::nullopt) {
    AlidadeParam param = Describe(ALIDADE_PARAM_TEXT, key, "", doc, {}, 1, nullptr);
    if (fallback) {
      param.flags |= ALIDADE_PARAM_HAS_DEFAULT;
      param.fallback_text = fallback->c_str();
    }
    std::vector<char> text(ALIDADE_MAX_TEXT + 1);
    const std::int32_t size = host_->read_text(host_->context, &param, text.data(),
                                               static_cast<std::int32_t>(text.size()));
    return size < 0 ? fallback.value_or("") : std::string(text.data());
  }
  /// Returns the `N` numbers of `key`, which all have the same unit and range.
  template <int N>
  std::array<double, N> Vector(const char* key, const char* unit, const char* doc, Range range = {},
                               std::optional<std::array<double, N>> fallback = std::nullopt) {
    std::array<double, N> values;
    values.fill(StandIn(range));
    if (fallback) values = *fallback;
    Read(ALIDADE_PARAM_NUMBER, key, unit, doc, range, N, fallback ? fallback->data() : nullptr,
         values.data(), N);
    return values;
  }
  /// Returns `N` numbers with the same unit and range. The config contains `N` numbers, or one
  /// number that applies to all axes.
  template <int N>
  std::array<double, N> PerAxis(const char* key, const char* unit, const char* doc,
                                Range range = {}) {
    double values[N + 1];  // one more element, to detect a list that is too long
    const std::int32_t count =
        Read(ALIDADE_PARAM_NUMBER, key, unit, doc, range, -1, nullptr, values, N + 1);
    std::array<double, N> result;
    result.fill(count >= 1 ? values[0] : StandIn(range));
    if (count == N) std::copy_n(values, N, result.begin());
    const bool is_list = count > 1;
    if (is_list && count != N) Fail(key, "needs one number, or one number for each axis");
    return result;
  }
  /// Reports an error of the parameters, for example if two parameters contradict each other.
  /// `text` follows the key in the message.
  void Fail(const char* key, const char* text) { host_->fail(host_->context, key, text); }

 private:
  static double StandIn(const Range& r) {
    const double inf = std::numeric_limits<double>::infinity();
    if (r.low > -inf && r.high < inf) return 0.5 * (r.low + r.high);
    if (r.low > -inf) return r.low + 1.0;
    return r.high < inf ? r.high - 1.0 : 0.0;
  }
  static AlidadeParam Describe(std::uint32_t kind, const char* key, const char* unit,
                               const char* doc, const Range& range, int count,
                               const double* fallback) {
    AlidadeParam param{};
    param.struct_size = sizeof(AlidadeParam);
    param.kind = kind;
    param.key = key;
    param.unit = unit;
    param.doc = doc;
    param.count = count;
    if (fallback != nullptr) param.flags |= ALIDADE_PARAM_HAS_DEFAULT;
    if (range.low_open) param.flags |= ALIDADE_PARAM_LOW_OPEN;
    if (range.high_open) param.flags |= ALIDADE_PARAM_HIGH_OPEN;
    param.low = range.low;
    param.high = range.high;
    param.fallback = fallback;
    return param;
  }
  std::int32_t Read(std::uint32_t kind, const char* key, const char* unit, const char* doc,
                    const Range& range, int count, const double* fallback, double* values,
                    int capacity) {
    const AlidadeParam param = Describe(kind, key, unit, doc, range, count, fallback);
    return host_->read(host_->context, &param, values, capacity);
  }

  const AlidadeHost* host_;
};

}  // namespace alidade
