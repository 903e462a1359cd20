// What a caller has at any moment of a fit.
#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/fit.hpp>

namespace swarmfit {
namespace {

constexpr double kSigma = 0.005, kTau = 2.5 * kSigma;

/// Points of segments in the unit square, 100 each, and 700 outliers.
struct Segments {
  std::vector<double> xy;
  std::mt19937 rng;
  std::uniform_real_distribution<double> unit{0, 1};
  std::normal_distribution<double> noise{0, kSigma};

  explicit Segments(unsigned seed) : rng(seed) {}
  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d along = (b - a).normalized(), across(-along.y(), along.x());
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d p = a + unit(rng) * (b - a) + noise(rng) * across;
      xy.insert(xy.end(), {p.x(), p.y()});
    }
  }
  void add_outliers() {
    for (int i = 0; i < 1400; ++i) xy.push_back(unit(rng));
  }
  PointsView view() const { return PointsView(std::span<const double>(xy), 2); }
};

Segments star(unsigned seed) {
  Segments scene(seed);
  for (int k = 0; k < 5; ++k) {
    const double at = 1.2566370614359172 * k, to = at + 2.5132741228718345;
    scene.add({0.5 + 0.45 * std::cos(at), 0.5 + 0.45 * std::sin(at)}, {0.5 + 0.45 * std::cos(to), 0.5 + 0.45 * std::sin(to)});
  }
  scene.add_outliers();
  return scene;
}

double off(const Segments& scene, std::size_t i, const Eigen::VectorXd& line) {
  return std::abs(line[0] * scene.xy[2 * i] + line[1] * scene.xy[2 * i + 1] + line[2]);
}

/// Sum over points of the distance to the nearest of the models, at most tau.
double energy(const Segments& scene, const std::vector<Model>& models) {
  double sum = 0;
  for (std::size_t i = 0; 2 * i < scene.xy.size(); ++i) {
    double least = kTau;
    for (const Model& model : models) least = std::min(least, off(scene, i, model.parameters));
    sum += least;
  }
  return sum;
}

FitOptions lines(std::uint64_t seed) {
  FitOptions options;
  options.model = ModelType::line2d;
  options.threshold = kTau;
  options.seed = seed;
  options.backend = "cpu";
  return options;
}

TEST(Anytime, EachModelLowersTheEnergyAndSoDoesTheEnd) {
  double polished = 0, saved = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Segments scene = star(seed);
    std::vector<Model> so_far;
    std::vector<double> energies{energy(scene, {})};
    const auto on_model = [&](const Model& model) {
      so_far.push_back(model);
      energies.push_back(energy(scene, so_far));
      return Verdict::go_on;
    };
    const auto result = fit(scene.view(), lines(seed), on_model);
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), 5U);
    for (std::size_t k = 1; k < energies.size(); ++k) EXPECT_LT(energies[k], energies[k - 1]);
    const double end = energy(scene, result->models);
    EXPECT_LE(end, energies.back() * (1 + 1e-6));
    polished += energies.back() - end;
    saved += energies.front() - end;
  }
  // The joint end is polish: nearly all is saved when the last model is delivered.
  EXPECT_LT(polished, 0.03 * saved);
}

TEST(Anytime, MostIsSavedEarlyInTheSearch) {
  double spent = 0, all = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Segments scene = star(seed);
    const auto result = fit(scene.view(), lines(seed));
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), 5U);
    for (const Model& model : result->models) spent += static_cast<double>(model.evaluations);
    all += static_cast<double>(result->evaluations);
  }
  EXPECT_LT(spent, 0.25 * all);
}

TEST(Anytime, StoppedAfterSomeModelsTheRestIsAsDelivered) {
  const Segments scene = star(3);
  for (std::size_t most = 1; most <= 4; ++most) {
    std::vector<Model> delivered;
    const auto on_model = [&](const Model& model) {
      delivered.push_back(model);
      return delivered.size() == most ? Verdict::stop : Verdict::go_on;
    };
    const auto result = fit(scene.view(), lines(1), on_model);
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), most);
    EXPECT_LE(energy(scene, result->models), energy(scene, delivered) * (1 + 1e-6));
    for (std::size_t i = 0; i < result->labels.size(); ++i) {
      const std::uint16_t label = result->labels[i];
      ASSERT_LE(label, most);
      const double far = label > 0 ? off(scene, i, result->models[label - 1U].parameters) : 0.0;
      EXPECT_LE(far, kTau * (1 + 1e-5)) << i;
    }
  }
}

}  // namespace
}  // namespace swarmfit
