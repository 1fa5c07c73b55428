// SPDX-License-Identifier: Apache-2.0
#include "models.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/base/random.h"
#include "alidade/config/config.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/short_forms.h"
#include "alidade/model/geometry.h"
#include "alidade/plugin/built_in_models.h"
#include "alidade/plugin/plugin_host.h"
#include "sensor_schedule.h"

namespace alidade {
namespace {

class Models : public Source {
 public:
  explicit Models(const SourceArguments& arguments) {
    Params& p = arguments.params;
    const double rate_hz = p.Number("rate_hz", "Hz", "time steps per second", {1e-6, 1e6}, 30.0);
    const double duration_s =
        p.Number("duration_s", "s", "maximum time of the last step", {0.0, 1e9}, 10.0);
    const Node& entry = arguments.entry;
    for (const char* key : {"start", "initial", "overrides", "sensors", "inputs", "landmarks"}) {
      entry.Declare(key);
    }
    if (arguments.config == nullptr || arguments.host == nullptr) {
      throw Error(ExitCode::kBadConfig, "source 'models' needs a config with models");
    }
    dt_s_ = 1.0 / rate_hz;
    // Allows for rounding if the duration is a multiple of the step.
    count_ = 1 + static_cast<std::int64_t>(duration_s * rate_hz * (1.0 + 1e-15));
    BuildTruth(arguments);
    DrawStart(entry, arguments.seed);
    AddMotions(entry, arguments.seed);
    AddSensors(entry, arguments.seed, rate_hz);
    DrawPoints(entry, arguments.seed);
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override { return count_; }

  std::optional<std::array<double, 3>> TrueLandmark(std::int64_t id) const override {
    if (id < 0 || id >= static_cast<std::int64_t>(points_.size())) return std::nullopt;
    return points_[static_cast<std::size_t>(id)];
  }

  bool Next(SourceFrame& frame) override {
    if (index_ == count_) return false;
    if (index_ > 0) Step();
    frame.timestamp = TimestampFromSeconds(Time());
    frame.truth = x_;
    frame.measurements.clear();
    for (Sensor& sensor : sensors_) Measure(sensor, frame);
    if (!frame.measurements.empty()) {
      for (Motion& motion : motions_) motion.is_noise_held = false;
    }
    for (Motion& motion : motions_) EmitInput(motion, frame);
    ++index_;
    return true;
  }

 private:
  struct Motion {
    const MotionBinding* binding;
    Random noise;
    int stream = -1;                       ///< stream of the control input; -1: no input
    const Motion* input_source = nullptr;  ///< earlier motion with the same input, or null
    std::vector<double> input, mean, amplitude;
    double frequency_hz = 0.0;
    std::vector<double> w;       ///< current sample of the noise
    bool is_noise_held = false;  ///< true if w is reused until the next measurement
  };
  struct Sensor {
    const SensorBinding* binding;
    SharedSensor model;  ///< model with landmarks in the representation xyz
    int stream;
    models::Schedule schedule;
    Random noise;
    int max_per_frame;  ///< maximum number of landmarks per frame
  };

  /// Builds the problem that defines the truth: that of the config, merged with `overrides`.
  void BuildTruth(const SourceArguments& arguments) {
    const auto overrides = arguments.entry.Find("overrides");
    Config truth = overrides ? arguments.config->Merged(*overrides) : arguments.config->Copy();
    ExpandShortForms(truth, *arguments.host);
    problem_ = ReadProblem(truth.root(), *arguments.host, {});
    AddXyzModels(truth, *arguments.host);
    start_s_ = problem_.initial_time_s.value_or(0.0);
    if (!overrides) return;
    for (const auto& [key, node] : overrides->Entries()) {
      if (!truth.root().HasUnread(key)) continue;
      node.Fail("the simulator does not read the key '" + key + "'",
                "'state', 'sensors', or a key that their models read");
    }
  }

  /// Adds models with landmarks in the representation xyz, for sensors that define their own
  /// representation of points.
  void AddXyzModels(const Config& truth, const PluginHost& host) {
    for (const SensorBinding& sensor : problem_.sensors) {
      const SensorModel& model = *sensor.model;
      const bool has_equations = internal::HasEquationsInConfig(model.name());
      if (!model.has_landmark() || has_equations || sensor.xyz != nullptr) continue;
      if (HasPoint(model) || HasPose(model)) continue;
      xyz_[sensor.name] =
          host.CreateSensor(model.name(), truth.root().At("sensors").At(sensor.name), "xyz");
    }
  }

  /// Returns a sample of N(0, P) as a tangent vector. P may be singular.
  static Eigen::VectorXd DrawFrom(const Eigen::MatrixXd& p, Random& random) {
    const Eigen::LDLT<Eigen::MatrixXd> root(p);
    Eigen::VectorXd n(p.rows());
    for (double& value : n) value = random.Normal();
    n = root.vectorD().cwiseMax(0.0).cwiseSqrt().cwiseProduct(n);
    const Eigen::VectorXd sample = root.matrixL() * n;
    return root.transpositionsP().transpose() * sample;
  }

  void DrawStart(const Node& entry, std::uint64_t seed) {
    const auto start = entry.Find("start");
    const bool draws_from_prior = !start || start->Choice({"prior", "mean"}) == 0;
    const auto initial_values = entry.Find("initial");
    Random random(seed, 0);
    x_.resize(problem_.layout.blocks().size());
    for (const Prior& prior : problem_.priors) {
      const Block& block = problem_.layout[prior.block];
      std::vector<double>& x = x_[static_cast<std::size_t>(prior.block)];
      const std::string name = block.name.substr(block.owner.size() + 1);
      const auto owner = initial_values ? initial_values->Find(block.owner) : std::nullopt;
      if (owner && !owner->is_map()) owner->Fail("this value is not a map", "{BLOCK: value}");
      if (const auto value = owner ? owner->Find(name) : std::nullopt) {
        x = ReadBlockValue(*value, block.space);
        block.geometry().Normalise(x.data());
        continue;
      }
      if (!prior.sensor.empty()) {
        entry.Fail(
            "block '" + block.name + "' starts from a measurement, so its true value is unknown",
            "source.initial: {" + block.owner + ": {" + name + ": value}}");
      }
      x = prior.mean;
      if (!draws_from_prior || prior.covariance.size() == 0) continue;
      const Eigen::VectorXd d = DrawFrom(prior.covariance, random);
      block.geometry().Plus(x.data(), d.data(), x.data());
    }
    if (initial_values) {
      for (const Block& block : problem_.layout.blocks()) {
        if (const auto owner = initial_values->Find(block.owner)) owner->RejectUnread();
      }
      initial_values->RejectUnread();
    }
    for (const Block& block : problem_.layout.blocks()) {
      truths_.push_back({block.name, block.geometry().ambient});
    }
  }

  void AddMotions(const Node& entry, std::uint64_t seed) {
    const auto inputs = entry.Find("inputs");
    motions_.reserve(problem_.motions.size());  // a motion can point to another motion
    for (std::size_t i = 0; i < problem_.motions.size(); ++i) {
      const MotionBinding& binding = problem_.motions[i];
      Motion motion{&binding, Random(seed, 100 + i), -1, nullptr, {}, {}, {}, 0.0, {}, false};
      motion.w.resize(static_cast<std::size_t>(binding.model->noise_size()));
      if (binding.model->has_input()) ReadInput(entry, inputs, motion);
      motions_.push_back(std::move(motion));
    }
    if (inputs) inputs->RejectUnread();
  }

  void ReadInput(const Node& source, const std::optional<Node>& inputs, Motion& motion) {
    if (motion.binding->input.timeout_s < dt_s_) {
      source.Fail(
          "the control input of '" + motion.binding->name + "' times out before the next time step",
          "rate_hz above 1 / timeout_s");
    }
    const std::string& stream = motion.binding->input.stream;
    for (const Motion& earlier : motions_) {
      if (earlier.stream < 0 || earlier.binding->input.stream != stream) continue;
      if (const auto duplicate = inputs ? inputs->Find(motion.binding->name) : std::nullopt) {
        duplicate->Fail("stream '" + stream + "' is already simulated by the input of '" +
                            earlier.binding->name + "'",
                        "an entry only for '" + earlier.binding->name + "'");
      }
      motion.stream = earlier.stream;
      motion.input_source = &earlier;
      return;
    }
    const Geometry& geometry = motion.binding->model->input().geometry;
    motion.mean = geometry.Identity();
    motion.amplitude.resize(motion.mean.size());
    motion.stream = static_cast<int>(streams_.size());
    streams_.push_back({stream, geometry.ambient});
    const auto entry = inputs ? inputs->Find(motion.binding->name) : std::nullopt;
    if (entry) {
      if (const auto mean = entry->Find("mean")) motion.mean = mean->Numbers(geometry.ambient);
      if (const auto amplitude = entry->Find("amplitude")) {
        if (!geometry.is_vector()) {
          amplitude->Fail("the input is not a vector, so it has no amplitude", "only 'mean'");
        }
        motion.amplitude = amplitude->Numbers(geometry.ambient);
        motion.frequency_hz = entry->At("frequency_hz", "an amplitude").Number(0.0, 1e6);
      }
      entry->RejectUnread();
    }
  }

  static std::vector<double> InputAt(const Motion& motion, double t_s) {
    std::vector<double> u = motion.mean;
    const double wave = std::sin(2.0 * std::numbers::pi * motion.frequency_hz * t_s);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += motion.amplitude[i] * wave;
    return u;
  }

  void AddSensors(const Node& entry, std::uint64_t seed, double rate_hz) {
    const auto settings = entry.Find("sensors");
    const auto landmarks = entry.Find("landmarks");
    const auto max_entry = landmarks ? landmarks->Find("max_per_frame") : std::nullopt;
    const int max_per_frame =
        max_entry ? static_cast<int>(max_entry->Integer(1, LandmarkOptions::kUnlimited))
                  : LandmarkOptions::kUnlimited;
    const std::ptrdiff_t inputs = std::ssize(streams_);
    for (std::size_t i = 0; i < problem_.sensors.size(); ++i) {
      const SensorBinding& binding = problem_.sensors[i];
      const auto sensor_settings = settings ? settings->Find(binding.name) : std::nullopt;
      const int known = binding.model->known_size();
      const models::Schedule schedule =
          models::ReadSchedule(sensor_settings, rate_hz, known, seed, 1001 + 2 * i);
      const auto existing = std::ranges::find(streams_, binding.stream, &StreamInfo::name);
      if (existing != streams_.end()) {
        const bool input = existing - streams_.begin() < inputs;
        if (input) {
          entry.Fail("stream '" + binding.stream + "' of sensor '" + binding.name +
                         "' belongs to a control input",
                     "a different stream for the sensor");
        }
        if (sensor_settings) {
          sensor_settings->Fail(
              "an earlier sensor already simulates the stream '" + binding.stream + "'",
              "these settings in the entry of that sensor");
        }
        continue;
      }
      if (known > 0 && !sensor_settings) {
        entry.Fail(
            "sensor '" + binding.name + "' needs known numbers with each measurement",
            "sensors." + binding.name + ".known, a list of these numbers for each measurement");
      }
      sensors_.push_back({&binding, ModelOf(entry, binding), static_cast<int>(streams_.size()),
                          schedule, Random(seed, 1000 + 2 * i), max_per_frame});
      streams_.push_back(
          {binding.stream, binding.model->measurement().geometry.ambient, 0.0, known});
    }
    if (settings) settings->RejectUnread();
  }

  /// Returns a model of the sensor whose landmarks are points or poses.
  SharedSensor ModelOf(const Node& entry, const SensorBinding& binding) const {
    if (!binding.model->has_landmark()) return binding.model;
    entry.At("landmarks", "sensor '" + binding.name + "'");
    if (binding.xyz) return binding.xyz;
    const auto xyz = xyz_.find(binding.name);
    const SharedSensor& model = xyz != xyz_.end() ? xyz->second : binding.model;
    if (!HasPose(*model) && !HasPoint(*model)) {
      entry.Fail("the landmarks of model '" + binding.model->name() + "' of sensor '" +
                     binding.name + "' are not points, which this source draws",
                 "a landmark role that is a vector(2) or vector(3), or a position and an "
                 "orientation or angle");
    }
    return model;
  }

  /// Returns true if a landmark of the model is a point in the plane or in space.
  static bool HasPoint(const SensorModel& model) {
    const Geometry& last = model.roles().back().geometry;
    const auto count = std::ranges::count_if(model.roles(), &Space::landmark);
    return count == 1 && (last == Geometry::Vector(2) || last == Geometry::Vector(3));
  }

  /// Returns true if the landmarks of the model are poses, in the plane or in space.
  static bool HasPose(const SensorModel& model) {
    const std::size_t count = model.roles().size();
    if (count < 2) return false;
    const Space &position = model.roles()[count - 2], &attitude = model.roles()[count - 1];
    return position.landmark() && attitude.landmark() &&
           ((position.geometry == Geometry::Vector(3) &&
             attitude.geometry == Geometry::UnitQuaternion()) ||
            (position.geometry == Geometry::Vector(2) && attitude.geometry == Geometry::Angle()));
  }

  void DrawPoints(const Node& entry, std::uint64_t seed) {
    const auto landmarks = entry.Find("landmarks");
    if (!landmarks) return;
    if (!problem_.landmarks) {
      landmarks->Fail("no sensor measures landmarks",
                      "a sensor of landmarks, or a source without the key 'landmarks'");
    }
    constexpr int kMaxCount = 1'000'000;
    const auto count =
        static_cast<std::size_t>(landmarks->At("count", "landmarks").Integer(1, kMaxCount));
    const Node box = landmarks->At("box", "landmarks");
    const std::vector<double> low = box.At("min").Numbers(3), high = box.At("max").Numbers(3);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(low[k] <= high[k])) box.Fail("'min' exceeds 'max'", "min <= max in each of x, y and z");
    }
    box.RejectUnread();
    landmarks->RejectUnread();
    Random random(seed, 1);
    points_.resize(count);
    for (auto& point : points_) {
      for (std::size_t k = 0; k < 3; ++k) point[k] = low[k] + (high[k] - low[k]) * random.Uniform();
    }
    Random orientation_random(seed, 2);
    orientations_.resize(count);
    for (auto& orientation : orientations_) {
      for (double& value : orientation) value = orientation_random.Normal();
      Geometry::UnitQuaternion().Normalise(orientation.data());
    }
    for (const KnownLandmark& known : problem_.landmarks->known) {
      if (known.id < 0 || known.id >= static_cast<std::int64_t>(count)) {
        landmarks->At("count").Fail(
            "no point has the id " + std::to_string(known.id) + " of 'landmarks.known'",
            "a count above the largest id");
      }
      auto& point = points_[static_cast<std::size_t>(known.id)];
      for (std::size_t k = 0; k < 3; ++k) {
        point[k] = known.position[k] + known.sigma * random.Normal();
      }
    }
  }

