// SPDX-License-Identifier: Apache-2.0
#include "incremental_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dense_front.h"
#include "kkt_covariance.h"

namespace alidade::ceres_batch {

IncrementalSolve::IncrementalSolve(CondensedRun& run, double relinearise_above)
    : run_(run), above_(relinearise_above) {
  const VariableRows variables = run_.FindVariables();
  rows_ = variables.moving();
  read_ = variables.read;
  for (const VariableRows::Constant& constant : variables.constants) {
    Constant& own = constants_.emplace_back();
    own.rows = constant.rows;
    own.column = constant_rows_;
    constant_rows_ += static_cast<int>(own.rows.size());
    own.dx = own.lambda = own.sigma = Eigen::VectorXd::Zero(std::ssize(own.rows));
  }
}

bool IncrementalSolve::Fail(const std::string& why) {
  problem_ = why;
  return false;
}

void IncrementalSolve::Touch(std::size_t node) { touched_ = std::min(touched_, node); }

// Frames that come.

bool IncrementalSolve::Extend() {
  for (std::size_t i = at_.size(); i < run_.epochs_.size(); ++i) {
    if (!AddNode(i)) return Fail(run_.problem());
  }
  return true;
}

/// The epoch is a node of its own, or, where noise goes on being held, the end of the last one.
bool IncrementalSolve::AddNode(std::size_t epoch) {
  const bool open = !nodes_.empty() && !run_.epochs_[nodes_.back().last].ends;
  if (!open) {
    Node& node = nodes_.emplace_back();
    node.first = epoch;
    node.column = run_.epochs_[epoch].column;
  }
  const std::size_t k = nodes_.size() - 1;
  Node& node = nodes_[k];
  node.last = epoch;
  const bool newest = epoch + 1 == run_.epochs_.size();
  node.columns = (newest ? run_.inputs_ : run_.epochs_[epoch + 1].column) - node.column;
  node_of_.push_back(k);
  at_.emplace_back();
  e_.conservativeResizeLike(Eigen::VectorXd::Zero(run_.inputs_));
  node.dx = Eigen::VectorXd::Zero(std::ssize(rows_));
  node.lambda = node.dx;
  node.sigma.resize(0);
  BearConstants(k);
  Touch(k);
  back_ = std::min(back_, k);
  return Predict(k) && LineariseMotion(k) && SeeLandmarks(k) && LineariseTerms(k, nullptr);
}

void IncrementalSolve::BearConstants(std::size_t k) {
  Node& node = nodes_[k];
  for (std::size_t i = 0; i < constants_.size(); ++i) {
    if (constants_[i].born || !run_.HasBorn(constants_[i].rows, node.first, node.last)) continue;
    constants_[i].born = true;
    constants_[i].node = k;
    node.born.push_back(i);
  }
}

/// x of its last epoch, from the estimates before it.
bool IncrementalSolve::Predict(std::size_t k) {
  const Node& node = nodes_[k];
  Point point;
  if (k > 0) {
    point.x = ValuesOf(k - 1, true);
  } else if (!run_.Begin(e_.data(), -1, point)) {
    return false;
  }
  for (std::size_t i = node.first; i <= node.last; ++i) {
    if (!run_.Advance(i, e_.data(), point)) return false;
  }
  if (k > 0) {  // a constant is one variable, about one value
    for (const Constant& constant : constants_) {
      if (!constant.born || constant.node == k) continue;
      for (const Block& block : run_.initial_.layout().blocks()) {
        if (!block.has_covariance() || block.tangent_offset != constant.rows.front()) continue;
        std::copy_n(at_[nodes_[k - 1].last].x.data() + block.value_offset, block.geometry().ambient,
                    point.x.data() + block.value_offset);
      }
    }
  }
  at_[node.last].x = point.x;
  return true;
}

/// Landmarks that the node sees: its terms, and those that come into the problem or back to it.
bool IncrementalSolve::SeeLandmarks(std::size_t k) {
  constexpr std::size_t kPatience = 10;  // nodes
  Node& node = nodes_[k];
  for (std::size_t i = landmarks_.size(); i < run_.landmarks_.size(); ++i) {
    Landmark& landmark = landmarks_.emplace_back();
    const MapLandmark& of_run = run_.landmarks_[i];
    landmark.l = of_run.l.size() > 0 ? of_run.l : of_run.from;
    landmark.q = Eigen::VectorXd::Zero(landmark.l.size());
    landmark.patience = kPatience;
  }
  const auto enter = [&](std::size_t i) {
    Landmark& landmark = landmarks_[i];
    landmark.seen = k;
    if (landmark.retired) {
      std::erase(nodes_[*landmark.retired].retired, i);
      Touch(*landmark.retired);
      landmark.retired.reset();
      landmark.patience *= 2;
    }
    if (landmark.sigma.size() > 0 || landmark.l.size() == 0) return true;
    landmark.node = k;
    landmark.sigma = Eigen::VectorXd::Zero(landmark.l.size());
    if (!LineariseLandmark(i)) return false;
    Term& term = node.terms.emplace_back();
    term.landmark = static_cast<int>(i);
    LinearisePrior(term);
    return true;
  };
  const std::vector<Factor>& factors = run_.epochs_[node.last].factors;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const Factor& factor = factors[i];
    const bool of_landmark = factor.row < 0 && factor.landmark >= 0;
    if (factor.row < 0 && !of_landmark) continue;
    if (of_landmark) {
      const auto landmark = static_cast<std::size_t>(factor.landmark);
      if (landmarks_[landmark].l.size() == 0 && !LineariseLandmark(landmark)) return false;
      if (!enter(landmark)) return false;
      if (factor.outcome != Outcome::kAccepted) continue;  // the one that it began with
    }
    Term& term = node.terms.emplace_back();
    term.factor = static_cast<int>(i);
    term.landmark = of_landmark ? factor.landmark : -1;
  }
  for (std::size_t i = 0; k > 0 && i < landmarks_.size(); ++i) {
    Landmark& landmark = landmarks_[i];
    const bool in = landmark.sigma.size() > 0 && !landmark.retired;
    if (!in || k - landmark.seen <= landmark.patience) continue;
    landmark.retired = k;
    node.retired.push_back(i);
  }
  return true;
}

