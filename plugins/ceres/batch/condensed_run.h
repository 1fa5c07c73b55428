// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/frame.h"
#include "alidade/estimation/landmark_representation.h"
#include "alidade/estimation/problem_index.h"
#include "alidade/estimation/timeline.h"
#include "alidade/state/state.h"

namespace alidade::ceres_batch {

/// One step of one motion model, whose inputs are those from `column` on.
struct Step {
  std::size_t motion;
  double dt_s;
  int column;
  int columns;            ///< inputs before it: of which the state depends on some
  bool begins;            ///< it has inputs of its own, else those that the step before held
  std::vector<double> u;  ///< control input; empty: the model takes none
  RowMajor l;             ///< frozen
};

/// A measurement, as one sensor takes it.
struct Factor {
  int sensor = -1;
  bool xyz = false;  ///< a known landmark: the sensor's model of one that is xyz
  Measurement measurement;
  Outcome outcome = Outcome::kAccepted;
  int row = -1;           ///< of r; -1: not in use, or of a landmark that has inputs
  int landmark = -1;      ///< index of the one that it sees
  bool left_out = false;  ///< of a landmark: not defined at the start, nor since
  Eigen::MatrixXd l;      ///< frozen
};

/// A factor whose measurement gives a block its first value.
struct FirstValue {
  std::size_t factor;
  BlockId block;
  int column;
};

/// A frame of a CondensedRun: how it is reached, and what was measured.
struct Epoch {
  std::vector<Step> steps;  ///< that lead to it
  std::vector<Factor> factors;
  std::vector<FirstValue> first_values;  ///< after the steps
  UpdateReport report;                   ///< as far as it does not depend on the solution
  bool ends = false;                     ///< no noise goes on being held after it
  int column = 0;  ///< the first of its inputs; of the first epoch 0: the prior's too
};

/// What a frame is at some inputs e: x_k, and S_k where it was asked for (columns of later inputs
/// are zero). About a given trajectory x is that one's, and the linearised state is
/// x (+) (offset + S e).
struct Point {
  std::vector<double> x;
  Eigen::MatrixXd s;
  Eigen::VectorXd offset;
  int before = 0;  ///< the first column of s is that of this input

  int ColumnOf(int input) const { return input - before; }
};
using TakePoint = std::function<void(std::size_t frame, const Point&)>;

/// A landmark as a function of the camera at its first observation k and of inputs l ~ N(0, I):
///
///   y = g(x_k, z_k (+) L_k l_z, rho0 + sigma l_rho)     by the sensor's own Initialise
///   y = m + sigma l                                     where it is known beforehand
///
/// So it has the information of the filter's initialisation: the observation k is consumed by it,
/// an anchor is the camera itself, and the prior of the inverse distance counts once.
///
/// Once the frame of that observation has left the window, y is in the state, and has no inputs of
/// its own: see CondensedRun::MarginaliseFirst.
struct MapLandmark {
  /// A factor of a frame.
  struct Observation {
    std::size_t epoch = 0, factor = 0;
  };
  std::int64_t id = -1;
  int generation = 0;                     ///< landmarks of this id before it
  int sensor = -1;                        ///< that saw it first
  bool xyz = false;                       ///< by its model of one that is xyz: known
  int observed = 0;                       ///< how often, without the first
  std::optional<Observation> first;       ///< none: known
  std::vector<Observation> observations;  ///< in their order, without the first; of the window
  double prior = 0.0;                     ///< rho0, 1/m
  double sigma = 0.0;                     ///< of rho0; known: of m; 0: exact
  std::vector<double> mean;               ///< m, where known
  Eigen::VectorXd from;                   ///< l that a search starts from
  Eigen::VectorXd l;                      ///< found last
  std::vector<double> y;                  ///< its value there, ambient, one role after the other

