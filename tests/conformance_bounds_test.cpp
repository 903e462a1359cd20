// Arguments out of bounds: `invalid`, with the field, its value and its bound; nothing written; and the evaluator works on.
#include <algorithm>
#include <limits>

#include "conformance.hpp"

namespace swarmfit::kernels::conformance {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

class Bounds : public Conformance {
 protected:
  void SetUp() override {
    Conformance::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    cloud_ = make_cloud(ModelKind::plane, 20);
    load(cloud_);
  }
  const Cloud& cloud() const { return cloud_; }

 private:
  Cloud cloud_;
};
INSTANTIATE_TEST_SUITE_P(Conformance, Bounds, testing::ValuesIn(contenders()), contender_name);

TEST_P(Bounds, OfPoints) {
  PointsView view = cloud().view();
  view.dimension = 1;
  EXPECT_TRUE(is_invalid(evaluator().set_points(view), {"dimension", "1", "2"}));
  view.dimension = 5;
  EXPECT_TRUE(is_invalid(evaluator().set_points(view), {"dimension", "5", "4"}));
  view.dimension = 3;
  view.count = std::size_t{1} << 31;
  EXPECT_TRUE(is_invalid(evaluator().set_points(view), {"count", "2147483648", "2147483647"}));
  view = cloud().view();
  view.data = nullptr;
  EXPECT_TRUE(is_invalid(evaluator().set_points(view), {"data"}));
}

TEST_P(Bounds, OfCaps) {
  std::vector<float> caps = cloud().caps;
  caps.pop_back();
  EXPECT_TRUE(is_invalid(evaluator().set_caps(caps), {"caps", "19", "20"}));
  caps.resize(21, 1.0F);
  EXPECT_TRUE(is_invalid(evaluator().set_caps(caps), {"caps", "21", "20"}));
  for (const float bad : {-0.5F, kNaN, kInf, -kInf}) {
    caps = cloud().caps;
    caps[13] = bad;
    EXPECT_TRUE(is_invalid(evaluator().set_caps(caps), {"caps[13]", ">= 0"})) << bad;
  }
}

TEST_P(Bounds, OfSwarms) {
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 3);
  Guarded<float> out(3, -7.0F);
  const auto evaluate = [&](ModelKind kind, std::size_t count, std::size_t numbers, std::span<const float> cutoffs, std::size_t costs) {
    const SwarmView view{kind, count, std::span(swarm).first(numbers)};
    const Result<> result = evaluator().evaluate(view, Loss::truncated_l1, cutoffs, out.span().first(costs));
    EXPECT_TRUE(out.intact());
    for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(out[j], -7.0F);
    return result;
  };
  EXPECT_TRUE(is_invalid(evaluate(ModelKind::plane, 3, 11, {}, 3), {"parameters", "11", "12"}));
  EXPECT_TRUE(is_invalid(evaluate(ModelKind::plane, 3, 12, {}, 2), {"costs", "2", "3"}));
  const std::vector<float> cutoffs{1, 2};
  EXPECT_TRUE(is_invalid(evaluate(ModelKind::plane, 3, 12, cutoffs, 3), {"cutoffs", "2", "3"}));
  EXPECT_TRUE(is_invalid(evaluate(ModelKind::line2d, 3, 9, {}, 3), {"line2d", "dimension", "2", "3"}));
}

TEST_P(Bounds, OfDistances) {
  const std::vector<double> model = make_swarm(ModelKind::plane, 1);
  Guarded<float> out(20, -7.0F);
  EXPECT_TRUE(is_invalid(evaluator().distances({ModelKind::plane, model}, out.span().first(19)), {"distances", "19", "20"}));
  EXPECT_TRUE(is_invalid(evaluator().distances({ModelKind::plane, std::span(model).first(3)}, out.span()), {"parameters", "3", "4"}));
  EXPECT_TRUE(is_invalid(evaluator().distances({ModelKind::line2d, std::span(model).first(3)}, out.span()), {"line2d", "dimension"}));
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(out[i], -7.0F);
}

TEST_P(Bounds, OfAssign) {
  const std::vector<double> plane = make_swarm(ModelKind::plane, 1);
  const std::vector<ModelView> one{{ModelKind::plane, plane}};
  std::vector<float> tolerance(20, 1.0F);
  Guarded<std::uint16_t> out(20, 7);
  EXPECT_TRUE(is_invalid(evaluator().assign(one, tolerance, out.span().first(19)), {"labels", "19", "20"}));
  EXPECT_TRUE(is_invalid(evaluator().assign(one, std::span(tolerance).first(5), out.span()), {"tolerance", "5", "20"}));
  EXPECT_TRUE(is_invalid(evaluator().assign(one, {}, out.span()), {"tolerance", "0", "20"}));
  for (const float bad : {-1.0F, kNaN}) {
    tolerance[11] = bad;
    EXPECT_TRUE(is_invalid(evaluator().assign(one, tolerance, out.span()), {"tolerance[11]", ">= 0"}));
    EXPECT_TRUE(is_invalid(evaluator().assign(one, std::span(tolerance).subspan(11, 1), out.span()), {"tolerance[0]"}));
  }
  tolerance[11] = 1;
  const std::vector<ModelView> broken{one[0], {ModelKind::plane, std::span(plane).first(2)}};
  EXPECT_TRUE(is_invalid(evaluator().assign(broken, tolerance, out.span()), {"parameters", "2", "4"}));
  const std::vector<ModelView> many(65535, one[0]);
  EXPECT_TRUE(is_invalid(evaluator().assign(many, tolerance, out.span()), {"models", "65535", "65534"}));
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(out[i], 7);
}

TEST_P(Bounds, AreNoTrap) {
  PointsView view = cloud().view();
  view.dimension = 9;
  EXPECT_FALSE(evaluator().set_points(view));
  load(cloud());
  expect_costs_agree(cloud(), ModelKind::plane, make_swarm(ModelKind::plane, 5), Loss::truncated_l1);
}

TEST_P(Bounds, EveryKindIsSupported) {
  for (const ModelKind kind : kModelKinds) {
    const Support support = evaluator().supports({kind, 307200, 1000});
    EXPECT_TRUE(support) << traits(kind).name << ": " << support.reason;
  }
  EXPECT_EQ(evaluator().identity().backend, GetParam().backend);
  EXPECT_FALSE(evaluator().identity().device.empty());
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
