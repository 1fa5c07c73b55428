// SPDX-License-Identifier: Apache-2.0
// Models with a member that is missing or cannot be called. Each value of BAD_MEMBER selects one
// fault; 0 selects a model without a fault. The compiler must refuse each fault with a message, as
// bad_members_test.sh checks.
#include "alidade/model/plugin.h"

using alidade::MatrixRef;
using alidade::Params;
using alidade::Quantity;
using alidade::Vec;

struct Base : alidade::Sensor<Vec<1>, Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b", "", "", "x,y"}};
  static constexpr Quantity kMeasurement{"z"};
  explicit Base(Params&) {}
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] + b[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
};

#if BAD_MEMBER == 20
struct Seen : alidade::Sensor<Vec<1>, Vec<1>> {  // kRoles and kMeasurement are missing
  explicit Seen(Params&) {}
  template <class T>
  bool Predict(const T* a, T* z) const {
    z[0] = a[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1.0);
  }
};
#else
struct Seen : Base {
  using Base::Base;
#if BAD_MEMBER == 0
  void Jacobian(const double*, const double*, MatrixRef, MatrixRef) const {}
  bool Valid(const double*) const { return true; }
  template <class T>
  bool Initialise(const T*, const T*, T*) const {
    return true;
  }
  static constexpr int kInitialises = 0;
#elif BAD_MEMBER == 1
  void Jacobian(const double*, MatrixRef, MatrixRef) const {}  // a role is missing
#elif BAD_MEMBER == 2
  void Jacobian(const double*, const double*, MatrixRef, MatrixRef) {}  // not a const member
#elif BAD_MEMBER == 3
  template <class T>
  void Jacobian(const T*, const T*, T*, T*) const {}
  void Jacobian(double) const {}  // matches neither signature
#elif BAD_MEMBER == 4
 private:
  void Jacobian(const double*, const double*, MatrixRef, MatrixRef) const {}
#elif BAD_MEMBER == 5
  bool Valid(double) const { return true; }
#elif BAD_MEMBER == 6
  void Valid(const double*) const {}  // returns no value
#elif BAD_MEMBER == 7
  template <class T>
  bool Initialise(const T*, const T*, T*) const {
    return true;
  }
#elif BAD_MEMBER == 8
  static constexpr int kInitialises = 0;
  template <class T>
  bool Initialise(const T*, T*) const {  // the role b is missing
    return true;
  }
#elif BAD_MEMBER == 13
  template <class T>
  bool Predict(const T* a, T* z) const {  // the role b is missing
    z[0] = a[0];
    return true;
  }
#elif BAD_MEMBER == 14
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) {  // not a const member
    l[0] = T(1.0);
  }
#elif BAD_MEMBER == 21
  bool Predict(const double* a, const double*, double* z) const {  // not a template
    z[0] = a[0];
    return true;
  }
#endif
};
#endif

struct MotionBase : alidade::Motion<1, Vec<1>> {
#if BAD_MEMBER != 22
  static constexpr std::array kBlocks{Quantity { "x" }};
#endif
  explicit MotionBase(Params&) {}
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

struct Moved : MotionBase {
  using MotionBase::MotionBase;
#if BAD_MEMBER == 11
  using Input = Vec<2>;
  static constexpr Quantity kInput{"u", "", "", "x,y"};
  template <class T>
  void Step(const T* x, const T*, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
  void StepJacobian(const double*, const double*, const double*, double, MatrixRef,
                    MatrixRef) const {}
#elif BAD_MEMBER == 15
  template <class T>
  void Step(const T* x, double, T* next) const {  // the noise is missing
    next[0] = x[0];
  }
#elif BAD_MEMBER == 23
  void Step(const double* x, const double* w, double, double* next) const {  // not a template
    next[0] = x[0] + w[0];
  }
#else
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
#endif
#if BAD_MEMBER == 0
  void StepJacobian(const double*, const double*, double, MatrixRef f, MatrixRef g) const {
    f(0, 0) = g(0, 0) = 1.0;
  }
  bool Stationary() const { return false; }
  static constexpr int kStepOrder = 2;
#elif BAD_MEMBER == 10
  void StepJacobian(const double*, double, MatrixRef, MatrixRef) const {}  // the noise is missing
#elif BAD_MEMBER == 12
  bool Stationary(double) const { return false; }
#elif BAD_MEMBER == 16
  void SqrtQ(MatrixRef l) const { l(0, 0) = 1.0; }  // dt is missing
#elif BAD_MEMBER == 17
  static constexpr int kStepOrder = 9;
#elif BAD_MEMBER == 18
  static constexpr double kStepOrder = 2.0;
#elif BAD_MEMBER == 19
  int kStepOrder = 2;  // not static constexpr
#elif BAD_MEMBER == 24
  bool noise_kind() const { return true; }
#endif
};

ALIDADE_PLUGIN(ALIDADE_SENSOR(Seen, "seen", "", ""), ALIDADE_MOTION(Moved, "moved", "", ""))
