// Planes one after another with the library's own evaluator and refinement, the swarm exchanged for a search by random samples. What such
// a search may spend is what the swarm spent on the same cloud with the same seed.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "bench/contender.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::peers {

/// Hypotheses about the points that are looked at, and the best of them so far.
class Hypotheses {
 public:
  /// `points` are those the evaluator holds; `open` lists those that no plane has explained.
  Hypotheses(kernels::FitnessEvaluator& evaluator, std::span<const float> points, std::span<const std::uint32_t> open,
             std::span<const float> caps, float threshold, std::size_t budget, std::mt19937_64& random);

  /// The plane through three random open points; none where they lie on a line or nothing is open.
  std::optional<Plane> minimal_sample();
  /// Planes through minimal samples, kBatch of them, scored; whether the best has improved. None where nothing can be sampled.
  std::optional<bool> score_batch();
  /// The least-squares plane through `count` of `from`.
  std::optional<Plane> least_squares(std::span<const std::uint32_t> from, std::size_t count);
  /// Open points within `tolerance` of a plane.
  std::vector<std::uint32_t> near(const Plane& plane, float tolerance) const;

  /// Scores as many as the budget allows; whether the best has improved.
  bool score(std::span<const Plane> planes);
  const std::optional<Plane>& best() const noexcept { return best_; }
  float threshold() const noexcept { return threshold_; }
  std::size_t spent() const noexcept { return spent_; }
  bool exhausted() const noexcept { return spent_ >= budget_; }

 private:
  kernels::FitnessEvaluator& evaluator_;
  std::span<const float> points_;
  std::span<const std::uint32_t> open_;
  std::span<const float> caps_;
  float threshold_;
  std::size_t budget_, spent_ = 0;
  std::mt19937_64& random_;
  std::optional<Plane> best_;
  float best_cost_;
  std::vector<double> parameters_;
  std::vector<float> cutoffs_, costs_;
};

/// Looks for one plane until the budget is exhausted.
using Search = std::function<void(Hypotheses&)>;

/// Hypotheses scored together.
inline constexpr std::size_t kBatch = 100;

std::unique_ptr<Contender> make_sampling_fit(std::string name, std::string how, Search search);

}  // namespace swarmfit::peers
