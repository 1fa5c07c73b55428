// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/read_landmarks.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <set>

#include "alidade/estimation/landmark_representation.h"

namespace alidade {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr int kMaxCount = 1'000'000;

/// Reads a number of frames or landmarks. Has no effect if the key is missing or `none`.
void ReadCount(const Node& map, const char* key, int& count) {
  const auto node = map.Find(key);
  if (!node || (node->kind() == Node::Kind::kScalar && node->Text() == "none")) return;
  try {
    count = static_cast<int>(node->Integer(1, kMaxCount));
  } catch (const Error& error) {
    throw Error(error.code(), std::string(error.what()) + ", or none");
  }
}

LandmarkOptions::Prior ReadPrior(const Node& node) {
  LandmarkOptions::Prior prior;
  node.Declare("distance_m");
  constexpr const char* kShape = "distance_m: [NEAR, FAR], or inverse_distance and sigma";
  prior.inverse_distance =
      node.At("inverse_distance", "landmarks.prior", kShape).Number(0.0, kUnbounded);
  prior.sigma = node.At("sigma", "landmarks.prior").Number(0.0, kUnbounded, true);
  ReadCount(node, "adapt_after", prior.adapt_after);
  if (const auto n = node.Find("min_observations"))
    prior.min_observations = static_cast<int>(n->Integer(1, kMaxCount));
  node.RejectUnread();
  return prior;
}

void ReadPrune(const Node& node, LandmarkOptions& options) {
  ReadCount(node, "max_missed_frames", options.max_missed_frames);
  const auto ratio = node.Find("min_match_ratio"), attempts = node.Find("min_attempts");
  if (ratio) options.min_match_ratio = ratio->Number(0.0, 1.0);
  if (attempts && !ratio)
    attempts->Fail("this key has no effect without min_match_ratio", "both keys, or neither");
  if (attempts) options.min_attempts = static_cast<int>(attempts->Integer(1, kMaxCount));
  node.RejectUnread();
}

std::vector<KnownLandmark> ReadKnown(const Node& list) {
  std::vector<KnownLandmark> known;
  std::set<std::int64_t> ids;
  for (const Node& node : list.Items()) {
    KnownLandmark& landmark = known.emplace_back();
    const Node id = node.At("id", "a known landmark");
    landmark.id = id.Integer(0, std::numeric_limits<std::int64_t>::max());
    const std::vector<double> position = node.At("position", "a known landmark").Numbers(3);
    std::ranges::copy(position, landmark.position.begin());
    landmark.sigma = node.At("sigma", "a known landmark").Number(0.0, kUnbounded);
    node.RejectUnread();
    if (!ids.insert(landmark.id).second) {
      id.Fail("landmark " + std::to_string(landmark.id) + " is listed twice",
              "a different id for each landmark");
    }
  }
  return known;
}

/// Reads the map `outlier_rejection` of a sensor: `method: one_point_ransac`, and one key for each
/// member of OnePointRansac.
OnePointRansac ReadOnePointRansac(const Node& node) {
  OnePointRansac ransac;
  static_cast<void>(node.At("method", "outlier_rejection").Choice({"one_point_ransac"}));
  const auto read = [&node](const char* key, double& value) {
    if (const auto entry = node.Find(key)) value = entry->Number(0.0, 1.0, true, true);
  };
  read("inlier_probability", ransac.inlier_probability);
  read("confidence", ransac.confidence);
  read("rescue_probability", ransac.rescue_probability);
  node.RejectUnread();
  return ransac;
}

/// Reads the map `landmarks` of the config except for `representation`, which the sensors read.
LandmarkOptions ReadOptions(const Node& node) {
  LandmarkOptions options;
  node.Declare("representation");
  if (const auto prior = node.Find("prior")) options.prior = ReadPrior(*prior);
  ReadCount(node, "max_per_frame", options.max_per_frame);
  if (const auto observations = node.Find("min_observations")) {
    options.min_observations = static_cast<int>(observations->Integer(1, kMaxCount));
  }
  if (const auto prune = node.Find("prune")) ReadPrune(*prune, options);
  if (const auto convert = node.Find("convert_to_xyz")) {
    options.max_linearity_index = convert->At("max_linearity_index", "landmarks.convert_to_xyz")
                                      .Number(0.0, kUnbounded, true);
    convert->RejectUnread();
  }
  if (const auto negative = node.Find("negative_depth")) {
    options.negative_depth =
        static_cast<LandmarkOptions::NegativeDepth>(negative->Choice({"keep", "delete"}));
  }
  if (const auto known = node.Find("known")) options.known = ReadKnown(*known);
  return options;
}

std::vector<Space> LandmarkRoles(const SensorBinding& sensor) {
  std::vector<Space> roles;
  for (const Space& role : sensor.model->roles()) {
    if (role.landmark()) roles.push_back(role);
  }
  return roles;
}

std::string RepresentationText(const SensorBinding& sensor) {
  const auto representation = RepresentationOf(sensor.model->roles());
  return representation ? ToString(*representation) : "a custom representation";
}

/// Rejects a sensor whose landmark roles are not last, whose prior has several numbers, or whose
/// landmark representation differs from that of `first_sensor`.
void CheckRoles(const Node& model, const SensorBinding& sensor, const SensorBinding& first_sensor) {
  const auto is_landmark = [](const Space& role) { return role.landmark(); };
  if (!std::ranges::is_partitioned(sensor.model->roles(), std::not_fn(is_landmark))) {
    model.Fail("model '" + sensor.model->name() + "' has roles after the roles of its landmark",
               "a model whose last roles belong to the landmark");
  }
  if (sensor.model->inverse().prior_size > 1) {
    model.Fail("model '" + sensor.model->name() + "' needs a prior of " +
                   std::to_string(sensor.model->inverse().prior_size) + " numbers",
               "a model without a prior, or with a prior of one number (the inverse distance)");
  }
  const auto is_same = [](const Space& a, const Space& b) {
    return a.name == b.name && a.geometry == b.geometry;
  };
  if (!std::ranges::equal(LandmarkRoles(sensor), LandmarkRoles(first_sensor), is_same)) {
    model.Fail("model '" + sensor.model->name() + "' represents landmarks as " +
                   RepresentationText(sensor) + ", but sensor '" + first_sensor.name +
                   "' represents them as " + RepresentationText(first_sensor),
               "the same representation for all sensors");
  }
}

/// Rejects `key` if the sensor has no role `position`, from which a sensor observes landmarks.
void CheckPosition(const Node& key, const SensorBinding& sensor) {
  if (std::ranges::find(sensor.model->roles(), "position", &Space::name) !=
      sensor.model->roles().end()) {
    return;
  }
  key.Fail("model '" + sensor.model->name() + "' of sensor '" + sensor.name +
           "' has no role 'position', from which landmarks are observed; remove this key");
}

/// Rejects options that the sensor does not support.
void CheckOptions(const Node& node, const LandmarkOptions& options, const SensorBinding& sensor) {
  const auto representation = RepresentationOf(sensor.model->roles());
  const std::string model = "model '" + sensor.model->name() + "' of sensor '" + sensor.name + "'";
  if (sensor.model->inverse().prior_size > 0 && !options.prior) {
    node.Fail("a prior is missing: " + model + " does not determine the distance of a landmark",
              "prior: {distance_m: [NEAR, FAR]}");
  }
  if (options.prior) {
    const Node prior = node.At("prior");
    if (representation == internal::XyzRepresentation() && sensor.model->inverse().prior_size > 0 &&
        !(options.prior->inverse_distance > 0.0)) {
      prior.At("inverse_distance")
          .Fail("a landmark at infinity cannot have the representation xyz",
                "an inverse distance above 0 (in 1/m)");
    }
    if (options.prior->adapt_after > 0) CheckPosition(prior.At("adapt_after"), sensor);
  }
  const bool has_xyz = representation == internal::XyzRepresentation() || sensor.xyz != nullptr;
  if (!options.known.empty() && !has_xyz) {
    node.At("known").Fail(model + " does not support the representation xyz; remove this key");
  }
  if (!(options.max_linearity_index > 0.0)) return;
  if (representation == internal::XyzRepresentation()) {
    node.At("convert_to_xyz")
        .Fail(
            "landmarks already have the representation xyz; remove this key, or use "
            "representation: inverse_depth");
  }
  if (!has_xyz)
    node.At("convert_to_xyz")
        .Fail(model + " does not support the representation xyz; remove this key");
  CheckPosition(node.At("convert_to_xyz"), sensor);
}

}  // namespace

