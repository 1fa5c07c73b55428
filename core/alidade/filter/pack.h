// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "alidade/model/autodiff.h"

/// The scalars of many filters at once, with which models are instantiated: kLanes numbers side by
/// side, and dual numbers of those.
namespace alidade::internal {

/// f(integral_constant<int, I>) for I < N: a loop that is unrolled before anything else, so that
/// arrays become single numbers.
template <int N, class F>
void For(const F& f) {
  detail::ForEach(f, std::make_index_sequence<static_cast<std::size_t>(N)>{});
}

/// Set where a model has compared packs and the lanes did not agree: what it then computed holds
/// for lane 0 alone.
inline constinit thread_local bool lanes_differ = false;

/// Vectors of the compiler.
template <int kWidth>
struct VectorsOf;
#define ALIDADE_VECTORS_OF(WIDTH)                                        \
  template <>                                                            \
  struct VectorsOf<WIDTH> {                                              \
    typedef double Numbers __attribute__((vector_size(WIDTH * 8)));      \
    typedef std::int64_t Truths __attribute__((vector_size(WIDTH * 8))); \
    typedef std::int8_t Bytes __attribute__((vector_size(WIDTH)));       \
  };
ALIDADE_VECTORS_OF(2)
ALIDADE_VECTORS_OF(4)
ALIDADE_VECTORS_OF(8)
#undef ALIDADE_VECTORS_OF

/// Lanes are kParts vectors of kWidth: two vectors side by side, of which neither waits for the
/// other, keep a processor busy that one would leave waiting for its last result.
template <int kLanes>
struct Parts {
  static constexpr int kWidth = kLanes < 8 ? kLanes : 8, kParts = kLanes / kWidth;
  using Vectors = VectorsOf<kWidth>;
};

/// A comparison of vectors.
template <int kWidth>
class VectorMask {
 public:
  using Numbers = typename VectorsOf<kWidth>::Numbers;
  static constexpr std::uint64_t kAll = ~std::uint64_t{0} >> (64 - 8 * kWidth);
  static constexpr bool kIsMask = false;

  void Less(const Numbers& a, const Numbers& b) { v_ = a < b; }
  void LessEqual(const Numbers& a, const Numbers& b) { v_ = a <= b; }
  void Equal(const Numbers& a, const Numbers& b) { v_ = a == b; }
  /// Element by element a where it holds, else b.
  void Select(const Numbers& a, const Numbers& b, Numbers& to) const { to = v_ ? a : b; }
  /// kAll where it holds for every element, 0 where for none.
  std::uint64_t bits() const {
    using Byte = typename VectorsOf<kWidth>::Bytes;
    const Byte bytes = __builtin_convertvector(v_, Byte);
    std::uint64_t bits = 0;
    std::memcpy(&bits, &bytes, kWidth);
    return bits;
  }

 private:
  typename VectorsOf<kWidth>::Truths v_;  ///< -1: true, 0: false
};

#if defined(__x86_64__)
/// Vectors of eight are for AVX-512 alone, which compares into a mask, a bit for each: of
/// comparisons as the language has them the compiler makes numbers, and bits of those.
template <>
class VectorMask<8> {
 public:
  using Numbers = typename VectorsOf<8>::Numbers;
  static constexpr std::uint64_t kAll = 255;
  static constexpr bool kIsMask = true;

  [[gnu::target("avx512f")]] void Less(const Numbers& a, const Numbers& b) {
    v_ = _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
  }
  [[gnu::target("avx512f")]] void LessEqual(const Numbers& a, const Numbers& b) {
    v_ = _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ);
  }
  [[gnu::target("avx512f")]] void Equal(const Numbers& a, const Numbers& b) {
    v_ = _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ);
  }
  [[gnu::target("avx512f")]] void Select(const Numbers& a, const Numbers& b, Numbers& to) const {
    to = _mm512_mask_blend_pd(v_, b, a);
  }
  void And(const VectorMask& other) { v_ &= other.v_; }
  std::uint64_t bits() const { return v_; }

 private:
  __mmask8 v_;
};
#endif

