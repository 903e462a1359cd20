// A user's own model: it is found as a built-in one is, on every back end; what is wrong with it is said.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <swarmfit/fit.hpp>
#include <swarmfit/results.hpp>

namespace swarmfit {
namespace {

using Doubles = std::span<const double>;

/// line2d once more: a x + b y + c = 0, a^2 + b^2 = 1.
OwnModel own_line() {
  OwnModel line;
  line.name = "my line";
  line.dimension = 2;
  line.parameter_count = 3;
  line.minimal_sample = 2;
  line.freedom = 2;
  line.residual = each_point([](Doubles x, Doubles p) { return p[0] * x[0] + p[1] * x[1] + p[2]; });
  line.solve = [](Doubles x, std::span<double> p) {
    p[0] = x[3] - x[1];
    p[1] = x[0] - x[2];
    p[2] = -(p[0] * x[0] + p[1] * x[1]);
    return true;
  };
  line.normalise = [](std::span<double> p) {
    const double length = std::hypot(p[0], p[1]);
    if (!(length > 0)) return false;
    const double scale = (p[1] < 0 || (p[1] == 0 && p[0] < 0) ? -1 : 1) / length;
    for (double& v : p) v *= scale;
    return true;
  };
  line.recentre = [](Doubles centre, std::span<double> p) { p[2] += p[0] * centre[0] + p[1] * centre[1]; };
  line.glsl = "float residual(vec2 x, float p[3]) { return p[0] * x.x + p[1] * x.y + p[2]; }";
  return line;
}

/// Three lines of 200 points in a square of 100, and 300 points anywhere.
Eigen::Matrix2Xd lines_scene(unsigned seed, Eigen::Vector2d origin = Eigen::Vector2d::Zero()) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(0, 100);
  std::normal_distribution<double> noise(0, 0.2);
  Eigen::Matrix2Xd points(2, 900);
  for (int i = 0; i < 900; ++i) {
    const double t = anywhere(random), off = noise(random);
    switch (i < 600 ? i % 3 : 3) {
      case 0: points.col(i) << t, 20 + 0.3 * t + off; break;
      case 1: points.col(i) << t, 90 - 0.7 * t + off; break;
      case 2: points.col(i) << 70 + off, t; break;
      default: points.col(i) << t, anywhere(random);
    }
    points.col(i) += origin;
  }
  return points;
}

/// Where in the result the k-th of the scene's lines is; beyond its end where it is not.
std::size_t place_of(std::size_t k, const FitResult& result) {
  static const std::array<Eigen::Vector3d, 3> kTruth{Eigen::Vector3d(-0.3, 1, -20), Eigen::Vector3d(0.7, 1, -90),
                                                     Eigen::Vector3d(1, 0, -70)};
  const Eigen::Vector3d line = kTruth[k] / kTruth[k].head<2>().norm();
  const auto at = std::find_if(result.models.begin(), result.models.end(), [&](const Model& model) {
    const double turned = model.parameters.head<2>().dot(line.head<2>()) < 0 ? -1 : 1;
    return (turned * model.parameters.head<2>() - line.head<2>()).norm() < 0.01 && std::abs(turned * model.parameters[2] - line[2]) < 0.5;
  });
  return static_cast<std::size_t>(at - result.models.begin());
}

FitOptions own_options(OwnModel own, std::string backend = "cpu") {
  FitOptions options;
  options.model = ModelType::own;
  options.own = std::move(own);
  options.threshold = 0.6;
  options.backend = std::move(backend);
  return options;
}

/// The message of a fit that must fail with this kind.
std::string failure(const FitOptions& options, Error::Kind kind, const Eigen::Matrix2Xd& points = lines_scene(1)) {
  const auto result = fit(PointsView(points), options);
  if (result) return "no failure";
  EXPECT_EQ(result.error().kind, kind) << result.error().message;
  return result.error().message;
}

bool vulkan_is_there() {
  const auto all = devices();
  return std::any_of(all.begin(), all.end(), [](const Device& device) { return device.backend == "vulkan" && device.usable; });
}

class OwnModels : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "vulkan" && !vulkan_is_there()) GTEST_SKIP() << "no Vulkan device here";
  }
};
INSTANTIATE_TEST_SUITE_P(BackEnds, OwnModels, testing::Values("reference", "cpu", "vulkan"), [](const auto& test) { return test.param; });

