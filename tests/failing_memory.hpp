// Memory that cannot be had, at a place of the test's choosing. Replaces operator new: for one file of a test executable.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

namespace swarmfit::tests {

/// What operator new is to do, in whatever thread.
struct Memory {
  static inline std::atomic<bool> armed = false;
  static inline std::atomic<long> asked = 0;          ///< since it was armed
  static inline std::atomic<long> fails_at = 0;       ///< this one, from 1 on; 0: none
  static inline std::atomic<bool> stays_out = false;  ///< all that follow fail as well
  static inline std::atomic<long> live = 0;           ///< blocks that are in use

  static void* get(std::size_t bytes, std::size_t alignment) {
    if (armed.load(std::memory_order_relaxed)) {
      const long number = ++asked, last = fails_at;
      if (last > 0 && (number == last || (stays_out && number > last))) throw std::bad_alloc();
    }
    void* block = alignment > alignof(std::max_align_t) ? std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment)
                                                        : std::malloc(bytes > 0 ? bytes : 1);
    if (block == nullptr) throw std::bad_alloc();
    ++live;
    return block;
  }
  /// The same, null where there is none.
  static void* get_or_null(std::size_t bytes, std::size_t alignment) noexcept {
    try {
      return get(bytes, alignment);
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
  }
  static void give(void* block) noexcept {
    if (block == nullptr) return;
    --live;
    std::free(block);
  }
};

/// While it lives the `number`-th request fails, and with `stays_out` each that follows; 0: none, and requests are counted.
class Failing {
 public:
  explicit Failing(long number, bool stays_out = false) {
    Memory::asked = 0;
    Memory::fails_at = number;
    Memory::stays_out = stays_out;
    Memory::armed = true;
  }
  ~Failing() { Memory::armed = false; }
  Failing(const Failing&) = delete;
  Failing& operator=(const Failing&) = delete;
};

/// Of so many requests: the first ones, then ever fewer of them.
inline std::vector<long> places(long requests, double growth, long first = 40) {
  std::vector<long> all;
  for (long k = 1; k <= requests; k = k < first ? k + 1 : static_cast<long>(growth * static_cast<double>(k)) + 1) all.push_back(k);
  return all;
}

}  // namespace swarmfit::tests

void* operator new(std::size_t bytes) { return swarmfit::tests::Memory::get(bytes, 0); }
void* operator new[](std::size_t bytes) { return swarmfit::tests::Memory::get(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return swarmfit::tests::Memory::get(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return swarmfit::tests::Memory::get(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return swarmfit::tests::Memory::get_or_null(bytes, 0); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return swarmfit::tests::Memory::get_or_null(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return swarmfit::tests::Memory::get_or_null(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return swarmfit::tests::Memory::get_or_null(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* block, const std::nothrow_t&) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block, const std::nothrow_t&) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete(void* block, std::align_val_t, const std::nothrow_t&) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block, std::align_val_t, const std::nothrow_t&) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete(void* block) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete(void* block, std::size_t) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block, std::size_t) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete(void* block, std::align_val_t) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block, std::align_val_t) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { swarmfit::tests::Memory::give(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { swarmfit::tests::Memory::give(block); }
