// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
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

struct EkfOptions {
  /// Probability with which a measurement that fits passes the gate; 1: no gate.
  double gate = 1.0;
  Fuse fuse = Fuse::kJoint;
  Lockout lockout = Lockout::kReset;
  int lockout_after = 20;  ///< consecutive rejections of one sensor
  /// Longer gaps are stepped in equal parts of at most this.
  double max_dt_s = std::numeric_limits<double>::infinity();

  /// Reads `gate`, `fuse` (`joint`, `per_sensor`, `per_measurement`), `lockout` (`after`; `action`:
  /// `reset`, `inflate`, `none`) and `max_dt_s` from an estimator's entry of the config; what is
  /// not there keeps its default. Errors: kBadConfig.
  static EkfOptions FromNode(const Node& entry);
  /// What FromNode reads.
  static std::vector<ParamInfo> Schema();
};

/// Extended Kalman filter: x' = f(x, 0), P' = F P F' + G Q G'; an update with stacked Jacobian H
/// of all accepted measurements, S = H P H' + R = L L', W = P H' L^-T, dx = W L^-1 r, P -= W W'.
/// Where a gain is not the optimal one (considered blocks) the Joseph form takes its place.
///
/// An update is a transaction: what would leave the state not finite or not positive definite is
/// rolled back and reported.
class Ekf : public Estimator {
 public:
  /// `streams` are the source's, in the order of Measurement::stream.
  Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams);

  void Start(Stamp stamp) override;
  UpdateReport Process(const Frame& frame) override;
  const State& state() const override { return state_; }
  Stamp stamp() const override { return stamp_; }
  bool diverged() const override { return diverged_; }
  bool failed() const override { return failed_; }

 private:
  /// One measurement on its way into an update.
  struct Row {
    const Measurement* measurement;
    int sensor;
    std::size_t report = 0;        ///< index into UpdateReport::measurements
    std::vector<JacobianBlock> h;  ///< by role with a non-zero Jacobian
    std::vector<bool> considered;  ///< of the blocks in h
    Eigen::VectorXd innovation;
    Eigen::MatrixXd r, pht;  ///< R, P H'
  };

  /// What one motion model makes of its blocks.
  struct Move {
    std::vector<std::pair<BlockId, std::vector<double>>> next;
    std::vector<std::pair<int, int>> segments;  ///< rows of the covariance: (offset, size)
    Eigen::MatrixXd f, q;                       ///< of those rows
  };

  void StepTo(Stamp stamp, UpdateReport& report);
  bool StepOnce(double dt_s, UpdateReport& report);
  bool StepModel(const MotionBinding& motion, double dt_s, std::vector<Move>& moves,
                 UpdateReport& report);

  std::vector<Row> Collect(const Frame& frame, UpdateReport& report);
  void FuseRows(const std::vector<Row*>& group, UpdateReport& report);
  Outcome Linearise(Row& row, MeasurementReport& entry, UpdateReport& report);
  Outcome NoiseOf(Row& row, const std::vector<const double*>& roles) const;
  Outcome JacobiansOf(Row& row, std::vector<const double*> roles) const;
  Outcome Gate(Row& row, MeasurementReport& entry, UpdateReport& report);
  void CheckConditioning(const Row& row, const Eigen::MatrixXd& hpht, UpdateReport& report);
  Outcome Apply(const std::vector<Row*>& rows, UpdateReport& report);
  bool MaskConsidered(const std::vector<Row*>& rows, Eigen::MatrixXd& gain) const;
  bool Correct(const std::vector<Row*>& rows, const Eigen::MatrixXd& w, const Eigen::MatrixXd& gain,
               bool masked, const Eigen::MatrixXd& r);

  void InitialiseFrom(std::vector<Row>& rows, UpdateReport& report);
  Outcome InitialiseBlock(Row& row, UpdateReport& report);
  void CountRejections(std::vector<Row>& rows, UpdateReport& report);
  void Recover(Row& row, UpdateReport& report);
  void ForgetMotionOf(BlockId id);

  const SensorBinding& BindingOf(const Row& row) const {
    return system_.sensors[static_cast<std::size_t>(row.sensor)];
  }
  void NotePluginFailure(const SensorBinding& sensor, UpdateReport& report) const;
  void Note(UpdateReport& report, const char* kind, std::string text) const;
  void GiveUp(UpdateReport& report, const char* kind, const std::string& what);
  std::string Describe(const std::vector<BlockId>& blocks) const;

  System system_;
  EkfOptions options_;
  std::vector<std::vector<int>> sensors_of_stream_;
  State state_;
  Stamp stamp_ = kNoStamp;
  std::vector<double> gate_threshold_;  ///< on r' S^-1 r, by sensor
  std::vector<int> rejections_;         ///< consecutive, by sensor
  std::vector<bool> inflated_;          ///< since the last acceptance, by sensor
  std::vector<bool> warned_;            ///< of conditioning, by sensor
  /// The last accepted measurement, for the record of a failure.
  struct {
    int sensor = -1;
    Stamp stamp = kNoStamp;
    std::vector<double> z;
  } last_used_;
  bool diverged_ = false;
  bool failed_ = false;
};

}  // namespace alidade
