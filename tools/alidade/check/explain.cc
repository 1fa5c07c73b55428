// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/explain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/io/text_table.h"

namespace alidade {
namespace {

using internal::Join;
using internal::NumberText;
using internal::TextRow;
using internal::TextTable;

constexpr std::size_t kIndent = 4;

const char* StatusText(BlockStatus status) {
  switch (status) {
    case BlockStatus::kEstimated:
      return "estimated";
    case BlockStatus::kConsider:
      return "consider";
    case BlockStatus::kConstant:
      break;
  }
  return "constant";
}

/// Formats values as a list. A single value is formatted as a number. With `merge_equal`, equal
/// values are formatted as one number.
std::string ListText(const std::vector<double>& values, bool merge_equal = false) {
  const bool equal = std::equal(values.begin() + 1, values.end(), values.begin());
  if (values.size() == 1 || (merge_equal && equal)) return NumberText(values[0]);
  std::vector<std::string> parts;
  for (const double value : values) parts.push_back(NumberText(value));
  return '[' + Join(parts) + ']';
}

std::string SigmasText(const Eigen::MatrixXd& covariance) {
  std::vector<double> sigmas;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    // Six digits hide the rounding error of sigma -> variance -> sigma.
    char sigma[32];
    std::snprintf(sigma, sizeof(sigma), "%.6g", std::sqrt(covariance(i, i)));
    sigmas.push_back(std::strtod(sigma, nullptr));
  }
  return ListText(sigmas, true);
}

std::string PriorText(const Prior& prior, const Block& block) {
  const bool measured = !prior.sensor.empty();
  std::string text = measured ? "first measurement of " + prior.sensor : ListText(prior.mean);
  if (block.status == BlockStatus::kConstant) return text + ", exact";
  if (measured) return text;
  return text + " +- " + SigmasText(prior.covariance);
}

/// Returns a table of the blocks. Below the table, a line explains the status `constant` if a block
/// has it, and one line for each unused truth states the reason.
std::string StateTable(const Problem& problem, const std::vector<StreamInfo>& truths) {
  const std::vector<int> block_truths = internal::MatchTruths(problem.layout, truths);
  std::vector<TextRow> rows = {
      {"block", "geometry", "size", "unit", "owner", "status", "truth", "starts from"}};
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    const Geometry& geometry = block.geometry();
    std::string size = std::to_string(geometry.ambient);
    if (geometry.tangent != geometry.ambient) {
      size.append(" (").append(std::to_string(geometry.tangent)).append(" free)");
    }
    const int truth_index = block_truths[static_cast<std::size_t>(prior.block)];
    rows.push_back({block.name, geometry.name(), size, block.space.unit, block.owner,
                    StatusText(block.status),
                    truth_index >= 0 ? truths[static_cast<std::size_t>(truth_index)].name
                    : truths.empty() ? ""
                                     : "-",
                    PriorText(prior, block)});
  }
  std::string text = TextTable(rows, kIndent);
  const auto is_fixed = [](const Block& block) { return block.status == BlockStatus::kConstant; };
  if (std::ranges::any_of(problem.layout.blocks(), is_fixed)) {
    text += "    constant: the value is known exactly and never changes; it has no covariance\n";
  }
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const std::string reason = internal::WhyNoBlock(problem.layout, truths, t);
    if (!reason.empty()) text += "    truth " + truths[t].name + " is not used: " + reason + '\n';
  }
  return text;
}

/// Returns the control input of a motion model, as in `speed <- odom, up to 0.2 s old`.
std::string InputText(const MotionBinding& motion) {
  if (!motion.model->has_input()) return "none";
  const InputBinding& input = motion.input;
  return motion.model->input().name + " <- " + input.stream +
         (std::isfinite(input.timeout_s) ? ", up to " + NumberText(input.timeout_s) + " s old"
                                         : "");
}

