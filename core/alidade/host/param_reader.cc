// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/param_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <tuple>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/words.h"
#include "alidade/config/tree.h"
#include "alidade/host/abi_read.h"

namespace alidade::internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string RangeText(const AlidadeParam& param) {
  const bool low_open = (param.flags & ALIDADE_PARAM_LOW_OPEN) != 0;
  const bool high_open = (param.flags & ALIDADE_PARAM_HIGH_OPEN) != 0;
  const bool bounded_below = param.low > -kInfinity, bounded_above = param.high < kInfinity;
  if (bounded_below && bounded_above) {
    return (low_open ? "(" : "[") + NumberText(param.low) + ", " + NumberText(param.high) +
           (high_open ? ")" : "]");
  }
  if (bounded_below) return (low_open ? "> " : ">= ") + NumberText(param.low);
  if (bounded_above) return (high_open ? "< " : "<= ") + NumberText(param.high);
  return {};
}

std::string TypeText(const AlidadeParam& param) {
  const char* const names[] = {"", "number", "integer", "flag", "choice"};
  const std::string name = names[param.kind];
  if (param.count < 0) return name + "[]";
  return param.count == 1 ? name : name + '[' + std::to_string(param.count) + ']';
}

std::string ValueText(const AlidadeParam& param, double value) {
  if (param.kind == ALIDADE_PARAM_FLAG) return value != 0.0 ? "true" : "false";
  if ((param.flags & ALIDADE_PARAM_OR_NONE) != 0 && value == kInfinity) return "none";
  if (param.kind != ALIDADE_PARAM_CHOICE) return NumberText(value);
  const bool known = value >= 0.0 && value < param.choice_count;
  return known ? Text(param.choices[static_cast<int>(value)]) : "";
}

std::vector<double> Fallback(const AlidadeParam& param) {
  if (param.fallback == nullptr) return {};
  return std::vector<double>(param.fallback, param.fallback + std::max(param.count, 0));
}

bool HasFallback(const AlidadeParam& param) {
  return (param.flags & ALIDADE_PARAM_HAS_DEFAULT) != 0;
}

std::string ValuesText(const AlidadeParam& param, const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + ValueText(param, value);
  return param.count == 1 ? text : '[' + text + ']';
}

std::string FallbackText(const AlidadeParam& param) {
  return HasFallback(param) ? ValuesText(param, Fallback(param)) : "";
}

std::vector<std::string> Choices(const AlidadeParam& param) {
  std::vector<std::string> choices;
  for (int i = 0; i < param.choice_count; ++i) choices.push_back(Text(param.choices[i]));
  return choices;
}

ParamInfo Describe(const AlidadeParam& param) {
  ParamInfo info;
  info.key = param.key;
  info.unit = Text(param.unit);
  info.doc = Text(param.doc);
  info.type = TypeText(param);
  const bool number = param.kind == ALIDADE_PARAM_NUMBER || param.kind == ALIDADE_PARAM_INTEGER;
  if (number) info.range = RangeText(param);
  if ((param.flags & ALIDADE_PARAM_OR_NONE) != 0) info.range += " or none";
  info.fallback = FallbackText(param);
  info.choices = Choices(param);
  return info;
}

/// Whether the defaults are there that it says it has; that of a choice is one of its names.
bool GoodFallback(const AlidadeParam& param) {
  if (!HasFallback(param) || param.count < 0) return true;
  if (param.fallback == nullptr) return false;
  const bool choice = param.kind == ALIDADE_PARAM_CHOICE;
  return !choice || (param.fallback[0] >= 0.0 && param.fallback[0] < param.choice_count);
}

/// The parameter, where it follows the rules of plugin_abi.h; else an exception.
AlidadeParam Checked(const AlidadeParam* from, const double* values, std::int32_t capacity) {
  if (from == nullptr) throw Error(ExitCode::kPlugin, "asks for no parameter at all");
  const AlidadeParam param = ReadPrefix(from);
  const std::string key = Text(param.key);
  const bool known = param.kind >= ALIDADE_PARAM_NUMBER && param.kind <= ALIDADE_PARAM_CHOICE;
  const bool choice = param.kind == ALIDADE_PARAM_CHOICE;
  if (key.empty() || !known || param.count == 0 || param.count < -1 || param.count > capacity ||
      values == nullptr || choice != (param.choices != nullptr && param.choice_count > 0) ||
      (choice && param.count != 1) || !GoodFallback(param)) {
    throw Error(ExitCode::kPlugin,
                "asks for parameter '" + key + "' in a way that this version does not understand");
  }
  return param;
}

