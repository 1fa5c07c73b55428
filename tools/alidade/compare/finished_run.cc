// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/finished_run.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/compare/json_node.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/io/number_rows.h"
#include "alidade/io/run_files.h"
#include "alidade/io/text_cell.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string TextOf(const JsonNode& map, const char* key) {
  const auto node = map.Find(key);
  return node ? node->Text() : "";
}

/// Parses the cells of a row. The row does not contain quotes. An empty cell becomes NaN.
std::vector<double> NumbersOf(std::string_view row, const fs::path& file, int line) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= row.size();) {
    const std::size_t end = std::min(row.find(',', begin), row.size());
    double value = kNan;
    const char* const last = row.data() + end;
    const auto [parsed_end, error] = std::from_chars(row.data() + begin, last, value);
    if (end > begin && (error != std::errc() || parsed_end != last))
      FailFile(file, line, "a cell is not a number");
    numbers.push_back(value);
    begin = end + 1;
  }
  return numbers;
}

Timestamp TimestampOf(std::string_view row, const fs::path& file, int line) {
  const std::string_view text = row.substr(0, row.find(','));
  double value = 0.0;
  if (const char* const defect = cell::ParseNumber(text, value))
    FailFile(file, line, std::string("t_s '") + cell::PrintableStart(text) + "' " + defect);
  if (!(std::abs(value) < cell::kTimeLimit))
    FailFile(file, line, "t_s '" + cell::PrintableStart(text) + "' is out of range");
  return cell::ParseTimestamp(text, value, 9);
}

/// Column indices of the values and sigmas in estimates.csv, in the order of the series.
struct EstimateCells {
  std::size_t columns = 0;
  std::vector<std::size_t> values, sigmas;
};

/// Finds the columns of the blocks. `columns` is the entry of estimates.csv in columns.json.
EstimateCells FindCells(const JsonNode& columns, const std::vector<SeriesBlock>& blocks,
                        const fs::path& file) {
  EstimateCells cells;
  std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> found;
  for (const JsonNode& column : columns.Items()) {
    found[{TextOf(column, "subject"), column.At("quantity").Text()}].push_back(cells.columns++);
  }
  const auto append = [&](const SeriesBlock& block, const char* quantity, int size,
                          std::vector<std::size_t>& list) {
    const std::vector<std::size_t>& places = found[{block.name, quantity}];
    if (std::ssize(places) != size) {
      FailFile(file, 0, "the columns of block '" + block.name + "' do not match run.json");
    }
    list.insert(list.end(), places.begin(), places.end());
  };
  for (const SeriesBlock& block : blocks) {
    append(block, "value", block.geometry.ambient, cells.values);
    append(block, "sigma", block.geometry.tangent, cells.sigmas);
  }
  return cells;
}

void AppendRow(Series& series, const EstimateCells& cells, const std::vector<double>& row) {
  for (const std::size_t cell : cells.values) series.values.push_back(row[cell]);
  for (const std::size_t cell : cells.sigmas) series.covariances.push_back(row[cell] * row[cell]);
}

/// Reads estimates.csv. Returns the number of rows with nan or inf. An empty cell represents a
/// missing value and does not count.
std::int64_t ReadEstimates(const fs::path& file, const EstimateCells& cells, std::int64_t rows,
                           Series& series) {
  std::int64_t not_finite = 0;
  std::ifstream stream = OpenFile(file);
  std::string line;
  std::getline(stream, line);
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::vector<double> row = NumbersOf(line, file, number);
    if (row.size() != cells.columns)
      FailFile(file, number, "the number of columns differs from columns.json");
    if (stream.eof()) FailFile(file, number, "the last line is incomplete");
    series.timestamps.push_back(TimestampOf(line, file, number));
    AppendRow(series, cells, row);
    not_finite += line.find_first_of("nN") != line.npos ? 1 : 0;  // the row contains nan or inf
  }
  if (std::ssize(series.timestamps) != rows) {
    FailFile(file, 0,
             "the file has " + std::to_string(series.timestamps.size()) +
                 " rows, but run.json records " + std::to_string(rows) + " rows");
  }
  return not_finite;
}

