// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/joint_nees.h"

#include <gtest/gtest.h>

#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Returns the NEES of the errors 3 of `p.x` and 4 of `p.v`, whose sigmas are `sigma_x` and 2. The
/// sigma of the priors is 1.
internal::Nees NeesWith(double sigma_x) {
  Problem problem;
  AddMotion(problem, "p", ConstantMotion(1), {{"x", 0.0, sigma_x}});
  AddMotion(problem, "q", ConstantMotion(1), {{"x", 0.0, 2.0}});
  const Ekf ekf(problem, {}, StreamsOf(problem));
  const Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 3.0),
                        q = Eigen::VectorXd::Constant(1, 4.0);
  return internal::JointNees(
      ekf.state(), std::vector<internal::BlockError>{{0, &x, 0.0, 1.0}, {1, &q, 0.0, 1.0}});
}

TEST(JointNees, SumsTheSquaresOfIndependentErrorsInSigmas) {
  const internal::Nees nees = NeesWith(1.5);
  EXPECT_EQ(nees.dof, 2);
  EXPECT_NEAR(nees.value, 4.0 + 4.0, 1e-12);
}

TEST(JointNees, DoesNotCountDirectionsThatAreMuchMoreCertainThanTheirPrior) {
  for (const double sigma : {0.0, 1e-10}) {
    const internal::Nees nees = NeesWith(sigma);
    EXPECT_EQ(nees.dof, 1) << sigma;
    EXPECT_NEAR(nees.value, 4.0, 1e-12) << sigma;
  }
  EXPECT_EQ(NeesWith(1e-8).dof, 2);
}

}  // namespace
}  // namespace alidade
