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
/// Largest magnitude up to which a double represents every integer.
constexpr double kMaxExactInteger = 9007199254740992.0;

std::string RangeText(const AlidadeParam& param) {
  const bool is_low_open = (param.flags & ALIDADE_PARAM_LOW_OPEN) != 0;
  const bool is_high_open = (param.flags & ALIDADE_PARAM_HIGH_OPEN) != 0;
  const bool has_lower_bound = param.low > -kInfinity, has_upper_bound = param.high < kInfinity;
  if (has_lower_bound && has_upper_bound) {
    return (is_low_open ? "(" : "[") + NumberText(param.low) + ", " + NumberText(param.high) +
           (is_high_open ? ")" : "]");
  }
  if (has_lower_bound) return (is_low_open ? "> " : ">= ") + NumberText(param.low);
  if (has_upper_bound) return (is_high_open ? "< " : "<= ") + NumberText(param.high);
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
  const bool is_known = value >= 0.0 && value < param.choice_count;
  return is_known ? Text(param.choices[static_cast<int>(value)]) : "";
}

std::vector<double> Fallback(const AlidadeParam& param) {
  if (param.fallback == nullptr) return {};
  return std::vector<double>(param.fallback, param.fallback + std::max(param.count, 0));
}

bool HasFallback(const AlidadeParam& param) {
  return (param.flags & ALIDADE_PARAM_HAS_DEFAULT) != 0;
}

/// Returns true if the key of the parameter names a standard deviation of the model's noise.
bool IsNoise(const AlidadeParam& param) {
  const std::string_view key = param.key;
  return param.kind == ALIDADE_PARAM_NUMBER &&
         (key == "sigma" || key.starts_with("sigma_") || key.starts_with("noise."));
}

/// Returns placeholder values: the default of the parameter or, without a default, values within
/// the range.
std::vector<double> StandIn(const AlidadeParam& param) {
  if (HasFallback(param) && param.count > 0) return Fallback(param);
  const bool has_lower_bound = param.low > -kInfinity, has_upper_bound = param.high < kInfinity;
  double value = 0.0;
  if (has_lower_bound) value = param.low + 1.0;
  if (has_upper_bound) value = param.high - 1.0;
  if (has_lower_bound && has_upper_bound) value = 0.5 * (param.low + param.high);
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
  if (!HasFallback(param)) return "";
  const std::vector<double> values = Fallback(param);
  return !values.empty() && values[0] == kInfinity ? "none" : ValuesText(param, values);
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
  const bool is_number = param.kind == ALIDADE_PARAM_NUMBER || param.kind == ALIDADE_PARAM_INTEGER;
  if (is_number) info.range = RangeText(param);
  if ((param.flags & ALIDADE_PARAM_OR_NONE) != 0) info.range += " or none";
  info.fallback = FallbackText(param);
  info.choices = Choices(param);
  return info;
}

/// Returns true unless the default of the parameter is invalid. The valid defaults are an index
/// into the choices, or numbers within the range. A parameter without a default is also valid.
bool IsValidFallback(const AlidadeParam& param) {
  if (!HasFallback(param) || param.count < 0) return true;
  if (IsText(param)) return TextDefect(param.fallback_text).empty();
  if (param.fallback == nullptr) return false;
  return std::all_of(param.fallback, param.fallback + param.count, [&](double value) {
    if (param.kind == ALIDADE_PARAM_CHOICE) return value >= 0.0 && value < param.choice_count;
    const bool is_integer = value == std::trunc(value) && std::abs(value) <= kMaxExactInteger;
    if (param.kind == ALIDADE_PARAM_INTEGER && !is_integer) return false;
    const bool is_none = value == kInfinity && (param.flags & ALIDADE_PARAM_OR_NONE) != 0;
    return is_none || (value >= param.low && value <= param.high);
  });
}

/// Returns true if `key` is a name, or several names separated by dots.
bool IsValidKey(const char* key) {
  if (!IsValidName(key)) return false;
  const std::string_view text = key;
  return text.front() != '.' && text.back() != '.' && text.find("..") == text.npos;
}

