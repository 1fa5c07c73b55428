// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/base/eigen_alignment.h"
#include "alidade/filter/ekf.h"

namespace alidade {

/// Fixed-interval smoother: the estimate of every frame from the measurements of all. An extended
/// Kalman filter goes forward; the way back is that of Rauch, Tung and Striebel in the adjoint form
/// of Bryson and Frazier, which inverts no covariance: P may be singular. n = size of P.
///
///   estimate   x_s = x (+) P lambda,   P_s = P - P Lambda P      x, P: the filter's, of the frame
///   start      lambda = 0, Lambda = 0                            at the last frame
///   step       lambda <- F' lambda,   Lambda <- F' Lambda F
///   update     lambda <- A' lambda + H' S^-1 r,   Lambda <- A' Lambda A + H' S^-1 H,
///              A = I - K H
///
/// Discrete noise w, held over an interval, is smoothed with x. At frames inside an interval lambda
/// and Lambda are those of (x, w), with [P M] for P, M = Cov(x, w), and [F G Lq; 0 I] for F. Where
/// the interval starts, what they have of w is dropped.
///
/// All Jacobians are those of the filter, and so are R and its weight under a robust loss.
///
/// Source       [Rauch1965]; [Bierman1977] ch. X, modified Bryson-Frazier.
class RtsSmoother : public Ekf {
 public:
  /// No consider blocks and roles, none that start or are linearised at a measurement, no
  /// rejection recovery, no landmarks.
  static constexpr Support kSupport = {};

  /// `options.rejection_recovery` counts as kNone. ContractViolation where `system` asks for more
  /// than kSupport.
  RtsSmoother(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams);

  const UpdateReport& Process(const Frame& frame) override;
  bool offline() const override { return true; }
  /// None: it waits for all frames, and does not go back.
  std::unique_ptr<Snapshot> Save() const override { return nullptr; }
  /// The reports are the filter's. Event `not_pd` where rounding would leave a smoothed variance
  /// negative: the covariance of that frame is then the filter's.
  void Smooth(const Emit& emit) override;

 protected:
  /// @cond
  bool StepOnce(double dt_s) override;
  Outcome Apply(std::span<Row* const> rows) override;

 private:
  /// How the adjoint goes back over a frame: lambda <- A' lambda + b, Lambda <- A' Lambda A +
  /// information. Where the frame starts inside an interval, A has columns for w behind those of x.
  struct Adjoint {
    Eigen::MatrixXd a;  ///< n x n, or n x (n + n_w)
    Eigen::VectorXd b;
    Eigen::MatrixXd information;

    /// This one, and then what comes later in time.
    void Append(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                const Eigen::MatrixXd& information);
    void GoBack(Eigen::Index held, Eigen::VectorXd& lambda, Eigen::MatrixXd& later) const;
  };
  /// One frame, and the filter's estimate after it.
  struct Passed {
    Adjoint adjoint;
    std::vector<double> x;
    Eigen::MatrixXd p;
    Eigen::MatrixXd m;  ///< M inside an interval, else n x 0
    UpdateReport report;
  };

  std::vector<Passed> passed_frames_;
  Adjoint current_;
  /// @endcond
};

}  // namespace alidade