/// A comparison of packs, lane by lane; for Select, Any and All alone, and to be kept as Flags.
template <int kLanes>
struct PackMask : Parts<kLanes> {
  using Base = Parts<kLanes>;
  VectorMask<Base::kWidth> v[Base::kParts];

  PackMask() = default;
  // Not trivial: else packs would go from function to function in registers, of which each
  // instruction set has others.
  PackMask(const PackMask& other) {
    For<Base::kParts>([&](auto k) { v[k] = other.v[k]; });
  }
  PackMask& operator=(const PackMask& other) = default;
};
template <int kLanes>
bool Any(const PackMask<kLanes>& mask) {
  std::uint64_t any = 0;
  For<Parts<kLanes>::kParts>([&](auto k) { any |= mask.v[k].bits(); });
  return any != 0;
}
template <int kLanes>
bool All(const PackMask<kLanes>& mask) {
  constexpr std::uint64_t all = VectorMask<Parts<kLanes>::kWidth>::kAll;
  std::uint64_t every = all;
  For<Parts<kLanes>::kParts>([&](auto k) { every &= mask.v[k].bits(); });
  return every == all;
}

/// kLanes numbers, an element of as many filters. Arithmetic is lane by lane. A comparison is a
/// bool: that of every lane where they agree, else that of lane 0, and `lanes_differ` is set.
template <int kLanes>
struct Pack : Parts<kLanes> {
  using Base = Parts<kLanes>;
  using Vector = typename Base::Vectors::Numbers;
  using Mask = PackMask<kLanes>;
  static constexpr int kCount = kLanes;
  Vector v[Base::kParts];

  Pack() = default;
  Pack(double all) {  // NOLINT(google-explicit-constructor): as double has it
    const Vector zero = {};
    ForParts([&](auto k) { v[k] = all - zero; });  // GCC 12 makes a copy number by number
  }
  Pack(const Pack& other) {  // not trivial, for the reason of PackMask
    ForParts([&](auto k) { v[k] = other.v[k]; });
  }
  Pack& operator=(const Pack& other) {  // NOLINT(bugprone-unhandled-self-assignment): numbers
    ForParts([&](auto k) { v[k] = other.v[k]; });
    return *this;
  }
  /// kLanes numbers that lie side by side.
  static Pack Load(const double* from) {
    return Each([&](auto k, Vector& to) { std::memcpy(&to, from + k * Base::kWidth, sizeof to); });
  }
  void Store(double* to) const {
    ForParts([&](auto k) { std::memcpy(to + k * Base::kWidth, &v[k], sizeof v[k]); });
  }
  double lane(int i) const { return v[i / Base::kWidth][i % Base::kWidth]; }
  void SetLane(int i, double value) { v[i / Base::kWidth][i % Base::kWidth] = value; }

  friend Pack operator+(const Pack& a, const Pack& b) {
    return Each([&](auto k, Vector& to) { to = a.v[k] + b.v[k]; });
  }
  friend Pack operator-(const Pack& a, const Pack& b) {
    return Each([&](auto k, Vector& to) { to = a.v[k] - b.v[k]; });
  }
  friend Pack operator*(const Pack& a, const Pack& b) {
    return Each([&](auto k, Vector& to) { to = a.v[k] * b.v[k]; });
  }
  friend Pack operator/(const Pack& a, const Pack& b) {
    return Each([&](auto k, Vector& to) { to = a.v[k] / b.v[k]; });
  }
  friend Pack operator-(const Pack& a) {
    return Each([&](auto k, Vector& to) { to = -a.v[k]; });
  }
  friend Pack operator+(const Pack& a) { return a; }
  Pack& operator+=(const Pack& other) { return *this = *this + other; }
  Pack& operator-=(const Pack& other) { return *this = *this - other; }
  Pack& operator*=(const Pack& other) { return *this = *this * other; }
  Pack& operator/=(const Pack& other) { return *this = *this / other; }

