// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/built_in.h"

#include <algorithm>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/filter/filter_options.h"
#include "alidade/filter/iekf.h"
#include "alidade/filter/rts.h"
#include "alidade/filter/square_root_ekf.h"
#include "alidade/filter/ukf.h"

namespace alidade::internal {
namespace {

std::vector<ParamInfo> CommonSchema() { return SchemaOf(ReadCommonOptions); }

template <class Filter>
EstimatorMaker Maker(const auto& options) {
  return [options](const System& system, const std::vector<StreamInfo>& streams) {
    return std::make_unique<Filter>(system, options, streams);
  };
}

EstimatorMaker ReadEkf(const Node& entry) { return Maker<Ekf>(EkfOptions::FromNode(entry)); }
EstimatorMaker ReadIekf(const Node& entry) { return Maker<Iekf>(IekfOptions::FromNode(entry)); }
EstimatorMaker ReadRts(const Node& entry) {
  return Maker<RtsSmoother>(OptionsFromNode(entry, "rts", ReadCommonOptions));
}
EstimatorMaker ReadSquareRoot(const Node& entry) {
  return Maker<SquareRootEkf>(OptionsFromNode(entry, "square_root_ekf", ReadCommonOptions));
}
EstimatorMaker ReadUkf(const Node& entry) { return Maker<Ukf>(UkfOptions::FromNode(entry)); }

Description DescribeEkf(const Node& entry) {
  const EkfOptions options = EkfOptions::FromNode(entry);
  const bool latest = options.jacobian == JacobianPolicy::kLatest;
  return {options,
          {{"jacobian", latest ? "latest: H at the estimate"
                               : "first_estimate: H where stationary blocks started from"}}};
}
Description DescribeIekf(const Node& entry) {
  const IekfOptions options = IekfOptions::FromNode(entry);
  return {options,
          {{"max_iterations", std::to_string(options.max_iterations)},
           {"tolerance", NumberText(options.tolerance) + " sigma of the posterior"}}};
}
Description DescribeUkf(const Node& entry) {
  const UkfOptions options = UkfOptions::FromNode(entry);
  return {options.filter,
          {{"alpha, beta, kappa", NumberText(options.alpha) + ", " + NumberText(options.beta) +
                                      ", " + NumberText(options.kappa)}}};
}
Description DescribeCommon(const Node& entry) {
  return {OptionsFromNode(entry, "filter", ReadCommonOptions), {}};
}

std::string NameIn(const Block& block) { return block.name.substr(block.owner.size() + 1); }

/// The item `block` of the list under `consider` of its state entry.
Node ConsiderOf(const Node& state, const Block& block) {
  const Node list = state.At("consider");
  for (const Node& item : list.Items()) {
    if (item.Text() == NameIn(block)) return item;
  }
  return list;
}

/// Where the config asks for what is not supported.
Node NodeOf(const Unsupported& asked, const Node& root, const System& system) {
  if (asked.block >= 0) {
    const Block& block = system.layout[asked.block];
    const auto entry = root.At("state").Find(block.owner);
    const Node state = entry ? *entry : root.At("sensors").At(block.owner);  // which owns it
    if (block.status == BlockStatus::kConsider) return ConsiderOf(state, block);
    return state.At("initial").At(NameIn(block)).At("from_measurement");
  }
  if (asked.sensor < 0) return root.At("landmarks");
  const SensorBinding& sensor = system.sensors[static_cast<std::size_t>(asked.sensor)];
  const Node entry = root.At("sensors").At(sensor.name);
  const auto role = static_cast<std::size_t>(asked.role);
  const Node node = entry.At("roles").At(sensor.model.roles()[role].name);
  // A mode that cannot be done comes before jacobian_at.
  return node.At(asked.what.starts_with("jacobian_at") ? "jacobian_at" : "mode");
}

}  // namespace

const std::vector<EstimatorType>& EstimatorTypes() {
  static const std::vector<EstimatorType> types = {
      {"ekf", "Extended Kalman filter.", ReadEkf, EkfOptions::Schema, DescribeEkf, Ekf::kSupport},
      {"iekf", "Iterated extended Kalman filter.", ReadIekf, IekfOptions::Schema, DescribeIekf,
       Iekf::kSupport},
      {"rts", "Fixed-interval smoother after an extended Kalman filter.", ReadRts, CommonSchema,
       DescribeCommon, RtsSmoother::kSupport, EstimatorKind::kSmoother},
      {"square_root_ekf", "Extended Kalman filter that carries a square root of P.", ReadSquareRoot,
       CommonSchema, DescribeCommon, SquareRootEkf::kSupport},
      {"ukf", "Unscented Kalman filter.", ReadUkf, UkfOptions::Schema, DescribeUkf, Ukf::kSupport},
  };
  return types;
}

const EstimatorType* FindEstimatorType(std::string_view name) {
  const auto& types = EstimatorTypes();
  const auto found = std::ranges::find_if(types, [&](const auto& t) { return t.name == name; });
  return found == types.end() ? nullptr : &*found;
}

void RefuseUnsupportedKeys(const std::string& type, const Node& entry) {
  constexpr std::pair<const char*, const char*> kKeys[] = {
      {"gate", "gate"},
      {"fuse", "choice of updates"},
      {"jacobian", "choice of Jacobian"},
      {"rejection_recovery", "rejection recovery"}};
  for (const auto& [key, what] : kKeys) {
    if (!entry.HasUnread(key)) continue;
    entry.At(key).Fail("estimator type '" + type + "' has no " + what,
                       "the key left out, or type: ekf");
  }
}

void RefuseUnsupported(const std::string& type, const Support& support, const Node& root,
                       const System& system) {
  const auto asked = FindUnsupported(system, support);
  if (!asked) return;
  NodeOf(*asked, root, system)
      .Fail("estimator type '" + type + "' does not support " + asked->what,
            asked->remedy + " (also by the estimator's `overrides`), or type: ekf");
}

void RefuseLoneMatches(const Node& entry, const System& system) {
  const auto fuse = entry.Find("fuse");
  if (!fuse || fuse->Text() != "per_measurement") return;
  for (const SensorBinding& sensor : system.sensors) {
    if (!sensor.outlier_rejection) continue;
    fuse->Fail("one match has no others to agree with, as sensor '" + sensor.name +
                   "' asks by its `outlier_rejection`",
               "joint or per_sensor");
  }
}

}  // namespace alidade::internal
