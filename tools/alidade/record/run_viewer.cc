// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_viewer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "alidade/experiment/truth_match.h"
#include "alidade/record/feature_trails.h"
#include "alidade/record/images.h"
#include "alidade/record/map_from_above.h"
#include "alidade/record/partial_file.h"
#include "alidade/record/pose_file.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxElements = 8;
constexpr std::size_t kMaxInnovations = 4;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Returns the index of the first online estimator. Error: kBadConfig.
int FirstOnline(const Experiment& experiment) {
  for (std::size_t e = 0; e < experiment.estimators.size(); ++e) {
    if (!experiment.estimators[e].estimator->offline()) return static_cast<int>(e);
  }
  throw Error(ExitCode::kBadConfig,
              ErrorLine({}, "estimators",
                        "each estimator needs all frames before its first estimate, so no estimate "
                        "can be shown with an image",
                        "at least one recursive estimator, such as ekf"));
}

}  // namespace

struct RunViewer::Impl {
  const EstimatorSpec* spec;
  int estimator;
  Source* source;
  std::vector<int> truth_of;  ///< index of the truth of each block; -1: none
  std::optional<internal::PosePlace> pose;
  std::vector<std::unique_ptr<internal::PartialFile>>
      videos;  ///< declared before `writers`, so that the files outlive the writers
  std::vector<std::unique_ptr<ImageWriter>> writers;
  RunView view;
  internal::FeatureTrails trails;
  internal::MapFromAbove map_from_above;
  std::optional<SourceFrame> pending;  ///< last frame, if its estimate is still missing

  void Write() {
    for (const auto& writer : writers) writer->Add(view);
  }
  void Show(const SourceFrame& frame, const State* state, const UpdateReport* report);
  void UpdateInnovations(const Frame& frame, const UpdateReport* report);
  void UpdateElements(const State& state, const Truth& truth);
  void UpdateSeries(Timestamp timestamp);
  void UpdateMap(const State& state, const Truth& truth);
  /// Returns the true value of a block, or null if it is unknown.
  const double* TruthOf(std::size_t block, const Truth& truth) const {
    const int t = block < truth_of.size() ? truth_of[block] : -1;
    if (t < 0 || t >= std::ssize(truth)) return nullptr;
    const std::vector<double>& values = truth[static_cast<std::size_t>(t)];
    return values.empty() ? nullptr : values.data();
  }
};

RunViewer::RunViewer(const Experiment& experiment, const std::string& title)
    : impl_(std::make_unique<Impl>()) {
  if (!experiment.source->measures_images() && experiment.source->views() == 0) {
    throw Error(ExitCode::kBadConfig,
                ErrorLine({}, "source", "the source has no images to show",
                          "a source that reads images, or draws images from `surfaces`"));
  }
  if (experiment.out_of_sequence.policy != OutOfSequence::kReject) {
    throw Error(ExitCode::kBadConfig,
                ErrorLine({}, "out_of_sequence.policy",
                          "this policy reorders frames, so their images cannot be shown",
                          "'reject' for a run that shows its images"));
  }
  impl_->estimator = FirstOnline(experiment);
  impl_->spec = &experiment.estimators[static_cast<std::size_t>(impl_->estimator)];
  impl_->source = experiment.source.get();
  const StateLayout& layout = impl_->spec->problem.layout;
  impl_->truth_of = internal::MatchTruths(layout, experiment.source->truths());
  std::vector<StreamInfo> blocks;
  for (const Block& block : layout.blocks()) {
    blocks.push_back({block.name, block.geometry().ambient});
  }
  impl_->pose = internal::FindPose(blocks);
  if (impl_->pose && impl_->pose->planar) impl_->pose.reset();
  impl_->view.title = title;
  impl_->view.estimator = impl_->spec->name;
  impl_->view.number = -1;
}

RunViewer::~RunViewer() = default;

void RunViewer::AddVideo(const std::filesystem::path& file, bool force) {
  impl_->videos.push_back(std::make_unique<internal::PartialFile>(file, force));
  const internal::PartialFile& video = *impl_->videos.back();
  impl_->writers.push_back(
      OpenImageWriter({ImageArguments::Form::kVideo, video.partial(), file.string(), 0, 0}));
}

void RunViewer::AddWindow() {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) {
    throw Error(ExitCode::kCannotCreate,
                ErrorLine({}, "--view", "there is no display, because DISPLAY is not set",
                          "a graphical session; --save-video FILE.avi does not need a display"));
  }
  impl_->writers.push_back(OpenImageWriter(
      {ImageArguments::Form::kWindow, "alidade: " + impl_->view.title, "--view", 0, 0}));
}

void RunViewer::OnFrame(const SourceFrame& frame) {
  if (impl_->pending) impl_->Show(*impl_->pending, nullptr, nullptr);
  impl_->view.image = impl_->source->measures_images() ? impl_->source->LastImage()
                                                       : MeasuredImage{impl_->source->Draw(0)};
  impl_->pending = frame;
}

