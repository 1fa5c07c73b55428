// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"
#include "alidade/estimation/observability.h"

namespace alidade::internal {
namespace {

/// Returns the prior mean of a block, or the neutral element if a measurement determines it.
std::vector<double> ValueOf(const Problem& problem, BlockId id) {
  const auto prior = std::ranges::find(problem.priors, id, &Prior::block);
  const bool is_known = prior != problem.priors.end() && !prior->mean.empty();
  return is_known ? prior->mean : problem.layout[id].geometry().Identity();
}

/// Returns a landmark in front of the camera, if the role is a point; else the neutral element.
std::vector<double> LandmarkValue(const Problem& problem, const Space& role) {
  const auto placed = role.geometry == Geometry::Vector(3) ? PlaceLandmarks(problem) : std::nullopt;
  if (!placed || placed->landmarks.empty()) return role.geometry.Identity();
  return ValueOf(placed->problem, placed->landmarks.back());
}

/// Returns the unit of the tangent elements of a block.
std::string TangentUnit(const Problem& problem, BlockId id) {
  return problem.layout[id].geometry().is_angular() ? "rad" : UnitOf(problem, id);
}

std::vector<const double*> PointersTo(const std::vector<std::vector<double>>& values) {
  std::vector<const double*> pointers;
  for (const std::vector<double>& value : values) {
    pointers.push_back(value.empty() ? nullptr : value.data());
  }
  return pointers;
}

std::string WithUnit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + ' ' + unit;
}

constexpr const char* kNotDefined = "not defined at the prior";

}  // namespace

double NominalStep(const Config& config) {
  constexpr double kDefaultStep = 0.1;
  const auto rate = config.root().At("source").Find("rate_hz");
  if (!rate || rate->kind() != Node::Kind::kScalar) return kDefaultStep;
  const double rate_hz = rate->Number();
  return rate_hz > 0.0 ? 1.0 / rate_hz : kDefaultStep;
}

std::string RoundedList(const std::vector<double>& values) {
  constexpr int kDigits = 4;
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(RoundedText(value, kDigits));
  const auto is_first = [&](const std::string& text) { return text == texts.front(); };
  return std::ranges::all_of(texts, is_first) ? texts.front() : '[' + Join(texts) + ']';
}

std::string SigmasText(const Eigen::MatrixXd& covariance) {
  std::vector<double> sigmas;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    sigmas.push_back(std::sqrt(covariance(i, i)));
  }
  return RoundedList(sigmas);
}

std::string MeasurementNoise(const Problem& problem, const SensorBinding& sensor) {
  const SensorModel& model = *sensor.model;
  if (model.known_size() > 0) return "depends on each measurement";
  std::vector<std::vector<double>> values;
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    const Space& role = model.roles()[i];
    const BlockId block = sensor.roles[i].block;
    values.push_back(block >= 0        ? ValueOf(problem, block)
                     : role.landmark() ? LandmarkValue(problem, role)
                                       : std::vector<double>());
  }
  const std::vector<const double*> roles = PointersTo(values);
  const Space& space = model.measurement();
  std::vector<double> z = space.geometry.Identity();
  std::vector<double> h(z.size());
  if (model.Predict(roles.data(), h.data()) == Status::kOk) z = h;
  const int m = space.geometry.tangent;
  RowMajor l = RowMajor::Zero(m, m);
  if (model.SqrtNoise(roles.data(), z.data(), l.data()) != Status::kOk || !l.allFinite()) {
    return kNotDefined;
  }
  return WithUnit(SigmasText(l * l.transpose()), space.unit);
}

std::vector<std::string> ProcessNoise(const Problem& problem, const MotionBinding& motion,
                                      double step_s) {
  const MotionModel& model = *motion.model;
  const int n = model.tangent_size(), noise = model.noise_size();
  if (noise == 0 || model.stationary()) return {};
  std::vector<std::vector<double>> values, next;
  for (const BlockId id : motion.blocks) values.push_back(ValueOf(problem, id));
  next = values;
  std::vector<double*> outputs;
  for (std::vector<double>& value : next) outputs.push_back(value.data());
  const std::vector<double> input =
      model.has_input() ? model.input().geometry.Identity() : std::vector<double>();
  RowMajor f = RowMajor::Zero(n, n), g = RowMajor::Zero(n, noise), l = RowMajor::Zero(noise, noise);
  const Status status =
      model.Step(PointersTo(values).data(), input.data(), nullptr, step_s,
                 {.next = outputs.data(), .f = f.data(), .g = g.data(), .sqrt_q = l.data()});
  const RowMajor root = g * l;
  if (status != Status::kOk || !root.allFinite()) return {kNotDefined};
  const Eigen::MatrixXd q = root * root.transpose();
  std::vector<std::string> texts;
  int row = 0;
  for (const BlockId id : motion.blocks) {
    const Block& block = problem.layout[id];
    const int size = block.geometry().tangent;
    if (block.status != BlockStatus::kConstant) {
      const std::string sigmas = SigmasText(q.block(row, row, size, size));
      texts.push_back(block.name + ' ' + WithUnit(sigmas, TangentUnit(problem, id)));
    }
    row += size;
  }
  return texts;
}

}  // namespace alidade::internal