/// `(px, > 0: rectified focal length)`
std::string Meaning(const AlidadeParam& param) {
  const ParamInfo info = Describe(param);
  std::vector<std::string> parts;
  if (!info.unit.empty()) parts.push_back(info.unit);
  if (!info.range.empty()) parts.push_back(info.range);
  if (!info.choices.empty()) parts.push_back("one of " + Join(info.choices));
  std::string text = Join(parts);
  if (!text.empty() && !info.doc.empty()) text += ": ";
  return '(' + text + info.doc + ')';
}

double NumberOrNone(const AlidadeParam& param, const Node& node, bool low_open, bool high_open) {
  if (node.kind() == Node::Kind::kScalar && node.Text() == "none") return kInfinity;
  try {
    return node.Number(param.low, param.high, low_open, high_open);
  } catch (const Error& e) {
    throw Error(e.code(), std::string(e.what()) + ", or none");
  }
}

double One(const AlidadeParam& param, const Node& node) {
  const bool low_open = (param.flags & ALIDADE_PARAM_LOW_OPEN) != 0;
  const bool high_open = (param.flags & ALIDADE_PARAM_HIGH_OPEN) != 0;
  constexpr double kExact = 9007199254740992.0;
  switch (param.kind) {
    case ALIDADE_PARAM_INTEGER:
      return static_cast<double>(
          node.Integer(static_cast<std::int64_t>(std::clamp(param.low, -kExact, kExact)),
                       static_cast<std::int64_t>(std::clamp(param.high, -kExact, kExact))));
    case ALIDADE_PARAM_FLAG:
      return node.Flag() ? 1.0 : 0.0;
    case ALIDADE_PARAM_CHOICE:
      return node.Choice(Choices(param));
    default:
      return (param.flags & ALIDADE_PARAM_OR_NONE) != 0
                 ? NumberOrNone(param, node, low_open, high_open)
                 : node.Number(param.low, param.high, low_open, high_open);
  }
}

std::vector<double> All(const AlidadeParam& param, const Node& node) {
  if (param.count == 1) return {One(param, node)};
  const std::vector<Node> items = node.ItemsOrOne();
  if (param.kind == ALIDADE_PARAM_NUMBER) {
    static_cast<void>(node.Numbers(param.count));
  } else if (param.count > 0 && std::ssize(items) != param.count) {
    node.Fail(std::to_string(items.size()) + " values", std::to_string(param.count));
  }
  std::vector<double> values;
  for (const Node& item : items) values.push_back(One(param, item));
  return values;
}

}  // namespace

ParamReader::ParamReader(const Node& entry, std::string owner, std::string representation)
    : entry_(entry), owner_(std::move(owner)), representation_(std::move(representation)) {
  host_.struct_size = sizeof(AlidadeHost);
  host_.abi_major = ALIDADE_ABI_MAJOR;
  host_.abi_minor = ALIDADE_ABI_MINOR;
  host_.context = this;
  host_.read = &ParamReader::Read;
  host_.fail = &ParamReader::Fail;
}

void ParamReader::Check() const {
  if (thrown_) std::rethrow_exception(thrown_);
  if (errors_.empty()) return;
  std::vector<std::string> lines(errors_.begin(), errors_.end());
  const auto by_place = [](const std::string& a, const std::string& b) {
    return strverscmp(a.c_str(), b.c_str()) < 0;
  };
  std::sort(lines.begin(), lines.end(), by_place);
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  throw Error(code_, Join(lines, "\n"));
}

std::int32_t ParamReader::Read(void* self, const AlidadeParam* param, double* values,
                               std::int32_t capacity) noexcept try {
  auto* reader = static_cast<ParamReader*>(self);
  try {
    const std::vector<double> read = reader->Values(reader->Expect(param, values, capacity));
    std::copy_n(read.begin(), std::min(std::ssize(read), std::ptrdiff_t{capacity}), values);
    return static_cast<std::int32_t>(read.size());
  } catch (const Error& e) {
    reader->errors_.emplace_back(e.what());
  }
  return -1;
} catch (...) {
  static_cast<ParamReader*>(self)->thrown_ = std::current_exception();
  return -1;
}

