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

/// `status` of a file of JSON; "" if it cannot be read or has none.
std::string StatusIn(const fs::path& file) {
  const std::string text = ReadFile(file, [](ExitCode, int) {});
  if (text.empty()) return "";
  const Json json = ParseJson(text, file.string());
  const auto status = json.is_object() ? json.find("status") : json.end();
  return status != json.end() && status->is_string() ? status->get<std::string>() : "";
}

/// What `files.txt` of a folder lists, as far as these are files.
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
  const RecordedInputs inputs = ReadInputs(ReadMadeFrom(folder).inputs, file.string());
  const std::vector<std::string>& arguments = inputs.command.arguments;
  if (arguments.empty() || (arguments[0] != "run" && arguments[0] != "sweep")) {
    throw Error(ExitCode::kBadData, ErrorLine(Place{file.string()}, "arguments",
                                              "no command that makes a folder", "run or sweep"));
  }
  if (!inputs.read_once.empty()) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(Place{folder.string()}, {},
                          "its data came from '" + inputs.read_once + "', which could be read once",
                          "a run on files"));
  }
  const std::string status = RecordedStatus(folder);
  if (status.empty() || status == "running" || status == "stopped") {
    throw Error(ExitCode::kBadData, ErrorLine(Place{folder.string()}, {},
                                              status == "stopped" ? "was stopped before its end"
                                                                  : "was not written to its end",
                                              "the folder of a run or sweep that is finished"));
  }
  return inputs;
}

bool HasWallClock(std::string_view file) {
  constexpr std::array<std::string_view, 3> kFiles = {"timing.json", "timing.csv",
                                                      "figures/timing.svg"};
  return std::ranges::find(kFiles, file) != kFiles.end();
}

ReplayResult CompareReplay(const fs::path& before, const fs::path& now) {
  ReplayResult result;
  result.inputs = InputDifferences(ReadMadeFrom(before).inputs, (before / kInputsFile).string(),
                                   ReadMadeFrom(now).inputs);
  std::set<std::string> made = ListedFiles(now);
  std::error_code ignored;
  for (const std::string& name : ListedFiles(before)) {
    const bool is_made = made.erase(name) > 0;
    if (HasWallClock(name)) {
      result.left_out.push_back(name);
      continue;
    }
    ++result.files;
    if (name == kInputsFile && !result.inputs.empty()) continue;
    if (!fs::exists(before / name, ignored)) {
      result.differences.push_back({name, 0, 0, "has been removed"});
      continue;
    }
    if (!is_made) {
      result.differences.push_back({name, 0, 0, "is not made now"});
      continue;
    }
    const RowComparison rows = CompareRows(before / name, now / name);
    if (rows.difference) {
      result.differences.push_back(
          {name, rows.difference->line, rows.difference->column, rows.difference->Text()});
    } else if (rows.before_goes_on || rows.now_goes_on) {
      result.differences.push_back(
          {name, rows.rows + 1, 1, rows.now_goes_on ? "now there is more" : "ends here now"});
    }
  }
  for (const std::string& name : made) {
    if (HasWallClock(name)) continue;
    ++result.files;
    result.differences.push_back({name, 0, 0, "is new"});
  }
  return result;
}

std::string ReplayJson(const ReplayResult& result) {
  Json json = {{"equal", result.equal()}, {"files", result.files}};
  json["not_compared"] = result.left_out;
  json["inputs"] = result.inputs;
  Json& differences = json["differences"] = Json::array();
  for (const FileDifference& one : result.differences) {
    Json& entry = differences.emplace_back(Json{{"file", one.file}});
    if (one.line > 0) entry["line"] = one.line;
    if (one.line > 0) entry["column"] = one.column;
    entry["what"] = one.what;
  }
  return JsonText(json);
}

std::string ReplayText(const ReplayResult& result, const std::string& folder) {
  std::string text;
  for (const std::string& one : result.inputs) text += "input differs: " + one + '\n';
  for (const FileDifference& one : result.differences) {
    const Place place{(fs::path(folder) / one.file).string(), static_cast<int>(one.line),
                      static_cast<int>(one.column)};
    text += "differs: " + ToString(place) + ": " + one.what + '\n';
  }
  const std::string left_out = Join(result.left_out);
  text += folder + ": " +
          (result.equal() ? "all " + std::to_string(result.files) + " files are equal"
                          : std::to_string(result.differences.size()) + " of " +
                                std::to_string(result.files) + " files differ") +
          (left_out.empty() ? "" : "; not compared: " + left_out) + '\n';
  return text;
}

}  // namespace alidade::internal
