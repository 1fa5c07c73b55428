// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/filter/lane_step.h"

namespace alidade {

namespace internal {
/// Lanes of the packs that BestVectorKernels has: 2, 4 or 16.
int BestLanes();
/// Whether the processor runs packs of so many.
bool HasLanes(int lanes);
}  // namespace internal

/// Many filters of one layout, each a StaticEkf<Motions...> of its own: one for each target. As a
/// structure of arrays they are stepped 2, 4 or 16 at a time, by the instruction set that the
/// processor has (or the environment variable ALIDADE_KERNELS names).
///
///   symbol     shape              meaning
///   count      1                  number of filters, size()
///   x, P, r    as StaticEkf       of each filter
///
/// Models are those of StaticEkf, their functions templates on the scalar. Where a model compares
/// numbers and filters side by side differ in the answer, where one of them goes beyond what is
/// finite, and where dt_s differs, they are stepped one by one: to the same numbers, but slower
/// than StaticEkf. Valid of a sensor may be a template on the scalar too: it is then asked of all
/// side by side, and one by one only where they differ. Blocks and measurements are vectors and
/// angles, and there are neither control inputs nor numbers that come with a measurement (compile
/// errors). Numbers differ from those of StaticEkf by rounding. A step allocates nothing.
template <class... Motions>
class StaticEkfArray {
 public:
  using Composed = StaticEkf<Motions...>;
  using Covariance = typename Composed::Covariance;
  static constexpr int kTangent = Composed::kTangent;
  template <int B>
  using Space = typename Composed::template Space<B>;
  static_assert(internal::AreFlat<typename Composed::Spaces>::value,
                "a StaticEkfArray has vectors and angles alone: unit quaternions and unit vectors "
                "are for StaticEkf");
  static_assert(((Motions::Input::kAmbient == 0) && ...),
                "a StaticEkfArray takes no control inputs: use StaticEkf");

  explicit StaticEkfArray(int count, Motions... motions)
      : count_(count),
        lanes_(internal::BestLanes()),
        motions_(std::move(motions)...),
        tiles_(static_cast<std::size_t>((count + kTile - 1) / kTile)),
        statuses_(tiles_.size() * kTile, Status::kOk) {}

  int size() const { return count_; }
  /// Of the packs: 2 (SSE2), 4 (AVX2) or 16 (AVX-512), as many as the processor runs.
  int lanes() const { return lanes_; }
  void set_lanes(int lanes) {
    ALIDADE_EXPECTS(internal::HasLanes(lanes));
    lanes_ = lanes;
  }

  /// As StaticEkf has it, of `filter`.
  template <int B, class Matrix>
  void Set(int filter, const double* value, const Eigen::MatrixBase<Matrix>& p) {
    constexpr int o = Offset(B), k = Space<B>::kTangent;
    for (int lane = LaneOf(filter); lane < LaneEnd(filter); ++lane) {
      Tile& tile = TileOf(filter);
      for (int i = 0; i < k; ++i) tile.x[o + i][lane] = value[i];
      for (int i = 0; i < kTangent; ++i) {
        for (int j = 0; j <= i; ++j) {
          const bool row = i >= o && i < o + k, column = j >= o && j < o + k;
          if (row || column) tile.p[At(i, j)][lane] = row && column ? p(i - o, j - o) : 0.0;
        }
      }
      tile.in_interval[lane] = 0.0;
    }
  }
  template <int B>
  void Set(int filter, double value, double sigma) {
    static_assert(Space<B>::kTangent == 1, "a scalar block");
    Set<B>(filter, &value, Eigen::Matrix<double, 1, 1>::Constant(sigma * sigma));
  }

  /// Element e of block B.
  template <int B>
  double value(int filter, int e = 0) const {
    return TileOf(filter).x[Offset(B) + e][LaneOf(filter)];
  }
  Covariance covariance(int filter) const {
    Covariance p;
    for (int i = 0; i < kTangent; ++i) {
      for (int j = 0; j <= i; ++j) p(i, j) = p(j, i) = TileOf(filter).p[At(i, j)][LaneOf(filter)];
    }
    return p;
  }
  /// Of the last prediction.
  Status status(int filter) const { return statuses_[static_cast<std::size_t>(filter)]; }

