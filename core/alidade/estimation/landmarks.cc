// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/landmarks.h"

#include <algorithm>
#include <limits>
#include <set>

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMost = 1'000'000;

LandmarkOptions::Prior ReadPrior(const Node& node) {
  LandmarkOptions::Prior prior;
  prior.inverse_distance = node.At("inverse_distance", "landmarks.prior").Number(0.0, kInfinity);
  prior.sigma = node.At("sigma", "landmarks.prior").Number(0.0, kInfinity, true);
  if (const auto n = node.Find("adapt_after"))
    prior.adapt_after = static_cast<int>(n->Integer(1, kMost));
  if (const auto n = node.Find("min_observations"))
    prior.min_observations = static_cast<int>(n->Integer(1, kMost));
  node.RejectUnread();
  return prior;
}

void ReadPrune(const Node& node, LandmarkOptions& options) {
  if (const auto frames = node.Find("max_missed_frames")) {
    options.max_missed_frames = static_cast<int>(frames->Integer(1, kMost));
  }
  const auto ratio = node.Find("min_match_ratio"), attempts = node.Find("min_attempts");
  if (ratio) options.min_match_ratio = ratio->Number(0.0, 1.0);
  if (attempts && !ratio) attempts->Fail("without a use", "min_match_ratio in addition");
  if (attempts) options.min_attempts = static_cast<int>(attempts->Integer(1, kMost));
  node.RejectUnread();
}

int ReadMost(const Node& node) {
  if (node.kind() == Node::Kind::kScalar && node.Text() == "unlimited") {
    return LandmarkOptions::kUnlimited;
  }
  try {
    return static_cast<int>(node.Integer(1, kMost));
  } catch (const Error& error) {
    throw Error(error.code(), std::string(error.what()) + ", or unlimited");
  }
}

std::vector<KnownLandmark> ReadKnown(const Node& list) {
  std::vector<KnownLandmark> known;
  std::set<std::int64_t> ids;
  for (const Node& node : list.Items()) {
    KnownLandmark& one = known.emplace_back();
    const Node id = node.At("id", "a known landmark");
    one.id = id.Integer(0, std::numeric_limits<std::int64_t>::max());
    const std::vector<double> position = node.At("position", "a known landmark").Numbers(3);
    std::ranges::copy(position, one.position.begin());
    one.sigma = node.At("sigma", "a known landmark").Number(0.0, kInfinity);
    node.RejectUnread();
    if (!ids.insert(one.id).second) {
      id.Fail("landmark " + std::to_string(one.id) + " is listed twice", "each id once");
    }
  }
  return known;
}

}  // namespace

OnePointRansac OnePointRansac::FromNode(const Node& node) {
  OnePointRansac ransac;
  static_cast<void>(node.At("method", "outlier_rejection").Choice({"one_point_ransac"}));
  const auto read = [&node](const char* key, double& value) {
    if (const auto given = node.Find(key)) value = given->Number(0.0, 1.0, true, true);
  };
  read("inlier_probability", ransac.inlier_probability);
  read("confidence", ransac.confidence);
  read("rescue_probability", ransac.rescue_probability);
  node.RejectUnread();
  return ransac;
}

LandmarkOptions LandmarkOptions::FromNode(const Node& node) {
  LandmarkOptions options;
  node.Declare("representation");
  if (const auto prior = node.Find("prior")) options.prior = ReadPrior(*prior);
  if (const auto most = node.Find("max_per_frame")) options.max_per_frame = ReadMost(*most);
  if (const auto observations = node.Find("min_observations")) {
    options.min_observations = static_cast<int>(observations->Integer(1, kMost));
  }
  if (const auto prune = node.Find("prune")) ReadPrune(*prune, options);
  if (const auto convert = node.Find("convert_to_xyz")) {
    options.max_linearity_index =
        convert->At("max_linearity_index", "landmarks.convert_to_xyz").Number(0.0, kInfinity, true);
    convert->RejectUnread();
  }
  if (const auto negative = node.Find("negative_depth")) {
    options.negative_depth = static_cast<NegativeDepth>(negative->Choice({"keep", "delete"}));
  }
  if (const auto known = node.Find("known")) options.known = ReadKnown(*known);
  return options;
}

}  // namespace alidade
