// SPDX-License-Identifier: Apache-2.0
#include <mrpt/bayes/CKalmanFilterCapable.h>

#include "bench/speed/depth_step.h"

namespace alidade::bench {
namespace {

/// Filter of MRPT. Both measurements form one observation of two numbers, which is the fastest way
/// in MRPT.
class Mrpt : public Peer, public mrpt::bayes::CKalmanFilterCapable<3, 2, 0, 0> {
 public:
  Mrpt() {
    KF_options.method = mrpt::bayes::kfEKFNaive;
    KF_options.enable_profiler = false;
    m_xkk.resize(3);
    m_xkk[0] = 0.35;
    m_xkk[1] = 0.0;
    m_xkk[2] = 3.3;
    m_pkk.setZero(3, 3);
    m_pkk(0, 0) = 0.01;
    m_pkk(1, 1) = m_pkk(2, 2) = 0.25;
  }
  void Step(double disparity, double inverse_scale) override {
    z_[0] = disparity;
    z_[1] = inverse_scale;
    runOneKalmanIteration();
  }
  double depth() const override { return m_xkk[0]; }

 private:
  void OnGetAction(KFArray_ACT&) const override {}
  void OnTransitionModel(const KFArray_ACT&, KFArray_VEH& x, bool&) const override {
    x[0] += x[1] * kDt;
  }
  void OnTransitionJacobian(KFMatrix_VxV& f) const override {
    f.setIdentity();
    f(0, 1) = kDt;
  }
  void OnTransitionNoise(KFMatrix_VxV& q) const override {
    const double g[3] = {0.5 * kDt * kDt * kAcceleration, kDt * kAcceleration, 0.0};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) q(r, c) = g[r] * g[c];
    }
  }
  void OnGetObservationNoise(KFMatrix_OxO& r) const override {
    const double s = m_xkk[0] * m_xkk[2], sigma = kRelative * s * s * s;
    r.setZero();
    r(0, 0) = 1.0;
    r(1, 1) = sigma * sigma;
  }
  void OnGetObservationsAndDataAssociation(vector_KFArray_OBS& z, std::vector<int>& association,
                                           const vector_KFArray_OBS&, const KFMatrix&,
                                           const std::vector<std::size_t>&,
                                           const KFMatrix_OxO&) override {
    z.assign(1, z_);
    association.clear();
  }
  void OnObservationModel(const std::vector<std::size_t>&,
                          vector_KFArray_OBS& predictions) const override {
    predictions.resize(1);
    predictions[0][0] = kBf / m_xkk[0];
    predictions[0][1] = m_xkk[0] * m_xkk[2];
  }
  void OnObservationJacobians(std::size_t, KFMatrix_OxV& h, KFMatrix_OxF&) const override {
    h.setZero();
    h(0, 0) = -kBf / (m_xkk[0] * m_xkk[0]);
    h(1, 0) = m_xkk[2];
    h(1, 2) = m_xkk[0];
  }

  KFArray_OBS z_;
};

}  // namespace

std::unique_ptr<Peer> MakeMrpt() { return std::make_unique<Mrpt>(); }

}  // namespace alidade::bench