// Linearised.

bool IncrementalSolve::LineariseMotion(std::size_t k) {
  Node& node = nodes_[k];
  const auto n = Eigen::Index{run_.initial_.covariance().size()};
  Point point;
  if (k == 0) {
    if (!run_.Begin(e_.data(), node.columns, point)) return false;
  } else {
    point.x = at_[nodes_[k - 1].last].x;
    point.s.setZero(n, n + node.columns);
    point.s.leftCols(n).setIdentity();
    point.offset.setZero(n);
    point.before = node.column - static_cast<int>(n);
  }
  for (std::size_t i = node.first; i <= node.last; ++i) {
    if (!run_.FreezeEpoch(run_.epochs_[i], e_.data(), point)) return false;
    if (i < node.last) at_[i].x = point.x;
  }
  run_.PutAbout(at_[node.last].x, point);
  std::vector<int> own = rows_, before = rows_;
  for (const std::size_t i : node.born) {
    own.insert(own.end(), constants_[i].rows.begin(), constants_[i].rows.end());
  }
  for (const Constant& constant : constants_) {
    before.insert(before.end(), constant.rows.begin(), constant.rows.end());
  }
  node.b = point.s(own, Eigen::lastN(node.columns));
  node.c = point.offset(own);
  node.f.resize(0, 0);
  if (k > 0) node.f = point.s(own, before);
  return true;
}

bool IncrementalSolve::LineariseLandmark(std::size_t i) {
  const MapLandmark& landmark = run_.landmarks_[i];
  Landmark& own = landmarks_[i];
  if (!run_.Place(landmark, own.l, at_, own.place)) return false;
  if (landmark.first) {
    const auto [epoch, index] = *landmark.first;
    Factor& factor = run_.epochs_[epoch].factors[index];
    if (!run_.FreezeFactor(factor, WithLandmark(at_[epoch].x, own.place.y)) ||
        !run_.Place(landmark, own.l, at_, own.place)) {
      return false;
    }
  }
  std::vector<int> columns = read_;
  for (const Constant& constant : constants_) {
    columns.insert(columns.end(), constant.rows.begin(), constant.rows.end());
  }
  own.c = run_.FollowOf(landmark, own.place, static_cast<int>(own.l.size()))(Eigen::all, columns);
  own.place.by_x = own.place.by_x(Eigen::all, columns).eval();
  return true;
}

/// l + q - C dx_f
void IncrementalSolve::LinearisePrior(Term& term) const {
  const Landmark& landmark = landmarks_[static_cast<std::size_t>(term.landmark)];
  term.j.resize(landmark.l.size(), landmark.c.cols() + landmark.l.size());
  term.j << -landmark.c, Eigen::MatrixXd::Identity(landmark.l.size(), landmark.l.size());
  term.r = landmark.l;
}

