// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>

#include "alidade/base/all_finite.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/delayed_initialisation.h"
#include "alidade/model/geometry.h"
#include "alidade/state/dense_algebra.h"
#include "condensed_run.h"
#include "plugins/ceres/difference.h"

/// The models of a CondensedRun: their values, derivatives and noise at a point of it.
namespace alidade::ceres_batch {
namespace {

/// d = z (-) h and, unless null, j = dd/dh (row-major), in the tangent at h.
void Difference(const Geometry& geometry, const double* z, const double* h, double* d, double* j) {
  const int size = geometry.tangent;
  geometry.Minus(z, h, d);
  if (j == nullptr) return;
  Eigen::Map<RowMajor> whole(j, size, size);
  whole = -RowMajor::Identity(size, size);
  geometry.ForEachPart([&](const Geometry& part, int a, int t) {
    VisitGeometry(part.row().number, [&]<class G>(G) {
      double unused[G::kTangent], block[G::kTangent * G::kTangent];
      ceres_batch::Difference<G>(z + a, h + a, unused, block);
      whole.block(t, t, part.tangent, part.tangent) =
          Eigen::Map<const RowMajor>(block, part.tangent, part.tangent);
    });
  });
}

/// Why a sensor model gives nothing.
std::string Why(Outcome outcome, const SensorModel& model) {
  return outcome == Outcome::kFailed ? model.error_text() : "out of its domain";
}

/// B <- L^-1 B, L the lower triangle of `l`. Of few rows.
template <class B>
void Whiten(const Eigen::MatrixXd& l, B& b) {
  for (Eigen::Index i = 0; i < l.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) b.row(i) -= l(i, j) * b.row(j);
    b.row(i) /= l(i, i);
  }
}

/// `sensor 'NAME' at TIME`
std::string TextOf(const SensorBinding& sensor, const Measurement& measurement) {
  return "sensor '" + sensor.name + "' at " + internal::SecondsText(measurement.timestamp);
}

}  // namespace

/// x = f(x, u, L e, dt); S = F S + [0  G L  0], which adds to what held inputs did before, and
/// offset = F offset, in the rows of the model.
bool CondensedRun::Move(const Step& step, const double* e, Point& point) const {
  const MotionBinding& motion = binding_.problem.motions[step.motion];
  const internal::MotionPlace& place = binding_.motion_places[step.motion];
  const int n = motion.model->tangent_size(), n_w = motion.model->noise_size();
  Eigen::VectorXd w = Eigen::VectorXd::Zero(n_w);  // the mean, until L is taken
  if (step.l.size() > 0) w = step.l * Eigen::Map<const Eigen::VectorXd>(e + step.column, n_w);
  const bool sensitivity = point.s.rows() > 0;
  RowMajor f(n, n), g(n, n_w);
  std::vector<double> next(point.x.size());
  const Outcome outcome = internal::StepAt(
      motion, place, point.x.data(), step.u.data(), w.data(), step.dt_s,
      {next.data(), sensitivity ? f.data() : nullptr, sensitivity ? g.data() : nullptr});
  if (outcome != Outcome::kAccepted) return Fail(internal::StepErrorOf(motion, outcome).text());
  internal::TakeStep(place, next.data(), point.x.data());
  if (!sensitivity) return true;

  std::vector<int> own, rows;  // of F and of S: those of blocks that are not constant
  for (int i = 0; i < n; ++i) {
    const int row = place.at[static_cast<std::size_t>(i)];
    if (row < 0) continue;
    own.push_back(i);
    rows.push_back(row);
  }
  const Eigen::MatrixXd f_own = f(own, own), gl = g(own, Eigen::all) * step.l;
  const auto before = Eigen::seqN(0, point.ColumnOf(step.columns)),
             inputs = Eigen::seqN(point.ColumnOf(step.column), n_w);
  point.s(rows, before) = (f_own * point.s(rows, before)).eval();
  point.s(rows, inputs) += gl;
  point.offset(rows) = (f_own * point.offset(rows)).eval();
  return true;
}

