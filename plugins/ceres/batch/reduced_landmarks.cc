// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "alidade/estimation/landmark_representation.h"
#include "alidade/state/dense_algebra.h"
#include "condensed_run.h"

/// A CondensedRun with landmarks as a problem in e alone, and the map that belongs to a solution.
namespace alidade::ceres_batch {

/// The points of e, by frame.
bool CondensedRun::PointsOf(const Eigen::VectorXd& e, bool sensitivity,
                            std::vector<Point>& points) const {
  const auto keep = [&](std::size_t, const Point& point) { points.push_back(point); };
  return ForEachFrame(e, epochs_.size(), keep, sensitivity);
}

bool CondensedRun::Reduce(const Eigen::VectorXd& e, bool derivatives, Reduced& reduced) {
  std::vector<Point> points;
  if (!PointsOf(e, derivatives, points) ||
      !Project(e, points, Undefined::kFails, derivatives, reduced)) {
    return false;
  }
  return !derivatives || reduced.llt.info() == Eigen::Success ||
         Fail("the normal matrix is not positive definite");
}

/// The measurements of no landmark.
bool CondensedRun::AddPlain(const std::vector<Point>& points, Undefined undefined,
                            Information* information, double& cost) const {
  const int n = initial_.covariance().size();
  const auto d = std::ssize(read_);
  Eigen::VectorXd r;
  Eigen::MatrixXd a;
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (const Factor& factor : epochs_[k].factors) {
      if (factor.row < 0 || factor.left_out) continue;
      if (!Residual(factor, points[k].x, r, information != nullptr ? &a : nullptr)) {
        if (undefined == Undefined::kFails) return false;
        continue;
      }
      const RobustLoss& loss = SensorOf(factor).loss;
      cost += Rho(loss, r.norm());
      if (information == nullptr) continue;
      const double w = Weight(loss, r.norm());
      const Eigen::MatrixXd a_x = Packed(a.leftCols(n).transpose());
      const auto here = d * static_cast<Eigen::Index>(k);
      information->h.block(here, here, d, d) += internal::ProductTransposed(w * a_x, a_x);
      information->g.segment(here, d) += internal::Product(w * a_x, r);
    }
  }
  return true;
}

/// phi and its derivatives at the points, from the landmarks settled there.
bool CondensedRun::Project(const Eigen::VectorXd& e, const std::vector<Point>& points,
                           Undefined undefined, bool derivatives, Reduced& reduced) {
  const auto d = std::ssize(read_), size = d * std::ssize(points);
  Information information;
  if (derivatives) {
    information.h = Eigen::MatrixXd::Zero(size, size);
    information.g = Eigen::VectorXd::Zero(size);
    information.first.resize(points.size());
    std::iota(information.first.begin(), information.first.end(), std::size_t{0});
  }
  Information* const into = derivatives ? &information : nullptr;
  reduced.cost = 0.5 * e.squaredNorm();
  if (!AddPlain(points, undefined, into, reduced.cost)) return false;
  Normal normal;
  for (MapLandmark& landmark : landmarks_) {
    if (!OptimiseLandmark(landmark, points, undefined) ||
        !NormalOf(landmark, landmark.l, points, undefined, normal, into)) {
      return false;
    }
    reduced.cost += normal.cost;
    if (!derivatives || d == 0 || normal.b.size() == 0) continue;
    // H -= B C^-1 B', g -= B C^-1 b
    const Eigen::LLT<Eigen::MatrixXd> c(normal.c);
    for (std::size_t i = 0; i < normal.epochs.size(); ++i) {
      const auto row = d * static_cast<Eigen::Index>(normal.epochs[i]);
      const Eigen::MatrixXd gain = c.solve(normal.ties[i].transpose()).transpose();
      information.g.segment(row, d) -= internal::Product(gain, normal.b);
      std::size_t& earliest = information.first[normal.epochs[i]];
      earliest = std::min(earliest, normal.epochs.front());
      for (std::size_t k = 0; k <= i; ++k) {
        const auto column = d * static_cast<Eigen::Index>(normal.epochs[k]);
        information.h.block(row, column, d, d) -= internal::ProductTransposed(gain, normal.ties[k]);
      }
    }
  }
  if (!derivatives) return true;
  for (MapLandmark& landmark : landmarks_) landmark.from = landmark.l;
  const Eigen::MatrixXd a = Assemble(e, points, information, reduced.g);
  if (!reduced.g.allFinite() || !a.allFinite()) {
    return Fail("the normal equations of the batch are not finite");
  }
  reduced.llt.compute(a);
  return true;
}

