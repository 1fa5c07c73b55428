// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/formula/compiled_function.h"

namespace alidade::internal {

/// Keys that sensors and motion models in the config have in common: `constants`, `let`, `units`,
/// and maps of names to geometries, such as `blocks: {p: [x, y], heading: angle}`.
class FormulaKeys {
 public:
  /// Reads the constants. The maps of the keys `declarations` declare names.
  FormulaKeys(const Node& entry, std::vector<const char*> declarations);

  /// Reads the map `key` of names to geometries. Each space has these flags.
  std::vector<Space> ReadSpaces(const char* key, unsigned flags = 0) const;
  /// Reads a geometry: the name of a geometry, `number`, or the list of the elements of a vector.
  Space ReadSpace(const std::string& name, const Node& node) const;
  /// Returns the unit of a quantity: that of the key `units`, or rad for an angle.
  std::string UnitOf(const std::string& name, const Geometry& geometry) const;
  /// Declares one name for each space. The first element of the first space is the variable `first`
  /// of the program.
  void DeclareSpaces(const std::vector<Space>& spaces, int first, Scope& scope) const;
  /// Declares the constants and the definitions of `let`.
  void AddTo(Scope& scope) const;
  /// Compiles all definitions of `let` in this scope, to find the errors in those that no
  /// expression uses.
  void CheckDefinitions(Scope& scope) const;
  /// Compiles all definitions of `let`, which may use the constants only.
  void CheckDefinitionsOfConstants() const;
  /// Rejects units of quantities that do not exist.
  void RejectUnread() const;

 private:
  struct Constant {
    std::string name;
    std::vector<double> values;
    Node node;
  };

  /// Returns the declaration of a name, or the entry of the model.
  Node PlaceOf(const std::string& name) const;

  Node entry_;
  std::vector<const char*> declarations_;
  std::optional<Node> units_;
  std::vector<Constant> constants_;
  std::vector<std::pair<std::string, Node>> definitions_;
};

/// Returns one vector that contains all elements of `spaces`. Its name is `name`, or that of the
/// only space. The result has no name if `spaces` is empty.
Space Concatenated(const std::vector<Space>& spaces, const std::string& name);

/// Returns the names of all elements of the spaces, such as `p.x`.
std::vector<std::string> ColumnsOf(const std::vector<Space>& spaces);

/// Returns a quantity whose elements are the variables of the program from `first`.
Value VariableOf(const Space& space, int first);

std::vector<Geometry> GeometriesOf(const std::vector<Space>& spaces);

/// Returns the text of an expression, for a description.
std::string ExpressionText(const Node& node);

}  // namespace alidade::internal
