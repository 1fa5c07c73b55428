// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimator.h"

namespace alidade {

/// How the measurements of one stamp are put into updates.
enum class Fuse {
  kJoint,           ///< one stacked update
  kPerSensor,       ///< one update for each sensor, in the order of the config
  kPerMeasurement,  ///< one update for each measurement, in the order of the sensors
};

/// What happens after `lockout_after` consecutive rejections of one sensor.
enum class Lockout {
  kReset,    ///< re-initialise its blocks from the measurement where it can, else inflate
  kInflate,  ///< multiply the covariance of its blocks by 100
  kNone,
};

/// Where H is taken for the blocks of stationary motion models (`constant`) [Huang2010].
enum class JacobianAt {
  kLatest,         ///< their estimate
  kFirstEstimate,  ///< what they started from: the prior's mean, or what a measurement implied
};

struct EkfOptions {
  /// Probability with which a measurement that fits passes the gate; 1: no gate.
  double gate = 1.0;
  Fuse fuse = Fuse::kJoint;
  JacobianAt jacobian = JacobianAt::kLatest;
  Lockout lockout = Lockout::kReset;
  int lockout_after = 20;  ///< consecutive rejections of one sensor
  /// Longer gaps are stepped in equal parts of at most this, to whole ns, and at least 1 ns.
  double max_dt_s = std::numeric_limits<double>::infinity();

  /// Reads `gate`, `fuse` (`joint`, `per_sensor`, `per_measurement`), `jacobian` (`latest`,
  /// `first_estimate`), `lockout` (`after`; `action`: `reset`, `inflate`, `none`) and `max_dt_s`
  /// from an estimator's entry of the config; what is not there keeps its default.
  /// Errors: kBadConfig.
  static EkfOptions FromNode(const Node& entry);
  /// What FromNode reads.
  static std::vector<ParamInfo> Schema();
};

/// Extended Kalman filter: x' = f(x, 0), P' = F P F' + G Q G'; an update with stacked Jacobian H
/// of all accepted measurements, S = H P H' + R = L L', W = P H' L^-T, dx = W L^-1 r, P -= W W'.
/// Where a gain is not the optimal one (considered blocks) the Joseph form takes its place. With a
/// robust loss on the sensor R / w(d) stands for R, d^2 = r' S^-1 r.
///
/// An update is a transaction: what would leave the state not finite or not positive definite is
/// rolled back and reported.
class Ekf : public Estimator {
 public:
  /// `streams` are the source's, in the order of Measurement::stream.
  Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams);

  ~Ekf() override;
  Ekf(const Ekf&) = delete;  // its plans point into its state
  Ekf& operator=(const Ekf&) = delete;

