#include "kernels/cpu/swarm_costs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace swarmfit::kernels::cpu {
namespace {

/// Runs of tiles that each keep partial sums, which so stay small whatever the size of the cloud.
constexpr std::size_t kMaxRuns = 128;
/// Of a thread, from which on runs hold several pieces: to take one takes longer then than what is left at the end is worth.
constexpr std::size_t kManyRuns = 128;
/// A tile is cut in so many pieces at most, and cut where threads would else idle for more than this share of all the work.
constexpr std::size_t kMostPieces = 4;
constexpr double kIdle = 0.01;
static_assert(kTileBlocks % kMostPieces == 0);
/// Points x models below which looking at the blocks first cannot pay for the extra passes.
constexpr std::size_t kLeastWork = std::size_t{1} << 18;
/// What a swarm is shared out in where it is pruned. Each group goes through the points by itself, which a few models do not repay; but the
/// same number a thread, and where groups stay fair two of them, so that one which has more to do than others keeps no thread waiting for
/// long.
constexpr std::size_t kGroupsPerThread = 2, kFairGroup = 32, kLeastGroup = 8;
/// Lines and planes below which looking at the blocks first does not pay: it saves these half of their residuals, others nearly all.
constexpr std::size_t kLeastFlat = 32;
/// Share of the residuals above which it does not pay: those of lines and planes are cheap.
constexpr double kPoorFlat = 0.7, kPoorRound = 0.8;
/// Where nothing tells yet whether it pays, so many models of a swarm are to tell, the last, which local samples have no part in; of one
/// that is this many times as large for each thread, as few threads share the trial.
constexpr std::size_t kTrial = 16, kTrialsInSwarm = 4;

std::size_t groups_of(std::size_t models) { return (models + kGroupModels - 1) / kGroupModels; }

/// Consecutive pieces of tiles, all of as many blocks but for the last.
struct Runs {
  /// Of whole tiles, whatever is evaluated and by whom.
  static Runs of_tiles(const PointStore& store) {
    const std::size_t tiles = store.costly_tiles();
    return {store, kTileBlocks, (tiles + kMaxRuns - 1) / kMaxRuns};
  }
  /// Of pieces that make tasks of so many models which the threads can share evenly.
  static Runs for_models(const PointStore& store, std::size_t models) {
    const std::size_t blocks = store.costly_blocks(), groups = groups_of(models), threads = workers();
    const auto idle = [&](std::size_t of_piece) {
      const std::size_t tasks = (blocks + of_piece - 1) / of_piece * groups, each = (tasks + threads - 1) / threads;
      return static_cast<double>(threads * each * of_piece) > (1 + kIdle) * static_cast<double>(blocks * groups);
    };
    std::size_t of_piece = kTileBlocks;
    while (of_piece > kTileBlocks / kMostPieces && threads > 1 && idle(of_piece)) of_piece /= 2;
    const std::size_t pieces = (blocks + of_piece - 1) / of_piece;
    return {store, of_piece, std::max<std::size_t>(1, pieces / (kManyRuns * threads))};
  }

  std::size_t first(std::size_t run) const { return run * length; }
  std::size_t last(std::size_t run) const { return std::min(pieces, (run + 1) * length); }
  TileView piece(const PointStore& store, std::size_t k) const {
    const std::size_t first = k * of_piece, before = first % kTileBlocks;
    TileView view = store.costly_tile(first / kTileBlocks);
    for (const float*& column : view.columns) column += column != nullptr ? before * kBlockPoints : 0;
    view.caps += before * kBlockPoints;
    view.blocks = std::min(of_piece, view.blocks - before);
    return view;
  }
  std::size_t points, of_piece, pieces, length, count;  ///< blocks of a piece, pieces of a run