/// A = I + S' H S, g = e + S' (g_x + H offset), for S of all points, which is lower triangular by
/// frames: no state depends on a later input. The lower triangle of A.
Eigen::MatrixXd CondensedRun::Assemble(const Eigen::VectorXd& e, const std::vector<Point>& points,
                                       const Information& information, Eigen::VectorXd& g) const {
  const auto d = std::ssize(read_), size = d * std::ssize(points);
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(inputs_, inputs_);
  g = e;
  if (size == 0) return a;
  const Eigen::MatrixXd& h = information.h;
  Eigen::MatrixXd s(size, inputs_), h_s = Eigen::MatrixXd::Zero(size, inputs_);
  Eigen::VectorXd offset(size);
  const auto begin = [&](std::size_t k) {
    return k < points.size() ? Eigen::Index{epochs_[k].column} : Eigen::Index{inputs_};
  };
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto row = d * static_cast<Eigen::Index>(k);
    s.middleRows(row, d) = Packed(points[k].s);
    offset.segment(row, d) = points[k].offset(read_);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {  // H S, H = L + L' by blocks
    const auto row = d * static_cast<Eigen::Index>(k);
    const auto first = d * static_cast<Eigen::Index>(information.first[k]);
    const Eigen::MatrixXd own = h.block(row, row, d, d).selfadjointView<Eigen::Lower>();
    const auto before = h.block(row, first, d, row - first);
    const auto here = s.block(row, 0, d, begin(k + 1));
    h_s.block(row, 0, d, here.cols()) += internal::Product(own, here);
    h_s.block(row, 0, d, begin(k)) +=
        internal::Product(before, s.block(first, 0, row - first, begin(k)));
    h_s.block(first, 0, row - first, here.cols()) += internal::TransposedProduct(before, here);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto row = d * static_cast<Eigen::Index>(k), first = begin(k), end = begin(k + 1);
    a.block(first, 0, end - first, end) += internal::TransposedProduct(
        s.block(row, first, size - row, end - first), h_s.block(row, 0, size - row, end));
  }
  const Eigen::VectorXd g_x = information.g + h.selfadjointView<Eigen::Lower>() * offset;
  g += s.transpose() * g_x;
  return a;
}

/// A landmark moves with e by M = J (J_y_x S_k - J_y_l C^-1 B' S), and by its own inputs besides:
/// P = M Cov(e) M' + J J_y_l C^-1 J_y_l' J', with J = dp/dy.
bool CondensedRun::PutMap(const Eigen::VectorXd& e, const Eigen::MatrixXd& u,
                          std::vector<LandmarkEstimate>& map) {
  std::vector<Point> points;
  if (!PointsOf(e, true, points)) return false;
  Information unused;
  for (LandmarkEstimate& estimate : map) {
    const auto found = std::ranges::find_if(landmarks_, [&](const MapLandmark& landmark) {
      return landmark.id == estimate.id && landmark.generation == estimate.generation;
    });
    if (found == landmarks_.end() || found->l.size() == 0) continue;  // known exactly
    Inverse place;
    Normal normal;
    if (!Place(*found, found->l, points, place) ||
        !NormalOf(*found, found->l, points, Undefined::kSkipped, normal, &unused)) {
      return false;
    }
    const Eigen::LLT<Eigen::MatrixXd> c(normal.c);
    Eigen::MatrixXd p =
        internal::Product(place.by_d, c.solve(Eigen::MatrixXd(place.by_d.transpose())));
    if (inputs_ > 0) {  // Eigen solves for one column at least
      Eigen::MatrixXd m = Eigen::MatrixXd::Zero(normal.b.size(), inputs_);
      for (std::size_t i = 0; i < normal.epochs.size(); ++i) {
        m += internal::TransposedProduct(normal.ties[i], Packed(points[normal.epochs[i]].s));
      }
      m = internal::Product(-place.by_d, c.solve(m));
      if (found->first) m += internal::Product(place.by_x, points[found->first->epoch].s);
      const Eigen::MatrixXd y = u.transpose().triangularView<Eigen::Lower>().solve(m.transpose());
      p += internal::TransposedProduct(y, y);
    }
    Describe(*found, p, estimate);
  }
  return true;
}

/// The point that a landmark is, where it has one.
std::optional<internal::LandmarkPoint> CondensedRun::PointOf(const MapLandmark& landmark,
                                                             const std::vector<double>& y) const {
  const std::vector<Space>& roles = ModelOf(landmark.sensor, landmark.xyz).roles();
  const auto representation = RepresentationOf(roles);
  if (!representation) return {};
  std::vector<const double*> blocks;
  const double* next = y.data();
  for (const Space& role : roles) {
    if (!role.landmark()) continue;
    blocks.push_back(next);
    next += role.geometry.ambient;
  }
  return internal::PointOf(*representation, blocks.data());
}

/// Place and covariance of a landmark whose blocks have the covariance p.
void CondensedRun::Describe(const MapLandmark& landmark, const Eigen::MatrixXd& p,
                            LandmarkEstimate& estimate) const {
  if (landmark.sensor < 0) return;
  estimate.representation = RepresentationOf(ModelOf(landmark.sensor, landmark.xyz).roles());
  estimate.tried = estimate.accepted = landmark.observed;
  estimate.position.setConstant(std::nan(""));
  estimate.covariance.setConstant(std::nan(""));
  if (!estimate.representation) {
    Eigen::Index value = 0, row = 0;
    for (const Space& role : ModelOf(landmark.sensor, landmark.xyz).roles()) {
      if (!role.landmark()) continue;
      if (role.name == "landmark_position" && role.geometry.tangent == 3) {
        estimate.position = Eigen::Map<const Eigen::Vector3d>(landmark.y.data() + value);
        estimate.covariance = p.block<3, 3>(row, row);
      }
      value += role.geometry.ambient;
      row += role.geometry.tangent;
    }
    return;
  }
  const auto last = p.rows() - 1;
  estimate.inverse_distance = IsXyz(*estimate.representation) ? std::nan("") : landmark.y.back();
  estimate.sigma = IsXyz(*estimate.representation) ? std::nan("") : std::sqrt(p(last, last));
  const auto point = PointOf(landmark, landmark.y);
  if (!point) return;
  estimate.position = point->position;
  estimate.covariance = internal::Congruence(point->jacobian, p);
}

}  // namespace alidade::ceres_batch
