// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of a whole frame of the EKF at the size of SLAM. The state is a camera with 13
// numbers, and N landmarks in inverse depth. Each frame observes some landmarks. The time is
// compared with
//
//   peak      the operations of the update alone, at the rate at which this processor multiplies
//             and adds; this rate is measured alternately with frames, without other contenders
//   mrpt      mrpt::bayes::CKalmanFilterCapable, if it is installed, up to 300 landmarks
//   textbook  the update with dense H in Eigen, as compiled by this build: K = P H' S^-1,
//             P = (I - K H) P
//   joseph    the update with dense H in Eigen: P = (I - K H) P (I - K H)' + K R K'
//   openblas  the factor of S, W = P H' L^-T and P - W W' by OpenBLAS, if it is installed; the
//             other parts of a frame are omitted. OPENBLAS_CORETYPE selects the type of a
//             processor that OpenBLAS does not detect.
//
// The other contenders are also measured in turn with frames. They displace the data of the frames
// from the caches.
//
// The program then prints the exponent b of time ~ (number of states)^b for a prediction, for a
// frame that measures 20 landmarks, and for the replacement of a landmark by a new landmark.
//
//   bench_slam [--size N/observed ...] [--no-exponents]
#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/experiment/make_filter.h"
#include "alidade/state/instruction_set.h"
#include "bench/speed/interleaved.h"
#include "bench/speed/slam_peer.h"
#include "support/temporary_folder.h"

#ifdef ALIDADE_BENCH_OPENBLAS
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b,
            const int* ldb);
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* beta, double* c, const int* ldc);
}
#endif

namespace alidade::bench {
namespace {

constexpr const char* kConfig = R"(
alidade: 1
camera: {model: pinhole, width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
state:
  cam:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 0.1, angular_acceleration: 0.05}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0, 0, 0], sigma: 0.3}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.3}
landmarks:
  representation: inverse_depth
  prior: {inverse_distance: 0.35, sigma: 0.1}
sensors:
  pixels:
    model: inverse_depth_feature
    stream: tracks
    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}
    sigma_px: 1.0
estimators: {ekf: {type: ekf}}
)";

/// Filter, and frames of a camera that oscillates in front of a box of points. Each frame observes
/// the next `observed` points in turn.
class Slam {
 public:
  Slam(const PluginHost& host, const Config& config, int landmarks, int observed)
      : filter_(MakeFilter(config, host, "ekf")), observed_(observed) {
    Random random(1);
    for (int i = 0; i < landmarks; ++i) {
      points_.push_back({2.0 * random.Uniform() - 1.0, 1.6 * random.Uniform() - 0.8,
                         2.0 + 2.0 * random.Uniform()});
    }
    stream_ = filter_->stream("tracks");
    ProcessFrame(landmarks);
    for (int i = 0; i < 3; ++i) ProcessFrame(observed_);
  }

  void operator()() { ProcessFrame(observed_); }
  void Step() { filter_->Push(NextTime(), {}); }
  long size() const { return filter_->state().covariance().size(); }
  bool has_used_all() const { return used_count_ == measured_; }
  const Filter& filter() const { return *filter_; }

 private:
  Timestamp NextTime() { return TimestampFromSeconds(count_++ / 30.0); }
  void ProcessFrame(int count) {
    const Timestamp timestamp = NextTime();
    const double t = Seconds(timestamp);
    const double x = 0.2 * std::sin(t), y = 0.1 * std::sin(1.3 * t);
    const long first = static_cast<long>(observed_) * count_;
    std::vector<Reading> readings;
    for (int k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>((first + k) % std::ssize(points_));
      const auto& p = points_[i];
      readings.push_back({stream_,
                          {320.0 + 525.0 * (p[0] - x) / p[2], 240.0 + 525.0 * (p[1] - y) / p[2]},
                          static_cast<std::int64_t>(i)});
    }
    const UpdateReport& report = filter_->Push(timestamp, readings);
    for (const MeasurementReport& entry : report.measurements()) {
      measured_ += 1;
      used_count_ += entry.outcome == Outcome::kAccepted || entry.outcome == Outcome::kInitialised;
    }
  }