/// y = g(x, z (+) d, prior) and its Jacobians.
bool CondensedRun::Invert(const Factor& factor, const Eigen::VectorXd& d, const double* prior,
                          const Point& point, const std::string& name, Inverse& inverse) const {
  const SensorBinding& sensor = SensorOf(factor);
  const Geometry& measured = sensor.model->measurement().geometry;
  const internal::SensorPlace& place =
      binding_.sensor_places[static_cast<std::size_t>(factor.sensor)];
  Measurement measurement = factor.measurement;
  double* const z = measurement.values.data();
  RowMajor j_plus(measured.tangent, measured.tangent);
  PlusJacobian(measured, z, d.data(), j_plus.data());
  measured.Plus(z, d.data(), z);
  internal::Roles roles;
  internal::RolesAt(place, point.x.data(), point.x.data(), roles);
  internal::InverseMeasurement at;
  const Outcome outcome = internal::InvertAt(sensor, place, measurement, prior, roles, at);
  if (outcome != Outcome::kAccepted) {
    return Fail("sensor '" + sensor.name + "' gives " + name +
                " no first value: " + Why(outcome, *sensor.model));
  }
  inverse.y = std::move(at.y);
  inverse.by_d = at.by_z * j_plus;
  inverse.by_prior = at.by_prior;
  inverse.by_x = Eigen::MatrixXd::Zero(inverse.by_d.rows(), initial_.covariance().size());
  Eigen::Index column = 0;
  for (const BlockId id : at.from) {
    const Block& block = initial_.layout()[id];
    const int width = block.geometry().tangent;
    inverse.by_x.middleCols(block.tangent_offset, width) += at.by_x.middleCols(column, width);
    column += width;
  }
  return true;
}

/// y = g(x, z'), z' = z (+) L e; S_y = J_y_x S + [0  J_y_z' J_z' L  0], offset_y = J_y_x offset.
bool CondensedRun::Initialise(const FirstValue& first, const Factor& factor, const double* e,
                              Point& point) const {
  const Block& block = initial_.layout()[first.block];
  const int m = SensorOf(factor).model->measurement().geometry.tangent;
  Eigen::VectorXd d = Eigen::VectorXd::Zero(m);
  if (factor.l.size() > 0) d = factor.l * Eigen::Map<const Eigen::VectorXd>(e + first.column, m);
  Inverse inverse;
  if (!Invert(factor, d, nullptr, point, '\'' + block.name + '\'', inverse)) return false;
  std::ranges::copy(inverse.y, point.x.begin() + block.value_offset);
  if (point.s.rows() == 0 || !block.has_covariance()) return true;
  const int t = block.geometry().tangent;
  Eigen::MatrixXd rows = inverse.by_x * point.s;
  const Eigen::VectorXd offset = inverse.by_x * point.offset;
  rows.middleCols(point.ColumnOf(first.column), m) = inverse.by_d * factor.l;
  point.s.middleRows(block.tangent_offset, t) = rows;
  point.offset.segment(block.tangent_offset, t) = offset;
  return true;
}

/// x and, behind, y of a landmark. Until the next call.
const std::vector<double>& CondensedRun::Joined(const std::vector<double>& x,
                                                const std::vector<double>& y) const {
  memory_.x = x;
  memory_.x.insert(memory_.x.end(), y.begin(), y.end());
  return memory_.x;
}

/// Until the next call.
const double* const* CondensedRun::RolesOf(const Factor& factor,
                                           const std::vector<double>& x) const {
  internal::RolesAt(PlaceOf(factor), x.data(), x.data(), memory_.roles);
  return memory_.roles.data();
}

/// h and, unless null, H in the columns of its place.
Outcome CondensedRun::See(const Factor& factor, const std::vector<double>& x,
                          std::vector<double>& h, std::vector<double>* jacobian) const {
  const internal::SensorPlace& place = PlaceOf(factor);
  h.resize(static_cast<std::size_t>(place.ambient));
  if (jacobian != nullptr) {
    jacobian->resize(static_cast<std::size_t>(place.dof) * static_cast<std::size_t>(place.width));
  }
  return internal::EvaluateAt(ModelOf(factor), place, factor.measurement, RolesOf(factor, x),
                              {h.data(), jacobian == nullptr ? nullptr : jacobian->data()});
}

