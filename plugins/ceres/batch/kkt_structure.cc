// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "kkt_system.h"

/// What a KktSystem consists of: nodes, constants, landmarks, and which of them its blocks tie.
namespace alidade::ceres_batch {

KktSystem::KktSystem(CondensedRun& run) : run_(run), points_(run.landmarks_.size()), edge_(run) {
  FindConstants();
  FindNodes();
  Build();
}

void KktSystem::FindConstants() {
  const VariableRows variables = run_.FindVariables();
  read_rows_ = variables.read;
  rest_rows_ = variables.rest;
  rows_ = variables.moving();
  for (const VariableRows::Constant& constant : variables.constants) {
    Constant& own = constants_.emplace_back();
    own.rows = constant.rows;
    own.of_landmark = constant.of_landmark;
  }
}

void KktSystem::FindNodes() {
  const std::vector<Epoch>& epochs = run_.epochs_;
  bool open = false;
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    if (!open) {
      Node& node = nodes_.emplace_back();
      node.first = k;
      node.column = epochs[k].column;
    }
    open = !epochs[k].ends;
    nodes_.back().last = k;
    node_of_.push_back(nodes_.size() - 1);
  }
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    node.columns = (k + 1 < nodes_.size() ? nodes_[k + 1].column : run_.inputs_) - node.column;
    for (std::size_t i = 0; i < constants_.size(); ++i) {
      if (constants_[i].born || !run_.HasBorn(constants_[i].rows, node.first, node.last)) continue;
      constants_[i].born = true;
      constants_[i].node = k;
      node.born.push_back(i);
    }
  }
}

void KktSystem::Tie(int i, int j) {
  if (i < 0 || j < 0) return;
  if (i < j) std::swap(i, j);
  const auto [at, inserted] = block_of_.try_emplace(KeyOf(i, j), 0);
  if (inserted) at->second = ldl_.AddBlock(i, j);
}

/// Adds a term of these variables, of which those that there are none of (-1) do not count.
void KktSystem::AddTerm(const std::vector<int>& variables) {
  Term term{variables_.size(), blocks_.size(), 0};
  for (const int v : variables) {
    if (v < 0) continue;
    variables_.push_back(v);
    ++term.count;
    for (int u = 0; u < term.count; ++u) {
      const int w = variables_[term.variables + static_cast<std::size_t>(u)];
      Tie(v, w);
      blocks_.push_back(block_of_.at(KeyOf(std::max(v, w), std::min(v, w))));
    }
  }
  terms_.push_back(term);
}

std::vector<int> KktSystem::ConstantsOf(const std::vector<JacobianPart>& parts) const {
  std::vector<int> found;
  for (const JacobianPart& part : parts) {
    for (std::size_t i = 0; i < constants_.size(); ++i) {
      const int index = static_cast<int>(i);
      const int row = constants_[i].rows.front();
      if (constants_[i].born && part.offset <= row && row < part.offset + part.size &&
          std::ranges::find(found, index) == found.end()) {
        found.push_back(index);
      }
    }
  }
  return found;
}

/// Of one in the state, by block.
std::vector<int> KktSystem::ConstantsOf(const MapLandmark& landmark) const {
  std::vector<JacobianPart> parts;
  for (const BlockId id : landmark.blocks) {
    const Block& block = run_.initial_.layout()[id];
    parts.push_back({block.tangent_offset, block.geometry().tangent, 0});
  }
  return ConstantsOf(parts);
}

bool KktSystem::ReadsStates(std::size_t sensor) const {
  const auto moves = [this](const JacobianPart& part) {
    return std::ranges::find(read_rows_, part.offset) != read_rows_.end();
  };
  return std::ranges::any_of(run_.binding_.sensor_places[sensor].parts, moves);
}

/// The variables of a state but its landmarks, and the rows of its tangent that each is.
std::vector<KktSystem::Part> KktSystem::PartsOf(std::size_t k) const {
  std::vector<Part> parts;
  if (nodes_[k].read >= 0) parts.push_back({nodes_[k].read, &read_rows_});
  if (nodes_[k].rest >= 0) parts.push_back({nodes_[k].rest, &rest_rows_});
  for (const Constant& constant : constants_) {
    if (constant.of_landmark || !constant.born || constant.node > k) continue;
    parts.push_back({constant.value, &constant.rows});
  }
  return parts;
}

