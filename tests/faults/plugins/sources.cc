// SPDX-License-Identifier: Apache-2.0
// A C++ plugin with working sources, and with a source that throws.
#include <stdexcept>

#include "alidade/experiment/source_plugin.h"
#include "alidade/model/camera.h"

namespace {

class Counter : public alidade::Source {
 public:
  explicit Counter(int last) : last_(last) {}
  const std::vector<alidade::StreamInfo>& streams() const override { return streams_; }
  const std::vector<alidade::StreamInfo>& truths() const override { return truths_; }
  bool Next(alidade::SourceFrame& frame) override {
    frame.timestamp = next_;
    return next_++ < last_;
  }

 private:
  std::vector<alidade::StreamInfo> streams_{{"count", 1}}, truths_;
  int next_ = 0, last_;
};

std::unique_ptr<alidade::Source> MakeCounter(const alidade::SourceArguments& arguments) {
  const int last = arguments.params.Integer("last", "how far it counts", 1, 100);
  static_cast<void>(arguments.entry.At("unit", "counter").Text());
  return std::make_unique<Counter>(last);
}

std::unique_ptr<alidade::Source> Throw(const alidade::SourceArguments&) {
  throw std::runtime_error("no such thing");
}

std::unique_ptr<alidade::Source> See(const alidade::SourceArguments& arguments) {
  return std::make_unique<Counter>(alidade::Camera(arguments.params).width);
}

}  // namespace

ALIDADE_SOURCE_PLUGIN({"counter", "counts", "unit  what is counted", &MakeCounter},
                      {"throwing_source", "throws", "", &Throw},
                      {"sees", "counts the columns of a camera", "", &See})
