// SPDX-License-Identifier: Apache-2.0
#include "support/systems.h"

#include "motion_models/constant.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/manifold_models.h"

namespace alidade::testing {

SharedSensor LinearSensor(double gain, double sigma) {
  return MakeSensor(Linear(gain, sigma), "linear");
}
SharedSensor SumSensor(double a, double b, double sigma) {
  return MakeSensor(WeightedSum(a, b, sigma), "sum");
}
SharedMotion ConstantMotion(int size, double random_walk) {
  return MakeMotion(Constant<>(size, random_walk), "constant");
}
SharedMotion ConstantVelocityMotion(double acceleration) {
  return MakeMotion(ConstantVelocity<1, false>(acceleration), "constant_velocity");
}

void AddMotion(Problem& problem, const std::string& name, const SharedMotion& model,
               const std::vector<GivenPrior>& priors) {
  MotionBinding binding{name, model, {}};
  for (std::size_t i = 0; i < priors.size(); ++i) {
    const BlockId id =
        problem.layout.Declare(name + "." + priors[i].block, name, model->blocks()[i]);
    binding.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = {priors[i].mean};
    prior.covariance = Eigen::MatrixXd::Constant(1, 1, priors[i].sigma * priors[i].sigma);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(binding);
}

void AddSensor(Problem& problem, const std::string& name, const SharedSensor& model,
               const std::vector<std::string>& blocks) {
  SensorBinding binding{name, name, model, {}};
  for (const std::string& block : blocks) {
    RoleBinding role;
    role.block = problem.layout.Find(block);
    binding.roles.push_back(role);
  }
  problem.sensors.push_back(binding);
}

static Problem PointOf(const SharedMotion& model) {
  Problem problem;
  AddMotion(problem, "p", model, {{"x", 1.0, 2.0}, {"v", -0.5, 3.0}});
  return problem;
}
Problem MovingPoint(double acceleration) {
  return PointOf(MakeMotion(Jolted(acceleration), "jolted"));
}
Problem HeldPoint(double acceleration) { return PointOf(ConstantVelocityMotion(acceleration)); }

Problem DepthFilter() {
  Problem problem;
  AddMotion(problem, "target", ConstantVelocityMotion(1.0),
            {{"depth", 0.35, 0.1}, {"depth_rate", 0.0, 0.5}});
  AddMotion(problem, "template", ConstantMotion(1), {{"inverse_distance", 3.3, 0.5}});
  AddSensor(problem, "disparity",
            MakeSensor(StereoDisparity(400.0, 0.065, 1.0), "stereo_disparity"), {"target.depth"});
  AddSensor(problem, "inverse_scale", MakeSensor(Scale2d::FromPixels(300.0, 1.0), "scale_2d"),
            {"target.depth", "template.inverse_distance"});
  return problem;
}

Problem WithStatus(Problem problem, const std::string& name, BlockStatus status) {
  StateLayout layout;
  for (const Block& block : problem.layout.blocks()) {
    const bool meant = name.empty() || block.name == name;
    layout.Declare(block.name, block.owner, block.space, meant ? status : block.status);
  }
  problem.layout = layout;
  return problem;
}

Problem WalkingOrientation() {
  Problem problem;
  AddMotion(problem, "q", MakeMotion(ManifoldWalk<UnitQuaternion, 0.01>(), "walk"),
            {{"x", 0.0, 0.1}});
  problem.priors[0].mean = {1.0, 0.0, 0.0, 0.0};
  problem.priors[0].covariance = 0.01 * Eigen::Matrix3d::Identity();
  AddSensor(problem, "z", MakeSensor(ManifoldSensor<UnitQuaternion, 0.05>(), "seen"), {"q.x"});
  return problem;
}

}  // namespace alidade::testing
