// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of one step of a small filter, relative to hand-unrolled code. A step is a
// prediction and two scalar measurements with gates, see depth_step.h. The filters of other
// libraries have no gates.
#include <CLI/CLI.hpp>
#include <Eigen/Core>

#include "alidade/base/statistics.h"
#include "alidade/estimation/ekf.h"
#include "alidade/model/static_ekf.h"
#include "bench/speed/depth_step.h"
#include "bench/speed/interleaved.h"
#include "motion_models/constant.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/model_maker.h"
#include "support/systems.h"

namespace alidade::bench {
namespace {

constexpr double kGate = 0.999;

/// Baseline: a filter in which every operation is unrolled by hand.
class HandUnrolled {
 public:
  void Step(double disparity, double inverse_scale) {
    Predict();
    if (disparity > 0.0 && z_ > 0.0) {
      const double inverse = 1.0 / z_, h = kBf * inverse;
      UpdateDisparity(disparity - h, -h * inverse);
    }
    if (inverse_scale > 0.0 && z_ > 0.0 && lambda_ > 0.0) UpdateScale(inverse_scale);
  }
  double depth() const { return z_; }

 private:
  void Predict() {
    z_ += kDt * v_;
    const double pvv = pvv_ + kVelocity * kVelocity;
    pzz_ += kDt * (2.0 * pvz_ + kDt * pvv_) + kPosition * kPosition;
    pvz_ += kDt * pvv_ + kPosition * kVelocity;
    plz_ += kDt * plv_;
    pvv_ = pvv;
  }
  void UpdateDisparity(double r, double h) {
    const double az = pzz_ * h, av = pvz_ * h, al = plz_ * h;
    Correct(az, av, al, 1.0 / (az * h + 1.0), r);
  }
  void UpdateScale(double inverse_scale) {
    const double s = lambda_ * z_, sigma = kRelative * s * s * s;
    const double az = pzz_ * lambda_ + plz_ * z_, av = pvz_ * lambda_ + plv_ * z_;
    const double al = plz_ * lambda_ + pll_ * z_;
    Correct(az, av, al, 1.0 / (az * lambda_ + al * z_ + sigma * sigma), inverse_scale - s);
  }
  /// Corrects the state. The arguments are the elements of a = P H', 1 / S, and the innovation r.
  void Correct(double az, double av, double al, double inverse_s, double r) {
    if (!(r * r * inverse_s <= gate_)) return;
    const double k = r * inverse_s;
    z_ += az * k;
    v_ += av * k;
    lambda_ += al * k;
    const double bz = az * inverse_s, bv = av * inverse_s, bl = al * inverse_s;
    pzz_ -= az * bz;
    pvz_ -= av * bz;
    pvv_ -= av * bv;
    plz_ -= al * bz;
    plv_ -= al * bv;
    pll_ -= al * bl;
  }

  static constexpr double kPosition = 0.5 * kDt * kDt * kAcceleration;
  static constexpr double kVelocity = kDt * kAcceleration;
  double gate_ = ChiSquareQuantile(kGate, 1);
  double z_ = 0.35, v_ = 0.0, lambda_ = 3.3;
  double pzz_ = 0.01, pvz_ = 0.0, pvv_ = 0.25, plz_ = 0.0, plv_ = 0.0, pll_ = 0.25;
};

/// Textbook filter with Eigen matrices of fixed size.
class FixedEigen {
 public:
  FixedEigen() {
    f_ << 1, kDt, 0, 0, 1, 0, 0, 0, 1;
    const Eigen::Vector3d g(0.5 * kDt * kDt * kAcceleration, kDt * kAcceleration, 0.0);
    q_ = g * g.transpose();
    p_.diagonal() << 0.01, 0.25, 0.25;
  }
  void Step(double disparity, double inverse_scale) {
    x_ = f_ * x_;
    p_ = f_ * p_ * f_.transpose() + q_;
    if (disparity > 0.0 && x_[0] > 0.0) {
      const double h = kBf / x_[0];
      Correct(disparity - h, Eigen::Vector3d(-h / x_[0], 0.0, 0.0), 1.0);
    }
    if (inverse_scale > 0.0 && x_[0] > 0.0 && x_[2] > 0.0) {
      const double s = x_[0] * x_[2], sigma = kRelative * s * s * s;
      Correct(inverse_scale - s, Eigen::Vector3d(x_[2], 0.0, x_[0]), sigma * sigma);
    }
  }
  double depth() const { return x_[0]; }

 private:
  void Correct(double r, const Eigen::Vector3d& h, double variance) {
    const Eigen::Vector3d a = p_ * h;
    const double inverse_s = 1.0 / (a.dot(h) + variance);
    if (!(r * r * inverse_s <= gate_)) return;
    x_ += a * (r * inverse_s);
    p_ -= (a * inverse_s) * a.transpose();
  }

  double gate_ = ChiSquareQuantile(kGate, 1);
  Eigen::Vector3d x_{0.35, 0.0, 3.3};
  Eigen::Matrix3d f_, q_, p_ = Eigen::Matrix3d::Zero();
};

/// Filter that is composed of shipped models at compile time.
class StaticFilter {
 public:
  StaticFilter() {
    filter_.Set<0>(0.35, 0.1);
    filter_.Set<1>(0.0, 0.5);
    filter_.Set<2>(3.3, 0.5);
  }
  void Step(double disparity, double inverse_scale) {
    static_cast<void>(filter_.Predict(kDt));
    filter_.Update<0>(stereo_, &disparity, gate_);
    filter_.Update<0, 2>(scale_, &inverse_scale, gate_);
  }
  double depth() const { return *filter_.value<0>(); }

