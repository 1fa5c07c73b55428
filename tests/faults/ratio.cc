// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "alidade/model/plugin.h"
#include "support/landmark_sensors.h"

namespace {

/// A ratio of two blocks. Each block can be initialised from the other, so the sensor can form a
/// cycle of initialisations.
struct Ratio : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"numerator"},
                                     alidade::Quantity{"denominator"}};
  static constexpr alidade::Quantity kMeasurement{"ratio"};
  static constexpr int kInitialises = 0;
  explicit Ratio(alidade::Params&) {}
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] / b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
  template <class T>
  bool Initialise(const T* b, const T* z, T* a) const {
    a[0] = b[0] * z[0];
    return true;
  }
};

template <class Model>
void Emplace(double sigma, AlidadeInstance* instance) {
  using Holder = alidade::detail::Holder<Model>;
  alidade::detail::PublishSensor(std::make_unique<Holder>(Model(sigma)), instance);
}

/// Measures the pixels of a landmark in the representation that `landmarks.representation` selects.
void MakePixels(alidade::Params& p, AlidadeInstance* instance) {
  using namespace alidade::testing;  // NOLINT(google-build-using-namespace): the test sensors
  const int representation =
      p.Choice("landmarks.representation", {"inverse_depth", "anchored", "xyz"},
               "representation of the landmarks", 0);
  const double sigma = p.Positive("sigma_px", "px", "noise, 1 sigma") /
                       p.Positive("camera.focal_px", "px", "focal length");
  if (representation == 0) Emplace<InverseDepthPixels>(sigma, instance);
  if (representation == 1) Emplace<AnchoredPixels<ALIDADE_ROLE_SHARED>>(sigma, instance);
  if (representation == 2) Emplace<XyzPixels>(sigma, instance);
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Ratio, "ratio", "a / b", ""),
               ALIDADE_SENSOR_BY(MakePixels, "pixels", "pixels of a landmark", ""))