  // Of one that is in the state.
  std::vector<BlockId> blocks;                ///< by role; empty: it is not
  std::vector<internal::SensorPlace> places;  ///< by sensor
  bool in_state() const { return !blocks.empty(); }
};

/// The values x of a state and, behind, y of a landmark.
inline std::vector<double> WithLandmark(std::vector<double> x, const std::vector<double>& y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

/// The values of all blocks, frame by frame.
using Trajectory = std::vector<std::vector<double>>;

/// Residuals of a measurement, of which a loss takes the norm; or, without one, of all on end.
struct Part {
  int row, size;
  RobustLoss loss;
};

/// The dense Jacobian of as many rows takes 128 MB.
inline constexpr int kMostDenseInputs = 4000;

/// P = y' y of a point, y = U^-T S', for Cov(e) = (U'U)^-1.
Eigen::MatrixXd CovarianceOf(const Point& point, const Eigen::MatrixXd& u);

/// Symmetric, and without what rounding left below zero.
Eigen::MatrixXd Clipped(const Eigen::MatrixXd& p);

/// What a CondensedRun consists of so far.
struct RunShape {
  int inputs, residuals;  ///< N, M
  std::size_t frames;
  bool has_landmarks;
  /// A block is one: its basis turns over at z = 0, and with it what an input of its motion means,
  /// so that x(e) jumps.
  bool has_unit_vector;
  bool robust;                  ///< a sensor has a loss
  std::span<const Part> parts;  ///< of the residuals
};

/// The problem in e alone, the landmarks where they cost least given e (variable projection
/// [Golub2003]):  phi(e) = min_l |e|^2 / 2 + |l|^2 / 2 + sum_i rho_i(|r_i(e, l)|).
struct Reduced {
  double cost = 0.0;                ///< phi
  Eigen::VectorXd g;                ///< its gradient, N
  Eigen::LLT<Eigen::MatrixXd> llt;  ///< of its Gauss-Newton matrix, N x N: a Schur complement
};

/// The rows of the tangent of a state, as a problem of its frames has them as variables.
struct VariableRows {
  struct Constant {
    std::vector<int> rows;
    bool of_landmark = false;  ///< a block of one that is in the state
  };
  std::vector<int> read, rest;      ///< those that move: that sensors read, and others
  std::vector<Constant> constants;  ///< blocks that do not move, what is known exactly apart

  std::vector<int> moving() const {
    std::vector<int> rows = read;
    rows.insert(rows.end(), rest.begin(), rest.end());
    return rows;
  }
};

/// A whole run as a function of its random inputs e, all of them N(0, 1):
///
///   prior         x_0     = m (+) L_0 e_0,             P_0 = L_0 L_0'
///   motion        x_{k+1} = f(x_k, u_k, L_k e_{k+1}, dt),   Q_k = L_k L_k'
///   measurement   r_i     = L_i^-1 (z_i (-) h(x_k)),   R_i = L_i L_i'
///   MAP           e*      = argmin |e|^2 / 2 + sum_i rho_i(|r_i(e)|)   rho(d) = d^2 / 2, or a loss
///   first value   y       = g(x_k, z (+) L_i e_k)      of a block that starts from a measurement
///   sensitivity   S_k = dx_k/de:  S_0 = [J L_0  0],  S_{k+1} = F S_k + [0  G L_k  0]
///                 with J = d(m (+) d)/dd,  J_r_e = L_i^-1 d(z (-) h)/dh H S_k
///
/// So P_0 and Q may have any rank, nothing is inverted but L_i, and the motion holds exactly at
/// every e. Discrete noise is held over an interval: all steps from one frame with a measurement in
/// use to the next have the same L and the same inputs. What depends on the state in Q and R stands
/// at where it was last frozen.
///
/// Landmarks are functions of the camera that saw them first and of inputs of their own, l, which
/// are not in e: see MapLandmark. Where there are any, Reduce stands for Evaluate.
///
///   symbol   shape      meaning
///   e        N          inputs: of the prior, then frame by frame of its steps and first values
///   r        M          residuals: of the measurements in use, in their order
///   x, S     -, n x N   values of all blocks; n: their tangents, but those of constant blocks
///
/// Source       [Bock1984] (condensing), [Bell1994] (smoothing as least squares).
class CondensedRun {
 public:
  /// Gaps longer than `max_dt_s` are stepped in equal parts. More than `most_inputs` are refused.
  CondensedRun(Problem problem, const std::vector<StreamInfo>& streams, double max_dt_s,
               int most_inputs = kMostDenseInputs);

  /// Sets the time of the prior; else the first frame, or initial_time_s, does.
  void Start(Timestamp timestamp) { timestamp_ = timestamp; }
  Timestamp timestamp() const { return timestamp_; }
  /// One frame more, which `filter` has processed: its report says which measurement gave a block
  /// or landmark its first value. Unless it has failed, its values go behind `about`. False, and
  /// problem(), where there would be too many inputs or steps: there is nothing to go on with then.
  bool Add(const Frame& frame, const UpdateReport& report, const Estimator& filter,
           Trajectory& about);
  /// Makes the first frame, linearised at e, part of the prior, which is then that of the state at
  /// that frame; e becomes the same trajectory in the inputs that are left, and `about` one of the
  /// frames that are left. L_0 is a square root: P_0 may stay singular. Q, R and the weights of
  /// losses are those at e. A frame after which noise goes on being held has no measurement: its
  /// steps become those of the next one. False where a model is not defined: nothing has changed.
  ///
  /// Landmarks that began in that frame become blocks of the state, as long as a frame that is left
  /// sees them, or `map`, what a filter has, names them. The dense solver does not know such ones.
  bool MarginaliseFirst(Eigen::VectorXd& e, const std::vector<LandmarkEstimate>& map,
                        Trajectory& about);
  /// Its parts are good until one of these is called.
  RunShape shape() const {
    return {inputs_,          residuals_, epochs_.size(), has_landmarks(),
            has_unit_vector_, robust_,    parts_};
  }

  /// Takes Q and R at the states of e: the largest relative change of a factor of them. Nothing
  /// where that cannot be.
  std::optional<double> Freeze(const Eigen::VectorXd& e);
  /// r (M) and, unless null, its row-major Jacobian (M x N). False where a model is not defined.
  bool Evaluate(const Eigen::VectorXd& e, double* r, double* j) const;
  /// phi and, where asked for, its derivatives, which also makes the landmarks there those that the
  /// next call starts from. False where a model is not defined, or its matrix singular.
  bool Reduce(const Eigen::VectorXd& e, bool derivatives, Reduced& reduced);
  /// The inputs that solve the problem linearised about `trajectory`, the values of a filter frame
  /// by frame (it may end early). Freezes there. False where that cannot be. With a unit vector it
  /// is linearised about its own solution again until that settles.
  bool Linearised(Trajectory trajectory, Eigen::VectorXd& e);

  /// Gives the points of e, of the first `count` frames, in turn, with S or without. False where a
  /// model is not defined, which ends it.
  bool ForEachFrame(const Eigen::VectorXd& e, std::size_t count, const TakePoint& take,
                    bool sensitivity = true) const;
  /// The estimate of frame k, x and its covariance P: `state`, that of frame k - 1 from
  /// Problem::InitialState(reserved) on, becomes the one of frame k; `report` says what became of
  /// the measurements.
  void Put(std::size_t k, const std::vector<double>& x, const Eigen::MatrixXd& p, State& state,
           UpdateReport& report) const;
  /// `map`, the landmarks that a filter has at the end: place and covariance at e, for
  /// Cov(e) = (U'U)^-1. False where a model is not defined.
  bool PutMap(const Eigen::VectorXd& e, const Eigen::MatrixXd& u,
              std::vector<LandmarkEstimate>& map);

  /// Why the last call failed.
  const std::string& problem() const { return problem_; }

 private:
  friend class KktSystem;  // the same run, linearised by frames instead of condensed
  friend class IncrementalSolve;
  friend class EdgeOfDomain;

  /// What a measurement tells of the roles that its sensor initialises, t in the tangent.
  struct Inverse {
    std::vector<double> y;
    Eigen::MatrixXd by_x, by_d, by_prior;  ///< t x n, t x m of d in z (+) d, t x prior
  };
  /// The normal equations in the states of all frames, d rows of each: those that a sensor reads.
  struct Information {
    Eigen::MatrixXd h;  ///< lower triangle
    Eigen::VectorXd g;
    std::vector<std::size_t> first;  ///< by frame: the earliest that h ties it to
  };
  /// Those of one landmark in its inputs l, and what ties l to the states.
  struct Normal {
    double cost = 0.0;
    Eigen::MatrixXd c;                  ///< I + sum w J_l' J_l
    Eigen::VectorXd b;                  ///< l + sum w J_l' r
    std::vector<std::size_t> epochs;    ///< that it is seen from, the first observation's first
    std::vector<Eigen::MatrixXd> ties;  ///< sum w J_x' J_l of each of them, d rows
  };
  /// An observation that is not defined makes the problem so, or is skipped.
  enum class Undefined { kFails, kSkipped };

  VariableRows FindVariables() const;
  bool HasBorn(const std::vector<int>& rows, std::size_t first, std::size_t last) const;
  /// x_0 and S_0, of so many columns; -1: without.
  bool Begin(const double* e, int columns, Point& point) const;
  /// From frame k - 1 (or the prior) to frame k.
  bool Advance(std::size_t k, const double* e, Point& point) const;
  static State Filled(State state);
  std::vector<double> ValuesOf(const State& state) const;
  std::vector<double> ValuesOf(const MapLandmark& landmark, const std::vector<double>& x) const;
  bool AddSteps(Timestamp begin, Timestamp end, Epoch& epoch);
  void AddFactors(const Frame& frame, const UpdateReport& report, Epoch& epoch);
  void AddLandmarks(const UpdateReport& report, const Estimator& filter, Epoch& epoch);
  void AddKnown();
  void Begin(const Factor& factor, std::size_t index, const Estimator& filter);
  void AddFirstValues(Epoch& epoch);
  void AddPart(Factor& factor);
  bool has_landmarks() const { return binding_.problem.landmarks.has_value(); }
  internal::SensorPlace PlaceBehind(std::size_t sensor, const SensorModel& model) const;
  void PutPlaces();
  /// Whether its landmark roles are filled by what a measurement names, not by blocks.
  bool ObservesLandmarks(const SensorBinding& sensor) const {
    return has_landmarks() && sensor.model->has_landmark();
  }
  /// A landmark with inputs that the first frame sees, and where these are in (e, l).
  struct Leaving {
    std::size_t landmark;
    Eigen::Index column;
    Inverse place;
  };
  bool FindLeaving(const std::vector<Point>& first, std::vector<Leaving>& leaving) const;
  bool LineariseFirst(const Point& point, const std::vector<Leaving>& leaving, Eigen::MatrixXd& j,
                      Eigen::VectorXd& r) const;
  std::vector<bool> FindGoingOn(const std::vector<Leaving>& leaving,
                                const std::vector<LandmarkEstimate>& map) const;
  Eigen::MatrixXd PutInState(const Point& point, std::vector<Leaving>& leaving,
                             const std::vector<bool>& goes_on, Eigen::Index columns);
  void AddBlocks(MapLandmark& landmark, State& state) const;
  void LetGo(const std::vector<bool>& goes_on);
  void DropFirst(Trajectory& about);
  void Shift(int columns);
  bool Present(BlockId id) const { return id < 0 || present_[static_cast<std::size_t>(id)]; }
  bool Move(const Step& step, const double* e, Point& point) const;
  bool Initialise(const FirstValue& first, const Factor& factor, const double* e,
                  Point& point) const;
  bool Invert(const Factor& factor, const Eigen::VectorXd& d, const double* prior,
              const Point& point, const std::string& name, Inverse& inverse) const;
  bool FreezeEpoch(Epoch& epoch, const double* e, Point& point);
  bool FreezeStep(Step& step, const Point& point);
  void EndInterval(Epoch& epoch);
  void PassOnFirst(Trajectory& about);
  // Of a factor of a landmark x has the landmark's values behind.
  bool FreezeFactor(Factor& factor, const std::vector<double>& x);
  bool Residual(const Factor& factor, const std::vector<double>& x, Eigen::VectorXd& r,
                Eigen::MatrixXd* a) const;
  Outcome See(const Factor& factor, const std::vector<double>& x, std::vector<double>& h,
              std::vector<double>* jacobian) const;
  const double* const* RolesOf(const Factor& factor, const std::vector<double>& x) const;
  const std::vector<double>& Joined(const std::vector<double>& x,
                                    const std::vector<double>& y) const;
  void NoteChange(const Eigen::MatrixXd& before, const Eigen::MatrixXd& after);
  const SensorBinding& SensorOf(const Factor& factor) const {
    return binding_.problem.sensors[static_cast<std::size_t>(factor.sensor)];
  }
  const SensorModel& ModelOf(int sensor, bool xyz) const {
    const SensorBinding& binding = binding_.problem.sensors[static_cast<std::size_t>(sensor)];
    return xyz ? *binding.xyz : *binding.model;
  }
  const SensorModel& ModelOf(const Factor& factor) const {
    return ModelOf(factor.sensor, factor.xyz);
  }
  /// y of a landmark that has inputs lies behind x, its rows behind S.
  const internal::SensorPlace& PlaceOf(const Factor& factor) const {
    const auto sensor = static_cast<std::size_t>(factor.sensor);
    if (IsOfState(factor))
      return landmarks_[static_cast<std::size_t>(factor.landmark)].places[sensor];
    return (factor.xyz ? xyz_places_ : places_)[sensor];
  }
  /// Whether it sees a landmark that is in the state.
  static bool IsOfState(const Factor& factor) { return factor.row >= 0 && factor.landmark >= 0; }
  bool PointsOf(const Eigen::VectorXd& e, bool sensitivity, std::vector<Point>& points) const;
  bool Place(const MapLandmark& landmark, const Eigen::VectorXd& l,
             const std::vector<Point>& points, Inverse& place) const;
  Eigen::MatrixXd FollowOf(const MapLandmark& landmark, const Inverse& place, int inputs) const;
  bool FreezeLandmarks(const std::vector<Point>& points);
  static constexpr double kSettledLandmark = 1e-10;  ///< sigma
  bool NormalOf(const MapLandmark& landmark, const Eigen::VectorXd& l,
                const std::vector<Point>& points, Undefined undefined, Normal& normal,
                Information* information) const;
  bool AddObservation(const Factor& factor, std::size_t epoch, const MapLandmark& landmark,
                      const Inverse& place, const Point& point, Normal& normal,
                      Information* information) const;
  bool OptimiseLandmark(MapLandmark& landmark, const std::vector<Point>& points,
                        Undefined undefined, double within = kSettledLandmark) const;
  bool Project(const Eigen::VectorXd& e, const std::vector<Point>& points, Undefined undefined,
               bool derivatives, Reduced& reduced);
  bool AddPlain(const std::vector<Point>& points, Undefined undefined, Information* information,
                double& cost) const;
  Eigen::MatrixXd Assemble(const Eigen::VectorXd& e, const std::vector<Point>& points,
                           const Information& information, Eigen::VectorXd& g) const;
  Eigen::MatrixXd Packed(const Eigen::MatrixXd& rows) const;
  std::optional<internal::LandmarkPoint> PointOf(const MapLandmark& landmark,
                                                 const std::vector<double>& y) const;
  void Describe(const MapLandmark& landmark, const Eigen::MatrixXd& p,
                LandmarkEstimate& estimate) const;
  void PutAbout(const std::vector<double>& about, Point& point) const;
  bool StepAbout(Trajectory& trajectory, const Eigen::VectorXd& e, Eigen::VectorXd& step);
  void Report(std::size_t k, const std::vector<double>& x, UpdateReport& report) const;
  bool Fail(std::string why) const;  ///< false, with this problem()
  bool FailTooMany() const;

  internal::ProblemIndex binding_;
  std::vector<internal::SensorPlace> places_, xyz_places_;  ///< by sensor
  State initial_;                 ///< all blocks that have a place have a value
  std::vector<bool> present_;     ///< at the last frame, by block of the problem
  std::vector<bool> prior_;       ///< likewise, before the first one
  std::vector<int> held_;         ///< by motion: column of the inputs that go on being held, or -1
  std::vector<RowMajor> held_l_;  ///< by motion: L of the last step that begins
  Eigen::MatrixXd l0_;            ///< n x the rows of blocks with a prior, later n x n
  Eigen::VectorXd d0_;            ///< x_0 = m (+) (d_0 + L_0 e_0); 0 but after MarginaliseFirst
  std::vector<Epoch> epochs_;
  std::vector<MapLandmark> landmarks_;
  struct Current {
    int landmark, generation;  ///< -1: it is gone
  };
  std::map<std::int64_t, Current> current_;  ///< by id: the last one
  std::vector<int> read_;                    ///< tangent rows of a state that sensors read
  std::vector<Part> parts_;
  Timestamp timestamp_ = kNoTimestamp;
  internal::Timeline time_;
  int inputs_ = 0, residuals_ = 0, most_inputs_;
  bool has_unit_vector_ = false, robust_ = false;
  double change_ = 0.0;
  mutable std::string problem_;
  struct Memory {
    std::vector<double> x, h, jacobian;
    internal::Roles roles;
    RowMajor j_r_h;
  };
  mutable Memory memory_;        ///< of Residual and what it calls
  std::vector<Step> passed_on_;  ///< of frames that were dropped, to the next one
};

}  // namespace alidade::ceres_batch
