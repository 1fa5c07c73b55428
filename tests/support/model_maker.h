// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/plugin.h"
#include "alidade/plugin/plugin_models.h"

namespace alidade::testing {

/// Host that reads parameters from a map. It runs models through the plugin ABI without a plugin
/// file.
class MapHost {
 public:
  using Values = std::map<std::string, std::vector<double>>;

  explicit MapHost(Values values = {}) : values_(std::move(values)) {
    host_.struct_size = sizeof(AlidadeHost);
    host_.context = this;
    host_.read = &MapHost::Read;
    host_.fail = &MapHost::Fail;
  }
  MapHost(const MapHost&) = delete;
  MapHost& operator=(const MapHost&) = delete;

  const AlidadeHost* c() const { return &host_; }
  const std::vector<std::string>& missing() const { return missing_; }
  const std::vector<std::string>& failures() const { return failures_; }

 private:
  static std::int32_t Read(void* self, const AlidadeParam* param, double* values,
                           std::int32_t capacity) {
    auto* host = static_cast<MapHost*>(self);
    const auto found = host->values_.find(param->key);
    if (found == host->values_.end()) {
      if ((param->flags & ALIDADE_PARAM_HAS_DEFAULT) != 0) return param->count;
      host->missing_.emplace_back(param->key);
      return -1;
    }
    const auto size = static_cast<std::int32_t>(found->second.size());
    std::copy_n(found->second.begin(), std::min(size, capacity), values);
    return size;
  }
  static void Fail(void* self, const char* key, const char* text) {
    static_cast<MapHost*>(self)->failures_.push_back(std::string(key) + ": " + text);
  }

  AlidadeHost host_{};
  Values values_;
  std::vector<std::string> missing_, failures_;
};

using Maker = void (*)(Params&, AlidadeInstance*);

inline std::shared_ptr<const ModelInstance> MakeInstance(Maker make, const MapHost& host) {
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  Params params(host.c());
  make(params, &instance);
  return std::make_shared<const ModelInstance>(instance, "test", "in process");
}

template <class Model>
std::shared_ptr<const PluginSensor> AbiSensor(const MapHost::Values& values = {}) {
  return std::make_shared<PluginSensor>(MakeInstance(&EmplaceSensor<Model>, MapHost(values)));
}
template <class Model>
std::shared_ptr<const PluginMotion> AbiMotion(const MapHost::Values& values = {}) {
  return std::make_shared<PluginMotion>(MakeInstance(&EmplaceMotion<Model>, MapHost(values)));
}

}  // namespace alidade::testing
