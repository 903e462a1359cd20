// The fit as a caller sees it.
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <swarmfit/fit.hpp>

#include "tests/same_answer.hpp"

namespace swarmfit {
namespace {

struct Truth {
  Eigen::Vector3d normal;
  double offset;
};

/// Three walls of a box of a metre, 2000 points each with noise of 2 mm, and 2000 outliers.
struct Corner {
  std::vector<double> rows;
  std::vector<int> labels;
  std::vector<Truth> truth;

  explicit Corner(double scale = 1, Eigen::Vector3d origin = Eigen::Vector3d::Zero()) {
    std::mt19937_64 engine(42);
    const auto unit = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
    const auto add = [&](const Eigen::Vector3d& x, int label) {
      const Eigen::Vector3d p = origin + scale * x;
      rows.insert(rows.end(), {p.x(), p.y(), p.z()});
      labels.push_back(label);
    };
    for (int wall = 0; wall < 3; ++wall) {
      truth.push_back({Eigen::Vector3d::Unit(wall), -origin[wall]});
      for (int k = 0; k < 2000; ++k) {
        Eigen::Vector3d x(unit(), unit(), unit());
        x[wall] = 0.002 * (unit() + unit() + unit() + unit() - 2) * std::sqrt(3.0);
        add(x, wall + 1);
      }
    }
    for (int k = 0; k < 2000; ++k) add({unit(), unit(), unit()}, 0);
  }
  PointsView view() const { return PointsView(std::span<const double>(rows), 3); }
};

/// Every true plane has exactly one model within a degree and 5 mm (scaled) at the data's own place.
void expect_found(const FitResult& result, const Corner& scene, double scale, const Eigen::Vector3d& origin) {
  ASSERT_EQ(result.models.size(), scene.truth.size());
  for (const Truth& plane : scene.truth) {
    int hits = 0;
    for (const Model& model : result.models) {
      const double cosine = std::abs(model.normal().dot(plane.normal));
      const Eigen::Vector3d middle = origin + scale * (Eigen::Vector3d::Constant(0.5) - 0.5 * plane.normal);
      hits += cosine > std::cos(0.0175) && std::abs(model.normal().dot(middle) + model.offset()) < 0.005 * scale;
    }
    EXPECT_EQ(hits, 1);
  }
}

class Presets : public testing::TestWithParam<Preset> {};

TEST_P(Presets, FindTheThreeWallsOfACorner) {
  const Corner scene;
  FitOptions options;
  options.preset = GetParam();
  options.backend = "cpu";
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    options.seed = seed;
    const auto result = fit(scene.view(), options);
    ASSERT_TRUE(result) << result.error().message;
    expect_found(*result, scene, 1, Eigen::Vector3d::Zero());
    EXPECT_NE(result->stop_reason.find("complete"), std::string::npos) << result->stop_reason;
    EXPECT_EQ(result->labels.size(), scene.labels.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Both, Presets, testing::Values(Preset::fast, Preset::paper));

TEST(Fit, LabelsAreInInputOrderAndAgreeWithTheTruth) {
  const Corner scene;
  const auto result = fit(scene.view(), {});
  ASSERT_TRUE(result) << result.error().message;
  std::size_t right = 0;
  for (std::size_t i = 0; i < scene.labels.size(); ++i) {
    const int mine = result->labels[i];
    int wall = 0;
    if (mine > 0) result->models[static_cast<std::size_t>(mine) - 1].normal().cwiseAbs().maxCoeff(&wall);
    right += (mine > 0 ? wall + 1 : 0) == scene.labels[i];
  }
  EXPECT_GT(right, 0.97 * static_cast<double>(scene.labels.size()));
}

TEST(Fit, SameSeedSameAnswerOnAnyNumberOfThreads) {
  const Corner scene;
  FitOptions options;
  options.backend = "cpu";
  options.threads = 1;
  const auto one = fit(scene.view(), options);
  options.threads = 2;
  const auto two = fit(scene.view(), options);
  ASSERT_TRUE(one && two);
  tests::expect_same_answer(*one, *two);
}

TEST(Fit, SeedsDiffer) {
  const Corner scene;
  FitOptions options;
  const auto a = fit(scene.view(), options);
  options.seed = 2;
  const auto b = fit(scene.view(), options);
  ASSERT_TRUE(a && b);
  EXPECT_NE(a->evaluations, b->evaluations);
}

TEST(Fit, WorksFarFromTheOriginAndInOtherUnits) {
  const Eigen::Vector3d utm(5.0e6, 4.6e5, 310);
  const Corner far(1, utm);
  auto result = fit(far.view(), {});
  ASSERT_TRUE(result) << result.error().message;
  expect_found(*result, far, 1, utm);
  const Corner in_millimetres(1000);
  FitOptions options;
  options.threshold = 10;
  auto scaled = fit(in_millimetres.view(), options);
  ASSERT_TRUE(scaled) << scaled.error().message;
  expect_found(*scaled, in_millimetres, 1000, Eigen::Vector3d::Zero());
  const auto plain = fit(Corner().view(), {});
  ASSERT_TRUE(plain);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < plain->labels.size(); ++i) differing += plain->labels[i] != scaled->labels[i];
  EXPECT_LE(differing, plain->labels.size() / 500);
}

TEST(Fit, CallbackSeesEachModelAndMayStop) {
  const Corner scene;
  std::size_t told = 0;
  const auto result = fit(scene.view(), {}, [&](const Model& model) {
    ++told;
    EXPECT_NEAR(model.normal().norm(), 1, 1e-9);
    return told == 2 ? Verdict::stop : Verdict::go_on;
  });
  ASSERT_TRUE(result);
  EXPECT_EQ(told, 2U);
  EXPECT_EQ(result->models.size(), 2U);
  EXPECT_EQ(result->stop_reason, "stopped by the caller");
  EXPECT_EQ(std::set<std::uint16_t>(result->labels.begin(), result->labels.end()).size(), 3U) << "labels are valid all the same";
}

TEST(Fit, CancelledBeforeItBeganFindsNothingAndSaysSo) {
  const Corner scene;
  std::stop_source source;
  source.request_stop();
  auto fitter = Fitter::create({});
  ASSERT_TRUE(fitter);
  const auto result = fitter->fit(scene.view(), {}, source.get_token());
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->models.empty());
  EXPECT_EQ(result->stop_reason, "cancelled");
}

TEST(Fit, ATinyTimeBudgetStillAnswers) {
  const Corner scene;
  FitOptions options;
  options.time_budget_ms = 1e-6;
  const auto result = fit(scene.view(), options);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->stop_reason, "time budget used up");
  EXPECT_EQ(result->labels.size(), scene.labels.size());
}

