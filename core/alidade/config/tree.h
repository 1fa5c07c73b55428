// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"

namespace alidade {

/// Node of a parsed config, with its children.
struct ConfigTree {
  Node::Kind kind = Node::Kind::kNull;
  bool quoted = false;       ///< whether a scalar is written as 'text', "text" or a block
  bool is_verbatim = false;  ///< whether the file contains `text` as it is, in one line
  bool is_filled = false;    ///< true: the program added this value, see Node::is_filled()
  Place place;
  std::string text;  ///< text of a scalar as it is written
  std::vector<std::unique_ptr<ConfigTree>> children;

  const ConfigTree* parent = nullptr;
  std::string key;  ///< key of this node if it is an entry of a map
  int index = -1;   ///< index of this node if it is an item of a list
  int key_line = 0;
  int key_column = 0;

  mutable std::string path;  ///< key path, computed when it is first used
  mutable std::set<std::string, std::less<>> known_keys;  ///< keys that were read or declared
};

namespace internal {

/// Total size of the files of one config after aliases are expanded, and the limits of this size.
struct Budget {
  static constexpr int kMaxNodes = 100'000;
  static constexpr int kMaxBytes = 8 << 20;

  int nodes = 0;
  std::size_t bytes = 0;
  bool is_within_limits() const { return nodes <= kMaxNodes && bytes <= kMaxBytes; }
};

constexpr int kMaxDepth = 64;

/// Origin of a YAML text, which messages report.
struct Origin {
  std::string file;
  std::string key_prefix = {};  ///< key path of the text's root, such as the key of `--set`
  bool has_lines = true;
  int max_depth = kMaxDepth;
};

/// Reads one YAML document strictly. Returns null if the text has no document.
std::unique_ptr<ConfigTree> ParseYaml(std::string_view text, const Origin& origin, Budget* budget);

/// Returns the reason why `key` is not a valid key, or "" if it is valid.
std::string KeyDefect(const std::string& key);

/// Returns the key path of `tree`.
const std::string& PathOf(const ConfigTree& tree);
/// Returns the key path of `key` in the map at `path`.
std::string PathBelow(const std::string& path, std::string_view key);
/// Returns the place of the key of `tree`, or the place of `tree` itself if it has no key.
Place KeyPlace(const ConfigTree& tree);
/// Returns the value of `key`, or null if `map` does not contain `key`.
ConfigTree* Child(const ConfigTree& map, std::string_view key);
/// Adds a value to `map`, which does not contain `key`. The value is marked as filled in and has
/// the place of `map`. FillNumbers adds a number if `values` has one item, else a list.
void FillText(ConfigTree& map, const std::string& key, const std::string& text);
void FillNumbers(ConfigTree& map, const std::string& key, const std::vector<double>& values);
/// Adds `value` to `map`, or to the existing value of its key if both are maps. Has no effect on
/// any other existing value. The added values are marked as filled in; they keep place and path.
void FillCopy(ConfigTree& map, const ConfigTree& value);
/// Replaces the value of `node` by an empty map, which is marked as filled in.
void FillMap(ConfigTree& node);
/// Removes `key` from `map`. Has no effect if the map does not contain `key`.
void Remove(ConfigTree& map, std::string_view key);
/// Replaces a list of names, as in `estimators: [ekf, ukf]`, by a map with an empty map for each
/// name. Has no effect on any other value.
void ExpandNames(ConfigTree& list);

/// Returns a deep copy in which no key counts as read.
std::unique_ptr<ConfigTree> Clone(const ConfigTree& tree);
std::string ToYaml(const ConfigTree& root);

inline bool IsDigit(char c) { return c >= '0' && c <= '9'; }

/// Returns `text` in single quotes, for a message. Escapes control characters and replaces the part
/// after the first 60 bytes by `...`.
std::string Quoted(std::string_view text);

/// Throws an Error kBadConfig whose message is ErrorLine() of these arguments.
[[noreturn]] void FailAt(const Place& place, std::string_view key, std::string_view message,
                         std::string_view expected = {}, std::string_view suggestion = {});

/// Fails unless `name` consists of letters, digits, `_` and `-`. Names are parts of column names
/// (`target.depth`) and metric keys (`rmse:target.depth@near`). `owner` describes the named object,
/// such as `a sensor`.
void ExpectName(const std::string& name, const Node& node, const std::string& owner);

}  // namespace internal
}  // namespace alidade
