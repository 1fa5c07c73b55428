// SPDX-License-Identifier: Apache-2.0
#include "alidade/system/landmarks.h"

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
  if (const auto n = node.Find("from_map")) prior.from_map = static_cast<int>(n->Integer(1, kMost));
  node.RejectUnread();
  return prior;
}

void ReadForget(const Node& node, LandmarkOptions& options) {
  if (const auto frames = node.Find("unseen_frames")) {
    options.unseen_frames = static_cast<int>(frames->Integer(1, kMost));
  }
  const auto ratio = node.Find("success_ratio"), tries = node.Find("minimum_tries");
  if (ratio) options.success_ratio = ratio->Number(0.0, 1.0);
  if (tries && !ratio) tries->Fail("without a use", "success_ratio beside it");
  if (tries) options.minimum_tries = static_cast<int>(tries->Integer(1, kMost));
  node.RejectUnread();
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
  static_cast<void>(node.At("ransac", "association").Choice({"one_point"}));
  const auto read = [&node](const char* key, double& value) {
    if (const auto given = node.Find(key)) value = given->Number(0.0, 1.0, true, true);
  };
  read("support", ransac.support);
  read("confidence", ransac.confidence);
  read("rescue", ransac.rescue);
  node.RejectUnread();
  return ransac;
}

LandmarkOptions LandmarkOptions::FromNode(const Node& node) {
  LandmarkOptions options;
  node.Declare("form");
  if (const auto prior = node.Find("prior")) options.prior = ReadPrior(*prior);
  if (const auto keep = node.Find("keep")) options.keep = static_cast<int>(keep->Integer(1, kMost));
  if (const auto observations = node.Find("enter_after")) {
    options.enter_after = static_cast<int>(observations->Integer(1, kMost));
  }
  if (const auto forget = node.Find("forget")) ReadForget(*forget, options);
  if (const auto to_xyz = node.Find("to_xyz")) {
    options.to_xyz = to_xyz->At("linearity", "landmarks.to_xyz").Number(0.0, kInfinity, true);
    to_xyz->RejectUnread();
  }
  if (const auto negative = node.Find("negative_depth")) {
    options.negative_depth = static_cast<NegativeDepth>(negative->Choice({"keep", "delete"}));
  }
  if (const auto known = node.Find("known")) options.known = ReadKnown(*known);
  return options;
}

}  // namespace alidade
