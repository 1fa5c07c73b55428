// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/bundle/cursor.h"
#include "alidade/bundle/formats.h"

namespace alidade::internal {
namespace {

/// Camera model of COLMAP. Its parameters are the first elements of the intrinsics of `lens`. The
/// principal point is constant, as in the bundle adjuster of COLMAP.
struct ColmapModel {
  const char* name;
  const char* lens;           ///< key `lens` of the sensor
  std::size_t focal_lengths;  ///< number of the first parameters that are focal lengths
  std::size_t parameters;     ///< number of parameters
  std::vector<std::string> fixed;
};
const std::array<ColmapModel, 5> kModels = {{
    {"SIMPLE_PINHOLE", "radtan", 1, 3, {"cx", "cy", "k1", "k2", "k3", "p1", "p2"}},
    {"PINHOLE", "opencv", 2, 4, {"cx", "cy", "k1", "k2", "p1", "p2"}},
    {"SIMPLE_RADIAL", "radtan", 1, 4, {"cx", "cy", "k2", "k3", "p1", "p2"}},
    {"RADIAL", "radtan", 1, 5, {"cx", "cy", "k3", "p1", "p2"}},
    {"OPENCV", "opencv", 2, 8, {"cx", "cy"}},
}};
constexpr std::size_t kIntrinsics = 8;  ///< of a lens `radtan` or `opencv`

constexpr std::int64_t kMaxId = std::numeric_limits<std::int64_t>::max();
using Indices = std::map<std::int64_t, int>;  ///< index of each id

/// Reads an id that no earlier row has.
std::int64_t NewId(BundleCursor& cursor, const char* quantity, Indices& indices) {
  const std::int64_t id = cursor.Integer(quantity, 0, kMaxId);
  if (!indices.emplace(id, static_cast<int>(indices.size())).second)
    cursor.Fail("this id occurs a second time", std::string(quantity) + " that no other row has");
  return id;
}

/// Reads the id of an existing row. Returns its index.
int IndexOf(BundleCursor& cursor, const char* quantity, const Indices& indices) {
  const auto found = indices.find(cursor.Integer(quantity, 0, kMaxId));
  if (found == indices.end()) cursor.Fail("this id does not exist", quantity);
  return found->second;
}

/// Reads the model of a camera, which must be `previous` unless `previous` is null.
const ColmapModel* ReadModel(BundleCursor& cursor, const ColmapModel* previous) {
  const std::string name(cursor.Word("the model of a camera"));
  const auto found = std::ranges::find(kModels, name, &ColmapModel::name);
  if (found == kModels.end()) {
    std::vector<std::string> names;
    for (const ColmapModel& model : kModels) names.emplace_back(model.name);
    cursor.Fail("the camera model " + cell::PrintableStart(name) + " is not supported",
                Join(names, ", "));
  }
  if (previous != nullptr && &*found != previous) {
    cursor.Fail("the camera models " + std::string(previous->name) + " and " + name + " are mixed",
                "one model for all cameras");
  }
  return &*found;
}

Indices ReadCameras(BundleCursor cursor, BundleFile& file) {
  Indices lenses;
  const ColmapModel* model = nullptr;
  while (cursor.NextRow()) {
    const std::int64_t id = NewId(cursor, "the id of a camera", lenses);
    model = ReadModel(cursor, model);
    constexpr std::int64_t kMaxSide = std::numeric_limits<std::int32_t>::max();
    const std::int64_t width = cursor.Integer("the width of an image", 1, kMaxSide);
    const std::int64_t height = cursor.Integer("the height of an image", 1, kMaxSide);
    file.lenses.push_back({id, width, height});
    std::vector<double>& lens = file.problem.intrinsics.emplace_back(kIntrinsics, 0.0);
    for (std::size_t i = 0; i < model->parameters; ++i) {
      lens[i] = cursor.Number("a parameter of a camera");
      if (i < model->focal_lengths && !(lens[i] > 0.0))
        cursor.Fail("the focal length is not positive", "a positive number in px");
    }
    if (!cursor.IsAtLineEnd()) {
      cursor.Word("the end of the line");
      cursor.Fail("the line contains additional numbers",
                  std::to_string(model->parameters) + " parameters of " + model->name);
    }
  }
  if (model == nullptr)
    cursor.Fail("the file contains no camera", "CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS");
  file.problem.sensor =
      std::string("{model: self_calibrating_feature, lens: ") + model->lens + ", sigma_px: 1}";
  file.problem.fixed = model->fixed;
  file.lens_model = model->name;
  file.lens_parameters = model->parameters;
  return lenses;
}

Indices ReadPoints(BundleCursor cursor, BundleFile& file) {
  Indices points;
  while (cursor.NextRow()) {
    file.point_ids.push_back(NewId(cursor, "the id of a point", points));
    cursor.Numbers("a point", 3, file.problem.points.emplace_back().data());
    std::string& colour = file.colours.emplace_back();
    for (int i = 0; i < 3; ++i) colour += (i > 0 ? " " : "") + std::string(cursor.Word("a colour"));
    cursor.SkipLine();  // the error and the track, which the images contain too
  }
  return points;
}

/// Reads the first line of an image, `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`.
void ReadImage(BundleCursor& cursor, const Indices& lenses, Indices& images, BundleFile& file) {
  file.camera_ids.push_back(NewId(cursor, "the id of an image", images));
  std::vector<double> pose(7);
  cursor.Numbers("the quaternion of an image", 4, pose.data());
  const double length = std::hypot(std::hypot(pose[0], pose[1]), std::hypot(pose[2], pose[3]));
  if (!(length > 1e-3)) cursor.Fail("the quaternion is zero", "qw qx qy qz with the length 1");
  cursor.Numbers("the translation of an image", 3, pose.data() + 4);
  double q[4];
  for (std::size_t i = 0; i < 4; ++i) q[i] = pose[i] / length;
  BundleCamera& camera =
      file.problem.cameras.emplace_back(CameraFromTransform(q, pose.data() + 4, false));
  camera.intrinsics = IndexOf(cursor, "the id of a camera in cameras.txt", lenses);
  file.poses.push_back({camera, pose});
  file.image_names.emplace_back(cursor.RemainderOfLine());
}

/// Reads the second line of an image, `X Y POINT3D_ID` for each feature.
void ReadFeatures(BundleCursor& cursor, const Indices& points, BundleFile& file) {
  auto& features = file.features.emplace_back();
  const int camera = static_cast<int>(file.problem.cameras.size()) - 1;
  while (!cursor.IsAtLineEnd()) {
    BundleFile::Feature feature{{}, -1};
    cursor.Numbers("a feature", 2, feature.z.data());
    const std::int64_t id = cursor.Integer("the id of a point, or -1", -1, kMaxId);
    if (id >= 0) {
      const auto point = points.find(id);
      if (point == points.end())
        cursor.Fail("this id does not exist", "the id of a point in points3D.txt, or -1");
      feature.point = point->second;
      file.problem.observations.push_back(
          {camera, feature.point, {feature.z[0], feature.z[1]}, true});
    }
    features.push_back(feature);
  }
}

}  // namespace

BundleFile ReadColmap(const ColmapTexts& texts, const std::filesystem::path& folder) {
  BundleFile file;
  file.format = BundleFormat::kColmap;
  const auto name = [&](const char* part) { return (folder / part).string(); };
  const Indices lenses = ReadCameras({texts.cameras, name("cameras.txt"), true}, file);
  const Indices points = ReadPoints({texts.points, name("points3D.txt"), true}, file);
  BundleCursor cursor(texts.images, name("images.txt"), true);
  Indices images;
  while (cursor.NextRow()) {
    ReadImage(cursor, lenses, images, file);
    cursor.NextLine();
    ReadFeatures(cursor, points, file);
  }
  return file;
}

ColmapTexts ColmapTextsOf(const BundleFile& file) {
  const BundleProblem& problem = file.problem;
  ColmapTexts texts{"# CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS\n",
                    "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# X Y POINT3D_ID ...\n",
                    "# POINT3D_ID X Y Z R G B ERROR IMAGE_ID POINT2D_INDEX ...\n"};
  for (std::size_t i = 0; i < file.lenses.size(); ++i) {
    const BundleFile::Lens& lens = file.lenses[i];
    texts.cameras += std::to_string(lens.id) + ' ' + file.lens_model + ' ' +
                     std::to_string(lens.width) + ' ' + std::to_string(lens.height);
    for (std::size_t k = 0; k < file.lens_parameters; ++k)
      AppendNumber(texts.cameras += ' ', problem.intrinsics[i][k]);
    texts.cameras += '\n';
  }
  std::vector<std::string> tracks(problem.points.size());
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    double moved[7];
    const double* pose = UnmovedNumbers(file, i);
    if (pose == nullptr) {
      TransformFromCamera(problem.cameras[i], false, moved, moved + 4);
      pose = moved;
    }
    texts.images += std::to_string(file.camera_ids[i]);
    for (std::size_t k = 0; k < 7; ++k) AppendNumber(texts.images += ' ', pose[k]);
    const auto lens = static_cast<std::size_t>(problem.cameras[i].intrinsics);
    texts.images += ' ' + std::to_string(file.lenses[lens].id) + ' ' + file.image_names[i] + '\n';
    const auto& features = file.features[i];
    for (std::size_t k = 0; k < features.size(); ++k) {
      for (const double x : features[k].z) AppendNumber(texts.images, x), texts.images += ' ';
      const int point = features[k].point;
      const std::int64_t id = point < 0 ? -1 : file.point_ids[static_cast<std::size_t>(point)];
      texts.images += std::to_string(id) + (k + 1 < features.size() ? " " : "");
      if (point >= 0) {
        tracks[static_cast<std::size_t>(point)] +=
            ' ' + std::to_string(file.camera_ids[i]) + ' ' + std::to_string(k);
      }
    }
    texts.images += '\n';
  }
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    texts.points += std::to_string(file.point_ids[i]);
    for (const double x : problem.points[i]) AppendNumber(texts.points += ' ', x);
    texts.points += ' ' + file.colours[i] + " -1" + tracks[i] + '\n';  // -1: unknown error
  }
  return texts;
}

}  // namespace alidade::internal
