// SPDX-License-Identifier: Apache-2.0
//
// To be preloaded: one call of the C library fails, and all others do what they do.
//
//   FAIL_CALL  malloc, open, write, fsync, rename or fork, with those of its kind
//   FAIL_FILE  two 64-bit numbers: which of these calls fails, from 1 on, and, afterwards, how many
//              there were, by the program and by what it forks, once main has begun
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

enum Call { kNone, kMalloc, kOpen, kWrite, kFsync, kRename, kFork };

struct Shared {
  std::int64_t at;
  std::atomic<std::int64_t> count;
};

Call g_call = kNone;
Shared* g_shared = nullptr;

/// OpenSSL 3.0 takes locks that it had no memory for: a crash of its own.
bool IsOfOpenSsl(const void* caller) {
  Dl_info of{};
  return dladdr(caller, &of) != 0 && std::strstr(of.dli_fname, "/libcrypto") != nullptr;
}

bool Fails(Call call, int error, const void* caller = nullptr) {
  if (call != g_call || g_shared->count.fetch_add(1) + 1 != g_shared->at) return false;
  if (caller != nullptr && IsOfOpenSsl(caller)) return false;
  errno = error;
  return true;
}

template <class Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

void Begin() {
  constexpr const char* kNames[] = {"", "malloc", "open", "write", "fsync", "rename", "fork"};
  const char* const name = std::getenv("FAIL_CALL");
  const char* const path = std::getenv("FAIL_FILE");
  if (name == nullptr || path == nullptr) return;
  const auto file = static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, O_RDWR | O_CLOEXEC));
  void* const memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  unsetenv("LD_PRELOAD");  // not for gnuplot
  if (memory == MAP_FAILED) return;
  g_shared = static_cast<Shared*>(memory);
  for (int call = kMalloc; call <= kFork; ++call) {
    if (std::strcmp(kNames[call], name) == 0) g_call = static_cast<Call>(call);
  }
}

int (*g_main)(int, char**, char**) = nullptr;

int Main(int count, char** arguments, char** environment) {
  Begin();
  return g_main(count, arguments, environment);
}

int OpenAt(int folder, const char* path, int flags, va_list rest) {
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  if (Fails(kOpen, EMFILE)) return -1;
  return static_cast<int>(syscall(SYS_openat, folder, path, flags, mode));
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);

#define PRELOADED __attribute__((visibility("default")))

PRELOADED int __libc_start_main(int (*main)(int, char**, char**), int count, char** arguments,
                                void (*init)(), void (*end)(), void (*loader_end)(), void* stack) {
  using Start = int(decltype(main), int, char**, void (*)(), void (*)(), void (*)(), void*);
  g_main = main;
  return Next<Start>("__libc_start_main")(Main, count, arguments, init, end, loader_end, stack);
}

PRELOADED void* malloc(size_t size) {
  return Fails(kMalloc, ENOMEM, __builtin_return_address(0)) ? nullptr : __libc_malloc(size);
}
PRELOADED void* calloc(size_t count, size_t size) {
  return Fails(kMalloc, ENOMEM, __builtin_return_address(0)) ? nullptr : __libc_calloc(count, size);
}
PRELOADED void* realloc(void* memory, size_t size) {
  return Fails(kMalloc, ENOMEM, __builtin_return_address(0)) ? nullptr
                                                             : __libc_realloc(memory, size);
}

PRELOADED int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = OpenAt(AT_FDCWD, path, flags, rest);
  va_end(rest);
  return file;
}
PRELOADED int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = OpenAt(AT_FDCWD, path, flags, rest);
  va_end(rest);
  return file;
}
PRELOADED int openat(int folder, const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int file = OpenAt(folder, path, flags, rest);
  va_end(rest);
  return file;
}
PRELOADED FILE* fopen(const char* path, const char* mode) {
  return Fails(kOpen, EMFILE) ? nullptr
                              : Next<FILE*(const char*, const char*)>("fopen")(path, mode);
}
PRELOADED FILE* fopen64(const char* path, const char* mode) {
  return Fails(kOpen, EMFILE) ? nullptr
                              : Next<FILE*(const char*, const char*)>("fopen64")(path, mode);
}

PRELOADED ssize_t write(int file, const void* data, size_t size) {
  return Fails(kWrite, ENOSPC) ? -1 : syscall(SYS_write, file, data, size);
}
PRELOADED int fsync(int /*file*/) { return Fails(kFsync, EIO) ? -1 : 0; }
PRELOADED int rename(const char* from, const char* to) {
  return Fails(kRename, EACCES)
             ? -1
             : static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
PRELOADED pid_t fork() { return Fails(kFork, EAGAIN) ? -1 : Next<pid_t()>("fork")(); }

}  // extern "C"