void KktSystem::Build() {
  ldl_ = {};
  block_of_.clear();
  terms_.clear();
  variables_.clear();
  blocks_.clear();
  const auto add = [this](const std::vector<int>& rows) {
    return rows.empty() ? -1 : ldl_.AddVariable(static_cast<int>(rows.size()));
  };
  for (Node& node : nodes_) {
    node.read = add(read_rows_);
    node.rest = add(rest_rows_);
    node.multiplier = add(rows_);
  }
  for (Constant& constant : constants_) {
    if (!constant.born) continue;
    constant.value = add(constant.rows);
    constant.multiplier = add(constant.rows);
  }
  constant_of_.assign(ldl_.graph().size.size(), -1);
  for (std::size_t i = 0; i < constants_.size(); ++i) {
    if (!constants_[i].born) continue;
    constant_of_[static_cast<std::size_t>(constants_[i].value)] = static_cast<int>(i);
  }
  inputs_ = run_.inputs_;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto size = static_cast<int>(run_.landmarks_[i].from.size());
    points_[i].column = inputs_;
    points_[i].variable = size > 0 ? ldl_.AddVariable(size) : -1;
    inputs_ += size;
  }
  for (std::size_t k = 0; k < nodes_.size(); ++k) AddConstraints(k);
  AddTerms();
  ChooseOrder();
}

/// The blocks of node k, and those whose inverse its covariance takes.
void KktSystem::AddConstraints(std::size_t k) {
  const Node& node = nodes_[k];
  std::vector<Part> before;
  if (k > 0) before = PartsOf(k - 1);
  Tie(node.multiplier, node.multiplier);
  Tie(node.multiplier, node.read);
  Tie(node.multiplier, node.rest);
  if (k > 0) {
    Tie(node.multiplier, nodes_[k - 1].read);
    Tie(node.multiplier, nodes_[k - 1].rest);
  }
  for (const std::size_t i : node.born) {
    Tie(constants_[i].multiplier, constants_[i].multiplier);
    Tie(constants_[i].multiplier, constants_[i].value);
  }
  for (const Part& part : PartsOf(k)) {
    for (const Constant& constant : constants_) {
      if (constant.of_landmark || !constant.born || constant.node > k) continue;
      Tie(constant.value, part.variable);
    }
  }
  // First values, a prior that ties blocks, and frames inside the node have all of it.
  bool joint = node.first != node.last;
  for (std::size_t i = node.first; i <= node.last; ++i) {
    joint = joint || !run_.epochs_[i].first_values.empty();
  }
  if (k == 0) {
    Eigen::MatrixXd p = run_.l0_ * run_.l0_.transpose();
    for (const Constant& constant : constants_) p(constant.rows, constant.rows).setZero();
    p(rows_, rows_).setZero();
    joint = joint || (p.array() != 0.0).any();
  }
  if (!joint) return;
  std::vector<int> multipliers{node.multiplier};
  for (const std::size_t i : node.born) multipliers.push_back(constants_[i].multiplier);
  for (const int i : multipliers) {
    for (const int j : multipliers) Tie(i, j);
    for (const Part& part : before) Tie(i, part.variable);
  }
}

