// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of a frame in which the EKF measures 20 of 1000 landmarks. The bias of the
// sensor is either an estimated state or a consider state. The times are relative to the time of P
// - W W' alone, with matrices of the same size.
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/model/model.h"
#include "bench/speed/interleaved.h"

namespace alidade::bench {
namespace {

constexpr int kLandmarks = 1000, kMeasured = 20;

struct Walk : Motion<3, Vec<3>> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "", "x,y,z"}};
  template <class T>
  void Step(const T* r, const T* w, double, T* next) const {
    for (int i = 0; i < 3; ++i) next[i] = r[i] + w[i];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = 0.1 * std::sqrt(dt_s);
  }
};

/// Sensor z = p - r + b, with the bias b.
struct Offset : Sensor<Vec<3>, Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position", "m", "", "x,y,z"},
                                     Quantity{"bias", "m", "", "x,y,z"},
                                     Quantity{"landmark", "m", "", "x,y,z", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"offset", "m", "", "x,y,z"};
  template <class T>
  bool Predict(const T* r, const T* b, const T* p, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = p[i] - r[i] + b[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.05);
  }
};

double Coordinate(int landmark, int axis) { return std::sin(1.0 + landmark * (axis + 1)); }

Problem BuildMapProblem(BlockStatus bias) {
  Problem problem;
  const SharedMotion walk = MakeMotion(Walk(), "walk");
  for (const char* owner : {"cam", "bias"}) {
    const BlockStatus status = *owner == 'b' ? bias : BlockStatus::kEstimated;
    const std::string name = std::string(owner) + ".position";
    const BlockId id = problem.layout.Declare(name, owner, walk->blocks()[0], status);
    problem.motions.push_back({owner, walk, {id}});
    Prior prior;
    prior.block = id;
    prior.mean = {0.0, 0.0, 0.0};
    prior.covariance = 0.01 * Eigen::Matrix3d::Identity();
    problem.priors.push_back(prior);
  }
  SensorBinding sensor{"tracks", "tracks", MakeSensor(Offset(), "offset"), {}};
  sensor.roles.resize(3);
  sensor.roles[0].block = 0;
  sensor.roles[1].block = 1;
  problem.sensors.push_back(sensor);
  LandmarkOptions landmarks;
  for (int i = 0; i < kLandmarks; ++i) {
    landmarks.known.push_back({i, {Coordinate(i, 0), Coordinate(i, 1), Coordinate(i, 2)}, 0.1});
  }
  problem.landmarks = landmarks;
  return problem;
}

/// Run that processes one frame per call.
class Run {
 public:
  explicit Run(BlockStatus bias) : filter_(BuildMapProblem(bias), {}, {{"tracks", 3}}) {}

  void operator()() {
    Frame frame;
    frame.timestamp = TimestampFromSeconds(0.1 * count_);
    for (int i = 0; i < kMeasured; ++i) {
      const int id = (kMeasured * count_ + i) % kLandmarks;
      frame.measurements.push_back(
          {frame.timestamp, 0, id, {Coordinate(id, 0), Coordinate(id, 1), Coordinate(id, 2)}, {}});
    }
    ++count_;
    for (const MeasurementReport& entry : filter_.Process(frame).measurements()) {
      used_count_ += entry.outcome == Outcome::kAccepted;
    }
  }
  bool has_used_all() const { return used_count_ == kMeasured * count_; }

 private:
  Ekf filter_;
  int count_ = 0, used_count_ = 0;
};

int Main(int argc, char** argv) {
  CLI::App app("Time per frame of an EKF with 1000 landmarks, relative to P - W W' alone");
  int rounds = 20;
  app.add_option("--rounds", rounds, "number of frames for each contender")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  Run estimated(BlockStatus::kEstimated), considered(BlockStatus::kConsider);
  const int n = 6 + 3 * kLandmarks, m = 3 * kMeasured;
  Eigen::MatrixXd p = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd w = 1e-3 * Eigen::MatrixXd::Random(n, m);
  std::vector<Contender> contenders = {
      {"P - W W' by Eigen",
       [&] { p.selfadjointView<Eigen::Lower>().rankUpdate(w, -1.0); },
       1.0,
       {}},
      {"EKF, bias is estimated", [&] { estimated(); }, 1.0, {}},
      {"EKF, bias is considered", [&] { considered(); }, 1.0, {}}};
  Interleave(contenders, rounds);
  if (!estimated.has_used_all() || !considered.has_used_all()) {
    std::fprintf(stderr, "error: not every measurement was accepted\n");
    return 1;
  }
  PrintTable(contenders);
  PrintRatio("considered/estimated", contenders[2], contenders[1]);
  PrintRatio("estimated/floor", contenders[1], contenders[0]);
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) { return alidade::bench::Main(argc, argv); }
