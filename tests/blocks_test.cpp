// Pruning changes nothing: with it, a cost below its cutoff is the same bytes as without, and any other lies between cutoff and truth.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/blocks.hpp"
#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/morton_order.hpp"

namespace swarmfit::kernels {
namespace {

struct Scene {
  ModelKind kind = ModelKind::plane;
  std::vector<float> points;
  std::vector<float> caps;
  std::vector<double> swarm;
  std::size_t particles = 0;

  int dimension() const { return traits(kind).dimension; }
  PointsView view() const {
    const auto width = static_cast<std::size_t>(dimension());
    return {points.data(), Scalar::float32, dimension(), points.size() / width, sizeof(float) * width};
  }
};

using Uniform = std::function<double(double, double)>;

bool is_flat(ModelKind kind) { return traits(kind).affine; }

void normalise(double* v, std::size_t width) {
  double square = 0;
  for (std::size_t c = 0; c < width; ++c) square += v[c] * v[c];
  for (std::size_t c = 0; c < width; ++c) v[c] /= std::sqrt(square) + 1e-12;
}

/// A surface through the cube of half width 2 about (origin, origin, ...); where it is round, of any size from a pea's to nearly flat.
std::vector<double> random_surface(ModelKind kind, double origin, const Uniform& uniform) {
  const auto width = static_cast<std::size_t>(traits(kind).dimension);
  std::vector<double> p(static_cast<std::size_t>(traits(kind).parameter_count));
  for (double& v : p) v = uniform(-1, 1);
  if (is_flat(kind)) {
    normalise(p.data(), width);
    for (std::size_t c = 0; c < width; ++c) p[width] -= p[c] * origin;
    return p;
  }
  if (kind == ModelKind::cylinder) normalise(p.data() + 3, 3);
  const double radius = p.back() = std::pow(10.0, uniform(-1.5, 2));
  for (std::size_t c = 0; c < width; ++c) p[c] = origin + p[c] * std::max(1.0, radius);
  return p;
}

/// To where x is `off` from the surface, along the normal.
void pull(ModelKind kind, const std::vector<double>& p, double off, std::vector<double>& x) {
  const std::size_t width = x.size();
  double distance = -off;
  std::vector<double> normal(width);
  if (is_flat(kind)) {
    distance += p[width];
    for (std::size_t c = 0; c < width; ++c) distance += (normal[c] = p[c]) * x[c];
  } else {
    double along = 0, length = 0;
    for (std::size_t c = 0; c < width; ++c) normal[c] = x[c] - p[c];
    for (std::size_t c = 0; kind == ModelKind::cylinder && c < 3; ++c) along += normal[c] * p[3 + c];
    for (std::size_t c = 0; kind == ModelKind::cylinder && c < 3; ++c) normal[c] -= along * p[3 + c];
    for (const double v : normal) length = std::hypot(length, v);
    for (double& v : normal) v /= length;
    distance += length - p.back();
  }
  for (std::size_t c = 0; c < width; ++c) x[c] -= distance * normal[c];
}

/// Patches of surfaces of all sizes with noise, clutter, duplicates, points that are not finite; caps of several shapes; models near the
/// patches, far from them, and anywhere.
Scene random_scene(ModelKind kind, unsigned seed, std::size_t count, std::size_t particles) {
  std::mt19937 engine(seed);
  const Uniform uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); };
  Scene scene;
  scene.kind = kind;
  scene.particles = particles;
  const auto width = static_cast<std::size_t>(scene.dimension());
  const double origin = seed % 4 == 3 ? 1000.0 : 0.0;
  const double noise = std::pow(10.0, uniform(-5, -1.5));

  std::vector<std::vector<double>> surfaces;
  for (int k = 0; k < 4; ++k) surfaces.push_back(random_surface(kind, origin, uniform));

