// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of one frame of a filter with formula models, relative to the filter with
// compiled models behind the plugin ABI. The filter has a unicycle with a control input, a range
// and a bearing. A frame contains one control input and two measurements.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "alidade/config/config.h"
#include "alidade/estimation/ekf.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/plugin/plugin_host.h"
#include "bench/speed/interleaved.h"
#include "support/model_maker.h"
#include "support/systems.h"

namespace alidade::bench {
namespace {

constexpr double kSpeed = 1.0, kTurnRate = 0.2, kDt = 0.1;

constexpr const char* kSensors = R"yaml(
sensors:
  range:
    model: formula
    stream: range
    roles: {p: robot.p}
    constants: {anchor: [30, -20]}
    z: {range: norm(p - anchor)}
    sigma: {range: 0.1}
  bearing:
    model: formula
    stream: bearing
    roles: {p: robot.p, heading: robot.heading}
    constants: {b: [-40, 50]}
    z:
      bearing: wrap(atan2(b[1] - p.y, b[0] - p.x) - heading)
    sigma: {bearing: 0.035}
)yaml";

constexpr const char* kState = R"yaml(
state:
  robot:
    model: formula
    blocks: {p: [x, y], heading: angle}
    inputs: {u: [v, omega]}
    noise: {nv: 0.1, nw: 0.05}
    input: {stream: wheels}
    initial: {p: {mean: [0, 0], sigma: 0.3}, heading: {mean: 0, sigma: 0.1}}
)yaml";

constexpr const char* kStep = R"yaml(
    let: {v: u.v + nv, w: u.omega + nw, m: heading + 0.5 * w * dt}
    step:
      p: p + v * dt * [cos(m), sin(m)]
      heading: heading + w * dt
)yaml";

constexpr const char* kRate = R"yaml(
    rate:
      p: (u.v + nv) * [cos(heading), sin(heading)]
      heading: u.omega + nw
)yaml";

struct Range : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"p", "", "", "x,y"}};
  static constexpr Quantity kMeasurement{"range"};
  explicit Range(Params& /*params*/) {}
  template <class T>
  bool Predict(const T* p, T* z) const {
    using std::sqrt;
    const T dx = p[0] - 30.0, dy = p[1] + 20.0;
    const T squared = dx * dx + dy * dy;
    if (!(squared > T(0.0))) return false;
    z[0] = sqrt(squared);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
};

struct Bearing : Sensor<Angle, Vec<2>, Angle> {
  static constexpr std::array kRoles{Quantity{"p", "", "", "x,y"}, Quantity{"heading", "rad"}};
  static constexpr Quantity kMeasurement{"bearing", "rad"};
  explicit Bearing(Params& /*params*/) {}
  template <class T>
  bool Predict(const T* p, const T* heading, T* z) const {
    using std::atan2;
    const T dx = -40.0 - p[0], dy = 50.0 - p[1];
    if (!(dx * dx + dy * dy > T(0.0))) return false;
    z[0] = Angle::Wrap(T(atan2(dy, dx) - heading[0]));
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.035);
  }
};

struct Unicycle : Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{Quantity{"p", "", "", "x,y"}, Quantity{"heading", "rad"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"u", "", "", "v,omega"};
  explicit Unicycle(Params& /*params*/) {}
  template <class T>
  void Step(const T* p, const T* heading, const T* u, const T* w, double dt_s, T* p1,
            T* heading1) const {
    using std::cos;
    using std::sin;
    const T distance = (u[0] + w[0]) * dt_s, turn = (u[1] + w[1]) * dt_s;
    const T middle = heading[0] + 0.5 * turn;
    p1[0] = p[0] + distance * cos(middle);
    p1[1] = p[1] + distance * sin(middle);
    heading1[0] = Angle::Wrap(T(heading[0] + turn));
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    const double scale = dt_s > 0.0 ? 1.0 / std::sqrt(dt_s) : 1.0;
    l(0, 0) = 0.1 * scale;
    l(1, 1) = 0.05 * scale;
  }
};

Problem FormulaProblem(const char* motion) {
  const Config config = Config::FromText(std::string(kState) + motion + kSensors, "bench_formula");
  return ReadProblem(config.root(), PluginHost(), {});
}

Problem CompiledProblem() {
  Problem problem = FormulaProblem(kStep);
  problem.motions[0].model = testing::AbiMotion<Unicycle>();
  problem.sensors[0].model = testing::AbiSensor<Range>();
  problem.sensors[1].model = testing::AbiSensor<Bearing>();
  return problem;
}

/// Filter of a robot that drives in a circle.
class Robot {
 public:
  explicit Robot(const Problem& problem) {
    filter_ =
        std::make_unique<Ekf>(problem, EkfOptions{},
                              std::vector<StreamInfo>{{"wheels", 2}, {"range", 1}, {"bearing", 1}});
    filter_->Start(0);
    frame_ = testing::FrameAt(0.0, {{0, 0.0}, {1, 0.0}, {2, 0.0}});
    frame_.measurements[0].values = {kSpeed, kTurnRate};
  }
  void Step() {
    ++count_;
    frame_.timestamp += TimestampFromSeconds(kDt);
    const double heading = kTurnRate * kDt * count_, radius = kSpeed / kTurnRate;
    const double x = radius * std::sin(heading), y = radius * (1.0 - std::cos(heading));
    frame_.measurements[1].values[0] = std::hypot(x - 30.0, y + 20.0);
    frame_.measurements[2].values[0] = Angle::Wrap(std::atan2(50.0 - y, -40.0 - x) - heading);
    filter_->Process(frame_);
  }
  double heading() const { return testing::ValueOf(filter_->state(), "robot.heading"); }

 private:
  std::unique_ptr<Ekf> filter_;
  Frame frame_;
  int count_ = 0;
};

Contender MakeContender(const std::string& name, const Problem& problem, double& heading) {
  constexpr int kSettle = 1000, kSteps = 300;
  const auto robot = std::make_shared<Robot>(problem);
  for (int i = 0; i < kSettle; ++i) robot->Step();
  heading = robot->heading();
  const auto run = [robot] {
    for (int i = 0; i < kSteps; ++i) robot->Step();
  };
  return {name, run, kSteps, {}};
}

int Main(int rounds) {
  double compiled = 0.0, step = 0.0, rate = 0.0;
  std::vector<Contender> contenders;
  contenders.push_back(MakeContender("compiled, plugin ABI", CompiledProblem(), compiled));
  contenders.push_back(MakeContender("formula, step", FormulaProblem(kStep), step));
  contenders.push_back(MakeContender("formula, rate", FormulaProblem(kRate), rate));
  // The formula of the step is the compiled model. That of the rate differs by its integration.
  if (!(std::abs(step - compiled) < 1e-9) || !(std::abs(rate - compiled) < 1e-3)) {
    std::fprintf(stderr, "error: the final headings differ: %.12f, %.12f and %.12f rad\n", compiled,
                 step, rate);
    return 1;
  }
  Interleave(contenders, rounds);
  PrintTable(contenders);
  std::printf("compiled: %.0f ns for each frame\n", contenders[0].Quantile(0.01));
  PrintRatio("step/compiled", contenders[1], contenders[0]);
  PrintRatio("rate/compiled", contenders[2], contenders[0]);
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) {
  CLI::App app{"Time of a frame of a filter with formula models, relative to compiled models."};
  int rounds = 400;
  app.add_option("--rounds", rounds, "Number of chunks of each contender")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return alidade::bench::Main(rounds);
}
