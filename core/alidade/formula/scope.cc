// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/scope.h"

#include <algorithm>
#include <array>

#include "alidade/formula/parser.h"

namespace alidade::internal {

void Scope::Declare(const std::string& name, Symbol symbol, const Node& node) {
  Insert(name, node).symbol = std::move(symbol);
}

void Scope::Define(const std::string& name, const Node& expression) {
  Insert(name, expression).definition = expression;
}

const Symbol* Scope::Find(const std::string& name) {
  const auto found = entries_.find(name);
  if (found == entries_.end()) return nullptr;
  Entry& entry = found->second;
  if (!entry.symbol) {
    if (entry.is_compiling) entry.definition->Fail("'" + name + "' depends on itself");
    if (++depth_ > kMaxDepth) {
      entry.definition->Fail("the definitions are nested too deep",
                             "at most " + std::to_string(kMaxDepth) + " levels");
    }
    entry.is_compiling = true;
    entry.symbol = Symbol{ParseExpression(*entry.definition, *this)};
    --depth_;
  }
  return &*entry.symbol;
}

std::vector<std::string> Scope::Names() const {
  std::vector<std::string> names;
  for (const auto& [name, entry] : entries_) {
    names.push_back(name);
    if (!entry.symbol) continue;
    for (const auto& [part, value] : entry.symbol->parts) names.push_back(name + '.' + part);
    for (const std::string& element : entry.symbol->value.elements)
      names.push_back(name + '.' + element);
  }
  return names;
}

Scope::Entry& Scope::Insert(const std::string& name, const Node& node) {
  if (!IsIdentifier(name)) {
    node.Fail("'" + name + "' cannot be used in an expression",
              "a name of letters, digits and _ that does not begin with a digit");
  }
  if (name == kPi || name == kAnd) {
    node.Fail("'" + name + "' has a meaning in expressions", "another name");
  }
  const auto [entry, is_new] = entries_.try_emplace(name);
  if (!is_new) node.Fail("the name '" + name + "' is already used", "another name");
  return entry->second;
}

}  // namespace alidade::internal