  friend Mask Less(const Pack& a, const Pack& b) {
    return Compare([&](auto k, auto& to) { to.Less(a.v[k], b.v[k]); });
  }
  friend Mask LessEqual(const Pack& a, const Pack& b) {
    return Compare([&](auto k, auto& to) { to.LessEqual(a.v[k], b.v[k]); });
  }
  friend Mask Equal(const Pack& a, const Pack& b) {
    return Compare([&](auto k, auto& to) { to.Equal(a.v[k], b.v[k]); });
  }
  friend bool operator<(const Pack& a, const Pack& b) { return Agreed(Less(a, b)); }
  friend bool operator>(const Pack& a, const Pack& b) { return Agreed(Less(b, a)); }
  friend bool operator<=(const Pack& a, const Pack& b) { return Agreed(LessEqual(a, b)); }
  friend bool operator>=(const Pack& a, const Pack& b) { return Agreed(LessEqual(b, a)); }
  friend bool operator==(const Pack& a, const Pack& b) { return Agreed(Equal(a, b)); }
  friend bool operator!=(const Pack& a, const Pack& b) { return !(a == b); }

 private:
  template <class F>
  static void ForParts(const F& f) {
    For<Base::kParts>(f);
  }
  template <class F>
  static Pack Each(const F& f) {
    Pack result;
    ForParts([&](auto k) { f(k, result.v[k]); });
    return result;
  }
  template <class F>
  static Mask Compare(const F& f) {
    Mask result;
    ForParts([&](auto k) { f(k, result.v[k]); });
    return result;
  }
  static bool Agreed(const Mask& mask) {
    constexpr std::uint64_t all = VectorMask<Base::kWidth>::kAll;
    std::uint64_t every = all, any = 0;
    ForParts([&](auto k) {
      const std::uint64_t bits = mask.v[k].bits();
      every &= bits;
      any |= bits;
    });
    if (__builtin_expect(every == all, 1)) return true;
    if (any == 0) return false;
    lanes_differ = true;
    return (mask.v[0].bits() & 1) != 0;
  }
};

inline double Select(bool mask, double a, double b) { return mask ? a : b; }
template <int kLanes>
Pack<kLanes> Select(const PackMask<kLanes>& mask, const Pack<kLanes>& a, const Pack<kLanes>& b) {
  Pack<kLanes> result;
  For<Parts<kLanes>::kParts>([&](auto k) { mask.v[k].Select(a.v[k], b.v[k], result.v[k]); });
  return result;
}

/// What holds of each lane by several comparisons together. With AVX-512 a mask; else numbers, 1
/// for true and 0 for false: truths that are combined the compiler would take apart.
template <class S>
struct FlagsOf {
  using Type = bool;
};
template <int kLanes>
struct FlagsOf<Pack<kLanes>> {
  static constexpr bool kIsMask = VectorMask<Parts<kLanes>::kWidth>::kIsMask;
  using Type = std::conditional_t<kIsMask, PackMask<kLanes>, Pack<kLanes>>;
};
template <class S>
using Flags = typename FlagsOf<S>::Type;

inline bool And(bool flags, bool mask) { return flags && mask; }
inline bool Mask(bool flags) { return flags; }
template <int kLanes>
Pack<kLanes> And(const Pack<kLanes>& flags, const PackMask<kLanes>& mask) {
  return Select(mask, flags, Pack<kLanes>(0.0));
}
template <int kLanes>
PackMask<kLanes> Mask(const Pack<kLanes>& flags) {
  return Less(Pack<kLanes>(0.0), flags);
}
template <int kLanes>
PackMask<kLanes> And(const PackMask<kLanes>& flags, const PackMask<kLanes>& mask) {
  PackMask<kLanes> both(flags);
  For<Parts<kLanes>::kParts>([&](auto k) { both.v[k].And(mask.v[k]); });
  return both;
}
template <int kLanes>
const PackMask<kLanes>& Mask(const PackMask<kLanes>& flags) {
  return flags;
}
/// True of every lane.
template <class S>
Flags<S> AllFlags() {
  if constexpr (std::is_constructible_v<Flags<S>, double>) {
    return Flags<S>(1.0);
  } else {
    return Equal(S(0.0), S(0.0));
  }
}