TEST_P(OwnModels, FindWhatTheBuiltInFinds) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Eigen::Matrix2Xd points = lines_scene(seed);
    FitOptions built_in;
    built_in.model = ModelType::line2d;
    built_in.threshold = 0.6;
    built_in.backend = "cpu";
    const auto theirs = fit(PointsView(points), built_in);
    const auto mine = fit(PointsView(points), own_options(own_line(), GetParam()));
    ASSERT_TRUE(theirs) << theirs.error().message;
    ASSERT_TRUE(mine) << mine.error().message;
    EXPECT_EQ(mine->backend.name, GetParam());
    std::array<std::size_t, 3> their_place, my_place;
    for (std::size_t k = 0; k < 3; ++k) {
      their_place[k] = place_of(k, *theirs);
      my_place[k] = place_of(k, *mine);
      ASSERT_LT(their_place[k], theirs->models.size()) << theirs->brief();
      ASSERT_LT(my_place[k], mine->models.size()) << mine->brief();
      const Model &their = theirs->models[their_place[k]], &my = mine->models[my_place[k]];
      EXPECT_EQ(my.type, ModelType::own);
      const double turned = my.parameters.dot(their.parameters) < 0 ? -1 : 1;
      EXPECT_LT((my.parameters - turned * their.parameters).norm(), 0.05);
      EXPECT_NEAR(static_cast<double>(my.inliers), static_cast<double>(their.inliers), 4);
      EXPECT_NEAR(my.rms, their.rms, 0.02 * their.rms);
      ASSERT_EQ(my.covariance.rows(), 3);
      EXPECT_LT((my.covariance - their.covariance).norm(), 0.1 * their.covariance.norm()) << my.covariance << "\n\n" << their.covariance;
    }
    std::size_t agree = 0, labelled = 0;
    for (std::size_t i = 0; i < 900; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        labelled += theirs->labels[i] == their_place[k] + 1 ? 1 : 0;
        agree += theirs->labels[i] == their_place[k] + 1 && mine->labels[i] == my_place[k] + 1 ? 1 : 0;
      }
    }
    EXPECT_GE(agree + 6, labelled);
    EXPECT_GE(agree, 580U);
  }
}

TEST_P(OwnModels, EstimateTheirThreshold) {
  FitOptions options = own_options(own_line(), GetParam());
  options.threshold.reset();
  const auto result = fit(PointsView(lines_scene(4)), options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->threshold, 2.5 * 0.2, 0.15);
  EXPECT_EQ(result->models.size(), 3U);
}

TEST_P(OwnModels, WorkFarFromTheOriginWhereTheyCanBeMoved) {
  const Eigen::Vector2d far(5e6, -3e6);
  const auto near_by = fit(PointsView(lines_scene(5)), own_options(own_line(), GetParam()));
  const auto far_off = fit(PointsView(lines_scene(5, far)), own_options(own_line(), GetParam()));
  ASSERT_TRUE(near_by && far_off);
  ASSERT_EQ(near_by->models.size(), 3U);
  ASSERT_EQ(far_off->models.size(), 3U);
  std::size_t agree = 0;
  for (std::size_t i = 0; i < 900; ++i) agree += near_by->labels[i] == far_off->labels[i] ? 1 : 0;
  EXPECT_GE(agree, 895U);
  for (std::size_t m = 0; m < 3; ++m) {
    const Eigen::VectorXd &here = near_by->models[m].parameters, &there = far_off->models[m].parameters;
    EXPECT_NEAR(there[2] + there[0] * far.x() + there[1] * far.y(), here[2], 1e-2);
  }
}

