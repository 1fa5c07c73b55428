// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "condensed_run.h"

namespace alidade::ceres_batch {

/// Landmarks whose optimum is at the edge of where their models are defined, as that of a stereo
/// pair whose disparity wants to be negative. Such a one is held: it goes along the edge alone, and
/// what is solved for is the optimum of all others given that. With the outward normal n of the
/// edge, in the landmark's inputs l, and the gradient b of what it costs alone,
///
///   n' dl = 0,   n' b < 0:  it would cost less outside. Else it is let go.
///
/// z are all inputs of the run: e, and behind it those of the landmarks, in their order.
class EdgeOfDomain {
 public:
  explicit EdgeOfDomain(CondensedRun& run) : run_(run), landmarks_(run.landmarks_.size()) {}

  /// n of the edge that a landmark is held at; empty: it is free.
  const Eigen::VectorXd& normal(std::size_t landmark) const { return landmarks_[landmark].normal; }
  bool holds(std::size_t landmark) const { return normal(landmark).size() > 0; }
  std::vector<std::int64_t> Held() const;  ///< ids

  /// Of a step to z, where a model is not defined: which landmarks it is not defined for, seen from
  /// `points`, the frames.
  void NoteUndefined(const Eigen::VectorXd& z, const std::vector<Point>& points);
  /// Puts landmarks that such steps go on leading out of their domain to its edge, and holds them
  /// there. Whether there were any.
  bool Hold(Eigen::VectorXd& z);
  /// Puts those that are held back to the edge. False where they are not defined near z.
  bool PutBack(Eigen::VectorXd& z);
  /// Frees those that cost less inside. Whether there were any.
  bool LetGo(const Eigen::VectorXd& z);
  /// Frees all, where they are.
  void Free();

 private:
  struct Landmark {
    Eigen::VectorXd normal;
    int refused = 0;   ///< steps that led it out of its domain
    int released = 0;  ///< how often it was let go of an edge
  };

  template <class Take>
  void ForEach(const Take& take);
  bool HoldsAny() const;
  bool IsDefined(const MapLandmark& landmark, const Eigen::VectorXd& l,
                 const std::vector<Point>& points) const;
  std::optional<double> EdgeAlong(const MapLandmark& landmark, const Eigen::VectorXd& l,
                                  const Eigen::VectorXd& s, double begin, double end,
                                  const std::vector<Point>& points) const;
  std::optional<Eigen::VectorXd> NormalOfEdge(const MapLandmark& landmark, const Eigen::VectorXd& l,
                                              const Eigen::VectorXd& s, double t,
                                              const std::vector<Point>& points) const;

  CondensedRun& run_;
  std::vector<Landmark> landmarks_;
};

}  // namespace alidade::ceres_batch
