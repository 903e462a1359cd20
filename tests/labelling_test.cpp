// The joint end's moves: each lowers the energy where labels and fits in turn are stuck, and none raises it.
#include <cmath>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "host/swarm/labelling.hpp"
#include "host/swarm/sampler.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::swarm {
namespace {

constexpr float kTau = 6;
constexpr std::size_t kEach = 60;

/// Points of a square of the first image that all move by the same way [px].
struct Patch {
  double left, shift_x, shift_y;
  std::size_t count;
};

class Moves : public testing::Test {
 protected:
  void show(std::initializer_list<Patch> patches, LabelPrices prices = {0.15, 5.5}) {
    rows_.clear();
    std::uint32_t n = 0;
    for (const Patch& patch : patches) {
      for (std::size_t i = 0; i < patch.count; ++i, ++n) {
        const auto w = random_.words(Draw::subset, 3, 0, n), e = random_.words(Draw::subset, 3, 1, n);
        const double x = patch.left + 100 * Random::unit(w[0]), y = 100 * Random::unit(w[1]);
        const double noise_x = Random::unit(e[0]) - 0.5, noise_y = Random::unit(e[1]) - 0.5;
        rows_.insert(rows_.end(), {x, y, x + patch.shift_x + noise_x, y + patch.shift_y + noise_y});
      }
    }
    points_ = models::WorkingPoints(PointsView(std::span<const double>(rows_), 4));
    evaluator_ = std::move(*kernels::make_reference_evaluator());
    part_ = std::make_unique<Part>(look_closely(points_, *space_, random_, kSampledFrom));
    ASSERT_TRUE(evaluator_->set_points(part_->points.view()));
    ground_ = std::make_unique<Ground>(Ground{.evaluator = *evaluator_, .space = *space_, .points = points_, .tau = kTau});
    labelling_ = std::make_unique<Labelling>(*ground_, part_->points, part_->neighbours, prices);
  }
  models::Position shifted(double x, double y) const {
    models::Position data(9);
    data << 1, 0, x, 0, 1, y, 0, 0, 1;
    return space_->from_data(data, points_.frame());
  }
  std::vector<models::Position> samples_of(std::initializer_list<std::size_t> owners) const {
    std::vector<float> marks(points_.size(), 0.0F);
    for (const std::size_t m : owners) labelling_->mark_owned(m, marks);
    Sampler sampler(points_, part_->points.index(), part_->neighbours, *space_, random_);
    EXPECT_TRUE(sampler.keep_to(marks));
    return sampler.draw_some(50, 2, 1);
  }
  std::vector<std::uint16_t> labels() const {
    std::vector<std::uint16_t> all(points_.size());
    labelling_->write(all);
    return all;
  }

  const Random random_{11};
  const std::unique_ptr<models::ModelSpace> space_ = models::make_space(ModelType::homography, {});
  std::vector<double> rows_;
  models::WorkingPoints points_;
  std::unique_ptr<kernels::FitnessEvaluator> evaluator_;
  std::unique_ptr<Part> part_;
  std::unique_ptr<Ground> ground_;
  std::unique_ptr<Labelling> labelling_;
};

TEST_F(Moves, AModelAcrossTwoSurfacesComesApart) {
  show({{0, 3, 0, kEach}, {130, -3, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(0, 0)}}));
  const double before = labelling_->energy();
  ASSERT_EQ(labelling_->models().size(), 1U);
  const auto divided = labelling_->split(0, samples_of({0}));
  ASSERT_TRUE(divided && *divided);
  EXPECT_LT(labelling_->energy(), before - 5);
  ASSERT_EQ(labelling_->models().size(), 2U);
  EXPECT_EQ(labelling_->kept(), (std::vector<std::size_t>{0, Labelling::kJoined}));
  const auto all = labels();
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], all[i < kEach ? 0 : kEach]) << i;
  EXPECT_NE(all.front(), all.back());
}

TEST_F(Moves, NoMoreModelsComeOfItThanWereAskedFor) {
  show({{0, 3, 0, kEach}, {130, -3, 0, kEach}});
  labelling_->bound(1);
  ASSERT_TRUE(labelling_->start({{shifted(0, 0)}}));
  const auto divided = labelling_->split(0, samples_of({0}));
  ASSERT_TRUE(divided);
  EXPECT_FALSE(*divided);
  const std::vector<models::Position> one{shifted(-3, 0)};
  const auto joined = labelling_->offer(one);
  ASSERT_TRUE(joined);
  EXPECT_FALSE(*joined);
  EXPECT_EQ(labelling_->models().size(), 1U);
}

