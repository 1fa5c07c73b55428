// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/calibration_file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/io/read_file.h"

namespace alidade {
namespace {

/// Coefficients of a lens. kBrown has the order of OpenCV: k1, k2, p1, p2, k3, k4, k5, k6.
enum class Lens { kBrown, kEquidistant };

/// Returns the offset at which the first YAML document ends. `ros2 topic echo` ends every message
/// with a line `---`. Directives, which begin with `%`, are not content.
std::size_t EndOfFirstDocument(std::string_view text) {
  bool has_content = false;
  for (std::size_t offset = 0; offset < text.size();) {
    const std::string_view line = text.substr(offset, text.find('\n', offset) - offset);
    const bool is_marker = line.starts_with("---");
    if (is_marker && has_content) return offset;
    const std::size_t first = line.find_first_not_of(" \t\r");
    const bool is_blank = first == line.npos || line[first] == '#' || line.starts_with('%');
    has_content = has_content || !(is_marker || is_blank);
    offset += line.size() + 1;
  }
  return text.size();
}

/// Returns the first YAML document of the file. Replaces the directive and the tags of OpenCV,
/// which are not YAML, by blanks.
std::string PlainYaml(const std::filesystem::path& file) {
  std::string text = internal::ReadFile(file, [&](ExitCode code, int error) {
    throw Error(code, ErrorLine({file.string()}, {}, std::strerror(error)));
  });
  for (const std::string_view directive : {"%YAML:1.0", "!!opencv-matrix"}) {
    for (std::size_t offset = 0; (offset = text.find(directive, offset)) != text.npos;) {
      text.replace(offset, directive.size(), directive.size(), ' ');
    }
  }
  text.resize(EndOfFirstDocument(text));
  return text;
}

Config ReadYaml(const std::filesystem::path& file) {
  const std::string text = PlainYaml(file);
  const bool includes = text.starts_with("include:") || text.find("\ninclude:") != text.npos;
  return includes ? Config::FromFile(file) : Config::FromText(text, file.string());
}

/// Returns the numbers of a list, which may be empty.
std::vector<double> Coefficients(const Node& list) {
  const bool is_empty = list.kind() == Node::Kind::kList && list.Items().empty();
  return is_empty ? std::vector<double>{} : list.Numbers();
}

class CalibrationFile {
 public:
  CalibrationFile(const std::filesystem::path& file, const CalibrationOptions& options)
      : input_(ReadYaml(file)),
        output_(Config::FromText("calibration: {}", file.string())),
        entry_(options.entry) {
    const Node root = input_.root();
    for (const char* key : {"sigma_px", "covariance"}) {
      const auto value = root.Find(key);
      if (value && options.noise) Copy(*value, key);
    }
    Read(root);
  }

  Config calibration() && { return std::move(output_); }

 private:
  void Read(const Node& root) {
    const auto has = [&](const std::string& key) { return root.HasUnread(key); };
    if (const std::string kalibr = entry_.empty() ? "cam0" : entry_; has(kalibr))
      return ReadKalibr(root.At(kalibr), "distortion_coeffs");
    for (const std::string& name :
         entry_.empty() ? std::vector<std::string>{"Camera", "Camera1"} : std::vector{entry_}) {
      if (has(name + ".fx")) return ReadOrbSlam(root, name + '.');
    }
    if (!entry_.empty()) {
      root.Fail("the file contains no camera '" + entry_ + "'",
                "an entry of a Kalibr or ORB-SLAM file, such as cam1 or Camera2");
    }
    if (has("camera_matrix")) return ReadOpenCv(root);
    for (const char* k : {"K", "k"}) {
      if (has(k)) return ReadRosMessage(root, k);
    }
    if (has("model_type")) return ReadCamodocal(root);
    if (has("intrinsics")) return ReadKalibr(root, "distortion_coefficients");
    ReadAlidade(root);
  }

  void ReadAlidade(const Node& root) {
    if (const auto camera = root.Find("camera")) {
      for (const auto& [key, value] : camera->Entries()) Copy(value, "camera." + key);
      if (!camera->Find("model")) Set("camera.model", "pinhole", camera->place());
    } else {
      ReadIntrinsics(root);
    }
    root.RejectUnread();
  }

