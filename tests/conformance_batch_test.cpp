// Many small problems scored together cost what each costs alone, to the byte, on every back end.
#include <algorithm>
#include <limits>

#include "conformance.hpp"
#include "kernels/batch_evaluator.hpp"

namespace swarmfit::kernels::conformance {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Problem {
  ModelKind kind = ModelKind::plane;
  Cloud cloud;
  std::vector<double> swarm;
  std::vector<float> costs;

  Problem(ModelKind k, std::size_t points, std::size_t particles) : kind(k), cloud(make_cloud(k, points)), swarm(make_swarm(k, particles)) {
    costs.assign(particles, -1.0F);
  }
};

class Batch : public Conformance {
 protected:
  std::unique_ptr<BatchEvaluator> make(std::size_t problems) {
    auto made = make_batch_evaluator(GetParam().backend, GetParam().options, problems);
    if (made) return std::move(*made);
    ADD_FAILURE() << made.error().message;
    return nullptr;
  }

  static void load_all(BatchEvaluator& batch, const std::vector<Problem>& problems) {
    for (std::size_t p = 0; p < problems.size(); ++p) {
      ASSERT_OK(batch.set_points(p, problems[p].cloud.view()));
      ASSERT_OK(batch.set_caps(p, problems[p].cloud.caps));
    }
  }

  static std::vector<BatchItem> ask(std::vector<Problem>& problems, Loss loss) {
    std::vector<BatchItem> items;
    for (std::size_t p = 0; p < problems.size(); ++p) {
      Problem& one = problems[p];
      items.push_back({p, {one.kind, one.costs.size(), one.swarm}, loss, {}, one.costs});
    }
    return items;
  }

