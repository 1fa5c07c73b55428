// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <Eigen/Core>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "alidade/check/plugin_listing.h"
#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/state/instruction_set.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDoctorFooter =
    R"(Each line starts with ok, warn or fail. A remedy follows if one is needed. The exit code is 1
if a line starts with fail, else 0.)";

/// Lines that `alidade doctor` prints.
class Diagnosis {
 public:
  void Ok(const std::string& text) { text_ += "ok    " + text + '\n'; }
  void Warn(const std::string& text, const std::string& remedy) {
    ++warnings_;
    Add("warn  ", text, remedy);
  }
  void Fail(const std::string& text, const std::string& remedy) {
    ++failures_;
    Add("fail  ", text, remedy);
  }
  const std::string& text() const { return text_; }
  bool failed() const { return failures_ > 0; }
  std::string Summary() const {
    if (failed()) return Counted(failures_, "failure") + ", " + Counted(warnings_, "warning");
    if (warnings_ > 0) return "the installation works, with " + Counted(warnings_, "warning");
    return "all is well";
  }

 private:
  void Add(const char* level, const std::string& text, const std::string& remedy) {
    text_ += level + text + '\n';
    if (!remedy.empty()) text_ += "      remedy: " + remedy + '\n';
  }
  static std::string Counted(int count, const char* noun) {
    return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
  }
  std::string text_;
  int warnings_ = 0, failures_ = 0;
};

std::string EigenVersion() {
  return std::to_string(EIGEN_WORLD_VERSION) + '.' + std::to_string(EIGEN_MAJOR_VERSION) + '.' +
         std::to_string(EIGEN_MINOR_VERSION);
}

std::string Compiler() {
#if defined(__clang__)
  return std::string("clang ") + __clang_version__;
#else
  return std::string("g++ ") + __VERSION__;
#endif
}

std::string Processor() {
  std::string text = std::to_string(std::thread::hardware_concurrency()) + " threads";
#if defined(__x86_64__)
  const auto add = [&](bool has, const char* name) {
    if (has) text.append(" ").append(name);
  };
  text += ", x86-64:";
  add(__builtin_cpu_supports("sse4.2") != 0, "sse4.2");
  add(__builtin_cpu_supports("avx") != 0, "avx");
  add(__builtin_cpu_supports("avx2") != 0, "avx2");
  add(__builtin_cpu_supports("fma") != 0, "fma");
  add(__builtin_cpu_supports("avx512f") != 0, "avx512f");
#endif
  return text;
}

void CheckVersions(Diagnosis& diagnosis) {
  diagnosis.Ok("alidade " ALIDADE_VERSION);
  diagnosis.Ok("built with " + Compiler() + ", Eigen " + EigenVersion() + ", yaml-cpp " +
               ALIDADE_YAML_CPP_VERSION + ", Boost " + ALIDADE_BOOST_VERSION);
  diagnosis.Ok("processor: " + Processor() +
               "; kernels: " + ToString(internal::BestInstructionSet()));
}

std::string RemedyFor(const Refusal& refusal) {
  const std::string file = refusal.file.string();
  if (refusal.code == ExitCode::kNotTrusted) {
    return "if you trust the file: chmod go-w '" + file +
           "' and the folders above it, and chown all of them to your user";
  }
  return "rebuild the plugin for this version of alidade, or remove the file";
}

/// Reports whether the batch estimator was built. The build omits the batch estimator if the Ceres
/// solver is not installed.
void CheckBatch(const PluginHost& host, Diagnosis& diagnosis) {
  const auto is_batch = [](const PluginEntry& entry) {
    return entry.kind == kEstimatorKind && EstimatorOf(entry).kind == EstimatorKind::kBatch;
  };
  const auto batch = std::ranges::find_if(host.entries(), is_batch);
  if (batch != host.entries().end()) {
    diagnosis.Ok("batch estimator: " + batch->name);
  } else {
    diagnosis.Warn("the batch estimator is not built: filters cannot be compared with a batch",
                   "apt-get install libceres-dev, then configure and build all targets");
  }
}

void CheckPlugins(const std::vector<std::string>& paths, Diagnosis& diagnosis) {
  const PluginHost host(Absolute(paths), OnRefusal::kList);
  for (const std::string& place : host.searched()) diagnosis.Ok("searched " + place);
  for (const Refusal& refusal : host.refusals()) {
    diagnosis.Warn("plugin " + refusal.file.string() + " was refused: " + refusal.reason,
                   RemedyFor(refusal));
  }
  const auto count = [&](const char* kind) {
    return static_cast<int>(std::ranges::count(host.entries(), kind, &PluginEntry::kind));
  };
  const int sources = count(kSourceKind);
  const int estimators = count(kEstimatorKind);
  const int models = static_cast<int>(host.entries().size()) - sources - estimators;
  const auto count_text = [](int n, const char* text) {
    return std::to_string(n) + ' ' + text + (n == 1 ? "" : "s");
  };
  const std::string found = count_text(models, "model") + ", " + count_text(sources, "source") +
                            " and " + count_text(estimators, "estimator") + " in plugins";
  if (models > 0 && sources > 0) {
    diagnosis.Ok(found);
  } else {
    diagnosis.Fail("plugins: " + found,
                   "build or install the plugins, or set ALIDADE_PLUGIN_PATH=FOLDER");
  }
  CheckBatch(host, diagnosis);
}

void CheckEnvironment(Diagnosis& diagnosis) {
  const char* const data = std::getenv("ALIDADE_DATA");
  const std::string remedy = "export ALIDADE_DATA=FOLDER; FOLDER must contain kitti-depth-pairs";
  std::error_code error;
  if (data == nullptr || *data == '\0') {
    diagnosis.Warn("ALIDADE_DATA is not set: examples with real recordings need this variable",
                   remedy);
  } else if (!fs::is_directory(data, error)) {
    diagnosis.Warn(std::string("ALIDADE_DATA is not a folder: ") + data, remedy);
  } else {
    diagnosis.Ok(std::string("ALIDADE_DATA is ") + data);
  }
}

/// Reports whether the current folder is writable. Creates a temporary folder for this test,
/// because permissions do not show that a file system is read-only or full.
void CheckCurrentFolder(Diagnosis& diagnosis) {
  std::string name = ".alidade-doctor-XXXXXX";
  if (::mkdtemp(name.data()) != nullptr) {
    ::rmdir(name.c_str());
    diagnosis.Ok("the current folder is writable: runs/ is created there");
    return;
  }
  const std::string reason = std::generic_category().message(errno);
  diagnosis.Fail("the current folder is not writable: " + reason,
                 "change to another folder, or choose one: alidade run CONFIG -o DIR");
}

ExitCode RunDoctor(const std::vector<std::string>& paths) {
  Diagnosis diagnosis;
  CheckVersions(diagnosis);
  CheckPlugins(paths, diagnosis);
  CheckEnvironment(diagnosis);
  CheckCurrentFolder(diagnosis);
  PrintText(diagnosis.text() + '\n' + diagnosis.Summary() + '\n');
  return diagnosis.failed() ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

void AddDoctor(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("doctor", "Check the installation");
  const auto paths = std::make_shared<std::vector<std::string>>();
  AddPluginPath(command, *paths);
  command.footer(kDoctorFooter);
  command.callback([&action, paths] { action = [paths] { return RunDoctor(*paths); }; });
}

}  // namespace alidade::cli