  std::unique_ptr<Filter> filter_;
  std::vector<std::array<double, 3>> points_;
  int observed_, stream_ = 0, count_ = 0;
  long measured_ = 0, used_count_ = 0;
};

/// Returns the number of multiplications and additions of an update of n states by m rows. H has 12
/// numbers in each row. The update computes P H', S, the factor of S, W = P H' L^-T and the lower
/// triangle of P - W W'.
double UpdateOperations(double n, double m) {
  return 2.0 * 12.0 * n * m + 12.0 * m * m + m * m * m / 3.0 + n * m * m + n * n * m;
}

/// Contender that multiplies and adds numbers in registers, without memory access.
template <int kLanes>
struct Multiply {
  using Vector [[gnu::vector_size(kLanes * sizeof(double))]] = double;
  [[gnu::always_inline]] static double Run(long rounds) {
    Vector sums[12];
    for (int k = 0; k < 12; ++k) sums[k] = static_cast<double>(k) - Vector{};
    Vector factor = 0.999999 - Vector{};
    for (long i = 0; i < rounds; ++i) {
#pragma GCC unroll 12
      for (int k = 0; k < 12; ++k) sums[k] = sums[k] * factor + factor;
    }
    double numbers[12 * kLanes];
    std::memcpy(numbers, sums, sizeof numbers);
    return std::accumulate(std::begin(numbers), std::end(numbers), 0.0);
  }
};

constexpr long kRounds = 20000;
double MultiplyBaseline() { return Multiply<2>::Run(kRounds); }
#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] double MultiplyAvx2() { return Multiply<4>::Run(kRounds); }
[[gnu::target("avx512f,avx2,fma")]] double MultiplyAvx512() { return Multiply<8>::Run(kRounds); }
#endif

struct Peak {
  double (*work)() = MultiplyBaseline;
  double operations = 2.0 * 2 * 12 * kRounds;
};

Peak PeakOf(const std::string& kernels) {
#if defined(__x86_64__)
  if (kernels == "AVX2") return {MultiplyAvx2, 2.0 * 4 * 12 * kRounds};
  if (kernels == "AVX-512") return {MultiplyAvx512, 2.0 * 8 * 12 * kRounds};
#endif
  return {};
}

/// Update of n states by m rows with dense matrices, as in textbooks.
struct Dense {
  Eigen::MatrixXd p, h, r;
  Dense(long n, long m)
      : p(Eigen::MatrixXd::Identity(n, n)),
        h(1e-3 * Eigen::MatrixXd::Random(m, n)),
        r(Eigen::MatrixXd::Identity(m, m)) {}
  Eigen::MatrixXd Gain() const {
    const Eigen::MatrixXd s = h * p * h.transpose() + r;
    return s.llt().solve(h * p).transpose();
  }
  void Textbook() {
    const Eigen::MatrixXd k = Gain();
    p = (Eigen::MatrixXd::Identity(p.rows(), p.rows()) - k * h) * p;
  }
  void Joseph() {
    const Eigen::MatrixXd k = Gain();
    const Eigen::MatrixXd a = Eigen::MatrixXd::Identity(p.rows(), p.rows()) - k * h;
    p = a * p * a.transpose() + k * r * k.transpose();
  }
};

#ifdef ALIDADE_BENCH_OPENBLAS
/// Update of n states by m rows with OpenBLAS: the factor of S, W = P H' L^-T and P - W W'.
struct OpenBlas {
  Eigen::MatrixXd p, pht, s, w, l;
  OpenBlas(long n, long m)
      : p(Eigen::MatrixXd::Identity(n, n)),
        pht(1e-3 * Eigen::MatrixXd::Random(n, m)),
        s(Eigen::MatrixXd::Identity(m, m)) {}
  void operator()() {
    w = pht;
    l = s;
    const auto n = static_cast<int>(w.rows()), m = static_cast<int>(w.cols());
    int info = 0;
    dpotrf_("L", &m, l.data(), &m, &info);
    const double plus_one = 1.0, minus_one = -1.0;
    dtrsm_("R", "L", "T", "N", &n, &m, &plus_one, l.data(), &m, w.data(), &n);
    dsyrk_("L", "N", &n, &m, &minus_one, w.data(), &n, &plus_one, p.data(), &n);
  }
};
#endif

