// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/observability.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/random.h"
#include "alidade/estimation/landmark_representation.h"
#include "alidade/model/geometry.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

/// Positions of the landmarks in the camera frame, in units of the typical distance of landmarks.
constexpr double kPositions[][3] = {{-0.2, 0.1, 1.0},   {0.23, -0.07, 1.3}, {0.1, 0.15, 0.8},
                                    {-0.1, -0.12, 1.6}, {0.02, 0.05, 2.1},  {0.17, 0.11, 1.15}};

/// Returns the model of a sensor for landmarks with the representation xyz, or null.
const SharedSensor& XyzModel(const SensorBinding& sensor) {
  const bool xyz = RepresentationOf(sensor.model->roles()) == internal::XyzRepresentation();
  return xyz ? sensor.model : sensor.xyz;
}

/// Returns the block that fills the role with this name, or -1 if the sensor has no such role.
BlockId BlockIn(const SensorBinding& sensor, const char* role) {
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (sensor.model->roles()[i].name == role) return sensor.roles[i].block;
  }
  return -1;
}

/// Returns the mean of the prior of a block, or `default_mean` if the prior has no mean.
std::vector<double> PriorMeanOf(const Problem& problem, BlockId block,
                                const std::vector<double>& default_mean) {
  const auto prior = std::ranges::find(problem.priors, block, &Prior::block);
  const bool has_mean = prior != problem.priors.end() && prior->mean.size() == default_mean.size();
  return has_mean ? prior->mean : default_mean;
}

/// Returns a copy of the sensor. The copy measures only the landmark `block`.
SensorBinding SensorOfLandmark(const SensorBinding& sensor, BlockId block) {
  SensorBinding binding{sensor.name, sensor.stream, XyzModel(sensor), {}};
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (!sensor.model->roles()[i].landmark()) binding.roles.push_back(sensor.roles[i]);
  }
  binding.roles.push_back({block});
  return binding;
}

/// Values of the blocks at a point of a trajectory, and their columns in the observability matrix.
struct Trajectory {
  std::vector<std::vector<double>> values;
  std::vector<int> columns;        ///< by block: first column; -1: the block is constant
  std::vector<double> scale;       ///< by column: sigma of the prior, or 1
  std::vector<std::string> names;  ///< by column: name of the block or block element
};

/// Returns a generic point near the prior. No element has a special value such as 0, and the point
/// is in the domain of the sensors.
Trajectory StartNearPrior(const Problem& problem) {
  Trajectory t;
  t.values.resize(problem.layout.blocks().size());
  t.columns.assign(t.values.size(), -1);
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    const Geometry& geometry = block.geometry();
    auto& value = t.values[static_cast<std::size_t>(prior.block)];
    value = prior.sensor.empty() ? prior.mean : geometry.Identity();
    std::vector<double> offset(static_cast<std::size_t>(geometry.tangent));
    for (std::size_t i = 0; i < offset.size(); ++i) {
      const double size = prior.sensor.empty() ? 0.03 * (1.0 + std::abs(value[i])) : 1.0;
      offset[i] = size * (1.0 + 0.1 * static_cast<double>((prior.block + 3 * i) % 7));
    }
    geometry.Plus(value.data(), offset.data(), value.data());
    if (block.status == BlockStatus::kConstant) continue;
    t.columns[static_cast<std::size_t>(prior.block)] = static_cast<int>(t.names.size());
    const std::vector<std::string> names = ColumnNames(block.name, block.space);
    for (int i = 0; i < geometry.tangent; ++i) {
      const bool by_element = geometry.tangent == geometry.ambient;
      t.names.push_back(block.owner == internal::kLandmarks ? block.owner
                        : by_element                        ? names[static_cast<std::size_t>(i)]
                                                            : block.name);
      const double sigma = prior.covariance.size() > 0 ? std::sqrt(prior.covariance(i, i)) : 1.0;
      t.scale.push_back(sigma > 0.0 ? sigma : 1.0);
    }
  }
  return t;
}

