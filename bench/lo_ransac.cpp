// Locally optimised RANSAC (Chum, Matas, Kittler 2003): each new best is improved by least squares on samples of its inliers.
#include "bench/sampling_fit.hpp"

namespace swarmfit::peers {
namespace {

constexpr std::size_t kInnerSamples = 10;  // of the paper
constexpr std::size_t kInnerSize = 14;
constexpr int kIterations = 4;
constexpr float kWidest = 3;  // thresholds, from which the iteration comes down to one

void optimise(Hypotheses& hypotheses) {
  std::vector<Plane> inner;
  const auto inliers = hypotheses.near(*hypotheses.best(), hypotheses.threshold());
  for (std::size_t k = 0; k < kInnerSamples; ++k) {
    if (const auto plane = hypotheses.least_squares(inliers, kInnerSize)) inner.push_back(*plane);
  }
  hypotheses.score(inner);
  Plane plane = *hypotheses.best();
  for (int k = 0; k <= kIterations; ++k) {
    const float width = kWidest - (kWidest - 1) * static_cast<float>(k) / kIterations;
    const auto support = hypotheses.near(plane, width * hypotheses.threshold());
    const auto better = hypotheses.least_squares(support, support.size());
    if (!better) return;
    plane = *better;
    hypotheses.score({&plane, 1});
  }
}

void search(Hypotheses& hypotheses) {
  while (!hypotheses.exhausted()) {
    const auto improved = hypotheses.score_batch();
    if (!improved) return;
    if (*improved) optimise(hypotheses);
  }
}

}  // namespace

SWARMFIT_CONTENDER(make_lo_ransac) { return make_sampling_fit("LO-RANSAC", "minimal samples in batches, each new best optimised", search); }

}  // namespace swarmfit::peers
