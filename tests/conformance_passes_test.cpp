// The passes over the caller's points, of every back end against the oracle.
#include <algorithm>
#include <limits>

#include <Eigen/Dense>

#include "conformance.hpp"

namespace swarmfit::kernels::conformance {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Largest allowed error of a distance, relative to the cloud's radius, and of a mean moment, relative to the radius and its square.
constexpr double kDistanceTolerance = 1e-6, kMomentTolerance = 2e-6;
constexpr float kOne[] = {0.03F};  // a tolerance for all
constexpr std::size_t kSizes[] = {1, 2, 3, 15, 16, 17, 511, 512, 513, 4095, 4097, 65537};

std::vector<ModelView> views(ModelKind kind, const std::vector<double>& swarm) {
  std::vector<ModelView> models;
  const auto width = static_cast<std::size_t>(traits(kind).parameter_count);
  for (std::size_t at = 0; at < swarm.size(); at += width) models.push_back({kind, std::span(swarm).subspan(at, width)});
  return models;
}

class Passes : public Conformance {
 protected:
  /// `loose` points are so near a limit that their side is a matter of rounding; a weight may be off by a share of `rounding`.
  void expect_moments_agree(const Cloud& cloud, const Moments& found, const Moments& exact, double loose, double rounding) {
    ASSERT_NEAR(found.weight, exact.weight, (1e-5 + rounding) * exact.weight + 10 * loose);
    if (exact.weight == 0 || loose > 0.01 * exact.weight) return;
    const double radius = cloud.radius(), share = kMomentTolerance + rounding + 20 * loose / exact.weight;
    for (std::size_t d = 0; d < static_cast<std::size_t>(cloud.dimension); ++d) {
      EXPECT_NEAR(found.mean[d], exact.mean[d], share * radius);
      for (std::size_t e = 0; e < static_cast<std::size_t>(cloud.dimension); ++e) {
        EXPECT_NEAR(found.scatter[d][e], exact.scatter[d][e], share * radius * radius * exact.weight);
      }
    }
  }

  void expect_agree(const Cloud& cloud, const Evidence& found, const Evidence& exact, double limits, double loose, double rounding = 0) {
    const double slack = kDistanceTolerance * cloud.radius();
    EXPECT_NEAR(static_cast<double>(found.count), static_cast<double>(exact.count), loose);
    EXPECT_NEAR(found.cost, exact.cost, kCostTolerance * limits + slack * static_cast<double>(cloud.count()));
    EXPECT_NEAR(found.square, exact.square, (loose + 1) * 1e-3 * std::max(1.0, cloud.radius()));
    expect_moments_agree(cloud, found.moments, exact.moments, loose, rounding);
  }

  /// Weighs one model and compares all there is.
  void expect_weighed_alike(const Cloud& cloud, const Weighing& how, const ModelView& model) {
    Guarded<float> found_distances(cloud.count(), -1.0F);
    std::vector<float> exact_distances(cloud.count());
    Evidence found, exact;
    ASSERT_OK(evaluator().weigh(cloud.view(), how, {&model, 1}, found_distances.span(), {&found, 1}));
    ASSERT_OK(reference().weigh(cloud.view(), how, {&model, 1}, exact_distances, {&exact, 1}));
    EXPECT_TRUE(found_distances.intact()) << "written outside distances";
    const double slack = kDistanceTolerance * (cloud.radius() + 1);
    double worst = 0, loose = 0, limits = 0;
    for (std::size_t i = 0; i < cloud.count(); ++i) {
      const double limit = how.caps.empty() ? how.tolerance : how.caps[i];
      const double d = exact_distances[i];
      ASSERT_EQ(std::isnan(found_distances[i]), std::isnan(exact_distances[i])) << i;
      if (std::isnan(exact_distances[i])) continue;
      limits += limit;
      worst = std::max(worst, std::abs(found_distances[i] - d));
      loose += std::abs(d - limit) <= slack || std::abs(d - how.tolerance) <= slack ? 1 : 0;
    }
    EXPECT_LE(worst, slack);
    expect_agree(cloud, found, exact, limits, loose, how.corner < 1 ? slack / (how.corner * how.tolerance) : 0.0);
  }
};
INSTANTIATE_TEST_SUITE_P(Conformance, Passes, testing::ValuesIn(contenders()), contender_name);

TEST_P(Passes, SurveysAgreeOnAllSizes) {
  for (const ModelKind kind : {ModelKind::line2d, ModelKind::plane}) {
    for (const std::size_t points : kSizes) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", " + std::to_string(points) + " points");
      Cloud cloud = make_cloud(kind, points);
      for (std::size_t i = 0; i < cloud.narrow.size(); i += 97) cloud.narrow[i] = i % 2 == 0 ? kNaN : -kInf;
      Survey found, exact;
      ASSERT_OK(evaluator().survey(cloud.view(), found));
      ASSERT_OK(reference().survey(cloud.view(), exact));
      EXPECT_EQ(found.finite_count, exact.finite_count);
      EXPECT_EQ(found.finite, exact.finite);
      expect_moments_agree(cloud, found.moments, exact.moments, 0, 0);
    }
  }
}

