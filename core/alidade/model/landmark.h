// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>

#include "alidade/model/autodiff.h"
#include "alidade/model/jet.h"
#include "alidade/model/params.h"

/// Representations of a landmark: ways to store a point of the world in the state. Every
/// representation is a struct that converts the stored values y to a ray p = a + m / rho. All other
/// code uses only this ray:
///
///   (1)  h = R_CW (rho (a - r) + m) = rho p_in_cam      finite at rho = 0, for a point at infinity
///
/// r is the position of the camera, and q = world_from_cam is the orientation of the camera. A
/// representation defines
///
///   using Spaces = std::tuple<...>;                      geometries of its blocks
///   static constexpr std::array kRoles{Quantity{...}};   one per block, ALIDADE_ROLE_LANDMARK
///   static constexpr const char* kName = "...";          name in configs
///   static constexpr bool kIsXyz = false;                true: y is the point p
///   static Ray<T> ToRay(const T* y);                     y: values of all blocks, in order
///   static bool FromRay(const Ray<T>& ray, T* y);        false: no y represents the ray
///
/// Unless kIsXyz is true, the last tangent element is rho. To add a representation, add a struct
/// here, a value to LandmarkRepresentation, and the struct to LandmarkRepresentations.
namespace alidade {

/// Ray to a point p = a + m / rho.
template <class T>
struct Ray {
  T origin[3];     ///< a, in metres
  T direction[3];  ///< vector m
  T rho;           ///< inverse distance in 1/m if `direction` has unit length
};

/// Inverse-depth representation of MonoSLAM. The six numbers are the position of the camera at the
/// first observation, the azimuth and elevation of the ray, and the inverse distance along the ray.
///
///   y = (x0, y0, z0, theta, phi, rho),  a = (x0, y0, z0)
///   m = (cos phi sin theta, -sin phi, cos phi cos theta)
///
/// The poles are the two directions of the world's y axis. FromRay returns false at a pole, because
/// theta is undefined there.
/// Source  [MonoSlam2015] sec. 4.3, [Civera2008] sec. II-B.
struct InverseDepth {
  using Spaces = std::tuple<Vec<6>>;
  static constexpr const char* kName = "inverse_depth";
  static constexpr bool kIsXyz = false;
  static constexpr std::array kRoles{
      Quantity{"landmark", "", "anchor in m, azimuth and elevation in rad, inverse distance in 1/m",
               "x0,y0,z0,theta,phi,rho", ALIDADE_ROLE_LANDMARK}};

  /// ToRay converts y to a ray. FromRay converts a ray to y.
  template <class T>
  static Ray<T> ToRay(const T* y) {
    using std::cos;
    using std::sin;
    const T cos_phi = cos(y[4]);
    return {{y[0], y[1], y[2]}, {cos_phi * sin(y[3]), -sin(y[4]), cos_phi * cos(y[3])}, y[5]};
  }
  template <class T>
  static bool FromRay(const Ray<T>& ray, T* y) {
    using std::atan2;
    using std::sqrt;
    const T* m = ray.direction;
    const T across2 = m[0] * m[0] + m[2] * m[2];
    constexpr double kPole = 1e-20;
    if (!(across2 > T(kPole))) return false;
    std::copy_n(ray.origin, 3, y);
    y[3] = atan2(m[0], m[2]);
    y[4] = atan2(T(-m[1]), T(sqrt(across2)));
    y[5] = ray.rho;
    return true;
  }
};

/// Anchored inverse-distance representation: an anchor a, a unit vector m and the inverse distance
/// rho from the anchor. Landmarks that were first observed in the same time step share one anchor.
/// Each landmark therefore adds only three degrees of freedom. The representation has no pole.
///
///   y = (a, m, rho)
///
/// Source  [Sola2012], anchored landmark points.
struct Anchored {
  using Spaces = std::tuple<Vec<3>, UnitVector, Vec<1>>;
  static constexpr const char* kName = "anchored";
  static constexpr bool kIsXyz = false;
  static constexpr std::array kRoles{
      Quantity{"anchor", "m", "position of the camera at the first observation", "x,y,z",
               ALIDADE_ROLE_LANDMARK | ALIDADE_ROLE_SHARED},
      Quantity{"direction", "", "direction from the anchor to the landmark, in the world", "x,y,z",
               ALIDADE_ROLE_LANDMARK},
      Quantity{"inverse_distance", "1/m", "inverse distance from the anchor", "",
               ALIDADE_ROLE_LANDMARK}};

