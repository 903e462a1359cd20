// Colour distance, colour cost, the graph cut, and the outlines that come of them.
#include "host/perception/segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "host/common/graph_cut.hpp"
#include "host/perception/colour_cost.hpp"
#include "tests/segmentation_fixture.hpp"

namespace swarmfit::perception {
namespace {

using test::Case, test::make_case, test::Score, test::score;

// mt19937's own output is the same everywhere; the standard's distributions are not.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
  std::uint8_t byte() { return static_cast<std::uint8_t>(below(256)); }

 private:
  std::mt19937 engine_;
};

TEST(ColourDistance, FollowsEquations6And7) {
  const auto d = [](Hls a, Hls b) { return colour_distance(a, b); };
  EXPECT_FLOAT_EQ(d({0.1f, 0.3f, 0}, {0.9f, 0.8f, 0}), 0.5f) << "greys differ in lightness alone";
  EXPECT_FLOAT_EQ(d({0.1f, 0.3f, 1}, {0.1f, 0.8f, 1}), 0) << "full colours differ in hue alone";
  EXPECT_FLOAT_EQ(d({0.95f, 0.5f, 1}, {0.05f, 0.5f, 1}), 0.4f) << "hue is circular: a tenth of the circle";
  EXPECT_FLOAT_EQ(d({0, 0.5f, 1}, {0.25f, 0.5f, 1}), 1) << "a quarter of the circle is as far as hues get";
  EXPECT_FLOAT_EQ(d({0, 0.5f, 1}, {0.5f, 0.5f, 1}), 1);
  EXPECT_FLOAT_EQ(d({0, 0, 0}, {0, 0, 1}), 1) << "saturation alone";
  // ds = 0.2, mean saturation 0.5, dh = 0.2, dl = 0.1: 0.04 + 0.8 (0.5 * 0.2 + 0.5 * 0.1) = 0.16
  EXPECT_NEAR(d({0.10f, 0.5f, 0.4f}, {0.15f, 0.6f, 0.6f}), 0.16f, 1e-6);
}

TEST(ColourDistance, IsSymmetricAndWithinBounds) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Hls a = to_hls(random.byte(), random.byte(), random.byte()), b = to_hls(random.byte(), random.byte(), random.byte());
    EXPECT_FLOAT_EQ(colour_distance(a, b), colour_distance(b, a));
    EXPECT_EQ(colour_distance(a, a), 0);
    EXPECT_GE(colour_distance(a, b), 0);
    EXPECT_LE(colour_distance(a, b), 1);
  }
}

TEST(ColourDistance, ConvertsKnownColours) {
  const auto expect = [](Hls got, float h, float l, float s) {
    EXPECT_NEAR(got.h, h, 1e-6);
    EXPECT_NEAR(got.l, l, 1e-6);
    EXPECT_NEAR(got.s, s, 1e-6);
  };
  expect(to_hls(255, 0, 0), 0, 0.5f, 1);
  expect(to_hls(0, 255, 0), 1.0f / 3, 0.5f, 1);
  expect(to_hls(0, 0, 255), 2.0f / 3, 0.5f, 1);
  expect(to_hls(255, 0, 255), 5.0f / 6, 0.5f, 1);
  expect(to_hls(51, 51, 51), 0, 0.2f, 0);
  expect(to_hls(255, 204, 204), 0, 0.9f, 1);  // light: the range over what is left to white
}

TEST(ColourCost, IsTheMeanDistanceToTheNearestOfTheSample) {
  Random random(2);
  for (const int k : {0, 1, 3, 50}) {
    ColourSample sample(k, 8);
    std::vector<Hls> colours;
    for (int i = 0; i < 50; ++i) {
      const std::uint8_t r = random.byte(), g = random.byte(), b = random.byte();
      sample.add(r, g, b);
      colours.push_back(to_hls(r, g, b));
    }
    sample.close(1000);
    EXPECT_EQ(sample.neighbours(), k == 0 ? 4 : k);  // sqrt(50) / 2
    for (int i = 0; i < 50; ++i) {
      const std::uint8_t r = random.byte(), g = random.byte(), b = random.byte();
      std::vector<float> distances;
      for (const Hls& c : colours) distances.push_back(colour_distance(to_hls(r, g, b), c));
      std::sort(distances.begin(), distances.end());
      float mean = 0;
      for (int n = 0; n < sample.neighbours(); ++n)
        mean += distances[static_cast<std::size_t>(n)] / static_cast<float>(sample.neighbours());
      EXPECT_NEAR(sample.cost(to_hls(r, g, b)), mean, 1e-5);
      EXPECT_NEAR(sample.cost(r, g, b), mean, 5e-5) << "as remembered";
      EXPECT_EQ(sample.cost(r, g, b), sample.cost(r, g, b));
    }
  }
}

