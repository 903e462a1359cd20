// Own models on every back end, against the oracle of the built-in kinds that they copy.
#include <algorithm>
#include <limits>

#include "conformance.hpp"

namespace swarmfit::kernels::conformance {
namespace {

using Doubles = std::span<const double>;

/// Of one point, as host/include/swarmfit/own_model.hpp has it for users.
template <class One>
auto each_point(One one) {
  return [one](Doubles rows, Doubles parameters, std::span<double> residuals) {
    const std::size_t width = residuals.empty() ? 0 : rows.size() / residuals.size();
    for (std::size_t i = 0; i < residuals.size(); ++i) residuals[i] = one(rows.subspan(i * width, width), parameters);
  };
}

struct Copy {
  ModelKind of;
  std::shared_ptr<OwnModel> own = std::make_shared<OwnModel>();
};

Copy copy_of(ModelKind kind, const char* glsl) {
  Copy copy{kind};
  copy.own->name = "copy of " + std::string(traits(kind).name);
  copy.own->dimension = traits(kind).dimension;
  copy.own->parameter_count = traits(kind).parameter_count;
  copy.own->glsl = glsl;
  return copy;
}

/// One of each dimension, one of them with a way to move it.
std::vector<Copy> copies() {
  Copy circle = copy_of(ModelKind::circle2d, "float residual(vec2 x, float p[3]) { return distance(x, vec2(p[0], p[1])) - abs(p[2]); }");
  circle.own->residual = each_point([](Doubles x, Doubles p) { return std::hypot(x[0] - p[0], x[1] - p[1]) - std::abs(p[2]); });

  Copy plane = copy_of(ModelKind::plane, "float residual(vec3 x, float p[4]) { return dot(x, vec3(p[0], p[1], p[2])) + p[3]; }");
  plane.own->residual = each_point([](Doubles x, Doubles p) { return p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3]; });
  plane.own->recentre = [](Doubles centre, std::span<double> p) {
    for (std::size_t d = 0; d < 3; ++d) p[3] += p[d] * centre[d];
  };

