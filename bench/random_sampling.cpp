// RANSAC at its plainest: minimal samples, scored in batches, the best wins.
#include "bench/sampling_fit.hpp"

namespace swarmfit::peers {
namespace {

void search(Hypotheses& hypotheses) {
  std::vector<Plane> batch;
  while (!hypotheses.exhausted()) {
    batch.clear();
    for (std::size_t tries = 0; tries < 10 * kBatch && batch.size() < kBatch; ++tries) {
      if (const auto plane = hypotheses.minimal_sample()) batch.push_back(*plane);
    }
    if (batch.empty()) return;
    hypotheses.score(batch);
  }
}

}  // namespace

SWARMFIT_CONTENDER(make_random_sampling) { return make_sampling_fit("random sampling", "minimal samples in batches", search); }

}  // namespace swarmfit::peers