/// Returns a line for a state or sensor entry whose noise is a covariance in the config. Otherwise
/// returns "".
std::string ConfigNoise(const std::string& name, const std::vector<double>& root, int size) {
  if (root.empty()) return "";
  const RowMajor l = Eigen::Map<const RowMajor>(root.data(), size, size);
  return "    noise of " + name + ": covariance from the config, with sigma " +
         SigmasText(l * l.transpose()) + '\n';
}

std::string MotionTable(const Problem& problem) {
  const bool has_input = std::ranges::any_of(
      problem.motions, [](const MotionBinding& motion) { return motion.model->has_input(); });
  std::vector<TextRow> rows = {{"entry", "model", "moves", "noise inputs"}};
  if (has_input) rows[0].emplace_back("control input");
  std::string noise_text;
  for (const MotionBinding& motion : problem.motions) {
    std::vector<std::string> blocks;
    for (const BlockId id : motion.blocks) {
      if (problem.layout[id].status == BlockStatus::kConstant) continue;
      blocks.push_back(problem.layout[id].name);
    }
    const int noise = motion.model->noise_size();
    const char* const kind = motion.model->discrete_noise() ? " discrete" : " continuous";
    rows.push_back({motion.name, motion.model->name(), blocks.empty() ? "none" : Join(blocks),
                    noise == 0 ? "none" : std::to_string(noise) + kind});
    if (has_input) rows.back().push_back(InputText(motion));
    noise_text += ConfigNoise(motion.name, motion.model->description().sqrt_noise, noise);
  }
  return TextTable(rows, kIndent) + noise_text;
}

const char* ModeText(RoleMode mode) {
  switch (mode) {
    case RoleMode::kEstimate:
      return "estimate";
    case RoleMode::kConsider:
      return "consider";
    case RoleMode::kKnown:
      break;
  }
  return "known";
}

std::string SensorTable(const Problem& problem) {
  std::vector<TextRow> rows = {
      {"sensor", "stream", "model", "role", "block", "mode", "jacobian_at"}};
  std::string noise_text;
  for (const SensorBinding& sensor : problem.sensors) {
    TextRow sensor_columns = {sensor.name, sensor.stream, sensor.model->name()};
    noise_text += ConfigNoise(sensor.name, sensor.model->description().sqrt_noise,
                              sensor.model->measurement().geometry.tangent);
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const RoleBinding& role = sensor.roles[i];
      TextRow row = std::exchange(sensor_columns, TextRow(3));
      row.push_back(sensor.model->roles()[i].name);
      if (sensor.model->roles()[i].landmark()) {
        row.insert(row.end(), {"landmarks", ModeText(RoleMode::kEstimate), "prediction"});
      } else if (role.block < 0) {
        row.insert(row.end(), {"(unbound)", "", ""});
      } else {
        const bool prediction = role.jacobian_at == JacobianAt::kPrediction;
        row.insert(row.end(), {problem.layout[role.block].name, ModeText(role.mode),
                               prediction ? "prediction" : "measurement"});
      }
      rows.push_back(std::move(row));
    }
  }
  return TextTable(rows, kIndent) + noise_text;
}

/// Returns the effect of a sensor on the block that is bound to a role.
const char* EffectText(const Block& block, RoleMode mode) {
  if (block.status == BlockStatus::kConstant || mode == RoleMode::kKnown) return "knows";
  const bool considers = block.status == BlockStatus::kConsider || mode == RoleMode::kConsider;
  return considers ? "considers" : "corrects";
}

