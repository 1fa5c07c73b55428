// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "condensed_run.h"

namespace alidade::ceres_batch {

/// The maximum a posteriori of the data so far, frame after frame, where what a frame does not
/// touch is kept: the system of KktSystem without damping, about states, landmarks and constants
/// that are linearised anew only once they have moved [Kaess2012], eliminated forward in time.
///
///   node   k: as of a KktSystem, with its state x_k, the multiplier lambda_k of the motion to it
///   E_k    motion to node k, its measurements, and the priors of landmarks that begin there
///   R_k    the matrix of x_k, lambda_k, the constants and the landmarks that go on:
///          R_k = C - B D^-1 B' of  R_{k-1} + E_k = [D B'; B C],   D: x_{k-1}, lambda_{k-1}, and
///                                                                 landmarks not seen any more
///
/// So a frame takes one step from R_{k-1} to R_k, and its estimate and covariance are those of R_k
/// alone. Then the steps go back, until what moves is too little to tell; what has moved by more
/// than a share of its standard deviation, as it was when it was the newest, is linearised anew
/// with all that was measured of it, and the steps from the first E_k that this changes are taken
/// again. It ends where nothing has moved that much. So the share is a bound of the distance to
/// where the models were linearised; the smaller it is, the nearer is the batch.
///
/// A landmark that has not been seen for some nodes leaves R_k. Where it is seen again the steps
/// from there on are taken again, and it stays for twice as long.
class IncrementalSolve {
 public:
  IncrementalSolve(CondensedRun& run, double relinearise_above);

  /// With the frames that the run has more than before. False, and problem(), where the estimates
  /// do not settle or a model is not defined: it can go on from a Restart, unless ended().
  bool Solve();
  /// At the solution e, with the landmarks that the run has, of all its frames.
  bool Restart(const Eigen::VectorXd& e);

  /// Of the last frame: its values, and P.
  std::vector<double> Values() const { return ValuesOf(nodes_.size() - 1, true); }
  Eigen::MatrixXd Covariance() const;
  /// `map`, the landmarks that a filter has: place and covariance. Linear in the frames.
  bool PutMap(std::vector<LandmarkEstimate>& map) const;
  const std::string& problem() const { return problem_; }
  /// Whether there is no going on: a landmark ties its first camera to those that see it later, or
  /// the prior is so vague that steps forward in time lose digits.
  bool ended() const { return ended_; }

 private:
  using Inverse = CondensedRun::Inverse;
  /// Residuals, by the rows of x_k that sensors read, the constants, and q of a landmark.
  struct Term {
    int factor = -1;    ///< of the node's last epoch; -1: the prior of the landmark
    int landmark = -1;  ///< -1: none
    Eigen::MatrixXd j;
    Eigen::VectorXd r;  ///< empty: it is not defined as yet
  };
  struct Node {
    std::size_t first = 0, last = 0;   ///< epochs
    int column = 0, columns = 0;       ///< inputs
    std::vector<std::size_t> born;     ///< constants
    std::vector<std::size_t> retired;  ///< landmarks that the step to it eliminates
    // Its motion: rows of x_k, then of the constants born.
    Eigen::MatrixXd f, b;  ///< by x_{k-1} and the constants, by w
    Eigen::VectorXd c;     ///< by which the motion misses x_k
    double alpha = 1.0;    ///< lambda = alpha lambda'
    std::vector<Term> terms;
    // What the step to it leaves, and what it eliminated.
    std::vector<int> variables;
    Eigen::MatrixXd r;      ///< R_k, m x m, lower triangle; empty: not kept
    Eigen::VectorXd right;  ///< m
    Eigen::MatrixXd x;      ///< D^-1 B', p x m
    Eigen::VectorXd y;      ///< D^-1 of the p rows of its right side
    // Its solution.
    Eigen::VectorXd dx, lambda;
    Eigen::VectorXd sigma;  ///< of x_k, given the data up to it; empty: not known yet
  };
  struct Constant {
    std::vector<int> rows;
    int column = 0;  ///< among those of all constants
    bool born = false;
    std::size_t node = 0;  ///< that it is born at
    Eigen::VectorXd dx, lambda, sigma;
  };
  struct Landmark {
    Eigen::VectorXd l;  ///< linearised at
    Inverse place;
    Eigen::MatrixXd c;      ///< q = dl + C dx_f; by what a Term has columns of
    Eigen::VectorXd q;      ///< solution
    Eigen::VectorXd sigma;  ///< of q; empty: it is not in the problem yet
    std::size_t node = 0;   ///< of its prior
    std::size_t seen = 0;   ///< last
    std::size_t patience = 0;
    std::optional<std::size_t> retired;  ///< at
  };
  /// What has moved since it was linearised.
  struct Moved {
    std::set<std::size_t> nodes, landmarks;
    bool constants = false;
    double largest = 0.0;  ///< share of a standard deviation
    bool any() const { return constants || !nodes.empty() || !landmarks.empty(); }
  };
  /// Variables of a node, which have a place each.
  enum : int { kState = -2, kMultiplier = -1 };
  int ValueOf(std::size_t constant) const { return static_cast<int>(2 * constant); }
  int MultiplierOf(std::size_t constant) const { return static_cast<int>(2 * constant + 1); }
  int VariableOf(std::size_t landmark) const {
    return static_cast<int>(2 * constants_.size() + landmark);
  }
  Eigen::VectorXd& SolutionOf(std::size_t node, int variable);
  int SizeOf(int variable) const;