 private:
  Runs(const PointStore& store, std::size_t blocks, std::size_t in_run)
      : points(store.costly()),
        of_piece(blocks),
        pieces((store.costly_blocks() + of_piece - 1) / of_piece),
        length(in_run),
        count(length == 0 ? 0 : (pieces + length - 1) / length) {}
};

/// body(run, first model, models, member) for each run and group of models; then finish(member).
template <class Body, class Finish>
void for_tasks(const Runs& runs, std::size_t models, Body&& body, Finish&& finish) {
  const std::size_t groups = groups_of(models);
  // Alike in size, and whole register tiles but for the last group.
  constexpr std::size_t kMultiple = 8;
  static_assert(kGroupModels % kMultiple == 0);
  const std::size_t even = groups > 0 ? (models + groups - 1) / groups : 0, size = (even + kMultiple - 1) / kMultiple * kMultiple;
  // All groups over a run one after the other: it is in the caches then.
  const auto one = [&](std::size_t task, std::size_t member) {
    const std::size_t first = task % groups * size;
    body(task / groups, first, std::min(size, models - first), member);
  };
  const std::size_t tasks = runs.count * groups;
  if (worth_sharing(runs.points, models)) {
    for_each_task_as_member(tasks, one, finish);
  } else {
    for (std::size_t task = 0; task < tasks; ++task) one(task, 0);
    finish(0);
  }
}

std::size_t width_of(ModelKind kind) { return static_cast<std::size_t>(traits(kind).coefficient_count); }

/// `models` models of a swarm from `first` on.
CentredSwarm part_of(const CentredSwarm& swarm, std::size_t first, std::size_t models) {
  const std::size_t width = width_of(swarm.kind);
  const auto cutoffs = swarm.cutoffs.empty() ? swarm.cutoffs : swarm.cutoffs.subspan(first, models);
  return {swarm.kind, models, swarm.coefficients.subspan(first * width, models * width), swarm.finite.subspan(first, models), cutoffs};
}

/// Tiles from which on it pays to know the sides of the best model, for a pass over all points whenever there is a better one.
constexpr std::size_t kTilesForSides = 16;
/// Tiles after which models that have lost are looked for.
constexpr std::size_t kStretch = 4;
std::size_t stretches(const PointStore& points) { return (points.costly_tiles() + kStretch - 1) / kStretch; }

/// Largest float that is not above `value`, and one less: sums in float and in double may differ in their last place.
float below(double value) { return std::nextafter(static_cast<float>(value), 0.0F); }

}  // namespace

std::uint64_t SwarmCosts::evaluate(PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs) {
  const Summing summing = points.summing(loss);
  if (!prune_now(points, swarm, summing)) {
    evaluate_all(points, swarm, summing, costs);
    return points.costly() * swarm.count;
  }
  const double poor = traits(swarm.kind).affine ? kPoorFlat : kPoorRound;
  const auto prune = [&](std::size_t first, std::size_t models) {
    return evaluate_open(points, part_of(swarm, first, models), summing, costs.subspan(first, models));
  };
  const auto share = [&](std::uint64_t touched, std::size_t models) {
    return static_cast<double>(touched) / (static_cast<double>(points.costly()) * static_cast<double>(models));
  };
  std::size_t rest = swarm.count;
  std::uint64_t touched = 0;
  if (!pause_.proven() && swarm.count >= kTrialsInSwarm * kTrial * workers()) {
    rest -= kTrial;
    touched = prune(rest, kTrial);
    if (const double tried = share(touched, kTrial); tried > poor) {
      pause_.note(tried, poor);
      evaluate_all(points, part_of(swarm, 0, rest), summing, costs.first(rest));
      return touched + points.costly() * rest;
    }
  }
  touched += prune(0, rest);
  pause_.note(share(touched, swarm.count), poor);
  return touched;
}

bool SwarmCosts::prune_now(const PointStore& points, const CentredSwarm& swarm, const Summing& summing) {
  if (!pruning_ || !traits(swarm.kind).bounded || summing.scale == 0 || points.costly() * swarm.count < kLeastWork) return false;
  if (traits(swarm.kind).affine && swarm.count < kLeastFlat) return false;
  return pause_.now();
}

void SwarmCosts::evaluate_all(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs) {
  if (summing.scale > 0) {
    sum_units(points, swarm, summing, costs);
  } else {
    sum_values(points, swarm, summing.loss, costs);
  }
  for (std::size_t j = 0; j < swarm.count; ++j) {
    if (!swarm.finite[j]) costs[j] = std::numeric_limits<float>::infinity();
  }
}