/// r + J dx, times the root of the weight of a loss. One of a landmark that is not defined tells
/// nothing until it is.
bool IncrementalSolve::LineariseTerm(std::size_t k, Term& term) {
  constexpr double kTied = 1e-7;  // of what the camera moves the point by
  if (term.factor < 0) {
    LinearisePrior(term);
    return true;
  }
  const std::size_t epoch = nodes_[k].last;
  Factor& factor = run_.epochs_[epoch].factors[static_cast<std::size_t>(term.factor)];
  const Landmark* const landmark =
      term.landmark < 0 ? nullptr : &landmarks_[static_cast<std::size_t>(term.landmark)];
  const std::vector<double> x =
      landmark == nullptr ? at_[epoch].x : WithLandmark(at_[epoch].x, landmark->place.y);
  Eigen::VectorXd r;
  Eigen::MatrixXd a;
  if (!run_.FreezeFactor(factor, x) || !run_.Residual(factor, x, r, &a)) {
    if (landmark == nullptr || term.r.size() > 0) return false;
    factor.left_out = true;
    return true;
  }
  factor.left_out = false;
  const auto read = std::ssize(read_);
  const Eigen::Index inputs = landmark == nullptr ? 0 : landmark->l.size();
  const Eigen::Index states = read + constant_rows_;
  term.j.resize(r.size(), states + inputs);
  term.j.leftCols(read) = a(Eigen::all, read_);
  for (const Constant& constant : constants_) {
    term.j.middleCols(read + constant.column, std::ssize(constant.rows)) =
        a(Eigen::all, constant.rows);
  }
  if (inputs > 0) {
    const Inverse& place = landmark->place;
    const MapLandmark& of_run = run_.landmarks_[static_cast<std::size_t>(term.landmark)];
    const auto a_y = a.rightCols(place.by_d.rows());
    term.j.rightCols(inputs).noalias() = a_y * place.by_d;
    if (of_run.first) {
      const Eigen::MatrixXd left = a_y * (place.by_x - place.by_d * landmark->c);
      if (of_run.first->epoch == epoch) {
        term.j.leftCols(states) += left;
      } else if (left.norm() > kTied * (a_y * place.by_x).norm()) {
        ended_ = true;
        return run_.Fail("landmark " + std::to_string(of_run.id) +
                         " ties its first camera to those that see it later");
      }
    }
  }
  const double root = std::sqrt(Weight(run_.SensorOf(factor).loss, r.norm()));
  term.j *= root;
  term.r = root * r;
  return true;
}

/// Those of the node, or, unless null, only those of these landmarks.
bool IncrementalSolve::LineariseTerms(std::size_t k, const std::set<std::size_t>* landmarks) {
  for (Term& term : nodes_[k].terms) {
    const bool named = term.landmark >= 0 && landmarks != nullptr &&
                       landmarks->contains(static_cast<std::size_t>(term.landmark));
    if ((landmarks == nullptr || named) && !LineariseTerm(k, term)) return false;
  }
  ChooseScale(nodes_[k]);
  return true;
}

/// As large as the terms of the node and its noise say: any will do, and it is for rounding alone.
void IncrementalSolve::ChooseScale(Node& node) const {
  double h = 0.0, q = 0.0;
  for (const Term& term : node.terms) {
    if (term.r.size() > 0) h = std::max(h, term.j.leftCols(std::ssize(read_)).squaredNorm());
  }
  for (Eigen::Index i = 0; i < node.b.rows(); ++i) q = std::max(q, node.b.row(i).squaredNorm());
  node.alpha = h > 0.0 && q > 0.0 ? std::sqrt(h / q) : 1.0;
}

