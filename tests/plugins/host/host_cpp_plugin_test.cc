// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/create.h"
#include "alidade/plugin/load.h"
#include "host_fixture.h"

namespace alidade {
namespace {

TEST_F(HostTest, CreatesASourceOfACppPlugin) {
  const PluginHost host({Built("sources")});
  const Config config = Parse("source: {type: counter, last: 2, unit: sheep}");
  const auto source = CreateSource(host, config, 1);
  EXPECT_EQ(source->streams().at(0).name, "count");
  SourceFrame frame;
  EXPECT_TRUE(source->Next(frame));
  EXPECT_TRUE(source->Next(frame));
  EXPECT_FALSE(source->Next(frame));
  EXPECT_NO_THROW(config.root().At("source").RejectUnread());
}

TEST_F(HostTest, AFailingSourceNamesItselfAndItsPlugin) {
  const PluginHost host({Built("sources")});
  const Config config = Parse("source: {type: throwing_source}");
  const Config incomplete = Parse("source: {type: counter}");
  ExpectError(ExitCode::kPlugin,
              {"source 'throwing_source'", Built("sources").string(), "no such thing"},
              [&] { CreateSource(host, config, 1); });
  ExpectError(ExitCode::kBadConfig, {"source.last: missing; source 'counter' needs it ([1, 100]"},
              [&] { CreateSource(host, incomplete, 1); });
  const auto counter = std::find_if(host.entries().begin(), host.entries().end(),
                                    [](const PluginEntry& e) { return e.name == "counter"; });
  const std::vector<ParamInfo> schema = SourceSchema(*counter);
  EXPECT_EQ(Param(schema, "last").range, "[1, 100]");
  EXPECT_EQ(Param(schema, "unit").doc, "what is counted");
  EXPECT_THROW(ModelSchema(*counter), ContractViolation);
}

TEST_F(HostTest, AFailingEstimatorNamesItselfAndItsPlugin) {
  const PluginHost host({Built("estimators")});
  const Config config = Parse("{gain: 1}"), empty = Parse("{type: throwing_estimator}");
  for (const char* name : {"throwing_estimator", "no_estimator"}) {
    const char* why = name[0] == 't' ? "no such thing" : "it did not create an object";
    ExpectError(ExitCode::kPlugin,
                {std::string("estimator '") + name + "'", Built("estimators").string(), why},
                [&] { CreateEstimator(host, name, config.root()); });
  }
  ExpectError(ExitCode::kBadConfig, {"gain: missing; estimator 'throwing_estimator' needs it (> 0"},
              [&] { CreateEstimator(host, "throwing_estimator", empty.root()); });
  ExpectError(ExitCode::kPlugin, {"no plugin offers the estimator 'none'", "searched"},
              [&] { CreateEstimator(host, "none", config.root()); });
}

TEST_F(HostTest, APluginOnDemandOfferingAnotherKindIsRefused) {
  const std::filesystem::path file = Copy("sources", "alone/sources.so");
  const auto ask = [&](const char* kind) {
    return internal::FactoryOnDemand(kind, "alone", file.parent_path(), "none");
  };
  EXPECT_STREQ(static_cast<const SourceEntry*>(ask(kSourceKind))->name, "counter");
  ExpectError(ExitCode::kPlugin, {file.string(), "does not offer an estimator"},
              [&] { ask(kEstimatorKind); });
}

}  // namespace
}  // namespace alidade