  double Time() const { return start_s_ + static_cast<double>(index_) * dt_s_; }

  /// Advances the truth to the next time step.
  void Step() {
    const double t_s = Time();
    std::vector<std::vector<double>> next = x_;
    for (Motion& motion : motions_) {
      const SharedMotion& model = motion.binding->model;
      if (model->stationary()) continue;
      std::vector<const double*> blocks;
      std::vector<double*> destinations;
      for (const BlockId id : motion.binding->blocks) {
        blocks.push_back(x_[static_cast<std::size_t>(id)].data());
        destinations.push_back(next[static_cast<std::size_t>(id)].data());
      }
      Status status = Status::kOk;
      const double* const input = motion.input.empty() ? nullptr : motion.input.data();
      if (!motion.is_noise_held || !model->discrete_noise())
        status = DrawNoise(blocks, input, motion);
      if (status == Status::kOk) {
        status = model->Step(blocks.data(), input, motion.w.data(), dt_s_, {destinations.data()});
      }
      if (status != Status::kOk) {
        throw Error(ExitCode::kBadData, "source 'models': the truth leaves the domain of model '" +
                                            model->name() + "' of '" + motion.binding->name +
                                            "' before t = " + std::to_string(t_s) + " s");
      }
      for (const BlockId id : motion.binding->blocks) {
        problem_.layout[id].geometry().Normalise(next[static_cast<std::size_t>(id)].data());
      }
    }
    // A constant block retains its value, even if its model computes another value.
    for (std::size_t id = 0; id < x_.size(); ++id) {
      if (problem_.layout[static_cast<BlockId>(id)].status != BlockStatus::kConstant)
        x_[id] = next[id];
    }
  }