void ParamReader::Fail(void* self, const char* key, const char* text) noexcept try {
  auto* reader = static_cast<ParamReader*>(self);
  if (Text(text) == std::bad_alloc().what()) throw std::bad_alloc();  // on the other side
  if (Text(key).empty()) {
    reader->failure_ = Text(text).empty() ? "it does not say why" : Text(text);
    return;
  }
  const Node base = reader->BaseOf(Text(key));
  Place place = base.place();
  std::optional<Node> at = base;
  std::string rest = key;
  for (std::size_t dot = 0; at && at->is_map() && dot != std::string::npos;) {
    dot = rest.find('.');
    at = at->Find(rest.substr(0, dot));
    if (at) place = at->place();
    rest.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  reader->errors_.push_back(ErrorLine(place, PathBelow(base.path(), key), Text(text)));
} catch (...) {
  static_cast<ParamReader*>(self)->thrown_ = std::current_exception();
}

/// The parameter; one that breaks the rules is an error of the plugin, at the entry.
AlidadeParam ParamReader::Expect(const AlidadeParam* param, const double* values,
                                 std::int32_t capacity) {
  try {
    return Checked(param, values, capacity);
  } catch (const Error& e) {
    code_ = e.code();
    throw Error(code_, ErrorLine(entry_.place(), entry_.path(), owner_ + ' ' + e.what()));
  }
}

/// The map below which `key` is read: the entry, or the root.
Node ParamReader::BaseOf(const std::string& key) const {
  const std::string first = key.substr(0, key.find('.'));
  if (first == key || (first != "camera" && first != "landmarks")) return entry_;
  std::optional<Node> at = entry_;
  std::string rest = key;
  for (std::size_t dot = 0; at && dot != std::string::npos;) {
    dot = rest.find('.');
    at = at->Find(rest.substr(0, dot));
    rest.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  return at ? entry_ : entry_.Root();
}

std::vector<double> ParamReader::Values(const AlidadeParam& param) const {
  std::string rest = param.key;
  const std::vector<std::string> choices = Choices(param);
  const auto representation = std::ranges::find(choices, representation_);
  if (rest == "landmarks.representation" && representation != choices.end()) {
    return {static_cast<double>(representation - choices.begin())};
  }
  Node map = BaseOf(rest);
  for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest.erase(0, dot + 1)) {
    const std::optional<Node> child = map.Find(rest.substr(0, dot));
    if (!child) return Absent(param, map, rest);
    map = *child;
  }
  const std::optional<Node> node = map.Find(rest);
  if (!node) return Absent(param, map, rest);
  const std::vector<double> values = All(param, *node);
  ExpectCalibrated(param, *node, values);
  return values;
}

std::optional<Node> ParamReader::InCalibration(const std::string& key) const {
  std::optional<Node> at = entry_.Root().Find("calibration");
  std::string rest = key;
  for (std::size_t dot = 0; at && dot != std::string::npos;) {
    dot = rest.find('.');
    at = at->is_map() ? at->Find(rest.substr(0, dot)) : std::nullopt;
    rest.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  return at;
}

/// Refuses the `values` of the config at `node` where the data tell others.
void ParamReader::ExpectCalibrated(const AlidadeParam& param, const Node& node,
                                   const std::vector<double>& values) const {
  const std::optional<Node> data = InCalibration(param.key);
  if (!data) return;
  const auto same = [](double a, double b) {
    constexpr double kSame = 1e-6;  // of the value: digits that one of the two texts leaves out
    return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b));
  };
  const std::vector<double> told = All(param, *data);
  if (std::ranges::equal(values, told, same)) return;
  node.Fail(ValuesText(param, values) + " differs from the calibration of the data, " +
                ValuesText(param, told) + " in " + data->place().file,
            "the same value, no such key (the data determine it), or 'source.calibration: ignore'");
}