/// The terms in the order in which Linearise goes through them.
void KktSystem::AddTerms() {
  const std::size_t sensors = run_.binding_.sensor_places.size();
  std::vector<std::vector<int>> constants(sensors);
  landmark_constants_.clear();
  for (std::size_t i = 0; i < sensors; ++i) {
    constants[i] = ConstantsOf(run_.binding_.sensor_places[i].parts);
    if (!run_.ObservesLandmarks(run_.binding_.problem.sensors[i])) continue;
    for (const int constant : constants[i]) {
      if (std::ranges::find(landmark_constants_, constant) == landmark_constants_.end()) {
        landmark_constants_.push_back(constant);
      }
    }
  }
  const auto with = [this](std::vector<int> variables, const std::vector<int>& more) {
    for (const int i : more) variables.push_back(constants_[static_cast<std::size_t>(i)].value);
    return variables;
  };
  for (std::size_t k = 0; k < run_.epochs_.size(); ++k) {
    for (const Factor& factor : run_.epochs_[k].factors) {
      if (factor.row < 0) continue;
      const auto sensor = static_cast<std::size_t>(factor.sensor);
      const int here = ReadsStates(sensor) ? nodes_[node_of_[k]].read : -1;
      AddTerm(with({here}, CondensedRun::IsOfState(factor) ? ConstantsOf(run_.PlaceOf(factor).parts)
                                                           : constants[sensor]));
    }
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const MapLandmark& landmark = run_.landmarks_[i];
    const Point3& point = points_[i];
    const std::vector<int> own = ConstantsOf(landmark);  // whose covariance is that of the landmark
    for (const int a : own) {
      for (const int b : own) {
        Tie(constants_[static_cast<std::size_t>(a)].value,
            constants_[static_cast<std::size_t>(b)].value);
      }
    }
    const int first = landmark.first ? nodes_[node_of_[landmark.first->epoch]].read : -1;
    AddTerm(landmark.first ? with({point.variable, first}, landmark_constants_)
                           : std::vector<int>{point.variable});
    for (const auto& [epoch, index] : landmark.observations) {
      const int here = nodes_[node_of_[epoch]].read;
      const bool tied = point.anchored && here != first;
      AddTerm(with({point.variable, here, tied ? first : -1}, landmark_constants_));
    }
  }
}

/// From the last node back, or minimum degree, but for the first node: the one with fewer flops.
/// From the last node back a landmark comes before the first node that sees it; where two nodes on
/// end see it alone, which the motion ties in any case, before the second one. Where the first node
/// comes last a covariance is a sum, P_k = Cov(x_k | x_k-1) + G P_k-1 G'; else that of a vague
/// first state is the difference of its prior's and one as large.
void KktSystem::ChooseOrder() {
  std::vector<std::vector<int>> before(nodes_.size());  // landmarks
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].variable < 0) continue;
    const MapLandmark& landmark = run_.landmarks_[i];
    std::size_t first = nodes_.size() - 1, last = 0;
    const auto see = [&](const MapLandmark::Observation& observation) {
      first = std::min(first, node_of_[observation.epoch]);
      last = std::max(last, node_of_[observation.epoch]);
    };
    if (landmark.first) see(*landmark.first);
    std::ranges::for_each(landmark.observations, see);
    before[last == first + 1 ? last : first].push_back(points_[i].variable);
  }
  Groups groups;
  for (std::size_t k = nodes_.size(); k-- > 0;) {
    for (const int landmark : before[k]) groups.push_back({landmark});
    std::vector<int>& pair = groups.emplace_back();
    for (const int v : {nodes_[k].read, nodes_[k].rest, nodes_[k].multiplier}) {
      if (v >= 0) pair.push_back(v);
    }
    if (pair.empty()) groups.pop_back();
  }
  for (const Constant& constant : constants_) {
    if (constant.born) groups.push_back({constant.value, constant.multiplier});
  }
  Elimination time(ldl_.graph(), groups);
  if (groups.empty()) return ldl_.Use(std::move(time));
  const auto first_node = std::ranges::find_if(groups, [&](const std::vector<int>& group) {
    return std::ranges::count(group, nodes_.front().multiplier) > 0;
  });
  if (first_node != groups.end()) std::rotate(first_node, first_node + 1, groups.end());
  std::reverse(groups.begin(), groups.end() - 1);  // of ties minimum degree takes the first
  Elimination least(ldl_.graph(), MinimumDegree(ldl_.graph(), groups));
  in_time_order_ = time.flops <= least.flops;
  ldl_.Use(std::move(in_time_order_ ? time : least));
}

double KktSystem::bytes() const {
  // The factor, the blocks of the matrix, and one front with its border.
  double matrix = 0.0, front = 0.0;
  const BlockGraph& graph = ldl_.graph();
  const auto size = [&](int v) { return 1.0 * graph.size[static_cast<std::size_t>(v)]; };
  for (const auto& [i, j] : graph.edges) matrix += size(i) * size(j);
  for (const Elimination::Front& f : elimination().fronts) {
    front = std::max(front, double(f.p + f.m) * double(f.p + f.m));
  }
  return 8.0 * (elimination().numbers + matrix + 3.0 * front);
}

}  // namespace alidade::ceres_batch
