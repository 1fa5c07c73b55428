// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/base/error.h"

namespace alidade::internal {

/// In the folder of a sweep that is not finished: the runs that are, a line of JSON each.
constexpr const char* kFinishedRuns = "finished_runs.jsonl";

/// What was recorded at `place` comes out otherwise from the same inputs. Error: kFound.
[[noreturn]] void FailOtherResults(const Place& place, const std::string& what);

/// Whether a folder is that of a run or sweep, and whether that came to its end.
enum class FolderStatus { kOther, kUnfinished, kFinished };
FolderStatus StatusOf(const std::filesystem::path& folder);
/// `status` in its run.json or sweep.json; "": there is none.
std::string RecordedStatus(const std::filesystem::path& folder);

/// What `config` (the resolved text) and `inputs` (of inputs.json) differ in from those that
/// `folder` was made from; "": in nothing.
std::string DifferenceFrom(const std::filesystem::path& folder, const std::string& config,
                           const std::string& inputs);

/// The two texts that a folder was made from: of its config.resolved.yaml and its inputs.json.
struct MadeFrom {
  std::string config, inputs;
};
/// What `now` differs in from `before`, whose inputs.json is `file`; "": in nothing.
std::string DifferenceOf(const MadeFrom& before, const std::string& file, const MadeFrom& now);

/// Whether `target` is a finished run of this config and these inputs; removes what is left of a
/// process that died right after it was. Error: kCannotCreate where it is one of others, unless
/// `force`.
bool IsFinishedRun(const std::filesystem::path& target, const std::string& config,
                   const std::string& inputs, bool force);

/// Refuses a target that --resume may not replace without --force: all but an unfinished run or
/// sweep. To be asked once nobody else can write to it. Error: kCannotCreate.
void CheckReplaceable(const std::filesystem::path& target);

/// The folders that unfinished runs to one place left: `NAME.failed-PID` next to it, and the folder
/// itself. A run that is to do the same to the end compares its rows with theirs.
class Leftovers {
 public:
  explicit Leftovers(const std::filesystem::path& target);

  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  /// Error: kCannotCreate where one of them was made from another config or other inputs.
  void CheckInputs(const std::string& config, const std::string& inputs) const;
  /// The first of their files that has more rows than that of `folder`, none: `folder` has them
  /// all. Estimators of which the estimates rest on later data too, `offline`, do not count: of
  /// less data they are others. Error: kFound where rows differ.
  std::optional<std::filesystem::path> LongerThan(const std::filesystem::path& folder,
                                                  const std::set<std::string>& offline) const;
  /// Removes those next to the target, which is finished now. One that holds a file that the target
  /// has not stays with that.
  void Remove() const;
  /// Likewise, those alone that were made from this config and these inputs, and have no other
  /// rows.
  void RemoveFinished(const std::string& config, const std::string& inputs) const;

 private:
  std::filesystem::path target_;
  std::vector<std::filesystem::path> folders_;
};

}  // namespace alidade::internal