TEST_P(Passes, ASurveyTellsALineFromAPlaneInFloat) {
  Cloud cloud;
  for (int i = 0; i < 20000; ++i) {
    const float t = 0.0001F * static_cast<float>(i) - 0.3F;
    cloud.narrow.insert(cloud.narrow.end(), {1.0F + t, 2.0F - 0.5F * t, 0.25F * t});
    cloud.caps.push_back(1);
  }
  Survey found;
  ASSERT_OK(evaluator().survey(cloud.view(), found));
  // The spread of x against its correlation with y: 0 on a line, but for the coordinates' own rounding.
  const auto& s = found.moments.scatter;
  EXPECT_NEAR(s[1][1] - s[0][1] * s[0][1] / s[0][0], 0, 1e-12 * s[0][0]);
}

TEST_P(Passes, ASurveyTellsAPlaneFromASolidInFloat) {
  Cloud cloud;
  for (int i = 0; i < 20000; ++i) {
    const float u = 0.001F * static_cast<float>(i % 173), v = 0.01F * static_cast<float>(i % 91);
    cloud.narrow.insert(cloud.narrow.end(), {u - 0.5F * v, v, 3.0F + 0.25F * u + v});
    cloud.caps.push_back(1);
  }
  Survey found;
  ASSERT_OK(evaluator().survey(cloud.view(), found));
  Eigen::Matrix3d scatter;
  for (int d = 0; d < 3; ++d) {
    for (int e = 0; e < 3; ++e) scatter(d, e) = found.moments.scatter[static_cast<std::size_t>(d)][static_cast<std::size_t>(e)];
  }
  const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  EXPECT_NEAR(spread[0], 0, 1e-12 * spread[2]);
  EXPECT_GT(spread[1], 1e-3 * spread[2]);
}

TEST_P(Passes, WeighedAlikeOnAllSizes) {
  for (const ModelKind kind : {ModelKind::line2d, ModelKind::plane}) {
    for (const std::size_t points : kSizes) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", " + std::to_string(points) + " points");
      Cloud cloud = make_cloud(kind, points);
      for (std::size_t i = 5; i < cloud.narrow.size(); i += 1001) cloud.narrow[i] = kNaN;
      const std::vector<double> swarm = make_swarm(kind, 3);
      for (const ModelView& model : views(kind, swarm)) {
        expect_weighed_alike(cloud, {0.02F, 1, {}}, model);
        expect_weighed_alike(cloud, {0.02F, 0.1F, cloud.caps}, model);
      }
    }
  }
}