std::vector<double> ParamReader::Absent(const AlidadeParam& param, const Node& map,
                                        const std::string& key_in_map) const {
  const bool dotted = std::string_view(param.key).find('.') != std::string_view::npos;
  const std::optional<Node> data = InCalibration(param.key);
  if (data && (dotted || !HasFallback(param))) return All(param, *data);
  if (HasFallback(param)) return Fallback(param);
  const std::string first = key_in_map.substr(0, key_in_map.find('.'));
  try {
    static_cast<void>(map.At(first));
  } catch (const Error& e) {
    // The config also tells of a key that looks like the missing one, or has another unit.
    constexpr std::string_view kPhrase = ": missing key";
    std::string text = e.what();
    const std::size_t at = text.find(kPhrase);
    if (at != std::string::npos) {
      text.replace(
          at, kPhrase.size(),
          key_in_map.substr(first.size()) + ": missing; " + owner_ + " needs it " + Meaning(param));
    }
    throw Error(ExitCode::kBadConfig, text);
  }
  return {};
}

ParamRecorder::ParamRecorder() : trials_(1) {
  host_.struct_size = sizeof(AlidadeHost);
  host_.abi_major = ALIDADE_ABI_MAJOR;
  host_.abi_minor = ALIDADE_ABI_MINOR;
  host_.context = this;
  host_.read = &ParamRecorder::Read;
  host_.fail = [](void*, const char*, const char*) {};
}

std::int32_t ParamRecorder::Read(void* self, const AlidadeParam* from, double* values,
                                 std::int32_t capacity) noexcept {
  auto* recorder = static_cast<ParamRecorder*>(self);
  Trial& trial = recorder->trials_.back();
  try {
    const AlidadeParam param = Checked(from, values, capacity);
    const bool choice = param.kind == ALIDADE_PARAM_CHOICE;
    if (choice) values[0] = HasFallback(param) ? Fallback(param)[0] : 0.0;
    if (choice && trial.choice == param.key) values[0] = trial.value;
    const auto same = [&](const Asked& other) { return other.info.key == param.key; };
    if (std::none_of(trial.asked.begin(), trial.asked.end(), same)) {
      trial.asked.push_back({Describe(param), choice ? static_cast<int>(values[0]) : 0});
    }
    return std::max(param.count, 0);
  } catch (const std::bad_alloc&) {
    recorder->out_of_memory_ = true;
  } catch (const std::exception&) {
    // The plugin asks wrongly; it is told so when the model is made.
  }
  return -1;
}

std::string ParamRecorder::When(const std::string& key) const {
  const auto asks = [&](const Trial& trial) {
    return std::any_of(trial.asked.begin(), trial.asked.end(),
                       [&](const Asked& asked) { return asked.info.key == key; });
  };
  std::vector<std::string> conditions;
  for (const Asked& choice : trials_[0].asked) {
    std::vector<std::string> values;
    for (int i = 0; i < std::ssize(choice.info.choices); ++i) {
      const auto with_value = [&](const Trial& trial) {
        return trial.choice.empty() ? i == choice.value
                                    : trial.choice == choice.info.key && trial.value == i;
      };
      const auto trial = std::find_if(trials_.begin(), trials_.end(), with_value);
      if (trial != trials_.end() && asks(*trial)) values.push_back(choice.info.choices[i]);
    }
    if (values.empty() || values.size() == choice.info.choices.size()) continue;
    conditions.push_back(choice.info.key + " = " + Join(values, " or "));
  }
  return Join(conditions);
}

std::vector<ParamInfo> ParamRecorder::Result() const {
  if (out_of_memory_) throw std::bad_alloc();
  std::vector<ParamInfo> result;
  for (const Trial& trial : trials_) {
    for (const Asked& asked : trial.asked) {
      const auto same = [&](const ParamInfo& other) { return other.key == asked.info.key; };
      const auto known = std::find_if(result.begin(), result.end(), same);
      if (known == result.end()) {
        result.push_back(asked.info);
        result.back().when = When(asked.info.key);
      } else if (known->unit != asked.info.unit &&
                 !known->unit.ends_with(" or " + asked.info.unit)) {
        known->unit += " or " + asked.info.unit;
      }
    }
  }
  const auto rank = [](const ParamInfo& info) {
    return std::tuple(!info.when.empty(), !info.fallback.empty());
  };
  std::stable_sort(result.begin(), result.end(),
                   [&](const ParamInfo& a, const ParamInfo& b) { return rank(a) < rank(b); });
  return result;
}

}  // namespace alidade::internal
