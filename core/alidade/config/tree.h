// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"

namespace alidade {

struct ConfigTree {
  Node::Kind kind = Node::Kind::kNull;
  bool quoted = false;  ///< a scalar written as 'text', "text" or a block
  Place place;
  std::string text;  ///< a scalar as written
  std::vector<std::unique_ptr<ConfigTree>> children;

  const ConfigTree* parent = nullptr;
  std::string key;  ///< in a map
  int index = -1;   ///< in a list
  int key_line = 0;
  int key_column = 0;

  mutable std::string path;  ///< made when first asked for
  mutable std::set<std::string, std::less<>> asked;
};

namespace internal {

/// What the files of one config may still add, aliases expanded.
struct Budget {
  static constexpr int kMaxNodes = 100'000;
  static constexpr int kMaxBytes = 8 << 20;

  int nodes = 0;
  std::size_t bytes = 0;
  bool within() const { return nodes <= kMaxNodes && bytes <= kMaxBytes; }
};

constexpr int kMaxDepth = 64;

/// Where the text of parse errors comes from.
struct Origin {
  std::string file;
  std::string key_prefix = {};  ///< key path of the root of the text, for `--set`
  bool has_lines = true;
  int max_depth = kMaxDepth;
};

/// Reads one YAML document strictly; null where the text holds none.
std::unique_ptr<ConfigTree> ParseYaml(std::string_view text, const Origin& origin, Budget* budget);

/// What forbids `key` as one, or "".
std::string KeyDefect(const std::string& key);

const std::string& PathOf(const ConfigTree& tree);
/// The key path of `key` in the map at `path`.
std::string PathBelow(const std::string& path, std::string_view key);
/// Where the key of `tree` is written, or its value where it has none.
Place KeyPlace(const ConfigTree& tree);
ConfigTree* Child(const ConfigTree& map, std::string_view key);
std::unique_ptr<ConfigTree> Clone(const ConfigTree& tree);
std::string ToYaml(const ConfigTree& root);

inline bool IsDigit(char c) { return c >= '0' && c <= '9'; }
/// With its ASCII letters in lower case, whatever the locale.
std::string LowerCase(std::string_view text);

/// `text` in quotes, shortened and without control characters.
std::string Quoted(std::string_view text);

[[noreturn]] void FailAt(const Place& place, std::string_view key, std::string_view what,
                         std::string_view expected = {}, std::string_view suggestion = {});

/// Refuses a name that is not one word in columns (`target.depth`), metric keys
/// (`rmse:target.depth@near`) and tables. `of` says of what, as in `a sensor`.
void ExpectName(const std::string& name, const Node& at, const std::string& of);

}  // namespace internal
}  // namespace alidade
