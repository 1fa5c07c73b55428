// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <iterator>
#include <memory>

#include "alidade/host/headers_hash.h"
#include "alidade/host/plugin_host.h"
#include "alidade/host/source.h"
#include "alidade/model/build_tag.h"

/// Exports of C++ plugins, made against alidade::core, loaded only into the very build
/// that they were made with.
namespace alidade {

class ImageWriter;      // in alidade/record/images.h
struct ImageArguments;  // likewise
struct BundleProblem;   // in alidade/bundle/bundle.h
struct BundleOptions;   // likewise
struct BundleResult;    // likewise

/// All that must be equal between the host and a C++ plugin: version and headers, compiler, and
/// what else changes the layout of classes.
#define ALIDADE_STRINGISE_(x) #x
#define ALIDADE_STRINGISE(x) ALIDADE_STRINGISE_(x)
#if defined(_GLIBCXX_DEBUG)
#define ALIDADE_BUILD_STL "debug-stl"
#else
#define ALIDADE_BUILD_STL "stl"
#endif
#define ALIDADE_BUILD_VERSION "0.1.0"  // of the project: plugin_host.cc checks it
#define ALIDADE_BUILD_ID \
  ALIDADE_BUILD_VERSION  \
  " " __VERSION__ " cxx" ALIDADE_STRINGISE(__cplusplus) " abi" ALIDADE_STRINGISE( \
      __GXX_ABI_VERSION) " align" ALIDADE_STRINGISE(__BIGGEST_ALIGNMENT__) " " ALIDADE_BUILD_STL \
  ALIDADE_STRINGISE(_GLIBCXX_USE_CXX11_ABI) " eigen" ALIDADE_STRINGISE(EIGEN_WORLD_VERSION) \
  "." ALIDADE_STRINGISE(EIGEN_MAJOR_VERSION) "." ALIDADE_STRINGISE(EIGEN_MINOR_VERSION) \
  "/" ALIDADE_STRINGISE(EIGEN_MAX_ALIGN_BYTES) " headers" ALIDADE_HEADERS_HASH

struct SourceEntry {
  const char* name;
  const char* doc;
  /// Keys that are not read through Params, one a line: `key  meaning`.
  const char* keys;
  std::unique_ptr<Source> (*create)(const SourceArguments& arguments);
};

/// What an estimator reads its options from.
struct EstimatorArguments {
  Node entry;      ///< the config's entry of `estimators`
  Params& params;  ///< the same entry, read by declaration (numbers, flags, choices)
};

struct EstimatorEntry {
  const char* name;
  const char* doc;
  const char* citation;
  /// Reads the options; what it returns makes the estimator once its system is known. Errors of
  /// both: an Error with a place, as of Node::Fail.
  EstimatorMaker (*create)(const EstimatorArguments& arguments);
  EstimatorKind kind = EstimatorKind::kFilter;
  /// What it can do; what a system asks for beyond is refused by name before `create`'s maker is
  /// asked. Null: it takes no landmarks, and refuses by itself what else it cannot do.
  const Support* support = nullptr;
};

struct CppPluginTable {
  std::uint32_t struct_size = sizeof(CppPluginTable);
  const SourceEntry* sources = nullptr;
  int source_count = 0;
  const EstimatorEntry* estimators = nullptr;
  int estimator_count = 0;
  /// Of the plugin that draws images: see OpenImageWriter.
  std::unique_ptr<ImageWriter> (*images)(const ImageArguments& arguments) = nullptr;
  /// Of the plugin that adjusts bundles: see AdjustBundle.
  BundleResult (*adjust)(const SensorModel& sensor, BundleProblem& problem,
                         const BundleOptions& options) = nullptr;
};

inline constexpr const char* kCppEntrySymbol = "alidade_cpp_plugin";

}  // namespace alidade

/// Exports a table of this plugin; `...` are the members of CppPluginTable after the size.
#define ALIDADE_CPP_PLUGIN_(...)                                                                 \
  ALIDADE_BUILD_TAG(ALIDADE_PLUGIN_CPP, ALIDADE_BUILD_ID)                                        \
  extern "C" __attribute__((visibility("default"))) const alidade::CppPluginTable*               \
  alidade_cpp_plugin() {                                                                         \
    static const alidade::CppPluginTable table = {sizeof(alidade::CppPluginTable), __VA_ARGS__}; \
    return &table;                                                                               \
  }

/// Exports the sources of this plugin: ALIDADE_SOURCE_PLUGIN({"name", "doc", "keys", &Create}, ...)
#define ALIDADE_SOURCE_PLUGIN(...)                                         \
  static constexpr alidade::SourceEntry alidade_sources[] = {__VA_ARGS__}; \
  ALIDADE_ENTRY_NAMES(alidade_sources)                                     \
  ALIDADE_CPP_PLUGIN_(alidade_sources, std::size(alidade_sources), nullptr, 0)

/// Exports the estimators of this plugin:
/// ALIDADE_ESTIMATOR_PLUGIN({"name", "doc", "citation", &Create}, ...)
#define ALIDADE_ESTIMATOR_PLUGIN(...)                                            \
  static constexpr alidade::EstimatorEntry alidade_estimators[] = {__VA_ARGS__}; \
  ALIDADE_ENTRY_NAMES(alidade_estimators)                                        \
  ALIDADE_CPP_PLUGIN_(nullptr, 0, alidade_estimators, std::size(alidade_estimators))

/// Exports the image writer of this plugin: ALIDADE_IMAGE_PLUGIN(&Create)
#define ALIDADE_IMAGE_PLUGIN(create) ALIDADE_CPP_PLUGIN_(nullptr, 0, nullptr, 0, create)

/// Exports the bundle adjustment of this plugin: ALIDADE_BUNDLE_PLUGIN(&Adjust)
#define ALIDADE_BUNDLE_PLUGIN(adjust) ALIDADE_CPP_PLUGIN_(nullptr, 0, nullptr, 0, nullptr, adjust)