void SwarmCosts::sum_units(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs) {
  const Runs runs = Runs::for_models(points, swarm.count);
  const std::size_t width = width_of(swarm.kind);
  units_.resize(std::max(units_.size(), workers()));
  ++swarm_;
  const auto settle = [&](Units& own, std::size_t first, std::size_t models) {
    kernels_.settle_units(own.lanes.data() + first * kMaxLanes, models, own.units.data() + first);
  };
  const auto add = [&](std::size_t run, std::size_t first, std::size_t models, std::size_t member) {
    Units& own = units_[member];
    if (own.swarm != swarm_) {
      own.swarm = swarm_;
      own.lanes.assign(swarm.count * kMaxLanes, 0);
      own.held.assign(swarm.count, 0);
      own.units.assign(swarm.count, 0);
    }
    std::size_t& held = own.held[first];
    for (std::size_t piece = runs.first(run); piece < runs.last(run); ++piece) {
      kernels_.add_units(swarm.kind, summing, runs.piece(points, piece), swarm.coefficients.data() + first * width, models, nullptr,
                         own.lanes.data() + first * kMaxLanes);
      if (++held < kernels_.lanes) continue;
      settle(own, first, models);
      held = 0;
    }
  };
  for_tasks(runs, swarm.count, add, [&](std::size_t member) {
    if (Units& own = units_[member]; own.swarm == swarm_) settle(own, 0, swarm.count);
  });
  total_units_.assign(swarm.count, 0);
  for (const Units& own : units_) {
    if (own.swarm != swarm_) continue;
    for (std::size_t j = 0; j < swarm.count; ++j) total_units_[j] += own.units[j];
  }
  for (std::size_t j = 0; j < swarm.count; ++j) {
    costs[j] = static_cast<float>(static_cast<double>(total_units_[j]) / static_cast<double>(summing.scale));
  }
}

void SwarmCosts::sum_values(const PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs) {
  const Runs runs = Runs::of_tiles(points);
  values_.resize(std::max(values_.size(), runs.count));
  for (std::size_t run = 0; run < runs.count; ++run) values_[run].assign(swarm.count, 0.0);
  const auto add = [&](std::size_t run, std::size_t first, std::size_t models, std::size_t) {
    for (std::size_t tile = runs.first(run); tile < runs.last(run); ++tile) {
      kernels_.add_values(swarm.kind, loss, points.costly_tile(tile), swarm.coefficients.data() + first * width_of(swarm.kind), models,
                          values_[run].data() + first);
    }
  };
  for_tasks(runs, swarm.count, add, [](std::size_t) {});
  for (std::size_t j = 0; j < swarm.count; ++j) {
    double cost = 0;
    for (std::size_t run = 0; run < runs.count; ++run) cost += values_[run][j];
    costs[j] = static_cast<float>(cost);
  }
}

std::uint64_t SwarmCosts::evaluate_open(PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs) {
  points.prepare_bounds(kernels_, summing);
  // Each model's blocks are looked at, and what must be touched of them is, by one thread from first to last.
  const std::size_t share = swarm.count / workers(),
                    each = workers() > 1 ? std::clamp(share / kFairGroup, std::size_t{1}, kGroupsPerThread) : 1;
  const std::size_t wanted = each * workers();
  const std::size_t size = std::clamp((swarm.count + wanted - 1) / wanted, kLeastGroup, kGroupModels);
  const std::size_t groups = (swarm.count + size - 1) / size;
  touched_.assign(groups, 0);
  const auto one = [&](std::size_t g) {
    // A thread's own from call to call: what another core wrote last is slow to get at.
    thread_local OpenGroup group;
    const std::size_t first = g * size, models = std::min(size, swarm.count - first);
    touched_[g] = group.evaluate(kernels_, points, part_of(swarm, first, models), summing, costs.subspan(first, models));
  };
  if (worth_sharing(points.costly(), swarm.count)) {
    for_each_task(groups, one);
  } else {
    for (std::size_t g = 0; g < groups; ++g) one(g);
  }
  const auto best = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  if (summing.loss == Loss::truncated_l1 && points.costly_tiles() >= kTilesForSides && costs[best] < least_) {
    least_ = costs[best];
    points.take_sides(kernels_, swarm.kind, swarm.coefficients.data() + best * width_of(swarm.kind));
  }
  const std::uint64_t touched = std::accumulate(touched_.begin(), touched_.end(), std::uint64_t{0});
  return std::min<std::uint64_t>(touched, points.costly() * swarm.count);  // padding was counted as well
}