/// Returns a generic control input, which is empty if the model has no control input. If a random
/// generator is given, each element is multiplied by a random factor from 1/4 to 7/4.
std::vector<double> GenericInput(const MotionModel& model, Random* random) {
  if (!model.has_input()) return {};
  const Geometry& geometry = model.input().geometry;
  std::vector<double> input = geometry.Identity();
  std::vector<double> offset(static_cast<std::size_t>(geometry.tangent));
  for (std::size_t i = 0; i < offset.size(); ++i) {
    offset[i] = 1.0 + 0.1 * static_cast<double>(i % 7);
    if (random != nullptr) offset[i] *= 0.25 + 1.5 * random->Uniform();
  }
  geometry.Plus(input.data(), offset.data(), input.data());
  return input;
}

/// Propagates the values by dt_s, and sets phi <- F phi. Returns false if a model fails.
bool Advance(const Problem& problem, double dt_s, Random* random, Trajectory& t,
             Eigen::MatrixXd& phi) {
  for (const MotionBinding& motion : problem.motions) {
    const int n = motion.model->tangent_size();
    std::vector<const double*> x;
    std::vector<std::vector<double>> next;
    std::vector<double*> y;
    for (const BlockId id : motion.blocks) {
      x.push_back(t.values[static_cast<std::size_t>(id)].data());
      next.push_back(t.values[static_cast<std::size_t>(id)]);
    }
    for (auto& value : next) y.push_back(value.data());
    RowMajor f(n, n), g(n, std::max(1, motion.model->noise_size()));
    const std::vector<double> u = GenericInput(*motion.model, random);
    if (motion.model->Step(x.data(), u.data(), nullptr, dt_s, {y.data(), f.data(), g.data()}) !=
            Status::kOk ||
        !f.allFinite()) {
      return false;
    }
    std::vector<Eigen::Index> phi_rows, f_rows;
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < motion.blocks.size(); ++i) {
      const BlockId id = motion.blocks[i];
      const int column = t.columns[static_cast<std::size_t>(id)];
      for (int k = 0; k < problem.layout[id].geometry().tangent; ++k, ++row) {
        if (column < 0) continue;
        f_rows.push_back(row);
        phi_rows.push_back(column + k);
      }
      if (column >= 0) t.values[static_cast<std::size_t>(id)] = next[i];
    }
    const Eigen::MatrixXd product = f(f_rows, f_rows) * phi(phi_rows, Eigen::all);
    phi(phi_rows, Eigen::all) = product;
  }
  return true;
}

/// Orthonormal basis of the row space of the observability matrix.
class RowSpace {
 public:
  explicit RowSpace(Eigen::Index n) : q_(n, n) {}

  Eigen::Index rank() const { return rank_; }
  /// Extends the basis by the part of `row` that is orthogonal to the basis, unless this part is
  /// only a rounding error.
  void Add(Eigen::VectorXd row) {
    constexpr double kRankTolerance = 1e-9;
    const double norm = row.norm();
    if (rank_ == q_.rows() || !(norm > 0.0) || !std::isfinite(norm)) return;
    row /= norm;
    const auto basis = q_.leftCols(rank_);
    for (int pass = 0; pass < 2; ++pass) row -= basis * (basis.transpose() * row);
    const double residual = row.norm();
    if (residual > kRankTolerance) q_.col(rank_++) = row / residual;
  }
  /// Returns an orthonormal basis of the null space: n x (n - rank).
  Eigen::MatrixXd Complement() const { return internal::ComplementOf(q_.leftCols(rank_)); }

 private:
  Eigen::MatrixXd q_;
  Eigen::Index rank_ = 0;
};

