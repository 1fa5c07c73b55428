// SPDX-License-Identifier: Apache-2.0
//
// fuzz_host_load CASES SEED PLUGIN...
//
// Loads damaged copies of plugins, each in a fork of this process: what the dynamic loader
// overwrites depends on what lies where, so only a process like the host shows it. Prints how many
// were loaded and refused. One that ends the process, hangs, or is no refusal of a plugin is kept
// as crash-SEED-CASE.so in the working folder; the exit code is then 1.
#include <elf.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>
#include <iostream>
#include <iterator>
#include <random>

#include "alidade/host/plugin_file.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kOne = 1;
constexpr std::uint64_t kValues[] = {
    0,          1,          0xff,         0x7fff,         0xffff,         0x7fffffff,
    0xffffffff, kOne << 32, kOne << 40,   kOne << 46,     kOne << 47,     kOne << 62,
    kOne << 63, ~0ull,      ~0ull - 4095, ~0ull - 0xffff, ~0ull - 0xfffff};

class Damage {
 public:
  Damage(const fs::path& file, std::uint64_t seed) : engine_(seed) {
    std::ifstream stream(file, std::ios::binary);
    good_.assign(std::istreambuf_iterator<char>(stream), {});
    std::memcpy(&header_, good_.data(), sizeof header_);
    for (unsigned i = 0; i < header_.e_shnum; ++i) {
      Elf64_Shdr section;
      std::memcpy(&section, good_.data() + header_.e_shoff + i * sizeof section, sizeof section);
      const bool walked = (section.sh_flags & SHF_ALLOC) != 0 && section.sh_type != SHT_NOBITS &&
                          section.sh_type != SHT_NOTE && section.sh_size >= 8 &&
                          (section.sh_flags & SHF_EXECINSTR) == 0;
      if (section.sh_type == SHT_DYNAMIC) dynamic_ = section;
      if ((section.sh_flags & SHF_EXECINSTR) != 0) code_.push_back(section);
      // What the dynamic loader walks; data alone only the plugin does.
      if (walked && (section.sh_type != SHT_PROGBITS || (section.sh_flags & SHF_WRITE) != 0))
        sections_.push_back(section);
    }
  }

  std::string Next() {
    constexpr std::size_t kChanges[] = {1, 1, 1, 2, 3};
    std::string bytes = good_;
    for (std::size_t left = kChanges[Below(5)]; left > 0; --left) Change(bytes);
    return bytes;
  }

 private:
  std::uint64_t Below(std::uint64_t n) { return engine_() % n; }
  std::uint64_t Value() {
    const std::uint64_t kind = Below(std::size(kValues) + 3);
    if (kind < std::size(kValues)) return kValues[kind];
    constexpr int kShifts[] = {0, 44, 48};
    return engine_() >> kShifts[kind - std::size(kValues)];
  }
  template <class T>
  static void Put(std::string& bytes, std::uint64_t at, T value) {
    if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
  }

  void Change(std::string& bytes) {
    const std::uint64_t kind = Below(20);
    if (kind < 8) {
      ChangeSegment(bytes);
    } else if (kind < 13) {
      const std::uint64_t entries =
          std::min<std::uint64_t>(dynamic_.sh_size / sizeof(Elf64_Dyn), 28);
      const std::uint64_t at = dynamic_.sh_offset + sizeof(Elf64_Dyn) * Below(entries);
      const bool tag = Below(4) == 0;
      Put(bytes, at + (tag ? 0 : 8), Below(3) == 0 ? Below(40) : Value());
    } else if (kind < 18) {
      const Elf64_Shdr& section = sections_[Below(sections_.size())];
      if (Below(2) == 0) {
        Put(bytes, section.sh_offset + Below(section.sh_size), static_cast<char>(engine_()));
      } else {
        Put(bytes, section.sh_offset + 8 * Below(section.sh_size / 8), Value());
      }
    } else if (const std::uint64_t at = Below(bytes.size()); !IsCode(at)) {
      Put(bytes, at, static_cast<char>(engine_()));
    }
  }
  /// What it does is the plugin's own affair.
  bool IsCode(std::uint64_t at) const {
    return std::any_of(code_.begin(), code_.end(), [&](const Elf64_Shdr& section) {
      return at >= section.sh_offset && at - section.sh_offset < section.sh_size;
    });
  }
  void ChangeSegment(std::string& bytes) {
    constexpr std::uint64_t kMembers[] = {0, 4, 8, 16, 32, 40, 48};
    constexpr std::uint32_t kTypes[] = {
        0, 1, 2, 3, 4, 5, 6, 7, PT_GNU_EH_FRAME, PT_GNU_STACK, PT_GNU_RELRO};
    const std::uint64_t at = header_.e_phoff + sizeof(Elf64_Phdr) * Below(header_.e_phnum);
    const std::uint64_t member = kMembers[Below(std::size(kMembers))];
    if (member >= 8) return Put(bytes, at + member, Value());
    const bool any = Below(12) == 0;
    Put(bytes, at + member,
        any ? static_cast<std::uint32_t>(engine_()) : kTypes[Below(std::size(kTypes))]);
  }

