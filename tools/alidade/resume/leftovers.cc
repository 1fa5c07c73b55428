// SPDX-License-Identifier: Apache-2.0
#include "alidade/resume/leftovers.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/base/json.h"
#include "alidade/base/output_folder.h"
#include "alidade/base/read_file.h"
#include "alidade/base/words.h"
#include "alidade/resume/compare_rows.h"
#include "alidade/resume/run_inputs.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// "" where it cannot be read.
std::string TextIn(const fs::path& file) {
  return ReadFile(file, [](ExitCode, int) {});
}

/// `status` of a file of JSON; "" where there is none.
std::string StatusIn(const fs::path& file) {
  const std::string text = TextIn(file);
  if (text.empty()) return "";
  const Json json = ParseJson(text, file.string());
  const auto status = json.is_object() ? json.find("status") : json.end();
  return status != json.end() && status->is_string() ? status->get<std::string>() : "";
}

/// Files of which a row is written as soon as it is known, and never changed: of the run, and of an
/// estimator.
constexpr std::array<std::string_view, 5> kRowsOfRun = {
    "measurements.csv", "truth.csv", "truth.tum", "expected.csv", "implied_states.csv"};
constexpr std::array<std::string_view, 8> kRowsOfEstimator = {
    "estimates.csv",    "errors.csv",     "innovations.csv",           "gains.csv",
    "reprojection.csv", "trajectory.tum", "trajectory_covariance.tum", "covariance.bin"};
/// Files that a finished folder has not.
constexpr std::array<std::string_view, 2> kOnlyOfUnfinished = {kFinishedRuns, ".gnuplot.log"};

bool Holds(const auto& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

bool HasRows(const fs::path& name, const std::set<std::string>& offline) {
  const std::string file = name.filename().string(), owner = name.parent_path().string();
  if (owner.empty()) return Holds(kRowsOfRun, file);
  return !offline.contains(owner) && Holds(kRowsOfEstimator, file);
}

/// The regular files in a folder, at any depth, relative to it.
std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (fs::is_regular_file(entry->symlink_status(error)))
      files.push_back(entry->path().lexically_relative(folder));
  }
  std::ranges::sort(files);
  return files;
}

[[noreturn]] void RefuseInputs(const fs::path& folder, const std::string& what,
                               const char* remedy) {
  throw Error(
      ExitCode::kCannotCreate,
      ErrorLine(Place{folder.string()}, {}, "was made from other inputs: " + what) + "; " + remedy);
}

/// The first file of a leftover with more rows than that of `folder`. Error: kFound where rows
/// differ.
std::optional<fs::path> LongerIn(const fs::path& leftover, const fs::path& folder,
                                 const std::set<std::string>& offline) {
  std::optional<fs::path> longer;
  for (const fs::path& name : FilesOf(leftover)) {
    if (!HasRows(name, offline)) continue;
    const RowComparison rows = CompareRows(leftover / name, folder / name, LastRow::kWhereWhole);
    if (rows.before_goes_on && !longer) longer = leftover / name;
    if (!rows.difference) continue;
    const Place place{(leftover / name).string(), static_cast<int>(rows.difference->line),
                      static_cast<int>(rows.difference->column)};
    FailOtherResults(place, rows.difference->Text());
  }
  return longer;
}

/// Removes the folders in `folder`, and it, as far as nothing is in them.
void RemoveEmpty(const fs::path& folder) {
  std::vector<fs::path> folders = {folder};
  std::error_code ignored;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (fs::is_directory(entry->symlink_status(ignored))) folders.push_back(entry->path());
  }
  std::ranges::sort(folders, std::ranges::greater());  // what is in a folder comes before it
  for (const fs::path& one : folders) fs::remove(one, ignored);
}

/// Removes a leftover as far as `finished` has its files too. What names its inputs goes last: an
/// end meanwhile leaves what the next call knows.
void RemoveAllOf(const fs::path& leftover, const fs::path& finished) {
  std::error_code ignored;
  RemoveMarks(leftover);
  std::vector<fs::path> files = FilesOf(leftover);
  std::stable_partition(files.begin(), files.end(),
                        [](const fs::path& name) { return name != kInputsFile; });
  for (const fs::path& name : files) {
    const bool known = Holds(kOnlyOfUnfinished, name.string()) ||
                       fs::is_regular_file(fs::symlink_status(finished / name, ignored));
    if (known) fs::remove(leftover / name, ignored);
  }
  RemoveEmpty(leftover);
}

}  // namespace

