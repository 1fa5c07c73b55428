// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "alidade/plugin/model_instance.h"

/// The functions of a model as the checks see them: named inputs in, guarded buffers out.
namespace alidade::internal {

/// A value for each of some spaces; an empty one is an optional role that is not bound.
using Values = std::vector<std::vector<double>>;

/// A row-major matrix, or a vector as one row, in cells that hold 1e302 until they are written,
/// between words that a callee has no business to touch: in front, behind and after each row.
class Buffer {
 public:
  Buffer(int rows, int columns);

  double* data() { return cells_.data() + kGuard; }
  int rows() const { return rows_; }
  int columns() const { return columns_; }
  int stride() const { return columns_ + kGap; }
  double operator()(int row, int column) const { return cells_[Index(row, column)]; }

  bool Untouched() const;
  bool GuardsWhole() const;
  /// Bit by bit.
  friend bool operator==(const Buffer& a, const Buffer& b);

 private:
  static constexpr int kGuard = 32, kGap = 3;
  std::size_t Index(int row, int column) const {
    return static_cast<std::size_t>(kGuard) + static_cast<std::size_t>(row) * stride() + column;
  }
  int rows_, columns_;
  std::vector<double> cells_;
};

/// Whether a cell still has what Buffer put there.
bool Unwritten(double cell);

struct Shape {
  int rows, columns;
};

/// One function of the plugin ABI. Its Jacobians side by side are d outputs / d inputs, in the
/// tangents, for the first `differentiated` inputs in order.
struct Function {
  std::string name;        ///< as the author knows it: `Predict`
  std::vector<int> slots;  ///< the inputs, as indices into ModelUnderTest::slots
  std::vector<Space> outputs;
  std::vector<Shape> matrices;  ///< Jacobians; or the factor of a covariance
  int differentiated = 0;
  bool is_noise = false;  ///< the one matrix is a factor L, always written
  /// `matrices` has null entries for what is not wanted.
  std::function<std::int32_t(const double* const* inputs, double* const* outputs,
                             double* const* matrices, const std::int32_t* strides)>
      call;

  /// Whether each of the differentiated inputs has a Jacobian of its own.
  bool jacobian_per_input() const { return std::ssize(matrices) == differentiated; }
};

/// What a call left.
struct Answer {
  std::int32_t code = 0;
  std::vector<Buffer> outputs, matrices;
  int written_input = -1;  ///< the first of its inputs that is no longer what it was
  bool ok() const { return code == ALIDADE_OK; }
  friend bool operator==(const Answer&, const Answer&) = default;
};

/// Which matrices a call asks for: none, all, or the one of an index.
enum : int { kNoMatrix = -1, kAllMatrices = -2 };

/// A model under test: everything that its functions take, and the functions.
struct ModelUnderTest {
  explicit ModelUnderTest(std::shared_ptr<const ModelInstance> from);

  bool is_sensor() const { return instance->c().kind == ALIDADE_KIND_SENSOR; }
  const Function* Find(const std::string& name) const;
  /// Of a sensor: the slot of its measurement.
  int measurement_slot() const { return static_cast<int>(instance->spaces().size()); }
  /// Of a sensor that can initialise: the roles that Initialise computes.
  std::vector<int> Initialised() const;

  std::shared_ptr<const ModelInstance> instance;
  /// Sensor: its roles, the measurement, the `prior` of Initialise where it needs one, the known
  /// numbers where it takes any. Motion: its blocks, the noise `w`, the control input where it has
  /// one, `dt`.
  std::vector<Space> slots;
  int known_slot = -1;  ///< -1: it takes none
  std::vector<Function> functions;
};

Answer CallFunction(const Function& function, const Values& inputs, int matrices);

/// `depth = 0.3, orientation = (1, 0, 0, 0)`
std::string StateText(const std::vector<Space>& spaces, const Values& values);

/// `count` random values of the slots of a model, then states at the edges: each slot in turn zero,
/// tiny, large or where its geometry wraps, turns over or is counted twice, the others random. The
/// slot of a sensor's measurement is random here; half of the random states leave optional roles
/// unbound.
std::vector<Values> RandomStates(const ModelUnderTest& model, int count, std::uint64_t seed);

}  // namespace alidade::internal