/// Returns the reason why a parameter breaks the rules of plugin_abi.h; "" if it breaks none.
std::string ParamDefect(const AlidadeParam& param) {
  constexpr std::uint32_t kFlags = ALIDADE_PARAM_HAS_DEFAULT | ALIDADE_PARAM_LOW_OPEN |
                                   ALIDADE_PARAM_HIGH_OPEN | ALIDADE_PARAM_OR_NONE;
  const bool is_choice = param.kind == ALIDADE_PARAM_CHOICE;
  if (!IsValidKey(param.key)) return "its key is not a valid name";
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
  if (is_choice != has_choices || (!is_choice && param.choice_count != 0) ||
      param.choice_count > ALIDADE_MAX_CHOICES) {
    return "it has " + std::to_string(param.choice_count) + " choices";
  }
  for (int i = 0; i < param.choice_count; ++i) {
    const std::string defect = TextDefect(param.choices[i]);
    if (!defect.empty()) return "a choice " + defect;
  }
  if (param.count == 0 || param.count < -1 || ((is_choice || IsText(param)) && param.count != 1)) {
    return "its count is " + std::to_string(param.count);
  }
  if (!(param.low <= param.high)) return "its range is empty";
  return IsValidFallback(param) ? "" : "its default is invalid";
}

/// Returns a copy of a requested parameter. Throws if the parameter breaks the rules of
/// plugin_abi.h. Also throws if a text is requested by `read`, a number is requested by
/// `read_text`, or the buffer is too small.
AlidadeParam CheckParam(const AlidadeParam* source, bool reads_text, bool has_capacity) {
  if (source == nullptr) throw Error(ExitCode::kPlugin, "requests a null parameter");
  const AlidadeParam param = ReadPrefix(source);
  std::string defect = ParamDefect(param);
  if (defect.empty() && (reads_text != IsText(param) || !has_capacity))
    defect = "the request uses the wrong function, or its buffer is too small";
  if (!defect.empty()) {
    throw Error(ExitCode::kPlugin, "requests parameter '" +
                                       (IsValidName(param.key) ? std::string(param.key) : "") +
                                       "' in a way that this version does not support: " + defect);
  }
  return param;
}

/// Checks a parameter that is read into `values`.
AlidadeParam CheckParam(const AlidadeParam* source, const double* values, std::int32_t capacity) {
  const bool has_capacity = values != nullptr && source != nullptr && source->count <= capacity;
  return CheckParam(source, false, has_capacity);
}

/// Checks a parameter that is read into `text`.
AlidadeParam CheckParam(const AlidadeParam* source, const char* text, std::int32_t capacity) {
  return CheckParam(source, true, text != nullptr && capacity > ALIDADE_MAX_TEXT);
}

/// Copies `source`, which has at most ALIDADE_MAX_TEXT bytes. Returns its length.
std::int32_t CopyText(const std::string& source, char* destination) {
  std::memcpy(destination, source.c_str(), source.size() + 1);
  return static_cast<std::int32_t>(source.size());
}

/// Returns the meaning of a parameter, such as `(px, > 0: rectified focal length)`.
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

double NumberOrNone(const AlidadeParam& param, const Node& node, bool is_low_open,
                    bool is_high_open) {
  if (node.kind() == Node::Kind::kScalar && node.Text() == "none") return kInfinity;
  try {
    return node.Number(param.low, param.high, is_low_open, is_high_open, Text(param.unit));
  } catch (const Error& e) {
    throw Error(e.code(), std::string(e.what()) + ", or none");
  }
}

double ReadValue(const AlidadeParam& param, const Node& node) {
  const bool is_low_open = (param.flags & ALIDADE_PARAM_LOW_OPEN) != 0;
  const bool is_high_open = (param.flags & ALIDADE_PARAM_HIGH_OPEN) != 0;
  switch (param.kind) {
    case ALIDADE_PARAM_INTEGER:
      return static_cast<double>(node.Integer(
          static_cast<std::int64_t>(std::clamp(param.low, -kMaxExactInteger, kMaxExactInteger)),
          static_cast<std::int64_t>(std::clamp(param.high, -kMaxExactInteger, kMaxExactInteger))));
    case ALIDADE_PARAM_FLAG:
      return node.Flag() ? 1.0 : 0.0;
    case ALIDADE_PARAM_CHOICE:
      return node.Choice(Choices(param));
    default:
      return (param.flags & ALIDADE_PARAM_OR_NONE) != 0
                 ? NumberOrNone(param, node, is_low_open, is_high_open)
                 : node.Number(param.low, param.high, is_low_open, is_high_open, Text(param.unit));
  }
}

