// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "alidade/base/eigen_alignment.h"
#include "alidade/filter/ekf.h"

namespace alidade {

struct UkfOptions {
  /// The mean of values y loses eps |y| / (2 alpha^2) to rounding: 1e-8 |y| here.
  static constexpr double kLeastAlpha = 1e-4;

  EkfOptions filter;    ///< gate, fuse and max_dt_s; `rejection_recovery` counts as kNone
  double alpha = 0.01;  ///< spread of the sigma points, in [1e-4, 1]
  double beta = 2.0;    ///< weight of what the centre adds, >= 0; 2: best for a Gaussian
  double kappa = 0.0;   ///< spread beyond the number of directions, >= 0

  /// Reads `alpha` in [1e-4, 1], `beta` >= 0, `kappa` >= 0, `gate`, `fuse` and `max_dt_s` from an
  /// estimator's entry of the config. Errors: kBadConfig.
  static UkfOptions FromNode(const Node& entry);
  /// What FromNode reads.
  static std::vector<ParamInfo> Schema();
};

/// Unscented Kalman filter: moments of y = g(x), x ~ N(x0, A A'), from 2N + 1 sigma points, A from
/// the pivoted L D L' of P, which may be singular.
///
///   points     x0,  x0 (+) c a_i,  x0 (+) -c a_i        a_i: columns of A, i = 1 ... N
///   spread     c^2 = alpha^2 (N + kappa),   w = 1 / (2 c^2)
///   mean       y = g(x0) (+) m,   m = w sum f_i         f_i = g(x_i) (-) g(x0), at the mean
///   moments    Cov(y) = w sum f_i f_i' + (beta - alpha^2) m m',   Cov(x, y) = w sum dx_i f_i'
///
/// This is the scaled transform without its large weight of the centre, which cancels. The mean on
/// a manifold is found by iteration. Process noise is augmented: N = n + noise inputs. Discrete
/// noise w is held over an interval: from its second step on the points are those of (x, w) with
/// Cov(x, w) = M, in the directions (b_i, 0), B B' = P - M M', and (m_j, e_j). A measurement's R is
/// that at x0; S = Cov(h) + R, K = Cov(x, h) S^-1, and with dx_i - K f_i in place of f_i the new P
/// is Cov(x - K h) + K R K', a sum of squares where beta >= alpha^2. A
/// robust loss takes R / w for R. The spread of a joint update is that of its narrowest
/// measurement; h, S and NIS are reported as the gate saw them.
///
/// Where sigma points leave the domain of a model that is defined at x0, or lie too far round a
/// manifold to have a mean, their spread is halved until they do not (event `guarded`), as long as
/// alpha stays above 1e-4: the mean loses eps |y| / (2 alpha^2) to rounding. Where they still do,
/// the measurement is out of domain, and a step ends the filter; a sensor that is not defined at x0
/// is out of domain. Where P has lost positive semi-definiteness, negative pivots count as zero
/// (event `repaired`).
///
/// Source       [Julier2004]; [Wan2000] alpha, beta, kappa.
class Ukf : public Ekf {
 public:
  /// No consider blocks and roles, none that start or are linearised at a measurement, no
  /// rejection recovery, no landmarks.
  static constexpr Support kSupport = {};

  /// ContractViolation where `system` asks for more than kSupport or an option is out of its range.
  Ukf(System system, const UkfOptions& options, const std::vector<StreamInfo>& streams);

  std::unique_ptr<Snapshot> Save() const override;
  void Restore(const Snapshot& snapshot) override;

 protected:
  /// @cond
  bool StepOnce(double dt_s) override;
  Outcome Linearise(Row& row) override;
  void Project(Row& row) override;
  Outcome Apply(std::span<Row* const> rows) override;

 private:
  struct Kept;
  /// Weights of the transform with 2N sigma points besides the centre.
  struct Transform {
    double c, w;
    double centre;  ///< beta - alpha^2
  };
  /// What the sigma points make of one measurement.
  struct Predicted {
    int halvings = 0;            ///< of the spread
    std::vector<double> centre;  ///< h(x0)
    std::vector<double> f;       ///< m x 2n by columns
    std::vector<double> m;
  };
  struct Moments {
    Workspace::Matrix f;
    Workspace::Vector m;
  };

  Transform TransformOf(Eigen::Index directions, int halvings) const;
  bool MayHalve(int halvings) const;
  const Eigen::MatrixXd& Root();
  const Eigen::MatrixXd& RootWithoutHeld();
  void TakeHeld(const Workspace::Matrix& f, double c);
  Status StepPoints(int halvings, double dt_s);
  Status StepPoint(const double* from, const double* noise, double dt_s, double* to);
  Outcome Predict(Row& row, int halvings);
  Moments MomentsAt(const Row& row);
  Outcome StackPoints(std::span<Row* const> rows, int halvings, Stacked& all,
                      Workspace::Vector& mean);
  void NoteGuard(std::size_t index, int halvings, bool narrow_enough);

  UkfOptions spread_;
  Eigen::MatrixXd root_;  ///< of P
  bool root_is_current_ = false;
  Eigen::MatrixXd held_;              ///< M, while an interval goes on
  std::vector<Predicted> predicted_;  ///< by report
  std::vector<bool> guarded_;         ///< by sensor; the last: the motion
  // Memory that is kept from step to step.
  Eigen::MatrixXd rest_, root_of_rest_;
  Eigen::LDLT<Eigen::MatrixXd> ldlt_;
  std::vector<const double*> x_;
  std::vector<double*> stepped_;
  std::vector<double> reported_h_, reported_innovation_;
  /// @endcond
};

}  // namespace alidade