/// State of a camera and N landmarks. Each call removes one landmark and initialises another.
class Exchange {
 public:
  explicit Exchange(int landmarks) : landmarks_(static_cast<std::size_t>(landmarks)) {
    const Space camera{"camera", "", "", {}, Geometry::Vector(kCamera)};
    camera_ = state_.Declare("cam.camera", "cam", camera);
    const std::vector<double> x(kCamera);
    state_.Add(camera_, x.data(), Eigen::MatrixXd::Identity(kCamera, kCamera));
    for (BlockId& landmark : landmarks_) landmark = Initialise();
  }
  void operator()() {
    BlockId& landmark = landmarks_[next_++ % landmarks_.size()];
    state_.Remove(landmark);
    landmark = Initialise();
  }

 private:
  static constexpr int kCamera = 12, kLandmark = 6;
  BlockId Initialise() {
    const BlockId id = state_.Declare("landmarks." + std::to_string(names_++), "landmarks", space_);
    state_.Initialise({&id, 1}, value_.data(), {&camera_, 1}, jacobian_, block_covariance_);
    return id;
  }

  State state_;
  BlockId camera_ = -1;
  std::vector<BlockId> landmarks_;
  std::size_t next_ = 0;
  long names_ = 0;
  const Space space_{"landmark", "", "", {}, Geometry::Vector(kLandmark)};
  const std::array<double, kLandmark> value_{};
  const RowMajor jacobian_ = RowMajor::Random(kLandmark, kCamera);
  const Eigen::MatrixXd block_covariance_ = Eigen::MatrixXd::Identity(kLandmark, kLandmark);
};

/// Returns other implementations of the update of n states by m rows.
std::vector<Contender> PeersOf([[maybe_unused]] int landmarks, [[maybe_unused]] int observed,
                               long n, long m) {
  std::vector<Contender> peers;
  if (n < 3000) {
    peers.push_back(
        {"textbook", [dense = std::make_shared<Dense>(n, m)] { dense->Textbook(); }, 1.0, {}});
    peers.push_back(
        {"joseph", [dense = std::make_shared<Dense>(n, m)] { dense->Joseph(); }, 1.0, {}});
  }
#ifdef ALIDADE_BENCH_OPENBLAS
  peers.push_back({"openblas", [blas = std::make_shared<OpenBlas>(n, m)] { (*blas)(); }, 1.0, {}});
#endif
#ifdef ALIDADE_BENCH_MRPT
  if (n < 3000) {
    const std::shared_ptr<SlamPeer> mrpt = MakeMrptSlam(landmarks, observed);
    peers.push_back({"mrpt", [mrpt] { mrpt->Frame(); }, 1.0, {}});
  }
#endif
  return peers;
}

void CompareSize(const PluginHost& host, const Config& config, const std::string& size,
                 const Peak& peak, int rounds, bool peers) {
  const int landmarks = std::atoi(size.c_str());
  const int observed = std::atoi(size.c_str() + size.find('/') + 1);
  Slam slam(host, config, landmarks, observed);
  const long n = slam.size(), m = 2L * observed;
  volatile double sink = 0.0;
  std::vector<Contender> contenders = {{"peak", [&] { sink = sink + peak.work(); }, 1.0, {}},
                                       {"frame", [&] { slam(); }, 1.0, {}}};
  // This part runs without the peers, because their dense matrices would displace the data of the
  // filter from the caches.
  Interleave(contenders, 4 * rounds);
  const double peak_ns = UpdateOperations(static_cast<double>(n), static_cast<double>(m)) /
                         peak.operations * contenders[0].Quantile(0.01);
  std::printf("%s: %ld states, %ld rows, %.3f ms per frame\n", size.c_str(), n, m,
              1e-6 * contenders[1].Quantile(0.5));
  std::printf("ratio update/peak_%s %.3f\n", size.c_str(), contenders[1].Quantile(0.01) / peak_ns);
  contenders[1].ns.clear();
  if (peers) {
    for (Contender& peer : PeersOf(landmarks, observed, n, m)) {
      contenders.push_back(std::move(peer));
    }
  }
  if (contenders.size() > 2) Interleave(contenders, rounds);
  if (!slam.has_used_all()) throw std::runtime_error("not every measurement was used");
  for (std::size_t i = 2; i < contenders.size(); ++i) {
    PrintRatio(contenders[i].name + "/update_" + size, contenders[i], contenders[1]);
  }
}

