// Every back end against the oracle: sizes around every vector, tile and chunk, then the clouds that hurt.
#include <algorithm>
#include <limits>

#include "conformance.hpp"

namespace swarmfit::kernels::conformance {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr Loss kLosses[] = {Loss::truncated_l1, Loss::truncated_l2};

class Costs : public Conformance {};
INSTANTIATE_TEST_SUITE_P(Conformance, Costs, testing::ValuesIn(contenders()), contender_name);

TEST_P(Costs, AgreeOnAllSizes) {
  for (const ModelKind kind : kModelKinds) {
    for (const std::size_t points : sizes(kind)) {
      const Cloud cloud = make_cloud(kind, points);
      load(cloud);
      for (const std::size_t particles : {1, 7, 64, 1000}) {
        // Not worth the time: the oracle against itself, what a GPU runs where there may be none, long sums of a dear residual.
        const bool slow = !traits(kind).affine || GetParam().backend == "reference" || GetParam().options.gpu_paths;
        if (slow && points * particles > 5000000) continue;
        SCOPED_TRACE(std::string(traits(kind).name) + ", " + std::to_string(points) + " points, " + std::to_string(particles) +
                     " particles");
        for (const Loss loss : kLosses) {
          // All of a small product, else enough particles to meet first, last and inner tiles.
          const std::size_t compared = points * particles <= 200000 ? particles : points > 100000 ? 5 : 12;
          expect_costs_agree(cloud, kind, make_swarm(kind, particles), loss, compared);
        }
      }
    }
  }
}

TEST_P(Costs, LeaveOutPointsThatAreNotFinite) {
  for (const ModelKind kind : kModelKinds) {
    Cloud cloud = make_cloud(kind, 5000);
    Random random(5);
    for (std::size_t i = 0; i < cloud.count(); ++i) {
      if (random() > 0.3) continue;
      const auto column = static_cast<std::size_t>(random() * cloud.dimension);
      cloud.narrow[i * static_cast<std::size_t>(cloud.dimension) + column] = i % 3 == 0 ? kInf : i % 3 == 1 ? -kInf : kNaN;
      cloud.caps[i] = i % 2 == 0 ? kNaN : -1.0F;  // not looked at
    }
    load(cloud);
    for (const Loss loss : kLosses) expect_costs_agree(cloud, kind, make_swarm(kind, 33), loss);
  }
}

TEST_P(Costs, AreZeroWithoutPoints) {
  Cloud cloud = make_cloud(ModelKind::plane, 100);
  std::fill(cloud.narrow.begin(), cloud.narrow.end(), kNaN);
  load(cloud);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 9);
  for (const float cost : costs(ModelKind::plane, swarm, Loss::truncated_l1)) EXPECT_EQ(cost, 0.0F);

  ASSERT_OK(evaluator().set_points({nullptr, Scalar::float32, 3, 0, 12}));
  ASSERT_OK(evaluator().set_caps({}));
  for (const float cost : costs(ModelKind::plane, swarm, Loss::truncated_l2)) EXPECT_EQ(cost, 0.0F);
  EXPECT_TRUE(costs(ModelKind::plane, {}, Loss::truncated_l1).empty());
}

TEST_P(Costs, AreZeroUnderZeroCaps) {
  for (const ModelKind kind : kModelKinds) {
    Cloud cloud = make_cloud(kind, 3001);
    ASSERT_OK(evaluator().set_points(cloud.view()));  // caps start at 0
    const std::vector<double> swarm = make_swarm(kind, 9);
    for (const float cost : costs(kind, swarm, Loss::truncated_l1)) EXPECT_EQ(cost, 0.0F);
    std::fill(cloud.caps.begin(), cloud.caps.end(), 0.0F);
    ASSERT_OK(evaluator().set_caps(cloud.caps));
    for (const float cost : costs(kind, swarm, Loss::truncated_l2)) EXPECT_EQ(cost, 0.0F);
  }
}

TEST_P(Costs, FollowEachPointsOwnCap) {
  Cloud cloud = make_cloud(ModelKind::plane, 20011);
  for (std::size_t i = 0; i < cloud.count(); ++i) cloud.caps[i] *= i % 4 == 0 ? 0.0F : i % 4 == 1 ? 1e-4F : i % 4 == 2 ? 1.0F : 100.0F;
  load(cloud);
  for (const Loss loss : kLosses) expect_costs_agree(cloud, ModelKind::plane, make_swarm(ModelKind::plane, 20), loss);
}