/// About where they are now.
bool IncrementalSolve::Relinearise(const Moved& moved) {
  std::set<std::size_t> nodes = moved.nodes, landmarks = moved.landmarks;
  if (moved.constants) {
    for (std::size_t k = 0; k < nodes_.size(); ++k) nodes.insert(k);
  }
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const bool in = landmarks_[i].sigma.size() > 0;
    if (in && run_.landmarks_[i].first && nodes.contains(landmarks_[i].node)) landmarks.insert(i);
  }
  // l + q; where the camera moves too, less what that moves it by.
  for (const std::size_t i : landmarks) {
    const bool follows = run_.landmarks_[i].first && nodes.contains(landmarks_[i].node);
    landmarks_[i].l =
        follows ? InputsOfLandmark(i, moved.constants) : (landmarks_[i].l + landmarks_[i].q).eval();
    landmarks_[i].q.setZero();
  }
  std::vector<std::pair<std::size_t, std::vector<double>>> values;
  for (const std::size_t k : nodes) {
    values.emplace_back(nodes_[k].last, ValuesOf(k, moved.constants));
    e_.segment(nodes_[k].column, nodes_[k].columns) = InputsOf(k);
  }
  for (auto& [epoch, x] : values) at_[epoch].x = std::move(x);
  for (const std::size_t k : nodes) nodes_[k].dx.setZero();
  if (moved.constants) {
    for (Constant& constant : constants_) constant.dx.setZero();
  }
  std::set<std::size_t> motions = nodes, changed = nodes;
  for (const std::size_t k : nodes) {
    if (k + 1 < nodes_.size()) motions.insert(k + 1);
  }
  for (const std::size_t k : motions) {
    if (!LineariseMotion(k)) return Fail(run_.problem());
    Touch(k);
  }
  for (const std::size_t i : landmarks) {
    if (!LineariseLandmark(i)) return Fail(run_.problem());
    changed.insert(landmarks_[i].node);
    for (const auto& [epoch, index] : run_.landmarks_[i].observations) {
      changed.insert(node_of_[epoch]);
    }
  }
  for (const std::size_t k : changed) {
    if (!LineariseTerms(k, nodes.contains(k) ? nullptr : &landmarks)) return Fail(run_.problem());
    Touch(k);
  }
  return true;
}

bool IncrementalSolve::Restart(const Eigen::VectorXd& e) {
  Clear();
  e_ = e;
  if (Extend()) return true;
  Clear();  // not half of it
  return false;
}

/// No frames, which Extend adds again from the inputs that there are.
void IncrementalSolve::Clear() {
  nodes_.clear();
  node_of_.clear();
  landmarks_.clear();
  at_.clear();
  touched_ = back_ = 0;
  for (Constant& constant : constants_) {
    constant.born = false;
    constant.dx.setZero();
  }
}

// Solved.

int IncrementalSolve::SizeOf(int variable) const {
  if (variable < 0) return static_cast<int>(rows_.size());
  const auto v = static_cast<std::size_t>(variable);
  if (v < 2 * constants_.size()) return static_cast<int>(constants_[v / 2].rows.size());
  return static_cast<int>(landmarks_[v - 2 * constants_.size()].l.size());
}

Eigen::VectorXd& IncrementalSolve::SolutionOf(std::size_t node, int variable) {
  if (variable == kState) return nodes_[node].dx;
  if (variable == kMultiplier) return nodes_[node].lambda;
  const auto v = static_cast<std::size_t>(variable);
  if (v >= 2 * constants_.size()) return landmarks_[v - 2 * constants_.size()].q;
  return v % 2 == 0 ? constants_[v / 2].dx : constants_[v / 2].lambda;
}

/// Takes the steps from the first node that was touched, or from the last matrix that was kept
/// before it.
bool IncrementalSolve::Eliminate() {
  constexpr std::size_t kEvery = 10;  // nodes; and of the last ones all
  std::size_t from = std::min(touched_, nodes_.size());
  while (from > 0 && nodes_[from - 1].r.size() == 0) --from;
  for (std::size_t k = from; k < nodes_.size(); ++k) {
    if (!StepTo(k)) return Fail("the batch has a singular pivot");
    if (LosesDigits(k)) return false;
    if (nodes_[k].sigma.size() == 0) PutSigmas(k);
    if (k >= kEvery && (k - kEvery) % kEvery != 0) nodes_[k - kEvery].r.resize(0, 0);
  }
  back_ = std::min(back_, from);
  touched_ = nodes_.size();
  return true;
}

/// Whether node k has measurements that know so much more of its state than the data before that a
/// step forward in time, which subtracts the one from the other, loses it: eps P-_ii H_ii.
bool IncrementalSolve::LosesDigits(std::size_t k) {
  const Node& node = nodes_[k];
  const auto n = std::ssize(rows_), read = std::ssize(read_);
  if (read == 0) return false;
  const double alpha = node.alpha, most = std::max(1e-6, 0.01 * above_);
  const auto h = node.r.diagonal().head(read), q = node.r.diagonal().segment(n, read);
  const double share = h.cwiseProduct(-q).maxCoeff() / (alpha * alpha);
  if (!(std::numeric_limits<double>::epsilon() * share > most)) return false;
  ended_ = true;
  return !Fail(
      "the prior is so vague beside what is measured that steps forward in time lose digits");
}

