// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/landmark.h"

namespace alidade {
namespace detail {

template <class Z, class Spaces>
struct PoseAnd;
template <class Z, class... G>
struct PoseAnd<Z, std::tuple<G...>> {
  using Type = Sensor<Z, Vec<3>, UnitQuaternion, G...>;
};

/// Returns the two roles of the camera's pose, followed by the roles of a landmark.
template <std::size_t N>
constexpr std::array<Quantity, N + 2> PrependPose(const std::array<Quantity, N>& landmark) {
  std::array<Quantity, N + 2> roles{
      Quantity{"position", "m", "position of the camera in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the camera, world_from_cam", "w,x,y,z"}};
  for (std::size_t i = 0; i < N; ++i) roles[i + 2] = landmark[i];
  return roles;
}

}  // namespace detail

/// Base of a sensor that observes landmarks from a camera. All landmarks have the same
/// `Representation`. The roles are the position and orientation of the camera, followed by the
/// roles of the representation. The code of the model does not depend on the representation.
///
/// The model defines functions of the point h / rho in the camera frame, which is at infinity if
/// rho = 0:
///
///   template <class T> bool PredictInCamera(const T* h, const T& rho, T* z) const;
///   template <class T> void SqrtNoiseInCamera(const T* h, const T& rho, T* L) const;
///
/// The model also defines Initialise, which Sensor describes. The noise is not evaluated if Predict
/// returns false.
template <class Model, class Z, class Representation>
struct LandmarkSensor : detail::PoseAnd<Z, typename Representation::Spaces>::Type {
  static constexpr auto kRoles = detail::PrependPose(Representation::kRoles);
  static constexpr int kInitialises = 2;

  /// Computes z for a representation that consists of one block.
  template <class T>
  bool Predict(const T* position, const T* orientation, const T* y, T* z) const {
    T h[3];
    const Ray<T> ray = Representation::ToRay(y);
    InCamera(ray, position, orientation, h);
    return static_cast<const Model&>(*this).PredictInCamera(h, ray.rho, z);
  }
  /// Computes L, m x m row-major, for a representation that consists of one block.
  template <class T>
  void SqrtNoise(const T* position, const T* orientation, const T* y, T* L) const {
    T h[3];
    const Ray<T> ray = Representation::ToRay(y);
    InCamera(ray, position, orientation, h);
    static_cast<const Model&>(*this).SqrtNoiseInCamera(h, ray.rho, L);
  }
  /// Computes z for a representation that consists of three blocks.
  template <class T>
  bool Predict(const T* position, const T* orientation, const T* anchor, const T* direction,
               const T* inverse_distance, T* z) const {
    return Predict(position, orientation, JoinedBlocks<T>(anchor, direction, inverse_distance).y,
                   z);
  }
  /// Computes L, m x m row-major, for a representation that consists of three blocks.
  template <class T>
  void SqrtNoise(const T* position, const T* orientation, const T* anchor, const T* direction,
                 const T* inverse_distance, T* L) const {
    SqrtNoise(position, orientation, JoinedBlocks<T>(anchor, direction, inverse_distance).y, L);
  }

 private:
  template <class T>
  struct JoinedBlocks {
    T y[7];
    JoinedBlocks(const T* anchor, const T* direction, const T* inverse_distance) {
      std::copy_n(anchor, 3, y);
      std::copy_n(direction, 3, y + 3);
      y[6] = inverse_distance[0];
    }
  };
};

}  // namespace alidade
