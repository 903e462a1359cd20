// Distances and assignment of every back end against the oracle.
#include <algorithm>
#include <limits>

#include "conformance.hpp"

namespace swarmfit::kernels::conformance {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Largest allowed error of a distance, relative to the cloud's radius: a few roundings of float.
constexpr double kDistanceTolerance = 1e-6;

class Labels : public Conformance {
 protected:
  std::vector<float> distances(FitnessEvaluator& from, const ModelView& model, std::size_t points) {
    Guarded<float> out(points, -1.0F);
    EXPECT_OK(from.distances(model, out.span()));
    EXPECT_TRUE(out.intact()) << "written outside distances";
    return {out.span().begin(), out.span().end()};
  }

  std::vector<std::uint16_t> labels(const std::vector<ModelView>& models, std::span<const float> tolerance, std::size_t points) {
    Guarded<std::uint16_t> out(points, 999);
    EXPECT_OK(evaluator().assign(models, tolerance, out.span()));
    EXPECT_TRUE(out.intact()) << "written outside labels";
    return {out.span().begin(), out.span().end()};
  }

  /// Each label is the nearest model within tolerance, up to the error a distance may have.
  void expect_labels(const Cloud& cloud, const std::vector<ModelView>& models, std::span<const float> tolerance) {
    const std::vector<std::uint16_t> found = labels(models, tolerance, cloud.count());
    const double slack = kDistanceTolerance * cloud.radius();
    std::vector<std::vector<float>> exact;
    for (const ModelView& model : models) exact.push_back(distances(reference(), model, cloud.count()));
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cloud.count(); ++i) {
      const double allowed = tolerance[tolerance.size() == 1 ? 0 : i];
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& distance : exact) {
        if (std::isfinite(distance[i])) nearest = std::min<double>(nearest, distance[i]);
      }
      if (found[i] == 0) {
        wrong += nearest < allowed - slack;
      } else {
        ASSERT_LE(found[i], models.size());
        const double distance = exact[found[i] - 1U][i];
        wrong += !(distance <= allowed + slack && distance <= nearest + slack);
      }
    }
    EXPECT_EQ(wrong, 0U) << "labels, of " << cloud.count();
  }
};
INSTANTIATE_TEST_SUITE_P(Conformance, Labels, testing::ValuesIn(contenders()), contender_name);

std::vector<ModelView> views(ModelKind kind, const std::vector<double>& swarm) {
  std::vector<ModelView> models;
  const auto width = static_cast<std::size_t>(traits(kind).parameter_count);
  for (std::size_t at = 0; at < swarm.size(); at += width) models.push_back({kind, std::span(swarm).subspan(at, width)});
  return models;
}

TEST_P(Labels, DistancesAgreeOnAllSizes) {
  for (const ModelKind kind : kModelKinds) {
    for (const std::size_t points : sizes(kind)) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", " + std::to_string(points) + " points");
      const Cloud cloud = make_cloud(kind, points);
      load(cloud);
      const std::vector<double> model = make_swarm(kind, 1);
      const std::vector<float> exact = distances(reference(), {kind, model}, points);
      const std::vector<float> found = distances(evaluator(), {kind, model}, points);
      double worst = 0;
      for (std::size_t i = 0; i < points; ++i) worst = std::max(worst, static_cast<double>(std::abs(found[i] - exact[i])));
      EXPECT_LE(worst, kDistanceTolerance * (cloud.radius() + 6));
    }
  }
}