TEST_F(Moves, WhereTimeIsUpWhatIsThereStays) {
  show({{0, 20, 0, kEach}, {130, -20, 0, kEach}});
  bool up = false;
  labelling_->stop_when([&] { return up; });
  ASSERT_TRUE(labelling_->start({{shifted(20, 0)}}));
  const double before = labelling_->energy();
  const auto labels_before = labels();
  const std::vector<models::Position> other{shifted(-20, 0)};
  up = true;
  auto joined = labelling_->offer(other);
  ASSERT_TRUE(joined);
  EXPECT_FALSE(*joined);
  EXPECT_EQ(labelling_->energy(), before);
  EXPECT_EQ(labels(), labels_before);
  up = false;
  joined = labelling_->offer(other);
  ASSERT_TRUE(joined);
  EXPECT_TRUE(*joined);
}

TEST_F(Moves, OtherModelsTakeThePlaceWhereTheyEndLower) {
  show({{0, 3, 0, kEach}, {130, -3, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(0, 0)}}));
  const double before = labelling_->energy();
  ASSERT_TRUE(labelling_->contend({{shifted(3, 0), shifted(-3, 0)}}));
  EXPECT_LT(labelling_->energy(), before - 5);
  EXPECT_EQ(labelling_->kept(), (std::vector<std::size_t>{Labelling::kJoined, Labelling::kJoined}));
  // Worse ones do not, and nothing changes.
  const double after = labelling_->energy();
  ASSERT_TRUE(labelling_->contend({{shifted(40, 0)}}));
  EXPECT_EQ(labelling_->energy(), after);
  EXPECT_EQ(labelling_->models().size(), 2U);
}

TEST_F(Moves, ModelsOfTheBeatenSideJoin) {
  // Each side has found one of two surfaces; the larger wins and the other's model comes along.
  show({{0, 8, 0, kEach}, {130, -8, 0, kEach / 2}});
  ASSERT_TRUE(labelling_->start({{shifted(-8, 0)}}));
  ASSERT_TRUE(labelling_->contend({{shifted(8, 0)}}));
  ASSERT_EQ(labelling_->models().size(), 2U);
  for (const std::uint16_t label : labels()) EXPECT_NE(label, 0);
}

TEST_F(Moves, NeighboursAgreeWhereModelsAreOfOneThingEach) {
  show({{0, 8, 0, kEach}, {130, -8, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(8, 0), shifted(-8, 0)}}));
  EXPECT_GT(labelling_->coherence(), 0.9);
  // Two that lie over each other: whose a point is says nothing of its neighbours.
  show({{0, 8, 0, kEach}, {0, -8, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(8, 0)}}));
  EXPECT_LT(labelling_->coherence(), 0.57);
}

TEST_F(Moves, ResidualsOfOneSurfaceAreNoiseAndOfTwoHaveAPattern) {
  show({{0, 3, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(3, 0)}}));
  EXPECT_GT(labelling_->evenness(0), 0.8);
  EXPECT_EQ(labelling_->evenness(7), 1.0) << "no points, no pattern";
  show({{0, 3, 0, kEach}, {130, -3, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(0, 0)}}));
  ASSERT_EQ(labelling_->models().size(), 1U);
  EXPECT_LT(labelling_->evenness(0), 0.6);
}

TEST_F(Moves, WhereNeighboursDisagreeAModelIsDearer) {
  constexpr double kPrice = 5.5, kMore = 0.5;
  const auto energy = [&](std::initializer_list<Patch> patches, double strewn) {
    show(patches, {0.15, kPrice, 0, strewn});
    EXPECT_TRUE(labelling_->start({{shifted(8, 0)}}));
    return labelling_->energy();
  };
  const std::initializer_list<Patch> apart{{0, 8, 0, kEach}, {330, -8, 0, kEach}}, mixed{{0, 8, 0, kEach}, {0, -8, 0, kEach}};
  EXPECT_EQ(energy(apart, kMore), energy(apart, 0));
  const double dearer = energy(mixed, kMore) - energy(mixed, 0);
  EXPECT_GT(dearer, kMore * kPrice / 2);
  EXPECT_LE(dearer, kMore * kPrice + 1e-9);
}

TEST_F(Moves, OneSurfaceDoesNotComeApart) {
  show({{0, 3, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(3, 0)}}));
  const double before = labelling_->energy();
  const auto divided = labelling_->split(0, samples_of({0}));
  ASSERT_TRUE(divided);
  EXPECT_FALSE(*divided);
  EXPECT_EQ(labelling_->energy(), before);
}

