// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kkt_system.h"
#include "map_solve.h"

namespace alidade::ceres_batch {

/// The maximum a posteriori of a CondensedRun by a KktSystem: Levenberg-Marquardt in all inputs
/// z = (e, l), whose damping goes up and down as in [Nielsen1999]; Gauss-Newton as long as the cost
/// falls, extrapolated from the last steps [Anderson1965]. Q and R that depend on the state are
/// frozen, the problem is solved, and so on until they settle. A step is measured by its decrement,
/// sqrt(-dz' grad phi): its length in sigmas.
class SparseSolve {
 public:
  SparseSolve(CondensedRun& run, const SolveOptions& options);

  void StopWhen(std::function<bool()> stop) { stop_ = std::move(stop); }
  void HeedStop() const;
  /// As MapSolve::SolveAll. False, and summary(), where there are no estimates, or where it would
  /// take too long or too much memory, which is found before anything is solved.
  bool SolveAll(const Trajectory& about);
  /// As MapSolve::SolveAnew.
  bool SolveAnew(const Trajectory& about, Eigen::VectorXd e);
  /// Flops of an iteration, known beforehand.
  double flops() const { return kkt_.elimination().flops; }

  /// x of a frame, and a function that makes its P, while it is taken.
  using Take = std::function<void(std::size_t frame, const std::vector<double>& x,
                                  const std::function<Eigen::MatrixXd()>& covariance)>;
  /// Gives the estimates of all frames, and `map`. False where a model is not defined.
  bool PutAll(const Take& take, std::vector<LandmarkEstimate>& map);

  /// e of the solution.
  Eigen::VectorXd inputs() const { return z_.head(run_.shape().inputs); }
  bool failed() const { return failed_; }
  const std::string& summary() const { return summary_; }
  /// As MapSolve::Note.
  void Note(Timestamp timestamp, std::vector<Event>& events) const;
  /// The event `inexact`, where rounding leaves little of the covariances that PutAll gave.
  void NoteInexact(Timestamp timestamp, std::vector<Event>& events) const;
  /// As Note, of one solve after another: and the event `edge_of_domain` where other landmarks are
  /// held there than in `told`, which becomes those.
  void NoteNew(Timestamp timestamp, std::string& told, std::vector<Event>& events) const;

 private:
  bool TooLarge();
  bool Start(const Trajectory& about);
  bool Solve(const std::function<bool()>& start);
  bool Minimise();
  bool Descend();
  struct Trial {
    Eigen::VectorXd z;
    std::optional<double> cost;  ///< none: a model is not defined there
  };
  /// Of z, landmarks that are held at the edge of their domain put back there.
  std::optional<double> CostAt(Eigen::VectorXd& z) {
    return kkt_.edge().PutBack(z) ? kkt_.Cost(z) : std::nullopt;
  }
  std::string TextOfEdge() const;
  Trial AfterStep(double predicted);
  std::optional<Trial> Extrapolated(double predicted);
  Trial NextPoint(double mu, double predicted);
  /// Why a descent ends whose steps are not short: no iterations are left, no step lowers the cost,
  /// or it is rounding that makes them.
  enum class End { kSpent, kNoneHelps, kRounding };
  bool EndUnsettled(double left, End end);

  CondensedRun& run_;
  SolveOptions options_;
  KktSystem kkt_;
  std::function<bool()> stop_;
  Eigen::VectorXd z_;
  struct Stepped {
    Eigen::VectorXd z, step;
  };
  std::deque<Stepped> last_;  ///< steps without damping, and from where
  int iterations_ = 0, solves_ = 0;
  int undefined_ = 0;  ///< of the iterations, whose full step led to where a model is not defined
  std::string summary_, note_;
  std::string ended_;    ///< how, where it has not failed
  std::string at_edge_;  ///< landmarks that the last solve holds at the edge of their domain; or ""
  bool failed_ = false;
  double inexactness_ = 0.0;  ///< as KktSystem::Covariances has it
};

}  // namespace alidade::ceres_batch