std::vector<double> ReadValues(const AlidadeParam& param, const Node& node) {
  if (param.count == 1) return {ReadValue(param, node)};
  const std::vector<Node> items = node.ItemsOrOne();
  if (param.kind == ALIDADE_PARAM_NUMBER) {
    static_cast<void>(node.Numbers(param.count, Text(param.unit)));
  } else if (param.count > 0 && std::ssize(items) != param.count) {
    node.Fail("has " + std::to_string(items.size()) + (items.size() == 1 ? " value" : " values"),
              std::to_string(param.count));
  }
  std::vector<double> values;
  for (const Node& item : items) values.push_back(ReadValue(param, item));
  return values;
}

/// Finds the node of a dotted key below `map`. Sets `map` to the last existing map on the path of
/// the key, and `key` to the remaining part of the key.
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
                         bool has_covariance, std::map<std::string, std::string> bound_geometries)
    : entry_(entry),
      owner_(std::move(owner)),
      representation_(std::move(representation)),
      has_covariance_(has_covariance),
      bound_geometries_(std::move(bound_geometries)),
      host_(MakeHost(this)) {
  host_.read = &ParamReader::Read;
  host_.read_text = &ParamReader::ReadText;
  host_.fail = &ParamReader::Fail;
}

void ParamReader::Check() const {
  if (exception_) std::rethrow_exception(exception_);
  if (errors_.empty() && missing_.empty()) return;
  std::vector<std::string> lines = errors_;
  for (const MissingKey& missing : missing_) lines.push_back(TextOfMissing(missing));
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
        reader->Values(reader->Expect([&] { return CheckParam(param, values, capacity); }));
    std::copy_n(read.begin(), std::min(std::ssize(read), std::ptrdiff_t{capacity}), values);
    return static_cast<std::int32_t>(read.size());
  } catch (const MissingKey& missing) {
    reader->missing_.push_back(missing);
  } catch (const Error& e) {
    reader->errors_.emplace_back(e.what());
  }
  return -1;
} catch (...) {
  static_cast<ParamReader*>(context)->exception_ = std::current_exception();
  return -1;
}

std::int32_t ParamReader::ReadText(void* context, const AlidadeParam* param, char* text,
                                   std::int32_t capacity) noexcept try {
  auto* reader = static_cast<ParamReader*>(context);
  try {
    const AlidadeParam expected = reader->Expect([&] { return CheckParam(param, text, capacity); });
    return CopyText(reader->TextOf(expected), text);
  } catch (const MissingKey& missing) {
    reader->missing_.push_back(missing);
  } catch (const Error& e) {
    reader->errors_.emplace_back(e.what());
  }
  return -1;
} catch (...) {
  static_cast<ParamReader*>(context)->exception_ = std::current_exception();
  return -1;
}