TEST_P(OwnModels, TakeAResidualThatIsNoNumberForFar) {
  OwnModel line = own_line();
  // Nothing beyond x = 50 is any of its business.
  line.recentre = nullptr;
  line.residual = each_point([](Doubles x, Doubles p) { return std::sqrt(50 - x[0]) * 0 + p[0] * x[0] + p[1] * x[1] + p[2]; });
  line.glsl =
      "float residual(vec2 x, float p[3]) {\n"
      "  return x.x > 50.0 ? uintBitsToFloat(0x7FC00000u) : p[0] * x.x + p[1] * x.y + p[2];\n"
      "}\n";
  const Eigen::Matrix2Xd points = lines_scene(6);
  const auto result = fit(PointsView(points), own_options(line, GetParam()));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->models.size(), 2U);
  for (std::size_t i = 0; i < 900; ++i) {
    if (points(0, static_cast<Eigen::Index>(i)) > 50) {
      EXPECT_EQ(result->labels[i], 0) << i;
    }
  }
  line.residual = each_point([](Doubles, Doubles) { return std::numeric_limits<double>::quiet_NaN(); });
  line.glsl = "float residual(vec2 x, float p[3]) { return uintBitsToFloat(0x7FC00000u); }";
  const auto nothing = fit(PointsView(points), own_options(line, GetParam()));
  ASSERT_TRUE(nothing) << nothing.error().message;
  EXPECT_TRUE(nothing->models.empty());
}

TEST(OwnModel, TakesARefinerOrDoesWithout) {
  OwnModel line = own_line();
  int calls = 0;
  line.refine = [&calls](Doubles x, Doubles w, std::span<double> p) {
    ++calls;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    double all = 0;
    for (std::size_t i = 0; i < w.size(); ++i) {
      mean += w[i] * Eigen::Vector2d(x[2 * i], x[2 * i + 1]);
      all += w[i];
    }
    mean /= all;
    for (std::size_t i = 0; i < w.size(); ++i) {
      const Eigen::Vector2d d = Eigen::Vector2d(x[2 * i], x[2 * i + 1]) - mean;
      scatter += w[i] * d * d.transpose();
    }
    const Eigen::Vector2d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvectors().col(0);
    p[0] = normal.x();
    p[1] = normal.y();
    p[2] = -normal.dot(mean);
    return true;
  };
  const auto with = fit(PointsView(lines_scene(7)), own_options(line));
  const auto without = fit(PointsView(lines_scene(7)), own_options(own_line()));
  ASSERT_TRUE(with && without);
  EXPECT_GT(calls, 3);
  ASSERT_EQ(with->models.size(), 3U);
  ASSERT_EQ(without->models.size(), 3U);
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_LT((with->models[m].parameters - without->models[m].parameters).norm(), 5e-2);
  }
}

