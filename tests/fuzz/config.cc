// SPDX-License-Identifier: Apache-2.0
//
// The input is a config, a `key=value` as for --set, and overrides. ToYaml of the config must read
// back as the same tree.
#include "alidade/config/config.h"

#include "alidade/config/read_covariance.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

void ExpectSame(const Node& a, const Node& b) {
  Require(a.kind() == b.kind(), "the kind of a node differs");
  Require(a.path() == b.path(), "the path of a node differs");
  if (a.kind() == Node::Kind::kScalar) {
    Require(a.Text() == b.Text(), "the text of a node differs");
    double x = 0.0, y = 0.0;
    const bool number = Accepts([&] { x = a.Number(); });
    Require(number == Accepts([&] { y = b.Number(); }) && x == y, "the number of a node differs");
    Require(Accepts([&] { static_cast<void>(a.Flag()); }) ==
                Accepts([&] { static_cast<void>(b.Flag()); }),
            "another flag");
  }
  if (a.kind() == Node::Kind::kMap) {
    const auto first = a.Entries(), second = b.Entries();
    Require(first.size() == second.size(), "the number of keys differs");
    for (std::size_t i = 0; i < first.size(); ++i) {
      Require(first[i].first == second[i].first, "a key differs");
      ExpectSame(first[i].second, second[i].second);
    }
  }
  if (a.kind() != Node::Kind::kList) return;
  const auto first = a.Items(), second = b.Items();
  Require(first.size() == second.size(), "the number of items differs");
  for (std::size_t i = 0; i < first.size(); ++i) ExpectSame(first[i], second[i]);
  static_cast<void>(Accepts([&] { static_cast<void>(a.Numbers()); }));
  const int size = static_cast<int>(first.size());
  static_cast<void>(Accepts([&] { static_cast<void>(internal::ReadCovariance(a, size)); }));
}

void ExpectReadAgain(const Config& config) {
  // Size limit of the files that are read, in bytes. ToYaml expands aliases, so its text may be
  // larger.
  constexpr std::size_t kMost = 1 << 20;
  const std::string yaml = config.ToYaml();
  if (yaml.size() > kMost) return;
  const Config again = Config::FromText(yaml, "again");
  ExpectSame(config.root(), again.root());
  Require(again.ToYaml() == yaml, "reading ToYaml changes it");
}

void Read(const std::vector<std::string>& parts) {
  Config config = Config::FromText(parts[0], "config");
  Require(Accepts([&] { ExpectReadAgain(config); }), "the reader refuses ToYaml");
  const std::string& set = parts[1];
  const std::size_t equals = std::min(set.find('='), set.size());
  Config changed = config.Copy();
  if (Accepts([&] {
        changed.Set(set.substr(0, equals), set.substr(std::min(equals + 1, set.size())), "--set");
      })) {
    Require(Accepts([&] { ExpectReadAgain(changed); }), "the reader refuses ToYaml after Set");
  }
  static_cast<void>(Accepts([&] {
    const Config overrides = Config::FromText(parts[2], "overrides");
    const Config merged = config.Merged(overrides.root());
    Require(Accepts([&] { static_cast<void>(Config::FromText(merged.ToYaml(), "merged")); }),
            "the reader refuses ToYaml of merged configs");
  }));
  static_cast<void>(Accepts([&] { config.root().RejectUnread(); }));
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static_cast<void>(Accepts([&] { Read(Parts(TextOf(data, size), 3)); }));
  return 0;
}