/// Prints the exponent: the slope of log(time) over log(states), by least squares.
void PrintExponent(const char* name, const std::vector<long>& states,
                   const std::vector<Contender>& contenders) {
  const auto count = static_cast<double>(states.size());
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double x = std::log(static_cast<double>(states[i]));
    const double y = std::log(contenders[i].Quantile(0.01));
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  std::printf("ratio exponent/%s %.2f\n", name, (count * sxy - sx * sy) / (count * sxx - sx * sx));
}

void CompareSizes(const PluginHost& host, const Config& config, int rounds) {
  constexpr int kSizes[] = {100, 200, 400, 1000}, kObserved = 20;
  std::vector<std::unique_ptr<Slam>> slams;
  std::vector<std::unique_ptr<Exchange>> exchanges;
  std::vector<Contender> step, frame, exchange;
  std::vector<long> states;
  for (const int size : kSizes) {
    Slam* const slam =
        slams.emplace_back(std::make_unique<Slam>(host, config, size, kObserved)).get();
    Exchange* const landmark_exchange =
        exchanges.emplace_back(std::make_unique<Exchange>(size)).get();
    states.push_back(slam->size());
    step.push_back({"step", [slam] { slam->Step(); }, 1.0, {}});
    frame.push_back({"frame", [slam] { (*slam)(); }, 1.0, {}});
    exchange.push_back({"exchange", [landmark_exchange] { (*landmark_exchange)(); }, 1.0, {}});
  }
  Interleave(frame, rounds);
  for (const auto& slam : slams) {
    if (!slam->has_used_all()) throw std::runtime_error("not every measurement was used");
  }
  Interleave(step, 10 * rounds);
  Interleave(exchange, 10 * rounds);
  PrintExponent("step", states, step);
  PrintExponent("frame_20", states, frame);
  PrintExponent("exchange", states, exchange);
}

int Main(int argc, char** argv) {
  CLI::App app(
      "Time per frame of an EKF at the size of SLAM, relative to the peak of the processor");
  int rounds = 15;
  bool peers = true;
  std::vector<std::string> sizes = {"30/20", "100/20", "300/20", "1000/20", "100/100", "300/300"};
  app.add_option("--rounds", rounds, "number of frames for each contender")->capture_default_str();
  app.add_option("--size", sizes, "number of landmarks / number of observed landmarks")
      ->capture_default_str();
  std::vector<std::string> settings;
  app.add_option("--set", settings, "setting KEY=VALUE of the config");
  app.add_flag("--peers,!--no-peers", peers, "also measure the dense update and other libraries");
  bool exponents = true;
  app.add_flag("--exponents,!--no-exponents", exponents,
               "also measure the exponents of time over states");
  CLI11_PARSE(app, argc, argv);

  const testing::TemporaryFolder temporary;
  const std::string file = (temporary.path() / "config.yaml").string();
  std::ofstream(file) << kConfig;
  Config config = Config::FromFile(file);
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == setting.npos) throw std::runtime_error("--set expects KEY=VALUE");
    config.Set(setting.substr(0, equals), setting.substr(equals + 1), "--set");
  }
  const PluginHost host;
  const std::string kernels = ToString(internal::BestInstructionSet());
  const Peak peak = PeakOf(kernels);
  std::printf("kernels: %s\n", kernels.c_str());
  for (const std::string& size : sizes) CompareSize(host, config, size, peak, rounds, peers);
  if (exponents) CompareSizes(host, config, rounds);
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) try {
  return alidade::bench::Main(argc, argv);
} catch (const std::exception& e) {
  std::cerr << "error: " << e.what() << '\n';
  return 1;
}
