// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/formula/compiled_function.h"
#include "alidade/plugin/built_in_models.h"

namespace alidade::internal {

/// Keys that formulas of sensors and of motion models have in common: `constants`, `let`, `units`,
/// and maps of names to geometries, such as `blocks: {p: [x, y], heading: angle}`.
class FormulaKeys {
 public:
  /// Reads the constants.
  explicit FormulaKeys(const Node& entry);

  const Node& entry() const { return entry_; }
  /// Reads the map `key` of names to geometries. Each space has these flags.
  std::vector<Space> ReadSpaces(const char* key, unsigned flags = 0) const;
  /// Reads a geometry: the name of a geometry, `number`, or the list of the elements of a vector.
  Space ReadSpace(const std::string& name, const Node& node) const;
  /// Returns the unit of a quantity: that of the key `units`, or rad for an angle.
  std::string UnitOf(const std::string& name, const Geometry& geometry) const;
  /// Declares the constants and the definitions of `let`.
  void AddTo(Scope& scope) const;
  /// Compiles all definitions of `let` in this scope, to find the errors in those that no
  /// expression uses.
  void CheckDefinitions(Scope& scope) const;
  /// Rejects units of quantities that do not exist.
  void RejectUnread() const;

 private:
  struct Constant {
    std::string name;
    std::vector<double> values;
    Node node;
  };

  Node entry_;
  std::optional<Node> units_;
  std::vector<Constant> constants_;
  std::vector<std::pair<std::string, Node>> definitions_;
};

/// Returns one vector that contains all elements of `spaces`. Its name is `name`, or that of the
/// only space. The result has no name if `spaces` is empty.
Space Concatenated(const std::vector<Space>& spaces, const std::string& name);

std::vector<Geometry> GeometriesOf(const std::vector<Space>& spaces);

/// Returns the text of an expression, for a description.
std::string ExpressionText(const Node& node);

}  // namespace alidade::internal
