// SPDX-License-Identifier: Apache-2.0
#include "table_layout.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/config/unit.h"
#include "alidade/io/text_cell.h"
#include "data_unit.h"
#include "known_table.h"

namespace alidade {
namespace {

TableColumn ReadColumn(const Node& node) { return {node.Text(), node}; }

/// Calls `set(conversion, item)` for each column of the field: with the only item of `key`, or with
/// an item for each column.
template <class F>
void ReadForEachColumn(const Node& node, const char* key, TableField& field, const F& set) {
  const std::optional<Node> found = node.Find(key);
  if (!found) return;
  const std::vector<Node> items = found->ItemsOrOne();
  const std::size_t count = field.conversions.size();
  if (field.geodetic && items.size() == 1 && count == 3) {
    found->Fail("one value would apply to the angles and to the height",
                "a list with a value for each of latitude, longitude and height");
  }
  if (items.size() != 1 && items.size() != count) {
    found->Fail("a list of " + std::to_string(items.size()),
                "one value, or " + std::to_string(count) + ", one for each column");
  }
  for (std::size_t i = 0; i < count; ++i) {
    set(field.conversions[i], items[items.size() == 1 ? 0 : i]);
  }
}

void ReadUnit(const Node& node, Conversion& conversion) {
  const std::string name = node.Text();
  const std::optional<DataUnit> unit = ParseDataUnit(name);
  if (!unit) {
    node.Fail(
        "'" + name + "' is not a unit",
        std::string("a unit such as deg, deg/s, km/h, ft or mm/s^2, or one of ") + kDataUnits);
  }
  conversion.unit = unit->factor;
  conversion.unit_node = node;
}

double ReadGain(const Node& node) {
  const double gain = node.Number();
  if (gain == 0.0) {
    node.Fail("a gain of 0 sets all values to 0", "a number other than 0");
  }
  return gain;
}

/// Reads a number in `unit`, or a number with its own unit, such as `90deg`.
double ReadOffset(const Node& node, double unit) {
  const auto quantity = internal::ParseQuantity(node.Text());
  return quantity ? quantity->value * quantity->unit.factor : node.Number() * unit;
}

/// Reads `geodetic`. The columns of a geodetic position are in deg, deg and m, unless `unit` is
/// given.
void ReadGeodetic(const Node& node, TableField& field) {
  const std::optional<Node> geodetic = node.Find("geodetic");
  field.geodetic = geodetic && geodetic->Flag();
  if (!field.geodetic) return;
  const std::size_t count = field.columns.size();
  if (count < 2 || count > 3 || field.reciprocal) {
    geodetic->Fail("the position has " + std::to_string(count) + " columns" +
                       (field.reciprocal ? " of reciprocals" : ""),
                   "columns: latitude, longitude and perhaps height");
  }
  const double degree = ParseDataUnit("deg")->factor;
  for (std::size_t i = 0; i < 2; ++i) field.conversions[i].unit = degree;
}

/// Reads the conversions of the columns. The offset of a reciprocal is in SI units.
void ReadConversions(const Node& node, TableField& field) {
  field.conversions.resize(field.columns.size());
  if (const auto reciprocal = node.Find("reciprocal")) field.reciprocal = reciprocal->Flag();
  ReadGeodetic(node, field);
  ReadForEachColumn(node, "unit", field, [](auto& c, const Node& n) { ReadUnit(n, c); });
  ReadForEachColumn(node, "gain", field, [](auto& c, const Node& n) { c.gain = ReadGain(n); });
  ReadForEachColumn(node, "offset", field, [&](auto& c, const Node& n) {
    c.offset = ReadOffset(n, field.reciprocal ? 1.0 : c.unit);
  });
}

std::vector<RowCondition> ReadConditions(const Node& node) {
  std::vector<RowCondition> conditions;
  for (const auto& [name, values] : node.Entries()) {
    RowCondition& condition = conditions.emplace_back(RowCondition{{name, values}, {}});
    for (const Node& value : values.ItemsOrOne()) condition.texts.push_back(value.Text());
  }
  return conditions;
}

/// Returns the size of a covariance with `count` numbers and its form.
std::optional<std::pair<std::size_t, CovarianceColumns::Form>> FullCovariance(std::size_t count) {
  for (std::size_t size = 1; size * (size + 1) / 2 <= count; ++size) {
    if (size * size == count) return std::pair(size, CovarianceColumns::Form::kFull);
  }
  for (std::size_t size = 1; size * (size + 1) / 2 <= count; ++size) {
    if (size * (size + 1) / 2 == count) return std::pair(size, CovarianceColumns::Form::kUpper);
  }
  return std::nullopt;
}

/// Sets the factor by which the conversion of the values scales each standard deviation.
void ReadScale(const Node& key, const TableField& field, CovarianceColumns& covariance) {
  covariance.scale.assign(covariance.size, 1.0);
  if (field.geodetic) return;
  if (field.reciprocal) key.Fail("the values are reciprocals", "'reciprocal: false'");
  std::vector<double> scale;
  for (const Conversion& c : field.conversions) scale.push_back(std::abs(c.gain * c.unit));
  if (scale.empty()) return;
  const bool is_uniform = std::ranges::all_of(scale, [&](double s) { return s == scale[0]; });
  if (is_uniform) covariance.scale.assign(covariance.size, scale[0]);
  if (!is_uniform && scale.size() == covariance.size) covariance.scale = scale;
  if (!is_uniform && scale.size() != covariance.size) {
    key.Fail("the columns of the values have different units or gains",
             std::to_string(scale.size()) + " standard deviations, one for each column");
  }
}

void ReadCovariance(const Node& node, TableField& field) {
  using Form = CovarianceColumns::Form;
  constexpr std::pair<const char*, Form> kForms[] = {
      {"sigma", Form::kSigma}, {"variance", Form::kVariance}, {"covariance", Form::kFull}};
  for (const auto& [name, form] : kForms) {
    const std::optional<Node> key = node.Find(name);
    if (!key) continue;
    if (field.covariance) {
      key->Fail("the covariance is given twice", "one of sigma, variance and covariance");
    }
    CovarianceColumns covariance{form, ReadColumns(*key), 0, {}};
    const auto value_size = static_cast<std::size_t>(field.info.size);
    covariance.size = covariance.columns.size();
    if (form == Form::kFull) {
      const auto full = FullCovariance(covariance.size);
      if (!full) {
        key->Fail(std::to_string(covariance.size) + " columns are not a covariance",
                  "n^2 columns, or the n (n + 1) / 2 columns of the upper triangle, row by row");
      }
      std::tie(covariance.size, covariance.form) = *full;
    } else if (covariance.size == 1) {  // one number for all elements
      covariance.columns.resize(value_size, covariance.columns[0]);
      covariance.size = value_size;
    }
    ReadScale(*key, field, covariance);
    field.covariance = std::move(covariance);
  }
}

/// Reads the keys that only streams have, not true values.
void ReadStreamKeys(const Node& node, TableField& field) {
  const std::optional<Node> known = node.Find("known");
  if (known && known->is_map()) {
    field.known_table = ReadKnownTableKeys(*known);
  } else if (known) {
    field.known = ReadColumns(*known);
  }
  if (const auto landmark = node.Find("landmark")) field.landmark = ReadColumn(*landmark);
  if (const auto delay = node.Find("delay_s")) {
    field.delay = TimestampFromSeconds(delay->Number(0.0, 1e6, false, false, "s"));
  }
  if (const auto interval = node.Find("min_interval_s")) {
    field.min_interval = TimestampFromSeconds(interval->Number(0.0, 1e9, false, false, "s"));
  }
  ReadCovariance(node, field);
  const auto& columns = field.known_table ? field.known_table->columns : field.known;
  field.info.known = static_cast<int>(columns.size());
  if (field.covariance) field.info.covariance = static_cast<int>(field.covariance->size);
}

void ReadFieldMap(const std::string& name, const Node& node, bool is_stream, TableField& field) {
  const std::optional<Node> constant = is_stream ? node.Find("constant") : std::nullopt;
  if (constant) {
    if (const auto columns = node.Find("columns")) {
      columns->Fail("'columns' and 'constant' are both given", "only one of these keys");
    }
    field.constant = constant->Numbers();
  } else {
    field.columns = ReadColumns(node.At("columns", name));
  }
  field.info.size = static_cast<int>(constant ? field.constant.size() : field.columns.size());
  if (!constant) ReadConversions(node, field);
  if (const auto rows = node.Find("rows")) field.conditions = ReadConditions(*rows);
  if (const auto valid = node.Find("valid")) field.valid = ReadColumn(*valid);
  if (is_stream) ReadStreamKeys(node, field);
  node.RejectUnread();
}

TableField ReadField(const std::string& name, const Node& node, bool is_stream, Timestamp delay) {
  TableField field;
  field.info.name = name;
  field.delay = delay;
  if (node.is_map()) {
    ReadFieldMap(name, node, is_stream, field);
    return field;
  }
  field.columns = ReadColumns(node);
  field.conversions.resize(field.columns.size());
  field.info.size = static_cast<int>(field.columns.size());
  return field;
}

/// Reads the keys of the times. Returns the default delay of the streams.
Timestamp ReadTime(const Node& entry, TableTime& time) {
  if (const auto gap = entry.Find("max_gap_s")) {
    time.max_gap = TimestampFromSeconds(gap->Number(0.0, 9e9, true, false, "s"));
  }
  if (const auto policy = entry.Find("on_gap")) {
    time.skips_gaps = policy->Choice({"fail", "skip"}) == 1;
    if (!time.max_gap) {
      policy->Fail("this key has no effect without 'max_gap_s'", "the key 'max_gap_s', too");
    }
  }
  const std::optional<Node> node = entry.Find("time");
  const std::optional<Node> rate = entry.Find("rate_hz");
  if (rate) {
    for (const char* const key : {"time", "max_gap_s"}) {
      if (!entry.Find(key)) continue;
      rate->Fail("'" + std::string(key) + "' and 'rate_hz' are both given",
                 "only one of these keys");
    }
    time.rate_hz = rate->Number(1e-3, 1e9);
    return 0;
  }
  time.column = TableColumn{"t_s", node.value_or(entry)};
  if (!node) return 0;
  const bool is_text = node->kind() == Node::Kind::kScalar;
  node->ExpectMap("{column: " + (is_text ? node->Text() : "t_s") + '}');
  if (const auto column = node->Find("column")) time.column = ReadColumn(*column);
  if (const auto unit = node->Find("unit")) {
    const int thousands = unit->Choice({"s", "ms", "us", "ns"});
    time.digits = static_cast<std::size_t>(9 - 3 * thousands);
  }
  if (const auto offset = node->Find("offset_s")) {
    time.offset =
        TimestampFromSeconds(offset->Number(-cell::kTimeLimit, cell::kTimeLimit, true, true, "s"));
  }
  if (const auto repeats = node->Find("repeats")) time.repeats = repeats->Flag();
  const std::optional<Node> delay = node->Find("delay_s");
  node->RejectUnread();
  return delay ? TimestampFromSeconds(delay->Number(0.0, 1e6, false, false, "s")) : 0;
}

char ReadSeparator(const Node& node) {
  const std::string text = node.Text();
  const bool part_of_number = text.find_first_of("+-.#\"\r\n0123456789eE") != std::string::npos;
  if (text.size() != 1 || part_of_number) {
    node.Fail("this text is not a valid separator",
              "one character that does not occur in numbers, such as ';' or \"\\t\"");
  }
  return text[0];
}

/// Reads the text of a cell that marks a missing value.
std::string ReadMissing(const Node& word) {
  const std::string text = word.Text();
  if (text == ".nan" || text == ".NaN" || text == ".NAN") {
    word.Fail("'" + text + "' cannot be the text of a cell", "the text that the table contains",
              text.substr(1));
  }
  return text;
}

void ReadBlind(const Node& entry, TableLayout& layout) {
  const std::optional<Node> after = entry.Find("blind_after");
  const std::optional<Node> blind = entry.Find("blind");
  if (!after) {
    if (blind) {
      blind->Fail("this key has no effect without 'blind_after'", "the key 'blind_after', too");
    }
    return;
  }
  layout.blind_after_node = after;
  layout.blind_after = after->Number(0.0, 1.0);
  if (!blind && !layout.streams.empty()) layout.streams.front().goes_blind = true;
  for (const Node& item : blind ? blind->ItemsOrOne() : std::vector<Node>{}) {
    std::vector<std::string> names;
    for (const TableField& stream : layout.streams) names.push_back(stream.info.name);
    const auto found = std::find(names.begin(), names.end(), item.Text());
    if (found == names.end()) {
      item.Fail("there is no stream '" + item.Text() + "'", "one of " + internal::Join(names),
                Nearest(item.Text(), names));
    }
    layout.streams[static_cast<std::size_t>(found - names.begin())].goes_blind = true;
  }
}

/// Returns true if all names of a header are numbers, which means that the header is missing.
bool AreNumbers(const std::vector<std::string>& names) {
  double value = 0.0;
  return std::ranges::all_of(
      names, [&](const std::string& name) { return cell::ParseNumber(name, value) == nullptr; });
}

/// Finds a column in `names`, the header of `file`.
void Resolve(const std::vector<std::string>& names, const std::string& file, TableColumn& column) {
  constexpr std::size_t kListed = 20;
  const auto found = std::find(names.begin(), names.end(), column.name);
  if (found == names.end() && AreNumbers(names)) {
    column.node.Fail("there is no column '" + column.name + "' in " + file +
                         ", because its first line contains numbers, not names",
                     "a first line that names the columns, as in 't_s,depth', or 'columns: [t_s, "
                     "depth]' in the config");
  }
  double number = 0.0;
  if (found == names.end() && cell::ParseNumber(column.name, number) == nullptr) {
    column.node.Fail("'" + column.name + "' is a number, not a column of " + file,
                     "the name of a column; a constant noise belongs to the sensor, as in "
                     "'sigma_m: 0.1'");
  }
  if (found == names.end()) {
    std::string expected = "one of ";
    for (std::size_t i = 0; i < std::min(names.size(), kListed); ++i) {
      expected += (i > 0 ? ", " : "") + cell::PrintableStart(names[i]);
    }
    if (names.size() > kListed) expected += ", ...";
    column.node.Fail("there is no column '" + column.name + "' in " + file, expected,
                     cell::PrintableStart(Nearest(column.name, names)));
  }
  if (std::find(found + 1, names.end(), column.name) != names.end()) {
    column.node.Fail(file + " has two columns '" + column.name + "'", "one column with this name");
  }
  column.index = static_cast<std::size_t>(found - names.begin());
}

/// Calls `visit` with each column of the table that the config names.
template <class Layout, class F>
void ForEachColumn(Layout& layout, const F& visit) {
  const auto visit_all = [&](auto& columns) {
    for (auto& column : columns) visit(column);
  };
  const auto visit_optional = [&](auto& column) {
    if (column) visit(*column);
  };
  visit_optional(layout.time.column);
  for (auto* fields : {&layout.streams, &layout.truths}) {
    for (auto& field : *fields) {
      visit_all(field.columns);
      if (field.covariance) visit_all(field.covariance->columns);
      visit_all(field.known);
      if (field.known_table) visit(field.known_table->id);
      visit_optional(field.landmark);
      visit_optional(field.valid);
      for (auto& condition : field.conditions) visit(condition.column);
    }
  }
}

}  // namespace

std::vector<TableColumn> ReadColumns(const Node& node) {
  std::vector<TableColumn> columns;
  for (const Node& column : node.ItemsOrOne()) columns.push_back(ReadColumn(column));
  if (columns.empty()) {
    node.Fail("the list is empty", "the name of a column, or a list of names");
  }
  return columns;
}

TableLayout ReadTableLayout(const Node& entry) {
  TableLayout layout{entry, {}, {}, {}, {}, '\0', {""}, {}, 1.0};
  for (const char* key : {"path", "time", "rate_hz", "max_gap_s", "on_gap", "streams", "truth",
                          "columns", "separator", "missing", "blind_after", "blind"}) {
    entry.Declare(key);
  }
  const Timestamp delay = ReadTime(entry, layout.time);
  const std::optional<Node> streams = entry.Find("streams");
  if (streams) {
    for (const auto& [name, node] : streams->Entries()) {
      layout.streams.push_back(ReadField(name, node, true, delay));
    }
    if (layout.streams.empty())
      streams->Fail("the map is empty", "a map such as 'disparity: disparity_px'");
  }
  if (const auto truth = entry.Find("truth")) {
    for (const auto& [name, node] : truth->Entries()) {
      layout.truths.push_back(ReadField(name, node, false, 0));
    }
  } else if (!streams) {
    static_cast<void>(entry.At("streams", "tables"));
  }
  if (const auto columns = entry.Find("columns")) {
    for (const TableColumn& column : ReadColumns(*columns)) layout.columns.push_back(column.name);
  }
  if (const auto separator = entry.Find("separator")) {
    layout.separator = ReadSeparator(*separator);
  }
  if (const auto missing = entry.Find("missing")) {
    for (const Node& word : missing->ItemsOrOne()) layout.missing.push_back(ReadMissing(word));
  }
  ReadBlind(entry, layout);
  return layout;
}

std::size_t CountColumns(const std::vector<std::string>& names, const TableLayout& layout) {
  std::size_t count = 0;
  ForEachColumn(layout, [&](const TableColumn& column) {
    if (std::ranges::find(names, column.name) != names.end()) ++count;
  });
  return count;
}

void ResolveColumns(const std::vector<std::string>& names, const std::string& file,
                    TableLayout& layout) {
  ForEachColumn(layout, [&](TableColumn& column) { Resolve(names, file, column); });
}

}  // namespace alidade