  void ReadIntrinsics(const Node& root) {
    const auto intrinsics = root.Find("intrinsics_px");
    if (!intrinsics) {
      root.Fail("the file contains no calibration of a camera",
                "'camera', 'intrinsics_px', or a file of Kalibr, OpenCV, ROS (camera_info), EuRoC, "
                "ORB-SLAM or VINS (camodocal)");
    }
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

  void ReadKalibr(const Node& camera, const char* distortion) {
    const Node model = camera.At("camera_model");
    if (model.Text() != "pinhole") {
      model.Fail("camera model '" + model.Text() + "' is not supported", "pinhole");
    }
    const Node intrinsics = camera.At("intrinsics"), size = camera.At("resolution");
    const std::vector<double> k = intrinsics.Numbers(4);
    SetIntrinsics({k[0], k[1], k[2], k[3]}, intrinsics.place());
    const std::vector<Node> sides = size.Items();
    if (sides.size() != 2) size.Fail("the list must have two numbers", "[width, height], px");
    Copy(sides[0], "camera.width");
    Copy(sides[1], "camera.height");
    const Node kind = camera.At("distortion_model");
    const std::string& name = kind.Text();
    if (name == "none") return Set("camera.model", "pinhole", kind.place());
    const bool equidistant = name == "equidistant" || name == "equi";
    if (!equidistant && name != "radtan" && name != "radial-tangential") {
      kind.Fail("distortion model '" + name + "' is not supported",
                "radtan, radial-tangential, equidistant or none");
    }
    SetDistortion(camera.At(distortion), equidistant ? Lens::kEquidistant : Lens::kBrown, 5);
  }

  void ReadOpenCv(const Node& root) {
    SetMatrix(root.At("camera_matrix").At("data"));
    Copy(root.At("image_width"), "camera.width");
    Copy(root.At("image_height"), "camera.height");
    SetRosDistortion(root, root.At("distortion_coefficients").At("data"));
  }

  void ReadRosMessage(const Node& root, const char* k) {
    SetMatrix(root.At(k));
    Copy(root.At("width"), "camera.width");
    Copy(root.At("height"), "camera.height");
    for (const char* key : {"binning_x", "binning_y"}) {
      const auto binning = root.Find(key);
      if (binning && binning->Number() > 1.0)
        binning->Fail("images with binning are not supported", "0 or 1");
    }
    SetRosDistortion(root, root.At(*k == 'K' ? "D" : "d"));
  }

  void ReadCamodocal(const Node& root) {
    const Node type = root.At("model_type"), projection = root.At("projection_parameters");
    const std::string& name = type.Text();
    const bool equidistant = name == "KANNALA_BRANDT", full = name == "PINHOLE_FULL";
    if (!equidistant && !full && name != "PINHOLE") {
      type.Fail("camera model '" + name + "' is not supported",
                "PINHOLE, PINHOLE_FULL or KANNALA_BRANDT");
    }
    const auto numbers = [](const Node& map, const std::vector<const char*>& keys) {
      std::vector<double> values;
      for (const char* key : keys) values.push_back(map.At(key).Number());
      return values;
    };
    const auto k = equidistant ? numbers(projection, {"mu", "mv", "u0", "v0"})
                               : numbers(projection, {"fx", "fy", "cx", "cy"});
    SetIntrinsics({k[0], k[1], k[2], k[3]}, projection.place());
    Copy(root.At("image_width"), "camera.width");
    Copy(root.At("image_height"), "camera.height");
    if (equidistant) {
      return SetDistortion(numbers(projection, {"k2", "k3", "k4", "k5"}), projection,
                           Lens::kEquidistant, 4);
    }
    const Node lens = root.At("distortion_parameters");
    SetDistortion(full ? numbers(lens, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
                       : numbers(lens, {"k1", "k2", "p1", "p2"}),
                  lens, Lens::kBrown, 8);
  }

  /// Reads a file whose keys begin with `prefix`, such as `Camera1.`.
  void ReadOrbSlam(const Node& root, const std::string& prefix) {
    const auto number = [&](const std::string& key) { return root.At(prefix + key).Number(); };
    SetIntrinsics({number("fx"), number("fy"), number("cx"), number("cy")},
                  root.At(prefix + "fx").place());
    for (const std::string key : {"width", "height"}) {
      if (const auto size = root.Find("Camera." + key)) Copy(*size, "camera." + key);
    }
    const auto type = root.Find("Camera.type");
    const std::string name = type ? type->Text() : "PinHole";
    if (name == "Rectified") return Set("camera.model", "pinhole", type->place());
    const bool equidistant = name == "KannalaBrandt8";
    if (!equidistant && name != "PinHole" && name != "Pinhole") {
      type->Fail("camera model '" + name + "' is not supported",
                 "PinHole, KannalaBrandt8 or Rectified");
    }
    std::vector<double> values;
    using Keys = std::vector<const char*>;
    for (const char* key :
         equidistant ? Keys{"k1", "k2", "k3", "k4"} : Keys{"k1", "k2", "p1", "p2", "k3"}) {
      const auto value = root.Find(prefix + key);
      values.push_back(value ? value->Number() : 0.0);
    }
    SetDistortion(std::move(values), root.At(prefix + "fx"),
                  equidistant ? Lens::kEquidistant : Lens::kBrown, 5);
  }

  /// Sets the intrinsics from a list of the 9 numbers of a camera matrix.
  void SetMatrix(const Node& matrix) {
    const std::vector<double> k = matrix.Numbers(9);
    if (k[1] != 0.0) matrix.Fail("a camera with skew is not supported", "0 as the second number");
    if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
      matrix.Fail("this is not a camera matrix", "[fx, 0, cx, 0, fy, cy, 0, 0, 1]");
    }
    SetIntrinsics({k[0], k[4], k[2], k[5]}, matrix.place());
  }

  void SetIntrinsics(const std::array<double, 4>& fx_fy_cx_cy, const Place& place) {
    constexpr const char* kKeys[] = {"camera.fx", "camera.fy", "camera.cx", "camera.cy"};
    for (std::size_t i = 0; i < 4; ++i) SetNumber(kKeys[i], fx_fy_cx_cy[i], place);
  }

  /// Sets the distortion of a file of OpenCV or ROS. OpenCV names no model, except that
  /// `fisheye_model: 1` denotes equidistant.
  void SetRosDistortion(const Node& root, const Node& coefficients) {
    const auto model = root.Find("distortion_model"), fisheye = root.Find("fisheye_model");
    const std::string name = model ? model->Text() : "";
    const bool equidistant = name == "equidistant" || (fisheye && fisheye->Number() != 0.0);
    if (!equidistant && !name.empty() && name != "plumb_bob" && name != "rational_polynomial") {
      model->Fail("distortion model '" + name + "' is not supported",
                  "plumb_bob, rational_polynomial or equidistant");
    }
    SetDistortion(coefficients, equidistant ? Lens::kEquidistant : Lens::kBrown,
                  name == "plumb_bob" ? 5 : 8);
  }

  void SetDistortion(const Node& list, Lens lens, std::size_t max_count) {
    SetDistortion(Coefficients(list), list, lens, max_count);
  }
  /// Sets the lens with these coefficients. The coefficients after the first `max_count` (kBrown)
  /// or 4 (kEquidistant) must be 0. Missing coefficients are 0.
  void SetDistortion(std::vector<double> values, const Node& node, Lens lens,
                     std::size_t max_count) {
    constexpr const char* kBrown[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
    constexpr const char* kEquidistant[] = {"k1", "k2", "k3", "k4"};
    const bool equidistant = lens == Lens::kEquidistant;
    if (equidistant && values.empty()) node.Fail("the list is empty", "k1, k2, k3, k4");
    if (equidistant) max_count = 4;
    const auto used = [](double value) { return value != 0.0; };
    for (std::size_t i = max_count; i < values.size(); ++i) {
      if (!used(values[i])) continue;
      node.Fail("a coefficient after the first " + std::to_string(max_count) + " is not 0",
                equidistant      ? "only k1, k2, k3, k4"
                : max_count == 5 ? "only k1, k2, p1, p2, k3"
                                 : "only k1, k2, p1, p2, k3, k4, k5, k6");
    }
    values.resize(8, 0.0);
    const bool rational = !equidistant && std::any_of(values.begin() + 5, values.end(), used);
    if (!equidistant && std::ranges::none_of(values, used)) {
      return Set("camera.model", "pinhole", node.place());
    }
    Set("camera.model",
        equidistant ? "equidistant"
        : rational  ? "rational_polynomial"
                    : "radtan",
        node.place());
    const std::size_t count = equidistant ? 4 : rational ? 8 : 5;
    for (std::size_t i = 0; i < count; ++i) {
      SetNumber(std::string("camera.") + (equidistant ? kEquidistant[i] : kBrown[i]), values[i],
                node.place());
    }
  }

  void SetNumber(const std::string& key, double value, const Place& place) {
    Set(key, internal::NumberText(value), place);
  }
  void Copy(const Node& value, const std::string& key) { Set(key, value.ToYaml(), value.place()); }
  void Set(const std::string& key, const std::string& yaml, const Place& place) {
    output_.Set("calibration." + key, yaml, ToString(place));
  }

  Config input_, output_;
  std::string entry_;
};

}  // namespace

Config ReadCalibrationFile(const std::filesystem::path& file, const CalibrationOptions& options) {
  try {
    return CalibrationFile(file, options).calibration();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kBadConfig) throw;
    throw Error(ExitCode::kBadData, error.what());
  }
}

}  // namespace alidade
