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

Eigen::MatrixXd SquareRootEkf::root() const {
  Eigen::MatrixXd root = engine().method->Root(engine().f);
  ALIDADE_EXPECTS(root.rows() == engine().f.size());
  return root;
}

}  // namespace alidade
