// Whether a model pays for itself: enough points of its own, and more of them than chance would put there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "host/swarm/settings.hpp"
#include "kernels/point_tallies.hpp"

namespace swarmfit::swarm {

/// What a candidate explains of what nobody has explained yet.
struct Support {
  static constexpr std::size_t kSlabs = kernels::SlabCounts::kSlabs;
  std::size_t unexplained = 0;              ///< all unexplained points
  std::array<std::size_t, kSlabs> slabs{};  ///< those less than tau away, those from there to 2 tau, and so on
  double square = 0;                        ///< sum of the squared distances of the first slab [data unit^2]
  std::size_t inner = 0;                    ///< of the first slab, those less than tau / 2 away
  std::size_t beside = 0;                   ///< of the first slab, those less than kSlabs tau from what has been found
  std::size_t shared = 0;  ///< explained points less than tau away, and nearer than to what has been found and explains them

  std::size_t inliers() const noexcept { return slabs[0]; }
  /// What surrounds the model.
  std::size_t band() const noexcept { return slabs[1] + slabs[2]; }
};

/// Of tau: a point is unexplained while its cap is at least that.
inline constexpr float kUnexplained = 0.5F;

/// Of the points that a model must have: at least so many nobody else may explain; the others it may have from found models that it is
/// nearer to these points than.
inline constexpr double kOwnShare = 0.8;

/// What a model at these distances saves of what the points may cost, in the caps' unit.
using kernels::saved;

/// NaN distances count for nothing. `beside` and `nearest` are empty or one a point, as in Near (deflation.hpp), and without `nearest` no
/// point is shared; `before` is of the points that come before these.
Support count_support(std::span<const float> distances, std::span<const float> caps, float tau, std::span<const std::uint8_t> beside = {},
                      const Support& before = {}, std::span<const float> nearest = {});

/// Logarithm of the expected number of models as good as this among the surroundings' points (a-contrario; Chernoff's bound on the
/// binomial tail, background density from the band or from all slabs beyond the first, whichever is denser, one test for each minimal
/// sample of the points). Lower is more meaningful. `least_background`: points that surroundings put into a slab at least.
double log_false_alarms(const Support& support, int minimal_sample, double least_background = 0);

/// Two surfaces side by side are each other's surroundings, and neither would pay. So the ring from tau / 2 to tau may be the background as
/// well, where the candidate is not beside a found model: there, a peak may be a layer of that model's own noise. `strewn`, here and below:
/// share of the unexplained points that chance puts into a slab at least, however empty the surroundings.
bool pays(const Support& support, const Settings& settings, int minimal_sample, double strewn = 0);

/// The same by what surrounds the candidate alone, whose own ring says little once it was fitted to points that were chosen with it.
bool pays_among_others(const Support& support, const Settings& settings, int minimal_sample, double strewn = 0);

/// What was found and runs across the candidate has taken points of it, and as many of its surroundings. `whole` is its support by all
/// points, be they explained or not: the candidate pays by these where half of its points are nobody else's, and these alone nearly pay.
bool pays_across(const Support& support, const Support& whole, const Settings& settings, int minimal_sample, double strewn);

}  // namespace swarmfit::swarm