  /// ToRay converts y to a ray. FromRay converts a ray to y.
  template <class T>
  static Ray<T> ToRay(const T* y) {
    return {{y[0], y[1], y[2]}, {y[3], y[4], y[5]}, y[6]};
  }
  template <class T>
  static bool FromRay(const Ray<T>& ray, T* y) {
    std::copy_n(ray.origin, 3, y);
    std::copy_n(ray.direction, 3, y + 3);
    y[6] = ray.rho;
    return true;
  }
};

/// Representation by the coordinates of the point, y = p. The ray has a = p, m = 0 and rho = 1, so
/// equation (1) becomes h = R_CW (p - r). FromRay returns false unless rho > 0.
struct Xyz {
  using Spaces = std::tuple<Vec<3>>;
  static constexpr const char* kName = "xyz";
  static constexpr bool kIsXyz = true;
  static constexpr std::array kRoles{Quantity{"landmark", "m", "position of the point in the world",
                                              "x,y,z", ALIDADE_ROLE_LANDMARK}};

  /// ToRay converts y to a ray. FromRay converts a ray to y.
  template <class T>
  static Ray<T> ToRay(const T* y) {
    return {{y[0], y[1], y[2]}, {T(0.0), T(0.0), T(0.0)}, T(1.0)};
  }
  template <class T>
  static bool FromRay(const Ray<T>& ray, T* y) {
    if (!(ray.rho > T(0.0))) return false;
    for (int i = 0; i < 3; ++i) y[i] = ray.origin[i] + ray.direction[i] / ray.rho;
    return true;
  }
};

/// Values of the key `landmarks.representation`.
enum class LandmarkRepresentation { kInverseDepth, kAnchored, kXyz };

/// Structs of the representations, in the order of LandmarkRepresentation.
using LandmarkRepresentations = std::tuple<InverseDepth, Anchored, Xyz>;

namespace detail {

constexpr bool IsSameText(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) ++a, ++b;
  return *a == *b;
}

/// Returns true if the blocks of two representations have the same names and geometries. The roles
/// of a sensor then do not determine the representation.
template <class A, class B>
constexpr bool HaveSameRoles() {
  if constexpr (std::is_same_v<typename A::Spaces, typename B::Spaces>) {
    for (std::size_t i = 0; i < A::kRoles.size(); ++i) {
      if (!IsSameText(A::kRoles[i].name, B::kRoles[i].name)) return false;
    }
    return true;
  }
  return false;
}

template <class List>
struct RepresentationTraits;
template <class... Representations>
struct RepresentationTraits<std::tuple<Representations...>> {
  static constexpr std::array<const char*, sizeof...(Representations)> kNames{
      Representations::kName...};
  static constexpr int kMaxTangent = std::max({Blocks<Representations>::kTangent...});

  /// Returns the number of representations that have the same roles as R.
  template <class R>
  static constexpr int CountWithRolesOf() {
    return (HaveSameRoles<R, Representations>() + ...);
  }
  static_assert(((CountWithRolesOf<Representations>() == 1) && ...),
                "two representations have the same roles: rename a role of one of them");

  /// Calls f(Representation{}) for the representation with this index.
  template <class F>
  static auto Visit(int index, const F& f) {
    using First = std::tuple_element_t<0, std::tuple<Representations...>>;
    using Result = decltype(f(First{}));
    using Call = Result (*)(const F&);
    constexpr Call kCalls[] = {[](const F& call) -> Result { return call(Representations{}); }...};
    return kCalls[index](f);
  }
};

}  // namespace detail

/// Names of the representations, in the order of LandmarkRepresentation.
inline constexpr auto kLandmarkRepresentations =
    detail::RepresentationTraits<LandmarkRepresentations>::kNames;