/// f of each lane.
template <int kLanes, class F>
Pack<kLanes> Map(const Pack<kLanes>& a, const F& f) {
  Pack<kLanes> result;
  for (int i = 0; i < kLanes; ++i) result.SetLane(i, f(a.lane(i)));
  return result;
}
#define ALIDADE_PACK_FUNCTION(NAME)                           \
  template <int kLanes>                                       \
  Pack<kLanes> NAME(const Pack<kLanes>& a) {                  \
    return Map(a, [](double one) { return std::NAME(one); }); \
  }
ALIDADE_PACK_FUNCTION(sin)
ALIDADE_PACK_FUNCTION(cos)
ALIDADE_PACK_FUNCTION(tan)
ALIDADE_PACK_FUNCTION(asin)
ALIDADE_PACK_FUNCTION(acos)
ALIDADE_PACK_FUNCTION(atan)
ALIDADE_PACK_FUNCTION(exp)
ALIDADE_PACK_FUNCTION(log)
ALIDADE_PACK_FUNCTION(ceil)
ALIDADE_PACK_FUNCTION(floor)
#undef ALIDADE_PACK_FUNCTION
template <int kLanes>
Pack<kLanes> sqrt(const Pack<kLanes>& a) {  // the instruction alone, without errno
  return Map(a, [](double one) { return one < 0.0 ? NAN : __builtin_sqrt(one); });
}
template <int kLanes>
Pack<kLanes> abs(const Pack<kLanes>& a) {
  return Select(Less(a, Pack<kLanes>(0.0)), -a, a);
}
template <int kLanes>
Pack<kLanes> atan2(const Pack<kLanes>& y, const Pack<kLanes>& x) {
  Pack<kLanes> result;
  for (int i = 0; i < kLanes; ++i) result.SetLane(i, std::atan2(y.lane(i), x.lane(i)));
  return result;
}

/// A derivative, which may be known to be zero: the compiler then leaves its products out.
template <class S>
struct Partial {
  S value;
  bool some;  ///< false: zero

  static Partial Zero() { return {S(0.0), false}; }
  friend Partial operator+(const Partial& a, const Partial& b) {
    if (!a.some) return b;
    return b.some ? Partial{a.value + b.value, true} : a;
  }
  friend Partial operator*(const S& s, const Partial& a) {
    return a.some ? Partial{s * a.value, true} : a;
  }
};

/// A value and its N derivatives: ceres::Jet of any scalar.
template <class S, int N>
struct Dual {
  S a;
  Partial<S> d[N];

  Dual() = default;
  template <std::convertible_to<S> A>
  Dual(const A& value) : a(value) {  // NOLINT(google-explicit-constructor): as double has it
    For<N>([&](auto i) { d[i] = Partial<S>::Zero(); });
  }
  template <int kSeed>
  Dual(const S& value, std::integral_constant<int, kSeed>) : Dual(value) {
    d[kSeed] = {S(1.0), true};
  }
  Dual(const Dual& other) : a(other.a) {
    For<N>([&](auto i) { d[i] = other.d[i]; });
  }
  Dual& operator=(const Dual& other) {  // NOLINT(bugprone-unhandled-self-assignment): numbers
    a = other.a;
    For<N>([&](auto i) { d[i] = other.d[i]; });
    return *this;
  }

