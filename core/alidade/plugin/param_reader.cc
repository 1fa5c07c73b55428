// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/param_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <string_view>
#include <tuple>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/plugin/abi_read.h"

namespace alidade::internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kExact = 9007199254740992.0;  // up to here a double has all integers

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
  const char* const names[] = {"", "number", "integer", "flag", "choice", "text", "file"};
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

/// Whether it is a standard deviation of the noise, by its name.
bool IsNoise(const AlidadeParam& param) {
  const std::string_view key = param.key;
  return param.kind == ALIDADE_PARAM_NUMBER &&
         (key.starts_with("sigma_") || key.starts_with("noise."));
}

/// Its default, or else values within its range.
std::vector<double> StandIn(const AlidadeParam& param) {
  if (HasFallback(param) && param.count > 0) return Fallback(param);
  const bool bounded_below = param.low > -kInfinity, bounded_above = param.high < kInfinity;
  double value = 0.0;
  if (bounded_below) value = param.low + 1.0;
  if (bounded_above) value = param.high - 1.0;
  if (bounded_below && bounded_above) value = 0.5 * (param.low + param.high);
  return std::vector<double>(static_cast<std::size_t>(std::max(param.count, 1)), value);
}

std::string ValuesText(const AlidadeParam& param, const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + ValueText(param, value);
  return param.count == 1 ? text : '[' + text + ']';
}

bool IsText(const AlidadeParam& param) { return param.kind == ALIDADE_PARAM_TEXT; }