TEST_P(Passes, DistancesAreTheSameWhereNobodyAsksForMore) {
  for (const ModelKind kind : {ModelKind::plane, ModelKind::homography}) {
    Cloud cloud = make_cloud(kind, 3000);
    for (std::size_t i = 0; i < cloud.narrow.size(); i += 97) cloud.narrow[i] = i % 2 == 0 ? kNaN : -kInf;
    std::vector<double> swarm = make_swarm(kind, 3);
    swarm[static_cast<std::size_t>(traits(kind).parameter_count)] = std::numeric_limits<double>::quiet_NaN();
    const auto models = views(kind, swarm);
    const Weighing how{0.02F, 1, {}};
    std::vector<float> with_more(3 * cloud.count()), alone(3 * cloud.count());
    std::vector<Evidence> more(3);
    ASSERT_OK(evaluator().weigh(cloud.view(), how, models, with_more, more));
    ASSERT_OK(evaluator().weigh(cloud.view(), how, models, alone, {}));
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_TRUE(alone[i] == with_more[i] || (std::isnan(alone[i]) && std::isnan(with_more[i]))) << traits(kind).name << ' ' << i;
    }
  }
  const Cloud cloud = make_cloud(ModelKind::plane, 100);
  const std::vector<double> plane = make_swarm(ModelKind::plane, 1);
  EXPECT_TRUE(
      is_invalid(evaluator().weigh(cloud.view(), {0.02F, 1, {}}, views(ModelKind::plane, plane), {}, {}), {"evidence.size()", "0", "1"}));
}

