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
#include "alidade/sweep/run_line.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// What the folder of a shard says of itself.
struct ShardFolder {
  fs::path folder;
  Shard shard;
  std::vector<std::string> arguments;
  InputTexts input_texts;  ///< of the whole sweep
};

[[noreturn]] void FailData(const fs::path& file, const std::string& what,
                           const std::string& expected = "") {
  throw Error(ExitCode::kBadData, ErrorLine(Place{file.string()}, {}, what, expected));
}

std::string TextOf(const fs::path& file) {
  return ReadFile(file, [&](ExitCode code, int error) {
    throw Error(code, ErrorLine(Place{file.string()}, {},
                                "cannot be read: " + std::generic_category().message(error)));
  });
}

/// The value of an option; "" where it is not there.
std::string ValueOf(const std::vector<std::string>& arguments, const std::string& option) {
  const auto place = std::ranges::find(arguments, option);
  const bool is_there = place != arguments.end() && place + 1 != arguments.end();
  return is_there ? *(place + 1) : "";
}

template <class Integer>
Integer IntegerOf(const std::string& text) {
  Integer number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

/// `3/16`
std::string TextOf(const Shard& shard) {
  return std::to_string(shard.index) + '/' + std::to_string(shard.of);
}

ShardFolder ReadShardFolder(const fs::path& folder) {
  if (!fs::exists(folder) && fs::exists(PartialOf(folder))) {
    FailData(folder, "is not finished: it is " + PartialOf(folder).string(),
             "a folder that its sweep has completed");
  }
  const RecordedInputs recorded = ReadReplayable(folder);
  const std::string text = ValueOf(recorded.command.arguments, "--shard");
  const fs::path inputs = folder / kInputsFile;
  if (recorded.command.arguments[0] != "sweep" || text.empty()) {
    FailData(inputs, "is not that of a shard", "a folder of `alidade sweep --shard i/n`");
  }
  ShardFolder one{folder, {}, recorded.command.arguments, {}};
  const std::size_t slash = std::min(text.find('/'), text.size() - 1);
  one.shard = {IntegerOf<int>(text.substr(0, slash)), IntegerOf<int>(text.substr(slash + 1))};
  const auto runs = IntegerOf<std::int64_t>(ValueOf(one.arguments, "--runs"));
  if (one.shard.index < 1 || one.shard.index > one.shard.of || one.shard.of > runs) {
    FailData(inputs, "has the shard '" + text + "' of " + std::to_string(runs) + " runs",
             "i/n with 1 <= i <= n, and a run for each shard");
  }
  one.input_texts = ReadInputTexts(folder);
  one.input_texts.inputs = WithoutOption(one.input_texts.inputs, "--shard", text);
  return one;
}

/// Refuses a shard that is of another sweep than the first.
void CheckSameSweep(const ShardFolder& first, const ShardFolder& one) {
  if (one.shard.of != first.shard.of) {
    FailData(one.folder,
             "is shard " + TextOf(one.shard) + ", but " + first.folder.string() + " is shard " +
                 TextOf(first.shard),
             "the shards of one sweep");
  }
  const std::string difference = DescribeDifferences(
      first.input_texts, (first.folder / kInputsFile).string(), one.input_texts);
  if (difference.empty()) return;
  FailData(one.folder, "is not of the same sweep as " + first.folder.string() + ": " + difference,
           "the shards of one sweep");
}

/// Sorts the shards by index. Refuses shards that come twice or are missing.
void Order(std::vector<ShardFolder>& shards) {
  std::ranges::stable_sort(shards, {}, [](const ShardFolder& one) { return one.shard.index; });
  std::vector<std::string> missing;
  int index = 0;
  for (const ShardFolder& one : shards) {
    if (one.shard.index == index) {
      FailData(one.folder, "is shard " + TextOf(one.shard) + ", which comes twice",
               "each shard once");
    }
    while (++index < one.shard.index) missing.push_back(TextOf(Shard{index, one.shard.of}));
  }
  const int of = shards.front().shard.of;
  while (++index <= of) missing.push_back(TextOf(Shard{index, of}));
  if (missing.empty()) return;
  constexpr std::size_t kShown = 10;
  const std::size_t count = missing.size();
  if (count > kShown) missing.resize(kShown);
  throw Error(ExitCode::kBadData,
              "shards are missing: " + Join(missing, ", ") +
                  (count > kShown ? " and " + std::to_string(count - kShown) + " more" : ""));
}

/// Adds the runs of a shard to `results`, which are by value; all share `names`.
void AddRuns(const ShardFolder& one, const SeedRange& seeds, const std::vector<std::string>& values,
             SharedNames& names, std::vector<SweepResult>& results) {
  const fs::path file = one.folder / kFinishedRuns;
  std::ifstream stream(file);
  if (!stream)
    throw Error(ExitCode::kInputMissing, ErrorLine(Place{file.string()}, {}, "cannot be read"));
  Place place{file.string(), 0, 0};
  const auto fail = [&place](const std::string& what) {
    throw Error(ExitCode::kBadData, ErrorLine(place, {}, what));
  };
  std::string line;
  for (std::size_t v = 0; v < values.size(); ++v) {
    for (std::int64_t i = 0; i < seeds.count; ++i) {
      ++place.line;
      const std::uint64_t seed = seeds.first + static_cast<std::uint64_t>(i);
      std::optional<LineOfRun> read;
      if (std::getline(stream, line)) read = ReadRunLine(line);
      if (!read || read->value != values[v] || read->run.seed != seed)
        fail("is not the run of seed " + std::to_string(seed));
      read->run.ShareNames(names);
      results[v].done.push_back(std::move(read->run));
    }
  }
  if (std::getline(stream, line)) fail("is one line too many");
}

/// What the runs of a sweep share, for each value; `summary` is the sweep.json of any shard.
std::vector<SweepResult> EmptyResults(const Json& summary, std::int64_t runs,
                                      std::uint64_t first_seed) {
  std::vector<SweepResult> results;
  const auto add = [&](const Json& of) {
    SweepResult& result = results.emplace_back();
    result.runs = runs;
    result.first_seed = first_seed;
    result.reference = of.at("reference").get<std::string>();
    for (const auto& [name, one] : of.at("estimators").items()) result.estimators.push_back(name);
  };
  const auto values = summary.find("values");
  if (values == summary.end()) {
    add(summary);
  } else {
    for (const Json& value : *values) add(value);
  }
  return results;
}

std::vector<SweepResult> ReadResults(const std::vector<ShardFolder>& shards,
                                     const std::vector<std::string>& values) {
  const ShardFolder& first = shards.front();
  const auto runs = IntegerOf<std::int64_t>(ValueOf(first.arguments, "--runs"));
  const auto first_seed = IntegerOf<std::uint64_t>(ValueOf(first.arguments, "--first-seed"));
  const fs::path file = first.folder / "sweep.json";
  std::vector<SweepResult> results;
  try {
    results = EmptyResults(ParseJson(TextOf(file), file.string()), runs, first_seed);
  } catch (const Json::exception&) {
  }
  if (results.size() != values.size()) FailData(file, "is not what a sweep of this version writes");
  SharedNames names;
  for (const ShardFolder& one : shards) {
    AddRuns(one, SeedsOf(one.shard, first_seed, runs), values, names, results);
  }
  return results;
}

}  // namespace

MergedSweep MergeShards(const std::vector<fs::path>& folders) {
  ALIDADE_EXPECTS(!folders.empty());
  std::vector<ShardFolder> shards;
  for (const fs::path& folder : folders) {
    shards.push_back(ReadShardFolder(folder));
    CheckSameSweep(shards.front(), shards.back());
  }
  Order(shards);
  const ShardFolder& first = shards.front();
  const std::string varied = ValueOf(first.arguments, "--vary");
  std::optional<Variation> variation;
  if (!varied.empty()) variation = Variation::FromText(varied);
  std::vector<SweepResult> results =
      ReadResults(shards, variation ? variation->values : std::vector<std::string>{""});
  return {Config::FromText(first.input_texts.config, (first.folder / kResolvedConfig).string()),
          first.input_texts.inputs, std::move(variation), std::move(results)};
}

}  // namespace alidade::internal
