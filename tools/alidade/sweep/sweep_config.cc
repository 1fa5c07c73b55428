// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/sweep_config.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

namespace alidade::internal {

void CheckReadableAgain(const Config& config, const char* reader) {
  const Config copy = config.Copy();
  const auto source = copy.root().Find("source");
  const auto path = source && source->is_map() ? source->Find("path") : std::nullopt;
  if (!path || path->kind() != Node::Kind::kScalar) return;
  std::error_code error;
  const auto status = std::filesystem::status(config.folder() / path->Text(), error);
  const bool file =
      !std::filesystem::exists(status) || is_regular_file(status) || is_directory(status);
  if (path->Text() != "-" && file) return;
  path->Fail("'" + path->Text() + "' can be read once, but " + reader, "a regular file");
}

namespace {

Config WithSeed(const Config& config, std::uint64_t seed) {
  Config copy = config.Copy();
  copy.Set("source.seed", std::to_string(seed), "--first-seed");
  return copy;
}

bool AreEqual(const SourceFrame& a, const SourceFrame& b) {
  const auto same = [](const Measurement& m, const Measurement& n) {
    return m.timestamp == n.timestamp && m.stream == n.stream && m.landmark == n.landmark &&
           m.values == n.values && m.covariance == n.covariance;
  };
  return a.timestamp == b.timestamp && a.truth == b.truth &&
         std::ranges::equal(a.measurements, b.measurements, same);
}

}  // namespace

bool UsesSeed(const Config& config, const PluginHost& host, std::uint64_t seed) {
  CheckReadableAgain(config);
  const Config first = WithSeed(config, seed), second = WithSeed(config, seed + 1);
  const Experiment one = BuildExperiment(first, host), another = BuildExperiment(second, host);
  SourceFrame a, b;
  try {
    for (;;) {
      const bool more = one.source->Next(a);
      if (more != another.source->Next(b)) return true;
      if (!more) return false;
      if (!AreEqual(a, b)) return true;
    }
  } catch (const Error&) {
    return true;  // the runs report it
  }
}

SeedRange SeedsOf(const Shard& shard, std::uint64_t first_seed, std::int64_t runs) {
  ALIDADE_EXPECTS(shard.index >= 1 && shard.index <= shard.of);
  const auto end = [&](int i) { return runs / shard.of * i + runs % shard.of * i / shard.of; };
  const std::int64_t before = end(shard.index - 1);
  return {first_seed + static_cast<std::uint64_t>(before), end(shard.index) - before};
}

void FailUnseeded(const Config& config) {
  const Config copy = config.Copy();
  const Node type = copy.root().At("source").At("type");
  type.Fail(
      "source '" + type.Text() + "' gives the same data for every seed: all runs would be equal",
      "one run, or a source that draws its data from the seed");
}

}  // namespace alidade::internal
