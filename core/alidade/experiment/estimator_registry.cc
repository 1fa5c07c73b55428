// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_registry.h"

#include <algorithm>
#include <memory>

#include "alidade/base/number_text.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "alidade/model/params.h"
#include "alidade/plugin/param_reader.h"

namespace alidade::internal {
namespace {

/// Reads the options of every recursive filter.
EkfOptions ReadCommon(Params& p) {
  EkfOptions options;
  options.gate =
      p.NumberOrNone("gate", "", "probability that the gate accepts a consistent measurement",
                     {0.0, 1.0, true, true})
          .value_or(options.gate);
  options.fuse =
      static_cast<Fuse>(p.Choice("fuse", {"joint", "per_sensor", "per_measurement"},
                                 "grouping of the measurements of one timestamp into updates",
                                 static_cast<int>(options.fuse)));
  options.max_dt_s =
      p.NumberOrNone("max_dt_s", "s", "longest step; longer gaps are divided into equal steps",
                     kPositive)
          .value_or(options.max_dt_s);
  options.rejection_recovery = static_cast<RejectionRecovery>(
      p.Choice("rejection_recovery.action", {"reset", "inflate", "none"},
               "action after `rejection_recovery.after` rejections",
               static_cast<int>(options.rejection_recovery)));
  options.rejection_recovery_after =
      p.Integer("rejection_recovery.after", "consecutive rejections of one sensor", 1, 1'000'000,
                options.rejection_recovery_after);
  options.rejection_recovery_after_s =
      p.NumberOrNone("rejection_recovery.after_s", "s",
                     "time without an accepted measurement of a rejected sensor", kPositive)
          .value_or(options.rejection_recovery_after_s);
  options.max_covariance_repairs =
      p.Integer("max_covariance_repairs",
                "maximum number of covariance repairs; the next one ends the estimator", 0,
                1'000'000, options.max_covariance_repairs);
  return options;
}

EkfOptions ReadEkf(Params& p) {
  EkfOptions options = ReadCommon(p);
  options.jacobian = static_cast<JacobianPolicy>(
      p.Choice("jacobian", {"latest", "first_estimate"},
               "linearisation point of H for blocks of stationary models",
               static_cast<int>(options.jacobian)));
  return options;
}

IekfOptions ReadIekf(Params& p) {
  IekfOptions options{ReadCommon(p)};
  options.max_iterations =
      p.Integer("max_iterations", "maximum number of linearisations per update", 2, 1000,
                options.max_iterations);
  options.tolerance =
      p.Number("tolerance", "",
               "step, in posterior standard deviations, below which an update has converged",
               {0.0, 1.0, true, false}, options.tolerance);
  return options;
}

UkfOptions ReadUkf(Params& p) {
  UkfOptions options;
  options.alpha = p.Number("alpha", "", "spread of the sigma points",
                           {UkfOptions::kMinAlpha, 1.0, false, false}, options.alpha);
  options.beta = p.NonNegative(
      "beta", "", "extra weight of the centre point in covariances; 2 is optimal for a Gaussian",
      options.beta);
  options.kappa = p.NonNegative(
      "kappa", "", "addend to the dimension in the formula for the spread of the sigma points",
      options.kappa);
  options.filter = ReadCommon(p);
  return options;
}

Description DescribeCommon(const EkfOptions& options) { return {options, {}}; }
Description DescribeEkf(const EkfOptions& options) {
  const bool latest = options.jacobian == JacobianPolicy::kLatest;
  return {options,
          {{"jacobian", latest ? "latest: H at the latest estimate"
                               : "first_estimate: H at the first estimate of stationary blocks"}}};
}
Description DescribeIekf(const IekfOptions& options) {
  return {options,
          {{"max_iterations", std::to_string(options.max_iterations)},
           {"tolerance", NumberText(options.tolerance) + " posterior sigma"}}};
}
Description DescribeUkf(const UkfOptions& options) {
  return {options.filter,
          {{"alpha, beta, kappa", NumberText(options.alpha) + ", " + NumberText(options.beta) +
                                      ", " + NumberText(options.kappa)}}};
}

/// Returns an estimator type. `read` reads the options of the type, and `describe` describes these
/// options. A missing key has its default value.
template <class Filter, class Options>
EstimatorType MakeType(const char* name, const char* doc, Options (*read)(Params&),
                       Description (*describe)(const Options&),
                       EstimatorKind kind = EstimatorKind::kFilter) {
  const auto read_options = [=](const Node& entry) {
    ParamReader reader(entry, std::string("estimator '") + name + "'");
    Params params(&reader.host());
    const Options options = read(params);
    reader.Check();
    return options;
  };
  const auto make_maker = [=](const Node& entry) {
    return [options = read_options(entry)](const Problem& problem,
                                           const std::vector<StreamInfo>& streams) {
      return std::make_unique<Filter>(problem, options, streams);
    };
  };
  const auto schema = [=] {
    ParamRecorder recorder;
    recorder.Run([&] {
      Params params(&recorder.host());
      static_cast<void>(read(params));
    });
    return recorder.Result();
  };
  const auto describe_entry = [=](const Node& entry) { return describe(read_options(entry)); };
  return {name, doc, Filter::kCapabilities, kind, make_maker, schema, describe_entry};
}

}  // namespace

const std::vector<ParamInfo>& CommonEstimatorKeys() {
  const auto key = [](const char* name, const char* type, const char* fallback, const char* doc,
                      std::vector<std::string> choices = {}) {
    return ParamInfo{name, "", doc, type, "", fallback, std::move(choices), ""};
  };
  static const std::vector<ParamInfo> keys = {
      key("type", "text", "the name of the entry", "type of the estimator"),
      key("sensors", "list", "all",
          "names of the sensors that the estimator uses, in the order of their updates"),
      key("use", "choice or map", "all",
          "all: every measurement; {accepted_by: NAME}: the measurements that the filter NAME "
          "accepts"),
      key("invariant_error", "map", "none",
          "{side: left, blocks: [...]} or {side: right, blocks: [...]}: the error of position, "
          "orientation and velocity is that of one element of a Euclidean group"),
      key("expect", "choice", "good",
          "poor: the entry shows a failure, so the verdict on the run ignores this estimator",
          {"good", "poor"}),
      key("on_divergence", "choice", "report", "report: continue the run; fail: end the run",
          {"report", "fail"}),
      key("on_plugin_failure", "choice", "skip",
          "after a failed call of a sensor: skip ignores the measurement, disable ignores the "
          "sensor until the end of the run, abort ends the run",
          {"skip", "disable", "abort"}),
      key("overrides", "map", "none",
          "state, sensors, landmarks and initial_time_s for this estimator; merged into the "
          "config")};
  return keys;
}

const std::vector<EstimatorType>& EstimatorTypes() {
  static const std::vector<EstimatorType> types = {
      MakeType<Ekf>("ekf", "Extended Kalman filter.", ReadEkf, DescribeEkf),
      MakeType<Iekf>("iekf", "Iterated extended Kalman filter.", ReadIekf, DescribeIekf),
      MakeType<RtsSmoother>("rts", "Fixed-interval smoother based on an extended Kalman filter.",
                            ReadCommon, DescribeCommon, EstimatorKind::kSmoother),
      MakeType<SquareRootEkf>("square_root_ekf",
                              "Extended Kalman filter that propagates a square root of P.",
                              ReadCommon, DescribeCommon),
      MakeType<Ukf>("ukf", "Unscented Kalman filter.", ReadUkf, DescribeUkf),
  };
  return types;
}

const EstimatorType* FindEstimatorType(std::string_view name) {
  const auto& types = EstimatorTypes();
  const auto found = std::ranges::find_if(types, [&](const auto& t) { return t.name == name; });
  return found == types.end() ? nullptr : &*found;
}

}  // namespace alidade::internal