  /// Costs of a problem by itself on the same back end, each also within the tolerance of the reference.
  std::vector<float> alone(const Problem& problem, Loss loss) {
    load(problem.cloud);
    return expect_costs_agree(problem.cloud, problem.kind, problem.swarm, loss, 4);
  }
};
INSTANTIATE_TEST_SUITE_P(Conformance, Batch, testing::ValuesIn(contenders()), contender_name);

/// Of every kind and many sizes: around chunks and tiles, one chunk, several, and long ones.
std::vector<Problem> mixed_problems() {
  std::vector<Problem> problems;
  for (const ModelKind kind : kModelKinds) {
    for (const std::size_t points : {1, 5, 33, 300, 511, 513, 2500}) problems.emplace_back(kind, points, 7 + points % 40);
  }
  problems.emplace_back(ModelKind::plane, 0, 20);
  problems.emplace_back(ModelKind::line2d, 50, 1);
  problems.emplace_back(ModelKind::line2d, 300, 100);
  std::fill(problems.back().cloud.narrow.begin(), problems.back().cloud.narrow.begin() + 40, kNaN);
  problems.emplace_back(ModelKind::sphere, 64, 33);
  std::fill(problems.back().cloud.narrow.begin(), problems.back().cloud.narrow.end(), kNaN);  // none is finite
  return problems;
}

TEST_P(Batch, CostsAreThoseOfEachProblemAlone) {
  std::vector<Problem> problems = mixed_problems();
  const auto batch = make(problems.size());
  ASSERT_TRUE(batch);
  EXPECT_EQ(batch->identity().backend, GetParam().backend);
  EXPECT_EQ(batch->problems(), problems.size());
  load_all(*batch, problems);
  std::vector<std::vector<float>> expected[2];
  for (const Loss loss : {Loss::truncated_l1, Loss::truncated_l2}) {
    for (const Problem& one : problems) expected[static_cast<std::size_t>(loss)].push_back(alone(one, loss));
  }
  for (const Loss loss : {Loss::truncated_l1, Loss::truncated_l2}) {
    ASSERT_OK(batch->evaluate(ask(problems, loss)));
    for (std::size_t p = 0; p < problems.size(); ++p) EXPECT_EQ(problems[p].costs, expected[static_cast<std::size_t>(loss)][p]) << p;
  }
  for (std::size_t p = 0; p < problems.size(); ++p) EXPECT_EQ(batch->effort(p).evaluations, 2 * problems[p].costs.size());
}

TEST_P(Batch, IsFewSubmissions) {
  std::vector<Problem> problems;
  for (int p = 0; p < 40; ++p) problems.emplace_back(ModelKind::plane, 100 + static_cast<std::size_t>(p), 50);
  const auto batch = make(problems.size());
  ASSERT_TRUE(batch);
  load_all(*batch, problems);
  for (int step = 0; step < 3; ++step) ASSERT_OK(batch->evaluate(ask(problems, Loss::truncated_l1)));
  EXPECT_EQ(batch->submissions(), 3U);
}

TEST_P(Batch, AModelThatIsNoneCostsInfinitelyMuch) {
  std::vector<Problem> problems;
  for (const std::size_t points : {0, 100}) problems.emplace_back(ModelKind::plane, points, 3);
  const auto batch = make(problems.size());
  ASSERT_TRUE(batch);
  load_all(*batch, problems);
  for (Problem& one : problems) one.swarm[5] = std::numeric_limits<double>::infinity();
  ASSERT_OK(batch->evaluate(ask(problems, Loss::truncated_l1)));
  for (const Problem& one : problems) {
    load(one.cloud);
    EXPECT_EQ(one.costs, costs(one.kind, one.swarm, Loss::truncated_l1));
    EXPECT_EQ(one.costs[1], std::numeric_limits<float>::infinity());
  }
}

/// Problems come and go: what one was says nothing of what it is.
TEST_P(Batch, FollowsItsProblems) {
  std::vector<Problem> problems;
  for (const std::size_t points : {60, 200, 90}) problems.emplace_back(ModelKind::circle2d, points, 30);
  const auto batch = make(problems.size());
  ASSERT_TRUE(batch);
  load_all(*batch, problems);
  ASSERT_OK(batch->evaluate(ask(problems, Loss::truncated_l1)));
  // New caps for one, more points of another kind for another, and only these two ask.
  std::fill_n(problems[0].cloud.caps.begin(), 30, 0.0F);
  ASSERT_OK(batch->set_caps(0, problems[0].cloud.caps));
  const std::vector<float> before = problems[1].costs;
  problems[2] = Problem(ModelKind::cylinder, 3000, 25);
  ASSERT_OK(batch->set_points(2, problems[2].cloud.view()));
  ASSERT_OK(batch->set_caps(2, problems[2].cloud.caps));
  std::vector<BatchItem> items = ask(problems, Loss::truncated_l1);
  items.erase(items.begin() + 1);
  std::reverse(items.begin(), items.end());
  ASSERT_OK(batch->evaluate(items));
  EXPECT_EQ(problems[0].costs, alone(problems[0], Loss::truncated_l1));
  EXPECT_EQ(problems[2].costs, alone(problems[2], Loss::truncated_l1));
  ASSERT_OK(batch->evaluate(ask(problems, Loss::truncated_l1)));
  EXPECT_EQ(problems[1].costs, before);
}

TEST_P(Batch, RefusesWhatIsOutOfBounds) {
  std::vector<Problem> problems;
  for (int p = 0; p < 3; ++p) problems.emplace_back(ModelKind::plane, 50, 10);
  const auto batch = make(problems.size());
  ASSERT_TRUE(batch);
  EXPECT_TRUE(is_invalid(batch->set_points(3, problems[0].cloud.view()), {"problem", "3"}));
  EXPECT_TRUE(is_invalid(batch->set_caps(3, problems[0].cloud.caps), {"problem", "3"}));
  load_all(*batch, problems);
  EXPECT_TRUE(is_invalid(batch->set_caps(1, std::span(problems[0].cloud.caps).first(49)), {"caps", "49", "50"}));
  std::vector<BatchItem> items = ask(problems, Loss::truncated_l1);
  items[2].problem = 3;
  EXPECT_TRUE(is_invalid(batch->evaluate(items), {"problem", "3"}));
  items[2].problem = 0;
  EXPECT_TRUE(is_invalid(batch->evaluate(items), {"problem 0", "twice"}));
  items[2].problem = 2;
  items[2].swarm.kind = ModelKind::line2d;
  EXPECT_TRUE(is_invalid(batch->evaluate(items), {"line2d", "dimension"}));
  ASSERT_OK(batch->evaluate(ask(problems, Loss::truncated_l1)));
  EXPECT_EQ(problems[1].costs, alone(problems[1], Loss::truncated_l1));
  EXPECT_TRUE(is_invalid(make_batch_evaluator(GetParam().backend, GetParam().options, 0).map([](auto&&) {}), {"problems", "0"}));
}

/// What does not fit one submission goes in several.
class VulkanBatches : public Batch {};
INSTANTIATE_TEST_SUITE_P(Conformance, VulkanBatches, testing::ValuesIn(contenders("vulkan")), contender_name);

TEST_P(VulkanBatches, SplitWhereTheDevicesRangeIsSmall) {
  std::vector<Problem> problems;
  for (int p = 0; p < 30; ++p) problems.emplace_back(ModelKind::plane, 60, 200);
  EvaluatorOptions options = GetParam().options;
  options.max_storage_range = 300000;  // 30 problems' points, and 18 swarms
  const auto made = make_batch_evaluator("vulkan", options, problems.size());
  ASSERT_TRUE(made) << made.error().message;
  load_all(**made, problems);
  ASSERT_OK((*made)->evaluate(ask(problems, Loss::truncated_l1)));
  EXPECT_GE((*made)->submissions(), 2U);
  EXPECT_LT((*made)->submissions(), 10U);
  for (const Problem& one : problems) EXPECT_EQ(one.costs, alone(one, Loss::truncated_l1));
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
