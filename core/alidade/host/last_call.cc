// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/last_call.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <vector>

#include "alidade/host/instances.h"
#include "alidade/host/model_instance.h"

namespace alidade {

constinit thread_local std::atomic<const void*> detail::last_call = nullptr;

namespace {

struct Instances {
  std::mutex mutex;
  std::vector<const ModelInstance*> all;
};

Instances& TheInstances() {
  static Instances& instances = *new Instances;  // models may outlive statics
  return instances;
}

/// The author's name of the function in that slot of an instance; null: it is none of its.
const char* NameOf(const ModelInstance& model, const void* slot) {
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

void internal::AddInstance(const ModelInstance& model) {
  const std::lock_guard lock(TheInstances().mutex);
  TheInstances().all.push_back(&model);
}

void internal::DropInstance(const ModelInstance& model) {
  const std::lock_guard lock(TheInstances().mutex);
  std::erase(TheInstances().all, &model);
}

void DescribeCall(const void* slot, char* text, std::size_t size) {
  CutText line(text, size);
  if (slot == nullptr) return;  // else there has been an instance
  const std::unique_lock lock(TheInstances().mutex, std::try_to_lock);
  if (!lock) return;
  for (const ModelInstance* const model : TheInstances().all) {
    const char* const name = NameOf(*model, slot);
    if (name == nullptr) continue;
    line << name << " of model '" << model->name().c_str() << "' of plugin "
         << model->plugin().c_str();
    return;
  }
}

}  // namespace alidade