TEST(OwnModel, NeedsNothingThatIsOptional) {
  // y = a x^2 + b x + c, by its vertical distance, in parameters of very different size.
  OwnModel parabola;
  parabola.parameter_count = parabola.minimal_sample = 3;
  parabola.residual = each_point([](Doubles x, Doubles p) { return x[1] - ((p[0] * x[0] + p[1]) * x[0] + p[2]); });
  parabola.solve = [](Doubles x, std::span<double> p) {
    Eigen::Matrix3d rows;
    Eigen::Vector3d y;
    for (int i = 0; i < 3; ++i) {
      const double at = x[static_cast<std::size_t>(2 * i)];
      rows.row(i) << at * at, at, 1;
      y[i] = x[static_cast<std::size_t>(2 * i + 1)];
    }
    const Eigen::Vector3d k = rows.fullPivLu().solve(y);
    std::copy(k.begin(), k.end(), p.begin());
    return k.allFinite();
  };
  std::mt19937 random(8);
  std::uniform_real_distribution<double> wide(-300, 300), high(-200, 600);
  std::normal_distribution<double> noise(0, 1);
  Eigen::Matrix2Xd points(2, 1500);
  for (int i = 0; i < 1500; ++i) {
    const double x = wide(random), y = i < 400 ? 0.005 * x * x + 0.1 * x - 100 : i < 800 ? 500 - 0.004 * x * x : high(random);
    points.col(i) << x, y + (i < 800 ? noise(random) : 0.0);
  }
  FitOptions options = own_options(parabola);
  options.threshold = 3;
  const auto result = fit(PointsView(points), options);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 2U) << result->brief();
  const Model& up = result->models[result->models[0].parameters[0] > 0 ? 0 : 1];
  EXPECT_NEAR(up.parameters[0], 0.005, 2e-5);
  EXPECT_NEAR(up.parameters[1], 0.1, 2e-3);
  EXPECT_NEAR(up.parameters[2], -100, 0.5);
  // The straight line's textbook covariance, from its design matrix.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  const auto label = static_cast<std::uint16_t>(&up - result->models.data() + 1);
  for (std::size_t i = 0; i < 1500; ++i) {
    const double x = points(0, static_cast<Eigen::Index>(i));
    const Eigen::Vector3d row(x * x, x, 1);
    if (result->labels[i] == label) information += row * row.transpose();
  }
  const double variance = up.rms * up.rms * static_cast<double>(up.inliers) / static_cast<double>(up.inliers - 3);
  // Least absolute deviations cost somewhat more variance than least squares, the same for all parameters.
  Eigen::Matrix3d expected = variance * information.inverse();
  const double dearer = up.covariance(0, 0) / expected(0, 0);
  EXPECT_GT(dearer, 0.99);
  EXPECT_LT(dearer, 2.5);
  expected *= dearer;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(up.covariance(r, c), expected(r, c), 1e-3 * std::sqrt(expected(r, r) * expected(c, c))) << r << ", " << c;
    }
  }
}

TEST(OwnModel, GivesTheSameOnAnyNumberOfThreads) {
  FitOptions options = own_options(own_line());
  options.threads = 1;
  const auto one = fit(PointsView(lines_scene(9)), options);
  ASSERT_TRUE(one);
  for (const int threads : {2, 4}) {
    options.threads = threads;
    const auto more = fit(PointsView(lines_scene(9)), options);
    ASSERT_TRUE(more);
    EXPECT_EQ(more->labels, one->labels);
    ASSERT_EQ(more->models.size(), one->models.size());
    for (std::size_t m = 0; m < one->models.size(); ++m) EXPECT_EQ(more->models[m].parameters, one->models[m].parameters);
  }
}

TEST(OwnModel, OfAFitterMayChange) {
  FitOptions built_in;
  built_in.model = ModelType::line2d;
  built_in.threshold = 0.6;
  built_in.backend = "cpu";
  auto fitter = Fitter::create(built_in);
  ASSERT_TRUE(fitter);
  const Eigen::Matrix2Xd points = lines_scene(10);
  ASSERT_TRUE(fitter->set_options(own_options(own_line())));
  const auto own = fitter->fit(PointsView(points));
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_EQ(own->models.size(), 3U);
  ASSERT_TRUE(fitter->set_options(built_in));
  const auto back = fitter->fit(PointsView(points));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->models.size(), 3U);
  EXPECT_NE(to_json(*own, Cloud(), 0).find("\"type\":\"own\",\"parameters\":{\"values\":["), std::string::npos);
}

