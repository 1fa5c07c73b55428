// SPDX-License-Identifier: Apache-2.0
#include <elf.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "host_fixture.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

/// Damaged copies of a good plugin, the same in every run: most damage is to the headers, where a
/// loader trusts offsets.
class FuzzTest : public HostTest {
 protected:
  FuzzTest() {
    std::ifstream file(Built("good"), std::ios::binary);
    good_.assign(std::istreambuf_iterator<char>(file), {});
    Elf64_Ehdr header;
    std::memcpy(&header, good_.data(), sizeof(header));
    sections_ = header.e_shoff;
    std::vector<Elf64_Shdr> table(header.e_shnum);
    std::memcpy(table.data(), good_.data() + sections_, table.size() * sizeof(Elf64_Shdr));
    for (const Elf64_Shdr& one : table) {
      // What the dynamic loader walks; not the code.
      if (one.sh_type != SHT_NOBITS && one.sh_size >= 8 && (one.sh_flags & SHF_ALLOC) != 0 &&
          (one.sh_flags & SHF_EXECINSTR) == 0 && one.sh_type != SHT_PROGBITS) {
        walked_.push_back(one);
      }
    }
  }
  std::size_t Below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }

  std::string Damaged() {
    std::string bytes = good_;
    const std::size_t kind = Below(10);
    if (kind == 0) bytes.resize(Below(bytes.size()));
    for (std::size_t flips = 1 + Below(6); flips > 0 && !bytes.empty(); --flips) {
      std::size_t at = Below(bytes.size());
      if (kind < 5) at = Below(0x400);
      if (kind >= 5 && kind < 7) at = sections_ + Below(good_.size() - sections_);
      if (kind == 7 || kind == 8) {
        const Elf64_Shdr& one = walked_[Below(walked_.size())];
        at = one.sh_offset + 8 * Below(one.sh_size / 8);
        if (Below(2) == 0 && at + 8 <= bytes.size()) {
          const std::uint64_t values[] = {0,        1,     0xff,       0xffff,       1u << 20,
                                          1u << 31, ~0ull, 1ull << 47, ~0ull - 4095, engine_()};
          std::memcpy(bytes.data() + at, &values[Below(std::size(values))], 8);
          continue;
        }
        at += Below(8);
      }
      if (at < bytes.size()) bytes[at] = static_cast<char>(engine_());
    }
    return bytes;
  }
  fs::path Write(const std::string& bytes) const {
    const fs::path file = folder_ / "fuzzed.so";
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

  std::string good_;
  std::size_t sections_ = 0;
  std::vector<Elf64_Shdr> walked_;
  std::mt19937_64 engine_{20260101};
};

TEST_F(FuzzTest, TheBuildTagReaderRefusesOrReads) {
  int read = 0;
  for (int i = 0; i < 3000; ++i) {
    try {
      static_cast<void>(ReadBuildTag(Write(Damaged())));
      ++read;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kPlugin);
    }
  }
  EXPECT_GT(read, 0);
  EXPECT_LT(read, 2500) << "most damage is to headers and must be noticed";
}

/// 0: loaded, 1: refused; anything else is the death of the host.
int LoadInAChild(const fs::path& file) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      PluginHost host({file});
      _exit(0);
    } catch (const Error& e) {
      _exit(e.code() == ExitCode::kPlugin ? 1 : 2);
    } catch (...) {
      _exit(3);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST_F(FuzzTest, TheHostSurvivesDamagedPlugins) {
  const int cases = testing::kSanitized ? 75 : 300;  // processes that start slowly
  int counts[2] = {};
  for (int i = 0; i < cases; ++i) {
    const std::string bytes = Damaged();
    const int outcome = LoadInAChild(Write(bytes));
    ASSERT_LE(outcome, 1) << "case " << i << " ended the host";
    ++counts[outcome];
  }
  EXPECT_GT(counts[0], 0) << "damage to unused bytes goes unnoticed";
  EXPECT_GT(counts[1], cases / 3);
}

}  // namespace
}  // namespace alidade
