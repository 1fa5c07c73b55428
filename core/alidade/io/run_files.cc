// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/run_files.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/io/read_file.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailOpen(const fs::path& file) {
  throw Error(ExitCode::kInputMissing,
              ErrorLine(Place{file.string()}, {}, "the file cannot be read",
                        "the folder of a finished run"));
}

}  // namespace

void FailFile(const fs::path& file, int line, const std::string& message) {
  throw Error(ExitCode::kBadData, ErrorLine(Place{file.string(), line}, {}, message,
                                            "an unmodified run folder; repeat the run"));
}

void RequireFile(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) FailOpen(file);
  if (!fs::is_regular_file(file, error)) FailFile(file, 0, "this is not a regular file");
}

std::ifstream OpenFile(const fs::path& file) {
  RequireFile(file);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) FailOpen(file);
  return stream;
}

Json ReadJsonFile(const fs::path& file) {
  constexpr std::uintmax_t kMaxBytes = 1 << 28;
  RequireFile(file);
  if (fs::file_size(file) > kMaxBytes) FailFile(file, 0, "the file is larger than 256 MiB");
  const std::string text = ReadFile(
      file, [&](ExitCode, int) { FailOpen(file); }, kMaxBytes);
  return ParseJson(text, file.string());
}

}  // namespace alidade::internal