/// Returns a table of effects with a row for each block and a column for each motion entry and
/// sensor.
std::string EffectTable(const Problem& problem) {
  std::vector<TextRow> rows(1 + problem.layout.blocks().size());
  rows[0].push_back("block");
  for (std::size_t b = 0; b + 1 < rows.size(); ++b) {
    rows[b + 1].push_back(problem.layout.blocks()[b].name);
  }
  const auto add_column = [&](const std::string& name) {
    for (TextRow& row : rows) row.emplace_back("-");
    rows[0].back() = name;
  };
  for (const MotionBinding& motion : problem.motions) {
    add_column(motion.name);
    for (const BlockId id : motion.blocks) {
      const bool constant = problem.layout[id].status == BlockStatus::kConstant;
      rows[static_cast<std::size_t>(id) + 1].back() = constant ? "knows" : "moves";
    }
  }
  for (const SensorBinding& sensor : problem.sensors) {
    add_column(sensor.name);
    for (const RoleBinding& role : sensor.roles) {
      if (role.block < 0) continue;
      rows[static_cast<std::size_t>(role.block) + 1].back() =
          EffectText(problem.layout[role.block], role.mode);
    }
  }
  return TextTable(rows, kIndent);
}

/// Returns the names of a direction, as in `target.depth together with target.depth_rate`.
std::string DirectionText(const std::vector<std::string>& names) {
  const std::string other_names = Join({names.begin() + 1, names.end()});
  return names[0] + (other_names.empty() ? "" : " together with " + other_names);
}

/// Returns a line for each direction that is observable only while a control input changes.
std::string NeedExcitation(const Problem& problem,
                           const std::vector<std::vector<std::string>>& unobservable) {
  const auto constant = internal::UnobservableDirections(problem, internal::Excitation::kConstant);
  std::string text;
  for (const auto& names : std::set(constant.begin(), constant.end())) {
    if (std::ranges::count(unobservable, names) > 0) continue;
    text += "  observable only while the control input changes: " + DirectionText(names) + '\n';
  }
  return text;
}

std::string Unobservable(const Problem& problem) {
  if (problem.landmarks && !internal::PlaceLandmarks(problem)) {
    return "  observability is not analysed, because it depends on the landmarks\n";
  }
  if (!internal::IsObservabilityComputed(problem)) {
    return "  observability is not analysed, because the state has more than " +
           std::to_string(internal::kMaxObservabilityElements) + " elements\n";
  }
  const std::vector<std::vector<std::string>> unobservable = UnobservableDirections(problem);
  std::map<std::vector<std::string>, int> directions;
  for (const auto& names : unobservable) ++directions[names];
  std::string text;
  if (directions.empty()) text = "  the state is fully observable\n";
  for (const auto& [names, count] : directions) {
    text += "  unobservable: " + DirectionText(names);
    text += " (" + std::to_string(count) + (count == 1 ? " direction)\n" : " directions)\n");
    if (names[0] == "scale") {
      text +=
          "    the prior alone determines the scale of trajectory and map; depth, a stereo pair,\n"
          "    odometry or known landmarks would make the scale observable\n";
    }
  }
  return text + NeedExcitation(problem, unobservable);
}

std::string CapabilitiesText(const std::string& type) {
  const internal::EstimatorType* estimator_type = internal::FindEstimatorType(type);
  if (estimator_type == nullptr) return {};
  const EstimatorCapabilities& capabilities = estimator_type->capabilities;
  const auto either = [](bool supported, const char* text, const char* alternative) {
    return std::string(supported ? text : alternative);
  };
  std::string unsupported;
  const auto add_unsupported = [&](bool supported, const char* feature) {
    if (!supported) unsupported += (unsupported.empty() ? "" : ", ") + std::string(feature);
  };
  add_unsupported(capabilities.consider, "consider blocks and roles");
  add_unsupported(capabilities.at_measurement, "jacobian_at measurement");
  add_unsupported(capabilities.from_measurement, "blocks that start from a measurement");
  add_unsupported(capabilities.recovery, "rejection\n    recovery");
  add_unsupported(capabilities.landmarks, "landmarks");
  return either(capabilities.consider,
                "    blocks estimated, consider (Schmidt) or constant; roles estimate, consider, "
                "known;\n",
                "    blocks estimated or constant; roles estimate, known;\n") +
         "    control inputs; jacobian_at prediction" +
         either(capabilities.at_measurement, " or measurement", "") +
         either(capabilities.from_measurement, "; blocks that start from a measurement", "") +
         ";\n    robust losses" + either(capabilities.landmarks, "; landmarks", "") + '.' +
         (unsupported.empty() ? "" : "\n    Not supported: " + unsupported + '.') + '\n';
}

