// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/replay.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/base/text.h"
#include "alidade/io/json.h"
#include "alidade/io/read_file.h"
#include "alidade/replay/compare_rows.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// Returns the value of `status` in a JSON file. Returns "" if the file cannot be read or does not
/// contain a status.
std::string StatusIn(const fs::path& file) {
  const std::string text = ReadFile(file, [](ExitCode, int) {});
  if (text.empty()) return "";
  const Json json = ParseJson(text, file.string());
  const auto status = json.is_object() ? json.find("status") : json.end();
  return status != json.end() && status->is_string() ? status->get<std::string>() : "";
}

/// Returns the entries of `files.txt` in a folder, except directories.
std::set<std::string> ListedFiles(const fs::path& folder) {
  std::ifstream list(folder / "files.txt");
  std::set<std::string> names;
  std::error_code ignored;
  for (std::string name; std::getline(list, name);) {
    if (!fs::is_directory(folder / name, ignored)) names.insert(name);
  }
  return names;
}

}  // namespace

std::string RecordedStatus(const fs::path& folder) {
  const std::string run = StatusIn(folder / "run.json");
  return run.empty() ? StatusIn(folder / "sweep.json") : run;
}

RecordedInputs ReadReplayable(const fs::path& folder) {
  const fs::path file = folder / kInputsFile;
  const RecordedInputs inputs = ReadInputs(ReadInputTexts(folder).inputs, file.string());
  const std::vector<std::string>& arguments = inputs.command.arguments;
  if (arguments.empty() || (arguments[0] != "run" && arguments[0] != "sweep")) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{file.string()}, "arguments", "the command cannot be repeated",
                          "the command run or sweep"));
  }
  if (!inputs.read_once.empty()) {
    throw Error(ExitCode::kInputMissing, ErrorLine(Place{folder.string()}, {},
                                                   "the data came from '" + inputs.read_once +
                                                       "', which can be read only once",
                                                   "a run whose data are regular files"));
  }
  const std::string status = RecordedStatus(folder);
  if (status.empty() || status == "running" || status == "stopped") {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{folder.string()}, {},
                          status == "stopped" ? "the run or sweep was stopped before it finished"
                                              : "the run or sweep is not finished",
                          "the folder of a finished run or sweep"));
  }
  return inputs;
}

bool HasWallClock(std::string_view file) {
  constexpr std::array<std::string_view, 2> kFiles = {"timing.json", "timing.csv"};
  return std::ranges::find(kFiles, file) != kFiles.end();
}

ReplayResult CompareReplay(const fs::path& recorded, const fs::path& current) {
  ReplayResult result;
  result.inputs =
      InputDifferences(ReadInputTexts(recorded).inputs, (recorded / kInputsFile).string(),
                       ReadInputTexts(current).inputs);
  std::set<std::string> new_files = ListedFiles(current);
  std::error_code ignored;
  for (const std::string& name : ListedFiles(recorded)) {
    const bool is_written = new_files.erase(name) > 0;
    if (HasWallClock(name)) {
      result.not_compared.push_back(name);
      continue;
    }
    ++result.files;
    if (name == kInputsFile && !result.inputs.empty()) continue;
    if (!fs::exists(recorded / name, ignored)) {
      result.differences.push_back({name, 0, 0, "the recorded file has been removed"});
      continue;
    }
    if (!is_written) {
      result.differences.push_back({name, 0, 0, "the replay does not write this file"});
      continue;
    }
    const RowComparison rows = CompareRows(recorded / name, current / name);
    if (rows.difference) {
      result.differences.push_back(
          {name, rows.difference->line, rows.difference->column, rows.difference->Text()});
    } else if (rows.recorded_has_more || rows.current_has_more) {
      result.differences.push_back({name, rows.rows + 1, 1,
                                    rows.current_has_more ? "the file now has more rows"
                                                          : "the file now ends before this row"});
    }
  }
  for (const std::string& name : new_files) {
    if (HasWallClock(name)) continue;
    ++result.files;
    result.differences.push_back({name, 0, 0, "the file is new"});
  }
  return result;
}

std::string ReplayJson(const ReplayResult& result) {
  Json json = {{"equal", result.equal()}, {"files", result.files}};
  json["not_compared"] = result.not_compared;
  json["inputs"] = result.inputs;
  Json& differences = json["differences"] = Json::array();
  for (const FileDifference& difference : result.differences) {
    Json& entry = differences.emplace_back(Json{{"file", difference.file}});
    if (difference.line > 0) entry["line"] = difference.line;
    if (difference.line > 0) entry["column"] = difference.column;
    entry["what"] = difference.description;
  }
  return JsonText(json);
}

std::string ReplayText(const ReplayResult& result, const std::string& folder) {
  std::string text;
  for (const std::string& input : result.inputs) text += "input differs: " + input + '\n';
  for (const FileDifference& difference : result.differences) {
    const Place place{(fs::path(folder) / difference.file).string(),
                      static_cast<int>(difference.line), static_cast<int>(difference.column)};
    text += "differs: " + ToString(place) + ": " + difference.description + '\n';
  }
  const std::string not_compared = Join(result.not_compared);
  text += folder + ": " +
          (result.equal() ? "all " + std::to_string(result.files) + " files are equal"
                          : std::to_string(result.differences.size()) + " of " +
                                std::to_string(result.files) + " files differ") +
          (not_compared.empty() ? "" : "; not compared: " + not_compared) + '\n';
  return text;
}

}  // namespace alidade::internal
