// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/io/log.h"
#include "alidade/io/text_table.h"
#include "alidade/sweep/sweep.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade {
namespace {

using internal::Quoted;

[[noreturn]] void FailUsage(const char* option, const std::string& message) {
  throw Error(ExitCode::kUsage, ErrorLine(Place{option}, {}, message,
                                          "KEY=v1,v2,... as in sensors.stereo.sigma_px=0.5,1,2"));
}

/// Returns the text without leading and trailing blanks.
std::string Trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == text.npos) return "";
  return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

/// Splits a list of values at the commas outside brackets, braces and quotes.
std::vector<std::string> SplitValues(const char* option, const std::string& text) {
  std::vector<std::string> values(1);
  int depth = 0;
  char quote = '\0';
  for (const char c : text) {
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == ',' && depth == 0) {
      values.emplace_back();
      continue;
    }
    values.back() += c;
  }
  if (depth != 0 || quote != '\0') {
    FailUsage(option, Quoted(text) + " has an unclosed bracket or quote");
  }
  std::ranges::transform(values, values.begin(), Trimmed);
  return values;
}

/// Refuses a key whose parent map does not exist. A misspelt key would create an unwanted map.
void CheckKey(const Config& config, const char* option, const std::string& key) {
  const Place place{option};
  if (key == "source.seed") {
    internal::FailAt(place, key,
                     "the seed cannot be varied, because every value uses the same seeds",
                     "another key; --first-seed and --runs set the seeds");
  }
  Node map = config.root();
  std::size_t start = 0;
  for (std::size_t dot = key.find('.'); dot != key.npos; dot = key.find('.', start)) {
    const std::string name = key.substr(start, dot - start);
    if (name.find('[') != name.npos || !map.is_map()) return;  // Config::Set() reports the error
    std::vector<std::string> names;
    std::optional<Node> next;
    for (const auto& [entry, node] : map.Entries()) {
      names.push_back(entry);
      if (entry == name) next = node;
    }
    if (!next) {
      internal::FailAt(place, key, "the config does not contain " + Quoted(key.substr(0, dot)),
                       "a key of an existing map", Nearest(name, names));
    }
    map = *next;
    start = dot + 1;
  }
}

/// Returns a copy of the config in which the varied keys have the given value.
Config ConfigWith(const Config& config, const Variation& variation, const std::string& value) {
  Config copy = config.Copy();
  variation.Set(copy, value);
  return copy;
}

/// Refuses a value for which the config is invalid, or for which the estimators differ from those
/// of the first value.
void CheckValues(const Config& config, const PluginHost& host, const Variation& variation) {
  std::vector<std::string> first_names;
  for (const std::string& value : variation.values) {
    const Config varied = ConfigWith(config, variation, value);
    internal::CheckReadableAgain(varied);
    const auto names = internal::NamesOf(BuildExperiment(varied, host).estimators);
    if (first_names.empty()) first_names = names;
    if (names == first_names) continue;
    internal::FailAt(Place{Variation::OptionOf(variation.scope)}, variation.key,
                     "the estimators are " + internal::Join(names) + " with " + Quoted(value) +
                         ", but " + internal::Join(first_names) + " with " +
                         Quoted(variation.values.front()),
                     "the same estimators for every value");
  }
}

/// Returns a warning if varied keys outside `source` also change the data of the source, otherwise
/// "". Compares the data for the first value with those for the last value.
std::string DescribeSharedKeys(const Config& config, const PluginHost& host,
                               const Variation& variation) {
  if (variation.scope == Variation::Scope::kEstimators || variation.values.size() < 2) return "";
  std::vector<std::string> keys = variation.Keys();
  std::erase_if(
      keys, [](const std::string& key) { return key == "source" || key.starts_with("source."); });
  if (keys.empty()) return "";
  const Variation outside{internal::Join(keys, "+"), variation.values};
  // Each experiment refers to its config.
  const Config first_config = ConfigWith(config, outside, outside.values.front());
  const Config last_config = ConfigWith(config, outside, outside.values.back());
  try {
    const Experiment first = BuildExperiment(first_config, host);
    const Experiment last = BuildExperiment(last_config, host);
    if (internal::HaveEqualData(*first.source, *last.source)) return "";
  } catch (const Error&) {
    return "";  // the runs will report the error
  }
  return "--vary " + outside.key +
         ": the source also reads this key, so the data change with its value, and a wrong value "
         "can appear consistent; to vary the key for the estimators only, use --vary-filter";
}

