// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/direct_models.h"
#include "alidade/model/camera.h"
#include "alidade/model/landmark.h"
#include "support/model_checks.h"

/// Landmarks of every representation in front of a camera, and checks that tests of landmark
/// sensors share.
namespace alidade::testing {

using Vec3 = std::array<double, 3>;

/// Returns a camera with a radtan lens and 640 x 480 px.
inline Camera Lens() {
  return Camera(640, 480, 525, 520, 320.5, 239.25, CameraModel::kRadtan, {-0.28, 0.07, 0.015, 0.0},
                {0.0012, -0.0007});
}
inline Camera Pinhole() { return Camera(640, 480, 525, 525, 320, 240); }

/// Position and orientation of a camera in a general pose.
inline const Blocks kPose{{0.4, -1.1, 0.3}, {0.8, 0.2, -0.4, 0.4}};

/// Calls f(Representation{}) for each representation.
template <class F>
void ForEachRepresentation(const F& f) {
  for (std::size_t i = 0; i < kLandmarkRepresentations.size(); ++i) {
    const auto representation = static_cast<LandmarkRepresentation>(i);
    SCOPED_TRACE(kLandmarkRepresentations[i]);
    WithRepresentation(representation, f);
  }
}

/// Splits the values `y` into the blocks of the representation.
template <class Representation>
Blocks CutIntoBlocks(const double* y) {
  Blocks blocks;
  const auto cut = [&](auto index) {
    constexpr int n = detail::SpaceAt<decltype(index)::value, Representation>::kAmbient;
    blocks.emplace_back(y, y + n);
    y += n;
  };
  detail::ForEach(cut, typename detail::Blocks<Representation>::Indices{});
  return blocks;
}

/// Returns the landmark at the point a + m / rho of a ray. m has unit length.
template <class Representation>
Blocks LandmarkOn(const Ray<double>& ray) {
  double y[detail::Blocks<Representation>::kAmbient];
  EXPECT_TRUE(Representation::FromRay(ray, y));
  return CutIntoBlocks<Representation>(y);
}

/// Returns the landmark at `point` with the given anchor.
template <class Representation>
Blocks LandmarkAt(const Vec3& anchor, const Vec3& point) {
  Vec3 m;
  for (std::size_t i = 0; i < 3; ++i) m[i] = point[i] - anchor[i];
  const double distance = std::hypot(m[0], m[1], m[2]);
  for (double& element : m) element /= distance;
  return LandmarkOn<Representation>(
      {{anchor[0], anchor[1], anchor[2]}, {m[0], m[1], m[2]}, 1.0 / distance});
}

inline Blocks operator+(Blocks a, const Blocks& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline std::vector<double> Predicted(const SharedSensor& sensor, const Blocks& roles) {
  std::vector<double> z(static_cast<std::size_t>(sensor->measurement().geometry.ambient), kPoison);
  EXPECT_EQ(sensor->Predict(Pointers(roles).data(), z.data()), Status::kOk);
  return z;
}

/// Compares the Jacobians of Predict with numeric Jacobians.
inline void ExpectTrueJacobians(const SharedSensor& sensor, const Blocks& roles) {
  // The numeric error is h^4 times fifth derivatives of pixels. These derivatives are at most 1e4
  // times the Jacobians.
  ExpectSame(SensorJacobian(sensor, roles), NumericSensorJacobian(sensor, roles), 10 * kNumeric);
}

/// Checks that Initialise inverts Predict. Compares the Jacobians of Initialise with numeric
/// Jacobians. `from` contains the position, the orientation and z. If the sensor needs a prior, it
/// is the last element.
inline void ExpectTrueInverse(const SharedSensor& sensor, const Blocks& from) {
  std::vector<Space> spaces{sensor->roles()[0], sensor->roles()[1], sensor->measurement()};
  spaces.resize(from.size());
  if (from.size() > 3) spaces[3].geometry = Geometry::Vector(sensor->inverse().prior_size);
  const std::vector<Space> representations(sensor->roles().begin() + 2, sensor->roles().end());
  const int n = TangentSize(representations), m = spaces[2].geometry.tangent;
  std::vector<double> jr(3 * n), jq(3 * n), jz(m * n), jp(n);
  const auto place = [&](const Blocks& x, bool jacobians) {
    std::vector<const double*> roles(sensor->roles().size());
    std::vector<double*> jx(roles.size());
    roles[0] = x[0].data();
    roles[1] = x[1].data();
    jx[0] = jr.data();
    jx[1] = jq.data();
    std::vector<double> y(16, kPoison);
    EXPECT_EQ(sensor->Initialise(roles.data(), {x[2].data()}, x.size() > 3 ? x[3].data() : nullptr,
                                 {.y = y.data(),
                                  .jx = jacobians ? jx.data() : nullptr,
                                  .jz = jacobians ? jz.data() : nullptr,
                                  .jp = jacobians && x.size() > 3 ? jp.data() : nullptr}),
              Status::kOk);
    Blocks blocks = Filled(representations, 0.0);
    const double* at = y.data();
    for (auto& block : blocks) {
      std::copy_n(at, block.size(), block.begin());
      at += block.size();
    }
    return blocks;
  };
  const Blocks y = place(from, true);
  const std::vector<double> z = Predicted(sensor, Blocks{from[0], from[1]} + y);
  for (std::size_t i = 0; i < z.size(); ++i) EXPECT_NEAR(z[i], from[2][i], 1e-10);
  std::vector<double> all;
  for (int row = 0; row < n; ++row) {
    const auto append = [&](const std::vector<double>& j, int columns) {
      all.insert(all.end(), j.begin() + row * columns, j.begin() + (row + 1) * columns);
    };
    append(jr, 3);
    append(jq, 3);
    append(jz, m);
    if (from.size() > 3) append(jp, 1);
  }
  ExpectSame(all,
             NumericJacobian(spaces, from, representations,
                             [&](const Blocks& x) { return place(x, false); }),
             10 * kNumeric);
}

}  // namespace alidade::testing
