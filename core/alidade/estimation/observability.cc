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

/// Where the landmarks are before the camera, as shares of their usual distance.
constexpr double kPlaces[][3] = {{-0.2, 0.1, 1.0},   {0.23, -0.07, 1.3}, {0.1, 0.15, 0.8},
                                 {-0.1, -0.12, 1.6}, {0.02, 0.05, 2.1},  {0.17, 0.11, 1.15}};

/// The sensor's model for landmarks of the representation xyz; null where it has none.
const SharedSensor& XyzModel(const SensorBinding& sensor) {
  const bool xyz = RepresentationOf(sensor.model->roles()) == internal::XyzRepresentation();
  return xyz ? sensor.model : sensor.xyz;
}

/// The block in the role of that name; -1 where there is none.
BlockId BlockIn(const SensorBinding& sensor, const char* role) {
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (sensor.model->roles()[i].name == role) return sensor.roles[i].block;
  }
  return -1;
}

/// Where the block starts, else `otherwise`.
std::vector<double> StartOf(const Problem& problem, BlockId block,
                            const std::vector<double>& otherwise) {
  const auto prior = std::ranges::find(problem.priors, block, &Prior::block);
  const bool fits = prior != problem.priors.end() && prior->mean.size() == otherwise.size();
  return fits ? prior->mean : otherwise;
}

/// The sensor as it sees the one landmark `block`.
SensorBinding SeenAs(const SensorBinding& sensor, BlockId block) {
  SensorBinding binding{sensor.name, sensor.stream, XyzModel(sensor), {}};
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (!sensor.model->roles()[i].landmark()) binding.roles.push_back(sensor.roles[i]);
  }
  binding.roles.push_back({block});
  return binding;
}

/// Blocks with their values and the columns they take in the observability matrix.
struct Trajectory {
  std::vector<std::vector<double>> values;
  std::vector<int> columns;  ///< -1: known, no column
  std::vector<double> scale;
  std::vector<std::string> names;
};

/// A generic point near the prior: no element at a special value, the sensors' domain kept.
Trajectory StartNearPrior(const Problem& problem) {
  Trajectory t;
  t.values.resize(problem.layout.blocks().size());
  t.columns.assign(t.values.size(), -1);
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    const Geometry& geometry = block.geometry();
    auto& value = t.values[static_cast<std::size_t>(prior.block)];
    value.resize(static_cast<std::size_t>(geometry.ambient));
    if (prior.from.empty()) {
      value = prior.mean;
    } else {
      geometry.Identity(value.data());
    }
    std::vector<double> nudge(static_cast<std::size_t>(geometry.tangent));
    for (std::size_t i = 0; i < nudge.size(); ++i) {
      const double size = prior.from.empty() ? 0.03 * (1.0 + std::abs(value[i])) : 1.0;
      nudge[i] = size * (1.0 + 0.1 * static_cast<double>((prior.block + 3 * i) % 7));
    }
    geometry.Plus(value.data(), nudge.data(), value.data());
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

/// A control input of no special value, each element times a random factor from 1/4 to 7/4 if there
/// is a generator; empty where the model takes none.
std::vector<double> GenericInput(const MotionModel& model, Random* random) {
  if (!model.has_input()) return {};
  const Geometry& geometry = model.input().geometry;
  std::vector<double> input(static_cast<std::size_t>(geometry.ambient));
  std::vector<double> nudge(static_cast<std::size_t>(geometry.tangent));
  for (std::size_t i = 0; i < nudge.size(); ++i) {
    nudge[i] = 1.0 + 0.1 * static_cast<double>(i % 7);
    if (random != nullptr) nudge[i] *= 0.25 + 1.5 * random->Uniform();
  }
  geometry.Identity(input.data());
  geometry.Plus(input.data(), nudge.data(), input.data());
  return input;
}

/// Moves the values by dt and phi <- F phi. False where a model cannot step.
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
    std::vector<Eigen::Index> to, from;
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < motion.blocks.size(); ++i) {
      const BlockId id = motion.blocks[i];
      const int column = t.columns[static_cast<std::size_t>(id)];
      for (int k = 0; k < problem.layout[id].geometry().tangent; ++k, ++row) {
        if (column < 0) continue;
        from.push_back(row);
        to.push_back(column + k);
      }
      if (column >= 0) t.values[static_cast<std::size_t>(id)] = next[i];
    }
    const Eigen::MatrixXd moved = f(from, from) * phi(to, Eigen::all);
    phi(to, Eigen::all) = moved;
  }
  return true;
}

/// The span of the rows seen so far, as an orthonormal basis.
class RowSpace {
 public:
  explicit RowSpace(Eigen::Index n) : q_(n, n) {}