/// Adds the rows H phi of a sensor. Their columns are scaled by the prior sigma. Returns false if h
/// is not defined at the values.
bool AddSensorRows(const SensorBinding& sensor, const double* known, const Problem& problem,
                   const Trajectory& t, const Eigen::MatrixXd& phi, RowSpace& rows) {
  const Eigen::Map<const Eigen::RowVectorXd> scale(t.scale.data(), phi.cols());
  const int m = sensor.model->measurement().geometry.tangent;
  std::vector<const double*> roles;
  std::vector<RowMajor> j;
  for (const RoleBinding& role : sensor.roles) {
    roles.push_back(role.block < 0 ? nullptr
                                   : t.values[static_cast<std::size_t>(role.block)].data());
    j.emplace_back(m, role.block < 0 ? 1 : problem.layout[role.block].geometry().tangent);
  }
  std::vector<double*> data;
  std::vector<int> strides;
  for (std::size_t i = 0; i < j.size(); ++i) {
    data.push_back(roles[i] == nullptr ? nullptr : j[i].data());
    strides.push_back(static_cast<int>(j[i].cols()));
  }
  std::vector<double> z(static_cast<std::size_t>(sensor.model->measurement().geometry.ambient));
  if (sensor.model->Linearise(roles.data(), z.data(), data.data(), strides.data(), known) !=
      Status::kOk) {
    return false;
  }
  Eigen::MatrixXd h_phi = Eigen::MatrixXd::Zero(m, phi.cols());
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    const RoleBinding& role = sensor.roles[i];
    if (role.block < 0 || role.mode == RoleMode::kKnown) continue;
    const int column = t.columns[static_cast<std::size_t>(role.block)];
    if (column < 0) continue;
    if (!j[i].allFinite()) return false;
    h_phi += j[i] * phi.middleRows(column, j[i].cols());
  }
  for (Eigen::Index i = 0; i < m; ++i) rows.Add(h_phi.row(i).cwiseProduct(scale));
  return true;
}

/// Adds the rows of every sensor. A sensor that needs known numbers is evaluated several times,
/// with random known numbers whose magnitude equals that of the state. Returns whether h of every
/// sensor was defined at least once.
bool AddObservationRows(const Problem& problem, const Trajectory& t, const Eigen::MatrixXd& phi,
                        Random& random, RowSpace& rows) {
  constexpr int kMeasurements = 4;
  double magnitude = 1.0;
  for (const std::vector<double>& value : t.values) {
    for (const double element : value) magnitude = std::max(magnitude, 2.0 * std::abs(element));
  }
  bool are_defined = true;
  for (const SensorBinding& sensor : problem.sensors) {
    bool is_defined = false;
    std::vector<double> known(static_cast<std::size_t>(sensor.model->known_size()));
    for (int i = 0; i < (known.empty() ? 1 : kMeasurements); ++i) {
      for (double& number : known) number = magnitude * random.Normal();
      is_defined |= AddSensorRows(sensor, known.data(), problem, t, phi, rows);
    }
    are_defined &= is_defined;
  }
  return are_defined;
}

/// Adds one row for each element with an exact prior and for each coordinate of a known landmark.
/// In a problem with landmarks, these elements and coordinates define the world frame.
void AddKnown(const internal::ProblemWithLandmarks& landmark_problem, const Trajectory& t,
              RowSpace& rows) {
  const auto n = static_cast<Eigen::Index>(t.names.size());
  for (const Prior& prior : landmark_problem.problem.priors) {
    const int column = t.columns[static_cast<std::size_t>(prior.block)];
    const auto landmark = std::ranges::find(landmark_problem.landmarks, prior.block) -
                          landmark_problem.landmarks.begin();
    for (Eigen::Index i = 0; column >= 0 && i < prior.covariance.rows(); ++i) {
      const bool is_known = landmark < static_cast<std::ptrdiff_t>(landmark_problem.known_count);
      if (is_known || prior.covariance(i, i) == 0.0) {
        rows.Add(Eigen::VectorXd::Unit(n, column + i));
      }
    }
  }
}