  const double clutter = uniform(0, 0.6);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> x(width);
    for (double& v : x) v = origin + uniform(-2, 2);
    if (uniform(0, 1) > clutter) pull(kind, surfaces[seed % 3 == 0 ? 0 : i % surfaces.size()], uniform(-noise, noise), x);
    if (uniform(0, 1) < 0.01) x[0] = std::numeric_limits<double>::quiet_NaN();
    for (const double v : x) scene.points.push_back(static_cast<float>(v));
  }
  for (std::size_t i = 0; i + 1 < count / 10; ++i) {
    for (std::size_t c = 0; c < width; ++c) scene.points[(i + 1) * width + c] = scene.points[c];
  }

  const double tau = std::pow(10.0, uniform(-3, -0.5));
  for (std::size_t i = 0; i < count; ++i) {
    double cap = tau;
    if (seed % 5 == 1) cap = uniform(0, tau);
    if (seed % 5 == 2 && i % 2 == 0) cap = 0;
    if (seed % 5 == 4) cap = i < count / 3 ? 0 : tau * (i % 7 == 0 ? 3 : 1);
    scene.caps.push_back(static_cast<float>(cap));
  }
  for (std::size_t j = 0; j < particles; ++j) {
    std::vector<double> model = j % 3 == 0 ? random_surface(kind, origin, uniform) : surfaces[j % surfaces.size()];
    const double shake = j % 3 == 2 ? std::pow(10.0, uniform(-5, -1)) : 0;
    for (double& v : model) v += shake * uniform(-1, 1);
    scene.swarm.insert(scene.swarm.end(), model.begin(), model.end());
  }
  return scene;
}

std::unique_ptr<FitnessEvaluator> make(bool pruning, int threads = 2, const std::string& simd = "") {
  EvaluatorOptions options;
  options.pruning = pruning;
  options.threads = threads;
  options.simd = simd;
  auto made = make_cpu_evaluator(options);
  EXPECT_TRUE(made);
  return std::move(*made);
}

std::vector<float> costs_of(FitnessEvaluator& evaluator, const Scene& scene, Loss loss, const std::vector<float>& cutoffs) {
  std::vector<float> costs(scene.particles, -1.0F);
  const auto done = evaluator.evaluate({scene.kind, scene.particles, scene.swarm}, loss, cutoffs, costs);
  EXPECT_TRUE(done) << done.error().message;
  return costs;
}

void load(FitnessEvaluator& evaluator, const Scene& scene) {
  ASSERT_TRUE(evaluator.set_points(scene.view()));
  ASSERT_TRUE(evaluator.set_caps(scene.caps));
}

std::vector<ModelKind> bounded_kinds() {
  std::vector<ModelKind> kinds(std::begin(kModelKinds), std::end(kModelKinds));
  std::erase_if(kinds, [](ModelKind kind) { return !traits(kind).bounded; });
  return kinds;
}

class Pruning : public testing::TestWithParam<std::tuple<ModelKind, Loss>> {};

TEST_P(Pruning, CostsBelowTheirCutoffsAreTheSameBytes) {
  const auto [kind, loss] = GetParam();
  std::uint64_t touched = 0, asked = 0;
  std::size_t lost = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Scene scene = random_scene(kind, seed, 12000 + 577 * seed, 96 + seed % 5);
    const auto brute = make(false), pruned = make(true);
    load(*brute, scene);
    load(*pruned, scene);
    const std::vector<float> truth = costs_of(*brute, scene, loss, {});
    EXPECT_EQ(truth, costs_of(*pruned, scene, loss, {})) << "seed " << seed;
    std::mt19937 engine(seed);
    for (const double least : {0.5, 0.9, 0.999, 1.0, 1.001}) {
      std::vector<float> cutoffs;
      for (const float t : truth) {
        cutoffs.push_back(t * static_cast<float>(least + std::uniform_real_distribution<double>(0, 0.05)(engine)));
      }
      const std::vector<float> costs = costs_of(*pruned, scene, loss, cutoffs);
      for (std::size_t j = 0; j < costs.size(); ++j) {
        if (truth[j] < cutoffs[j]) {
          EXPECT_EQ(costs[j], truth[j]) << "seed " << seed << " model " << j;
        } else {
          EXPECT_GE(costs[j], cutoffs[j]) << "seed " << seed << " model " << j;
          EXPECT_LE(costs[j], truth[j]) << "seed " << seed << " model " << j;
          lost += costs[j] < truth[j];
        }
      }
    }
    touched += pruned->effort().touched;
    asked += pruned->effort().point_models;
    // Of all points, or of those that may cost something.
    std::uint64_t costly = 0;
    for (std::size_t i = 0; i < scene.caps.size(); ++i) costly += scene.view().finite(i) && scene.caps[i] > 0 ? 1 : 0;
    const std::uint64_t all = brute->effort().point_models;
    EXPECT_TRUE(brute->effort().touched == all || brute->effort().touched == truth.size() * costly)
        << brute->effort().touched << " of " << all;
  }
  EXPECT_GT(lost, 100U);              // the cutoffs did settle models early
  EXPECT_LT(touched, asked / 4 * 3);  // and blocks were left out
}

