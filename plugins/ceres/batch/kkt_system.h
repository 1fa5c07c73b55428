// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "block_ldl.h"
#include "condensed_run.h"
#include "edge_of_domain.h"

namespace alidade::ceres_batch {

/// The step of Levenberg-Marquardt of a CondensedRun from a sparse system in the states, with a
/// multiplier for each step of the motion; mu is the damping of all inputs z = (e, l).
///
///   node     k: a frame after which no noise goes on being held, and those before it that have no
///            measurement in use:   dx_k = F_k dx_{k-1} + B_k dw_k + c_k,   dx_0 = B_0 dw_0 + c_0
///   minimise |w + dw|^2 / 2 + mu |dw|^2 / 2 + |r + J dx|^2 / 2     r, J times sqrt(rho'(d) / d)
///   dw_k     = (B_k' lambda_k - w_k) / (1 + mu)
///   x_k      sum J'J dx + lambda_k - F_{k+1}' lambda_{k+1} = -sum J' r
///   lambda_k dx_k - F_k dx_{k-1} - B_k B_k' / (1 + mu) lambda_k = c_k - B_k w_k / (1 + mu)
///
/// c_k is zero where the states are those of e. The step is that of the condensed problem: neither
/// Q_k = B_k B_k' nor P_0 is inverted, and they may have any rank. x_k and lambda_k are one pivot.
/// The block of any such pairs is [H A'; A -Q], where A is unit lower triangular in time: if it
/// takes (a, b) to zero, a' H a + b' Q b = 0, so H a = 0 and Q b = 0, so A' b = 0 and A a = 0, so
/// both are zero. So whatever the order, every pivot is nonsingular, without a threshold.
///
/// - A constant block is one variable s; it is born at the first node or by a first value, with a
///   multiplier of its own. So is each block of a landmark that is in the state.
/// - A landmark is q = dl + C dx_f, where x_f is the camera of its first observation and C is such
///   that q moves the point but the camera alone does not: q is the point itself, in units of its
///   inputs, so later observations do not tie their cameras to the first one. Its prior is
///   |l + q - C dx_f|^2 / 2.
/// - A landmark that is held at the edge of its domain (EdgeOfDomain) has n' dl = 0 and C = 0:
///   q = dl, and its observations tie their cameras to the first one.
///
/// The multipliers are scaled: lambda = alpha lambda', alpha^2 = median H_ii / median Q_ii.
class KktSystem {
 public:
  class Covariances;  // in kkt_covariance.h

  explicit KktSystem(CondensedRun& run);

  const Elimination& elimination() const { return ldl_.elimination(); }
  bool in_time_order() const { return in_time_order_; }
  double bytes() const;  ///< that a solve takes, about

  /// All inputs, from e and those where the landmarks are now; and back.
  Eigen::VectorXd Join(const Eigen::VectorXd& e) const;
  /// The landmarks become those of z. False where one is not defined.
  bool TakeLandmarks(const Eigen::VectorXd& z);
  struct Frozen {
    double change;  ///< as of CondensedRun::Freeze
    bool joined;    ///< an observation that was left out before
  };
  /// Takes Q and R at z; observations of landmarks that are not defined there are left out until
  /// they are. Nothing where it cannot be done.
  std::optional<Frozen> Freeze(const Eigen::VectorXd& z);

  /// phi(z). Nothing where a model is not defined.
  std::optional<double> Cost(const Eigen::VectorXd& z);
  /// Moves the landmarks of z to where they cost least given e, by the observations that are
  /// defined there, or by all: false then where one is not. Together they stop where less than
  /// about `left` of the cost is to gain.
  bool Settle(Eigen::VectorXd& z, bool all, double left);
  EdgeOfDomain& edge() { return edge_; }
  const EdgeOfDomain& edge() const { return edge_; }
  /// Of a step to z, where a model is not defined.
  void NoteUndefined(const Eigen::VectorXd& z) { edge_.NoteUndefined(z, at_); }
  /// At z, on the states that it gives. False where a model is not defined.
  bool Linearise(const Eigen::VectorXd& z, double damping);
  /// About `trajectory` instead, freezing there, with landmarks where they cost least, in z too.
  bool LineariseAbout(const Trajectory& trajectory, Eigen::VectorXd& z);
  /// Factorises and solves. False where a pivot is singular: a model or prior is not defined.
  bool Solve();
  struct Step {
    double cost = 0.0;  ///< where it is linearised: Linearise knows it already
    Eigen::VectorXd dz;
    double decrement = 0.0;  ///< dz' (A + mu I) dz = -dz' grad phi
  };
  const Step& step() const { return step_; }  ///< the solution
  /// The states that the step leads to, in the tangent.
  void Move(Trajectory& trajectory) const;