TEST(ColourCost, AnEmptySampleCostsAllAndALargeOneIsThinned) {
  ColourSample none;
  none.close(10);
  EXPECT_EQ(none.cost(1, 2, 3), 1);
  ColourSample many;
  for (int i = 0; i < 1000; ++i) many.add(static_cast<std::uint8_t>(i % 256), 0, 0);
  many.close(100);
  EXPECT_EQ(many.size(), 100U);
  EXPECT_EQ(many.neighbours(), 5);
}

struct Grid {
  common::PottsEnergy energy;
  std::vector<std::vector<common::PottsEnergy::Cost>> costs;  // by node and label
  std::vector<std::array<int, 3>> edges;
  int ground = -1;
};

/// Small whole numbers: many ties. Weights are even, as a ground asks.
Grid random_grid(Random& random, int width, int height, int labels, int ground = -1) {
  Grid grid;
  grid.ground = ground;
  if (ground >= 0) grid.energy.set_ground(static_cast<common::PottsEnergy::Label>(ground));
  for (int i = 0; i < width * height; ++i) {
    grid.energy.add_node();
    grid.costs.emplace_back();
    for (int l = 0; l < labels; ++l) {
      grid.costs.back().push_back(random.below(20));
      grid.energy.add_label(static_cast<common::PottsEnergy::Label>(l), grid.costs.back().back());
    }
    const auto join = [&](int j) {
      const int weight = ground >= 0 ? 2 * random.below(8) : random.below(15);
      grid.edges.push_back({i, j, weight});
      grid.energy.add_edge(i, j, weight);
    };
    if (i % width > 0) join(i - 1);
    if (i >= width) join(i - width);
  }
  grid.energy.close();
  return grid;
}

common::PottsEnergy::Cost plain_energy(const Grid& grid, const std::vector<common::PottsEnergy::Label>& labels) {
  common::PottsEnergy::Cost sum = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) sum += grid.costs[i][labels[i]];
  for (const auto& [i, j, weight] : grid.edges) {
    const int a = labels[static_cast<std::size_t>(i)], b = labels[static_cast<std::size_t>(j)];
    if (a != b) sum += a == grid.ground || b == grid.ground ? weight / 2 : weight;
  }
  return sum;
}

TEST(GraphCut, OneExpansionIsTheBestOfAllSubsets) {
  Random random(3);
  for (int trial = 0; trial < 400; ++trial) {
    Grid grid = random_grid(random, 3, 3, 3, trial % 2 == 0 ? -1 : trial % 3);
    std::vector<common::PottsEnergy::Label> start(9);
    for (auto& label : start) label = static_cast<common::PottsEnergy::Label>(random.below(3));
    for (common::PottsEnergy::Label alpha = 0; alpha < 3; ++alpha) {
      common::PottsEnergy::Cost best = std::numeric_limits<common::PottsEnergy::Cost>::max();
      for (int subset = 0; subset < 512; ++subset) {
        auto labels = start;
        for (std::size_t i = 0; i < 9; ++i)
          if (((subset >> i) & 1) != 0) labels[i] = alpha;
        best = std::min(best, plain_energy(grid, labels));
      }
      auto labels = start;
      const auto fall = grid.energy.expand(alpha, labels);
      EXPECT_EQ(plain_energy(grid, labels), best);
      EXPECT_EQ(plain_energy(grid, start) - best, fall);
      EXPECT_EQ(grid.energy.energy(labels), best);
    }
  }
}