TEST_F(Moves, TwoModelsOfOneSurfaceBecomeOne) {
  // Each is right for its end of the surface and wrong for the other: fitted to its own points it stays so.
  show({{0, 0, 0, kEach}, {100, 0, 0, kEach}});
  models::Position left(9), right(9);
  left << 1, 0, 0, 0, 1.03, 0, 0, 0, 1;
  right << 1, 0, 0, 0, 0.97, 3, 0, 0, 1;
  ASSERT_TRUE(labelling_->start({{space_->from_data(left, points_.frame()), space_->from_data(right, points_.frame())}}));
  ASSERT_EQ(labelling_->models().size(), 2U);
  const double before = labelling_->energy();
  const auto joined = labelling_->join(0, 1, samples_of({0, 1}));
  ASSERT_TRUE(joined && *joined);
  EXPECT_LT(labelling_->energy(), before);
  EXPECT_EQ(labelling_->models().size(), 1U);
  EXPECT_EQ(labelling_->kept(), (std::vector<std::size_t>{0}));
  for (const std::uint16_t label : labels()) EXPECT_EQ(label, 1);
}

TEST_F(Moves, TwoSurfacesDoNotBecomeOne) {
  show({{0, 8, 0, kEach}, {100, -8, 0, kEach}});
  ASSERT_TRUE(labelling_->start({{shifted(8, 0), shifted(-8, 0)}}));
  EXPECT_GT(labelling_->border(0, 1), 0);
  EXPECT_EQ(labelling_->border(0, 1), labelling_->border(1, 0));
  const double before = labelling_->energy();
  const auto joined = labelling_->join(0, 1, samples_of({0, 1}));
  ASSERT_TRUE(joined);
  EXPECT_FALSE(*joined);
  EXPECT_EQ(labelling_->energy(), before);
  EXPECT_EQ(labelling_->models().size(), 2U);
}

TEST_F(Moves, AModelPulledAsideByOthersPointsIsReplaced) {
  // Least squares over both lies between them, where it keeps both; a sample of the many leaves the few out.
  show({{0, 0, 0, kEach}, {0, 7, 0, kEach / 2}});
  ASSERT_TRUE(labelling_->start({{shifted(7.0 / 3, 0)}}));
  const double before = labelling_->energy();
  const auto replaced = labelling_->replace(0, samples_of({0}));
  ASSERT_TRUE(replaced && *replaced);
  EXPECT_LT(labelling_->energy(), before);
  EXPECT_EQ(labelling_->models().size(), 1U);
  const Eigen::VectorXd data = space_->to_data(labelling_->models()[0], points_.frame());
  EXPECT_NEAR(data[2] / data[8], 0, 1);
}

TEST_F(Moves, AFewPointsThatMoveAlikeAreWorthTheirModel) {
  FitOptions options;
  options.model = ModelType::homography;
  show({{0, 0, 0, kEach}, {300, 25, 0, 7}}, resolve(options, kEach + 7, kTau).prices);
  ASSERT_TRUE(labelling_->start({{shifted(0, 0), shifted(25, 0)}}));
  ASSERT_TRUE(labelling_->drop());
  EXPECT_EQ(labelling_->models().size(), 2U);
}

TEST_F(Moves, ABentDistanceIsTauAtTauAndComesBack) {
  constexpr double kBend = 0.8;
  for (const double bend : {0.0, kBend}) {
    show({{0, 2, 0, kEach}, {300, 40, 0, kEach}}, {0.15, 5.5, bend});
    ASSERT_TRUE(labelling_->start({{shifted(2, 0)}}));
    std::vector<float> costs(points_.size());
    labelling_->costs(costs);
    for (std::size_t i = 0; i < kEach; ++i) EXPECT_LT(costs[i], 1) << i;  // as far as it is, [px]
    for (std::size_t i = kEach; i < costs.size(); ++i) EXPECT_NEAR(costs[i], kTau, 1e-4F * kTau) << i;
    double sum = 0;
    for (const float cost : costs) {
      const double far = static_cast<double>(cost / kTau);
      sum += bend > 0 ? std::log1p(far / bend) / std::log1p(1 / bend) : far;
    }
    EXPECT_NEAR(labelling_->energy(), sum + 5.5, 0.1);  // no neighbours of another label
  }
}

}  // namespace
}  // namespace swarmfit::swarm
