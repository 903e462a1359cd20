#include "kernels/cpu/swarm_costs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace swarmfit::kernels::cpu {
namespace {

/// Runs of tiles; few, so that partial sums stay small whatever the size of the cloud.
constexpr std::size_t kMaxRuns = 128;
/// Points x models below which looking at the blocks first cannot pay for the extra passes.
constexpr std::size_t kLeastWork = std::size_t{1} << 18;
/// Share of the residuals computed above which pruning pauses, for twice as long each time up to the longest pause.
constexpr double kPoorShare = 0.8;
constexpr int kLongestPause = 32;

struct Runs {
  explicit Runs(const PointStore& store) : points(store.finite()), tiles(store.tiles()), length((tiles + kMaxRuns - 1) / kMaxRuns) {
    count = length == 0 ? 0 : (tiles + length - 1) / length;
  }
  std::size_t first(std::size_t run) const { return run * length; }
  std::size_t last(std::size_t run) const { return std::min(tiles, (run + 1) * length); }
  std::size_t points, tiles, length, count;
};

std::size_t groups_of(std::size_t models) { return (models + kGroupModels - 1) / kGroupModels; }

/// body(task, run, first model, models) for each run of tiles and group of models.
template <class Body>
void for_tasks(const Runs& runs, std::size_t models, Body&& body) {
  const std::size_t groups = groups_of(models), tasks = runs.count * groups;
  // Alike in size, and whole register tiles but for the last group.
  constexpr std::size_t kMultiple = 8;
  static_assert(kGroupModels % kMultiple == 0);
  const std::size_t even = groups > 0 ? (models + groups - 1) / groups : 0, size = (even + kMultiple - 1) / kMultiple * kMultiple;
  const auto one = [&](std::size_t task) {
    const std::size_t first = task % groups * size;
    body(task, task / groups, first, std::min(size, models - first));
  };
  if (worth_sharing(runs.points, models)) {
    for_each_task(tasks, one);
  } else {
    for (std::size_t task = 0; task < tasks; ++task) one(task);
  }
}

std::size_t width_of(ModelKind kind) { return static_cast<std::size_t>(traits(kind).coefficient_count); }

/// Largest float that is not above `value`, and one less: sums in float and in double may differ in their last place.
float below(double value) { return std::nextafter(static_cast<float>(value), 0.0F); }

}  // namespace

void SwarmCosts::forget() noexcept { pause_ = last_pause_ = 0; }

std::uint64_t SwarmCosts::evaluate(PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs) {
  const Summing summing = points.summing(loss);
  if (!prune_now(points, swarm, summing)) return evaluate_all(points, swarm, summing, costs);
  const std::uint64_t touched = evaluate_open(points, swarm, summing, costs);
  const double share = static_cast<double>(touched) / (static_cast<double>(points.finite()) * static_cast<double>(swarm.count));
  last_pause_ = share > kPoorShare ? std::clamp(2 * last_pause_, 1, kLongestPause) : 0;
  pause_ = last_pause_;
  return touched;
}

bool SwarmCosts::prune_now(const PointStore& points, const CentredSwarm& swarm, const Summing& summing) {
  if (!pruning_ || !traits(swarm.kind).bounded || summing.scale == 0 || points.finite() * swarm.count < kLeastWork) return false;
  if (pause_ > 0) {
    --pause_;
    return false;
  }
  return true;
}

std::uint64_t SwarmCosts::evaluate_all(const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                                       std::span<float> costs) {
  const Runs runs(points);
  partial_.assign(runs.count * swarm.count, {});
  for_tasks(runs, swarm.count, [&](std::size_t, std::size_t run, std::size_t first, std::size_t models) {
    for (std::size_t tile = runs.first(run); tile < runs.last(run); ++tile) {
      kernels_.add_costs(swarm.kind, summing, points.tile(tile), swarm.coefficients.data() + first * width_of(swarm.kind), models,
                         partial_.data() + run * swarm.count + first);
    }
  });
  for (std::size_t j = 0; j < swarm.count; ++j) {
    PartialCost total;
    for (std::size_t run = 0; run < runs.count; ++run) {
      total.units += partial_[run * swarm.count + j].units;
      total.value += partial_[run * swarm.count + j].value;
    }
    const double cost = summing.scale > 0 ? static_cast<double>(total.units) / static_cast<double>(summing.scale) : total.value;
    costs[j] = swarm.finite[j] ? static_cast<float>(cost) : std::numeric_limits<float>::infinity();
  }
  return points.finite() * swarm.count;
}