std::string FallbackText(const AlidadeParam& param) {
  if (IsText(param)) return Text(param.fallback_text);
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

/// Whether the defaults are there that it says it has; that of a choice is one of its names, that
/// of a number lies in its range.
bool GoodFallback(const AlidadeParam& param) {
  if (!HasFallback(param) || param.count < 0) return true;
  if (IsText(param)) return TextDefect(param.fallback_text).empty();
  if (param.fallback == nullptr) return false;
  return std::all_of(param.fallback, param.fallback + param.count, [&](double value) {
    if (param.kind == ALIDADE_PARAM_CHOICE) return value >= 0.0 && value < param.choice_count;
    const bool whole = value == std::trunc(value) && std::abs(value) <= kExact;
    if (param.kind == ALIDADE_PARAM_INTEGER && !whole) return false;
    const bool none = value == kInfinity && (param.flags & ALIDADE_PARAM_OR_NONE) != 0;
    return none || (value >= param.low && value <= param.high);
  });
}

/// A name, or several with a dot between them.
bool GoodKey(const char* key) {
  if (!GoodName(key)) return false;
  const std::string_view text = key;
  return text.front() != '.' && text.back() != '.' && text.find("..") == text.npos;
}

/// What breaks the rules of plugin_abi.h in a parameter, or "".
std::string ParamDefect(const AlidadeParam& param) {
  constexpr std::uint32_t kFlags = ALIDADE_PARAM_HAS_DEFAULT | ALIDADE_PARAM_LOW_OPEN |
                                   ALIDADE_PARAM_HIGH_OPEN | ALIDADE_PARAM_OR_NONE;
  const bool choice = param.kind == ALIDADE_PARAM_CHOICE;
  if (!GoodKey(param.key)) return "its key is no name";
  if (param.kind == ALIDADE_PARAM_FILE) return "it is a file";
  if (param.kind < ALIDADE_PARAM_NUMBER || param.kind > ALIDADE_PARAM_TEXT) {
    return "its kind is " + std::to_string(param.kind);
  }
  const std::string unknown = UnknownBits(param.flags, kFlags);
  if (!unknown.empty()) return "it has the flags " + unknown;
  if (param.reserved0 != 0 || !AllZero(param.reserved)) return "it uses reserved members";
  for (const char* text : {param.unit, param.doc}) {
    const std::string defect = TextDefect(text);
    if (!defect.empty()) return "its unit or doc " + defect;
  }
  const bool has_choices = param.choices != nullptr && param.choice_count > 0;
  if (choice != has_choices || (!choice && param.choice_count != 0) ||
      param.choice_count > ALIDADE_MAX_CHOICES) {
    return "it has " + std::to_string(param.choice_count) + " choices";
  }
  for (int i = 0; i < param.choice_count; ++i) {
    const std::string defect = TextDefect(param.choices[i]);
    if (!defect.empty()) return "a choice " + defect;
  }
  if (param.count == 0 || param.count < -1 || ((choice || IsText(param)) && param.count != 1)) {
    return "its count is " + std::to_string(param.count);
  }
  if (!(param.low <= param.high)) return "its range is empty";
  return GoodFallback(param) ? "" : "its default is none";
}

/// The parameter, where it follows the rules of plugin_abi.h and there is room for it; else an
/// exception.
AlidadeParam Checked(const AlidadeParam* from, bool text, bool room) {
  if (from == nullptr) throw Error(ExitCode::kPlugin, "asks for no parameter at all");
  const AlidadeParam param = ReadPrefix(from);
  std::string defect = ParamDefect(param);
  if (defect.empty() && (text != IsText(param) || !room))
    defect = "it is asked for as another kind";
  if (!defect.empty()) {
    throw Error(ExitCode::kPlugin,
                "asks for parameter '" + (GoodName(param.key) ? std::string(param.key) : "") +
                    "' in a way that this version does not understand: " + defect);
  }
  return param;
}

/// The same of one that is read into `values`.
AlidadeParam Checked(const AlidadeParam* from, const double* values, std::int32_t capacity) {
  const bool room = values != nullptr && from != nullptr && from->count <= capacity;
  return Checked(from, false, room);
}

/// The same of one that is read into `text`.
AlidadeParam Checked(const AlidadeParam* from, const char* text, std::int32_t capacity) {
  return Checked(from, true, text != nullptr && capacity > ALIDADE_MAX_TEXT);
}

/// Copies `from`, of at most ALIDADE_MAX_TEXT bytes; its length.
std::int32_t Put(const std::string& from, char* to) {
  std::memcpy(to, from.c_str(), from.size() + 1);
  return static_cast<std::int32_t>(from.size());
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

/// What a dotted key names below `map`, or nothing: then `map` is the last map on the way, and
/// `key` what is missing there.
std::optional<Node> FindBelow(Node& map, std::string& key) {
  for (std::size_t dot; (dot = key.find('.')) != std::string::npos; key.erase(0, dot + 1)) {
    const std::optional<Node> child = map.Find(key.substr(0, dot));
    if (!child) return std::nullopt;
    map = *child;
  }
  return map.Find(key);
}

}  // namespace

AlidadeHost MakeHost(void* context) {
  AlidadeHost host{};
  host.struct_size = sizeof(host);
  host.abi_major = ALIDADE_ABI_MAJOR;
  host.abi_minor = ALIDADE_ABI_MINOR;
  host.context = context;
  return host;
}

ParamReader::ParamReader(const Node& entry, std::string owner, std::string representation,
                         bool noise_given)
    : entry_(entry),
      owner_(std::move(owner)),
      representation_(std::move(representation)),
      noise_given_(noise_given),
      host_(MakeHost(this)) {
  host_.read = &ParamReader::Read;
  host_.read_text = &ParamReader::ReadText;
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

std::int32_t ParamReader::Read(void* context, const AlidadeParam* param, double* values,
                               std::int32_t capacity) noexcept try {
  auto* reader = static_cast<ParamReader*>(context);
  try {
    const std::vector<double> read =
        reader->Values(reader->Expect([&] { return Checked(param, values, capacity); }));
    std::copy_n(read.begin(), std::min(std::ssize(read), std::ptrdiff_t{capacity}), values);
    return static_cast<std::int32_t>(read.size());
  } catch (const Error& e) {
    reader->errors_.emplace_back(e.what());
  }
  return -1;
} catch (...) {
  static_cast<ParamReader*>(context)->thrown_ = std::current_exception();
  return -1;
}

std::int32_t ParamReader::ReadText(void* context, const AlidadeParam* param, char* text,
                                   std::int32_t capacity) noexcept try {
  auto* reader = static_cast<ParamReader*>(context);
  try {
    const AlidadeParam expected = reader->Expect([&] { return Checked(param, text, capacity); });
    return Put(reader->TextOf(expected), text);
  } catch (const Error& e) {
    reader->errors_.emplace_back(e.what());
  }
  return -1;
} catch (...) {
  static_cast<ParamReader*>(context)->thrown_ = std::current_exception();
  return -1;
}

void ParamReader::Fail(void* context, const char* key, const char* text) noexcept try {
  auto* reader = static_cast<ParamReader*>(context);
  if (Text(text) == std::bad_alloc().what()) throw std::bad_alloc();  // on the other side
  if (Text(key).empty()) {
    reader->failure_ = Text(text).empty() ? "it does not say why" : ShownText(text);
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
  reader->errors_.push_back(
      ErrorLine(place, PathBelow(base.path(), ShownText(key)), ShownText(text)));
} catch (...) {
  static_cast<ParamReader*>(context)->thrown_ = std::current_exception();
}

/// The parameter; one that breaks the rules is an error of the plugin, at the entry.
AlidadeParam ParamReader::Expect(const std::function<AlidadeParam()>& checked) {
  try {
    const AlidadeParam param = checked();
    keys_.insert(param.key);
    if (keys_.size() > ALIDADE_MAX_PARAMS) {
      throw Error(ExitCode::kPlugin, "asks for more than " + std::to_string(ALIDADE_MAX_PARAMS) +
                                         " parameters, which is the most");
    }
    return param;
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
  const std::optional<Node> node = FindBelow(map, rest);
  if (noise_given_ && IsNoise(param)) {
    if (node) node->Fail("the entry gives the noise as `covariance` too", "one of the two");
    return StandIn(param);
  }
  if (!node) return Absent(param, map, rest);
  const std::vector<double> values = All(param, *node);
  ExpectCalibrated(param, *node, values);
  return values;
}

/// A text, which no calibration has.
std::string ParamReader::TextOf(const AlidadeParam& param) const {
  std::string rest = param.key;
  Node map = BaseOf(rest);
  const std::optional<Node> node = FindBelow(map, rest);
  if (!node && HasFallback(param)) return Text(param.fallback_text);
  if (!node) FailMissing(param, map, rest);
  const std::string text = node->Text();
  const std::string defect = TextDefect(text.c_str());
  if (!defect.empty()) node->Fail("a text that " + defect);
  return text;
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
  FailMissing(param, map, key_in_map);
}

void ParamReader::FailMissing(const AlidadeParam& param, const Node& map,
                              const std::string& key_in_map) const {
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
  throw ContractViolation("a key that is there is missing: " + key_in_map);
}

ParamRecorder::ParamRecorder() : host_(MakeHost(this)), trials_(1) {
  host_.read = &ParamRecorder::Read;
  host_.read_text = &ParamRecorder::ReadText;
  host_.fail = [](void*, const char*, const char*) {};
}

std::int32_t ParamRecorder::Read(void* context, const AlidadeParam* from, double* values,
                                 std::int32_t capacity) noexcept {
  auto* recorder = static_cast<ParamRecorder*>(context);
  Trial& trial = recorder->trials_.back();
  try {
    const AlidadeParam param = Checked(from, values, capacity);
    const bool choice = param.kind == ALIDADE_PARAM_CHOICE;
    if (choice) values[0] = HasFallback(param) ? Fallback(param)[0] : 0.0;
    if (choice && trial.choice == param.key) values[0] = trial.value;
    recorder->Note(param, choice ? static_cast<int>(values[0]) : 0);
    return std::max(param.count, 0);
  } catch (const std::bad_alloc&) {
    recorder->out_of_memory_ = true;
  } catch (const std::exception&) {
    // The plugin asks wrongly; it is told so when the model is made.
  }
  return -1;
}

std::int32_t ParamRecorder::ReadText(void* context, const AlidadeParam* from, char* text,
                                     std::int32_t capacity) noexcept {
  auto* recorder = static_cast<ParamRecorder*>(context);
  try {
    const AlidadeParam param = Checked(from, text, capacity);
    recorder->Note(param, 0);
    return Put(Text(param.fallback_text), text);
  } catch (const std::bad_alloc&) {
    recorder->out_of_memory_ = true;
  } catch (const std::exception&) {
    // As above.
  }
  return -1;
}

void ParamRecorder::Note(const AlidadeParam& param, int value) {
  std::vector<Asked>& asked = trials_.back().asked;
  const auto same = [&](const Asked& other) { return other.info.key == param.key; };
  if (asked.size() >= ALIDADE_MAX_PARAMS) return;  // it is told so when the model is made
  if (std::none_of(asked.begin(), asked.end(), same)) asked.push_back({Describe(param), value});
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
