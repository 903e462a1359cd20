// What a fit of a large cloud takes: at most three times the cloud's own bytes, and 64 MiB for the program.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

/// Two planes and points anywhere, by a generator of our own so that it takes no time.
std::vector<float> large_cloud(std::size_t points) {
  std::vector<float> values(3 * points);
  std::uint64_t state = 1;
  const auto next = [&] {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<float>(state >> 40U) / static_cast<float>(1U << 24U);
  };
  for (std::size_t i = 0; i < points; ++i) {
    float* p = &values[3 * i];
    for (int d = 0; d < 3; ++d) p[d] = 4 * next() - 2;
    if (i % 3 < 2) p[2 * (i % 3)] = 0.01F * next();
  }
  return values;
}

/// Of the command's whole life [MiB]; below 0 if it failed.
double peak_of(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  int status = 0;
  rusage usage{};
  if (child < 0 || ::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) return -1;
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

TEST(Memory, AFitOfALargeCloudTakesThreeTimesItsBytes) {
#if defined(__SANITIZE_ADDRESS__) || !defined(__GLIBC__)
  GTEST_SKIP() << "another allocator";
#endif
  constexpr std::size_t kPoints = 3'000'000;
  const tests::TemporaryFolder folder;
  std::string file = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + std::to_string(kPoints) +
                     "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(kPoints) + "\nDATA binary\n";
  const std::vector<float> values = large_cloud(kPoints);
  const std::size_t bytes = values.size() * sizeof(float), header = file.size();
  file.resize(header + bytes);
  std::memcpy(file.data() + header, values.data(), bytes);
  const std::string cloud = folder.put("large.pcd", file).string();
  for (const char* preset : {"fast", "paper"}) {
    const double peak = peak_of({SWARMFIT_COMMAND, "fit", "plane", cloud, "--backend", "cpu", "--threads", "2", "--preset", preset,
                                 "--iterations", "3", "--max-models", "2", "--quiet", "--json", (folder / "result.json").string()});
    EXPECT_GT(peak, 0) << preset;
    EXPECT_LT(peak, 3.0 * static_cast<double>(bytes) / (1 << 20) + 64) << preset;
    RecordProperty(preset, std::to_string(peak));
  }
}

}  // namespace
}  // namespace swarmfit