TEST_P(Costs, FollowNewCapsAndNewClouds) {
  Cloud cloud = make_cloud(ModelKind::plane, 9000);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 11);
  load(cloud);
  expect_costs_agree(cloud, ModelKind::plane, swarm, Loss::truncated_l1);
  for (std::size_t i = 0; i < cloud.count(); i += 2) cloud.caps[i] = 0;
  for (FitnessEvaluator* each : {&evaluator(), &reference()}) ASSERT_OK(each->set_caps(cloud.caps));
  expect_costs_agree(cloud, ModelKind::plane, swarm, Loss::truncated_l1);
  const Cloud flat = make_cloud(ModelKind::line2d, 70000);
  load(flat);
  expect_costs_agree(flat, ModelKind::line2d, make_swarm(ModelKind::line2d, 11), Loss::truncated_l1);
  const Cloud small = make_cloud(ModelKind::plane, 5);
  load(small);
  expect_costs_agree(small, ModelKind::plane, swarm, Loss::truncated_l2);
}

// Many equal caps are where plain float sums drift: every addition rounds the same way.
TEST_P(Costs, FollowCapsThatGoAndComeBack) {
  for (const ModelKind kind : kModelKinds) {
    const Cloud before = make_cloud(kind, 5000);
    Cloud cloud = before;
    load(cloud);
    const std::vector<double> swarm = make_swarm(kind, 64);
    const std::vector<float> all = costs(kind, swarm, Loss::truncated_l1);
    for (const double gone : {0.3, 0.97, 0.0, 0.6, 1.0, 0.0}) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", share of caps that are 0: " + std::to_string(gone));
      Random random(7);
      for (std::size_t i = 0; i < cloud.count(); ++i) cloud.caps[i] = random() < gone ? 0.0F : before.caps[i];
      ASSERT_OK(evaluator().set_caps(cloud.caps));
      ASSERT_OK(reference().set_caps(cloud.caps));
      for (const Loss loss : kLosses) expect_costs_agree(cloud, kind, swarm, loss, 12);
    }
    EXPECT_EQ(costs(kind, swarm, Loss::truncated_l1), all) << "where nothing is gone, nothing has changed";
  }
}

TEST_P(Costs, DoNotDriftOverEqualTerms) {
  for (const float cap : {0.01F, 0.013F, 0.1F}) {
    Cloud cloud = make_cloud(ModelKind::plane, 307200);
    std::fill(cloud.caps.begin(), cloud.caps.end(), cap);
    load(cloud);
    const std::vector<double> nowhere{0, 0, 1, 1000, 0, 0, 1, -3.0};
    for (const Loss loss : kLosses) expect_costs_agree(cloud, ModelKind::plane, nowhere, loss);
  }
}

TEST_P(Costs, HoldFarFromTheOrigin) {
  for (const ModelKind kind : kModelKinds) {
    const bool images = traits(kind).dimension == 4;
    const double middle = images ? 1e4 : 5e6, size = images ? 500 : 20;  // a window of a large image; UTM coordinates, in metres
    const Cloud cloud = make_cloud(kind, 20000, middle, size, false);
    load(cloud);
    for (const Loss loss : kLosses) expect_costs_agree(cloud, kind, make_swarm(kind, 16, middle, size), loss);
  }
}

TEST_P(Costs, HoldForDuplicates) {
  for (const ModelKind kind : kModelKinds) {
    Cloud cloud = make_cloud(kind, 1000);
    const auto width = static_cast<std::size_t>(cloud.dimension);
    for (std::size_t i = width; i < cloud.narrow.size(); ++i) cloud.narrow[i] = cloud.narrow[i - width];
    load(cloud);
    for (const Loss loss : kLosses) expect_costs_agree(cloud, kind, make_swarm(kind, 16), loss);
  }
}

TEST_P(Costs, AreTheCapsWhereNothingIsExplained) {
  const std::vector<double> nowhere[] = {{0, 0, 0, 0, 0, 0, 0, 0, 0}, {1, 2, 3, 2, 4, 6, 3, 6, 9}};
  const Cloud cloud = make_cloud(ModelKind::homography, 3001);
  load(cloud);
  for (const Loss loss : kLosses) {
    const double all = cloud.worst_loss(loss);
    for (const std::vector<double>& singular : nowhere) {
      EXPECT_NEAR(costs(ModelKind::homography, singular, loss)[0], all, kCostTolerance * all);
    }
    EXPECT_NEAR(costs(ModelKind::fundamental, nowhere[0], loss)[0], all, kCostTolerance * all);
  }
}

