// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <optional>

#include "alidade/check/check_context.h"
#include "alidade/check/check_values.h"

/// Check of angles: a number in rad that jumps by 2 pi must have the geometry of an angle.
namespace alidade::internal {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Element of an output.
struct Element {
  std::size_t output = 0, index = 0;
  std::string name;
};

/// Returns the elements of the outputs that are vectors, or parts of products, in rad.
std::vector<Element> UnwrappedAngles(const Function& f) {
  std::vector<Element> angles;
  for (std::size_t i = 0; i < f.outputs.size(); ++i) {
    const Space& space = f.outputs[i];
    const std::vector<std::string> names = ColumnNames(space.name, space);
    std::size_t part_index = 0;
    space.geometry.ForEachPart([&](const Geometry& part, int offset, int) {
      const bool has_part = part_index < space.part_units.size();
      const std::string& unit = has_part ? space.part_units[part_index] : space.unit;
      ++part_index;
      if (!part.is_vector() || unit != "rad") return;
      for (int k = offset; k < offset + part.ambient; ++k) {
        const auto index = static_cast<std::size_t>(k);
        angles.push_back({i, index, names[index]});
      }
    });
  }
  return angles;
}

/// Returns the point at the fraction s of the way from `start` to `end`.
Values Between(const std::vector<int>& slots, const std::vector<Space>& spaces, const Values& start,
               const Values& end, double s) {
  Values point = start;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (start[i].empty()) continue;
    const Geometry& geometry = spaces[static_cast<std::size_t>(slots[i])].geometry;
    std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(end[i].data(), start[i].data(), d.data());
    for (double& element : d) element *= s;
    geometry.Plus(start[i].data(), d.data(), point[i].data());
  }
  return point;
}

bool IsTurn(double difference, double tolerance) {
  return std::abs(std::abs(difference) - kTurn) < tolerance;
}

/// Path between two tested states, along which a function is evaluated.
class Path {
 public:
  Path(Context& context, Values start, Values end)
      : context_(&context), start_(std::move(start)), end_(std::move(end)) {}

  Values At(double s) const {
    const ModelUnderTest& model = context_->model();
    return Between(context_->main().slots, model.slots, start_, end_, s);
  }
  /// Returns the outputs at the fraction s, or nullopt if they are not defined.
  std::optional<Values> Evaluate(double s) const {
    const Answer answer = context_->CallWith(context_->main(), At(s), kNoMatrix);
    return answer.ok() ? std::optional<Values>(OutputValues(answer)) : std::nullopt;
  }
  /// Returns whether `element` jumps by 2 pi between the fractions `low` and `high`. Sets `low` to
  /// the fraction of the jump.
  bool Jumps(const Element& element, double& low, double high) const {
    constexpr double kTolerance = 1e-3, kResolution = 1e-9;
    const auto value = [&](double s) -> std::optional<double> {
      const auto values = Evaluate(s);
      if (!values) return std::nullopt;
      return (*values)[element.output][element.index];
    };
    auto below = value(low), above = value(high);
    while (below && above && high - low > kResolution) {
      const double middle = 0.5 * (low + high);
      const auto at_middle = value(middle);
      if (!at_middle) return false;
      const bool is_below = std::abs(*at_middle - *below) < std::abs(*at_middle - *above);
      (is_below ? low : high) = middle;
      (is_below ? below : above) = at_middle;
    }
    return below && above && IsTurn(*above - *below, kTolerance);
  }

 private:
  Context* context_;
  Values start_, end_;
};

bool HaveSameRoles(const Values& a, const Values& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].empty() != b[i].empty()) return false;
  }
  return true;
}

}  // namespace

CheckResult CheckAngles(Context& context) {
  const Function& f = context.main();
  const std::vector<Element> angles = UnwrappedAngles(f);
  if (angles.empty()) return Skip("no vector has the unit rad");
  constexpr int kSamples = 32;
  const std::vector<CheckedState>& states = context.states();
  const auto random = static_cast<std::size_t>(context.options().states);
  for (std::size_t i = 0; i + 1 < std::min(random, states.size()); ++i) {
    if (!states[i].defined || !states[i + 1].defined) continue;
    const Values start = Context::Inputs(f, states[i]), end = Context::Inputs(f, states[i + 1]);
    if (!HaveSameRoles(start, end)) continue;
    const Path path(context, start, end);
    std::optional<Values> previous = path.Evaluate(0.0);
    for (int n = 1; n <= kSamples && previous; ++n) {
      const std::optional<Values> next = path.Evaluate(static_cast<double>(n) / kSamples);
      for (const Element& angle : angles) {
        constexpr double kNear = 2.0;
        double s = static_cast<double>(n - 1) / kSamples;
        if (!next ||
            !IsTurn((*next)[angle.output][angle.index] - (*previous)[angle.output][angle.index],
                    kNear) ||
            !path.Jumps(angle, s, static_cast<double>(n) / kSamples)) {
          continue;
        }
        return Warn(angle.name +
                    " is a vector in rad, but jumps by 2 pi, so innovations near the "
                    "jump are wrong by 2 pi; declare it as Angle; " +
                    context.CallText(f, path.At(s)));
      }
      previous = next;
    }
  }
  return Ok("vectors in rad do not jump by 2 pi");
}

}  // namespace alidade::internal
