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
  const Eigen::Index all = step.positions.cols(), kept = std::min(kMostParticles, all);
  Step shown{step.type, step.swarm, step.step,         Eigen::MatrixXd(step.positions.rows(), kept),
             {},        step.best,  step.best_fitness, step.nothing_explained};
  for (Eigen::Index k = 0; k < kept; ++k) {
    // Evenly, for the first half of the samples that a swarm begins with are local ones.
    const Eigen::Index j = k * all / kept;
    shown.positions.col(k) = step.positions.col(j);
    shown.fitness.push_back(step.fitness[static_cast<std::size_t>(j)]);
  }
  steps_.push_back(std::move(shown));
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