  /// Steps every filter by dt_s seconds, then uses `updates` (ArrayUpdate), one after the other:
  /// in one pass over the filters. Outcome kInvalid too where there is no measurement. The number
  /// of filters that a model refuses to predict, see status(): their measurements are used at the
  /// state where they are.
  template <class... Updates>
  int Step(double dt_s, const Updates&... updates) {
    return Run(Same{dt_s, RootsOf(dt_s)}, updates...);
  }
  /// The same, filter i by dt_s[i].
  template <class... Updates>
  int Step(const double* dt_s, const Updates&... updates) {
    return Run(Each{dt_s}, updates...);
  }
  /// Updates alone.
  template <class... Updates>
  void Update(const Updates&... updates) {
    Run(None{}, updates...);
  }

 private:
  using Lanes = internal::LaneStep<double, Motions...>;
  template <class S>
  using State = internal::LaneState<S, Motions...>;
  static constexpr int kTile = 16;
  static constexpr int kAmbient = Composed::kAmbient;
  static constexpr int kTriangle = State<double>::kTriangle, kHeld = State<double>::kHeld;
  /// Filters side by side. Those beyond the last are copies of it.
  struct alignas(64) Tile {
    double x[kAmbient][kTile] = {}, p[kTriangle][kTile] = {}, held[kHeld + 1][kTile] = {};
    double in_interval[kTile] = {};
  };

  static constexpr int At(int i, int j) { return Lanes::At(i, j); }
  static constexpr int Offset(int block) { return Lanes::Offset(block); }
  Tile& TileOf(int filter) { return tiles_[static_cast<std::size_t>(filter / kTile)]; }
  const Tile& TileOf(int filter) const { return tiles_[static_cast<std::size_t>(filter / kTile)]; }
  static int LaneOf(int filter) { return filter % kTile; }
  int LaneEnd(int filter) const { return filter == count_ - 1 ? kTile : filter % kTile + 1; }

  using Roots = std::tuple<internal::RootQ<Motions>...>;
  Roots RootsOf(double dt_s) const {
    const auto make = [&](const auto&... motions) {
      return Roots(internal::RootQ<Motions>(motions, dt_s)...);
    };
    return std::apply(make, motions_);
  }
  /// By how much the filters are predicted: all alike, each by its own dt_s, or not at all.
  struct Same {
    double dt_s;
    Roots roots;
  };
  struct Each {
    const double* dt_s;
  };
  struct None {};

  /// What is asked of the filters.
  template <class Time, class... Updates>
  struct Request {
    const Time& time;
    const std::tuple<const Updates&...>& updates;
  };

  template <class Time, class... Updates>
  int Run(const Time& time, const Updates&... updates) {
    (CheckUpdate<Updates>(), ...);
    const std::tuple<const Updates&...> all(updates...);
    const Request<Time, Updates...> work{time, all};
    if constexpr (!std::is_same_v<Time, None>) {
      if (refused_ > 0) std::fill(statuses_.begin(), statuses_.end(), Status::kOk);
      refused_ = 0;
    }
#if defined(__x86_64__)
    if (lanes_ == 16) {
      RunAvx512(work);
    } else if (lanes_ == 4) {
      RunAvx2(work);
    } else  // NOLINT(readability-misleading-indentation)
#endif
      RunBaseline(work);
    return refused_;
  }
  template <class Work>
  ALIDADE_FLATTEN void RunBaseline(const Work& work) {
    RunTiles<2>(work);
  }
#if defined(__x86_64__)
  template <class Work>
  [[gnu::target("avx2,fma")]] ALIDADE_FLATTEN void RunAvx2(const Work& work) {
    RunTiles<4>(work);
  }
  template <class Work>
  [[gnu::target("avx512f,avx2,fma")]] ALIDADE_FLATTEN void RunAvx512(const Work& work) {
    RunTiles<16>(work);
  }
#endif
  template <class Update>
  static constexpr void CheckUpdate() {
    using Model = typename Update::Sensor;
    using Blocks = detail::Blocks<Model>;
    static_assert(Update::kRoles == Blocks::kCount, "one block for each role");
    static_assert(!detail::kHasKnown<Model>,
                  "a StaticEkfArray has no numbers that come with a measurement: use StaticEkf");
    static_assert(Model::Measurement::kAmbient == Model::Measurement::kTangent,
                  "a StaticEkfArray has measurements of vectors and angles: use StaticEkf");
    static_assert(internal::AreFlat<typename Model::Spaces>::value, "of vectors and angles");
    static_assert(
        internal::PredictsWith<Model, internal::Dual<internal::Pack<16>, Blocks::kTangent>,
                               typename Blocks::Indices>::value,
        "Predict is no template on the scalar: use StaticEkf");
  }