/// Removes the direction of scale from a basis of the null space. This direction moves each
/// landmark p away from the camera r, by d p = p - r. It may also move other blocks. Returns false
/// if the null space does not contain the direction of scale.
bool RemoveScale(const internal::ProblemWithLandmarks& landmark_problem, const Trajectory& start,
                 Eigen::MatrixXd& basis) {
  constexpr double kTolerance = 1e-5;
  if (landmark_problem.camera < 0 || basis.cols() == 0) return false;
  Eigen::VectorXd offsets(3 * std::ssize(landmark_problem.landmarks));
  const double* const r = start.values[static_cast<std::size_t>(landmark_problem.camera)].data();
  for (std::size_t i = 0; i < landmark_problem.landmarks.size(); ++i) {
    const double* const p =
        start.values[static_cast<std::size_t>(landmark_problem.landmarks[i])].data();
    for (std::size_t e = 0; e < 3; ++e) {
      offsets[static_cast<Eigen::Index>(3 * i + e)] = p[e] - r[e];
    }
  }
  const Eigen::MatrixXd landmark_rows = basis.bottomRows(offsets.size());
  const Eigen::VectorXd scale = internal::SolveByPivoting(landmark_rows, offsets);
  if (!((landmark_rows * scale - offsets).norm() < kTolerance * offsets.norm())) return false;
  basis = (basis * internal::ComplementOf(scale)).eval();
  return true;
}

/// Converts the columns of a basis of the null space to reduced echelon form. Each column then has
/// few non-zero elements.
void Reduce(Eigen::MatrixXd& basis) {
  Eigen::Index rank = 0;
  for (Eigen::Index row = 0; row < basis.rows() && rank < basis.cols(); ++row) {
    Eigen::Index pivot = rank;
    basis.row(row).tail(basis.cols() - rank).cwiseAbs().maxCoeff(&pivot);
    pivot += rank;
    if (std::abs(basis(row, pivot)) < 1e-6) continue;
    basis.col(rank).swap(basis.col(pivot));
    basis.col(rank) /= basis(row, rank);
    for (Eigen::Index c = 0; c < basis.cols(); ++c) {
      if (c != rank) basis.col(c) -= basis(row, c) * basis.col(rank);
    }
    ++rank;
  }
}

}  // namespace

