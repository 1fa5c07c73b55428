// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/shards.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "alidade/base/text.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/io/read_file.h"
#include "alidade/replay/replay.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/sweep/finished_runs.h"
#include "alidade/sweep/run_record.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// Description of a shard, read from the folder of the shard.
struct ShardFolder {
  fs::path folder;
  Shard shard;
  std::vector<std::string> arguments;
  InputTexts input_texts;  ///< texts of the inputs, without the option --shard
};

[[noreturn]] void FailData(const fs::path& file, const std::string& message,
                           const std::string& expected = "") {
  throw Error(ExitCode::kBadData, ErrorLine(Place{file.string()}, {}, message, expected));
}

std::string TextOf(const fs::path& file) {
  return ReadFile(file, [&](ExitCode code, int error) {
    throw Error(code,
                ErrorLine(Place{file.string()}, {},
                          "the file cannot be read: " + std::generic_category().message(error)));
  });
}

/// Returns the value of an option. Returns "" if the option is missing.
std::string ValueOf(const std::vector<std::string>& arguments, const std::string& option) {
  const auto position = std::ranges::find(arguments, option);
  const bool has_value = position != arguments.end() && position + 1 != arguments.end();
  return has_value ? *(position + 1) : "";
}

template <class Integer>
Integer IntegerOf(const std::string& text) {
  Integer number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

/// Formats a shard as `3/16`.
std::string TextOf(const Shard& shard) {
  return std::to_string(shard.index) + '/' + std::to_string(shard.count);
}

ShardFolder ReadShardFolder(const fs::path& folder) {
  if (!fs::exists(folder) && fs::exists(PartialOf(folder))) {
    FailData(folder, "the sweep is not finished: its files are in " + PartialOf(folder).string(),
             "the folder of a finished sweep");
  }
  const RecordedInputs recorded = ReadReplayable(folder);
  const std::string text = ValueOf(recorded.command.arguments, "--shard");
  const fs::path inputs = folder / kInputsFile;
  if (recorded.command.arguments[0] != "sweep" || text.empty()) {
    FailData(inputs, "this is not the inputs.json of a shard",
             "a folder of `alidade sweep --shard i/n`");
  }
  ShardFolder shard_folder{folder, {}, recorded.command.arguments, {}};
  const std::size_t slash = std::min(text.find('/'), text.size() - 1);
  shard_folder.shard = {IntegerOf<int>(text.substr(0, slash)),
                        IntegerOf<int>(text.substr(slash + 1))};
  const auto runs = IntegerOf<std::int64_t>(ValueOf(shard_folder.arguments, "--runs"));
  const Shard& shard = shard_folder.shard;
  if (shard.index < 1 || shard.index > shard.count || shard.count > runs) {
    FailData(inputs,
             "the file records the shard '" + text + "' of " + std::to_string(runs) + " runs",
             "i/n with 1 <= i <= n, and at least one run for each shard");
  }
  shard_folder.input_texts = ReadInputTexts(folder);
  shard_folder.input_texts.inputs = WithoutOption(shard_folder.input_texts.inputs, "--shard", text);
  return shard_folder;
}

/// Refuses a shard that does not belong to the same sweep as the first shard.
void CheckSameSweep(const ShardFolder& first, const ShardFolder& candidate) {
  if (candidate.shard.count != first.shard.count) {
    FailData(candidate.folder,
             "this is shard " + TextOf(candidate.shard) + ", but " + first.folder.string() +
                 " is shard " + TextOf(first.shard),
             "the shards of one sweep");
  }
  const std::string difference = DescribeDifferences(
      first.input_texts, (first.folder / kInputsFile).string(), candidate.input_texts);
  if (difference.empty()) return;
  FailData(candidate.folder,
           "the shard belongs to another sweep than " + first.folder.string() + ": " + difference,
           "the shards of one sweep");
}

/// Sorts the shards by index. Refuses repeated and missing shards.
void SortByIndex(std::vector<ShardFolder>& shards) {
  std::ranges::stable_sort(shards, {},
                           [](const ShardFolder& folder) { return folder.shard.index; });
  std::vector<std::string> missing;
  int index = 0;
  for (const ShardFolder& folder : shards) {
    const Shard& shard = folder.shard;
    if (shard.index == index) {
      FailData(folder.folder, "shard " + TextOf(shard) + " is given twice", "each shard once");
    }
    while (++index < shard.index) missing.push_back(TextOf(Shard{index, shard.count}));
  }
  const int count = shards.front().shard.count;
  while (++index <= count) missing.push_back(TextOf(Shard{index, count}));
  if (missing.empty()) return;
  constexpr std::size_t kShown = 10;
  const std::size_t missing_count = missing.size();
  if (missing_count > kShown) missing.resize(kShown);
  throw Error(
      ExitCode::kBadData,
      "shards are missing: " + Join(missing, ", ") +
          (missing_count > kShown ? " and " + std::to_string(missing_count - kShown) + " more"
                                  : ""));
}

/// Adds the runs of a shard to `results`, which has one entry for each value. The runs share lists
/// of names through the pool.
void AddRuns(const ShardFolder& folder, const SeedRange& seeds,
             const std::vector<std::string>& values, SharedNames& pool,
             std::vector<SweepResult>& results) {
  const fs::path file = folder.folder / kFinishedRuns;
  std::ifstream stream(file);
  if (!stream)
    throw Error(ExitCode::kInputMissing,
                ErrorLine(Place{file.string()}, {}, "the file cannot be read"));
  Place place{file.string(), 0, 0};
  const auto fail = [&place](const std::string& message) {
    throw Error(ExitCode::kBadData, ErrorLine(place, {}, message));
  };
  std::string line;
  for (std::size_t v = 0; v < values.size(); ++v) {
    for (std::int64_t i = 0; i < seeds.count; ++i) {
      ++place.line;
      const std::uint64_t seed = seeds.first + static_cast<std::uint64_t>(i);
      std::optional<ParsedRunLine> parsed;
      if (std::getline(stream, line)) parsed = ReadRunLine(line);
      if (!parsed || parsed->value != values[v] || parsed->run.seed != seed)
        fail("the line is not the run of seed " + std::to_string(seed));
      parsed->run.ShareNames(pool);
      results[v].done.push_back(std::move(parsed->run));
    }
  }
  if (std::getline(stream, line)) fail("the file contains a line after the last run");
}

/// Returns a SweepResult without runs for each value. `summary` is the sweep.json of any shard.
std::vector<SweepResult> EmptyResults(const Json& summary, std::int64_t runs,
                                      std::uint64_t first_seed) {
  std::vector<SweepResult> results;
  const auto add = [&](const Json& entry) {
    SweepResult& result = results.emplace_back();
    result.runs = runs;
    result.first_seed = first_seed;
    result.reference = entry.at("reference").get<std::string>();
    for (const auto& [name, estimator] : entry.at("estimators").items())
      result.estimators.push_back(name);
  };
  const auto values = summary.find("values");
  if (values == summary.end()) {
    add(summary);
  } else {
    for (const Json& value : *values) add(value);
  }
  return results;
}

/// Returns the variation of a recorded command, or nullopt if no key is varied.
std::optional<Variation> VariationOf(const std::vector<std::string>& arguments) {
  for (const auto scope : {Variation::Scope::kConfig, Variation::Scope::kEstimators}) {
    const std::string text = ValueOf(arguments, Variation::OptionOf(scope));
    if (!text.empty()) return Variation::FromText(text, scope);
  }
  return std::nullopt;
}

/// Adds the results and the warning of the shards to `merged`.
void ReadResults(const std::vector<ShardFolder>& shards, MergedSweep& merged) {
  const ShardFolder& first = shards.front();
  const auto runs = IntegerOf<std::int64_t>(ValueOf(first.arguments, "--runs"));
  const auto first_seed = IntegerOf<std::uint64_t>(ValueOf(first.arguments, "--first-seed"));
  const std::vector<std::string> values =
      merged.variation ? merged.variation->values : std::vector<std::string>{""};
  const fs::path file = first.folder / "sweep.json";
  try {
    const Json summary = ParseJson(TextOf(file), file.string());
    merged.results = EmptyResults(summary, runs, first_seed);
    if (merged.variation) merged.warning = summary.at("warning").get<std::string>();
  } catch (const Json::exception&) {
    merged.results.clear();
  }
  if (merged.results.size() != values.size())
    FailData(file, "this is not a sweep.json of this alidade version");
  SharedNames pool;
  for (const ShardFolder& folder : shards) {
    AddRuns(folder, SeedsOf(folder.shard, first_seed, runs), values, pool, merged.results);
  }
}

}  // namespace

MergedSweep MergeShards(const std::vector<fs::path>& folders) {
  ALIDADE_EXPECTS(!folders.empty());
  std::vector<ShardFolder> shards;
  for (const fs::path& folder : folders) {
    shards.push_back(ReadShardFolder(folder));
    CheckSameSweep(shards.front(), shards.back());
  }
  SortByIndex(shards);
  const ShardFolder& first = shards.front();
  MergedSweep merged{
      Config::FromText(first.input_texts.config, (first.folder / kResolvedConfig).string()),
      first.input_texts.inputs,
      VariationOf(first.arguments),
      {}};
  ReadResults(shards, merged);
  return merged;
}

}  // namespace alidade::internal
