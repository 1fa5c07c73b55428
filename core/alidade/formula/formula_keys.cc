// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/formula_keys.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/config/unit.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

constexpr const char* kNumber = "number";

/// Returns the names of the geometries of fixed size, and `number`.
std::vector<std::string> GeometryNames() {
  std::vector<std::string> names = {kNumber};
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->ambient > 0) names.emplace_back(row->name);
  }
  return names;
}

/// Rejects a unit that is unknown, or that is not an SI unit. Formulas compute in SI units.
void CheckUnit(const Node& node) {
  constexpr std::string_view kOtherUnits[] = {"1", "A", "K", "N", "Pa", "J", "W", "V", "T", "uT"};
  constexpr const char* kExpected = "an SI unit such as m, rad, m/s, kg/m^3 or uT";
  const std::string text = node.Text();
  for (std::string_view remaining = text;;) {
    const std::size_t end = std::min(remaining.find('/'), remaining.size());
    const std::string_view factor = remaining.substr(0, end);
    const std::string_view base = factor.substr(0, factor.find('^'));
    const auto unit = ParseUnit(base);
    if (!unit && std::ranges::find(kOtherUnits, base) == std::end(kOtherUnits)) {
      node.Fail(Quoted(text) + " is not a unit", kExpected);
    }
    if (unit && unit->factor != 1.0) node.Fail(Quoted(text) + " is not an SI unit", kExpected);
    if (end == remaining.size()) return;
    remaining.remove_prefix(end + 1);
  }
}

std::vector<std::pair<std::string, Node>> EntriesOf(const Node& entry, const char* key,
                                                    const char* example) {
  const auto map = entry.Find(key);
  if (!map) return {};
  map->ExpectMap(example);
  return map->Entries();
}

}  // namespace

FormulaKeys::FormulaKeys(const Node& entry, std::vector<const char*> declarations)
    : entry_(entry),
      declarations_(std::move(declarations)),
      units_(entry.Find("units")),
      definitions_(EntriesOf(entry, "let", "{NAME: EXPRESSION}")) {
  if (units_) units_->ExpectMap("{NAME: UNIT}");
  Program program(0);
  Scope scope(program);
  for (const auto& [name, node] : EntriesOf(entry, "constants", "{NAME: NUMBER}")) {
    Constant& constant = constants_.emplace_back(Constant{name, {}, node});
    const Value value = ParseExpression(node, scope);
    for (const int element : value.nodes) {
      const auto number = program.ConstantValue(element);
      if (!number) node.Fail("the constant has no finite value", "a number, such as 2 or 30deg");
      constant.values.push_back(*number);
    }
    scope.Declare(name, {value}, node);
  }
}

std::vector<Space> FormulaKeys::ReadSpaces(const char* key, unsigned flags) const {
  std::vector<Space> spaces;
  for (const auto& [name, node] : EntriesOf(entry_, key, "{NAME: GEOMETRY}")) {
    spaces.push_back(ReadSpace(name, node));
    spaces.back().flags = flags;
  }
  return spaces;
}

Space FormulaKeys::ReadSpace(const std::string& name, const Node& node) const {
  Space space;
  space.name = name;
  if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) {
      space.elements.push_back(item.Text());
      if (!IsIdentifier(space.elements.back()))
        item.Fail("'" + space.elements.back() + "' cannot name an element", "a name such as x");
    }
    if (space.elements.empty()) node.Fail("the list is empty", "the names of the elements");
    space.geometry = Geometry::Vector(static_cast<int>(space.elements.size()));
  } else {
    const std::vector<std::string> names = GeometryNames();
    const std::string text = node.Text();
    if (std::ranges::find(names, text) == names.end()) {
      node.Fail("'" + text + "' is not a geometry",
                Join(names) + ", or the list of the elements of a vector, such as [x, y]",
                Nearest(text, names));
    }
    for (const GeometryRow* row : detail::kGeometryRows) {
      if (text == row->name) space.geometry = Geometry(row->number);
    }
    space.elements = ElementsOf("", space.geometry);
  }
  space.unit = UnitOf(name, space.geometry);
  return space;
}

std::string FormulaKeys::UnitOf(const std::string& name, const Geometry& geometry) const {
  const auto unit = units_ ? units_->Find(name) : std::nullopt;
  if (!unit) return geometry.is_angle() ? "rad" : "";
  CheckUnit(*unit);
  return unit->Text();
}

void FormulaKeys::DeclareSpaces(const std::vector<Space>& spaces, int first, Scope& scope) const {
  for (const Space& space : spaces) {
    scope.Declare(space.name, {VariableOf(space, first)}, PlaceOf(space.name));
    first += space.geometry.ambient;
  }
}

Node FormulaKeys::PlaceOf(const std::string& name) const {
  for (const char* key : declarations_) {
    const auto map = entry_.Find(key);
    const auto node = map && map->is_map() ? map->Find(name) : std::nullopt;
    if (node) return *node;
  }
  return entry_;
}

void FormulaKeys::AddTo(Scope& scope) const {
  for (const Constant& constant : constants_) {
    Symbol symbol;
    for (const double value : constant.values)
      symbol.value.nodes.push_back(scope.program().Constant(value));
    scope.Declare(constant.name, std::move(symbol), constant.node);
  }
  for (const auto& [name, node] : definitions_) scope.Define(name, node);
}

void FormulaKeys::CheckDefinitions(Scope& scope) const {
  for (const auto& [name, node] : definitions_) static_cast<void>(scope.Find(name));
}

void FormulaKeys::CheckDefinitionsOfConstants() const {
  Program program(0);
  Scope scope(program);
  AddTo(scope);
  CheckDefinitions(scope);
}

void FormulaKeys::RejectUnread() const {
  if (units_) units_->RejectUnread();
}

Space Concatenated(const std::vector<Space>& spaces, const std::string& name) {
  if (spaces.size() == 1) return spaces[0];
  Space all;
  if (spaces.empty()) return all;
  all.name = name;
  all.elements = ColumnsOf(spaces);
  for (const Space& space : spaces) {
    if (&space == &spaces[0]) all.unit = space.unit;
    if (space.unit != all.unit) all.unit.clear();
  }
  all.geometry = Geometry::Vector(static_cast<int>(all.elements.size()));
  return all;
}

std::vector<std::string> ColumnsOf(const std::vector<Space>& spaces) {
  std::vector<std::string> columns;
  for (const Space& space : spaces) {
    for (const std::string& name : ColumnNames(space.name, space)) columns.push_back(name);
  }
  return columns;
}

Value VariableOf(const Space& space, int first) {
  Value value;
  value.geometry = space.geometry.row().number;
  for (int i = 0; i < space.geometry.ambient; ++i) value.nodes.push_back(first + i);
  const bool has_names = std::ssize(space.elements) == space.geometry.ambient;
  if (has_names && !space.elements[0].empty()) value.elements = space.elements;
  return value;
}

std::vector<Geometry> GeometriesOf(const std::vector<Space>& spaces) {
  std::vector<Geometry> geometries;
  for (const Space& space : spaces) geometries.push_back(space.geometry);
  return geometries;
}

std::string ExpressionText(const Node& node) {
  if (node.kind() != Node::Kind::kList) return node.Text();
  std::vector<std::string> items;
  for (const Node& item : node.Items()) items.push_back(item.Text());
  return '[' + Join(items) + ']';
}

}  // namespace alidade::internal
