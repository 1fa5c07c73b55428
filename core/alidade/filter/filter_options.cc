// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/filter_options.h"

#include "alidade/filter/ekf_options.h"
#include "alidade/filter/iekf.h"
#include "alidade/filter/ukf.h"

namespace alidade {
namespace {

EkfOptions ReadRecovering(Params& p) {
  EkfOptions options = internal::ReadCommonOptions(p);
  options.rejection_recovery = static_cast<RejectionRecovery>(p.Choice(
      "rejection_recovery.action", {"reset", "inflate", "none"},
      "what is done after so many rejections", static_cast<int>(options.rejection_recovery)));
  options.rejection_recovery_after =
      p.Integer("rejection_recovery.after", "rejections of one sensor in a row", 1, 1'000'000,
                options.rejection_recovery_after);
  options.max_covariance_repairs = p.Integer(
      "max_covariance_repairs", "most repairs of a covariance; the next one ends the estimator", 0,
      1'000'000, options.max_covariance_repairs);
  return options;
}

EkfOptions ReadEkf(Params& p) {
  EkfOptions options = ReadRecovering(p);
  options.jacobian = static_cast<JacobianPolicy>(p.Choice(
      "jacobian", {"latest", "first_estimate"}, "where H is taken for blocks of stationary models",
      static_cast<int>(options.jacobian)));
  return options;
}

IekfOptions ReadIekf(Params& p) {
  IekfOptions options{ReadRecovering(p)};
  options.max_iterations = p.Integer("max_iterations", "most linearisations of an update", 2, 1000,
                                     options.max_iterations);
  options.tolerance = p.Number(
      "tolerance", "", "step, in posterior standard deviations, at which an update has converged",
      {0.0, 1.0, true, false}, options.tolerance);
  return options;
}

UkfOptions ReadUkf(Params& p) {
  UkfOptions options;
  options.alpha = p.Number("alpha", "", "spread of the sigma points",
                           {UkfOptions::kLeastAlpha, 1.0, false, false}, options.alpha);
  options.beta = p.NonNegative("beta", "", "weight of what the centre adds; 2: best for a Gaussian",
                               options.beta);
  options.kappa =
      p.NonNegative("kappa", "", "spread beyond the number of directions", options.kappa);
  options.filter = internal::ReadCommonOptions(p);
  return options;
}

}  // namespace

EkfOptions internal::ReadCommonOptions(Params& p) {
  EkfOptions options;
  options.gate = p.NumberOrNone("gate", "", "probability with which a measurement that fits passes",
                                {0.0, 1.0, true, true})
                     .value_or(options.gate);
  options.fuse = static_cast<Fuse>(p.Choice("fuse", {"joint", "per_sensor", "per_measurement"},
                                            "how the measurements of one timestamp make updates",
                                            static_cast<int>(options.fuse)));
  options.max_dt_s =
      p.NumberOrNone("max_dt_s", "s", "longer gaps are stepped in equal parts", kPositive)
          .value_or(options.max_dt_s);
  return options;
}

EkfOptions EkfOptions::FromNode(const Node& entry) {
  return internal::OptionsFromNode(entry, "ekf", ReadEkf);
}

std::vector<ParamInfo> EkfOptions::Schema() { return internal::SchemaOf(ReadEkf); }

IekfOptions IekfOptions::FromNode(const Node& entry) {
  return internal::OptionsFromNode(entry, "iekf", ReadIekf);
}

std::vector<ParamInfo> IekfOptions::Schema() { return internal::SchemaOf(ReadIekf); }

UkfOptions UkfOptions::FromNode(const Node& entry) {
  return internal::OptionsFromNode(entry, "ukf", ReadUkf);
}

std::vector<ParamInfo> UkfOptions::Schema() { return internal::SchemaOf(ReadUkf); }

}  // namespace alidade