  template <int kLanes, class Work>
  void RunTiles(const Work& work) {
    for (int first = 0; first < count_; first += kLanes) {
      if (!StepPack<kLanes>(first, work)) StepOneByOne<kLanes>(first, work);
    }
  }
  /// Elements [first, first + kLanes) of `all`, the last one where it ends.
  template <int kLanes, class T>
  const T* Elements(const T* all, int first, T* padded) const {
    if (__builtin_expect(first + kLanes <= count_, 1)) return all + first;
    for (int i = 0; i < kLanes; ++i) padded[i] = all[std::min(first + i, count_ - 1)];
    return padded;
  }

  /// false, with nothing done, where the lanes have to be stepped one by one.
  template <int kLanes, class Work>
  bool StepPack(int first, const Work& work) {
    using S = internal::Pack<kLanes>;
    Tile& tile = TileOf(first);
    const int lane = LaneOf(first);
    internal::lanes_differ = false;
    State<S> state;
    internal::For<kAmbient>([&](auto i) { state.x[i] = S::Load(tile.x[i] + lane); });
    internal::For<kTriangle>([&](auto i) { state.p[i] = S::Load(tile.p[i] + lane); });
    state.in_interval = S::Load(tile.in_interval + lane);
    if (Any(Less(S(0.0), state.in_interval))) {
      internal::For<kHeld>([&](auto i) { state.held[i] = S::Load(tile.held[i] + lane); });
    } else {  // not used: any numbers
      internal::For<kHeld>([&](auto i) { state.held[i] = state.x[0]; });
    }
    internal::LaneStep<S, Motions...> step(state, motions_);
    if (!PredictPack<kLanes>(first, work.time, step)) return false;
    const auto update_all = [&](const auto&... updates) {
      return (UpdatePack<kLanes>(first, updates, step) && ...);
    };
    if (!std::apply(update_all, work.updates)) return false;
    if (internal::lanes_differ || !step.IsFinite()) return false;
    internal::For<kAmbient>([&](auto i) { state.x[i].Store(tile.x[i] + lane); });
    internal::For<kTriangle>([&](auto i) { state.p[i].Store(tile.p[i] + lane); });
    state.in_interval.Store(tile.in_interval + lane);
    if (Any(Less(S(0.0), state.in_interval))) {
      internal::For<kHeld>([&](auto i) { state.held[i].Store(tile.held[i] + lane); });
    }
    return true;
  }
  template <int kLanes, class Step>
  bool PredictPack(int, const None&, Step&) {
    return true;
  }
  template <int kLanes, class Step>
  bool PredictPack(int, const Same& same, Step& step) {
    return step.Predict(same.dt_s, &same.roots);
  }
  template <int kLanes, class Step>
  bool PredictPack(int first, const Each& each, Step& step) {
    double padded[kLanes];
    const double* const dt_s = Elements<kLanes>(each.dt_s, first, padded);
    for (int i = 1; i < kLanes; ++i) {
      if (dt_s[i] != dt_s[0]) return false;
    }
    const Roots roots = RootsOf(dt_s[0]);
    return step.Predict(dt_s[0], &roots);
  }
  /// Side by side where the model's Valid is a template, else lane by lane.
  template <class Model, int kLanes, class Valid>
  static bool AllValid(const Model& sensor, const internal::Pack<kLanes>* z, const Valid& valid) {
    if constexpr (requires { sensor.Valid(z); }) {
      const bool differed = std::exchange(internal::lanes_differ, false);
      const bool all = sensor.Valid(z);
      return !std::exchange(internal::lanes_differ, differed) && all;
    } else {
      bool all = true;
      internal::For<kLanes>([&](auto lane) { all = all && valid(lane); });
      return all;
    }
  }
  template <int kLanes, class Update, class Step>
  bool UpdatePack(int first, const Update& update, Step& step) {
    using S = internal::Pack<kLanes>;
    using Model = typename Update::Sensor;
    constexpr int m = Model::Measurement::kTangent;
    S z[m];
    double padded[m][kLanes];
    const double* from[m];
    for (int i = 0; i < m; ++i) {
      from[i] = Elements<kLanes>(update.z + std::ptrdiff_t{i} * count_, first, padded[i]);
      z[i] = S::Load(from[i]);
    }
    internal::Flags<S> active = internal::AllFlags<S>();
    const auto require = [&](const auto& holds) {
      double each[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) each[lane] = holds(lane) ? 1.0 : 0.0;
      active = And(active, Less(S(0.0), S::Load(each)));
    };
    if constexpr (detail::HasValid<Model>::value) {
      const auto valid = [&](int lane) {
        double one[m];
        for (int i = 0; i < m; ++i) one[i] = from[i][lane];
        return detail::CallValid(update.sensor, nullptr, one);
      };
      if (!AllValid(update.sensor, z, valid)) require(valid);
    }
    if (update.present != nullptr) {
      bool own[kLanes];
      const bool* const present = Elements<kLanes>(update.present, first, own);
      require([&](int lane) { return present[lane]; });
    }
    const auto result = step.Update(update, z, active);
    if (internal::lanes_differ) return false;
    if (update.outcomes != nullptr) {
      double used[kLanes], accepted[kLanes];
      Select(Mask(active), S(1.0), S(0.0)).Store(used);
      Select(Mask(result.accepted), S(1.0), S(0.0)).Store(accepted);
      for (int lane = 0; lane < kLanes && first + lane < count_; ++lane) {
        update.outcomes[first + lane] = used[lane] == 0.0       ? StaticOutcome::kInvalid
                                        : accepted[lane] != 0.0 ? StaticOutcome::kAccepted
                                                                : result.outcome;
      }
    }
    return true;
  }