/// Of the variables of node k, given the data up to it.
void IncrementalSolve::PutSigmas(std::size_t k) {
  Node& node = nodes_[k];
  Eigen::VectorXd sigma;
  if (node.r.size() > 0) {
    front_ = node.r.selfadjointView<Eigen::Lower>();
    sigma = front_.partialPivLu().inverse().diagonal().cwiseMax(0.0).cwiseSqrt();
  }
  Eigen::Index row = 0;
  for (const int v : node.variables) {
    const auto own = sigma.segment(row, SizeOf(v));
    row += own.size();
    if (v == kState) node.sigma = own;
    if (v < 0) continue;
    const auto i = static_cast<std::size_t>(v);
    if (i >= 2 * constants_.size()) {
      landmarks_[i - 2 * constants_.size()].sigma = own;
    } else if (i % 2 == 0) {
      constants_[i / 2].sigma = own;
    }
  }
}

/// The variables of a node, and the places of all in the step to it: what is eliminated, then
/// those. How many rows are eliminated.
Eigen::Index IncrementalSolve::PlaceVariables(std::size_t k) {
  Node& node = nodes_[k];
  std::vector<int>& next = node.variables;
  next = {kState, kMultiplier};
  for (std::size_t i = 0; i < constants_.size(); ++i) {
    if (!constants_[i].born || constants_[i].node > k) continue;
    next.push_back(ValueOf(i));
    next.push_back(MultiplierOf(i));
  }
  places_.assign(2 * constants_.size() + landmarks_.size(), -1);
  const auto place = [&](int v) -> Eigen::Index& { return places_[static_cast<std::size_t>(v)]; };
  Eigen::Index p = k == 0 ? 0 : 2 * std::ssize(rows_);
  for (const std::size_t i : node.retired) {
    place(VariableOf(i)) = p;
    p += SizeOf(VariableOf(i));
  }
  for (std::size_t i = 0; k > 0 && i < nodes_[k - 1].variables.size(); ++i) {
    const int v = nodes_[k - 1].variables[i];
    const bool landmark = v >= static_cast<int>(2 * constants_.size());
    if (landmark && place(v) < 0) next.push_back(v);
  }
  for (const Term& term : node.terms) {
    if (term.factor < 0) next.push_back(VariableOf(static_cast<std::size_t>(term.landmark)));
  }
  Eigen::Index size = p;
  for (const int v : next) {
    if (v >= 0) place(v) = size;
    size += SizeOf(v);
  }
  front_.setZero(size, size);
  right_.setZero(size);
  return p;
}

/// Puts R_{k-1} in its place.
void IncrementalSolve::PutBefore(std::size_t k) {
  const Node& before = nodes_[k - 1];
  std::vector<RowRun> runs;
  Eigen::Index from = 0;
  for (const int v : before.variables) {
    Eigen::Index to = v == kState ? 0 : std::ssize(rows_);
    if (v >= 0) to = places_[static_cast<std::size_t>(v)];
    Append({from, to, SizeOf(v)}, runs);
    from += SizeOf(v);
  }
  AddByRuns(runs, before.r, front_);
  for (const RowRun& run : runs) {
    right_.segment(run.to, run.size) = before.right.segment(run.from, run.size);
  }
}

/// R_k, from R_{k-1} and E_k.
bool IncrementalSolve::StepTo(std::size_t k) {
  Node& node = nodes_[k];
  const Eigen::Index p = PlaceVariables(k), m = front_.rows() - p;
  if (k > 0) PutBefore(k);
  AddMotion(k, p);
  for (const Term& term : node.terms) AddTerm(term, p);
  Eigen::PartialPivLU<Eigen::MatrixXd> d;
  if (!ceres_batch::Eliminate(front_, p, d, node.x, node.r)) return false;
  node.right = right_.tail(m);
  node.y = right_.head(p);
  if (p > 0) {
    node.right.noalias() -= node.x.transpose() * node.y;
    node.y = d.solve(node.y).eval();
  }
  return true;
}