TEST_P(Passes, WeighedAlikeFarFromTheOriginAndInAnyLayout) {
  const Cloud far = make_cloud(ModelKind::plane, 3000, 5e6, 2, false);
  const std::vector<double> far_plane = make_swarm(ModelKind::plane, 1, 5e6);
  expect_weighed_alike(far, {0.02F, 0.1F, {}}, {ModelKind::plane, far_plane});

  const Cloud tight = make_cloud(ModelKind::plane, 3000);
  std::vector<float> padded;
  for (std::size_t i = 0; i < tight.count(); ++i) {
    padded.insert(padded.end(), tight.narrow.begin() + static_cast<std::ptrdiff_t>(3 * i),
                  tight.narrow.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    padded.push_back(kNaN);  // not a column
  }
  const std::vector<double> plane = make_swarm(ModelKind::plane, 1);
  const ModelView model{ModelKind::plane, plane};
  const Weighing how{0.02F, 0.1F, tight.caps};
  Evidence found, same;
  ASSERT_OK(evaluator().weigh({padded.data(), Scalar::float32, 3, tight.count(), 4 * sizeof(float)}, how, {&model, 1}, {}, {&found, 1}));
  ASSERT_OK(evaluator().weigh(tight.view(), how, {&model, 1}, {}, {&same, 1}));
  EXPECT_EQ(found.count, same.count);
  EXPECT_EQ(found.cost, same.cost);
  EXPECT_EQ(found.moments.scatter, same.moments.scatter);
}

TEST_P(Passes, OneStrayDoesNotCostTheOthersTheirPrecision) {
  Cloud cloud = make_cloud(ModelKind::plane, 2000, 0);
  for (const std::size_t i : {0, 3 * 700, 3 * 1999}) cloud.narrow[i] = 3e7F;
  const std::vector<double> plane = make_swarm(ModelKind::plane, 1, 0);
  const ModelView model{ModelKind::plane, plane};
  std::vector<float> found(cloud.count()), exact(cloud.count());
  Evidence evidence;
  ASSERT_OK(evaluator().weigh(cloud.view(), {0.02F, 1, {}}, {&model, 1}, found, {&evidence, 1}));
  ASSERT_OK(reference().weigh(cloud.view(), {0.02F, 1, {}}, {&model, 1}, exact, {&evidence, 1}));
  for (std::size_t i = 0; i < cloud.count(); ++i) {
    if (exact[i] < 100) {
      ASSERT_NEAR(found[i], exact[i], 1e-5) << i;
    }
  }
}

TEST_P(Passes, ClaimsAgreeWithTheLabelsAndTheOracle) {
  for (const std::size_t points : kSizes) {
    SCOPED_TRACE(std::to_string(points) + " points");
    Cloud cloud = make_cloud(ModelKind::plane, points);
    for (std::size_t i = 5; i < cloud.narrow.size(); i += 1001) cloud.narrow[i] = kNaN;
    std::vector<double> swarm = make_swarm(ModelKind::plane, 9);
    swarm.insert(swarm.end(), {0, 0, std::numeric_limits<double>::quiet_NaN(), 0});
    const std::vector<ModelView> models = views(ModelKind::plane, swarm);
    std::vector<float> each(points);
    for (std::size_t i = 0; i < points; ++i) each[i] = i % 7 == 0 ? 0.0F : 0.01F * static_cast<float>(1 + i % 5);
    for (const std::span<const float> tolerance : {std::span<const float>(kOne), std::span<const float>(each)}) {
      Guarded<std::uint16_t> found(points, 999);
      std::vector<std::uint16_t> exact(points);
      std::vector<Evidence> found_evidence(models.size()), exact_evidence(models.size());
      ASSERT_OK(evaluator().claim(cloud.view(), tolerance, models, found.span(), found_evidence));
      ASSERT_OK(reference().claim(cloud.view(), tolerance, models, exact, exact_evidence));
      EXPECT_TRUE(found.intact()) << "written outside labels";
      // Which of two models is nearer, and whether at all, is a matter of rounding for a few.
      double differing = 0;
      for (std::size_t i = 0; i < points; ++i) differing += found[i] != exact[i] ? 1 : 0;
      EXPECT_LE(differing, 1 + 1e-3 * static_cast<double>(points));
      for (std::size_t m = 0; m < models.size(); ++m) {
        EXPECT_EQ(found_evidence[m].count, std::count(found.span().begin(), found.span().end(), m + 1));
        expect_agree(cloud, found_evidence[m], exact_evidence[m], 0.03 * static_cast<double>(points), differing);
      }
    }
  }
}

// An image has holes of whole words; who knows of them may leave them out and must come to the same bytes.
TEST_P(Passes, HolesThatAreKnownChangeNothing) {
  for (const std::size_t points : kSizes) {
    for (const bool wide : {false, true}) {
      SCOPED_TRACE(std::to_string(points) + (wide ? " points, double" : " points, float"));
      Cloud cloud = make_cloud(ModelKind::plane, points);
      for (std::size_t i = 0; i < points; ++i) {
        const std::size_t word = i / 64;
        const bool hole = word % 3 == 1 || word % 11 < 4 || i % 97 == 5 || (points > 40000 && word / 16 == 9);
        if (hole) cloud.narrow[3 * i + i % 3] = i % 2 == 0 ? kNaN : kInf;
      }
      const std::vector<double> rows(cloud.narrow.begin(), cloud.narrow.end());
      const PointsView blind = wide ? PointsView{rows.data(), Scalar::float64, 3, points, 3 * sizeof(double)} : cloud.view();
      Survey survey;
      ASSERT_OK(evaluator().survey(blind, survey));
      PointsView knowing = blind;
      knowing.finite_rows = survey.finite.data();
      std::vector<double> swarm = make_swarm(ModelKind::plane, 3);
      swarm.insert(swarm.end(), {0, 0, std::numeric_limits<double>::quiet_NaN(), 0});
      const std::vector<ModelView> models = views(ModelKind::plane, swarm);
      const auto same = [&](const std::vector<Evidence>& a, const std::vector<Evidence>& b) {
        for (std::size_t m = 0; m < models.size(); ++m) {
          EXPECT_EQ(a[m].count, b[m].count);
          EXPECT_EQ(a[m].cost, b[m].cost);
          EXPECT_EQ(a[m].square, b[m].square);
          EXPECT_EQ(a[m].moments.mean, b[m].moments.mean);
          EXPECT_EQ(a[m].moments.scatter, b[m].moments.scatter);
        }
      };
      std::vector<Evidence> of_blind(models.size()), of_knowing(models.size());
      std::vector<std::uint16_t> labels(points, 7);
      Guarded<std::uint16_t> found(points, 999);
      ASSERT_OK(evaluator().claim(blind, kOne, models, labels, of_blind));
      ASSERT_OK(evaluator().claim(knowing, kOne, models, found.span(), of_knowing));
      EXPECT_TRUE(found.intact()) << "written outside labels";
      EXPECT_TRUE(std::equal(labels.begin(), labels.end(), found.span().begin()));
      same(of_blind, of_knowing);
      for (const std::span<const float> caps : {std::span<const float>(), std::span<const float>(cloud.caps)}) {
        std::vector<float> distances(points * models.size());
        Guarded<float> told(points * models.size(), -1.0F);
        ASSERT_OK(evaluator().weigh(blind, {0.02F, 0.1F, caps}, models, distances, of_blind));
        ASSERT_OK(evaluator().weigh(knowing, {0.02F, 0.1F, caps}, models, told.span(), of_knowing));
        EXPECT_TRUE(told.intact()) << "written outside distances";
        for (std::size_t i = 0; i < distances.size(); ++i) {
          ASSERT_TRUE(told.span()[i] == distances[i] || (std::isnan(told.span()[i]) && std::isnan(distances[i]))) << i;
        }
        same(of_blind, of_knowing);
      }
      Survey again;
      ASSERT_OK(evaluator().survey(knowing, again));
      EXPECT_EQ(again.finite, survey.finite);
    }
  }
}

TEST_P(Passes, NoPointsAndNoModels) {
  Survey survey;
  ASSERT_OK(evaluator().survey({nullptr, Scalar::float32, 3, 0, 12}, survey));
  EXPECT_EQ(survey.finite_count, 0U);
  EXPECT_EQ(survey.moments.weight, 0);
  const Cloud cloud = make_cloud(ModelKind::plane, 100);
  std::vector<std::uint16_t> labels(100, 7);
  ASSERT_OK(evaluator().claim(cloud.view(), kOne, {}, labels, {}));
  EXPECT_EQ(std::count(labels.begin(), labels.end(), 0), 100);
}

TEST_P(Passes, WrongArgumentsAreNamed) {
  const Cloud cloud = make_cloud(ModelKind::plane, 100);
  const std::vector<double> plane = make_swarm(ModelKind::plane, 1), line{1, 0, 0};
  const ModelView model{ModelKind::plane, plane}, flat{ModelKind::line2d, line};
  Evidence evidence;
  std::vector<float> few(99);
  const auto weigh = [&](const Weighing& how, const ModelView& of, std::span<float> distances) {
    return evaluator().weigh(cloud.view(), how, {&of, 1}, distances, {&evidence, 1});
  };
  EXPECT_TRUE(is_invalid(weigh({0, 1, {}}, model, {}), {"tolerance", "0", "> 0"}));
  EXPECT_TRUE(is_invalid(weigh({1, 0, {}}, model, {}), {"corner", "0", "(0, 1]"}));
  EXPECT_TRUE(is_invalid(weigh({1, 1, few}, model, {}), {"caps.size()", "99", "100"}));
  EXPECT_TRUE(is_invalid(weigh({1, 1, {}}, model, few), {"distances.size()", "99", "100"}));
  EXPECT_TRUE(is_invalid(weigh({1, 1, {}}, flat, {}), {"line2d", "2", "3"}));
  std::vector<std::uint16_t> labels(100);
  Survey survey;
  const float negative = -1;
  EXPECT_TRUE(is_invalid(evaluator().claim(cloud.view(), {&negative, 1}, {}, labels, {}), {"tolerance", "-1", ">= 0"}));
  EXPECT_TRUE(is_invalid(evaluator().claim(cloud.view(), few, {}, labels, {}), {"tolerance.size()", "99", "100"}));
  EXPECT_TRUE(is_invalid(evaluator().survey({few.data(), Scalar::float32, 5, 1, 20}, survey), {"dimension", "5"}));
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
