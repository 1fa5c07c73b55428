// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/calibration_file.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/io/read_file.h"

namespace alidade {
namespace {

class CalibrationFile {
 public:
  explicit CalibrationFile(const std::filesystem::path& file)
      : input_(Config::FromText(PlainYaml(file), file.string())),
        output_(Config::FromText("calibration: {}", file.string())) {
    const Node root = input_.root();
    root.Declare("sigma_px");
    if (root.Find("camera_matrix")) {
      ReadOpenCv(root);
    } else if (const auto first = root.Find("cam0")) {
      ReadKalibr(*first, "distortion_coeffs");
    } else if (root.Find("intrinsics")) {
      ReadKalibr(root, "distortion_coefficients");
    } else {
      ReadAlidade(root);
    }
  }

  Config calibration() && { return std::move(output_); }

 private:
  void ReadAlidade(const Node& root) {
    if (const auto camera = root.Find("camera")) {
      for (const auto& [key, value] : camera->Entries()) Copy(value, "camera." + key);
      if (!camera->Find("model")) Set("camera.model", "pinhole", camera->place());
    } else {
      ReadIntrinsics(root);
    }
    root.RejectUnread();
  }

  /// Returns the text of the file. Replaces the directive and the tags of OpenCV, which are not
  /// YAML, by blanks.
  static std::string PlainYaml(const std::filesystem::path& file) {
    std::string text = internal::ReadFile(file, [&](ExitCode code, int error) {
      throw Error(code, ErrorLine({file.string()}, {}, std::strerror(error)));
    });
    for (const std::string_view directive : {"%YAML:1.0", "!!opencv-matrix"}) {
      for (std::size_t offset = 0; (offset = text.find(directive, offset)) != text.npos;) {
        text.replace(offset, directive.size(), directive.size(), ' ');
      }
    }
    return text;
  }

  void ReadOpenCv(const Node& root) {
    const Node matrix = root.At("camera_matrix").At("data");
    const std::vector<double> k = matrix.Numbers(9);
    if (k[1] != 0.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
      matrix.Fail("this is not a camera matrix without skew", "[fx, 0, cx, 0, fy, cy, 0, 0, 1]");
    }
    SetIntrinsics({k[0], k[4], k[2], k[5]}, matrix.place());
    Copy(root.At("image_width"), "camera.width");
    Copy(root.At("image_height"), "camera.height");
    const auto model = root.Find("distortion_model");
    SetDistortion(root.At("distortion_coefficients").At("data"),
                  model && model->Text() == "equidistant");
  }

  void ReadKalibr(const Node& camera, const char* distortion) {
    const Node model = camera.At("camera_model");
    if (model.Text() != "pinhole") {
      model.Fail("unknown camera model '" + model.Text() + "'", "pinhole");
    }
    const Node intrinsics = camera.At("intrinsics"), size = camera.At("resolution");
    const std::vector<double> k = intrinsics.Numbers(4);
    SetIntrinsics({k[0], k[1], k[2], k[3]}, intrinsics.place());
    const std::vector<Node> sides = size.Items();
    if (sides.size() != 2) size.Fail("the list must have two numbers", "[width, height], px");
    Copy(sides[0], "camera.width");
    Copy(sides[1], "camera.height");
    const Node kind = camera.At("distortion_model");
    if (kind.Text() == "none") return Set("camera.model", "pinhole", kind.place());
    const bool equidistant = kind.Text() == "equidistant";
    if (!equidistant && kind.Text() != "radtan" && kind.Text() != "radial-tangential") {
      kind.Fail("unknown distortion model '" + kind.Text() + "'",
                "radtan, radial-tangential, equidistant or none");
    }
    SetDistortion(camera.At(distortion), equidistant);
  }

  void SetIntrinsics(const std::array<double, 4>& fx_fy_cx_cy, const Place& place) {
    constexpr const char* kKeys[] = {"camera.fx", "camera.fy", "camera.cx", "camera.cy"};
    for (std::size_t i = 0; i < 4; ++i) SetNumber(kKeys[i], fx_fy_cx_cy[i], place);
  }

  /// Sets k1 k2 p1 p2 [k3], or k1 to k4 if `equidistant` is true. Further coefficients must be 0.
  void SetDistortion(const Node& node, bool equidistant) {
    constexpr const char* kRadtan[] = {"camera.k1", "camera.k2", "camera.p1", "camera.p2",
                                       "camera.k3"};
    constexpr const char* kEquidistant[] = {"camera.k1", "camera.k2", "camera.k3", "camera.k4"};
    std::vector<double> values = node.Numbers();
    const std::size_t max_count = equidistant ? 4 : 5;
    for (std::size_t i = max_count; i < values.size(); ++i) {
      if (values[i] != 0.0) {
        node.Fail("a coefficient after the first " + std::to_string(max_count) + " is not 0",
                  equidistant ? "only k1, k2, k3, k4" : "only k1, k2, p1, p2, k3");
      }
    }
    values.resize(max_count, 0.0);
    if (std::ranges::all_of(values, [](double value) { return value == 0.0; }) && !equidistant) {
      return Set("camera.model", "pinhole", node.place());
    }
    Set("camera.model", equidistant ? "equidistant" : "radtan", node.place());
    for (std::size_t i = 0; i < max_count; ++i) {
      SetNumber(equidistant ? kEquidistant[i] : kRadtan[i], values[i], node.place());
    }
  }

  void SetNumber(const std::string& key, double value, const Place& place) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", value);
    Set(key, text, place);
  }

  void ReadIntrinsics(const Node& root) {
    const auto intrinsics = root.Find("intrinsics_px");
    if (!intrinsics)
      root.Fail("the file contains no calibration of a camera",
                "'camera', 'intrinsics_px', or a file of OpenCV, ROS, Kalibr or EuRoC");
    for (const char* key : {"fx", "fy", "cx", "cy"}) {
      Copy(intrinsics->At(key), std::string("camera.") + key);
    }
    Set("camera.model", "pinhole", intrinsics->place());
    const Node image = root.At("image");
    for (const char* key : {"width", "height"}) Copy(image.At(key), std::string("camera.") + key);
    if (const auto baseline = root.Find("baseline_m")) Copy(*baseline, "camera.baseline_m");
    if (const auto mount = root.Find("vehicle_from_cam")) {
      Copy(mount->At("position_m"), "vehicle_from_cam.position");
      const Node quaternion = mount->At("quaternion");
      for (const char* key : {"w", "x", "y", "z"}) {
        Copy(quaternion.At(key), std::string("vehicle_from_cam.orientation.") + key);
      }
      quaternion.RejectUnread();
    }
  }

  void Copy(const Node& value, const std::string& key) { Set(key, value.ToYaml(), value.place()); }
  void Set(const std::string& key, const std::string& yaml, const Place& place) {
    output_.Set("calibration." + key, yaml, ToString(place));
  }

  Config input_, output_;
};

}  // namespace

Config ReadCalibrationFile(const std::filesystem::path& file) {
  try {
    return CalibrationFile(file).calibration();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kBadConfig) throw;
    throw Error(ExitCode::kBadData,
                std::string(error.what()) + "; 'source.calibration: ignore' skips the calibration");
  }
}

}  // namespace alidade