void FailOtherResults(const Place& place, const std::string& what) {
  throw Error(ExitCode::kFound,
              ErrorLine(place, {}, what) +
                  "; config, data, plugins and build are as they were: another machine, a file "
                  "next to the data, or a model that is not deterministic (`alidade check`)");
}

std::string RecordedStatus(const fs::path& folder) {
  const std::string run = StatusIn(folder / "run.json");
  return run.empty() ? StatusIn(folder / "sweep.json") : run;
}

FolderStatus StatusOf(const fs::path& folder) {
  const std::string status = RecordedStatus(folder);
  if (status.empty()) return FolderStatus::kOther;
  std::error_code ignored;
  const bool reported =
      !fs::exists(folder / "run.json", ignored) || fs::exists(folder / "report.html", ignored);
  return status == "ok" && reported ? FolderStatus::kFinished : FolderStatus::kUnfinished;
}

std::string DifferenceFrom(const fs::path& folder, const std::string& config,
                           const std::string& inputs) {
  const MadeFrom before = {TextIn(folder / kResolvedConfig), TextIn(folder / kInputsFile)};
  if (before.inputs.empty()) return std::string("it has no ") + kInputsFile;
  return DifferenceOf(before, (folder / kInputsFile).string(), {config, inputs});
}

std::string DifferenceOf(const MadeFrom& before, const std::string& file, const MadeFrom& now) {
  std::vector<std::string> differences;
  std::istringstream config_before(before.config), config_now(now.config);
  if (const auto one = CompareRows(config_before, config_now, LastRow::kCounts).difference) {
    differences.push_back(std::string(kResolvedConfig) + ':' + std::to_string(one->line) + ": " +
                          one->Text());
  }
  for (const std::string& one : InputDifferences(before.inputs, file, now.inputs)) {
    if (differences.empty() || !one.starts_with("config: ")) differences.push_back(one);
  }
  return Join(differences, "; ");
}

bool IsFinishedRun(const fs::path& target, const std::string& config, const std::string& inputs,
                   bool force) {
  if (StatusOf(target) != FolderStatus::kFinished) return false;
  const std::string difference = DifferenceFrom(target, config, inputs);
  if (difference.empty()) {
    RemoveMarks(target);
    Leftovers(target).RemoveFinished(config, inputs);
    return true;
  }
  if (!force) RefuseInputs(target, difference, "add --force to replace it");
  return false;
}

void CheckReplaceable(const fs::path& target) {
  std::error_code ignored;
  const bool is_there = fs::exists(fs::symlink_status(target, ignored));
  if (!is_there || StatusOf(target) == FolderStatus::kUnfinished) return;
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{target.string()}, {}, "is no unfinished run") +
                  "; add --force to replace it");
}

Leftovers::Leftovers(const fs::path& target) : target_(target), folders_(FailedFolders(target)) {
  std::erase_if(folders_, [](const fs::path& folder) {
    if (!FilesOf(folder).empty()) return false;
    RemoveEmpty(folder);  // the end of a removal that was killed
    return true;
  });
  if (StatusOf(target) == FolderStatus::kUnfinished) folders_.push_back(target);
}

void Leftovers::CheckInputs(const std::string& config, const std::string& inputs) const {
  for (const fs::path& folder : folders_) {
    const std::string difference = DifferenceFrom(folder, config, inputs);
    if (!difference.empty()) {
      RefuseInputs(folder, difference,
                   "to start anew, move it elsewhere or remove it, and leave out --resume");
    }
  }
}

std::optional<fs::path> Leftovers::LongerThan(const fs::path& folder,
                                              const std::set<std::string>& offline) const {
  std::optional<fs::path> longer;
  for (const fs::path& leftover : folders_) {
    const std::optional<fs::path> one = LongerIn(leftover, folder, offline);
    if (!longer) longer = one;
  }
  return longer;
}

void Leftovers::Remove() const {
  for (const fs::path& folder : folders_) {
    if (folder != target_) RemoveAllOf(folder, target_);
  }
}

void Leftovers::RemoveFinished(const std::string& config, const std::string& inputs) const {
  for (const fs::path& folder : folders_) {
    if (folder == target_ || !DifferenceFrom(folder, config, inputs).empty()) continue;
    try {
      if (!LongerIn(folder, target_, {})) RemoveAllOf(folder, target_);
    } catch (const Error&) {
      // It has other rows, and stays.
    }
  }
}

}  // namespace alidade::internal