  bool Fail(const std::string& why);
  void Clear();
  bool Extend();
  bool AddNode(std::size_t epoch);
  bool Predict(std::size_t k);
  void BearConstants(std::size_t k);
  bool SeeLandmarks(std::size_t k);
  void Touch(std::size_t node);
  bool LineariseMotion(std::size_t k);
  bool LineariseLandmark(std::size_t i);
  bool LineariseTerm(std::size_t k, Term& term);
  bool LineariseTerms(std::size_t k, const std::set<std::size_t>* landmarks);
  void LinearisePrior(Term& term) const;
  void ChooseScale(Node& node) const;
  bool Relinearise(const Moved& moved);
  bool Eliminate();
  Eigen::Index PlaceVariables(std::size_t k);
  void PutBefore(std::size_t k);
  bool StepTo(std::size_t k);
  void AddMotion(std::size_t k, Eigen::Index p);
  void AddTerm(const Term& term, Eigen::Index p);
  bool LosesDigits(std::size_t k);
  void PutSigmas(std::size_t k);
  std::optional<std::size_t> SolveRoot();
  std::size_t SolveBack(std::size_t least);
  /// What changes less, in sigma, is not told to the nodes before.
  double Kept() const { return 0.01 * above_; }
  Moved FindMoved(std::size_t from) const;
  bool IsExact(std::size_t constant, int row) const;
  std::vector<double> ValuesOf(std::size_t k, bool constants) const;
  Eigen::VectorXd InputsOf(std::size_t k) const;
  Eigen::VectorXd InputsOfLandmark(std::size_t i, bool constants) const;
  bool StoreLandmarks();
  bool PutMapOfRun(std::vector<LandmarkEstimate>& map) const;

  CondensedRun& run_;
  double above_;
  std::vector<int> rows_, read_;  ///< of the tangent: x_k, and those first that sensors read
  std::vector<Constant> constants_;
  int constant_rows_ = 0;
  std::vector<Node> nodes_;
  std::vector<std::size_t> node_of_;  ///< by epoch
  std::vector<Landmark> landmarks_;   ///< those of the run
  std::vector<Point> at_;             ///< by epoch: x, linearised at
  Eigen::VectorXd e_;                 ///< inputs, linearised at
  std::size_t touched_ = 0;           ///< the first node whose E_k is not in its R_k
  std::size_t back_ = 0;  ///< the first that was eliminated anew since the last solution
  std::vector<Eigen::Index> places_;  ///< in the step taken last, of constants and landmarks
  Eigen::MatrixXd front_;             ///< of that step, the lower triangle; and what follows
  Eigen::VectorXd right_;             ///< its right side
  Eigen::PartialPivLU<Eigen::MatrixXd> root_;  ///< of the last R_k
  std::string problem_;
  bool ended_ = false;
};

}  // namespace alidade::ceres_batch