void internal::ReadLandmarkKeys(const std::string& name, const Node& entry,
                                const SensorModel& model, const PluginHost& host,
                                SensorOptions& options) {
  const Node role = entry.At("roles").At("landmark", "sensor '" + name + "'");
  if (role.is_map() || role.Text() != "landmarks") {
    role.Fail("this role is not bound to `landmarks`",
              "`landmarks`, because each measurement names its landmark");
  }
  if (const auto node = entry.Find("outlier_rejection")) {
    options.outlier_rejection = ReadOnePointRansac(*node);
  }
  const auto representation = RepresentationOf(model.roles());
  if (!representation || IsXyz(*representation)) return;
  SharedSensor xyz =
      host.CreateSensor(model.name(), entry, ToString(internal::XyzRepresentation()));
  if (RepresentationOf(xyz->roles()) == internal::XyzRepresentation()) options.xyz = std::move(xyz);
}

std::optional<LandmarkOptions> internal::ReadLandmarks(const Node& root,
                                                       const std::vector<SensorBinding>& sensors) {
  const auto observes_landmarks = [](const SensorBinding& sensor) {
    return sensor.model->has_landmark();
  };
  const auto first = std::ranges::find_if(sensors, observes_landmarks);
  if (first == sensors.end()) {
    if (const auto node = root.Find("landmarks")) {
      node->Fail("no sensor measures landmarks; add such a sensor, or remove this key");
    }
    return std::nullopt;
  }
  const Node node = root.At("landmarks", "sensor '" + first->name + "'");
  LandmarkOptions options = ReadOptions(node);
  bool can_initialise = !options.known.empty();
  for (const SensorBinding& sensor : sensors) {
    if (!observes_landmarks(sensor)) continue;
    const Node model = root.At("sensors").At(sensor.name).At("model");
    CheckRoles(model, sensor, *first);
    CheckOptions(node, options, sensor);
    const int role = sensor.model->inverse().role;
    can_initialise =
        can_initialise ||
        (role >= 0 && sensor.model->roles()[static_cast<std::size_t>(role)].landmark());
  }
  if (!can_initialise) {
    node.Fail("no sensor can initialise a landmark from its first measurement",
              "known landmarks under `known`");
  }
  node.RejectUnread();
  return options;
}

}  // namespace alidade