TEST(Fit, MaxModelsIsKept) {
  FitOptions options;
  options.max_models = 1;
  const auto result = fit(Corner().view(), options);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->models.size(), 1U);
  EXPECT_EQ(result->stop_reason, "max-models reached");
}

TEST(Fit, PriorKeepsToItsDirection) {
  FitOptions options;
  options.prior = DirectionPrior{Eigen::Vector3d::UnitZ(), 0.1};
  const auto result = fit(Corner().view(), options);
  ASSERT_TRUE(result);
  ASSERT_EQ(result->models.size(), 1U);
  EXPECT_GT(std::abs(result->models[0].normal().z()), std::cos(0.1));
}

TEST(Fit, WarmStartKeepsTheModelsOfTheLastFrame) {
  const Corner scene;
  auto fitter = Fitter::create({});
  ASSERT_TRUE(fitter);
  const auto first = fitter->fit(scene.view());
  ASSERT_TRUE(first);
  const auto second = fitter->fit(scene.view(), {}, {}, first->models);
  ASSERT_TRUE(second);
  expect_found(*second, scene, 1, Eigen::Vector3d::Zero());
}

TEST(Fit, NoiseAloneGivesNoModels) {
  std::mt19937_64 engine(9);
  std::vector<double> rows(3 * 4000);
  for (double& v : rows) v = static_cast<double>(engine() >> 11) * 0x1p-53;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    FitOptions options;
    options.seed = seed;
    const auto result = fit(PointsView(std::span<const double>(rows), 3), options);
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->models.empty());
  }
}

TEST(Fit, PerfectlyFlatAndDuplicatedPointsAreAnswered) {
  std::vector<double> rows;
  for (int k = 0; k < 400; ++k) rows.insert(rows.end(), {(k % 20) * 0.1, (k / 20) * 0.1, 0.5});
  const std::vector<double> once = rows;
  rows.insert(rows.end(), once.begin(), once.end());
  const auto result = fit(PointsView(std::span<const double>(rows), 3), {});
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 1U);
  EXPECT_EQ(result->models[0].inliers, 800U);
  EXPECT_TRUE(result->models[0].covariance.allFinite());
}

TEST(Fit, NotFinitePointsGetLabelZero) {
  Corner scene;
  for (std::size_t i = 0; i < scene.labels.size(); i += 3) scene.rows[3 * i + i % 3] = i % 2 ? NAN : INFINITY;
  const auto result = fit(scene.view(), {});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->models.size(), 3U);
  for (std::size_t i = 0; i < scene.labels.size(); i += 3) ASSERT_EQ(result->labels[i], 0);
}

