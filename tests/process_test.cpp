// What the command asks of its process.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <gtest/gtest.h>

#include "host/cli/process.hpp"

namespace swarmfit::cli {
namespace {

/// The system's flags of the mapping that an address lies in; empty where there are none to read.
std::string flags_at(const void* address) {
  std::ifstream maps("/proc/self/smaps");
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  bool inside = false;
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t first = 0, last = 0;
    char dash = 0;
    std::istringstream head(line);
    if (head >> std::hex >> first >> dash >> last && dash == '-') inside = first <= wanted && wanted < last;
    if (inside && line.starts_with("VmFlags:")) return line + " ";
  }
  return {};
}

TEST(Process, LargeArraysLieInLargePages) {
#if defined(__SANITIZE_ADDRESS__) || !defined(__GLIBC__)
  GTEST_SKIP() << "another allocator";
#endif
  if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage")) GTEST_SKIP() << "no large pages on this system";
  settle_process();
  const std::vector<char> large(std::size_t{16} << 20, 1);
  const std::string flags = flags_at(&large[large.size() / 2]);
  EXPECT_NE(flags.find(" hg "), std::string::npos) << flags;
}

TEST(Process, WhatIsThrownIsToldInWords) {
  const Error memory = error_of(std::bad_alloc());
  EXPECT_EQ(memory.kind, Error::Kind::out_of_memory);
  EXPECT_EQ(memory.message, "out of memory");
  const Error thread = error_of(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)));
  EXPECT_EQ(thread.kind, Error::Kind::out_of_memory);
  EXPECT_TRUE(thread.message.starts_with("a thread cannot be started: ")) << thread.message;
  const Error other = error_of(std::runtime_error("a word"));
  EXPECT_EQ(other.kind, Error::Kind::bad_input);
  EXPECT_EQ(other.message, "a word");
}

}  // namespace
}  // namespace swarmfit::cli