TEST(OwnModel, SaysWhichFieldIsWrong) {
  const auto refused = [](auto change) {
    FitOptions options = own_options(own_line());
    change(options);
    return failure(options, Error::Kind::invalid_option);
  };
  EXPECT_EQ(refused([](FitOptions& o) { o.own.reset(); }), "own is empty, must be given where model is own");
  EXPECT_EQ(refused([](FitOptions& o) { o.model = ModelType::plane; }), "model is plane, must be own where own is given");
  EXPECT_EQ(refused([](FitOptions& o) { o.rivals = {ModelType::line2d}; }), "rivals holds line2d, must hold nothing beside an own model");
  EXPECT_EQ(refused([](FitOptions& o) { o.preset = Preset::paper; }),
            "deflation is parametric, must be residual for an own model (preset fast)");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->name.clear(); }), "own.name is empty, must be given");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->dimension = 5; }), "own.dimension is 5, must be 2, 3 or 4");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->parameter_count = 10; }), "own.parameter_count is 10, must be in [1, 9]");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->minimal_sample = 0; }), "own.minimal_sample is 0, must be in [1, 8]");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->freedom = 4; }), "own.freedom is 4, must be in [0, parameter_count]");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->residual = nullptr; }), "own.residual is empty, must be given");
  EXPECT_EQ(refused([](FitOptions& o) { o.own->solve = nullptr; }), "own.solve is empty, must be given");
  OwnModel wide = own_line();
  wide.dimension = 3;
  EXPECT_EQ(failure(own_options(wide), Error::Kind::bad_input), "points have 2 columns, must have 3 to fit a my line");
  EXPECT_EQ(failure(own_options(own_line()), Error::Kind::bad_input, Eigen::Matrix2Xd::Zero(2, 1)),
            "points is 1, must be >= 2 to fit a my line");
}

TEST(OwnModel, SaysWhatThrew) {
  OwnModel line = own_line();
  line.residual = each_point([](Doubles, Doubles) -> double { throw std::runtime_error("no such thing"); });
  EXPECT_EQ(failure(own_options(line), Error::Kind::bad_input), "own.residual threw: no such thing");
  line = own_line();
  line.solve = [](Doubles, std::span<double>) -> bool { throw 7; };
  EXPECT_EQ(failure(own_options(line), Error::Kind::bad_input), "own.solve threw what is no std::exception");
  line = own_line();
  line.refine = [](Doubles, Doubles, std::span<double>) -> bool { throw std::logic_error("cannot"); };
  EXPECT_EQ(failure(own_options(line), Error::Kind::bad_input), "own.refine threw: cannot");
}

TEST(OwnModel, OfNoSampleIsNeverFound) {
  OwnModel line = own_line();
  line.solve = [](Doubles, std::span<double>) { return false; };
  const auto none = fit(PointsView(lines_scene(1)), own_options(line));
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_TRUE(none->models.empty());
  line.solve = [](Doubles, std::span<double> p) {
    p[0] = std::numeric_limits<double>::infinity();
    return true;
  };
  const auto nowhere = fit(PointsView(lines_scene(1)), own_options(line));
  ASSERT_TRUE(nowhere) << nowhere.error().message;
  EXPECT_TRUE(nowhere->models.empty());
}

TEST(OwnModel, WithGlslThatDoesNotCompileIsRefusedInTheCompilersWords) {
  if (!vulkan_is_there()) GTEST_SKIP() << "no Vulkan device here";
  OwnModel line = own_line();
  line.glsl = "float residual(vec2 x, float p[3]) {\n  return slope * x.x;\n}\n";
  const std::string told = failure(own_options(line, "vulkan"), Error::Kind::invalid_option);
  EXPECT_NE(told.find("glsl of the own model my line does not compile: "), std::string::npos) << told;
  EXPECT_NE(told.find("my line:2: 'slope' : undeclared identifier"), std::string::npos) << told;
  line.glsl = "float distance_to(vec2 x) { return 0.0; }";
  EXPECT_NE(failure(own_options(line, "vulkan"), Error::Kind::invalid_option).find("'residual' : no matching overloaded function"),
            std::string::npos);
  line.glsl = "#include \"/etc/passwd\"\n";
  EXPECT_NE(failure(own_options(line, "vulkan"), Error::Kind::invalid_option).find("does not compile"), std::string::npos);
  line.glsl.clear();
  EXPECT_EQ(failure(own_options(line, "vulkan"), Error::Kind::invalid_option),
            "glsl of the own model my line is empty, must define its residual for backend vulkan");
  // The processor does not look at it.
  line.glsl = "nonsense";
  const auto result = fit(PointsView(lines_scene(1)), own_options(line, "cpu"));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->models.size(), 3U);
}

}  // namespace
}  // namespace swarmfit