TEST(Fit, ReportsWhatItDid) {
  const auto result = fit(Corner().view(), {});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->backend.name, "cpu");
  EXPECT_FALSE(result->backend.reason.empty());
  EXPECT_GT(result->evaluations, 0U);
  EXPECT_GT(result->points_touched, 0);
  EXPECT_LE(result->points_touched, 1);
  EXPECT_NE(result->brief().find("3 models"), std::string::npos);
  for (const Model& model : result->models) {
    EXPECT_NEAR(model.rms, 0.002, 0.0015);
    EXPECT_EQ(model.covariance.rows(), 4);
    EXPECT_TRUE(model.covariance.isApprox(model.covariance.transpose()));
  }
}

TEST(Fit, Line2dEstimatesItsThreshold) {
  std::mt19937_64 engine(4);
  const auto unit = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  std::vector<double> rows;
  for (int k = 0; k < 200; ++k) rows.insert(rows.end(), {unit(), 0.3 + 0.004 * (unit() + unit() + unit() - 1.5) * 2});  // sigma 0.004
  for (int k = 0; k < 300; ++k) rows.insert(rows.end(), {unit(), unit()});
  FitOptions options;
  options.model = ModelType::line2d;
  const auto result = fit(PointsView(std::span<const double>(rows), 2), options);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 1U);
  EXPECT_NEAR(result->threshold, 0.01, 0.003);
  EXPECT_NEAR(std::abs(result->models[0].parameters[1]), 1, 1e-3);
}

/// Mean of e^T C^+ e over fits of one line or plane of 100 points of noise 0.005 among `outliers`, over its expectation.
double relative_nees(ModelType type, int outliers) {
  const int dimension = type == ModelType::line2d ? 2 : 3;
  constexpr int kFits = 400;
  double sum = 0;
  for (int trial = 0; trial < kFits; ++trial) {
    std::mt19937_64 engine(static_cast<std::uint64_t>(trial));
    std::normal_distribution<double> normal(0, 0.005);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    std::vector<double> rows;  // the line or the plane is 0.6 x + 0.8 y = 0
    for (int k = 0; k < 100; ++k) {
      const double along = unit(engine), off = normal(engine);
      rows.insert(rows.end(), {0.8 * along + 0.6 * off, -0.6 * along + 0.8 * off});
      if (dimension == 3) rows.push_back(unit(engine));
    }
    for (int k = 0; k < outliers * dimension; ++k) rows.push_back(unit(engine));
    FitOptions options;
    options.model = type;
    options.threshold = 0.0125;
    options.max_models = 1;
    options.threads = 1;
    const auto result = fit(PointsView(std::span<const double>(rows), dimension), options);
    if (!result || result->models.empty()) return -1;
    const Model& model = result->models[0];
    Eigen::VectorXd truth = Eigen::VectorXd::Zero(dimension + 1);
    truth.head<2>() << 0.6, 0.8;
    Eigen::VectorXd error = model.parameters - truth;
    if (model.parameters.dot(truth) < 0) error = model.parameters + truth;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(model.covariance);
    const Eigen::VectorXd along = solver.eigenvectors().transpose() * error;
    for (Eigen::Index k = 1; k < along.size(); ++k) sum += along[k] * along[k] / solver.eigenvalues()[k];
  }
  return sum / kFits / dimension;
}

TEST(Fit, CovarianceIsThatOfWhatIsDelivered) {
  // 400 fits tell the mean to 7 % (two deviations). Least squares' own covariance would be off by 57 %, and by another 9 % of the noise
  // that the threshold hides.
  EXPECT_NEAR(relative_nees(ModelType::line2d, 0), 1, 0.15);
  EXPECT_NEAR(relative_nees(ModelType::plane, 0), 1, 0.15);
  EXPECT_NEAR(relative_nees(ModelType::line2d, 100), 1, 0.2);
}

/// Five chords of a circle that cross each other, Gaussian noise 0.0075, among as many outliers; `noise` [data unit].
std::vector<double> star(double noise) {
  std::mt19937_64 engine(12);
  std::normal_distribution<double> normal(0, noise);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> rows;
  for (int line = 0; line < 5; ++line) {
    const double one = 1.2566 * line, other = one + 2.5133;
    for (int k = 0; k < 50; ++k) {
      const double t = unit(engine);
      rows.push_back(0.5 + 0.45 * ((1 - t) * std::cos(one) + t * std::cos(other)) + normal(engine));
      rows.push_back(0.5 + 0.45 * ((1 - t) * std::sin(one) + t * std::sin(other)) + normal(engine));
    }
  }
  for (int k = 0; k < 250; ++k) rows.insert(rows.end(), {unit(engine), unit(engine)});
  return rows;
}

