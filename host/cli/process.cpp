#include "host/cli/process.hpp"

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <system_error>

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>
#if defined(__GLIBC__)
#include <malloc.h>
#include <sys/mman.h>
#endif

namespace swarmfit::cli {

namespace {

/// What the first arrays are put into comes in large pages where the system gives them on request: a small one costs a fault of a
/// microsecond or two for each 4 KiB. Takes no memory before it is written to.
void ask_for_large_pages() {
#if defined(__GLIBC__) && defined(MADV_HUGEPAGE)
  constexpr std::size_t kRoom = std::size_t{96} << 20, kPage = std::size_t{2} << 20;  // [bytes]
  void* room = std::malloc(kRoom);
  if (room == nullptr) return;
  void* inside = room;
  std::size_t left = kRoom;
  if (std::align(kPage, kPage, inside, left) != nullptr) madvise(inside, left / kPage * kPage, MADV_HUGEPAGE);
  std::free(room);  // to the top of the heap, where what comes next is taken from
#endif
}

/// With a standard stream closed, the next file that is opened would take its place: summaries would go into a result. What stands here
/// instead cannot be written to.
void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) == -1 && ::open("/dev/null", O_RDONLY) == -1) return;
  }
}

}  // namespace

void settle_process() {
  hold_standard_streams();
#if defined(__GLIBC__)
  constexpr int kLarge = 1 << 30;  // [bytes]
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, kLarge);
#endif
  ask_for_large_pages();
  using Shutdown = int (*)();
  // POSIX: what dlsym gives for a function may be called as one.
  if (void* found = dlsym(RTLD_DEFAULT, "blas_thread_shutdown_")) reinterpret_cast<Shutdown>(found)();
}

Error error_of(const std::exception& thrown) {
  if (dynamic_cast<const std::bad_alloc*>(&thrown) != nullptr) return {Error::Kind::out_of_memory, "out of memory"};
  const auto* system = dynamic_cast<const std::system_error*>(&thrown);
  if (system != nullptr && system->code() == std::errc::resource_unavailable_try_again)
    return {Error::Kind::out_of_memory, "a thread cannot be started: " + system->code().message()};
  return {Error::Kind::bad_input, thrown.what()};
}

void settle_large_input(std::size_t bytes) {
#if defined(__GLIBC__)
  constexpr std::size_t kLarge = std::size_t{1} << 25;
  if (bytes < kLarge) return;
  mallopt(M_MMAP_THRESHOLD, static_cast<int>(kLarge / 2));
  malloc_trim(0);
#else
  static_cast<void>(bytes);
#endif
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
