// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/check/plugin_listing.h"
#include "alidade/io/wrap_text.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kPluginsFooter = R"(Examples:
  alidade plugins list -v
  alidade plugins info stereo_disparity
  alidade plugins info scale_2d --json
  alidade plugins info ekf
  alidade plugins where --plugin-path build/lib

alidade searches for plugins in the paths of the config's `plugins:`, of --plugin-path and of
ALIDADE_PLUGIN_PATH, in the user's data folder ($XDG_DATA_HOME/alidade/plugins), and next to the
program.)";

struct PluginsArguments {
  std::vector<std::string> paths;
  std::string name;
  bool json = false, files = false;
};

using Listing = std::string (*)(const PluginHost&, const PluginsArguments&);

/// Adds the options of a subcommand. The subcommand prints the result of `listing`.
std::shared_ptr<PluginsArguments> AddListing(CLI::App& command, Action& action, Listing listing,
                                             OnRefusal on_refusal = OnRefusal::kThrow) {
  const auto arguments = std::make_shared<PluginsArguments>();
  AddPluginPath(command, arguments->paths);
  command.footer(kPluginsFooter);
  command.callback([&action, arguments, listing, on_refusal] {
    action = [arguments, listing, on_refusal] {
      const PluginHost host(Absolute(arguments->paths), on_refusal);
      const std::string text = listing(host, *arguments);
      Print(arguments->json ? text : internal::WrapText(text, OutputWidth()));
      return ExitCode::kOk;
    };
  });
  return arguments;
}

std::string List(const PluginHost& host, const PluginsArguments& arguments) {
  if (const std::size_t count = host.refusals().size(); count > 0) {
    PrintNote(std::to_string(count) + (count == 1 ? " plugin was" : " plugins were") +
              " refused: `alidade plugins where` lists the reasons");
  }
  return arguments.json ? PluginListJson(host) : PluginList(host, arguments.files);
}

std::string Info(const PluginHost& host, const PluginsArguments& arguments) {
  return arguments.json ? PluginInfoJson(host, arguments.name) : PluginInfo(host, arguments.name);
}

std::string Where(const PluginHost& host, const PluginsArguments&) { return PluginPlaces(host); }

}  // namespace

void AddPlugins(CLI::App& program, Action& action) {
  CLI::App& plugins = *program.add_subcommand("plugins", "List plugins or describe one");
  plugins.require_subcommand(1);
  plugins.footer(kPluginsFooter);
  CLI::App& list =
      *plugins.add_subcommand("list", "List the models, sources and estimators that are available");
  const auto list_arguments = AddListing(list, action, List);
  list.add_flag("-v,--verbose", list_arguments->files, "also print the file of each plugin");
  list.add_flag("--json", list_arguments->json, "print JSON");
  CLI::App& info = *plugins.add_subcommand("info", "Describe a model, source or estimator");
  const auto info_arguments = AddListing(info, action, Info);
  info.add_option("NAME", info_arguments->name,
                  "name of a sensor, motion model, source or estimator")
      ->option_text(" ")
      ->required();
  info.add_flag("--json", info_arguments->json, "print JSON");
  CLI::App& places = *plugins.add_subcommand(
      "where",
      "List the searched folders, their plugins, and the refused plugins with the reasons");
  AddListing(places, action, Where, OnRefusal::kList);
}

}  // namespace alidade::cli