TEST(GraphCut, OtherLabelsOnTheSameEdgesAreAsMadeAnew) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    Grid grid = random_grid(random, 4, 4, 3);
    std::vector<common::PottsEnergy::Label> used(16, 0);
    const std::array<common::PottsEnergy::Label, 4> order{0, 1, 2, 3};
    grid.energy.minimise(order, 3, used, 1);
    // Some nodes lose a label, and all may take a new one.
    common::PottsEnergy fresh;
    grid.energy.forget_labels();
    for (std::size_t i = 0; i < 16; ++i) {
      fresh.add_node();
      grid.energy.add_node();
      for (common::PottsEnergy::Label l = 0; l < 4; ++l) {
        if (l == 1 && i % 3 == 0) continue;
        const int cost = random.below(20);
        fresh.add_label(l, cost);
        grid.energy.add_label(l, cost);
      }
    }
    for (const auto& [i, j, weight] : grid.edges) fresh.add_edge(i, j, weight);
    fresh.close();
    grid.energy.close();
    std::vector<common::PottsEnergy::Label> again(16, 0), anew(16, 0);
    EXPECT_EQ(grid.energy.minimise(order, 3, again, 1), fresh.minimise(order, 3, anew, 1));
    EXPECT_EQ(again, anew);
    EXPECT_EQ(grid.energy.energy(again), fresh.energy(anew));
  }
}

TEST(GraphCut, MinimisingEndsWithinTwiceTheOptimum) {
  Random random(4);
  int exact = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Grid grid = random_grid(random, 4, 2, 3);
    common::PottsEnergy::Cost best = std::numeric_limits<common::PottsEnergy::Cost>::max();
    for (int code = 0; code < 6561; ++code) {
      std::vector<common::PottsEnergy::Label> labels;
      for (int i = 0, rest = code; i < 8; ++i, rest /= 3) labels.push_back(static_cast<common::PottsEnergy::Label>(rest % 3));
      best = std::min(best, plain_energy(grid, labels));
    }
    auto labels = grid.energy.cheapest();
    const common::PottsEnergy::Label order[] = {0, 1, 2};
    const auto start = plain_energy(grid, labels);
    const auto found = start - grid.energy.minimise(order, 10, labels);
    EXPECT_EQ(found, plain_energy(grid, labels));
    EXPECT_LE(found, 2 * best) << "the bound of alpha-expansion for Potts energies";
    exact += found == best;
  }
  EXPECT_GE(exact, 50) << "and mostly it is the optimum";
}

TEST(GraphCut, TheEnergyNeverRises) {
  Random random(5);
  Grid grid = random_grid(random, 40, 30, 5);
  auto labels = grid.energy.cheapest();
  auto energy = plain_energy(grid, labels);
  for (int step = 0; step < 25; ++step) {
    const auto fall = grid.energy.expand(static_cast<common::PottsEnergy::Label>(step % 5), labels);
    EXPECT_GE(fall, 0);
    EXPECT_EQ(plain_energy(grid, labels), energy - fall);
    energy -= fall;
  }
}

TEST(GraphCut, PiecesAreMinimisedAloneByAnyNumberOfThreads) {
  Random random(6);
  common::PottsEnergy together;
  std::vector<common::PottsEnergy> alone(12);
  for (auto& energy : alone) {
    const int first = static_cast<int>(together.nodes());
    for (int i = 0; i < 30; ++i) {
      for (common::PottsEnergy* e : {&energy, &together}) e->add_node();
      for (common::PottsEnergy::Label l = 0; l < 4; ++l) {
        const int cost = random.below(20);
        for (common::PottsEnergy* e : {&energy, &together}) e->add_label(l, cost);
      }
      if (i == 0) continue;
      for (const int j : {i - 1, std::max(0, i - 7)}) {
        const int weight = random.below(15);
        energy.add_edge(j, i, weight);
        together.add_edge(first + j, first + i, weight);
      }
    }
  }
  together.close();
  const common::PottsEnergy::Label order[] = {0, 1, 2, 3};
  std::vector<common::PottsEnergy::Label> expected;
  for (auto& energy : alone) {
    energy.close();
    auto labels = energy.cheapest();
    energy.minimise(order, 10, labels);
    expected.insert(expected.end(), labels.begin(), labels.end());
  }
  for (const int threads : {1, 2, 0}) {
    auto labels = together.cheapest();
    const auto before = together.energy(labels);
    const auto fall = together.minimise(order, 10, labels, threads);
    EXPECT_EQ(labels, expected) << threads;
    EXPECT_EQ(before - fall, together.energy(labels));
    EXPECT_GT(fall, 0);
  }
}

