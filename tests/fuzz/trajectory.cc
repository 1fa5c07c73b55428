// SPDX-License-Identifier: Apache-2.0
//
// The input contains two bytes of options, then a reference and an estimate in any format.
#include "alidade/evaluate/evaluate.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

constexpr TrajectoryFormat kFormats[] = {TrajectoryFormat::kDetect, TrajectoryFormat::kTum,
                                         TrajectoryFormat::kKitti, TrajectoryFormat::kEuroc};

EvaluateOptions OptionsOf(unsigned bits) {
  EvaluateOptions options;
  options.alignment = static_cast<Alignment>(bits % 6);
  options.align_poses = static_cast<int>(bits >> 3 & 3);
  options.pairs.unit = static_cast<DeltaUnit>((bits >> 5) % 5);
  options.pairs.all = (bits >> 8 & 1) != 0;
  options.max_diff = (bits >> 9 & 1) != 0 ? 10'000'000 : 1'000'000'000'000;
  options.offset = (bits >> 10 & 1) != 0 ? 0 : -1'000'000'000;
  options.plane = static_cast<Plane>(bits >> 13 & 3);
  options.downsample = (bits >> 15 & 1) != 0 ? 3 : 0;
  for (int relation = 0; relation < 6; ++relation) {
    if (relation != 0 && relation != 2)
      options.relations.push_back(static_cast<PoseRelation>(relation));
  }
  return options;
}

void Read(unsigned bits, const std::vector<std::string>& parts) {
  const TrajectoryFormat format = kFormats[bits >> 11 & 3];
  const MemoryFile first(parts[0]), second(parts[1]);
  const Trajectory reference = ReadTrajectory(first.path(), format);
  Require(reference.size() > 0, "a trajectory has no poses");
  for (std::size_t i = 1; i < reference.timestamps.size(); ++i) {
    Require(reference.timestamps[i - 1] <= reference.timestamps[i], "timestamps do not ascend");
  }
  const Trajectory estimate =
      ReadTrajectory(second.path(), TrajectoryFormat::kDetect, NonFiniteRows::kSkip);
  const Evaluation evaluation = Evaluate(reference, estimate, OptionsOf(bits));
  Require(evaluation.estimate.size() == evaluation.reference.size(), "a pose has no partner");
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  if (size < 2) return 0;
  const auto bits = static_cast<unsigned>(data[0] | data[1] << 8);
  static_cast<void>(Accepts([&] { Read(bits, Parts(TextOf(data + 2, size - 2), 2)); }));
  return 0;
}