 private:
  double gate_ = ChiSquareQuantile(kGate, 1);
  StereoDisparity stereo_{400.0, 0.065, 1.0};
  Scale2d scale_ = Scale2d::FromPixels(300.0, 1.0);
  StaticEkf<ConstantVelocity<1, false>, Constant<1>> filter_{
      ConstantVelocity<1, false>(kAcceleration), Constant<1>(1)};
};

/// Filter engine: processes a frame, and returns a report on all measurements.
class Engine {
 public:
  explicit Engine(Problem problem) {
    EkfOptions options;
    options.gate = kGate;
    filter_ = std::make_unique<Ekf>(problem, options, testing::StreamsOf(problem));
    filter_->Start(0);
    frame_ = testing::FrameAt(0.0, {{0, 0.0}, {1, 0.0}});
  }
  void Step(double disparity, double inverse_scale) {
    frame_.timestamp += kStep;
    frame_.measurements[0].values[0] = disparity;
    frame_.measurements[1].values[0] = inverse_scale;
    filter_->Process(frame_);
  }
  double depth() const { return testing::ValueOf(filter_->state(), "target.depth"); }

 private:
  static inline const Timestamp kStep = TimestampFromSeconds(kDt);
  std::unique_ptr<Ekf> filter_;
  Frame frame_;
};

/// Returns the problem with models behind the plugin ABI, as a config would create it.
Problem PluginProblem() {
  Problem problem = testing::DepthFilter();
  problem.motions[0].model =
      testing::AbiMotion<ConstantVelocity<1, false>>({{"noise.acceleration", {kAcceleration}}});
  problem.motions[1].model = testing::AbiMotion<Constant<>>({{"noise.random_walk", {0.0}}});
  problem.sensors[0].model = testing::AbiSensor<StereoDisparity>(
      {{"focal_px", {400.0}}, {"baseline_m", {0.065}}, {"sigma_px", {1.0}}});
  problem.sensors[1].model =
      testing::AbiSensor<Scale2d>({{"template_px", {300.0}}, {"sigma_px", {1.0}}});
  return problem;
}

/// Returns a contender whose chunk takes about 0.4 ms. Appends the depth of its filter after one
/// period to `depths`.
template <class Filter>
Contender MakeContender(const std::string& name, std::shared_ptr<Filter> filter,
                        const TargetMeasurements& target, std::vector<double>& depths) {
  const auto steps = [filter, &target, index = 0](int count) mutable {
    for (int i = 0; i < count; ++i) {
      filter->Step(target.disparity[static_cast<std::size_t>(index)],
                   target.inverse_scale[static_cast<std::size_t>(index)]);
      index = (index + 1) % TargetMeasurements::kPeriod;
    }
  };
  auto run = std::make_shared<std::decay_t<decltype(steps)>>(steps);
  (*run)(TargetMeasurements::kPeriod);
  depths.push_back(filter->depth());
  const double start = CpuNs();
  (*run)(TargetMeasurements::kPeriod);
  const double ns = (CpuNs() - start) / TargetMeasurements::kPeriod;
  const int count = std::max(1, static_cast<int>(4e5 / ns));
  return {name, [run, count] { (*run)(count); }, static_cast<double>(count), {}};
}

int Main(int rounds) {
  const TargetMeasurements target;
  std::vector<double> depths;
  std::vector<Contender> contenders;
  contenders.push_back(
      MakeContender("hand-unrolled (baseline)", std::make_shared<HandUnrolled>(), target, depths));
  contenders.push_back(
      MakeContender("Eigen, fixed size, by hand", std::make_shared<FixedEigen>(), target, depths));
  contenders.push_back(
      MakeContender("alidade, static", std::make_shared<StaticFilter>(), target, depths));
  contenders.push_back(MakeContender("alidade, models in process",
                                     std::make_shared<Engine>(testing::DepthFilter()), target,
                                     depths));
  contenders.push_back(
      MakeContender("alidade, plugins", std::make_shared<Engine>(PluginProblem()), target, depths));
  std::vector<std::string> peers;
  const auto add_peer = [&](const char* name, const char* text, std::shared_ptr<Peer> peer) {
    peers.emplace_back(name);
    contenders.push_back(MakeContender(text, std::move(peer), target, depths));
  };
#if defined(ALIDADE_BENCH_OPENCV)
  add_peer("opencv", "OpenCV KalmanFilter, two corrections", MakeOpenCv());
#endif
#if defined(ALIDADE_BENCH_BFL)
  add_peer("bfl", "Orocos BFL, two updates", MakeBfl());
#endif
#if defined(ALIDADE_BENCH_MRPT)
  add_peer("mrpt", "MRPT, one observation of two numbers", MakeMrpt());
#endif
  // All contenders solve the same problem. Depths may differ by 1 mm, because joint and sequential
  // updates linearise at different points.
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (std::abs(depths[i] - depths[0]) < 1e-3) continue;
    std::fprintf(stderr, "error: the final depth of %s is %.9f m, that of the baseline is %.9f m\n",
                 contenders[i].name.c_str(), depths[i], depths[0]);
    return 1;
  }
  Interleave(contenders, rounds);
  PrintTable(contenders);
  PrintRatio("static/baseline", contenders[2], contenders[0]);
  PrintRatio("direct/baseline", contenders[3], contenders[0]);
  PrintRatio("plugin/baseline", contenders[4], contenders[0]);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    PrintRatio(peers[i] + "/plugin", contenders[5 + i], contenders[4]);
  }
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) {
  CLI::App app{
      "Time of a step of a small filter, relative to hand-written code and other libraries."};
  int rounds = 300;
  app.add_option("--rounds", rounds, "Number of chunks of 0.4 ms for each contender")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return alidade::bench::Main(rounds);
}
