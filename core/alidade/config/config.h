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

struct ConfigTree;  // node of the parsed tree, defined in core/alidade/config/tree.h

/// Node of a config: a scalar, list or map with its file, line, column and key path.
///
/// A node is a cheap handle to a Config, which must outlive it. Every failure is an Error with code
/// kBadConfig that names the place, the key path, the value found and the values accepted. A map
/// records the keys that are read, and RejectUnread() rejects the other keys. Because of this
/// record, two threads must not read a config at the same time.
class Node {
 public:
  enum class Kind { kNull, kScalar, kList, kMap };

  explicit Node(const ConfigTree* tree) : tree_(tree) {}
  const ConfigTree& tree() const { return *tree_; }

  Kind kind() const;
  /// Returns true if the program filled in this value, for example a default or a short form.
  bool is_filled() const;
  bool is_map() const { return kind() == Kind::kMap; }
  const Place& place() const;
  /// Returns the key path from the root, such as `sensors.stereo.focal_px` or `source.columns[2]`.
  const std::string& path() const;

  /// Returns the root of the config.
  Node Root() const;

  /// Returns the value of `key` of this map, or nullopt if the map does not contain `key`. Fails if
  /// this node is not a map.
  std::optional<Node> Find(std::string_view key) const;
  /// Returns the value of `key` of this map. If the key is missing, the error reports that
  /// `needed_by` needs it, and contains `expected`.
  Node At(std::string_view key, std::string_view needed_by = {},
          std::string_view expected = {}) const;
  /// Fails unless this node is a map. The error contains `example`, a text such as
  /// `{mean: 0.3, sigma: 0.1}`.
  void ExpectMap(std::string_view example) const;
  /// Returns all entries of this map in the order of the file, and records each key as read.
  std::vector<std::pair<std::string, Node>> Entries() const;
  /// Returns all items of this list.
  std::vector<Node> Items() const;
  /// Returns all items of a list; any other node counts as a list of one item.
  std::vector<Node> ItemsOrOne() const;

  /// Returns a finite number. Rejects a unit, trailing text, leading zeros, underflow and overflow.
  double Number() const;
  /// Returns a number within [low, high]. `low_open` and `high_open` exclude the respective bound.
  /// Errors contain `unit`.
  double Number(double low, double high, bool low_open = false, bool high_open = false,
                std::string_view unit = {}) const;
  /// Returns an integer within [low, high], with the strict syntax of Number(). The smallest or
  /// largest value of the type means that there is no bound.
  std::int64_t Integer(std::int64_t low, std::int64_t high) const;
  bool Flag() const;  ///< accepts `true` and `false` only
  /// Returns the text of any scalar without its quotes. Also accepts numbers and flags.
  std::string Text() const;
  /// Returns the index of the scalar in `choices`. Fails if `choices` does not contain it.
  int Choice(const std::vector<std::string>& choices) const;
  /// Returns a list of numbers; a single number counts as a list of one number. If `size` < 0, any
  /// length above zero is accepted. Errors contain `unit`.
  std::vector<double> Numbers(int size = -1, std::string_view unit = {}) const;

  /// Fails if this map contains a key that was never read, and suggests the most similar known key.
  /// Also checks each nested map from which at least one key was read.
  void RejectUnread() const;
  /// Returns true if this map contains `key` and the key has not been read. This call does not
  /// count as a read.
  bool HasUnread(std::string_view key) const;
  /// Declares `key` of this map as known without reading the value. RejectUnread() then accepts the
  /// key.
  void Declare(std::string_view key) const;

  /// Returns this value as YAML that Config::Set can read.
  std::string ToYaml() const;

  /// Throws an Error with the text
  /// `FILE:LINE:COL path: message; expected ...; did you mean ...?`
  [[noreturn]] void Fail(std::string_view message, std::string_view expected = {},
                         std::string_view suggestion = {}) const;

 private:
  const ConfigTree* tree_;
};

/// Parsed config. The reader is strict: docs/config.md lists the constructs that it rejects. Copies
/// share one tree.
class Config {
 public:
  /// Reads a file and the files that its key `include` lists. A list of names under `estimators`
  /// counts as a map of empty maps. Values of the file replace values of
  /// the included files. An included file must lie inside the folder of the file that includes it,
  /// unless `allow_outside` is true. Relative paths (`source.path`, the items of `plugins`) are
  /// resolved against the folder of the file that contains them. Errors: kInputMissing, kBadConfig,
  /// kNotTrusted.
  static Config FromFile(const std::filesystem::path& file, bool allow_outside = false);
  /// Reads YAML text. The key `include` is an error in such a text. Messages use `name` as the name
  /// of the file.
  static Config FromText(std::string_view text, std::string_view name);

  Node root() const;
  /// Returns the tree, which all copies of the config share, except those made by Copy().
  ConfigTree& tree() { return *tree_; }
  /// Returns the folder of the file, or `.` if the config was read from a text.
  const std::filesystem::path& folder() const { return folder_; }
  const std::string& name() const { return name_; }
  /// Returns the files that an output must not replace: the config files and `source.path`.
  std::vector<std::string> inputs() const;

  /// Sets `dotted_key`, such as `a.b[0]`, to `value`, which is parsed as YAML. Creates missing maps
  /// on the path of the key. Messages use `origin` (such as `--set`) as the name of the file. The
  /// value `-` is read as a text. A relative path is resolved against the current folder. Nodes of
  /// the replaced value become invalid.
  void Set(std::string_view dotted_key, std::string_view value, std::string_view origin);
  /// Returns a copy into which the map `overrides` is merged. Maps are merged key by key; any other
  /// value replaces the old value. A map with a different `model` or `type` replaces the whole old
  /// map. Messages report a merged value at its place and key path in `overrides`. The record of
  /// the keys that were read is not copied.
  Config Merged(const Node& overrides) const;
  /// Returns a deep copy in which no key counts as read.
  Config Copy() const;

  /// Returns the tree as YAML, in the order of the file. Parsing this YAML yields the same tree.
  std::string ToYaml() const;

 private:
  Config() = default;
  std::shared_ptr<ConfigTree> tree_;
  std::filesystem::path folder_;
  std::string name_;
  std::vector<std::string> files_;  ///< config files that were read
};

/// Returns `path` resolved against `base`. Throws an Error kNotTrusted if `allow_outside` is false
/// and the path leaves `base` by `..`, an absolute path or a symlink (even a dangling one).
std::filesystem::path ResolveInside(const std::filesystem::path& base, const std::string& path,
                                    bool allow_outside, const Place& place, std::string_view key);

}  // namespace alidade
