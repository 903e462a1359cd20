#include "host/cli/process.hpp"

#include <cstdlib>

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

}  // namespace swarmfit::cli