 private:
  using Inverse = CondensedRun::Inverse;
  static std::uint64_t KeyOf(int i, int j) {
    return (static_cast<std::uint64_t>(i) << 32U) | static_cast<std::uint32_t>(j);
  }
  /// Some rows of a tangent, and the variable that they are.
  struct Part {
    int variable;
    const std::vector<int>* rows;
  };
  struct Node {
    std::size_t first = 0, last = 0;            ///< epochs
    int column = 0, columns = 0;                ///< inputs
    int read = -1, rest = -1, multiplier = -1;  ///< variables; rows that sensors read, and others
    std::vector<std::size_t> born;              ///< constants
    Eigen::MatrixXd b;                          ///< of rows_, then of those born
  };
  struct Constant {
    std::vector<int> rows;
    int value = -1, multiplier = -1;  ///< variables
    std::size_t node = 0;             ///< that it is born at
    bool born = false;
    bool of_landmark = false;  ///< no part of the covariance of a frame
  };
  struct Point3 {           ///< a landmark
    int variable = -1;      ///< q
    int column = 0;         ///< of its inputs in z
    bool anchored = false;  ///< its observations tie their cameras to the first one
    bool ties = false;      ///< so it must be built so
    Eigen::MatrixXd c;      ///< C, by the tangent of x_f
    Inverse place;
  };
  /// Residuals that some variables have in common: their places in variables_ and blocks_.
  struct Term {
    std::size_t variables = 0, blocks = 0;
    int count = 0;
  };

  void Build();
  void FindConstants();
  void FindNodes();
  void AddConstraints(std::size_t k);
  void AddTerms();
  void ChooseOrder();
  void Tie(int i, int j);
  void AddTerm(const std::vector<int>& variables);
  void Set(int i, int j, const Eigen::MatrixXd& value);
  void Accumulate(const Eigen::MatrixXd& j, const Eigen::VectorXd& r);
  std::vector<Part> PartsOf(std::size_t k) const;
  std::vector<int> ConstantsOf(const std::vector<JacobianPart>& parts) const;
  std::vector<int> ConstantsOf(const MapLandmark& landmark) const;
  bool ReadsStates(std::size_t sensor) const;
  bool LineariseStates(const Eigen::VectorXd& z, const Trajectory* about);
  bool LinearisePlain(std::size_t k, bool about);
  bool LineariseLandmarks(const Eigen::VectorXd& z, bool about);
  bool BuildAnew();
  void AccumulatePrior(std::size_t i, Eigen::Index rows, const Eigen::VectorXd& l);
  bool LineariseLandmark(std::size_t i, const Eigen::VectorXd& l, bool about);
  void PutConstraint(std::size_t k, const Point& point, const Eigen::VectorXd& z);
  Eigen::VectorXd Multipliers(const Node& node) const;
  void ChooseScale();
  Eigen::VectorXd CameraOf(const MapLandmark& landmark, const Eigen::VectorXd& from) const;

  CondensedRun& run_;
  std::vector<int> rows_;  ///< tangent rows that move: those that sensors read, then the rest
  std::vector<int> read_rows_, rest_rows_;
  std::vector<Constant> constants_;
  std::vector<int> constant_of_;  ///< by variable; -1: it is none
  std::vector<Node> nodes_;
  std::vector<std::size_t> node_of_;  ///< by epoch
  std::vector<Point3> points_;        ///< by landmark
  EdgeOfDomain edge_;
  std::vector<int> landmark_constants_;
  std::vector<bool> left_out_;  ///< by observation of a landmark, in their order
  int inputs_ = 0;              ///< of z
  BlockLdl ldl_;
  bool in_time_order_ = true, chosen_ = false;
  std::unordered_map<std::uint64_t, std::size_t> block_of_;
  std::vector<Term> terms_;
  std::vector<int> variables_;
  std::vector<std::size_t> blocks_;
  std::size_t term_ = 0;  ///< next one

  double damping_ = 0.0, alpha_ = 1.0, next_alpha_ = 1.0;
  Eigen::VectorXd z_, rhs_, solution_;
  Step step_;
  std::vector<Point> at_;  ///< by epoch: x; of frames inside a node S and offset too
};

}  // namespace alidade::ceres_batch
