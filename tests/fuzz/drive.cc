// SPDX-License-Identifier: Apache-2.0
//
// Replacement for libFuzzer. Usage: PROGRAM SEED... or PROGRAM FOLDER MUTATIONS
//
// Runs each seed once. With FOLDER, the seeds are the files of this folder, and the program also
// runs MUTATIONS mutations of them. The mutations are the same in every run. An input that crashes
// the program is written to crash-PID in the working folder. Exit code 2: a seed or the folder
// cannot be read.
#include <fcntl.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <random>
#include <sstream>
#include <system_error>

#include "fuzz.h"

namespace {

namespace fs = std::filesystem;

std::string g_input;  // the current input; Keep writes it to a file

extern "C" void Keep(int signal) {
  char name[32];
  std::snprintf(name, sizeof name, "crash-%d", static_cast<int>(::getpid()));
  const int file = ::open(name, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const bool kept = ::write(file, g_input.data(), g_input.size()) >= 0;
  std::fprintf(stderr, "signal %d; %s %s\n", signal,
               kept ? "the input is in" : "cannot write the input to", name);
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void Run(const std::string& input) {
  g_input = input;
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

[[noreturn]] void FailRead(const fs::path& path) {
  std::fprintf(stderr, "%s: cannot be read\n", path.c_str());
  std::exit(2);
}

std::string Read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (stream && stream.peek() != std::ifstream::traits_type::eof()) text << stream.rdbuf();
  if (!stream.is_open() || stream.bad() || text.bad()) FailRead(file);
  return text.str();
}

/// Returns the files of a folder, sorted by name.
std::vector<fs::path> FilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error))
    files.push_back(entry->path());
  if (error || files.empty()) FailRead(folder);
  std::sort(files.begin(), files.end());
  return files;
}

/// Makes a few random changes to a text.
class Mutator {
 public:
  explicit Mutator(std::vector<std::string> seeds) : seeds_(std::move(seeds)) {}

  std::string Next() {
    std::string text = seeds_[Below(seeds_.size())];
    for (std::size_t changes = 1 + Below(4); changes > 0; --changes) Change(text);
    return text;
  }

 private:
  std::size_t Below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }

  void Change(std::string& text) {
    static constexpr std::array<std::string_view, 24> kPieces = {
        "0",      "-1",
        "1e308",  "-0",
        "nan",    "9223372036854775807",
        "1e-320", "4294967296",
        ",",      "\n",
        ": ",     "[",
        "{",      "}",
        "]",      "'",
        "\"",     "- ",
        "&a ",    "*a",
        "#",      "\xEF\xBB\xBF",
        "\xFF",   std::string_view("\0", 1)};
    const std::size_t at = Below(text.size() + 1),
                      length = Below(1 + std::min<std::size_t>(text.size() - at, 32));
    switch (Below(6)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(engine_());
        break;
      case 1:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << Below(8)));
        break;
      case 2:
        text.erase(at, length);
        break;
      case 3:
        text.insert(at, text.substr(Below(text.size() + 1), 1 + Below(32)));
        break;
      case 4: {
        const std::string& other = seeds_[Below(seeds_.size())];
        const std::size_t from = Below(other.size() + 1);
        text.replace(at, length, other, from, 1 + Below(64));
        break;
      }
      default:
        text.replace(at, Below(3) == 0 ? length : 0, kPieces[Below(kPieces.size())]);
    }
  }

  std::vector<std::string> seeds_;
  std::mt19937_64 engine_{1};
};

}  // namespace

int main(int count, char** arguments) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) ::signal(signal, Keep);
  std::error_code ignored;
  if (count == 3 && fs::is_directory(arguments[1], ignored)) {
    std::vector<std::string> seeds;
    for (const fs::path& file : FilesIn(arguments[1])) seeds.push_back(Read(file));
    for (const std::string& seed : seeds) Run(seed);
    Mutator mutator(std::move(seeds));
    for (int left = std::atoi(arguments[2]); left > 0; --left) Run(mutator.Next());
    return 0;
  }
  for (int i = 1; i < count; ++i) Run(Read(arguments[i]));
  return count > 1 ? 0 : 2;
}