void RunViewer::OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                           const UpdateReport& report) {
  if (estimator == impl_->estimator && impl_->pending) impl_->Show(frame, &state, &report);
}

void RunViewer::Close() {
  if (impl_->pending) impl_->Show(*impl_->pending, nullptr, nullptr);
  for (const auto& writer : impl_->writers) writer->Close();
  for (const auto& video : impl_->videos) video->Commit();
}

void RunViewer::Impl::Show(const SourceFrame& frame, const State* state,
                           const UpdateReport* report) {
  ++view.number;
  view.timestamp = frame.timestamp;
  view.features = trails.Add(frame, report);
  UpdateInnovations(frame, report);
  view.counts = {};
  for (const ViewFeature& feature : view.features) {
    ++view.counts[static_cast<std::size_t>(feature.mark)];
  }
  for (const ViewInnovation& innovation : view.innovations) {
    ++view.counts[static_cast<std::size_t>(innovation.mark)];
  }
  if (state != nullptr) {
    UpdateElements(*state, frame.truth);
    if (pose) {
      UpdateMap(*state, frame.truth);
    } else {
      UpdateSeries(frame.timestamp);
    }
  }
  pending.reset();
  Write();
}

void RunViewer::Impl::UpdateInnovations(const Frame& frame, const UpdateReport* report) {
  view.innovations.clear();
  view.outline = Mark::kLost;
  if (report == nullptr) return;
  const std::vector<StreamInfo>& streams = source->streams();
  for (const MeasurementReport& measurement : report->measurements()) {
    if (measurement.landmark >= 0 || view.innovations.size() == kMaxInnovations) continue;
    const SensorBinding& sensor =
        spec->problem.sensors[static_cast<std::size_t>(measurement.sensor)];
    const auto is_of_sensor = [&](const Measurement& m) {
      return streams[static_cast<std::size_t>(m.stream)].name == sensor.stream;
    };
    const auto measured = std::ranges::find_if(frame.measurements, is_of_sensor);
    if (measured == frame.measurements.end() || measured->values.empty()) continue;
    double sigmas = kUnknown;
    if (!measurement.innovation.empty() && !measurement.s.empty() && measurement.s[0] > 0.0) {
      sigmas = measurement.innovation[0] / std::sqrt(measurement.s[0]);
    }
    view.innovations.push_back(
        {sensor.name, internal::MarkOf(measurement.outcome), measured->values[0], sigmas});
    // The outline of the target shows the best mark of all measurements of the target.
    view.outline = std::min(view.outline, view.innovations.back().mark);
  }
}

void RunViewer::Impl::UpdateElements(const State& state, const Truth& truth) {
  view.elements.clear();
  const std::size_t system_blocks = spec->problem.layout.blocks().size();
  for (std::size_t b = 0; b < system_blocks; ++b) {
    const auto id = static_cast<BlockId>(b);
    const Block& block = state.layout()[id];
    if (!block.present || block.geometry().ambient != block.geometry().tangent) continue;
    const std::vector<std::string> names = internal::TangentNames(block.name, block.space);
    const double* const true_value = TruthOf(b, truth);
    for (std::size_t i = 0; i < names.size() && view.elements.size() < kMaxElements; ++i) {
      view.elements.push_back({names[i], internal::UnitOf(spec->problem, id), state.value(id)[i],
                               state.sigma(id, static_cast<int>(i)),
                               true_value == nullptr ? kUnknown : true_value[i]});
    }
  }
}

void RunViewer::Impl::UpdateSeries(Timestamp timestamp) {
  if (view.elements.empty()) return;
  const ViewElement& first = view.elements.front();
  if (view.series && view.series->name != first.name) view.series.reset();
  if (!view.series) view.series = {first.name, first.unit, {}, {}, {}, {}};
  view.series->t_s.push_back(Seconds(timestamp));
  view.series->value.push_back(first.value);
  view.series->sigma.push_back(first.sigma);
  view.series->truth.push_back(first.truth);
}

void RunViewer::Impl::UpdateMap(const State& state, const Truth& truth) {
  const auto p = static_cast<BlockId>(pose->position), q = static_cast<BlockId>(pose->orientation);
  if (!state.layout()[p].present || !state.layout()[q].present) return;
  const double* const w = state.value(q);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  if (const Block& block = state.layout()[p]; block.has_covariance()) {
    covariance = state.covariance().Block(block.tangent_offset, 3, block.tangent_offset, 3);
  }
  const std::vector<LandmarkEstimate> landmarks = spec->estimator->landmarks();
  map_from_above.Add(Eigen::Map<const Eigen::Vector3d>(state.value(p)), covariance,
                     Eigen::Quaterniond(w[0], w[1], w[2], w[3]).matrix(),
                     TruthOf(pose->position, truth), landmarks);
  view.map = map_from_above.map();
  if (spec->problem.landmarks) view.landmarks = static_cast<int>(landmarks.size());
}

}  // namespace alidade