TEST(Fit, LinesThatCrossTellTheirNoiseWhateverTheSeed) {
  const auto rows = star(0.0075);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    FitOptions options;
    options.model = ModelType::line2d;
    options.seed = seed;
    std::size_t told = 0;
    const auto result = fit(PointsView(std::span<const double>(rows), 2), options, [&](const Model&) {
      ++told;
      return Verdict::go_on;
    });
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->models.size(), 5U) << seed;
    EXPECT_EQ(told, 5U) << "those that told the noise are announced as well";
    EXPECT_NEAR(result->threshold, 2.5 * 0.0075, 0.15 * 2.5 * 0.0075) << seed;
    for (const Model& model : result->models) EXPECT_GT(model.iterations, 0U);
  }
}

TEST(Fit, MaxModelsHoldsForThoseThatToldTheNoise) {
  const auto rows = star(0.0075);
  FitOptions options;
  options.model = ModelType::line2d;
  options.max_models = 2;
  const auto result = fit(PointsView(std::span<const double>(rows), 2), options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->models.size(), 2U);
  EXPECT_EQ(result->stop_reason, "max-models reached");
}

struct BadPoints {
  const char* name;
  std::vector<float> rows;
  int dimension;
  const char* says;
};

TEST(Fit, PointsThatCannotBeUsedAreNamed) {
  const float nan = std::nanf("");
  const BadPoints all[] = {
      {"none", {}, 3, "must be >= 3"},
      {"two", {0, 0, 0, 1, 0, 0}, 3, "points is 2, must be >= 3"},
      {"all NaN", {nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan}, 3, "finite points is 0 of 4"},
      {"collinear", {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3}, 3, "are collinear"},
      {"coincident", {1, 2, 3, 1, 2, 3, 1, 2, 3}, 3, "all coincide"},
      {"wrong columns", {0, 0, 1, 0, 0, 1, 1, 1}, 2, "points have 2 columns, must have 3"},
  };
  for (const BadPoints& bad : all) {
    const auto result = fit(PointsView(std::span<const float>(bad.rows), bad.dimension), {});
    ASSERT_FALSE(result) << bad.name;
    EXPECT_EQ(result.error().kind, Error::Kind::bad_input) << bad.name;
    EXPECT_NE(result.error().message.find(bad.says), std::string::npos) << bad.name << ": " << result.error().message;
  }
}

TEST(FitOptions, EachBoundIsChecked) {
  const auto message = [](auto&& change) {
    FitOptions options;
    change(options);
    const auto ok = options.validate();
    return ok ? std::string() : ok.error().message;
  };
  EXPECT_EQ(message([](FitOptions&) {}), "");
  EXPECT_EQ(message([](FitOptions& o) { o.threshold = -0.5; }), "threshold is -0.5, must be finite and > 0");
  EXPECT_EQ(message([](FitOptions& o) { o.threshold = NAN; }), "threshold is nan, must be finite and > 0");
  EXPECT_EQ(message([](FitOptions& o) { o.threshold = 1e-300; }), "threshold is 1e-300, must be in [1e-30, 1e30]");
  EXPECT_EQ(message([](FitOptions& o) { o.threshold = 1e31; }), "threshold is 1e+31, must be in [1e-30, 1e30]");
  EXPECT_EQ(message([](FitOptions& o) { o.particles = 1; }), "particles is 1, must be in [2, 1000000]");
  EXPECT_EQ(message([](FitOptions& o) { o.iterations = 0; }), "iterations is 0, must be >= 1");
  EXPECT_EQ(message([](FitOptions& o) { o.stall = 0; }), "stall is 0, must be >= 1");
  EXPECT_EQ(message([](FitOptions& o) { o.lambda = 0; }), "lambda is 0, must be finite and > 0");
  EXPECT_EQ(message([](FitOptions& o) { o.time_budget_ms = -1; }), "time_budget_ms is -1, must be finite and >= 0 ms");
  EXPECT_EQ(message([](FitOptions& o) { o.threads = -1; }), "threads is -1, must be in [0, 4096]");
  EXPECT_NE(message([](FitOptions& o) { o.prior = DirectionPrior{Eigen::Vector3d::Zero(), 0.1}; }), "");
  EXPECT_NE(message([](FitOptions& o) { o.prior = DirectionPrior{Eigen::Vector3d::UnitX(), 0}; }), "");
}