std::uint64_t SwarmCosts::evaluate_open(PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs) {
  points.prepare_bounds(kernels_, summing);
  bound_all(points, swarm, summing.loss);
  alive_.resize(swarm.count);
  std::iota(alive_.begin(), alive_.end(), 0U);
  std::erase_if(alive_, [&](std::uint32_t j) {
    if (swarm.finite[j]) return false;
    costs[j] = std::numeric_limits<float>::infinity();
    return true;
  });
  const auto drop_lost = [&] {
    std::erase_if(alive_, [&](std::uint32_t j) {
      const float least = below(static_cast<double>(units_[j]) / static_cast<double>(summing.scale) + bound_mixed_[j] + bound_within_[j]);
      if (swarm.cutoffs.empty() || !(least >= swarm.cutoffs[j])) return false;
      costs[j] = least;
      return true;
    });
  };
  // Blocks that straddle their caps are bounded loosest: they come first.
  drop_lost();
  std::uint64_t touched = add_open(points, swarm, summing, &Open::mixed);
  for (const std::uint32_t j : alive_) bound_mixed_[j] = 0;
  drop_lost();
  touched += add_open(points, swarm, summing, &Open::within);
  for (const std::uint32_t j : alive_) {
    costs[j] = static_cast<float>(static_cast<double>(units_[j]) / static_cast<double>(summing.scale));
  }
  return std::min<std::uint64_t>(touched, points.finite() * swarm.count);  // padding was counted as well
}

void SwarmCosts::bound_all(const PointStore& points, const CentredSwarm& swarm, Loss loss) {
  const std::size_t width = width_of(swarm.kind);
  slack_.resize(swarm.count);
  for (std::size_t j = 0; j < swarm.count; ++j) {
    slack_[j] = residual_rounding(swarm.kind, swarm.coefficients.data() + j * width, points.reach().data());
  }
  const Runs runs(points);
  bounds_.assign(runs.count * swarm.count, {});
  open_.resize(points.tiles() * swarm.count);
  for_tasks(runs, swarm.count, [&](std::size_t, std::size_t run, std::size_t first, std::size_t models) {
    for (std::size_t tile = runs.first(run); tile < runs.last(run); ++tile) {
      kernels_.bound(swarm.kind, loss, points.bounds(tile), swarm.coefficients.data() + first * width, slack_.data() + first, models,
                     open_.data() + tile * swarm.count + first, bounds_.data() + run * swarm.count + first);
    }
  });
  units_.assign(swarm.count, 0);
  bound_within_.assign(swarm.count, 0.0);
  bound_mixed_.assign(swarm.count, 0.0);
  for (std::size_t run = 0; run < runs.count; ++run) {
    for (std::size_t j = 0; j < swarm.count; ++j) {
      const PartialBound& bound = bounds_[run * swarm.count + j];
      units_[j] += bound.settled;
      bound_within_[j] += bound.within;
      bound_mixed_[j] += bound.mixed;
    }
  }
}

std::uint64_t SwarmCosts::add_open(const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                                   std::uint8_t Open::*blocks) {
  if (alive_.empty()) return 0;
  const std::size_t width = width_of(swarm.kind);
  const Runs runs(points);
  alive_coefficients_.resize(alive_.size() * width);
  for (std::size_t a = 0; a < alive_.size(); ++a) {
    std::copy_n(swarm.coefficients.data() + alive_[a] * width, width, alive_coefficients_.data() + a * width);
  }
  partial_.assign(runs.count * alive_.size(), {});
  touched_.assign(runs.count * groups_of(alive_.size()), 0);
  for_tasks(runs, alive_.size(), [&](std::size_t task, std::size_t run, std::size_t first, std::size_t models) {
    std::array<std::uint8_t, kGroupModels> bits{};
    for (std::size_t tile = runs.first(run); tile < runs.last(run); ++tile) {
      unsigned any = 0;
      for (std::size_t m = 0; m < models; ++m) {
        bits[m] = open_[tile * swarm.count + alive_[first + m]].*blocks;
        any |= bits[m];
        touched_[task] += static_cast<std::uint64_t>(std::popcount(bits[m])) * kBlockPoints;
      }
      if (any == 0) continue;
      kernels_.add_open_costs(swarm.kind, summing, points.tile(tile), alive_coefficients_.data() + first * width, models, bits.data(),
                              partial_.data() + run * alive_.size() + first);
    }
  });
  for (std::size_t run = 0; run < runs.count; ++run) {
    for (std::size_t a = 0; a < alive_.size(); ++a) units_[alive_[a]] += partial_[run * alive_.size() + a].units;
  }
  return std::accumulate(touched_.begin(), touched_.end(), std::uint64_t{0});
}

}  // namespace swarmfit::kernels::cpu