std::optional<internal::ProblemWithLandmarks> internal::PlaceLandmarks(const Problem& problem) {
  const auto has_landmark = [](const SensorBinding& s) { return s.model->has_landmark(); };
  const auto has_no_xyz = [&](const SensorBinding& s) {
    return has_landmark(s) && XyzModel(s) == nullptr;
  };
  const auto first = std::ranges::find_if(problem.sensors, has_landmark);
  if (!problem.landmarks || first == problem.sensors.end() ||
      std::ranges::any_of(problem.sensors, has_no_xyz)) {
    return std::nullopt;
  }
  const std::size_t known = std::min(problem.landmarks->known.size(), std::size(kPositions));
  ProblemWithLandmarks landmark_problem{problem, {}, known, BlockIn(*first, "position")};
  landmark_problem.problem.landmarks.reset();
  std::erase_if(landmark_problem.problem.sensors, has_landmark);
  const std::vector<double> r = PriorMeanOf(problem, landmark_problem.camera, {0.0, 0.0, 0.0});
  const std::vector<double> q =
      PriorMeanOf(problem, BlockIn(*first, "orientation"), {1.0, 0.0, 0.0, 0.0});
  const auto& prior = problem.landmarks->prior;
  // Landmarks at infinity do not determine the scale.
  constexpr double kMaxDistance_m = 1000.0;
  const double distance_m = prior ? std::min(1.0 / prior->inverse_distance, kMaxDistance_m) : 2.0;
  const Space xyz{"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3)};
  for (const auto& position : kPositions) {
    const double h[3] = {distance_m * position[0], distance_m * position[1],
                         distance_m * position[2]};
    double p[3];
    UnitQuaternion::Rotate(q.data(), h, p);
    Vec<3>::Plus(r.data(), p, p);
    const std::string name =
        std::string(kLandmarks) + '.' + std::to_string(landmark_problem.landmarks.size());
    const BlockId block = landmark_problem.problem.layout.Declare(name, kLandmarks, xyz);
    landmark_problem.landmarks.push_back(block);
    landmark_problem.problem.priors.push_back({block, {p, p + 3}, Eigen::Matrix3d::Identity(), {}});
    for (const SensorBinding& sensor : problem.sensors) {
      if (has_landmark(sensor))
        landmark_problem.problem.sensors.push_back(SensorOfLandmark(sensor, block));
    }
  }
  return landmark_problem;
}

bool internal::IsObservabilityComputed(const Problem& problem) {
  int size = 0;
  for (const Block& block : problem.layout.blocks()) {
    if (block.status != BlockStatus::kConstant) size += block.geometry().tangent;
  }
  return size <= internal::kMaxObservabilityElements;
}

std::vector<std::vector<std::string>> internal::UnobservableDirections(
    const Problem& original_problem, Excitation excitation) {
  const auto landmark_problem = internal::PlaceLandmarks(original_problem);
  if ((original_problem.landmarks && !landmark_problem) ||
      !internal::IsObservabilityComputed(original_problem)) {
    return {};
  }
  const Problem& problem = landmark_problem ? landmark_problem->problem : original_problem;
  constexpr double kStep = 0.02;
  constexpr int kIdleSteps = 2;
  const Trajectory start = StartNearPrior(problem);
  const Eigen::Index n = static_cast<Eigen::Index>(start.names.size());
  if (n == 0) return {};
  Trajectory t = start;
  Eigen::MatrixXd phi = Eigen::MatrixXd::Identity(n, n);
  RowSpace rows(n);
  if (landmark_problem) AddKnown(*landmark_problem, t, rows);
  Random random(1), known(2);
  Random* const changing = excitation == Excitation::kChanging ? &random : nullptr;
  // If a step does not increase the rank, later steps usually do not increase the rank either,
  // because state and inputs are generic. The loop ends only after two such steps in a row, because
  // the rank may increase again when the trajectory turns.
  bool are_defined = false;
  for (int idle = 0; idle < kIdleSteps && rows.rank() < n;) {
    const Eigen::Index previous_rank = rows.rank();
    are_defined |= AddObservationRows(problem, t, phi, known, rows);
    idle = rows.rank() == previous_rank ? idle + 1 : 0;
    if (!Advance(problem, kStep, changing, t, phi)) break;
  }
  // A sensor that is not defined near the prior may determine the missing directions.
  if (rows.rank() == n || !are_defined) return {};
  Eigen::MatrixXd null_space = rows.Complement();
  std::vector<std::vector<std::string>> directions;
  if (landmark_problem && RemoveScale(*landmark_problem, start, null_space))
    directions.push_back({"scale"});
  Reduce(null_space);
  for (Eigen::Index c = 0; c < null_space.cols(); ++c) {
    std::vector<std::string> names;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::abs(null_space(i, c)) < 1e-6 * null_space.col(c).cwiseAbs().maxCoeff()) continue;
      const std::string& name = start.names[static_cast<std::size_t>(i)];
      if (names.empty() || names.back() != name) names.push_back(name);
    }
    // A direction that changes only landmarks is omitted. It becomes observable as the trajectory
    // continues.
    if (!landmark_problem || names.front() != internal::kLandmarks)
      directions.push_back(std::move(names));
  }
  return directions;
}

std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem) {
  return internal::UnobservableDirections(problem, internal::Excitation::kChanging);
}

}  // namespace alidade
