// Counter-based random numbers: what is drawn depends on where it is used, never on which thread draws it or when.
#pragma once

#include <array>
#include <cstdint>

#include <Random123/philox.h>

namespace swarmfit::swarm {

/// What a number is for; part of the counter.
enum class Draw : std::uint32_t { sample = 1, move = 2, roulette = 3, subset = 4 };

class Random {
 public:
  explicit Random(std::uint64_t seed) : key_{{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}} {}

  /// Four independent 32-bit words of one place in the run.
  std::array<std::uint32_t, 4> words(Draw purpose, std::uint32_t round, std::uint32_t step, std::uint32_t particle) const {
    const r123::Philox4x32::ctr_type counter{{particle, step, round, static_cast<std::uint32_t>(purpose)}};
    const auto out = r123::Philox4x32{}(counter, key_);
    return {out[0], out[1], out[2], out[3]};
  }
  /// Uniform in [0, 1).
  static double unit(std::uint32_t word) { return word * 0x1p-32; }
  /// Uniform in {0, ..., n - 1}, n >= 1.
  static std::size_t below(std::uint32_t word, std::size_t n) {
    return static_cast<std::size_t>((static_cast<std::uint64_t>(word) * n) >> 32);
  }

 private:
  r123::Philox4x32::key_type key_;
};

}  // namespace swarmfit::swarm