/// Reads the joint covariances P if the file exists and P is not too large. The covariances replace
/// the variances of the series.
void ReadCovariances(const fs::path& file, Series& series) {
  if (series.tangent() > Series::kMaxJoint || !fs::exists(file)) return;
  series.joint = true;
  RequireFile(file);
  std::vector<double> cells(series.cells() * series.timestamps.size());
  const auto bytes = static_cast<std::streamsize>(8 * cells.size());
  if (fs::file_size(file) != static_cast<std::uintmax_t>(bytes)) {
    FailFile(file, 0, "the size does not match the number of rows of estimates.csv");
  }
  OpenFile(file).read(reinterpret_cast<char*>(cells.data()), bytes);
  series.covariances = std::move(cells);
}

Geometry GeometryOf(const JsonNode& block) {
  const int size = static_cast<int>(block.At("size").Count(1'000'000));
  std::vector<Geometry> geometries;
  std::vector<std::string> names;
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->number == ALIDADE_PRODUCT) continue;  // only a measurement can be a product
    geometries.emplace_back(row->number, size);
    names.emplace_back(row->name);
  }
  return geometries[static_cast<std::size_t>(block.At("geometry").Choice(names))];
}

std::vector<SeriesBlock> ReadBlocks(const JsonNode& entry) {
  std::vector<SeriesBlock> blocks;
  for (const JsonNode& block : entry.At("blocks").Items()) {
    blocks.push_back({block.At("name").Text(), TextOf(block, "unit"), GeometryOf(block)});
  }
  return blocks;
}

Verdict VerdictOf(const JsonNode& entry) {
  std::vector<std::string> names;
  for (const VerdictInfo& info : kVerdicts) names.emplace_back(info.name);
  Verdict verdict;
  verdict.state = static_cast<VerdictState>(entry.At("state").Choice(names));
  verdict.because = entry.At("because").Text();
  return verdict;
}

EstimatorResult ReadResult(const std::string& name, const JsonNode& entry) {
  EstimatorResult result;
  result.name = name;
  result.type = TextOf(entry, "type");
  using enum EstimatorKind;
  result.kind = static_cast<EstimatorKind>(entry.At("kind").Choice(
      {ToString(kFilter), ToString(kSmoother), ToString(kBatch), ToString(kSlidingWindow)}));
  result.smoothed = entry.At("smoothed").Flag();
  result.accepted_by = TextOf(entry, "accepted_by");
  result.overrides = TextOf(entry, "overrides");
  result.sensors = entry.At("sensors").Texts();
  result.position_block = TextOf(entry, "position_block");
  result.failed = entry.At("failed").Flag();
  for (const auto& [key, value] : entry.At("metrics").Entries()) {
    if (key == "diverged") {
      result.diverged = value.Flag();
    } else {
      result.metrics[key] = value.Number();
    }
  }
  result.verdict = VerdictOf(entry.At("verdict"));
  for (const auto& [key, value] : entry.At("counts").Entries()) {
    result.counts[key] = value.Count();
  }
  for (const auto& [key, value] : entry.At("units").Entries()) result.units[key] = value.Text();
  for (const JsonNode& direction : entry.At("unobservable").Items()) {
    result.unobservable.push_back(direction.Texts());
  }
  return result;
}

