// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/last_call.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <string_view>
#include <vector>

#include "alidade/base/child_process.h"
#include "alidade/base/log.h"
#include "alidade/host/foreign_call.h"
#include "alidade/host/instances.h"
#include "alidade/host/model_instance.h"

namespace alidade {

constinit thread_local std::atomic<const void*> detail::last_call = nullptr;

namespace {

struct Instances {
  std::mutex mutex;
  std::vector<const ModelInstance*> all;
  internal::NamedCall* calls = nullptr;  ///< that last
  std::uint64_t call_count = 0;
};

Instances& TheInstances() {
  static Instances& instances = *new Instances;  // models may outlive statics
  return instances;
}

/// Puts one text after another, as far as there is room.
class CutText {
 public:
  CutText(char* text, std::size_t size) : at_(text), end_(text + size - 1) { *at_ = '\0'; }
  CutText& operator<<(const char* more) {
    while (*more != '\0' && at_ != end_) *at_++ = *more++;
    *at_ = '\0';
    return *this;
  }

 private:
  char *at_, *end_;
};

}  // namespace

const char* internal::NameOfCall(const ModelInstance& model, const void* slot) {
  const AlidadeInstance& c = model.c();
  if (c.sensor != nullptr) {
    if (slot == &c.sensor->eval) return "Predict";
    if (slot == &c.sensor->sqrt_noise) return "SqrtNoise";
    if (slot == &c.sensor->valid) return "Valid";
    if (slot == &c.sensor->initialise) return "Initialise";
  }
  if (c.motion != nullptr) {
    if (slot == &c.motion->step) return "Step";
    if (slot == &c.motion->sqrt_q) return "SqrtQ";
  }
  return nullptr;
}

void internal::AddInstance(const ModelInstance& model) {
  const std::lock_guard lock(TheInstances().mutex);
  TheInstances().all.push_back(&model);
}

void internal::DropInstance(const ModelInstance& model) {
  const std::lock_guard lock(TheInstances().mutex);
  std::erase(TheInstances().all, &model);
}

internal::NamedCall::NamedCall(const char* of_call, const char* of_kind, const std::string& of_name,
                               const std::string& of_plugin)
    : call(of_call),
      kind(of_kind),
      name(of_name.c_str()),
      plugin(of_plugin.c_str()),
      outer_(detail::last_call) {
  const std::lock_guard lock(TheInstances().mutex);
  number = ++TheInstances().call_count;
  next = TheInstances().calls;
  TheInstances().calls = this;
  detail::NoteCall(this);
}

internal::NamedCall::~NamedCall() {
  detail::NoteCall(outer_);
  const std::lock_guard lock(TheInstances().mutex);
  NamedCall** at = &TheInstances().calls;
  while (*at != this) at = &(*at)->next;
  *at = next;
}

void internal::Destroy(const AlidadeInstance& instance, const std::string& name,
                       const std::string& plugin) noexcept {
  const NamedCall call("Destroy", "model", name, plugin);
  EnterInChild("destroy");
  const std::string thrown = ThrownBy([&] { instance.destroy(instance.self); });
  if (thrown.empty()) return;
  Log(LogLevel::kWarning,
      "Destroy of model '" + name + "' of plugin " + plugin + " threw: " + thrown);
}

void DescribeCall(const void* slot, char* text, std::size_t size) {
  CutText line(text, size);
  if (slot == nullptr) return;  // else there has been an instance
  const std::unique_lock lock(TheInstances().mutex, std::try_to_lock);
  if (!lock) return;
  for (const internal::NamedCall* call = TheInstances().calls; call != nullptr; call = call->next) {
    if (call != slot) continue;
    line << call->call << " of " << call->kind << " '" << call->name << "' of plugin "
         << call->plugin;
    return;
  }
  for (const ModelInstance* const model : TheInstances().all) {
    const char* const name = internal::NameOfCall(*model, slot);
    if (name == nullptr) continue;
    line << name << " of model '" << model->name().c_str() << "' of plugin "
         << model->plugin().c_str();
    return;
  }
}

LastingCall OldestLastingCall() {
  const std::lock_guard lock(TheInstances().mutex);
  LastingCall oldest;
  for (const internal::NamedCall* call = TheInstances().calls; call != nullptr; call = call->next) {
    if (std::string_view(call->kind) != "source") oldest = {call, call->number};
  }
  return oldest;
}

}  // namespace alidade