/// Reads the parameter `landmarks.representation`.
inline LandmarkRepresentation ReadLandmarkRepresentation(Params& params) {
  return static_cast<LandmarkRepresentation>(
      params.Choice("landmarks.representation", kLandmarkRepresentations,
                    "representation of a landmark in the state", 0));
}

/// Calls f(Representation{}) with the struct of a representation, and returns the result of f.
template <class F>
auto WithRepresentation(LandmarkRepresentation representation, const F& f) {
  return detail::RepresentationTraits<LandmarkRepresentations>::Visit(
      static_cast<int>(representation), f);
}

/// Computes the three elements of h by equation (1).
template <class T>
void InCamera(const Ray<T>& ray, const T* position, const T* orientation, T* h) {
  T difference[3];
  for (int i = 0; i < 3; ++i) {
    difference[i] = ray.rho * (ray.origin[i] - position[i]) + ray.direction[i];
  }
  UnitQuaternion::RotateBack(orientation, difference, h);
}

/// Inverse measurement model. Computes y of the point that a camera observes in the direction h at
/// the inverse distance rho, 1/m. h is in the camera frame and may have any length. Returns false
/// if no y represents the point.
template <class Representation, class T>
bool PlaceLandmark(const T* position, const T* orientation, const T* h, const T& rho, T* y) {
  using std::sqrt;
  const T length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
  const T unit[3] = {h[0] / length, h[1] / length, h[2] / length};
  Ray<T> ray{{position[0], position[1], position[2]}, {}, rho};
  UnitQuaternion::Rotate(orientation, unit, ray.direction);
  return Representation::FromRay(ray, y);
}

/// Returns the ray of a landmark whose blocks have these values.
template <class Representation>
Ray<double> RayOf(const double* const* blocks) {
  double y[detail::Blocks<Representation>::kAmbient];
  int offset = 0;
  const auto copy = [&](auto index) {
    constexpr int i = decltype(index)::value;
    constexpr int n = detail::SpaceAt<i, Representation>::kAmbient;
    std::copy_n(blocks[i], n, y + offset);
    offset += n;
  };
  detail::ForEach(copy, typename detail::Blocks<Representation>::Indices{});
  return Representation::ToRay(y);
}

/// Computes the point p = a + m / rho of a landmark. Unless J_p_y is empty, also computes the
/// Jacobian J_p_y (3 x tangent size of the blocks). Returns kOutOfDomain unless rho > 0.
template <class Representation>
Status ConvertToXyz(const double* const* blocks, double* p, MatrixRef J_p_y = {}) {
  constexpr int n = detail::Blocks<Representation>::kTangent;
  using Jet = alidade::Jet<double, n>;
  Jet y[detail::Blocks<Representation>::kAmbient], lifted[3];
  const Jet* pointers[detail::Blocks<Representation>::kCount];
  detail::Lift<Representation>(blocks, y, pointers);
  if (!Xyz::FromRay(Representation::ToRay(y), lifted)) return Status::kOutOfDomain;
  for (int i = 0; i < 3; ++i) p[i] = lifted[i].a;
  if (J_p_y) detail::ReadTangent<Vec<3>>(lifted, 0, n, J_p_y);
  return Status::kOk;
}

/// Returns the linearity index L_d = 4 sigma_rho |cos alpha| / (rho^2 d1) with d1 = |p - r|
/// [Civera2008] sec. III. alpha is the angle between the rays to p from the anchor and from the
/// camera at r; sigma_rho is in 1/m. L_d is small if the distribution of p is almost Gaussian. L_d
/// is infinite at rho = 0, and zero for Xyz.
inline double LinearityIndex(const Ray<double>& ray, double sigma_rho, const double* position) {
  double dot = 0.0, length2 = 0.0;  // computed from rho (p - r), to avoid a division by rho^2
  for (int i = 0; i < 3; ++i) {
    const double scaled = ray.rho * (ray.origin[i] - position[i]) + ray.direction[i];
    dot += scaled * ray.direction[i];
    length2 += scaled * scaled;
  }
  if (dot == 0.0) return 0.0;
  if (ray.rho == 0.0) return std::numeric_limits<double>::infinity();
  return 4.0 * sigma_rho * std::abs(dot) / (std::abs(ray.rho) * length2);
}

}  // namespace alidade
