// RANSAC at its plainest: minimal samples, scored in batches, the best wins.
#include "bench/sampling_fit.hpp"

namespace swarmfit::peers {
namespace {

void search(Hypotheses& hypotheses) {
  while (!hypotheses.exhausted() && hypotheses.score_batch()) {
  }
}

}  // namespace

SWARMFIT_CONTENDER(make_random_sampling) { return make_sampling_fit("random sampling", "minimal samples in batches", search); }

}  // namespace swarmfit::peers