std::uint64_t OpenGroup::evaluate(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                                  std::span<float> costs) {
  bound(kernels, points, swarm, summing.loss);
  alive_.resize(swarm.count);
  std::iota(alive_.begin(), alive_.end(), 0U);
  std::erase_if(alive_, [&](std::uint32_t j) {
    if (swarm.finite[j]) return false;
    costs[j] = std::numeric_limits<float>::infinity();
    return true;
  });
  touched_ = 0;
  drop_lost(swarm, summing, costs);
  // Blocks that straddle their caps are bounded loosest: they come first.
  add(kernels, points, swarm, summing, &Open::mixed, &PartialBound::mixed, costs);
  add(kernels, points, swarm, summing, &Open::within, &PartialBound::within, costs);
  for (const std::uint32_t j : alive_) {
    costs[j] = static_cast<float>(static_cast<double>(bounds_[j].settled) / static_cast<double>(summing.scale));
  }
  return touched_;
}

void OpenGroup::drop_lost(const CentredSwarm& swarm, const Summing& summing, std::span<float> costs) {
  if (swarm.cutoffs.empty()) return;
  std::erase_if(alive_, [&](std::uint32_t j) {
    const PartialBound& known = bounds_[j];
    const float least = below(static_cast<double>(known.settled) / static_cast<double>(summing.scale) + known.mixed + known.within);
    if (!(least >= swarm.cutoffs[j])) return false;
    costs[j] = least;
    return true;
  });
}

void OpenGroup::bound(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, Loss loss) {
  const std::size_t width = width_of(swarm.kind);
  const float* coefficients = swarm.coefficients.data();
  const std::size_t models = swarm.count;
  slack_.resize(models);
  for (std::size_t j = 0; j < models; ++j) slack_[j] = residual_rounding(swarm.kind, coefficients + j * width, points.reach().data());
  parts_.assign(stretches(points) * models, {});
  open_.resize(points.costly_tiles() * models);
  for (std::size_t tile = 0; tile < points.costly_tiles(); ++tile) {
    kernels.bound(swarm.kind, loss, points.bounds(tile), coefficients, slack_.data(), models, open_.data() + tile * models,
                  parts_.data() + tile / kStretch * models);
  }
  bounds_.assign(models, {});
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    PartialBound& all = bounds_[k % models];
    all.settled += parts_[k].settled;
    all.within += parts_[k].within;
    all.mixed += parts_[k].mixed;
  }
}

void OpenGroup::add(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                    std::uint8_t Open::*blocks, double PartialBound::*least, std::span<float> costs) {
  for (std::size_t stretch = 0; stretch < stretches(points) && !alive_.empty(); ++stretch) {
    add_stretch(kernels, points, swarm, summing, blocks, stretch);
    const bool last = stretch + 1 == stretches(points);
    for (const std::uint32_t j : alive_) bounds_[j].*least = last ? 0.0 : bounds_[j].*least - parts_[stretch * swarm.count + j].*least;
    drop_lost(swarm, summing, costs);
  }
}

void OpenGroup::add_stretch(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                            std::uint8_t Open::*blocks, std::size_t stretch) {
  const std::size_t width = width_of(swarm.kind);
  coefficients_.resize(alive_.size() * width);
  for (std::size_t a = 0; a < alive_.size(); ++a) {
    std::copy_n(swarm.coefficients.data() + alive_[a] * width, width, coefficients_.data() + a * width);
  }
  lanes_.assign(alive_.size() * kMaxLanes, 0);
  units_.assign(alive_.size(), 0);
  std::size_t held = 0;  // tiles
  std::array<std::uint8_t, kGroupModels> bits{};
  const std::size_t last = std::min(points.costly_tiles(), (stretch + 1) * kStretch);
  for (std::size_t tile = stretch * kStretch; tile < last; ++tile) {
    unsigned any = 0;
    for (std::size_t a = 0; a < alive_.size(); ++a) {
      bits[a] = open_[tile * swarm.count + alive_[a]].*blocks;
      any |= bits[a];
      touched_ += static_cast<std::uint64_t>(std::popcount(bits[a])) * kBlockPoints;
    }
    if (any == 0) continue;
    kernels.add_units(swarm.kind, summing, points.costly_tile(tile), coefficients_.data(), alive_.size(), bits.data(), lanes_.data());
    if (++held < kernels.lanes) continue;
    kernels.settle_units(lanes_.data(), alive_.size(), units_.data());
    held = 0;
  }
  kernels.settle_units(lanes_.data(), alive_.size(), units_.data());
  for (std::size_t a = 0; a < alive_.size(); ++a) bounds_[alive_[a]].settled += units_[a];
}

}  // namespace swarmfit::kernels::cpu
