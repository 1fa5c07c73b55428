// SPDX-License-Identifier: Apache-2.0
#include <filter/extendedkalmanfilter.h>
#include <model/analyticmeasurementmodel_gaussianuncertainty.h>
#include <model/linearanalyticsystemmodel_gaussianuncertainty.h>
#include <pdf/analyticconditionalgaussian_additivenoise.h>

#include "bench/speed/depth_step.h"

namespace alidade::bench {
namespace {

using MatrixWrapper::ColumnVector;
using MatrixWrapper::Matrix;
using MatrixWrapper::SymmetricMatrix;

BFL::Gaussian Noise(const ColumnVector& mean, const SymmetricMatrix& covariance) {
  return {mean, covariance};
}
BFL::Gaussian Noise(double variance) {
  ColumnVector mean(1);
  mean(1) = 0.0;
  SymmetricMatrix covariance(1);
  covariance(1, 1) = variance;
  return {mean, covariance};
}

class Disparity : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  Disparity() : AnalyticConditionalGaussianAdditiveNoise(Noise(1.0), 1) {}
  ColumnVector ExpectedValueGet() const override {
    ColumnVector z(1);
    z(1) = kBf / ConditionalArgumentGet(0)(1);
    return z;
  }
  Matrix dfGet(unsigned int) const override {
    const double z = ConditionalArgumentGet(0)(1);
    Matrix h(1, 3);
    h = 0.0;
    h(1, 1) = -kBf / (z * z);
    return h;
  }
};

class InverseScale : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  InverseScale() : AnalyticConditionalGaussianAdditiveNoise(Noise(1.0), 1) {}
  ColumnVector ExpectedValueGet() const override {
    ColumnVector z(1);
    z(1) = ConditionalArgumentGet(0)(1) * ConditionalArgumentGet(0)(3);
    return z;
  }
  Matrix dfGet(unsigned int) const override {
    Matrix h(1, 3);
    h = 0.0;
    h(1, 1) = ConditionalArgumentGet(0)(3);
    h(1, 3) = ConditionalArgumentGet(0)(1);
    return h;
  }
  SymmetricMatrix CovarianceGet() const override {
    const double s = ConditionalArgumentGet(0)(1) * ConditionalArgumentGet(0)(3);
    const double sigma = kRelative * s * s * s;
    SymmetricMatrix covariance(1);
    covariance(1, 1) = sigma * sigma;
    return covariance;
  }
};

class Bfl : public Peer {
 public:
  Bfl()
      : motion_pdf_(Transition(), ProcessNoise()),
        motion_(&motion_pdf_),
        disparity_(&disparity_pdf_),
        inverse_scale_(&inverse_scale_pdf_),
        prior_(Prior()),
        filter_(&prior_),
        z_(1) {}
  void Step(double disparity, double inverse_scale) override {
    filter_.Update(&motion_);
    z_(1) = disparity;
    filter_.Update(&disparity_, z_);
    z_(1) = inverse_scale;
    filter_.Update(&inverse_scale_, z_);
  }
  double depth() const override {
    return const_cast<Bfl*>(this)->filter_.PostGet()->ExpectedValueGet()(1);
  }

 private:
  static Matrix Transition() {
    Matrix f(3, 3);
    f = 0.0;
    f(1, 1) = f(2, 2) = f(3, 3) = 1.0;
    f(1, 2) = kDt;
    return f;
  }
  static BFL::Gaussian ProcessNoise() {
    const double g[3] = {0.5 * kDt * kDt * kAcceleration, kDt * kAcceleration, 0.0};
    ColumnVector mean(3);
    mean = 0.0;
    SymmetricMatrix q(3);
    for (int r = 1; r <= 3; ++r) {
      for (int c = 1; c <= r; ++c) q(r, c) = g[r - 1] * g[c - 1];
    }
    return Noise(mean, q);
  }
  static BFL::Gaussian Prior() {
    ColumnVector mean(3);
    mean(1) = 0.35;
    mean(2) = 0.0;
    mean(3) = 3.3;
    SymmetricMatrix p(3);
    p = 0.0;
    p(1, 1) = 0.01;
    p(2, 2) = p(3, 3) = 0.25;
    return Noise(mean, p);
  }

  BFL::LinearAnalyticConditionalGaussian motion_pdf_;
  BFL::LinearAnalyticSystemModelGaussianUncertainty motion_;
  Disparity disparity_pdf_;
  InverseScale inverse_scale_pdf_;
  BFL::AnalyticMeasurementModelGaussianUncertainty disparity_, inverse_scale_;
  BFL::Gaussian prior_;
  BFL::ExtendedKalmanFilter filter_;
  ColumnVector z_;
};

}  // namespace

std::unique_ptr<Peer> MakeBfl() { return std::make_unique<Bfl>(); }

}  // namespace alidade::bench