  Eigen::Index rank() const { return rank_; }
  /// Adds what `row` has outside the span; nothing where that is rounding.
  void Add(Eigen::VectorXd row) {
    constexpr double kRankTolerance = 1e-9;
    const double norm = row.norm();
    if (rank_ == q_.rows() || !(norm > 0.0) || !std::isfinite(norm)) return;
    row /= norm;
    const auto known = q_.leftCols(rank_);
    for (int twice = 0; twice < 2; ++twice) row -= known * (known.transpose() * row);
    const double outside = row.norm();
    if (outside > kRankTolerance) q_.col(rank_++) = row / outside;
  }
  /// Orthonormal columns which the rows do not see: n x (n - rank).
  Eigen::MatrixXd Complement() const { return internal::ComplementOf(q_.leftCols(rank_)); }

 private:
  Eigen::MatrixXd q_;
  Eigen::Index rank_ = 0;
};

/// Adds the rows H phi of a sensor, where it is defined at the values, in units of the prior sigma.
void ObserveBy(const SensorBinding& sensor, const double* known, const Problem& problem,
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
  for (RowMajor& block : j) {
    data.push_back(block.data());
    strides.push_back(static_cast<int>(block.cols()));
  }
  std::vector<double> z(static_cast<std::size_t>(sensor.model->measurement().geometry.ambient));
  if (sensor.model->Linearise(roles.data(), z.data(), data.data(), strides.data(), known) !=
      Status::kOk) {
    return;
  }
  Eigen::MatrixXd seen = Eigen::MatrixXd::Zero(m, phi.cols());
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    const RoleBinding& role = sensor.roles[i];
    if (role.block < 0 || role.mode == RoleMode::kKnown) continue;
    const int column = t.columns[static_cast<std::size_t>(role.block)];
    if (column < 0) continue;
    if (!j[i].allFinite()) return;
    seen += j[i] * phi.middleRows(column, j[i].cols());
  }
  for (Eigen::Index i = 0; i < m; ++i) rows.Add(seen.row(i).cwiseProduct(scale));
}

/// The same of every sensor; known numbers are any of the size of the state, as several
/// measurements bring them.
void Observe(const Problem& problem, const Trajectory& t, const Eigen::MatrixXd& phi,
             Random& random, RowSpace& rows) {
  constexpr int kMeasurements = 4;
  double reach = 1.0;
  for (const std::vector<double>& value : t.values) {
    for (const double element : value) reach = std::max(reach, 2.0 * std::abs(element));
  }
  for (const SensorBinding& sensor : problem.sensors) {
    std::vector<double> known(static_cast<std::size_t>(sensor.model->known_size()));
    for (int i = 0; i < (known.empty() ? 1 : kMeasurements); ++i) {
      for (double& number : known) number = reach * random.Normal();
      ObserveBy(sensor, known.data(), problem, t, phi, rows);
    }
  }
}

/// Adds the elements that the prior tells exactly, and the places of landmarks that are known: with
/// landmarks it is these that say where the world is.
void AddKnown(const internal::WithLandmarks& with, const Trajectory& t, RowSpace& rows) {
  const auto n = static_cast<Eigen::Index>(t.names.size());
  for (const Prior& prior : with.problem.priors) {
    const int column = t.columns[static_cast<std::size_t>(prior.block)];
    const auto landmark = std::ranges::find(with.landmarks, prior.block) - with.landmarks.begin();
    for (Eigen::Index i = 0; column >= 0 && i < prior.covariance.rows(); ++i) {
      const bool known = landmark < static_cast<std::ptrdiff_t>(with.known);
      if (known || prior.covariance(i, i) == 0.0) rows.Add(Eigen::VectorXd::Unit(n, column + i));
    }
  }
}

/// Takes the direction that moves all landmarks along their offsets from the camera, d p = p - r,
/// and the rest of the state somehow, out of a null-space basis; false where it is not in it.
bool TakeScale(const internal::WithLandmarks& with, const Trajectory& start,
               Eigen::MatrixXd& basis) {
  constexpr double kTolerance = 1e-5;
  if (with.camera < 0 || basis.cols() == 0) return false;
  Eigen::VectorXd offsets(3 * std::ssize(with.landmarks));
  const double* const r = start.values[static_cast<std::size_t>(with.camera)].data();
  for (std::size_t i = 0; i < with.landmarks.size(); ++i) {
    const double* const p = start.values[static_cast<std::size_t>(with.landmarks[i])].data();
    for (std::size_t e = 0; e < 3; ++e) {
      offsets[static_cast<Eigen::Index>(3 * i + e)] = p[e] - r[e];
    }
  }
  const Eigen::MatrixXd moved = basis.bottomRows(offsets.size());  // their columns come last
  const Eigen::VectorXd scale = internal::SolveByPivoting(moved, offsets);
  if (!((moved * scale - offsets).norm() < kTolerance * offsets.norm())) return false;
  basis = (basis * internal::ComplementOf(scale)).eval();
  return true;
}

/// Brings the columns of a null-space basis to reduced echelon form, so that each one moves as few
/// elements as it can.
void Reduce(Eigen::MatrixXd& basis) {
  Eigen::Index done = 0;
  for (Eigen::Index row = 0; row < basis.rows() && done < basis.cols(); ++row) {
    Eigen::Index pivot = done;
    basis.row(row).tail(basis.cols() - done).cwiseAbs().maxCoeff(&pivot);
    pivot += done;
    if (std::abs(basis(row, pivot)) < 1e-6) continue;
    basis.col(done).swap(basis.col(pivot));
    basis.col(done) /= basis(row, done);
    for (Eigen::Index c = 0; c < basis.cols(); ++c) {
      if (c != done) basis.col(c) -= basis(row, c) * basis.col(done);
    }
    ++done;
  }
}

}  // namespace

