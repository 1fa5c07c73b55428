// SPDX-License-Identifier: Apache-2.0
#include "csv_layout.h"

#include <algorithm>

#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

CsvField ReadField(const std::string& name, const Node& node, bool has_known) {
  CsvField field;
  field.info.name = name;
  Node columns = node;
  if (node.is_map()) {
    columns = node.At("columns", name);
    if (const auto reciprocal = node.Find("reciprocal")) field.reciprocal = reciprocal->Flag();
    if (const auto gain = node.Find("gain")) {
      field.gain = gain->Number();
      if (field.gain == 0.0) {
        gain->Fail("a gain of 0 sets all values to 0", "a number other than 0");
      }
    }
    if (const auto known = has_known ? node.Find("known") : std::nullopt) {
      for (const Node& column : known->ItemsOrOne()) field.known.push_back({column.Text(), column});
    }
    node.RejectUnread();
  }
  for (const Node& column : columns.ItemsOrOne()) field.columns.push_back({column.Text(), column});
  if (field.columns.empty()) {
    columns.Fail("the list is empty", "the name of a column, or a list of names");
  }
  field.info.size = static_cast<int>(field.columns.size());
  field.info.known = static_cast<int>(field.known.size());
  return field;
}

std::vector<CsvField> ReadFields(const Node& map, bool has_known) {
  std::vector<CsvField> fields;
  for (const auto& [name, node] : map.Entries()) fields.push_back(ReadField(name, node, has_known));
  return fields;
}

void ReadTime(const Node& entry, CsvLayout& layout) {
  const std::optional<Node> time = entry.Find("time");
  const std::optional<Node> rate = entry.Find("rate_hz");
  if (rate) {
    if (time) rate->Fail("'time' and 'rate_hz' are both given", "only one of these keys");
    layout.rate_hz = rate->Number(1e-3, 1e9);
    return;
  }
  layout.time = CsvColumn{"t_s", time.value_or(entry)};
  if (!time) return;
  if (const auto column = time->Find("column")) layout.time = CsvColumn{column->Text(), *column};
  if (const auto unit = time->Find("unit")) {
    const int thousands = unit->Choice({"s", "ms", "us", "ns"});
    layout.time_digits = static_cast<std::size_t>(9 - 3 * thousands);
  }
  if (const auto repeats = time->Find("repeats")) layout.time_repeats = repeats->Flag();
  time->RejectUnread();
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

void ReadBlind(const Node& entry, CsvLayout& layout) {
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
  if (!blind) layout.streams.front().goes_blind = true;
  for (const Node& item : blind ? blind->ItemsOrOne() : std::vector<Node>{}) {
    std::vector<std::string> names;
    for (const CsvField& stream : layout.streams) names.push_back(stream.info.name);
    const auto found = std::find(names.begin(), names.end(), item.Text());
    if (found == names.end()) {
      std::string known;
      for (const std::string& name : names) known += (known.empty() ? "one of " : ", ") + name;
      item.Fail("there is no stream '" + item.Text() + "'", known, Nearest(item.Text(), names));
    }
    layout.streams[static_cast<std::size_t>(found - names.begin())].goes_blind = true;
  }
}

/// Returns the remedy `, or 'source.separator: ";"'` if the header has a single name that contains
/// another separator. Otherwise returns "".
std::string OtherSeparator(const std::vector<std::string>& names) {
  if (names.size() != 1) return {};
  for (const char separator : {';', '\t', '|', ',', ' '}) {
    if (names[0].find(separator) == std::string::npos) continue;
    const std::string text = separator == '\t' ? "\\t" : std::string(1, separator);
    return ", or 'source.separator: \"" + text + "\"'";
  }
  return {};
}

/// Returns true if all names of a header are numbers, which means that the header is missing.
bool AreNumbers(const std::vector<std::string>& names) {
  double value = 0.0;
  return std::ranges::all_of(
      names, [&](const std::string& name) { return cell::ParseNumber(name, value) == nullptr; });
}

/// Finds a column in `names`, the header of `file`.
void Resolve(const std::vector<std::string>& names, const std::string& file, CsvColumn& column) {
  constexpr std::size_t kListed = 20;
  const auto found = std::find(names.begin(), names.end(), column.name);
  if (found == names.end() && AreNumbers(names)) {
    column.node.Fail("there is no column '" + column.name + "' in " + file +
                         ", because its first line contains numbers, not names",
                     "a first line that names the columns, as in 't_s,depth'");
  }
  if (found == names.end()) {
    std::string expected = "one of ";
    for (std::size_t i = 0; i < std::min(names.size(), kListed); ++i) {
      expected += (i > 0 ? ", " : "") + cell::PrintableStart(names[i]);
    }
    if (names.size() > kListed) expected += ", ...";
    const std::string remedy = OtherSeparator(names);
    column.node.Fail("there is no column '" + column.name + "' in " + file, expected + remedy,
                     remedy.empty() ? cell::PrintableStart(Nearest(column.name, names)) : "");
  }
  if (std::find(found + 1, names.end(), column.name) != names.end()) {
    column.node.Fail(file + " has two columns '" + column.name + "'", "one column with this name");
  }
  column.index = static_cast<std::size_t>(found - names.begin());
}

}  // namespace

CsvLayout ReadCsvLayout(const Node& entry) {
  CsvLayout layout;
  for (const char* key : {"path", "time", "rate_hz", "streams", "truth", "separator", "missing",
                          "blind_after", "blind"}) {
    entry.Declare(key);
  }
  const Node streams = entry.At("streams", "csv");
  layout.streams = ReadFields(streams, true);
  if (layout.streams.empty())
    streams.Fail("the map is empty", "a map such as 'disparity: disparity_px'");
  if (const auto truth = entry.Find("truth")) layout.truths = ReadFields(*truth, false);
  ReadTime(entry, layout);
  if (const auto separator = entry.Find("separator")) {
    layout.separator = ReadSeparator(*separator);
  }
  if (const auto missing = entry.Find("missing")) {
    layout.missing.clear();
    for (const Node& word : missing->ItemsOrOne()) layout.missing.push_back(ReadMissing(word));
  }
  ReadBlind(entry, layout);
  return layout;
}

void ResolveColumns(const std::vector<std::string>& names, const std::string& file,
                    CsvLayout& layout) {
  if (layout.time) Resolve(names, file, *layout.time);
  for (std::vector<CsvField>* fields : {&layout.streams, &layout.truths}) {
    for (CsvField& field : *fields) {
      for (CsvColumn& column : field.columns) Resolve(names, file, column);
      for (CsvColumn& column : field.known) Resolve(names, file, column);
    }
  }
}

}  // namespace alidade
