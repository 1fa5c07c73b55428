// SPDX-License-Identifier: Apache-2.0
#include <mrpt/bayes/CKalmanFilterCapable.h>

#include <cmath>

#include "bench/speed/slam_peer.h"

namespace alidade::bench {
namespace {

class Mrpt : public SlamPeer, public mrpt::bayes::CKalmanFilterCapable<12, 2, 6, 0> {
 public:
  Mrpt(int landmarks, int observed) : landmarks_(landmarks), observed_(observed) {
    KF_options.method = mrpt::bayes::kfEKFAlaDavison;  // 2 to 4 times as fast as other methods
    KF_options.enable_profiler = false;
    const int n = 12 + 6 * landmarks;
    m_xkk.setZero(n);
    m_pkk.setZero(n, n);
    for (int i = 0; i < n; ++i) m_pkk(i, i) = 0.01;
  }
  void Frame() override {
    runOneKalmanIteration();
    first_ = (first_ + observed_) % landmarks_;
  }

 private:
  void OnGetAction(KFArray_ACT&) const override {}
  void OnTransitionModel(const KFArray_ACT&, KFArray_VEH&, bool&) const override {}
  void OnTransitionJacobian(KFMatrix_VxV& f) const override { f.setIdentity(); }
  void OnTransitionNoise(KFMatrix_VxV& q) const override {
    q.setZero();
    for (int i = 0; i < 12; ++i) q(i, i) = 1e-4;
  }
  void OnGetObservationNoise(KFMatrix_OxO& r) const override { r.setIdentity(); }
  void OnPreComputingPredictions(const vector_KFArray_OBS&,
                                 std::vector<std::size_t>& observed) const override {
    observed.clear();
    for (int i = 0; i < observed_; ++i) {
      observed.push_back(static_cast<std::size_t>((first_ + i) % landmarks_));
    }
  }
  void OnGetObservationsAndDataAssociation(vector_KFArray_OBS& z, std::vector<int>& association,
                                           const vector_KFArray_OBS&, const KFMatrix&,
                                           const std::vector<std::size_t>& observed,
                                           const KFMatrix_OxO&) override {
    z.clear();
    association.clear();
    for (const std::size_t landmark : observed) {
      KFArray_OBS zero;
      zero[0] = zero[1] = 0.0;
      z.push_back(zero);
      association.push_back(static_cast<int>(landmark));
    }
  }
  void OnObservationModel(const std::vector<std::size_t>& observed,
                          vector_KFArray_OBS& predictions) const override {
    predictions.resize(observed.size());
    for (KFArray_OBS& prediction : predictions) prediction[0] = prediction[1] = 0.1;
  }
  void OnObservationJacobians(std::size_t landmark, KFMatrix_OxV& h,
                              KFMatrix_OxF& landmark_jacobian) const override {
    const auto number = [&](int i) { return std::sin(1.0 + static_cast<double>(landmark) + i); };
    h.setZero();
    for (int i = 0; i < 14; ++i) h(i / 7, i % 7) = number(i);
    for (int i = 0; i < 12; ++i) landmark_jacobian(i / 6, i % 6) = number(20 + i);
  }

  int landmarks_, observed_, first_ = 0;
};

}  // namespace

std::unique_ptr<SlamPeer> MakeMrptSlam(int landmarks, int observed) {
  return std::make_unique<Mrpt>(landmarks, observed);
}

}  // namespace alidade::bench