TEST(GraphCut, KeepsToTheLabelsANodeMayTake) {
  common::PottsEnergy energy;
  energy.add_node();
  energy.add_label(1, 5);
  energy.add_node();
  energy.add_label(2, 0);
  energy.add_label(7, 3);
  energy.add_edge(0, 1, 100);
  energy.close();
  auto labels = energy.cheapest();
  const common::PottsEnergy::Label order[] = {1, 2, 7, 9};
  EXPECT_EQ(energy.energy(labels), 105);
  EXPECT_EQ(energy.minimise(order, 5, labels), 0);
  EXPECT_EQ(labels, (std::vector<common::PottsEnergy::Label>{1, 2}));
}

TEST(Segmentation, OutlinesTheObjectsAndFillsTheirHoles) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Case c = make_case(seed);
    const Score before = score(c, c.popout);
    const Score after = score(c, segment_objects(c.input(), PerceiveOptions{}));
    EXPECT_GT(after.f, 0.97) << "seed " << seed;
    EXPECT_GT(after.f, before.f + 0.02) << "seed " << seed << ": better than depth alone";
    EXPECT_GT(after.holes, 0.85) << "seed " << seed;
    EXPECT_EQ(before.holes, 0);
  }
}

TEST(Segmentation, ThePapersCutOutlinesTheObjects) {
  PerceiveOptions options;
  options.fit.preset = Preset::paper;
  const Case c = make_case(1);
  const Score after = score(c, segment_objects(c.input(), options));
  EXPECT_GT(after.f, 0.75);
  EXPECT_GT(after.holes, 0.15);
}

TEST(Segmentation, NeighboursDoNotClaimEachOthersPoints) {
  const Case c = make_case(2);
  const auto objects = segment_objects(c.input(), PerceiveOptions{});
  std::size_t points = 0, kept = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    points += c.popout[i] > 0;
    kept += c.popout[i] > 0 && objects[i] == c.popout[i];
  }
  EXPECT_GT(static_cast<double>(kept), 0.99 * static_cast<double>(points));
}

TEST(Segmentation, RepeatsItselfAndTakesDoubles) {
  Case c = make_case(1, 320, 240);
  for (const Preset preset : {Preset::fast, Preset::paper}) {
    PerceiveOptions options;
    options.fit.preset = preset;
    const auto once = segment_objects(c.input(), options);
    EXPECT_EQ(segment_objects(c.input(), options), once);
    const Case doubles = c.in_doubles();
    EXPECT_EQ(segment_objects(doubles.input(), options), once);
  }
}

TEST(Segmentation, TheFixedCostDecidesWhatIsUncertain) {
  const Case c = make_case(1);
  const auto uncertain = [&](double cost) {
    PerceiveOptions options;
    options.fit.preset = Preset::paper;
    options.uncertain_cost = cost;
    const auto objects = segment_objects(c.input(), options);
    return std::count(objects.begin(), objects.end(), kUncertain);
  };
  EXPECT_GT(uncertain(0.02), uncertain(0.2));
  EXPECT_EQ(uncertain(0.999), 0);
}

TEST(Segmentation, EdgeCasesAreAnswered) {
  Case c = make_case(1, 160, 120);
  const std::vector<SpaceOfInterest> none;
  for (const Preset preset : {Preset::fast, Preset::paper}) {
    PerceiveOptions options;
    options.fit.preset = preset;
    EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, c.popout, none}, options), std::vector<std::uint16_t>(c.scene.cloud.size(), 0));
    // SOIs of which no pixel is left.
    const std::vector<std::uint16_t> nothing(c.scene.cloud.size(), 0);
    EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, nothing, c.sois}, options), nothing);
    // No plane known, no background in any sphere.
    Case bare = c;
    bare.planes = nothing;
    for (auto& soi : bare.sois) soi.radius = 0;
    EXPECT_EQ(segment_objects(bare.input(), options).size(), c.scene.cloud.size());
    // One SOI that is the whole image.
    Case whole = c;
    whole.popout.assign(c.scene.cloud.size(), 1);
    EXPECT_EQ(segment_objects(whole.input(), options).size(), c.scene.cloud.size());
  }
}

}  // namespace
}  // namespace swarmfit::perception