/// Describes the treatment of out-of-sequence frames. Returns "" for the default treatment.
std::string OutOfSequenceText(const OutOfSequencePolicy& handling) {
  if (handling.policy == OutOfSequence::kReject) return "";
  const bool buffer = handling.policy == OutOfSequence::kBuffer;
  const char* const action =
      buffer
          ? "buffer: frames are delayed"
          : "rollback: the estimators return to an earlier state and process all frames in order";
  return std::string("  out-of-sequence frames: ") + action +
         (handling.window
              ? "; a frame may be up to " + internal::RoundedText(Seconds(*handling.window), 6) +
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
    std::vector<std::string> texts;
    for (const Node& item : value.ItemsOrOne()) texts.push_back(item.Text());
    rows.push_back({path, Join(texts), ToString(value.place())});
  }
}

std::string CalibrationText(const Config& config, const Source& source) {
  const Config calibrated = internal::WithCalibration(config, source);
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

std::string SourceText(const Config& config, const Experiment& experiment) {
  const Node source = config.root().At("source");
  std::string text = "source " + source.At("type").Text();
  text += ", seed " + std::to_string(experiment.seed) + '\n';
  std::vector<TextRow> rows = {{"stream", "size", "used by"}};
  for (const StreamInfo& stream : experiment.source->streams()) {
    std::vector<std::string> users;
    for (const auto& [name, sensor] : config.root().At("sensors").Entries()) {
      if (sensor.At("stream").Text() == stream.name) users.push_back(name);
    }
    for (const auto& [name, state] : config.root().At("state").Entries()) {
      const auto input = state.Find("input");
      if (input && input->At("stream").Text() == stream.name) users.push_back(name + " (input)");
    }
    rows.push_back({stream.name, std::to_string(stream.size), users.empty() ? "-" : Join(users)});
  }
  const std::vector<std::string> truths = internal::NamesOf(experiment.source->truths());
  text += TextTable(rows, kIndent) + SourceKeys(source);
  if (const std::string guide = experiment.source->guide_name(); !guide.empty()) {
    text += "  guide: filter '" + guide + "' predicts the search regions of the measurements\n";
  }
  return text + "  truth: " + (truths.empty() ? "not known" : Join(truths)) + '\n' +
         CalibrationText(config, *experiment.source) +
         OutOfSequenceText(experiment.out_of_sequence);
}

}  // namespace

std::string Explain(const Config& config, const Experiment& experiment) {
  std::string text = SourceText(config, experiment);
  for (const EstimatorSpec& spec : experiment.estimators) {
    const Problem& problem = spec.problem;
    const Node entry = config.root().At("estimators").At(spec.name);
    text += "\nestimator " + spec.name + " (" + spec.type + ")\n";
    text += "  state\n" + StateTable(problem, experiment.source->truths());
    text += "  motion\n" + MotionTable(problem);
    text += "  sensors\n" + SensorTable(problem);
    if (problem.landmarks)
      text += "  landmarks\n" + TextTable(internal::LandmarkRows(problem), kIndent);
    text += "  effects on blocks\n" + EffectTable(problem);
    text += Unobservable(problem);
    text += "  options\n" + TextTable(internal::OptionRows(entry, spec), kIndent);
    if (const std::string support = CapabilitiesText(spec.type); !support.empty()) {
      text += "  type " + spec.type + " supports\n" + support;
    }
  }
  return text;
}

}  // namespace alidade