/// Adds the motion to node k, whose variables begin at row p.
void IncrementalSolve::AddMotion(std::size_t k, Eigen::Index p) {
  const Node& node = nodes_[k];
  const auto n = std::ssize(rows_);
  std::vector<Eigen::Index> values, multipliers;  // places
  for (Eigen::Index i = 0; i < n; ++i) {
    values.push_back(p + i);
    multipliers.push_back(p + n + i);
  }
  const auto place = [&](int v) { return places_[static_cast<std::size_t>(v)]; };
  for (const std::size_t born : node.born) {
    for (int i = 0; i < SizeOf(ValueOf(born)); ++i) {
      values.push_back(place(ValueOf(born)) + i);
      multipliers.push_back(place(MultiplierOf(born)) + i);
    }
  }
  const double alpha = node.alpha;
  const Eigen::MatrixXd q = alpha * alpha * node.b * node.b.transpose();
  const Eigen::VectorXd missed = alpha * (node.c - node.b * e_.segment(node.column, node.columns));
  for (std::size_t i = 0; i < multipliers.size(); ++i) {
    const Eigen::Index row = multipliers[i], own = static_cast<Eigen::Index>(i);
    right_[row] += missed[own];
    front_(std::max(row, values[i]), std::min(row, values[i])) += alpha;
    for (std::size_t j = 0; j <= i; ++j) {
      front_(std::max(row, multipliers[j]), std::min(row, multipliers[j])) -=
          q(own, static_cast<Eigen::Index>(j));
    }
    if (k == 0) continue;
    front_.row(row).head(n) -= alpha * node.f.row(own).head(n);
    for (std::size_t c = 0; c < constants_.size(); ++c) {
      const Constant& constant = constants_[c];
      if (!constant.born || constant.node >= k) continue;
      for (Eigen::Index j = 0; j < std::ssize(constant.rows); ++j) {
        const Eigen::Index column = place(ValueOf(c)) + j;
        front_(std::max(row, column), std::min(row, column)) -=
            alpha * node.f(own, n + constant.column + j);
      }
    }
  }
}

/// Adds J'J and -J'r.
void IncrementalSolve::AddTerm(const Term& term, Eigen::Index p) {
  if (term.r.size() == 0) return;
  struct Columns {
    Eigen::Index place, column, size;
  };
  const auto read = std::ssize(read_);
  std::vector<Columns> parts{{p, 0, read}};
  for (std::size_t i = 0; i < constants_.size(); ++i) {
    if (places_[static_cast<std::size_t>(ValueOf(i))] < 0) continue;
    parts.push_back({places_[static_cast<std::size_t>(ValueOf(i))], read + constants_[i].column,
                     std::ssize(constants_[i].rows)});
  }
  const Eigen::Index states = read + constant_rows_;
  if (term.landmark >= 0 && term.j.cols() > states) {
    const int v = VariableOf(static_cast<std::size_t>(term.landmark));
    parts.push_back({places_[static_cast<std::size_t>(v)], states, term.j.cols() - states});
  }
  for (std::size_t a = 0; a < parts.size(); ++a) {
    const auto j_a = term.j.middleCols(parts[a].column, parts[a].size);
    right_.segment(parts[a].place, parts[a].size).noalias() -= j_a.transpose() * term.r;
    for (std::size_t b = 0; b <= a; ++b) {
      const auto j_b = term.j.middleCols(parts[b].column, parts[b].size);
      if (parts[a].place >= parts[b].place) {
        front_.block(parts[a].place, parts[b].place, parts[a].size, parts[b].size) +=
            j_a.transpose().lazyProduct(j_b);
      } else {
        front_.block(parts[b].place, parts[a].place, parts[b].size, parts[a].size) +=
            j_b.transpose().lazyProduct(j_a);
      }
    }
  }
}

namespace {

/// The largest of by_i / sigma_i; what is rounding does not count.
double LargestShare(const Eigen::VectorXd& by, const Eigen::VectorXd& sigma) {
  constexpr double kRounding = 1e-12;
  double share = 0.0;
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    if (std::abs(by[i]) > kRounding) share = std::max(share, std::abs(by[i]) / sigma[i]);
  }
  return share;
}

}  // namespace

/// The solution of the last node. The first node that what changes is a part of; nothing where it
/// is not finite.
std::optional<std::size_t> IncrementalSolve::SolveRoot() {
  const std::size_t last = nodes_.size() - 1;
  const Node& root = nodes_[last];
  Eigen::VectorXd found = root.right;
  if (found.size() > 0) {
    front_ = root.r.selfadjointView<Eigen::Lower>();
    root_.compute(front_);
    found = root_.solve(root.right).eval();
  }
  if (!found.allFinite()) return {};
  std::size_t least = std::min(back_, last);
  Eigen::Index row = 0;
  for (const int v : root.variables) {
    const Eigen::Index size = SizeOf(v);
    Eigen::VectorXd& solution = SolutionOf(last, v);
    const Eigen::VectorXd change = found.segment(row, size) - solution;
    solution = found.segment(row, size);
    row += size;
    if (v < 0) continue;
    const auto i = static_cast<std::size_t>(v);
    if (i >= 2 * constants_.size()) {
      const Landmark& landmark = landmarks_[i - 2 * constants_.size()];
      if (LargestShare(change, landmark.sigma) > Kept()) least = std::min(least, landmark.node);
    } else if (i % 2 == 0) {  // no multiplier
      const Constant& constant = constants_[i / 2];
      if (LargestShare(change, constant.sigma) > Kept()) least = std::min(least, constant.node);
    }
  }
  return least;
}

