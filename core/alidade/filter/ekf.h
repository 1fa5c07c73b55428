// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alidade/filter/control_inputs.h"
#include "alidade/filter/ekf_options.h"
#include "alidade/filter/estimator.h"
#include "alidade/filter/support.h"
#include "alidade/filter/workspace.h"

namespace alidade {

/// Extended Kalman filter: x' = f(x, u, 0), P' = F P F' + G Q G'; an update with stacked Jacobian H
/// of all accepted measurements, S = H P H' + R = L L', W = P H' L^-T, dx = W L^-1 r, P -= W W'.
/// The gain of a consider block is 0 (Schmidt): P += E E', E = (K - K*) L of the optimal gain K*.
/// Where digits would cancel the Joseph form takes the place of both. With a robust loss on the
/// sensor R / w(d) stands for R, d^2 = r' S^-1 r.
///
/// Control inputs act as ControlInputs has it. A gap stepped in parts is noted as the event
/// `substeps`, where it takes at least twice as many as any noted before.
///
/// Discrete noise w ~ N(0, I) is held over an interval, which ends with whatever changes the state
/// but a step: frames without an accepted measurement are part of it. With Lq of its start and
/// M = Cov(x, w), 0 there, each step of it makes
///
///   N = G Lq,  A = F M:   P' = F P F' + A N' + N A' + N N',   M' = A + N
///
/// An update is a transaction: what would leave the state not finite or not positive definite is
/// rolled back and reported. Where S is not positive definite because P is not positive
/// semi-definite, P is repaired (event `repaired`: negative pivots of its L D L' count as zero);
/// after `max_covariance_repairs` of that the next ends the filter.
class Ekf : public Estimator {
 public:
  /// All there is.
  static constexpr Support kSupport = {.consider = true,
                                       .at_measurement = true,
                                       .from_measurement = true,
                                       .recovery = true,
                                       .landmarks = true};

  /// `streams` are the source's, in the order of Measurement::stream.
  Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams);

  ~Ekf() override;
  Ekf(const Ekf&) = delete;  // its plans point into its state
  Ekf& operator=(const Ekf&) = delete;

  void Start(Timestamp timestamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return timestamp_; }
  bool diverged() const override { return diverged_; }
  bool failed() const override { return failed_; }
  /// An estimator derived from this one that keeps more from frame to frame overrides both.
  std::unique_ptr<Snapshot> Save() const override;
  void Restore(const Snapshot& snapshot) override;
  std::vector<LandmarkEstimate> landmarks() const override;

