// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/live_run.h"

#include <functional>
#include <thread>

#include "support/http_client.h"
#include "support/recording.h"

namespace alidade {
namespace {

using testing::HttpClient;

/// Observer that calls `action` before frame `index` is processed.
class ActionAt : public RunObserver {
 public:
  ActionAt(int index, std::function<void()> action) : index_(index), action_(std::move(action)) {}
  void OnFrame(const SourceFrame& /*frame*/) override {
    if (next_++ == index_) action_();
  }

 private:
  int index_, next_ = 0;
  std::function<void()> action_;
};

RunResult RunWith(Experiment& experiment, std::vector<RunObserver*> observers) {
  RunOptions options;
  options.observers = std::move(observers);
  return Run(experiment, options);
}

/// Options of a recorder that writes each row at once.
Recorder::Options WithoutDelay(const std::filesystem::path& folder) {
  Recorder::Options options = testing::OptionsFor(folder);
  options.max_delay = std::chrono::milliseconds(0);
  return options;
}

std::uint16_t PortOf(const LiveRun& live) {
  const std::string address = live.address();
  const std::size_t colon = address.rfind(':');
  return static_cast<std::uint16_t>(std::stoul(address.substr(colon + 1)));
}

std::string FirstUpdate(HttpClient& client) {
  const std::string& text = client.ReceiveUntil("}\n\n");
  const std::size_t begin = text.find("data: ") + 6;
  return text.substr(begin, text.find("\n\n", begin) - begin);
}

/// Reads the data of a page. JSON is also YAML.
Config Parse(const std::string& json) { return Config::FromText(json, "update"); }

Node First(const Node& list) { return list.Items().front(); }

/// Number of rows of a column of the data of a page.
double RowsOf(const Config& data, const Node& ref) {
  const auto index = static_cast<std::size_t>(ref.Number());
  return data.root().At("columns").Items()[index].At("n").Number();
}

TEST(LiveRun, SendsTheRowsSoFarAndThenTheReport) {
  const testing::TemporaryFolder temporary;
  const auto folder = temporary / "run";
  LiveRun live(0, folder, testing::MakeConfig());
  Recorder recorder(WithoutDelay(folder), testing::MakeConfig());
  std::unique_ptr<HttpClient> client;
  std::string page, update;
  ActionAt look(30, [&] {
    page = testing::Response(PortOf(live), "GET", "/");
    client = std::make_unique<HttpClient>(PortOf(live));
    client->Request("GET", "/events");
    update = FirstUpdate(*client);
  });
  Experiment experiment = testing::MakeExperiment();
  recorder.Finish(RunWith(experiment, {&recorder, &live, &look}));
  live.Finish();

  EXPECT_NE(page.find("<title>A &lt;swinging> target - alidade</title>"), page.npos);
  const Config so_far = Parse(update);
  EXPECT_EQ(so_far.root().At("status").Text(), "running");
  EXPECT_EQ(so_far.root().At("live").At("dropped").Number(), 0);
  const Node ekf = First(so_far.root().At("run").At("estimators"));
  EXPECT_EQ(ekf.At("name").Text(), "ekf");
  EXPECT_EQ(RowsOf(so_far, ekf.At("t")), 30);
  EXPECT_EQ(RowsOf(so_far, First(First(ekf.At("blocks")).At("error"))), 30);
  EXPECT_EQ(RowsOf(so_far, First(ekf.At("nees")).At("v")), 30);
  // Every other frame contains the disparity.
  EXPECT_EQ(RowsOf(so_far, First(ekf.At("innovations")).At("t")), 15);
  EXPECT_EQ(ekf.At("counts").At("accepted:disparity").Number(), 15);
  EXPECT_FALSE(ekf.Find("verdict"));

  const std::string& text = client->ReceiveUntil("");
  const std::size_t end = text.find("event: end\ndata: ");
  ASSERT_NE(end, text.npos);
  const Config last = Parse(text.substr(end + 17));
  EXPECT_EQ(last.root().At("status").Text(), "ok");
  EXPECT_EQ(last.root().At("live").At("report").Text(), (folder / "report.html").string());
  EXPECT_EQ(RowsOf(last, last.root().At("run").At("t")), 60);
  EXPECT_TRUE(First(last.root().At("run").At("estimators")).Find("verdict"));
}

TEST(LiveRun, ShowsTheLastRowsOfALongRun) {
  const testing::TemporaryFolder temporary;
  const auto folder = temporary / "run";
  LiveRun live(0, folder, testing::MakeConfig());
  Recorder recorder(WithoutDelay(folder), testing::MakeConfig());
  std::string update;
  ActionAt look(2500, [&] {
    HttpClient client(PortOf(live));
    client.Request("GET", "/events");
    update = FirstUpdate(client);
  });
  Experiment experiment = testing::MakeExperiment(2501);
  recorder.Finish(RunWith(experiment, {&recorder, &live, &look}));
  live.Finish();
  const Config data = Parse(update);
  const Node ekf = First(data.root().At("run").At("estimators"));
  EXPECT_EQ(RowsOf(data, ekf.At("t")), LiveRun::kRows);
  EXPECT_EQ(RowsOf(data, First(First(ekf.At("blocks")).At("error"))), LiveRun::kRows);
  EXPECT_EQ(data.root().At("run").At("t0").Number(),
            0.0);  // the times count from the first frame of the run
}

TEST(LiveRun, DoesNotChangeTheFilesOfTheRun) {
  const testing::TemporaryFolder temporary;
  testing::Record(testing::OptionsFor(temporary / "without"));
  {
    LiveRun live(0, temporary / "with", testing::MakeConfig());
    Recorder::Options record = testing::OptionsFor(temporary / "with");
    record.max_delay = LiveRun::kMaxDelay;
    Recorder recorder(record, testing::MakeConfig());
    Experiment experiment = testing::MakeExperiment();
    RunResult result = RunWith(experiment, {&recorder, &live});
    result.estimators[0].events.push_back(
        {33'000'000, EventKind::kEstimatorSpecific, "a \"word\", and\nanother"});
    result.estimators[0].events.push_back(
        {kNoTimestamp, EventKind::kEstimatorSpecific, "timeless"});
    recorder.Finish(result);
    live.Finish();
  }
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(temporary / "without")) {
    const auto name = std::filesystem::relative(entry.path(), temporary / "without");
    // The wall-clock times differ.
    if (!entry.is_regular_file() || name == "timing.json" || name == "timing.csv") continue;
    EXPECT_TRUE(testing::Read(entry.path()) == testing::Read(temporary / "with" / name)) << name;
    ++files;
  }
  EXPECT_GT(files, 10);
}

}  // namespace
}  // namespace alidade