  template <class Step>
  void PredictOne(int, const None&, Step&, State<double>&) {}
  template <class Step>
  void PredictOne(int filter, const Same& same, Step& step, State<double>& state) {
    PredictOne(filter, same.dt_s, same.roots, step, state);
  }
  template <class Step>
  void PredictOne(int filter, const Each& each, Step& step, State<double>& state) {
    PredictOne(filter, each.dt_s[filter], RootsOf(each.dt_s[filter]), step, state);
  }
  template <class Step>
  void PredictOne(int filter, double dt_s, const Roots& roots, Step& step, State<double>& state) {
    const State<double> before = state;
    Status& status = statuses_[static_cast<std::size_t>(filter)];
    status = Status::kOk;
    if (!step.Predict(dt_s, &roots)) {
      status = Status::kOutOfDomain;
    } else if (!step.IsFinite()) {
      state = before;
      status = Status::kError;
    }
    refused_ += status == Status::kOk ? 0 : 1;
  }
  /// The same filter by filter, as StaticEkf has it.
  template <int kLanes, class Work>
  [[gnu::noinline, gnu::cold]] void StepOneByOne(int first, const Work& work);

  int count_, lanes_, refused_ = 0;
  std::tuple<Motions...> motions_;
  std::vector<Tile> tiles_;
  std::vector<Status> statuses_;
};

template <class... Motions>
template <int kLanes, class Work>
void StaticEkfArray<Motions...>::StepOneByOne(int first, const Work& work) {
  for (int filter = first; filter < std::min(first + kLanes, count_); ++filter) {
    Tile& tile = TileOf(filter);
    const int lane = LaneOf(filter);
    State<double> state;
    for (int i = 0; i < kAmbient; ++i) state.x[i] = tile.x[i][lane];
    for (int i = 0; i < kTriangle; ++i) state.p[i] = tile.p[i][lane];
    for (int i = 0; i < kHeld; ++i) state.held[i] = tile.held[i][lane];
    state.in_interval = tile.in_interval[lane];
    internal::LaneStep<double, Motions...> step(state, motions_);
    PredictOne(filter, work.time, step, state);
    const auto update_one = [&](const auto& update) {
      using Model = typename std::decay_t<decltype(update)>::Sensor;
      constexpr int m = Model::Measurement::kTangent;
      double z[m];
      for (int i = 0; i < m; ++i) z[i] = update.z[std::ptrdiff_t{i} * count_ + filter];
      bool active = update.present == nullptr || update.present[filter];
      if constexpr (detail::HasValid<Model>::value) {
        active = active && detail::CallValid(update.sensor, nullptr, z);
      }
      StaticOutcome outcome = StaticOutcome::kInvalid;
      if (active) {
        const State<double> before = state;
        const auto result = step.Update(update, z, true);
        outcome = result.accepted ? StaticOutcome::kAccepted : result.outcome;
        if (!step.IsFinite()) {
          state = before;
          outcome = StaticOutcome::kNotFinite;
        }
      }
      if (update.outcomes != nullptr) update.outcomes[filter] = outcome;
    };
    const auto update_all = [&](const auto&... updates) { (update_one(updates), ...); };
    std::apply(update_all, work.updates);
    for (int to = lane; to < LaneEnd(filter); ++to) {
      for (int i = 0; i < kAmbient; ++i) tile.x[i][to] = state.x[i];
      for (int i = 0; i < kTriangle; ++i) tile.p[i][to] = state.p[i];
      for (int i = 0; i < kHeld; ++i) tile.held[i][to] = state.held[i];
      tile.in_interval[to] = state.in_interval;
    }
  }
}

}  // namespace alidade