TEST_P(Labels, DistancesOfOddPointsAndModels) {
  Cloud cloud = make_cloud(ModelKind::plane, 50);
  cloud.narrow[3] = kNaN;
  cloud.narrow[100] = kInf;
  load(cloud);
  std::vector<double> model = make_swarm(ModelKind::plane, 1);
  const auto is_finite = [](std::size_t i) { return i != 1 && i != 33; };
  std::vector<float> found = distances(evaluator(), {ModelKind::plane, model}, 50);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(std::isfinite(found[i]), is_finite(i)) << i;
  EXPECT_TRUE(std::isnan(found[1]) && std::isnan(found[33]));
  model[2] = std::numeric_limits<double>::quiet_NaN();
  found = distances(evaluator(), {ModelKind::plane, model}, 50);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_TRUE(is_finite(i) ? found[i] == kInf : std::isnan(found[i])) << i;
}

TEST_P(Labels, AgreeOnAllSizes) {
  for (const ModelKind kind : kModelKinds) {
    for (const std::size_t points : sizes(kind)) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", " + std::to_string(points) + " points");
      const Cloud cloud = make_cloud(kind, points);
      load(cloud);
      const std::vector<double> swarm = make_swarm(kind, 7);
      expect_labels(cloud, views(kind, swarm), std::vector<float>{0.03F});
      expect_labels(cloud, views(kind, swarm), cloud.caps);
    }
  }
}

TEST_P(Labels, TiesGoToTheLowerNumber) {
  const Cloud cloud = make_cloud(ModelKind::plane, 1000);
  load(cloud);
  const std::vector<double> one = make_swarm(ModelKind::plane, 1);
  std::vector<double> swarm{0, 0, 1, 1000};  // near nothing
  for (int copy = 0; copy < 3; ++copy) swarm.insert(swarm.end(), one.begin(), one.end());
  for (const double v : one) swarm.push_back(-v);  // the same plane, the other way round
  const std::vector<std::uint16_t> found = labels(views(ModelKind::plane, swarm), std::vector<float>{kInf}, 1000);
  EXPECT_EQ(std::count(found.begin(), found.end(), 2), 1000);
}

TEST_P(Labels, ZeroForNoModelNoPointAndBrokenModels) {
  Cloud cloud = make_cloud(ModelKind::plane, 300);
  cloud.narrow[9] = kNaN;  // point 3
  load(cloud);
  const std::vector<float> wide{100.0F};
  std::vector<std::uint16_t> found = labels({}, wide, 300);
  EXPECT_EQ(std::count(found.begin(), found.end(), 0), 300);

  std::vector<double> swarm = make_swarm(ModelKind::plane, 2);
  swarm[1] = std::numeric_limits<double>::quiet_NaN();
  found = labels(views(ModelKind::plane, swarm), wide, 300);
  EXPECT_EQ(std::count(found.begin(), found.end(), 2), 299);
  EXPECT_EQ(found[3], 0);

  const std::vector<double> far{0, 0, 1, 1000};
  found = labels(views(ModelKind::plane, far), std::vector<float>{1.0F}, 300);
  EXPECT_EQ(std::count(found.begin(), found.end(), 0), 300);
}

TEST_P(Labels, ZeroToleranceTakesExactPointsOnly) {
  Cloud cloud;
  for (int i = 0; i < 40; ++i) {
    for (const float v : {static_cast<float>(i % 5), static_cast<float>(i / 5), i % 2 == 0 ? 0.0F : 1.0F}) cloud.narrow.push_back(v);
    cloud.caps.push_back(1);
  }
  load(cloud);
  const std::vector<double> swarm{0, 0, 1, 0, 0, 0, 1, -1};
  const std::vector<std::uint16_t> found = labels(views(ModelKind::plane, swarm), std::vector<float>{0.0F}, 40);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(found[i], i % 2 == 0 ? 1 : 2) << i;
}

TEST_P(Labels, ManyModels) {
  const Cloud cloud = make_cloud(ModelKind::plane, 400);
  load(cloud);
  std::vector<double> swarm;
  for (int m = 0; m < 700; ++m) swarm.insert(swarm.end(), {0.0, 0.0, 1.0, -1.0 - m * 4.0 / 700});
  expect_labels(cloud, views(ModelKind::plane, swarm), std::vector<float>{0.01F});
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