/// r = L^-1 (z (-) h), m, and unless null a = dr/dx, m x n, that of its landmark behind.
bool CondensedRun::Residual(const Factor& factor, const std::vector<double>& x, Eigen::VectorXd& r,
                            Eigen::MatrixXd* a) const {
  const SensorBinding& sensor = SensorOf(factor);
  const SensorModel& model = ModelOf(factor);
  const Geometry& geometry = model.measurement().geometry;
  if (factor.l.size() == 0) {
    return Fail(TextOf(sensor, factor.measurement) + ": not defined at the start");
  }
  std::vector<double>&h = memory_.h, &jacobian = memory_.jacobian;
  const Outcome outcome = See(factor, x, h, a == nullptr ? nullptr : &jacobian);
  if (outcome != Outcome::kAccepted) {
    return Fail(TextOf(sensor, factor.measurement) + ": " + Why(outcome, model));
  }
  const int m = geometry.tangent;
  r.resize(m);
  RowMajor& j_r_h = memory_.j_r_h;
  j_r_h.resize(m, m);
  Difference(geometry, factor.measurement.values.data(), h.data(), r.data(),
             a == nullptr ? nullptr : j_r_h.data());
  Whiten(factor.l, r);
  bool finite = r.allFinite();
  if (a != nullptr) {
    const internal::SensorPlace& place = PlaceOf(factor);
    const Eigen::Map<const RowMajor> j_h(jacobian.data(), m, place.width);
    const int width = factor.row < 0 && ObservesLandmarks(sensor)
                          ? place.parts.back().offset + place.parts.back().size
                          : initial_.covariance().size();
    a->setZero(m, width);
    Whiten(factor.l, j_r_h);
    for (const JacobianPart& part : place.parts) {
      a->middleCols(part.offset, part.size) +=
          j_r_h.lazyProduct(j_h.middleCols(part.column, part.size));
    }
    finite = finite && a->allFinite();
  }
  return finite || Fail("sensor '" + sensor.name + "' predicts what is not finite");
}

bool CondensedRun::FreezeStep(Step& step, const Point& point) {
  if (!step.begins) {
    step.l = held_l_[step.motion];
    return true;
  }
  const MotionBinding& motion = binding_.problem.motions[step.motion];
  const internal::MotionPlace& place = binding_.motion_places[step.motion];
  RowMajor l(motion.model->noise_size(), motion.model->noise_size());
  const Outcome outcome = internal::StepAt(motion, place, point.x.data(), step.u.data(), nullptr,
                                           step.dt_s, {.l = l.data()});
  if (outcome != Outcome::kAccepted) return Fail(internal::StepErrorOf(motion, outcome).text());
  NoteChange(step.l, l);
  step.l = std::move(l);
  if (place.holds) held_l_[step.motion] = step.l;
  return true;
}

bool CondensedRun::FreezeFactor(Factor& factor, const std::vector<double>& x) {
  const SensorModel& model = ModelOf(factor);
  const int m = model.measurement().geometry.tangent;
  std::vector<double> root(static_cast<std::size_t>(m * m)), r(root.size());
  const Outcome outcome = internal::NoiseAt(model, PlaceOf(factor), factor.measurement,
                                            RolesOf(factor, x), root.data(), r.data());
  const std::string noise = "the noise of " + TextOf(SensorOf(factor), factor.measurement);
  if (outcome != Outcome::kAccepted) return Fail(noise + ": " + Why(outcome, model));
  const Eigen::Map<const RowMajor> covariance(r.data(), m, m);
  if (!internal::AllFinite(r)) return Fail(noise + " is not finite");
  Eigen::MatrixXd l;
  if (factor.outcome == Outcome::kInitialised) {  // L is not inverted
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
    internal::SquareRootOf(covariance, ldlt, l);
  } else {
    const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
    if (llt.info() != Eigen::Success) {
      return Fail(noise + " is not positive definite: a batch needs sigma > 0, and its square");
    }
    l = llt.matrixL();
  }
  NoteChange(factor.l, l);
  factor.l = l;
  return true;
}

}  // namespace alidade::ceres_batch
