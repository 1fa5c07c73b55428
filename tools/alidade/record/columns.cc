// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/columns.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/io/json.h"

namespace alidade::internal {

CsvFile CreateCsv(const OutputFolder& folder, const std::string& name, std::vector<Column> columns,
                  RunColumns& run_columns) {
  CsvFile file(folder, name, NamesOf(columns));
  run_columns[name] = std::move(columns);
  return file;
}

std::string ColumnsJson(const RunColumns& run_columns) {
  Json json = Json::object();
  for (const auto& [file, columns] : run_columns) {
    Json& list = json[file] = Json::array();
    for (const Column& column : columns) {
      Json& entry = list.emplace_back(Json{{"name", column.name}});
      if (!column.unit.empty()) entry["unit"] = column.unit;
      entry["quantity"] = column.quantity;
      if (!column.subject.empty()) entry["subject"] = column.subject;
    }
  }
  return JsonText(json);
}

}  // namespace alidade::internal