/// The solutions of the nodes before the last one, at least down to node `least`, and as long as
/// they change. The first node that it was made for.
std::size_t IncrementalSolve::SolveBack(std::size_t least) {
  back_ = nodes_.size();
  const auto n = std::ssize(rows_);
  for (std::size_t k = nodes_.size() - 1; k > 0; --k) {
    const Node& node = nodes_[k];
    Node& before = nodes_[k - 1];
    Eigen::VectorXd border(node.x.cols());
    Eigen::Index row = 0;
    for (const int v : node.variables) {
      border.segment(row, SizeOf(v)) = SolutionOf(k, v);
      row += SizeOf(v);
    }
    const Eigen::VectorXd own = node.y - node.x * border;
    const bool same = LargestShare(own.head(n) - before.dx, before.sigma) <= Kept();
    if (k <= least && same) return k;
    before.dx = own.head(n);
    before.lambda = own.segment(n, n);
    row = 2 * n;
    for (const std::size_t i : node.retired) {
      landmarks_[i].q = own.segment(row, landmarks_[i].q.size());
      row += landmarks_[i].q.size();
    }
  }
  return 0;
}

IncrementalSolve::Moved IncrementalSolve::FindMoved(std::size_t from) const {
  Moved moved;
  const auto is_far = [&](const Eigen::VectorXd& by, const Eigen::VectorXd& sigma) {
    const double share = LargestShare(by, sigma);
    moved.largest = std::max(moved.largest, share);
    return share > above_;
  };
  for (std::size_t k = from; k < nodes_.size(); ++k) {
    if (is_far(nodes_[k].dx, nodes_[k].sigma)) moved.nodes.insert(k);
  }
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (landmarks_[i].sigma.size() == 0) continue;
    if (is_far(landmarks_[i].q, landmarks_[i].sigma)) moved.landmarks.insert(i);
  }
  for (const Constant& constant : constants_) {
    const bool far = constant.born && is_far(constant.dx, constant.sigma);
    moved.constants = moved.constants || far;
  }
  return moved;
}

/// Where the passes get no further, and what still moves is little, it is rounding that moves it.
bool IncrementalSolve::Solve() {
  constexpr int kMostPasses = 50, kRounded = 5;
  constexpr double kShort = 1e-3;  // sigma
  if (!Extend()) return false;
  double least_moved = std::numeric_limits<double>::infinity();
  int since = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    if (!Eliminate()) return false;
    const std::optional<std::size_t> least = SolveRoot();
    if (!least) return Fail("the step of the batch is not finite");
    const Moved moved = FindMoved(SolveBack(*least));
    if (!moved.any()) return StoreLandmarks();
    if (moved.largest < 0.9 * least_moved) {
      least_moved = moved.largest;
      since = 0;
    } else if (++since >= kRounded && moved.largest <= kShort && !run_.robust_) {
      return StoreLandmarks();
    }
    if (!Relinearise(moved)) return false;
  }
  return Fail("the estimates do not settle in " + std::to_string(kMostPasses) + " passes");
}

// Estimates.

/// Of the state of node k; constants as they are linearised, or as they are now.
std::vector<double> IncrementalSolve::ValuesOf(std::size_t k, bool constants) const {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(run_.initial_.covariance().size());
  d(rows_) = nodes_[k].dx;
  for (const Constant& constant : constants_) {
    if (constants && constant.born && constant.node <= k) d(constant.rows) = constant.dx;
  }
  std::vector<double> x = at_[nodes_[k].last].x;
  for (const Block& block : run_.initial_.layout().blocks()) {
    if (!block.has_covariance()) continue;
    double* const value = x.data() + block.value_offset;
    block.geometry().Plus(value, d.data() + block.tangent_offset, value);
  }
  return x;
}

/// w = B' alpha lambda'
Eigen::VectorXd IncrementalSolve::InputsOf(std::size_t k) const {
  const Node& node = nodes_[k];
  Eigen::VectorXd lambda(node.b.rows());
  lambda.head(node.lambda.size()) = node.lambda;
  Eigen::Index row = node.lambda.size();
  for (const std::size_t i : node.born) {
    lambda.segment(row, constants_[i].lambda.size()) = constants_[i].lambda;
    row += constants_[i].lambda.size();
  }
  return node.alpha * (node.b.transpose() * lambda);
}

