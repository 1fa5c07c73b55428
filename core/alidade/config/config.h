// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"

namespace alidade {

struct ConfigTree;  // one node of the parsed tree, defined in core/alidade/config/tree.h

/// One place of a config: a scalar, list or map that knows its file, line, column and key path.
///
/// A cheap handle; the Config it came from must outlive it. Every failure is an Error with code
/// kBadConfig that names place, key path, what was found and what is accepted. Reading declares: a
/// map remembers the keys asked of it, and RejectUnread() refuses the rest. That record makes
/// reading unsafe from two threads at once.
class Node {
 public:
  enum class Kind { kNull, kScalar, kList, kMap };

  explicit Node(const ConfigTree* tree) : tree_(tree) {}
  const ConfigTree& tree() const { return *tree_; }

  Kind kind() const;
  bool is_map() const { return kind() == Kind::kMap; }
  const Place& place() const;
  /// Key path from the root, as in `sensors.stereo.focal_px` or `source.columns[2]`.
  const std::string& path() const;

  /// The root of the config that this is of.
  Node Root() const;

  /// Map: the value of `key`, if it is there. Fails where this is not a map.
  std::optional<Node> Find(std::string_view key) const;
  /// Map: the value of `key`; `needed_by` names who needs it in the error.
  Node At(std::string_view key, std::string_view needed_by = {}) const;
  /// Map: all entries in the order written; each counts as read.
  std::vector<std::pair<std::string, Node>> Entries() const;
  /// List: all items.
  std::vector<Node> Items() const;
  /// All items of a list; anything else counts as a list of one.
  std::vector<Node> ItemsOrOne() const;

  /// Finite number in full: no unit, no trailing text, no leading zeros, no under- or overflow.
  double Number() const;
  /// Number within [low, high]; an open end excludes its value.
  double Number(double low, double high, bool low_open = false, bool high_open = false) const;
  /// Integer in full, as Number, within [low, high]; the limits of the type stand for no bound.
  std::int64_t Integer(std::int64_t low, std::int64_t high) const;
  bool Flag() const;  ///< `true` or `false`, nothing else
  /// The scalar as it is written, without quotes: a number or a flag is text too.
  std::string Text() const;
  /// Index of the scalar in `choices`.
  int Choice(const std::vector<std::string>& choices) const;
  /// A list of numbers; a bare number counts as a list of one. `size` < 0: any length above zero.
  std::vector<double> Numbers(int size = -1) const;

  /// Map: fails on every key that was never asked for, with the nearest asked one; also in the maps
  /// below of which a key was asked for.
  void RejectUnread() const;
  /// Map: whether it has `key`, which nobody has asked for yet; does not declare it.
  bool HasUnread(std::string_view key) const;
  /// Map: declares keys without reading them (so that they are known to RejectUnread).
  void Declare(std::string_view key) const;

  /// This value as YAML, which Config::Set reads back.
  std::string ToYaml() const;

  /// Throws the Error of this place: `FILE:LINE:COL path: what; expected ...; did you mean ...?`
  [[noreturn]] void Fail(std::string_view what, std::string_view expected = {},
                         std::string_view suggestion = {}) const;

 private:
  const ConfigTree* tree_;
};

/// A config file, read strictly: see docs/config.md for what is refused. Copies share the tree.
class Config {
 public:
  /// Reads a file, and the files its `include:` names (below it in precedence). An include must lie
  /// inside the folder of the file unless `allow_outside`. Relative paths (`source.path`, the items
  /// of `plugins`) become absolute, taken from the folder of the file that has them.
  /// Errors: kInputMissing, kBadConfig, kNotTrusted.
  static Config FromFile(const std::filesystem::path& file, bool allow_outside = false);
  /// Reads YAML text, in which `include:` is refused; `name` stands for the file in messages.
  static Config FromText(std::string_view text, std::string_view name);

  Node root() const;
  /// The folder of the file; of a text, the current one.
  const std::filesystem::path& folder() const { return folder_; }
  const std::string& name() const { return name_; }
  /// What an output must not replace: the files that it was read from, and `source.path`.
  std::vector<std::string> inputs() const;

  /// Sets `dotted.key` to `value`, read as YAML; maps on the way are made. `origin` stands for the
  /// file in messages about it (as in `--set`). A lone `-` is a text; a relative path becomes
  /// absolute, taken from the current folder. Handles to what was there before become invalid.
  void Set(std::string_view dotted_key, std::string_view value, std::string_view origin);
  /// A copy with `overrides` (a map) merged in: maps merge key by key, everything else replaces,
  /// and a map that names another `model:` or `type:` replaces the old map whole. What is merged in
  /// keeps place and key path. Reads recorded in this config are not copied.
  Config Merged(const Node& overrides) const;
  /// A config of its own, of which nothing has been read; a copied Config shares what was.
  Config Copy() const;

  /// The tree as YAML, in the order written; reads back to the same tree.
  std::string ToYaml() const;

 private:
  Config() = default;
  std::shared_ptr<ConfigTree> tree_;
  std::filesystem::path folder_;
  std::string name_;
  std::vector<std::string> files_;  ///< that it was read from
};

/// `path` taken relative to `base`; Error kNotTrusted where it leaves `base` by `..`, an absolute
/// path or a symlink (also one that leads to nothing) and `allow_outside` is false.
std::filesystem::path ResolveInside(const std::filesystem::path& base, const std::string& path,
                                    bool allow_outside, const Place& place, std::string_view key);

}  // namespace alidade
