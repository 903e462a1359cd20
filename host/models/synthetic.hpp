// Made-up clouds of known models: to measure on, to test with, to make a back end ready by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <swarmfit/model.hpp>

namespace swarmfit::models {

/// Of each of the three uniform numbers whose sum is the noise of synthetic points.
inline constexpr double kSyntheticSpread = 0.003;

struct SyntheticMix {
  std::size_t models = 4;  ///< >= 1, point i near model i % models if any
  std::size_t tenths = 6;  ///< of the points, near some model: the first of each ten
};

/// `count` points in [-1, 1]^D or thereabouts, row after row: some near a model of the kind, the rest uniform. The same on every standard
/// library. Empty for an own model: nobody here knows what it looks like.
std::vector<float> synthetic_points(ModelType type, std::size_t count, std::uint64_t seed, const SyntheticMix& mix = {});

}  // namespace swarmfit::models