TEST_P(Pruning, SameBytesOnAnyThreadsAndEachInstructionSet) {
  const auto [kind, loss] = GetParam();
  const Scene scene = random_scene(kind, 8, 30000, 64);
  for (const cpu::CpuKernels* kernels : cpu::available_kernels()) {
    const auto brute = make(false, 1, kernels->name);
    load(*brute, scene);
    const std::vector<float> truth = costs_of(*brute, scene, loss, {});
    for (const int threads : {1, 2, 5}) {
      for (const bool pruning : {false, true}) {
        const auto other = make(pruning, threads, kernels->name);
        load(*other, scene);
        EXPECT_EQ(truth, costs_of(*other, scene, loss, {})) << kernels->name << " " << threads << " threads, pruning " << pruning;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Pruning,
                         testing::Combine(testing::ValuesIn(bounded_kinds()), testing::Values(Loss::truncated_l1, Loss::truncated_l2)));

TEST(PruningEdges, ModelsThatAreNotFiniteCostInfinity) {
  Scene scene = random_scene(ModelKind::plane, 3, 20000, 64);
  scene.swarm[4 * 7 + 1] = std::numeric_limits<double>::quiet_NaN();
  scene.swarm[4 * 9 + 3] = std::numeric_limits<double>::infinity();
  const auto pruned = make(true), brute = make(false);
  load(*pruned, scene);
  load(*brute, scene);
  const std::vector<float> costs = costs_of(*pruned, scene, Loss::truncated_l1, std::vector<float>(64, 1.0F));
  EXPECT_EQ(costs[7], std::numeric_limits<float>::infinity());
  EXPECT_EQ(costs[9], std::numeric_limits<float>::infinity());
  EXPECT_EQ(costs_of(*pruned, scene, Loss::truncated_l1, {}), costs_of(*brute, scene, Loss::truncated_l1, {}));
}

TEST(PruningEdges, CapsFarBeyondTheCloudAreSummedAlike) {
  Scene scene = random_scene(ModelKind::plane, 2, 20000, 64);
  std::fill(scene.caps.begin(), scene.caps.end(), std::numeric_limits<float>::max() / 1e9F);
  const auto pruned = make(true), brute = make(false);
  load(*pruned, scene);
  load(*brute, scene);
  const std::vector<float> truth = costs_of(*brute, scene, Loss::truncated_l1, {});
  EXPECT_EQ(costs_of(*pruned, scene, Loss::truncated_l1, {}), truth);
  EXPECT_GT(*std::max_element(truth.begin(), truth.end()), 100.0F);  // plain sums of distances, not all rounded away
}

TEST(PruningEdges, NewCapsAreHeeded) {
  Scene scene = random_scene(ModelKind::plane, 6, 40000, 64);
  const auto pruned = make(true), brute = make(false);
  load(*pruned, scene);
  load(*brute, scene);
  costs_of(*pruned, scene, Loss::truncated_l1, {});
  for (std::size_t i = 0; i < scene.caps.size(); ++i) scene.caps[i] = i % 3 == 0 ? 0.0F : 2 * scene.caps[i];
  ASSERT_TRUE(pruned->set_caps(scene.caps));
  ASSERT_TRUE(brute->set_caps(scene.caps));
  EXPECT_EQ(costs_of(*pruned, scene, Loss::truncated_l1, {}), costs_of(*brute, scene, Loss::truncated_l1, {}));
}

TEST(PruningEdges, PointsThatComeInOrderCostTheSame) {
  // In any order: that a cloud is said to be ordered may cost time, never exactness.
  const Scene scene = random_scene(ModelKind::plane, 9, 30000, 64);
  const auto sorted = make(true), as_given = make(true), brute = make(false);
  load(*sorted, scene);
  PointsView ordered = scene.view();
  ordered.ordered = true;
  ASSERT_TRUE(as_given->set_points(ordered));
  ASSERT_TRUE(as_given->set_caps(scene.caps));
  ASSERT_TRUE(brute->set_points(ordered));
  ASSERT_TRUE(brute->set_caps(scene.caps));
  const std::vector<float> truth = costs_of(*brute, scene, Loss::truncated_l1, {});
  EXPECT_EQ(costs_of(*as_given, scene, Loss::truncated_l1, {}), truth);
  const std::vector<float> blocked = costs_of(*sorted, scene, Loss::truncated_l1, {});
  for (std::size_t j = 0; j < truth.size(); ++j) EXPECT_NEAR(blocked[j], truth[j], 1e-5 * truth[j]);
}

TEST(MortonOrder, IsAPermutationOfNeighbours) {
  for (const std::size_t dimensions : {2U, 3U}) {
    std::mt19937 engine(5);
    constexpr std::size_t kCount = 50000;
    std::vector<std::vector<float>> columns(dimensions, std::vector<float>(kCount));
    for (auto& column : columns) {
      for (float& v : column) v = std::uniform_real_distribution<float>(-3, 3)(engine);
    }
    columns[0][17] = 1e6F;  // one stray point must not push all others into one cell
    std::vector<const float*> starts;
    for (const auto& column : columns) starts.push_back(column.data());
    MortonOrder morton;
    std::vector<std::uint32_t> order;
    morton.sort(starts, kCount, order);
    std::vector<std::uint32_t> sorted(order.begin(), order.end());
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> all(kCount);
    std::iota(all.begin(), all.end(), 0U);
    ASSERT_EQ(sorted, all);
    const auto length = [&](std::span<const std::uint32_t> path) {
      double sum = 0;
      for (std::size_t i = 1; i < path.size(); ++i) {
        double square = 0;
        for (const auto& column : columns) square += std::pow(double{column[path[i]]} - double{column[path[i - 1]]}, 2);
        sum += std::min(std::sqrt(square), 10.0);
      }
      return sum;
    };
    EXPECT_LT(length(order), (dimensions == 2 ? 0.1 : 0.2) * length(all));
  }
}

TEST(MortonOrder, WhatIsBeyondFloatsIsSortedSomewhere) {
  constexpr std::size_t kCount = 5000;
  constexpr float kMost = std::numeric_limits<float>::max(), kInfinity = std::numeric_limits<float>::infinity();
  std::array<std::vector<float>, 3> columns;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t i = 0; i < kCount; ++i) columns[c].push_back(std::array{kMost, -kMost, kInfinity, -kInfinity, 1.0F}[(i + c) % 5]);
  }
  const std::array<const float*, 3> starts{columns[0].data(), columns[1].data(), columns[2].data()};
  std::vector<std::uint32_t> order, all(kCount);
  MortonOrder().sort(starts, kCount, order);
  std::sort(order.begin(), order.end());
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(order, all);
}

TEST(MortonOrder, LargeCloudsAreOrderedAsSmallOnesAre) {
  // The same cells again and again: the large cloud's points of a cell must come in their order, cells as in the small cloud.
  constexpr std::size_t kSmall = 40000, kTimes = 30;
  std::mt19937 engine(6);
  std::vector<std::vector<float>> small(3, std::vector<float>(kSmall)), large(3);
  for (auto& column : small) {
    for (float& v : column) v = static_cast<float>(engine() % 8);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kTimes; ++k) large[c].insert(large[c].end(), small[c].begin(), small[c].end());
  }
  const auto sorted = [](const std::vector<std::vector<float>>& columns) {
    std::vector<const float*> starts;
    for (const auto& column : columns) starts.push_back(column.data());
    std::vector<std::uint32_t> order;
    MortonOrder().sort(starts, columns[0].size(), order);
    return order;
  };
  const auto cell = [&](std::uint32_t i) { return std::array{large[0][i], large[1][i], large[2][i]}; };
  const auto few = sorted(small), many = sorted(large);
  std::vector<std::array<float, 3>> cells, again;
  for (const std::uint32_t i : few) {
    if (cells.empty() || cells.back() != cell(i)) cells.push_back(cell(i));
  }
  for (std::size_t k = 0; k < many.size(); ++k) {
    if (k > 0 && again.back() == cell(many[k])) {
      ASSERT_LT(many[k - 1], many[k]);
    } else {
      again.push_back(cell(many[k]));
    }
  }
  EXPECT_EQ(again, cells);
}

