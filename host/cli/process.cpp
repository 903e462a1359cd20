#include "host/cli/process.hpp"

#include <cstdlib>
#include <filesystem>

#include <dlfcn.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace swarmfit::cli {

void settle_process() {
#if defined(__GLIBC__)
  constexpr int kLarge = 1 << 30;  // [bytes]
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, kLarge);
#endif
  using Shutdown = int (*)();
  // POSIX: what dlsym gives for a function may be called as one.
  if (void* found = dlsym(RTLD_DEFAULT, "blas_thread_shutdown_")) reinterpret_cast<Shutdown>(found)();
}

namespace {

std::string& command() {
  static std::string remembered;
  return remembered;
}

/// A word that a POSIX shell reads as it is.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace

void remember_command(int argc, const char* const* argv) {
  command() = argc > 0 ? std::filesystem::path(argv[0]).filename().string() : "swarmfit";
  for (int k = 1; k < argc; ++k) command() += " " + quoted(argv[k]);
}

const std::string& remembered_command() { return command(); }

}  // namespace swarmfit::cli