  Copy sampson = copy_of(ModelKind::fundamental,
                         "float residual(vec4 x, float p[9]) {\n"
                         "  const mat3 f = transpose(mat3(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]));\n"
                         "  const vec3 there = f * vec3(x.xy, 1), back = vec3(x.zw, 1) * f;\n"
                         "  return dot(vec3(x.zw, 1), there) / length(vec4(there.xy, back.xy));\n"
                         "}\n");
  sampson.own->residual = each_point([](Doubles x, Doubles p) {
    const double there[3] = {p[0] * x[0] + p[1] * x[1] + p[2], p[3] * x[0] + p[4] * x[1] + p[5], p[6] * x[0] + p[7] * x[1] + p[8]};
    const double back[2] = {p[0] * x[2] + p[3] * x[3] + p[6], p[1] * x[2] + p[4] * x[3] + p[7]};
    const double gradient = there[0] * there[0] + there[1] * there[1] + back[0] * back[0] + back[1] * back[1];
    return (x[2] * there[0] + x[3] * there[1] + there[2]) / std::sqrt(gradient);
  });
  return {circle, plane, sampson};
}

/// Every back end once: what a processor's instruction set is makes no difference here.
std::vector<Contender> own_contenders() {
  std::vector<Contender> all = contenders(), kept;
  for (const Contender& contender : all) {
    const bool again =
        std::any_of(kept.begin(), kept.end(), [&](const Contender& k) { return k.backend == "cpu" && contender.backend == "cpu"; });
    if (!again) kept.push_back(contender);
  }
  return kept;
}

class Own : public Conformance {
 protected:
  /// An evaluator of the contender's kind for an own model, with the cloud and its caps.
  std::unique_ptr<FitnessEvaluator> evaluator_of(const Copy& copy, const Cloud& cloud) {
    EvaluatorOptions options = GetParam().options;
    options.own = copy.own;
    auto made = make_evaluator(GetParam().backend, options);
    if (!made) {
      ADD_FAILURE() << made.error().message;
      return nullptr;
    }
    EXPECT_OK(made->evaluator->set_points(cloud.view()));
    EXPECT_OK(made->evaluator->set_caps(cloud.caps));
    return std::move(made->evaluator);
  }
};
INSTANTIATE_TEST_SUITE_P(Conformance, Own, testing::ValuesIn(own_contenders()), contender_name);

std::vector<ModelView> views(ModelKind kind, std::span<const double> swarm, std::size_t width, std::size_t count) {
  std::vector<ModelView> all;
  for (std::size_t m = 0; m < count; ++m) all.push_back({kind, swarm.subspan(m * width, width)});
  return all;
}

TEST_P(Own, CostsAreThoseOfTheBuiltInKind) {
  for (const Copy& copy : copies()) {
    for (const std::size_t points : {17, 255, 1000, 5003, 40000}) {
      SCOPED_TRACE(copy.own->name + ", " + std::to_string(points) + " points");
      const Cloud cloud = make_cloud(copy.of, points, copy.own->recentre ? 300 : 0, 2);
      const std::vector<double> swarm = make_swarm(copy.of, 37, copy.own->recentre ? 300 : 0, 2);
      const auto own = evaluator_of(copy, cloud);
      ASSERT_NE(own, nullptr);
      load(cloud);
      for (const Loss loss : {Loss::truncated_l1, Loss::truncated_l2}) {
        Guarded<float> costs(37), expected(37);
        ASSERT_OK(own->evaluate({ModelKind::own, 37, swarm}, loss, {}, costs.span()));
        ASSERT_OK(reference().evaluate({copy.of, 37, swarm}, loss, {}, expected.span()));
        EXPECT_TRUE(costs.intact());
        for (std::size_t j = 0; j < 37; ++j) {
          const double off = std::abs(static_cast<double>(costs[j]) - static_cast<double>(expected[j])) / cloud.worst_loss(loss);
          note_error(GetParam().name, copy.own->name, off);
          EXPECT_LE(off, kCostTolerance) << "model " << j << ": " << costs[j] << ", must be " << expected[j];
        }
        // Below its cutoff a cost is exact, else between that and the truth.
        std::vector<float> cutoffs(37);
        for (std::size_t j = 0; j < 37; ++j) cutoffs[j] = costs[j] * (j % 2 == 0 ? 0.5F : 1.5F);
        Guarded<float> cut(37);
        ASSERT_OK(own->evaluate({ModelKind::own, 37, swarm}, loss, cutoffs, cut.span()));
        for (std::size_t j = 0; j < 37; ++j) {
          EXPECT_LE(cut[j], costs[j]);
          EXPECT_GE(cut[j], j % 2 == 0 ? cutoffs[j] : costs[j]);
        }
      }
    }
  }
}

TEST_P(Own, DistancesLabelsAndEvidenceAreThoseOfTheBuiltInKind) {
  for (const Copy& copy : copies()) {
    SCOPED_TRACE(copy.own->name);
    Cloud cloud = make_cloud(copy.of, 5003, 0, 2);
    const auto width = static_cast<std::size_t>(copy.own->parameter_count), columns = static_cast<std::size_t>(cloud.dimension);
    for (std::size_t i = 0; i < cloud.count(); i += 11) cloud.narrow[i * columns + 1] = std::numeric_limits<float>::quiet_NaN();
    const std::vector<double> swarm = make_swarm(copy.of, 9, 0, 2);
    const auto own = evaluator_of(copy, cloud);
    ASSERT_NE(own, nullptr);
    load(cloud);
    const auto mine = views(ModelKind::own, swarm, width, 9), theirs = views(copy.of, swarm, width, 9);
    Guarded<float> distances(cloud.count()), expected(cloud.count());
    ASSERT_OK(own->distances(mine[0], distances.span()));
    ASSERT_OK(reference().distances(theirs[0], expected.span()));
    EXPECT_TRUE(distances.intact());
    for (std::size_t i = 0; i < cloud.count(); ++i) {
      EXPECT_EQ(std::isnan(distances[i]), std::isnan(expected[i])) << i;
      if (!std::isnan(expected[i])) {
        EXPECT_NEAR(distances[i], expected[i], 1e-5F * (1 + expected[i])) << i;
      }
    }
    const float tolerance = 0.05F;
    Guarded<std::uint16_t> labels(cloud.count()), right(cloud.count());
    std::vector<Evidence> evidence(9), truth(9);
    const auto agree = [&] {
      std::size_t same = 0;
      for (std::size_t i = 0; i < cloud.count(); ++i) same += labels[i] == right[i] ? 1 : 0;
      EXPECT_GE(static_cast<double>(same), 0.999 * static_cast<double>(cloud.count()));
      EXPECT_TRUE(labels.intact());
    };
    ASSERT_OK(own->assign(mine, std::span(&tolerance, 1), labels.span()));
    ASSERT_OK(reference().assign(theirs, std::span(&tolerance, 1), right.span()));
    agree();
    ASSERT_OK(own->assign(mine, cloud.caps, labels.span()));
    ASSERT_OK(reference().assign(theirs, cloud.caps, right.span()));
    agree();
    const auto same_evidence = [&] {
      for (std::size_t m = 0; m < 9; ++m) {
        EXPECT_NEAR(static_cast<double>(evidence[m].count), static_cast<double>(truth[m].count),
                    2 + 1e-3 * static_cast<double>(truth[m].count));
        EXPECT_NEAR(evidence[m].cost, truth[m].cost, 1e-5 * truth[m].cost);
        EXPECT_NEAR(evidence[m].square, truth[m].square, 2e-2 * truth[m].square + 2 * 0.0025);
        EXPECT_NEAR(evidence[m].moments.weight, truth[m].moments.weight, 1e-2 * truth[m].moments.weight + 20);
      }
    };
    ASSERT_OK(own->claim(cloud.view(), {&tolerance, 1}, mine, labels.span(), evidence));
    ASSERT_OK(reference().claim(cloud.view(), {&tolerance, 1}, theirs, right.span(), truth));
    agree();
    same_evidence();
    std::vector<float> told(9 * cloud.count());
    ASSERT_OK(own->weigh(cloud.view(), {tolerance, 0.1F, {}}, mine, told, evidence));
    ASSERT_OK(reference().weigh(cloud.view(), {tolerance, 0.1F, {}}, theirs, {}, truth));
    same_evidence();
    for (std::size_t i = 0; i < cloud.count(); ++i) EXPECT_EQ(std::isnan(told[i]), std::isnan(expected[i]));
  }
}

TEST_P(Own, AResidualThatIsNoNumberIsOutOfReach) {
  Copy copy = copies().front();
  copy.own->residual = each_point([](Doubles x, Doubles p) { return x[0] > p[0] ? std::numeric_limits<double>::quiet_NaN() : 0.0; });
  copy.own->glsl = "float residual(vec2 x, float p[3]) { return x.x > p[0] ? uintBitsToFloat(0xFFC00000u) : 0.0; }";
  const Cloud cloud = make_cloud(copy.of, 3000, 0, 2);
  const auto own = evaluator_of(copy, cloud);
  ASSERT_NE(own, nullptr);
  const std::vector<double> model{0, 0, 0};
  double right = 0, squares = 0;
  for (std::size_t i = 0; i < cloud.count(); ++i) {
    if (!(cloud.narrow[2 * i] > 0)) continue;
    right += static_cast<double>(cloud.caps[i]);
    squares += static_cast<double>(cloud.caps[i]) * static_cast<double>(cloud.caps[i]);
  }
  float cost = 0;
  ASSERT_OK(own->evaluate({ModelKind::own, 1, model}, Loss::truncated_l1, {}, std::span(&cost, 1)));
  EXPECT_NEAR(static_cast<double>(cost), right, 1e-5 * right);
  ASSERT_OK(own->evaluate({ModelKind::own, 1, model}, Loss::truncated_l2, {}, std::span(&cost, 1)));
  EXPECT_NEAR(static_cast<double>(cost), squares, 1e-5 * squares);
  std::vector<float> distances(cloud.count());
  ASSERT_OK(own->distances({ModelKind::own, model}, distances));
  for (std::size_t i = 0; i < cloud.count(); ++i) EXPECT_EQ(std::isinf(distances[i]), cloud.narrow[2 * i] > 0) << i;
}

TEST_P(Own, KindsAreNotMixedUp) {
  const Copy copy = copies().front();
  const Cloud cloud = make_cloud(copy.of, 100, 0, 2);
  const auto own = evaluator_of(copy, cloud);
  ASSERT_NE(own, nullptr);
  load(cloud);
  const std::vector<double> swarm = make_swarm(copy.of, 2, 0, 2);
  std::vector<float> costs(2);
  EXPECT_TRUE(is_invalid(own->evaluate({copy.of, 2, swarm}, Loss::truncated_l1, {}, costs), {"circle2d", "own"}));
  EXPECT_TRUE(is_invalid(evaluator().evaluate({ModelKind::own, 2, swarm}, Loss::truncated_l1, {}, costs), {"own", "built in"}));
  // No more than that it cannot be: a model of no number costs infinitely much.
  const std::vector<double> nowhere{0, std::numeric_limits<double>::quiet_NaN(), 1};
  float cost = 0;
  ASSERT_OK(own->evaluate({ModelKind::own, 1, nowhere}, Loss::truncated_l1, {}, std::span(&cost, 1)));
  EXPECT_EQ(cost, std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
