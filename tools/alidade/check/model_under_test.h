// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "alidade/plugin/model_instance.h"

/// Functions of a model with named inputs and guarded output buffers.
namespace alidade::internal {

/// One value for each space. An empty value represents an unbound optional role.
using Values = std::vector<std::vector<double>>;

/// Row-major matrix. A vector is a matrix with one row. A cell contains 1e302 until it is written.
/// Guard words surround the matrix and separate the rows. A callee must not write to the guard
/// words.
class Buffer {
 public:
  Buffer(int rows, int columns);

  double* data() { return cells_.data() + kGuard; }
  int rows() const { return rows_; }
  int columns() const { return columns_; }
  int stride() const { return columns_ + kGap; }
  double operator()(int row, int column) const { return cells_[Index(row, column)]; }

  bool Untouched() const;
  bool GuardsIntact() const;
  /// Returns true if all bits are equal.
  friend bool operator==(const Buffer& a, const Buffer& b);

 private:
  static constexpr int kGuard = 32, kGap = 3;
  std::size_t Index(int row, int column) const {
    return static_cast<std::size_t>(kGuard) + static_cast<std::size_t>(row) * stride() + column;
  }
  int rows_, columns_;
  std::vector<double> cells_;
};

/// Returns true if a cell still contains the initial value of Buffer.
bool Unwritten(double cell);

struct Shape {
  int rows, columns;
};

/// One function of the plugin ABI. The concatenated Jacobians are the derivatives of all outputs
/// with respect to the first `differentiated` inputs, in tangent coordinates.
struct Function {
  std::string name;        ///< name in the C++ interface, as in `Predict`
  std::vector<int> slots;  ///< the inputs, as indices into ModelUnderTest::slots
  std::vector<Space> outputs;
  std::vector<Shape> matrices;  ///< Jacobians, or the factor of a covariance
  int differentiated = 0;
  bool is_noise = false;  ///< true: the only matrix is a noise factor L; every call computes it
  /// An entry of `matrices` is null if that matrix is not requested.
  std::function<std::int32_t(const double* const* inputs, double* const* outputs,
                             double* const* matrices, const std::int32_t* strides)>
      call;

  /// Returns true if each differentiated input has a separate Jacobian.
  bool jacobian_per_input() const { return std::ssize(matrices) == differentiated; }
};

/// Results of a call.
struct Answer {
  std::int32_t code = 0;
  std::vector<Buffer> outputs, matrices;
  int written_input = -1;  ///< first input that the call has changed; -1: none
  bool ok() const { return code == ALIDADE_OK; }
  friend bool operator==(const Answer&, const Answer&) = default;
};

/// Values of the parameter `matrices` that request no matrix or all matrices. A value >= 0 is the
/// index of one requested matrix.
enum : int { kNoMatrix = -1, kAllMatrices = -2 };

/// Model under test: its functions and the spaces of their inputs.
struct ModelUnderTest {
  explicit ModelUnderTest(std::shared_ptr<const ModelInstance> model_instance);

  bool is_sensor() const { return instance->c().kind == ALIDADE_KIND_SENSOR; }
  const Function* Find(const std::string& name) const;
  /// Returns the slot of a sensor's measurement.
  int measurement_slot() const { return static_cast<int>(instance->spaces().size()); }
  /// Returns the roles that a sensor's Initialise computes.
  std::vector<int> InitialisedRoles() const;

  std::shared_ptr<const ModelInstance> instance;
  /// Slots of a sensor: roles, measurement, `prior` if Initialise needs it, known numbers if any.
  /// Slots of a motion model: blocks, noise `w`, control input if any, `dt`.
  std::vector<Space> slots;
  int known_slot = -1;  ///< slot of the known numbers; -1: none
  std::vector<Function> functions;
};

Answer CallFunction(const Function& function, const Values& inputs, int matrices);

/// Formats a state, as in `depth = 0.3, orientation = (1, 0, 0, 0)`.
std::string StateText(const std::vector<Space>& spaces, const Values& values);

/// Returns `count` states with random values, followed by edge states. In an edge state one slot is
/// zero, tiny, large or a special value of its geometry (wrap-around, half turn, double cover); the
/// other slots are random. The measurement slot of a sensor is random. Half of the random states
/// have unbound optional roles.
std::vector<Values> RandomStates(const ModelUnderTest& model, int count, std::uint64_t seed);

}  // namespace alidade::internal