TEST_P(Costs, DoNotDependOnTheStride) {
  const Cloud packed = make_cloud(ModelKind::plane, 777);
  load(packed);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 10);
  const std::vector<float> expected = costs(ModelKind::plane, swarm, Loss::truncated_l1);

  std::vector<float> loose(777 * 8, kNaN);
  std::vector<double> wide(777 * 5, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < 777; ++i) {
    for (std::size_t d = 0; d < 3; ++d) loose[i * 8 + d] = packed.narrow[i * 3 + d];
    for (std::size_t d = 0; d < 3; ++d) wide[i * 5 + d] = static_cast<double>(packed.narrow[i * 3 + d]);
  }
  const PointsView views[] = {{loose.data(), Scalar::float32, 3, 777, 32}, {wide.data(), Scalar::float64, 3, 777, 40}};
  for (const PointsView& view : views) {
    ASSERT_OK(evaluator().set_points(view));
    ASSERT_OK(evaluator().set_caps(packed.caps));
    EXPECT_EQ(costs(ModelKind::plane, swarm, Loss::truncated_l1), expected);
  }
}

TEST_P(Costs, AreInfiniteForParametersThatAreNotFinite) {
  const Cloud cloud = make_cloud(ModelKind::plane, 500);
  load(cloud);
  std::vector<double> swarm = make_swarm(ModelKind::plane, 12);
  const std::vector<float> before = costs(ModelKind::plane, swarm, Loss::truncated_l1);
  for (std::size_t k = 0; k < 4; ++k) {
    swarm[(2 * k + 1) * 4 + k] = k % 2 == 0 ? std::numeric_limits<double>::quiet_NaN() : -std::numeric_limits<double>::infinity();
  }
  const std::vector<float> after = costs(ModelKind::plane, swarm, Loss::truncated_l1);
  for (std::size_t j = 0; j < 12; ++j) {
    const bool broken = j % 2 == 1 && j < 8;
    EXPECT_EQ(after[j], broken ? kInf : before[j]) << j;
  }
  ASSERT_OK(evaluator().set_points({nullptr, Scalar::float32, 3, 0, 12}));
  EXPECT_EQ(costs(ModelKind::plane, swarm, Loss::truncated_l1)[1], kInf);
}

TEST_P(Costs, KeepTheContractOfCutoffs) {
  for (const ModelKind kind : kModelKinds) {
    const Cloud cloud = make_cloud(kind, traits(kind).dimension <= 3 ? 30000 : 5000);
    load(cloud);
    const std::vector<double> swarm = make_swarm(kind, 40);
    for (const Loss loss : kLosses) {
      const double slack = 2 * kCostTolerance * cloud.worst_loss(loss);
      const std::vector<float> exact = expect_costs_agree(cloud, kind, swarm, loss, 40);
      std::vector<float> cutoffs;
      for (std::size_t j = 0; j < exact.size(); ++j) {
        const float around[] = {0.0F, 0.5F * exact[j], 0.99F * exact[j], exact[j], 1.01F * exact[j], 2 * exact[j], kInf};
        cutoffs.push_back(around[j % std::size(around)]);
      }
      const std::vector<float> found = costs(kind, swarm, loss, cutoffs);
      for (std::size_t j = 0; j < found.size(); ++j) {
        SCOPED_TRACE("model " + std::to_string(j) + ", cutoff " + std::to_string(cutoffs[j]));
        const bool beaten = static_cast<double>(exact[j]) + slack < static_cast<double>(cutoffs[j]);
        EXPECT_LE(found[j], exact[j] + slack);
        EXPECT_GE(found[j], beaten ? exact[j] - slack : std::min<double>(cutoffs[j], exact[j]) - slack);
      }
    }
  }
}

TEST_P(Costs, AreTheSameBytesEachTime) {
  const Cloud cloud = make_cloud(ModelKind::plane, 100003);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 65);
  load(cloud);
  const std::vector<float> first = costs(ModelKind::plane, swarm, Loss::truncated_l1);
  EXPECT_EQ(costs(ModelKind::plane, swarm, Loss::truncated_l1), first);
  const Cloud other = make_cloud(ModelKind::plane, 1234);
  load(other);
  costs(ModelKind::plane, swarm, Loss::truncated_l2);
  load(cloud);
  EXPECT_EQ(costs(ModelKind::plane, swarm, Loss::truncated_l1), first);
}

TEST_P(Costs, CountTheEffort) {
  Cloud cloud = make_cloud(ModelKind::plane, 1000);
  cloud.narrow[5] = kNaN;
  load(cloud);
  EXPECT_EQ(evaluator().effort().evaluations, 0U);
  costs(ModelKind::plane, make_swarm(ModelKind::plane, 7), Loss::truncated_l1);
  costs(ModelKind::plane, make_swarm(ModelKind::plane, 5), Loss::truncated_l1);
  EXPECT_EQ(evaluator().effort().evaluations, 12U);
  EXPECT_EQ(evaluator().effort().point_models, 12U * 999U);
  EXPECT_LE(evaluator().effort().touched, evaluator().effort().point_models);
  load(cloud);
  EXPECT_EQ(evaluator().effort().evaluations, 0U);
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
