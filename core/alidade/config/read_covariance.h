// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/config/config.h"

namespace alidade::internal {

/// Reads a list of rows as a symmetric, positive semi-definite `size` x `size` matrix. Returns it
/// row-major. If the matrix is not positive semi-definite, the error reports the smallest
/// eigenvalue. The entries (i, j) and (j, i) may differ by rounding errors, up to 1e-9 times the
/// product of the standard deviations i and j. The mean then replaces both entries.
std::vector<double> ReadCovariance(const Node& node, int size);

/// Reads a covariance C. Returns the lower triangular matrix L of C = L L', row-major. ReadSqrtR
/// also rejects a singular covariance, because a measurement has noise in each direction.
std::vector<double> ReadSqrtCovariance(const Node& node, int size);
std::vector<double> ReadSqrtR(const Node& node, int size);

/// Repeats a single value that is not in a list. Rejects other values unless there are `size`.
template <class T>
void RepeatTo(int size, const Node& node, std::vector<T>& values) {
  const auto count = static_cast<std::size_t>(size);
  const bool is_single = values.size() == 1 && node.kind() != Node::Kind::kList;
  if (is_single) values.assign(count, T(values[0]));
  if (values.size() == count) return;
  node.Fail("the list has " + std::to_string(values.size()) +
                (values.size() == 1 ? " element" : " elements"),
            std::to_string(size) + ", or one number for all elements");
}

/// Rejects a standard deviation that is negative.
void ExpectSigma(const Node& node, double sigma);

/// Reads one standard deviation for all elements, or one for each of `size` elements.
std::vector<double> ReadSigmas(const Node& node, int size, const std::string& unit = {});

}  // namespace alidade::internal