/// Returns the paths of the maps in which the keys are set, each with a final dot.
std::vector<std::string> PrefixesOf(const Config& config, Variation::Scope scope) {
  if (scope == Variation::Scope::kConfig) return {""};
  std::vector<std::string> prefixes;
  const Config copy = config.Copy();
  for (const auto& [name, entry] : copy.root().At("estimators").Entries()) {
    prefixes.push_back("estimators." + name + ".overrides.");
  }
  return prefixes;
}

}  // namespace

const char* Variation::OptionOf(Scope scope) {
  return scope == Scope::kConfig ? "--vary" : "--vary-filter";
}

Variation Variation::FromText(const std::string& text, Scope scope) {
  const auto fail = [&](const std::string& message) {
    FailUsage(OptionOf(scope), Quoted(text) + message);
  };
  const std::size_t equals = text.find('=');
  if (equals == text.npos || equals == 0) fail(" does not name a key to vary");
  Variation variation{text.substr(0, equals), SplitValues(OptionOf(scope), text.substr(equals + 1)),
                      scope};
  std::vector<std::string> keys = variation.Keys();
  std::ranges::sort(keys);
  if (keys.front().empty() || std::ranges::adjacent_find(keys) != keys.end()) {
    fail(" has an empty or repeated key");
  }
  const std::vector<std::string>& values = variation.values;
  for (auto value = values.begin(); value != values.end(); ++value) {
    if (value->empty()) fail(" has an empty value");
    if (std::find(values.begin(), value, *value) != value) {
      fail(" has the value " + Quoted(*value) + " twice");
    }
  }
  return variation;
}

std::vector<std::string> Variation::Keys() const {
  std::vector<std::string> keys(1);
  for (const char c : key) {
    if (c == '+') {
      keys.emplace_back();
    } else {
      keys.back() += c;
    }
  }
  return keys;
}

void Variation::Set(Config& config, const std::string& value) const {
  for (const std::string& prefix : PrefixesOf(config, scope)) {
    for (const std::string& name : Keys()) config.Set(prefix + name, value, OptionOf(scope));
  }
}

VariedSweep SweepVariation(const Config& config, const PluginHost& host,
                           const SweepOptions& options, const Variation& variation) {
  ALIDADE_EXPECTS(!variation.values.empty());
  Config copy = config.Copy();
  const char* const option = Variation::OptionOf(variation.scope);
  copy.Set("alidade", "1", option);
  for (const std::string& key : variation.Keys()) CheckKey(copy, option, key);
  CheckValues(config, host, variation);
  const auto uses_seed = [&](const std::string& value) {
    return internal::UsesSeed(ConfigWith(config, variation, value), host, options.first_seed);
  };
  if (options.runs > 1 && std::ranges::none_of(variation.values, uses_seed)) {
    internal::FailUnseeded(ConfigWith(config, variation, variation.values.front()));
  }
  VariedSweep sweep{variation, {}, DescribeSharedKeys(config, host, variation)};
  if (!sweep.warning.empty()) Log(LogLevel::kWarning, sweep.warning);
  SweepOptions value_options = options;
  for (const std::string& value : variation.values) {
    value_options.value = value;
    const auto finished_values = static_cast<std::int64_t>(sweep.results.size());
    if (options.progress) {
      value_options.progress = [&options, finished_values, &variation](std::int64_t done,
                                                                       std::int64_t total) {
        const auto values = static_cast<std::int64_t>(variation.values.size());
        options.progress(finished_values * total + done, values * total);
      };
    }
    const Config varied = ConfigWith(config, variation, value);
    sweep.results.push_back(internal::SweepSeeds(varied, host, value_options));
    if (sweep.stopped()) break;
  }
  return sweep;
}

}  // namespace alidade
