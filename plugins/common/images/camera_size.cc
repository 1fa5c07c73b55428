// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/images/camera_size.h"

#include <algorithm>

#include "alidade/base/error.h"

namespace alidade {

std::string SizeText(cv::Size size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height) + " px";
}

CameraSize::CameraSize(const SourceArguments& arguments, const Source& source) {
  if (arguments.config == nullptr) return;
  const Config config = arguments.config->Copy();  // copied: the keys of the original remain unread
  const Node root = config.root();
  const auto use = root.At("source").Find("calibration");
  std::optional<Config> calibration;
  if (!use || use->Text() != "ignore") calibration = source.Calibration();
  std::vector<Node> shared{root};
  if (calibration) shared.push_back(calibration->root().At("calibration"));
  for (const Node& sensor : SensorsOn(source.streams(), root)) {
    std::vector<Node> places{sensor};
    places.insert(places.end(), shared.begin(), shared.end());
    Read(places);
  }
  if (cameras_.empty()) Read(shared);
}

void CameraSize::Check(cv::Size found, const Place& image) const {
  for (const Camera& camera : cameras_) {
    if (Matches(camera.width, found.width) && Matches(camera.height, found.height)) continue;
    throw Error(
        ExitCode::kBadData,
        ErrorLine(image, {},
                  "the image is " + SizeText(found) + ", but the camera of " + camera.place +
                      " has " + SideText(camera.width) + "x" + SideText(camera.height) + " px",
                  "images of this camera, or a section 'camera' with the width and height "
                  "of these images, and with fx, fy, cx, cy in pixels of these images"));
  }
}

bool CameraSize::Matches(const std::optional<std::int64_t>& side, int found) {
  return !side || *side == found;
}

std::string CameraSize::SideText(const std::optional<std::int64_t>& side) {
  return side ? std::to_string(*side) : "?";
}

std::vector<Node> CameraSize::SensorsOn(const std::vector<StreamInfo>& streams, const Node& root) {
  std::vector<Node> found;
  const auto sensors = root.Find("sensors");
  if (!sensors || !sensors->is_map()) return found;
  for (const auto& [name, sensor] : sensors->Entries()) {
    const auto stream = sensor.is_map() ? sensor.Find("stream") : std::nullopt;
    if (!stream || stream->kind() != Node::Kind::kScalar) continue;
    if (std::ranges::find(streams, stream->Text(), &StreamInfo::name) != streams.end()) {
      found.push_back(sensor);
    }
  }
  return found;
}

void CameraSize::Read(const std::vector<Node>& maps) {
  constexpr std::int64_t kMaxSide = 1 << 20;
  Camera camera;
  const auto read = [&](const char* key, std::optional<std::int64_t>& side) {
    for (const Node& map : maps) {
      const auto section = map.Find("camera");
      const auto node = section && section->is_map() ? section->Find(key) : std::nullopt;
      if (!node) continue;
      side = node->Integer(1, kMaxSide);
      const Place& place = node->place();
      camera.place = place.file;
      if (place.line > 0) camera.place += ":" + std::to_string(place.line);
      return;
    }
  };
  read("height", camera.height);
  read("width", camera.width);
  if (camera.width || camera.height) cameras_.push_back(camera);
}

}  // namespace alidade