/// l + q - C dx_f, constants as for ValuesOf
Eigen::VectorXd IncrementalSolve::InputsOfLandmark(std::size_t i, bool constants) const {
  const Landmark& landmark = landmarks_[i];
  if (!run_.landmarks_[i].first) return landmark.l + landmark.q;
  const auto read = std::ssize(read_);
  Eigen::VectorXd camera = Eigen::VectorXd::Zero(landmark.c.cols());
  camera.head(read) = nodes_[landmark.node].dx.head(read);
  for (const Constant& constant : constants_) {
    if (constants) camera.segment(read + constant.column, constant.dx.size()) = constant.dx;
  }
  return landmark.l + landmark.q - landmark.c * camera;
}

/// In the run, as they are now.
bool IncrementalSolve::StoreLandmarks() {
  Inverse place;
  for (const int v : nodes_.back().variables) {
    const int i = v - static_cast<int>(2 * constants_.size());
    if (i < 0) continue;
    const Landmark& own = landmarks_[static_cast<std::size_t>(i)];
    MapLandmark& landmark = run_.landmarks_[static_cast<std::size_t>(i)];
    if (!run_.Place(landmark, own.l + own.q, at_, place)) return Fail(run_.problem());
    landmark.y = place.y;
    landmark.l = landmark.from = InputsOfLandmark(static_cast<std::size_t>(i), true);
  }
  return true;
}

/// Whether that row of a constant has no noise where it is born.
bool IncrementalSolve::IsExact(std::size_t constant, int row) const {
  const Node& node = nodes_[constants_[constant].node];
  Eigen::Index at = std::ssize(rows_) + row;
  for (const std::size_t i : node.born) {
    if (i == constant) break;
    at += std::ssize(constants_[i].rows);
  }
  return !node.b.row(at).any();
}

Eigen::MatrixXd IncrementalSolve::Covariance() const {
  const Node& node = nodes_.back();
  const auto n = Eigen::Index{run_.initial_.covariance().size()};
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(n, n);
  std::vector<int> rows;
  std::vector<Eigen::Index> places;
  Eigen::Index at = 0;
  for (const int v : node.variables) {
    const bool constant = v >= 0 && static_cast<std::size_t>(v) < 2 * constants_.size();
    const std::vector<int>* of = v == kState ? &rows_ : nullptr;
    if (constant && v % 2 == 0) of = &constants_[static_cast<std::size_t>(v) / 2].rows;
    for (int i = 0; of != nullptr && i < SizeOf(v); ++i) {
      // What the prior knows exactly has no variance, not that of rounding.
      if (v == kState && nodes_.size() == 1 && !node.b.row(i).any()) continue;
      if (constant && IsExact(static_cast<std::size_t>(v) / 2, i)) continue;
      rows.push_back((*of)[static_cast<std::size_t>(i)]);
      places.push_back(at + i);
    }
    at += SizeOf(v);
  }
  Eigen::MatrixXd of_rows = Eigen::MatrixXd::Zero(at, std::ssize(places));
  for (std::size_t i = 0; i < places.size(); ++i) {
    of_rows(places[i], static_cast<Eigen::Index>(i)) = 1.0;
  }
  if (!rows.empty()) p(rows, rows) = Eigen::MatrixXd(root_.solve(of_rows))(places, Eigen::all);
  const auto size = run_.binding_.initial.covariance().size();
  return Clipped(p.topLeftCorner(size, size));
}

bool IncrementalSolve::PutMap(std::vector<LandmarkEstimate>& map) const {
  const std::vector<MapLandmark> before = run_.landmarks_;  // what a solve starts from
  const bool put = PutMapOfRun(map);
  run_.landmarks_ = before;
  return put;
}

bool IncrementalSolve::PutMapOfRun(std::vector<LandmarkEstimate>& map) const {
  KktSystem kkt(run_);
  Eigen::VectorXd e(run_.inputs_);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    e.segment(nodes_[k].column, nodes_[k].columns) = InputsOf(k);
  }
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (landmarks_[i].sigma.size() > 0) run_.landmarks_[i].l = InputsOfLandmark(i, true);
  }
  const Eigen::VectorXd z = kkt.Join(e);
  if (!kkt.TakeLandmarks(z) || !kkt.Linearise(z, 0.0) || !kkt.Solve()) return false;
  KktSystem::Covariances(kkt).PutMap(map);
  return true;
}

}  // namespace alidade::ceres_batch