  Status DrawNoise(const std::vector<const double*>& blocks, const double* input,
                   Motion& motion) const {
    const auto n = static_cast<Eigen::Index>(motion.w.size());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> l(n, n);
    const Status status = motion.binding->model->SqrtQ(blocks.data(), input, dt_s_, l.data());
    Eigen::VectorXd sample(n);
    for (double& value : sample) value = motion.noise.Normal();
    Eigen::VectorXd::Map(motion.w.data(), n) = l * sample;
    motion.is_noise_held = true;
    return status;
  }

  void Measure(Sensor& sensor, Frame& frame) {
    if (!sensor.schedule.IsDue(index_)) return;
    for (const std::vector<double>& known : sensor.schedule.known) {
      if (!sensor.model->has_landmark()) {
        EmitMeasurement(sensor, -1, known, frame);
        continue;
      }
      int remaining = sensor.max_per_frame;
      for (std::size_t id = 0; id < points_.size() && remaining > 0; ++id) {
        remaining -= EmitMeasurement(sensor, static_cast<std::int64_t>(id), known, frame) ? 1 : 0;
      }
    }
  }

  /// Emits one measurement. Returns false if h is not defined or the value is not valid. Returns
  /// true if the measurement is emitted, or is simulated as missing.
  bool EmitMeasurement(Sensor& sensor, std::int64_t landmark, const std::vector<double>& known,
                       Frame& frame) {
    const Geometry& geometry = sensor.model->measurement().geometry;
    std::vector<const double*> roles;
    for (const RoleBinding& role : sensor.binding->roles) {
      roles.push_back(role.block < 0 ? nullptr : x_[static_cast<std::size_t>(role.block)].data());
    }
    double heading = 0.0;
    if (landmark >= 0) {
      const auto id = static_cast<std::size_t>(landmark);
      const std::array<double, 4>& q = orientations_[id];
      heading = Angle::Wrap(2.0 * std::atan2(q[3], q[0]));
      const bool has_pose = HasPose(*sensor.model);
      const bool is_planar = sensor.model->roles().back().geometry == Geometry::Angle();
      roles.resize(sensor.model->roles().size() - (has_pose ? 2 : 1));
      roles.push_back(points_[id].data());
      if (has_pose) roles.push_back(is_planar ? &heading : q.data());
    }
    const auto m = static_cast<Eigen::Index>(geometry.tangent);
    std::vector<double> z(static_cast<std::size_t>(geometry.ambient));
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> l(m, m);
    // The noise is drawn before the domain of h is checked. The sequence of the noise is therefore
    // the same for every true state.
    Eigen::VectorXd n(m);
    for (double& value : n) value = sensor.noise.Normal();
    const auto outcome = sensor.schedule.Draw();
    if (sensor.model->Predict(roles.data(), z.data(), known.data()) != Status::kOk ||
        sensor.model->Valid({z.data(), known.data()}) != Status::kOk ||
        sensor.model->SqrtNoise(roles.data(), z.data(), l.data(), known.data()) != Status::kOk) {
      return false;
    }
    const Eigen::VectorXd d = outcome.sigma_scale * (l * n);
    geometry.Plus(z.data(), d.data(), z.data());
    if (sensor.model->Valid({z.data(), known.data()}) != Status::kOk) return false;
    if (outcome.missing) return true;
    Measurement& measurement = frame.measurements.emplace_back();
    measurement.timestamp = frame.timestamp;
    measurement.stream = sensor.stream;
    measurement.landmark = landmark;
    measurement.values = std::move(z);
    measurement.known = known;
    return true;
  }

  void EmitInput(Motion& motion, Frame& frame) {
    if (motion.stream < 0) return;
    motion.input =
        motion.input_source != nullptr ? motion.input_source->input : InputAt(motion, Time());
    if (motion.input_source != nullptr) return;
    Measurement& measurement = frame.measurements.emplace_back();
    measurement.timestamp = frame.timestamp;
    measurement.stream = motion.stream;
    measurement.values = motion.input;
  }

  Problem problem_;
  std::map<std::string, SharedSensor> xyz_;  ///< by sensor: see AddXyzModels
  std::vector<StreamInfo> streams_, truths_;
  std::vector<std::vector<double>> x_;  ///< true value of each block
  std::vector<Motion> motions_;
  std::vector<Sensor> sensors_;
  std::vector<std::array<double, 3>> points_;
  std::vector<std::array<double, 4>> orientations_;  ///< orientations of landmarks that have a pose
  double dt_s_, start_s_ = 0.0;
  std::int64_t count_, index_ = 0;
};

}  // namespace

std::unique_ptr<Source> CreateModels(const SourceArguments& arguments) {
  return std::make_unique<Models>(arguments);
}

}  // namespace alidade
