// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iterator>
#include <memory>

#include "alidade/model/build_tag.h"
#include "alidade/plugin/plugin_host.h"
#include "alidade/plugin/source.h"

/// Exports of C++ plugins, which are made against alidade::core.
namespace alidade {

class ImageWriter;      // in alidade/record/images.h
struct ImageArguments;  // likewise
struct BundleProblem;   // in alidade/bundle/bundle.h
struct BundleOptions;   // likewise
struct BundleResult;    // likewise

/// The ABI number of C++ plugins, which share classes with the library. A plugin is loaded only if
/// its number is that of the library. Whoever changes the layout or the meaning of an installed
/// class or function raises it. The classes of a debug standard library have another layout.
#if defined(_GLIBCXX_DEBUG)
#define ALIDADE_CPP_ABI "1 with _GLIBCXX_DEBUG"
#else
#define ALIDADE_CPP_ABI "1"
#endif

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
  ALIDADE_BUILD_TAG(ALIDADE_PLUGIN_CPP, ALIDADE_CPP_ABI)                                         \
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