void ParamReader::Fail(void* context, const char* key, const char* text) noexcept try {
  auto* reader = static_cast<ParamReader*>(context);
  // This text means that the plugin caught a bad_alloc.
  if (Text(text) == std::bad_alloc().what()) throw std::bad_alloc();
  if (Text(key).empty()) {
    reader->failure_ = Text(text).empty() ? "it did not report a reason" : PrintableText(text);
    return;
  }
  const Node base = reader->BaseOf(Text(key));
  Place place = base.place();
  std::optional<Node> node = base;
  std::string remaining = key;
  for (std::size_t dot = 0; node && node->is_map() && dot != std::string::npos;) {
    dot = remaining.find('.');
    node = node->Find(remaining.substr(0, dot));
    if (node) place = node->place();
    remaining.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  reader->errors_.push_back(
      ErrorLine(place, PathBelow(base.path(), PrintableText(key)), PrintableText(text)));
} catch (...) {
  static_cast<ParamReader*>(context)->exception_ = std::current_exception();
}

/// Returns the parameter that `check` returns. If `check` throws an Error, adds the place of the
/// config entry and the name of the model to the error.
AlidadeParam ParamReader::Expect(const std::function<AlidadeParam()>& check) {
  try {
    const AlidadeParam param = check();
    keys_.insert(param.key);
    if (keys_.size() > ALIDADE_MAX_PARAMS) {
      throw Error(ExitCode::kPlugin,
                  "requests more than " + std::to_string(ALIDADE_MAX_PARAMS) + " parameters");
    }
    return param;
  } catch (const Error& e) {
    code_ = e.code();
    throw Error(code_, ErrorLine(entry_.place(), entry_.path(), owner_ + ' ' + e.what()));
  }
}

/// Returns the map that contains or should contain `key`: the entry or the root.
Node ParamReader::BaseOf(const std::string& key) const {
  const std::string first = key.substr(0, key.find('.'));
  if (first == key || (first != "camera" && first != "landmarks")) return entry_;
  std::optional<Node> node = entry_;
  std::string remaining = key;
  for (std::size_t dot = 0; node && dot != std::string::npos;) {
    dot = remaining.find('.');
    node = node->Find(remaining.substr(0, dot));
    remaining.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  return node ? entry_ : entry_.Root();
}

std::vector<double> ParamReader::Values(const AlidadeParam& param) const {
  std::string key = param.key;
  const std::vector<std::string> choices = Choices(param);
  const auto representation = std::ranges::find(choices, representation_);
  if (key == "landmarks.representation" && representation != choices.end()) {
    return {static_cast<double>(representation - choices.begin())};
  }
  Node map = BaseOf(key);
  const std::optional<Node> node = FindBelow(map, key);
  if (has_covariance_ && IsNoise(param)) {
    if (node) node->Fail("the entry also defines the noise by `covariance`", "one of the two keys");
    return StandIn(param);
  }
  if (!node) return Absent(param, map, key);
  const std::vector<double> values = ReadValues(param, *node);
  ExpectCalibrated(param, *node, values);
  return values;
}

/// Returns the text of a parameter. A calibration does not contain texts.
std::string ParamReader::TextOf(const AlidadeParam& param) const {
  std::string key = param.key;
  if (key == "roles") return RolesText();
  Node map = BaseOf(key);
  const std::optional<Node> node = FindBelow(map, key);
  if (!node && HasFallback(param)) return Text(param.fallback_text);
  if (!node) throw MissingKey(map, key, Meaning(param));
  const std::string text = node->Text();
  const std::string defect = TextDefect(text.c_str());
  if (!defect.empty()) node->Fail("the text " + defect);
  return text;
}

/// Returns `ROLE: GEOMETRY, ...` for the roles that the entry binds, in the order of the entry.
std::string ParamReader::RolesText() const {
  std::vector<std::string> roles;
  const std::optional<Node> map = entry_.Find("roles");
  if (!map || !map->is_map()) return {};
  for (const auto& [name, node] : map->Entries()) {
    const auto bound = bound_geometries_.find(name);
    if (bound != bound_geometries_.end()) {
      roles.push_back(name + ": " + bound->second);
    } else if (!node.is_map()) {
      roles.push_back(name + ": " + node.Text());
    }
  }
  return Join(roles);
}

std::optional<Node> ParamReader::InCalibration(const std::string& key) const {
  std::optional<Node> node = entry_.Root().Find("calibration");
  std::string remaining = key;
  for (std::size_t dot = 0; node && dot != std::string::npos;) {
    dot = remaining.find('.');
    node = node->is_map() ? node->Find(remaining.substr(0, dot)) : std::nullopt;
    remaining.erase(0, dot == std::string::npos ? dot : dot + 1);
  }
  return node;
}

/// Fails if `values`, which were read from `node` of the config, differ from the calibration of the
/// data.
void ParamReader::ExpectCalibrated(const AlidadeParam& param, const Node& node,
                                   const std::vector<double>& values) const {
  const std::optional<Node> data = InCalibration(param.key);
  if (!data) return;
  const auto is_same = [](double a, double b) {
    constexpr double kTolerance = 1e-6;  // relative tolerance for rounded texts
    return std::abs(a - b) <= kTolerance * std::max(std::abs(a), std::abs(b));
  };
  const std::vector<double> calibrated = ReadValues(param, *data);
  if (std::ranges::equal(values, calibrated, is_same)) return;
  node.Fail(ValuesText(param, values) + " differs from the calibration of the data, " +
                ValuesText(param, calibrated) + " in " + data->place().file,
            "the same value; correct or remove this key, or set 'source.calibration: ignore'");
}

std::vector<double> ParamReader::Absent(const AlidadeParam& param, const Node& map,
                                        const std::string& key_in_map) const {
  const bool is_dotted = std::string_view(param.key).find('.') != std::string_view::npos;
  const std::optional<Node> data = InCalibration(param.key);
  if (data && (is_dotted || !HasFallback(param))) return ReadValues(param, *data);
  if (HasFallback(param)) return Fallback(param);
  throw MissingKey(map, key_in_map, Meaning(param));
}

std::string ParamReader::TextOfMissing(const MissingKey& missing) const {
  const std::string first = missing.key.substr(0, missing.key.find('.'));
  try {
    static_cast<void>(missing.map.At(first));
  } catch (const Error& e) {
    // The message of the config may suggest a similar key, or a key with another unit. This
    // suggestion is retained.
    constexpr std::string_view kPhrase = ": missing key";
    std::string text = e.what();
    const std::size_t position = text.find(kPhrase);
    if (position != std::string::npos) {
      text.replace(position, kPhrase.size(),
                   missing.key.substr(first.size()) + ": missing; " + owner_ + " needs it " +
                       missing.meaning);
    }
    return text;
  }
  throw ContractViolation("the existing key '" + missing.key + "' was reported as missing");
}

ParamRecorder::ParamRecorder() : host_(MakeHost(this)), trials_(1) {
  host_.read = &ParamRecorder::Read;
  host_.read_text = &ParamRecorder::ReadText;
  host_.fail = [](void*, const char*, const char*) {};
}

std::int32_t ParamRecorder::Read(void* context, const AlidadeParam* source, double* values,
                                 std::int32_t capacity) noexcept {
  auto* recorder = static_cast<ParamRecorder*>(context);
  Trial& trial = recorder->trials_.back();
  try {
    const AlidadeParam param = CheckParam(source, values, capacity);
    const bool is_choice = param.kind == ALIDADE_PARAM_CHOICE;
    if (is_choice) values[0] = HasFallback(param) ? Fallback(param)[0] : 0.0;
    if (is_choice && trial.choice == param.key) values[0] = trial.value;
    recorder->Record(param, is_choice ? static_cast<int>(values[0]) : 0);
    return std::max(param.count, 0);
  } catch (const std::bad_alloc&) {
    recorder->out_of_memory_ = true;
  } catch (const std::exception&) {
    // An invalid request is reported when the model is created.
  }
  return -1;
}

std::int32_t ParamRecorder::ReadText(void* context, const AlidadeParam* source, char* text,
                                     std::int32_t capacity) noexcept {
  auto* recorder = static_cast<ParamRecorder*>(context);
  try {
    const AlidadeParam param = CheckParam(source, text, capacity);
    if (Text(param.key) != "roles") recorder->Record(param, 0);
    return CopyText(Text(param.fallback_text), text);
  } catch (const std::bad_alloc&) {
    recorder->out_of_memory_ = true;
  } catch (const std::exception&) {
    // As in Read(), an invalid request is reported when the model is created.
  }
  return -1;
}

void ParamRecorder::Record(const AlidadeParam& param, int value) {
  std::vector<Request>& requests = trials_.back().requests;
  const auto is_same = [&](const Request& request) { return request.info.key == param.key; };
  // An excess of requests is reported when the model is created.
  if (requests.size() >= ALIDADE_MAX_PARAMS) return;
  if (std::none_of(requests.begin(), requests.end(), is_same))
    requests.push_back({Describe(param), value});
}

std::string ParamRecorder::ConditionOf(const std::string& key) const {
  const auto requests_key = [&](const Trial& trial) {
    return std::any_of(trial.requests.begin(), trial.requests.end(),
                       [&](const Request& request) { return request.info.key == key; });
  };
  std::vector<std::string> conditions;
  for (const Request& choice : trials_[0].requests) {
    std::vector<std::string> values;
    for (int i = 0; i < std::ssize(choice.info.choices); ++i) {
      const auto has_value = [&](const Trial& trial) {
        return trial.choice.empty() ? i == choice.value
                                    : trial.choice == choice.info.key && trial.value == i;
      };
      const auto trial = std::find_if(trials_.begin(), trials_.end(), has_value);
      if (trial != trials_.end() && requests_key(*trial)) values.push_back(choice.info.choices[i]);
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
    for (const Request& request : trial.requests) {
      const auto is_same = [&](const ParamInfo& info) { return info.key == request.info.key; };
      const auto existing = std::find_if(result.begin(), result.end(), is_same);
      if (existing == result.end()) {
        result.push_back(request.info);
        result.back().condition = ConditionOf(request.info.key);
      } else if (existing->unit != request.info.unit &&
                 !existing->unit.ends_with(" or " + request.info.unit)) {
        existing->unit += " or " + request.info.unit;
      }
    }
  }
  const auto rank = [](const ParamInfo& info) {
    return std::tuple(!info.condition.empty(), !info.fallback.empty());
  };
  std::stable_sort(result.begin(), result.end(),
                   [&](const ParamInfo& a, const ParamInfo& b) { return rank(a) < rank(b); });
  return result;
}

}  // namespace alidade::internal
