// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/random.h"
#include "alidade/check/model_under_test.h"

namespace alidade::internal {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Draws x = identity (+) d. The elements of a vector have magnitudes from 0.03 to 30. If
/// `positive` is true, all elements are positive.
std::vector<double> RandomValue(const Geometry& geometry, bool positive, Random& random) {
  std::vector<double> x = geometry.Identity(), d;
  geometry.ForEachPart([&](const Geometry& part, int, int) {
    for (int i = 0; i < part.tangent; ++i) {
      if (part.is_vector()) {
        const double sign = positive || random.Uniform() < 0.5 ? 1.0 : -1.0;
        d.push_back(sign * std::pow(10.0, 3.0 * random.Uniform() - 1.5));
      } else {
        d.push_back(1.2 * random.Normal());
      }
    }
  });
  geometry.Plus(x.data(), d.data(), x.data());
  return x;
}

/// Returns the special points of a geometry:
///
///   vector   all elements 0, 1e-6 or 1e6, with either sign
///   product  the special points of one part, with the other parts at the neutral element
///   others   the neutral element; the points at pi, -pi + 1e-9 and pi / 2 along each tangent
///            direction; for a double cover, the negative of the neutral element
std::vector<std::vector<double>> Edges(const Geometry& geometry) {
  std::vector<std::vector<double>> edges;
  if (geometry.is_vector()) {
    for (const double value : {0.0, 1e-6, -1e-6, 1e6, -1e6}) {
      edges.emplace_back(static_cast<std::size_t>(geometry.ambient), value);
    }
    return edges;
  }
  const std::vector<double> identity = geometry.Identity();
  if (geometry.is_product()) {
    geometry.ForEachPart([&](const Geometry& part, int a, int) {
      for (const std::vector<double>& edge : Edges(part)) {
        edges.push_back(identity);
        std::ranges::copy(edge, edges.back().begin() + a);
      }
    });
    return edges;
  }
  edges.push_back(identity);
  for (int i = 0; i < geometry.tangent; ++i) {
    for (const double length : {kPi, -kPi + 1e-9, 0.5 * kPi}) {
      std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
      d[static_cast<std::size_t>(i)] = length;
      edges.push_back(identity);
      geometry.Plus(edges.back().data(), d.data(), edges.back().data());
    }
  }
  if (const int q = geometry.row().quaternion; q >= 0) {
    edges.push_back(identity);
    for (int i = q; i < q + 4; ++i) {
      double& element = edges.back()[static_cast<std::size_t>(i)];
      element = -element;
    }
  }
  return edges;
}

/// Draws dt from 1 ms to 3 s.
double RandomStep(Random& random) { return std::pow(10.0, 3.5 * random.Uniform() - 3.0); }

std::vector<double> RandomNoise(int size, Random& random) {
  std::vector<double> w(static_cast<std::size_t>(size));
  for (double& element : w) element = random.Normal();
  return w;
}

}  // namespace

std::vector<Values> RandomStates(const ModelUnderTest& model, int count, std::uint64_t seed) {
  Random random(seed);
  const std::size_t blocks = model.instance->spaces().size();
  const auto draw = [&](int i) {
    Values values;
    for (std::size_t k = 0; k < model.slots.size(); ++k) {
      const Space& space = model.slots[k];
      if (!model.is_sensor() && k == blocks) {
        values.push_back(RandomNoise(space.geometry.ambient, random));
      } else if (!model.is_sensor() && k + 1 == model.slots.size()) {
        values.push_back({RandomStep(random)});
      } else {
        const bool is_prior =
            model.is_sensor() && k > blocks && static_cast<int>(k) != model.known_slot;
        values.push_back(RandomValue(space.geometry, is_prior || i % 2 == 0, random));
        if (space.optional() && i % 4 >= 2) values.back().clear();
      }
    }
    return values;
  };
  std::vector<Values> states;
  for (int i = 0; i < count; ++i) states.push_back(draw(i));
  for (std::size_t k = 0; k < model.slots.size(); ++k) {
    const bool is_dt = !model.is_sensor() && k + 1 == model.slots.size();
    if (model.slots[k].geometry.ambient == 0) continue;
    const auto edges = is_dt ? std::vector<std::vector<double>>{{0.0}, {1e-9}, {10.0}}
                             : Edges(model.slots[k].geometry);
    for (const std::vector<double>& edge : edges) {
      states.push_back(draw(0));
      states.back()[k] = edge;
    }
  }
  return states;
}

}  // namespace alidade::internal