/// Values of a block, on a cache line.
struct alignas(64) BlockColumn {
  std::array<float, kBlockPoints> values{};
  float& operator[](std::size_t i) { return values[i]; }
};

void expect_every_point_with_a_cap_held(const cpu::CpuKernels& kernels) {
  SCOPED_TRACE(kernels.name);
  for (const int dimension : {2, 3}) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      std::mt19937 engine(seed);
      std::normal_distribution<float> normal;
      std::array<BlockColumn, 3> columns;
      BlockColumn caps;
      for (std::size_t i = 0; i < kBlockPoints; ++i) {
        for (int c = 0; c < dimension; ++c) columns[static_cast<std::size_t>(c)][i] = normal(engine) * (c == 0 ? 1.0F : 0.05F) + 2;
        columns[1][i] += columns[0][i];
        caps[i] = i % 3 == 0 ? 0.0F : 0.1F + 0.01F * static_cast<float>(i % 5);
      }
      columns[0][0] = 50;  // has no cap, and must not widen the box
      const float* starts[] = {&columns[0][0], &columns[1][0], &columns[2][0]};
      BlockBounds bounds;
      kernels.bound_block(starts, &caps[0], dimension, bounds);
      EXPECT_EQ(bounds.count, static_cast<float>(kBlockPoints - (kBlockPoints + 2) / 3));
      EXPECT_FLOAT_EQ(bounds.least_cap, 0.1F);
      EXPECT_FLOAT_EQ(bounds.most_cap, 0.14F);
      double shortest = 1e9, longest = 0;
      for (int e = 0; e < dimension; ++e) {
        double square = 0;
        for (int c = 0; c < dimension; ++c) square += double{bounds.axis[e][c]} * double{bounds.axis[e][c]};
        shortest = std::min(shortest, std::sqrt(square));
        longest = std::max(longest, std::sqrt(square));
        for (std::size_t i = 0; i < kBlockPoints; ++i) {
          if (caps[i] == 0) continue;
          double along = 0;
          for (int c = 0; c < dimension; ++c)
            along += double{bounds.axis[e][c]} * (double{columns[static_cast<std::size_t>(c)][i]} - double{bounds.mean[c]});
          EXPECT_LE(std::abs(along), square * (1 + 1e-5));
        }
      }
      EXPECT_LT(longest, 10);
      EXPECT_LT(shortest, 0.25 * longest);  // the box follows the slanted points
    }
  }
}

TEST(BlockBounds, HoldEveryPointWithACap) {
  for (const cpu::CpuKernels* kernels : cpu::available_kernels()) expect_every_point_with_a_cap_held(*kernels);
}

TEST(BlockBounds, WithoutCapsThereIsNothingToReach) {
  BlockColumn zeros;
  const float* starts[] = {&zeros[0], &zeros[0], &zeros[0]};
  for (const cpu::CpuKernels* kernels : cpu::available_kernels()) {
    SCOPED_TRACE(kernels->name);
    BlockBounds bounds;
    kernels->bound_block(starts, &zeros[0], 3, bounds);
    EXPECT_EQ(bounds.count, 0);
    EXPECT_LT(bounds.most_cap, 0);
    EXPECT_EQ(bounds.cap_sum, 0);
  }
}

}  // namespace
}  // namespace swarmfit::kernels
