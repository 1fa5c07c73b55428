// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"
#include "alidade/experiment/calibration.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kIndent = 4;

/// Describes the treatment of out-of-sequence frames. Returns "" for the default treatment.
std::string OutOfSequenceText(const OutOfSequencePolicy& handling) {
  if (handling.policy == OutOfSequence::kReject) return "";
  const bool buffer = handling.policy == OutOfSequence::kBuffer;
  const char* const action =
      buffer
          ? "buffer: frames are delayed"
          : "rollback: the estimators return to an earlier state and process all frames in order";
  return std::string("  out-of-sequence frames: ") + action +
         (handling.window ? "; a frame may be up to " + RoundedText(Seconds(*handling.window), 6) +
                                " s older than the newest frame"
                          : "; a frame may be of any age") +
         '\n';
}

/// Appends a row for each parameter in the calibration of the data: key, value and position in the
/// file.
void AddCalibration(const Node& map, const std::string& key, std::vector<TextRow>& rows) {
  for (const auto& [name, value] : map.Entries()) {
    const std::string path = key.empty() ? name : key + '.' + name;
    if (value.is_map()) {
      AddCalibration(value, path, rows);
      continue;
    }
    rows.push_back({path, ValueText(value), ToString(value.place())});
  }
}

std::string CalibrationText(const Config& config, const Source& source) {
  const Config calibrated = WithCalibration(config, source);
  const auto calibration = calibrated.root().Find("calibration");
  if (!calibration) return "";
  std::vector<TextRow> rows;
  AddCalibration(*calibration, "", rows);
  return "  calibration of the data\n" + TextTable(rows, kIndent);
}

/// Returns a table with a row for each key of the source that has a scalar value.
std::string SourceKeys(const Node& source) {
  std::vector<TextRow> rows;
  for (const auto& [key, value] : source.Entries()) {
    if (value.kind() != Node::Kind::kScalar || key == "type" || key == "seed") continue;
    rows.push_back({key, value.Text()});
  }
  return rows.empty() ? "" : "  keys\n" + TextTable(rows, kIndent);
}

}  // namespace

std::string ValueText(const Node& value) {
  std::vector<std::string> texts;
  for (const Node& item : value.ItemsOrOne()) texts.push_back(item.Text());
  return Join(texts);
}

std::vector<std::string> UsersOf(const Config& config, const std::string& stream) {
  std::vector<std::string> users;
  for (const auto& [name, sensor] : config.root().At("sensors").Entries()) {
    if (sensor.At("stream").Text() == stream) users.push_back(name);
  }
  for (const auto& [name, state] : config.root().At("state").Entries()) {
    const auto input = state.Find("input");
    if (input && input->At("stream").Text() == stream) users.push_back(name + " (input)");
  }
  return users;
}

std::string ExplainSource(const Config& config, const Experiment& experiment) {
  const Node source = config.root().At("source");
  std::string text = "source " + source.At("type").Text();
  text += ", seed " + std::to_string(experiment.seed) + '\n';
  std::vector<TextRow> rows = {{"stream", "size", "used by"}};
  for (const StreamInfo& stream : experiment.source->streams()) {
    const std::vector<std::string> users = UsersOf(config, stream.name);
    rows.push_back({stream.name, std::to_string(stream.size), users.empty() ? "-" : Join(users)});
  }
  const std::vector<std::string> truths = NamesOf(experiment.source->truths());
  text += TextTable(rows, kIndent) + SourceKeys(source);
  if (const std::string guide = experiment.source->guide_name(); !guide.empty()) {
    text += "  guide: filter '" + guide + "' predicts the search regions of the measurements\n";
  }
  return text + "  truth: " + (truths.empty() ? "not known" : Join(truths)) + '\n' +
         CalibrationText(config, *experiment.source) +
         OutOfSequenceText(experiment.out_of_sequence);
}

}  // namespace alidade::internal
