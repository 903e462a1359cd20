#include <algorithm>

#include <swarmfit/report.hpp>

namespace swarmfit {
namespace {

constexpr Eigen::Index kMostParticles = 64;  // of a step
constexpr std::size_t kMostSteps = 1500;     // of a search

}  // namespace

void SearchRecord::add(const SwarmStep& step) {
  particles_ = std::max(particles_, step.fitness.size());
  if (seen_++ % every_ != 0) return;
  const Eigen::Index kept = std::min(kMostParticles, step.positions.cols());
  steps_.push_back({step.type,
                    step.swarm,
                    step.step,
                    step.positions.leftCols(kept),
                    {step.fitness.begin(), step.fitness.begin() + kept},
                    step.best,
                    step.best_fitness,
                    step.nothing_explained});
  if (steps_.size() > kMostSteps) thin();
}

void SearchRecord::add(const Model& found) { found_.push_back({found, steps_.size()}); }

void SearchRecord::thin() {
  for (std::size_t k = 0; 2 * k < steps_.size(); ++k) {
    if (k > 0) steps_[k] = std::move(steps_[2 * k]);
  }
  steps_.resize((steps_.size() + 1) / 2);
  for (Found& found : found_) found.after = (found.after + 1) / 2;
  every_ *= 2;
}

}  // namespace swarmfit
