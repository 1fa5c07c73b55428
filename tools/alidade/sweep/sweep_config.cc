// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/sweep_config.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "alidade/config/data_paths.h"

namespace alidade::internal {

void CheckReadableAgain(const Config& config, const char* reader) {
  for (const std::string& path : DataPaths(config.root().tree())) {
    std::error_code error;
    const auto status = std::filesystem::status(config.folder() / path, error);
    const bool is_reopenable =
        !std::filesystem::exists(status) || is_regular_file(status) || is_directory(status);
    if (path != "-" && is_reopenable) continue;
    const Config copy = config.Copy();
    const Node source = copy.root().At("source");
    const std::optional<Node> files = source.Find("files");
    (files ? *files : source.At("path"))
        .Fail("'" + path + "' can be read only once, but " + reader, "a regular file");
  }
}

namespace {

Config WithSeed(const Config& config, std::uint64_t seed) {
  Config copy = config.Copy();
  copy.Set("source.seed", std::to_string(seed), "--first-seed");
  return copy;
}

bool AreEqual(const SourceFrame& a, const SourceFrame& b) {
  const auto are_equal = [](const Measurement& m, const Measurement& n) {
    return m.timestamp == n.timestamp && m.stream == n.stream && m.landmark == n.landmark &&
           m.values == n.values && m.covariance == n.covariance;
  };
  return a.timestamp == b.timestamp && a.truth == b.truth &&
         std::ranges::equal(a.measurements, b.measurements, are_equal);
}

}  // namespace

bool HaveEqualData(Source& a, Source& b) {
  SourceFrame a_frame, b_frame;
  for (;;) {
    const bool has_frame = a.Next(a_frame);
    if (has_frame != b.Next(b_frame)) return false;
    if (!has_frame) return true;
    if (!AreEqual(a_frame, b_frame)) return false;
  }
}

bool UsesSeed(const Config& config, const PluginHost& host, std::uint64_t seed) {
  CheckReadableAgain(config);
  const Config first = WithSeed(config, seed), second = WithSeed(config, seed + 1);
  const Experiment first_experiment = BuildExperiment(first, host);
  const Experiment second_experiment = BuildExperiment(second, host);
  try {
    return !HaveEqualData(*first_experiment.source, *second_experiment.source);
  } catch (const Error&) {
    return true;  // the runs will report the error
  }
}

SeedRange SeedsOf(const Shard& shard, std::uint64_t first_seed, std::int64_t runs) {
  ALIDADE_EXPECTS(shard.index >= 1 && shard.index <= shard.count);
  const auto end = [&](int i) {
    return runs / shard.count * i + runs % shard.count * i / shard.count;
  };
  const std::int64_t begin = end(shard.index - 1);
  return {first_seed + static_cast<std::uint64_t>(begin), end(shard.index) - begin};
}

void FailUnseeded(const Config& config) {
  const Config copy = config.Copy();
  const Node type = copy.root().At("source").At("type");
  type.Fail(
      "source '" + type.Text() + "' produces the same data for every seed: all runs would be equal",
      "one run, or a source whose data depend on the seed");
}

}  // namespace alidade::internal