  std::string good_;
  Elf64_Ehdr header_{};
  Elf64_Shdr dynamic_{};
  std::vector<Elf64_Shdr> sections_, code_;
  std::mt19937_64 engine_;
};

enum Outcome { kLoaded, kRefused, kBroken };

/// As the program does: what the library has registered runs when the process ends.
[[noreturn]] void Load(const fs::path& file, const fs::path& good) {
  constexpr unsigned kMost_s = 60;  // the host itself gives a plugin 30 s
  const int silent = ::open("/dev/null", O_WRONLY);
  ::dup2(silent, STDOUT_FILENO);
  ::dup2(silent, STDERR_FILENO);
  ::alarm(kMost_s);
  int code = kBroken;
  try {
    static_cast<void>(internal::OpenPlugin(file, file));
    code = kLoaded;
  } catch (const Error& error) {
    if (error.code() == ExitCode::kPlugin) code = kRefused;
  }
  // What was overwritten may be what the next one needs.
  static_cast<void>(internal::OpenPlugin(good, good));
  std::exit(code);
}

Outcome Try(const fs::path& file, const fs::path& good, std::string& how) {
  const pid_t child = ::fork();
  if (child == 0) Load(file, good);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) how = "signal " + std::to_string(WTERMSIG(status));
  if (WIFEXITED(status)) how = "exit code " + std::to_string(WEXITSTATUS(status));
  return WIFEXITED(status) && WEXITSTATUS(status) < kBroken
             ? static_cast<Outcome>(WEXITSTATUS(status))
             : kBroken;
}

int Run(int cases, std::uint64_t seed, const std::vector<fs::path>& plugins) {
  const Folder folder(fs::temp_directory_path());  // code in memory may not be run
  const fs::path file = folder.path() / "damaged.so";
  std::vector<Damage> damages;
  for (const fs::path& plugin : plugins) damages.emplace_back(plugin, seed++);
  int counts[3] = {};
  for (int i = 0; i < cases; ++i) {
    const std::string bytes = damages[static_cast<std::size_t>(i) % damages.size()].Next();
    folder.Put(file.filename(), bytes);
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    std::string how;
    const Outcome outcome = Try(file, plugins.front(), how);
    ++counts[outcome];
    if (outcome != kBroken) continue;
    const std::string kept = "crash-" + std::to_string(seed) + '-' + std::to_string(i) + ".so";
    std::ofstream(kept, std::ios::binary) << bytes;
    std::cout << kept << ": " << how << std::endl;
  }
  std::cout << cases << " damaged plugins: " << counts[kLoaded] << " loaded, " << counts[kRefused]
            << " refused, " << counts[kBroken] << " broke the host" << std::endl;
  const bool both = counts[kLoaded] > 0 && counts[kRefused] > 0;
  return counts[kBroken] == 0 && both ? 0 : 1;
}

}  // namespace
}  // namespace alidade::fuzz

int main(int count, char** arguments) {
  if (count < 4) {
    std::cerr << "usage: fuzz_host_load CASES SEED PLUGIN...\n";
    return 2;
  }
  const std::vector<std::filesystem::path> plugins(arguments + 3, arguments + count);
  return alidade::fuzz::Run(std::atoi(arguments[1]), std::strtoull(arguments[2], nullptr, 10),
                            plugins);
}