std::optional<internal::WithLandmarks> internal::PlaceLandmarks(const Problem& problem) {
  const auto sees = [](const SensorBinding& sensor) { return sensor.model->has_landmark(); };
  const auto blind = [&](const SensorBinding& s) { return sees(s) && XyzModel(s) == nullptr; };
  const auto first = std::ranges::find_if(problem.sensors, sees);
  if (!problem.landmarks || first == problem.sensors.end() ||
      std::ranges::any_of(problem.sensors, blind)) {
    return std::nullopt;
  }
  const std::size_t known = std::min(problem.landmarks->known.size(), std::size(kPlaces));
  WithLandmarks with{problem, {}, known, BlockIn(*first, "position")};
  with.problem.landmarks.reset();
  std::erase_if(with.problem.sensors, sees);
  const std::vector<double> r = StartOf(problem, with.camera, {0.0, 0.0, 0.0});
  const std::vector<double> q =
      StartOf(problem, BlockIn(*first, "orientation"), {1.0, 0.0, 0.0, 0.0});
  const auto& prior = problem.landmarks->prior;
  constexpr double kFarthest_m = 1000.0;  // a prior at infinity would tell nothing of scale
  const double distance_m = prior ? std::min(1.0 / prior->inverse_distance, kFarthest_m) : 2.0;
  const Space xyz{"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3)};
  for (const auto& place : kPlaces) {
    const double h[3] = {distance_m * place[0], distance_m * place[1], distance_m * place[2]};
    double p[3];
    UnitQuaternion::Rotate(q.data(), h, p);
    Vec<3>::Plus(r.data(), p, p);
    const std::string name = std::string(kLandmarks) + '.' + std::to_string(with.landmarks.size());
    const BlockId block = with.problem.layout.Declare(name, kLandmarks, xyz);
    with.landmarks.push_back(block);
    with.problem.priors.push_back({block, {p, p + 3}, Eigen::Matrix3d::Identity(), {}});
    for (const SensorBinding& sensor : problem.sensors) {
      if (sees(sensor)) with.problem.sensors.push_back(SeenAs(sensor, block));
    }
  }
  return with;
}

bool internal::ObservabilityIsTold(const Problem& problem) {
  int size = 0;
  for (const Block& block : problem.layout.blocks()) {
    if (block.status != BlockStatus::kConstant) size += block.geometry().tangent;
  }
  return size <= internal::kMostObserved;
}

std::vector<std::vector<std::string>> internal::UnobservableDirections(const Problem& given,
                                                                       Excitation excitation) {
  const auto with = internal::PlaceLandmarks(given);
  if ((given.landmarks && !with) || !internal::ObservabilityIsTold(given)) return {};
  const Problem& problem = with ? with->problem : given;
  constexpr double kStep = 0.02;
  constexpr int kIdleSteps = 2;
  const Trajectory start = StartNearPrior(problem);
  const Eigen::Index n = static_cast<Eigen::Index>(start.names.size());
  if (n == 0) return {};
  Trajectory t = start;
  Eigen::MatrixXd phi = Eigen::MatrixXd::Identity(n, n);
  RowSpace rows(n);
  if (with) AddKnown(*with, t, rows);
  Random random(1), known(2);
  Random* const changing = excitation == Excitation::kChanging ? &random : nullptr;
  // Once a step adds nothing to the rank, later ones do not either: what holds from this state and
  // for these inputs, which are not special, holds from the next ones. Twice, as trajectories turn.
  for (int idle = 0; idle < kIdleSteps && rows.rank() < n;) {
    const Eigen::Index before = rows.rank();
    Observe(problem, t, phi, known, rows);
    idle = rows.rank() == before ? idle + 1 : 0;
    if (!Advance(problem, kStep, changing, t, phi)) break;
  }
  if (rows.rank() == n) return {};
  Eigen::MatrixXd null_space = rows.Complement();
  std::vector<std::vector<std::string>> directions;
  if (with && TakeScale(*with, start, null_space)) directions.push_back({"scale"});
  Reduce(null_space);
  for (Eigen::Index c = 0; c < null_space.cols(); ++c) {
    std::vector<std::string> names;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::abs(null_space(i, c)) < 1e-6 * null_space.col(c).cwiseAbs().maxCoeff()) continue;
      const std::string& name = start.names[static_cast<std::size_t>(i)];
      if (names.empty() || names.back() != name) names.push_back(name);
    }
    // Where a landmark is by itself, the path tells in time.
    if (!with || names.front() != internal::kLandmarks) directions.push_back(std::move(names));
  }
  return directions;
}

std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem) {
  return internal::UnobservableDirections(problem, internal::Excitation::kChanging);
}

}  // namespace alidade