 protected:  // for the estimators that share how frames are stepped to, read, gated and reported
  /// @cond
  /// Whether StepOnce, Linearise, Project and Apply are those of Ekf, which the fast path may stand
  /// in for, or a derived class overrides some of them, and says so.
  enum class Steps { kOwn, kOverridden };
  Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams,
      Steps steps);

  /// How a sensor touches the state, as long as the layout stays as it is.
  struct SensorPlan {
    std::vector<const double*> roles;  ///< values; null where unbound or without a value yet
    std::vector<const double*> linearised_at;  ///< `roles`, where not elsewhere
    std::vector<int> columns;                  ///< of each role in a row of H; -1: no Jacobian
    std::vector<int> strides;                  ///< for the model: `width` for each role
    std::vector<JacobianPart> parts;
    std::vector<bool> consider;         ///< of the parts
    int width = 0;                      ///< of a row of H
    bool whole = false;                 ///< a row of H is n wide, with the columns of P
    bool ready = true;                  ///< all roles have a value
    bool linearised_elsewhere = false;  ///< H is taken elsewhere than h
    std::vector<double> implied;        ///< of the role that is linearised at what z implies
  };
  /// How a motion model moves the state.
  struct MotionPlan {
    bool active = true;  ///< false: stationary, or a block has no value yet
    std::vector<const double*> x;
    const double* u = nullptr;  ///< control input of the step; null: the model takes none
    std::vector<double*> next;  ///< into next_
    std::vector<std::pair<int, int>> segments;  ///< rows of the covariance: (offset, size)
    std::vector<int> rows;                      ///< of F that have a covariance; empty: all
    std::vector<int> at;                        ///< of the covariance, of each row of F; -1: none
    std::vector<double> f, g, l, gl, q;  ///< F, G, L of Qw, G L, G Qw G' (its lower triangle)
    bool holds = false;                  ///< its noise is discrete
    std::vector<double> m;               ///< then M; q holds A N' + N A' too
  };
  /// One measurement on its way into an update.
  struct Row {
    const Measurement* measurement = nullptr;
    int sensor = -1;
    std::size_t report = 0;              ///< index into UpdateReport::measurements()
    std::vector<double> h;               ///< H, m rows of the plan's width
    std::vector<double> r, l, pht;       ///< R and its factor, m x m; P H', n x m by columns
    std::vector<double> work;            ///< for the gate
    double weight = 1.0;                 ///< w of the robust loss; R is divided by it
    const SensorPlan* zeroed = nullptr;  ///< whose zeros H holds
    SensorPlan* plan = nullptr;          ///< of the landmark that it measures; null: the sensor's
    const SensorModel* model = nullptr;  ///< of the landmark's representation; null: the sensor's
  };

  /// Moves state and covariance by dt_s; false, and GiveUp called, where that cannot be.
  virtual bool StepOnce(double dt_s);
  /// x', F, G and Lq of one motion model in its plan, x' in next_; without `derivatives` x' and Lq
  /// alone. False, and GiveUp called, where that cannot be or is not finite.
  bool StepModel(const MotionBinding& motion, MotionPlan& plan, double dt_s,
                 bool derivatives = true);
  /// h, the innovation, R and what the estimator makes of h, in `row` and its report.
  virtual Outcome Linearise(Row& row);
  /// The row's roles where the state has `values`; known ones as they are. Until the next call.
  const double* const* RolesAt(const Row& row, const std::vector<double>& values);
  /// R at the values `roles`, or as the measurement itself says, in `row`.
  Outcome NoiseOf(Row& row, const double* const* roles);
  /// S of one measurement by itself, in its report.
  virtual void Project(Row& row);
  /// One update with all rows: all of it happens or nothing.
  virtual Outcome Apply(std::span<Row* const> rows);

  // Matrices below lie in work_.
  /// Noise inputs of the active models.
  int NoiseSize() const;
  /// F (n x n) of the last StepOnce, n = size of the covariance.
  Workspace::Matrix Transition();
  /// G Lq (n x NoiseSize()) of the last StepOnce.
  Workspace::Matrix NoiseInput();
  /// The same, the columns of continuous noise zero.
  Workspace::Matrix HeldInput();
  /// M (n x NoiseSize()) after the last StepOnce, the columns of continuous noise zero.
  Workspace::Matrix HeldNoise();
  /// Whether noise that the last step held goes on being held.
  bool InInterval() const { return holds_ && interval_steps_ > 0; }
  /// Rows below one another: H (m x n), R (m x m) and the innovation.
  struct Stacked {
    Workspace::Matrix h, noise;
    Workspace::Vector innovation;
  };
  /// The rows as Linearise left them.
  Stacked Stack(std::span<Row* const> rows);
  /// J (n x n) of State::MoveTo(values): dx there = J dx here.
  Workspace::Matrix TransportTo(const std::vector<double>& values);
  /// P <- p, of which the lower triangle counts.
  void SetCovariance(const Workspace::Matrix& p);
  /// Writes the gain of all rows (n x m by columns, its rows as they lie in P) down in their
  /// reports, remembers the last one used, and ends the interval of held noise. Null where no block
  /// has a covariance.
  void RecordUpdate(std::span<Row* const> rows, const double* gain);

  /// The report, the sensor and the plan that belong to a row.
  MeasurementReport& EntryOf(const Row& row) { return report_.measurements()[row.report]; }
  const SensorBinding& BindingOf(const Row& row) const {
    return system_.sensors[static_cast<std::size_t>(row.sensor)];
  }
  const SensorPlan& PlanOf(const Row& row) const {
    return row.plan != nullptr ? *row.plan : plans_[static_cast<std::size_t>(row.sensor)];
  }
  const SensorModel& ModelOf(const Row& row) const {
    return row.model != nullptr ? *row.model : BindingOf(row).model;
  }

  /// Tells why h of a row could not be had.
  void NoteRefusal(const Row& row, Outcome outcome);
  /// An event in the report.
  Event& Note(const char* kind, std::string text);
  /// Ends the filter, with an event that tells its last good state.
  void GiveUp(const char* kind, const std::string& what);

  struct Kept;  ///< the snapshot
  class Small;  ///< the fast path of a filter of few states that are all vectors
  class Landmarks;

  void Bind();
  void KeepFirstEstimates();
  void BindMotions();
  void ProcessFully(const Frame& frame);
  void StepTo(Timestamp timestamp);
  bool StepEvenly(Timestamp end);
  void UseInputs();
  void CarryHeld(const MotionModel& model, MotionPlan& plan);
  Workspace::Matrix Spread(std::vector<double> MotionPlan::*matrix, bool held_only);
  bool StepIsBounded() const;
  bool Propagate();
  void PropagateModels();
  void Collect(const Frame& frame);
  void Fuse(std::span<Row* const> group);
  Outcome Evaluate(Row& row, MeasurementReport& entry, const double* const* roles);
  Outcome EvaluateElsewhere(Row& row, MeasurementReport& entry);
  void Chain(Row& row, int column, int size, const double* j);
  Outcome Gate(Row& row);
  void Weigh(Row& row);
  void CheckConditioning(const Row& row);
  Outcome ApplySmall(std::span<Row* const> rows, int m);
  Outcome ApplyLarge(std::span<Row* const> rows);
  Eigen::MatrixXd MaskConsidered(std::span<Row* const> rows, Eigen::MatrixXd& gain) const;
  bool Correct(const Eigen::MatrixXd& w, const Eigen::MatrixXd& lost, const Eigen::MatrixXd& gain,
               const Eigen::MatrixXd& h, const Eigen::MatrixXd& r);
  Workspace::Matrix ProjectionOf(std::span<Row* const> rows);
  void InitialiseFromMeasurements();
  /// What the inverse measurement model makes of one measurement.
  struct Inverse {
    std::vector<double> y;                   ///< values, one role after the other
    std::vector<BlockId> from;               ///< the blocks that it took
    std::vector<Eigen::MatrixXd> jacobians;  ///< dy/d from
    Eigen::MatrixXd own;                     ///< J_z R J_z' + J_p sigma^2 J_p', p the prior
  };
  Outcome Invert(Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse);
  Outcome InitialiseBlock(Row& row);
  void RepairCovariance();
  void CountRejections();
  void Recover(Row& row);
  void DropMotionOf(BlockId id);
  std::span<Row> rows() { return {rows_.data(), row_count_}; }
  JacobianRows JacobianOf(const Row& row) const;
  std::vector<double>& FirstEstimate(BlockId id) { return first_[static_cast<std::size_t>(id)]; }
  void NotePluginFailure(const SensorBinding& sensor);
  void NoteDivergence(const char* kind, std::string text);
  std::string Describe(const std::vector<BlockId>& blocks) const;
  System system_;
  EkfOptions options_;
  std::vector<int> stream_of_sensor_;  ///< -1: the source has none of that name
  State state_;
  std::vector<SensorPlan> plans_;  ///< by sensor
  std::vector<MotionPlan> motions_;
  Steps steps_;
  std::unique_ptr<Landmarks> landmarks_;  ///< null where the system has none
  std::unique_ptr<Small> small_;          ///< null where the general path is the only one
  std::vector<int> order_;  ///< rows of P in the order of the layout; empty: as they are
  bool waiting_ = false,
       considering_ = false;                ///< a block has no value yet; one is a consider state
  bool holds_ = false;                      ///< the noise of a model is discrete
  std::vector<std::vector<double>> first_;  ///< estimates of stationary blocks, by block
  const double* correction_ = nullptr;      ///< dx of the update; null: K r
  // Memory that is kept from frame to frame.
  Workspace work_;
  UpdateReport report_;
  std::vector<Row> rows_;  ///< the first row_count_ are in use
  std::size_t row_count_ = 0;
  std::vector<Row*> group_, passed_;
  std::vector<double> next_, moved_, predicted_;
  std::vector<double*> jacobians_;
  std::vector<const double*> roles_;
  Timestamp timestamp_ = kNoTimestamp;
  ControlInputs inputs_;
  Timestamp most_parts_ = 1;            ///< of a gap, as far as they were noted
  Timestamp interval_steps_ = 0;        ///< since the state was last changed by anything else
  std::vector<double> gate_threshold_;  ///< on r' S^-1 r, by sensor
  std::vector<int> rejections_;         ///< consecutive, by sensor
  std::vector<char> out_of_domain_;     ///< since the last acceptance, by sensor
  std::vector<char> inflated_;          ///< since the last acceptance, by sensor
  std::vector<bool> warned_;            ///< of conditioning, by sensor
  int repairs_ = 0;                     ///< of the covariance, so far
  /// The last accepted measurement, for the record of a failure.
  struct {
    int sensor = -1;
    Timestamp timestamp = kNoTimestamp;
    std::vector<double> z;
  } last_used_;
  bool diverged_ = false, failed_ = false;
  /// @endcond
};

}  // namespace alidade