TEST(Fitter, OptionsMayChangeOnTheSameBackEnd) {
  FitOptions options;
  options.backend = "cpu";
  options.threads = 1;
  auto fitter = Fitter::create(options);
  ASSERT_TRUE(fitter);
  options.prior = DirectionPrior{Eigen::Vector3d::UnitZ(), 0.1};
  options.seed = 7;
  ASSERT_TRUE(fitter->set_options(options));
  EXPECT_EQ(fitter->options().seed, 7u);
  EXPECT_TRUE(fitter->options().prior.has_value());
  FitOptions other = options;
  other.backend = "reference";
  auto refused = fitter->set_options(other);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, Error::Kind::invalid_option);
  EXPECT_NE(refused.error().message.find("must stay cpu"), std::string::npos);
  other = options;
  other.threads = 2;
  EXPECT_FALSE(fitter->set_options(other));
  other = options;
  other.particles = -1;
  EXPECT_FALSE(fitter->set_options(other));
  EXPECT_EQ(fitter->options().seed, 7u) << "what was refused changes nothing";
}

TEST(Fitter, AnUnknownBackEndIsAnErrorThatListsWhatThereIs) {
  FitOptions options;
  options.backend = "quantum";
  const auto fitter = Fitter::create(options);
  ASSERT_FALSE(fitter);
  EXPECT_EQ(fitter.error().kind, Error::Kind::backend_unavailable);
  EXPECT_NE(fitter.error().message.find("'quantum'"), std::string::npos);
  EXPECT_NE(fitter.error().message.find("reference"), std::string::npos);
}

TEST(Fitter, TheReferenceBackEndAgreesWithTheCpu) {
  const Corner scene;
  FitOptions options;
  options.backend = "cpu";
  const auto cpu = fit(scene.view(), options);
  options.backend = "reference";
  const auto reference = fit(scene.view(), options);
  ASSERT_TRUE(cpu && reference);
  EXPECT_EQ(reference->backend.name, "reference");
  ASSERT_EQ(cpu->models.size(), reference->models.size());
  std::size_t differing = 0;
  for (std::size_t i = 0; i < cpu->labels.size(); ++i) differing += (cpu->labels[i] > 0) != (reference->labels[i] > 0);
  EXPECT_LE(differing, cpu->labels.size() / 1000);
}

/// Swarms that a fit flies.
std::size_t swarms_flown(std::span<const float> rows, FitResult& result) {
  auto fitter = Fitter::create({});
  std::size_t swarms = 0;
  fitter->observe([&](const SwarmStep& step) { swarms = std::max(swarms, step.swarm + 1); });
  auto fitted = fitter->fit(PointsView(rows, 3));
  EXPECT_TRUE(fitted) << fitted.error().message;
  result = std::move(fitted).value_or(FitResult{});
  return swarms;
}

/// Points of the plane z = `height`, scattered by a millimetre, over a square metre at most.
void add_level(std::vector<float>& rows, std::mt19937& engine, float height, float side, int count) {
  std::uniform_real_distribution<float> unit(0, 1);
  std::normal_distribution<float> noise(0, 0.001F);
  for (int i = 0; i < count; ++i) rows.insert(rows.end(), {side * unit(engine), side * unit(engine), height + noise(engine)});
}

TEST(Fit, FliesNoSwarmOverWhatIsExplained) {
  std::mt19937 engine(5);
  std::vector<float> rows;
  add_level(rows, engine, 0, 1, 20000);
  FitResult result;
  EXPECT_EQ(swarms_flown(rows, result), 1U);
  EXPECT_EQ(result.models.size(), 1U);
  EXPECT_EQ(result.stop_reason, "complete: no further model pays for itself");
}

TEST(Fit, EndsWhenTwoSwarmsFindTheSameInVain) {
  std::mt19937 engine(6);
  std::uniform_real_distribution<float> unit(0.1F, 1);
  std::vector<float> rows;
  add_level(rows, engine, 0, 1, 20000);
  add_level(rows, engine, 1.5F, 0.2F, 180);  // a surface, but less than one point in a hundred
  for (int i = 0; i < 150; ++i) rows.insert(rows.end(), {unit(engine), unit(engine), unit(engine)});
  FitResult result;
  EXPECT_EQ(swarms_flown(rows, result), 3U) << "one that finds the plane, and two";
  EXPECT_EQ(result.models.size(), 1U);
}

}  // namespace
}  // namespace swarmfit