  void Start(Stamp stamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  const State& state() const override { return state_; }
  Stamp stamp() const override { return stamp_; }
  bool diverged() const override { return diverged_; }
  bool failed() const override { return failed_; }
  /// An estimator derived from this one that keeps more from frame to frame overrides both.
  std::unique_ptr<Snapshot> Save() const override;
  void Restore(const Snapshot& snapshot) override;
  std::vector<LandmarkEstimate> landmarks() const override;

 protected:  // for the estimators that share how frames are stepped to, read, gated and reported
  /// @cond
  /// How a sensor touches the state, as long as the layout stays as it is.
  struct SensorPlan {
    std::vector<const double*> roles;  ///< values; null where unbound or without a value yet
    std::vector<const double*> at;     ///< where H is taken: `roles`, where not apart
    std::vector<int> columns;          ///< of each role in a row of H; -1: no Jacobian
    std::vector<int> strides;          ///< for the model: `width` for each role
    std::vector<JacobianPart> parts;
    std::vector<bool> considered;  ///< of the parts
    int width = 0;                 ///< of a row of H: n where the covariance is small
    bool ready = true;             ///< all roles have a value
    bool apart = false;            ///< H is taken elsewhere than h
    std::vector<double> implied;   ///< of the role that is linearised at what z implies
  };
  /// How a motion model moves the state.
  struct MotionPlan {
    bool active = true;  ///< false: stationary, or a block has no value yet
    std::vector<const double*> x;
    std::vector<double*> next;                  ///< into next_
    std::vector<std::pair<int, int>> segments;  ///< rows of the covariance: (offset, size)
    std::vector<int> rows;                      ///< of F that have a covariance; empty: all
    std::vector<double> f, g, l, gl, q;         ///< F, G, L of Qw, G L, G Qw G'
  };
  /// One measurement on its way into an update.
  struct Row {
    const Measurement* measurement = nullptr;
    int sensor = -1;
    std::size_t report = 0;              ///< index into UpdateReport::measurements()
    std::vector<double> h;               ///< H, m rows of the plan's width
    std::vector<double> r, l, pht;       ///< R and its factor, m x m; P H', n x m by columns
    double weight = 1.0;                 ///< w of the robust loss; R is divided by it
    const SensorPlan* zeroed = nullptr;  ///< whose zeros H holds
    SensorPlan* plan = nullptr;          ///< of the landmark that it measures; null: the sensor's
    const SensorModel* model = nullptr;  ///< of the landmark's form; null: the sensor's
  };

  /// Moves state and covariance by dt_s; false, and GiveUp called, where that cannot be.
  virtual bool StepOnce(double dt_s);
  /// x', F, G and Lq of one motion model in its plan, x' in next_; false, and GiveUp called, where
  /// that cannot be or is not finite.
  bool StepModel(const MotionBinding& motion, MotionPlan& plan, double dt_s);
  /// h, the innovation, R and what the estimator makes of h, in `row` and its report.
  virtual Outcome Linearise(Row& row);
  /// R at the values `roles`, or as the measurement itself says, in `row`.
  Outcome NoiseOf(Row& row, const double* const* roles);
  /// S of one measurement by itself, in its report.
  virtual void Project(Row& row);
  /// One update with all rows: all of it happens or nothing.
  virtual Outcome Apply(std::span<Row* const> rows);

  /// F (n x n) of the last StepOnce, n = size of the covariance.
  Eigen::MatrixXd Transition() const;
  /// G Lq (n x noise inputs of the active models) of the last StepOnce.
  Eigen::MatrixXd NoiseInput() const;
  /// Rows below one another: H (m x n), R (m x m) and the innovation.
  struct Stacked {
    Eigen::MatrixXd h, noise;
    Eigen::VectorXd innovation;
  };
  /// The rows as Linearise left them.
  Stacked Stack(std::span<Row* const> rows) const;
  /// J (n x n) of State::MoveTo(values): dx there = J dx here.
  Eigen::MatrixXd TransportTo(const std::vector<double>& values) const;
  /// Writes the gain of all rows, n x m, down in their reports, and remembers the last one used.
  void RecordUpdate(std::span<Row* const> rows, const Eigen::MatrixXd& gain);

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
  void StepTo(Stamp stamp);
  bool StepIsBounded() const;
  bool Propagate();
  void PropagateModels();

  void Collect(const Frame& frame);
  void Fuse(std::span<Row* const> group);
  Outcome Evaluate(Row& row, MeasurementReport& entry);
  Outcome EvaluateApart(Row& row, MeasurementReport& entry);
  void Chain(Row& row, int column, const RowMajor& j) const;
  Outcome Gate(Row& row);
  void Weigh(Row& row);
  void CheckConditioning(const Row& row);
  Outcome ApplySmall(std::span<Row* const> rows, int m);
  Outcome ApplyLarge(std::span<Row* const> rows);
  bool MaskConsidered(std::span<Row* const> rows, Eigen::MatrixXd& gain) const;
  bool Correct(const Eigen::MatrixXd& w, const Eigen::MatrixXd& gain, bool masked,
               const Eigen::MatrixXd& h, const Eigen::MatrixXd& r);
  Eigen::MatrixXd ProjectionOf(std::span<Row* const> rows) const;
  void RecordGain(MeasurementReport& entry, const double* gain) const;

  void InitialiseFromMeasurements();
  Outcome InitialiseBlock(Row& row);
  void CountRejections();
  void Recover(Row& row);
  void ForgetMotionOf(BlockId id);

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
  std::unique_ptr<Landmarks> landmarks_;  ///< null where the system has none
  std::unique_ptr<Small> small_;          ///< null where the general path is the only one
  bool small_is_known_ = false;           ///< whether small_ fits the plans
  std::vector<int> order_;    ///< rows of P in the order of the layout; empty: as they are
  bool waiting_ = false;      ///< a block has no value yet
  bool considering_ = false;  ///< a block is considered
  std::vector<std::vector<double>> first_;       ///< estimates of stationary blocks, by block
  const Eigen::VectorXd* correction_ = nullptr;  ///< dx of the update; null: K r
  // Memory that is kept from frame to frame.
  UpdateReport report_;
  std::vector<Row> rows_;  ///< the first row_count_ are in use
  std::size_t row_count_ = 0;
  std::vector<Row*> group_, passed_;
  std::vector<double> next_, moved_, predicted_;
  std::vector<double*> jacobians_;
  Stamp stamp_ = kNoStamp;
  std::vector<double> gate_threshold_;  ///< on r' S^-1 r, by sensor
  std::vector<int> rejections_;         ///< consecutive, by sensor
  std::vector<char> out_of_domain_;     ///< since the last acceptance, by sensor
  std::vector<char> inflated_;          ///< since the last acceptance, by sensor
  std::vector<bool> warned_;            ///< of conditioning, by sensor
  /// The last accepted measurement, for the record of a failure.
  struct {
    int sensor = -1;
    Stamp stamp = kNoStamp;
    std::vector<double> z;
  } last_used_;
  bool diverged_ = false;
  bool failed_ = false;
  /// @endcond
};

}  // namespace alidade
