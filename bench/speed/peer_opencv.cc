// SPDX-License-Identifier: Apache-2.0
#include <opencv2/video/tracking.hpp>

#include "bench/speed/depth_step.h"

namespace alidade::bench {
namespace {

/// cv::KalmanFilter used as an extended Kalman filter. H is evaluated at the prediction, z + H x -
/// h(x) replaces z, and each sensor has a separate correction.
class OpenCv : public Peer {
 public:
  OpenCv() : filter_(3, 1, 0, CV_64F), z_(1, 1, CV_64F) {
    const double g[3] = {0.5 * kDt * kDt * kAcceleration, kDt * kAcceleration, 0.0};
    cv::setIdentity(filter_.transitionMatrix);
    filter_.transitionMatrix.at<double>(0, 1) = kDt;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) filter_.processNoiseCov.at<double>(r, c) = g[r] * g[c];
    }
    const double mean[3] = {0.35, 0.0, 3.3}, variance[3] = {0.01, 0.25, 0.25};
    for (int i = 0; i < 3; ++i) {
      filter_.statePost.at<double>(i) = mean[i];
      filter_.errorCovPost.at<double>(i, i) = variance[i];
    }
  }
  void Step(double disparity, double inverse_scale) override {
    filter_.predict();
    const double z = filter_.statePre.at<double>(0), d = kBf / z;
    Correct(disparity, d, -d / z, 0.0, 1.0);
    filter_.statePost.copyTo(filter_.statePre);
    filter_.errorCovPost.copyTo(filter_.errorCovPre);
    const double depth = filter_.statePre.at<double>(0), lambda = filter_.statePre.at<double>(2);
    const double s = lambda * depth, sigma = kRelative * s * s * s;
    Correct(inverse_scale, s, lambda, depth, sigma * sigma);
  }
  double depth() const override { return filter_.statePost.at<double>(0); }

 private:
  void Correct(double z, double h, double d_depth, double d_lambda, double variance) {
    double* const row = filter_.measurementMatrix.ptr<double>(0);
    row[0] = d_depth;
    row[1] = 0.0;
    row[2] = d_lambda;
    filter_.measurementNoiseCov.at<double>(0) = variance;
    const double* const x = filter_.statePre.ptr<double>(0);
    z_.at<double>(0) = z - h + d_depth * x[0] + d_lambda * x[2];
    filter_.correct(z_);
  }

  cv::KalmanFilter filter_;
  cv::Mat z_;
};

}  // namespace

std::unique_ptr<Peer> MakeOpenCv() { return std::make_unique<OpenCv>(); }

}  // namespace alidade::bench