  friend Dual operator+(const Dual& x, const Dual& y) {
    return Both(x.a + y.a, x, S(1.0), y, S(1.0));
  }
  friend Dual operator-(const Dual& x, const Dual& y) {
    return Both(x.a - y.a, x, S(1.0), y, S(-1.0));
  }
  friend Dual operator*(const Dual& x, const Dual& y) { return Both(x.a * y.a, x, y.a, y, x.a); }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const S inverse = 1.0 / y.a, quotient = x.a * inverse;
    return Both(quotient, x, inverse, y, -quotient * inverse);
  }
  friend Dual operator-(const Dual& x) { return Chain(-x.a, x, S(-1.0)); }
  friend Dual operator+(const Dual& x) { return x; }
  Dual& operator+=(const Dual& other) { return *this = *this + other; }
  Dual& operator-=(const Dual& other) { return *this = *this - other; }
  Dual& operator*=(const Dual& other) { return *this = *this * other; }
  Dual& operator/=(const Dual& other) { return *this = *this / other; }

  friend bool operator<(const Dual& x, const Dual& y) { return x.a < y.a; }
  friend bool operator>(const Dual& x, const Dual& y) { return x.a > y.a; }
  friend bool operator<=(const Dual& x, const Dual& y) { return x.a <= y.a; }
  friend bool operator>=(const Dual& x, const Dual& y) { return x.a >= y.a; }
  friend bool operator==(const Dual& x, const Dual& y) { return x.a == y.a; }
  friend bool operator!=(const Dual& x, const Dual& y) { return x.a != y.a; }

  /// f, of slope df/dx.
  friend Dual Chain(const S& f, const Dual& x, const S& slope) {
    Dual result(f);
    For<N>([&](auto i) { result.d[i] = slope * x.d[i]; });
    return result;
  }
  /// f, of slopes df/dx and df/dy.
  friend Dual Both(const S& f, const Dual& x, const S& slope_x, const Dual& y, const S& slope_y) {
    Dual result(f);
    For<N>([&](auto i) { result.d[i] = slope_x * x.d[i] + slope_y * y.d[i]; });
    return result;
  }
  friend Dual sqrt(const Dual& x) {
    using std::sqrt;
    const S root = sqrt(x.a);
    return Chain(root, x, 0.5 / root);
  }
  friend Dual sin(const Dual& x) {
    using std::cos, std::sin;
    return Chain(sin(x.a), x, cos(x.a));
  }
  friend Dual cos(const Dual& x) {
    using std::cos, std::sin;
    return Chain(cos(x.a), x, -sin(x.a));
  }
  friend Dual tan(const Dual& x) {
    using std::tan;
    const S t = tan(x.a);
    return Chain(t, x, 1.0 + t * t);
  }
  friend Dual asin(const Dual& x) {
    using std::asin, std::sqrt;
    return Chain(asin(x.a), x, 1.0 / sqrt(1.0 - x.a * x.a));
  }
  friend Dual acos(const Dual& x) {
    using std::acos, std::sqrt;
    return Chain(acos(x.a), x, -1.0 / sqrt(1.0 - x.a * x.a));
  }
  friend Dual atan(const Dual& x) {
    using std::atan;
    return Chain(atan(x.a), x, 1.0 / (1.0 + x.a * x.a));
  }
  friend Dual atan2(const Dual& y, const Dual& x) {
    using std::atan2;
    const S inverse = 1.0 / (x.a * x.a + y.a * y.a);
    return Both(atan2(y.a, x.a), y, x.a * inverse, x, -y.a * inverse);
  }
  friend Dual exp(const Dual& x) {
    using std::exp;
    const S e = exp(x.a);
    return Chain(e, x, e);
  }
  friend Dual log(const Dual& x) {
    using std::log;
    return Chain(log(x.a), x, 1.0 / x.a);
  }
  friend Dual ceil(const Dual& x) {
    using std::ceil;
    return Dual(ceil(x.a));
  }
  friend Dual floor(const Dual& x) {
    using std::floor;
    return Dual(floor(x.a));
  }
  friend Dual abs(const Dual& x) {
    using std::abs;
    return Chain(abs(x.a), x, x.a < S(0.0) ? S(-1.0) : S(1.0));
  }
};

}  // namespace alidade::internal
