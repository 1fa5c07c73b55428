// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/square_root_ekf.h"

#include "alidade/base/error.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/square_root_equations.h"

namespace alidade {

SquareRootEkf::SquareRootEkf(Problem problem, const EkfOptions& options,
                             const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "SquareRootEkf", kCapabilities), options, streams,
             std::make_unique<internal::SquareRootEquations>()) {}

const Eigen::MatrixXd& SquareRootEkf::root() const {
  const Eigen::MatrixXd* const root = engine().method->Root();
  ALIDADE_EXPECTS(root != nullptr);
  return *root;
}

}  // namespace alidade
