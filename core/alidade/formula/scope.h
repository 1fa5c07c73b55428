// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/formula/functions.h"

namespace alidade::internal {

/// Quantity that an expression can name.
struct Symbol {
  Value value;
  std::vector<std::pair<std::string, Value>> parts = {};  ///< of a measurement
};

/// Names that the expressions of one program can use.
class Scope {
 public:
  explicit Scope(Program& program) : program_(&program) {}

  Program& program() const { return *program_; }
  /// Adds a name. `node` is the place of the declaration. Fails if the name is not an identifier,
  /// or exists.
  void Declare(const std::string& name, Symbol symbol, const Node& node);
  /// Adds a name for an expression, which is compiled when the name is used.
  void Define(const std::string& name, const Node& expression);
  bool Contains(const std::string& name) const { return entries_.contains(name); }
  /// Returns the symbol of a name, or null if the name does not exist. Fails if the definition of
  /// the name contains an error.
  const Symbol* Find(const std::string& name);
  /// Returns all names, and the elements of the declared names as `name.element`.
  std::vector<std::string> Names() const;

 private:
  struct Entry {
    std::optional<Symbol> symbol;
    std::optional<Node> definition;  ///< expression that is not yet compiled
    bool is_compiling = false;
  };
  static constexpr int kMaxDepth = 64;  ///< of definitions that use other definitions

  Entry& Insert(const std::string& name, const Node& node);

  Program* program_;
  std::map<std::string, Entry> entries_;
  int depth_ = 0;
};

}  // namespace alidade::internal