/// Reads the landmarks of the final state. Skips landmarks that were removed during the run.
std::vector<LandmarkEstimate> ReadMap(const fs::path& file) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  RequireFile(file);
  std::vector<LandmarkEstimate> map;
  NumberRows rows(file, Place{file.string()}, {});
  std::map<std::string, std::size_t, std::less<>> columns;
  rows.Next();
  for (std::size_t i = 0; i < rows.size(); ++i) columns.emplace(rows.text(i), i);
  for (const char* name : {"id", "generation", "x", "y", "z", "status"}) {
    if (!columns.contains(name))
      FailFile(file, 1, std::string("the column '") + name + "' is missing");
  }
  while (rows.Next()) {
    if (rows.size() < columns.size()) FailFile(file, rows.line(), "the row has too few columns");
    if (rows.text(columns.at("status")) == "removed") continue;
    LandmarkEstimate& landmark = map.emplace_back();
    landmark.id = rows.Index(columns.at("id"), "id");
    landmark.generation = static_cast<int>(rows.Index(columns.at("generation"), "generation"));
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t cell = columns.at(kAxes[i]);
      const bool is_empty = rows.text(cell).empty();
      landmark.position[static_cast<Eigen::Index>(i)] =
          is_empty ? kNan : rows.Number(cell, kAxes[i]);
    }
  }
  return map;
}

std::int64_t CountOf(const EstimatorResult& result, const std::vector<std::string>& outcomes) {
  std::int64_t sum = 0;
  for (const auto& [key, count] : result.counts) {
    const MetricKey parsed = MetricKey::Parse(key);
    if (!parsed.subject.empty() && std::ranges::count(outcomes, parsed.name) > 0) sum += count;
  }
  return sum;
}

}  // namespace

std::int64_t Candidate::measurements() const {
  return CountOf(result, internal::NamesOf(kOutcomes));
}

std::int64_t Candidate::used() const {
  return CountOf(result, {ToString(Outcome::kAccepted), ToString(Outcome::kInitialised)});
}

Json ReadRunJson(const fs::path& folder) {
  if (fs::exists(folder / "sweep.json")) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{folder.string()}, {}, "this is the folder of a sweep",
                          "folders that `alidade run` has written"));
  }
  const fs::path file = folder / "run.json";
  Json json = ReadJsonFile(file);
  if (JsonNode(json, file.string()).At("status").Text() == "running") {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{folder.string()}, {}, "the run is not finished", "a finished run"));
  }
  return json;
}

ComparedRun ReadRun(const fs::path& folder) {
  ComparedRun run;
  run.folder = folder;
  const fs::path run_file = folder / "run.json", timing_file = folder / "timing.json";
  const Json run_json = ReadRunJson(folder);
  const JsonNode root(run_json, run_file.string());
  const Json timing_json = ReadJsonFile(timing_file);
  const JsonNode timing(timing_json, timing_file.string());
  const fs::path columns_file = folder / "columns.json";
  const Json columns_json = ReadJsonFile(columns_file);
  const JsonNode columns(columns_json, columns_file.string());
  run.status = static_cast<RunStatus>(root.At("status").Choice({"ok", "stopped", "failed"}));
  run.reason = root.At("reason").Text();
  run.reference = root.At("reference").Text();
  run.frames = root.At("frames").Count();
  const auto data = root.Find("data");
  if (!data) FailFile(run_file, 0, "the hashes of the data are missing");
  run.measurements_sha256 = data->At("measurements").Text();
  run.truth_sha256 = TextOf(*data, "truth");
  for (const auto& [name, entry] : root.At("estimators").Entries()) {
    Candidate& candidate = run.estimators.emplace_back();
    candidate.result = ReadResult(name, entry);
    candidate.result.wall_s = timing.At("estimators").At(name).At("wall_s").Number();
    candidate.series.blocks = ReadBlocks(entry);
    candidate.series.joint = false;
    candidate.had_rejection_recovery =
        entry.At("events").Find(ToString(EventKind::kRejectionRecovery)).has_value();
    const std::string estimates = name + "/estimates.csv";
    const EstimateCells cells =
        FindCells(columns.At(estimates), candidate.series.blocks, columns_file);
    candidate.not_finite_rows =
        ReadEstimates(folder / estimates, cells, entry.At("rows").Count(), candidate.series);
    ReadCovariances(folder / name / "covariance.bin", candidate.series);
    const fs::path map = folder / name / "landmarks.csv";
    if (fs::exists(map)) candidate.result.landmarks = ReadMap(map);
  }
  return run;
}

}  // namespace alidade::internal
