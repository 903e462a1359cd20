// FitOptions with every preset and default filled in.
#pragma once

#include <swarmfit/fit.hpp>

#include "host/models/working_points.hpp"

namespace swarmfit::swarm {

/// What a labelling costs, in units of what leaving one point unexplained costs.
struct LabelPrices {
  double smoothness = 0;  ///< two neighbours with different labels, for each of the two that counts the other among its nearest
  double model = 0;       ///< a model that is used at all
  double bend = 0;        ///< of tau: beyond it what a distance costs grows as its logarithm does; 0: it grows evenly
  double strewn = 0;      ///< share by which a model is dearer where neighbours agree no more than chance has it
};

/// Whom a particle follows beside itself.
enum class Topology {
  roulette,  ///< one of the last n global bests, Eq. (2)
  ring,      ///< the best of its neighbours' personal bests
};

struct Settings {
  int starters = 100;   ///< minimal samples that a swarm begins with; as many as particles where it is less
  int particles = 100;  ///< so many of them, the fittest, fly on
  int iterations = 200;
  int stall = 20;
  int eager_stall = 0;       ///< the same of the first swarms, until one of them finds nothing that pays; 0: all are alike
  int eager_starters = 0;    ///< theirs, where they end sooner; 0: as many as others have
  double inertia = 1.0;      ///< w of Eq. (1)
  double cognitive = 2.1;    ///< c1
  double social = 2.0;       ///< c2
  int roulette_length = 10;  ///< n of Eq. (2)
  Topology topology = Topology::roulette;
  int ring_radius = 2;            ///< neighbours on each side
  double local_share = 0;         ///< of the minimal samples that take nearby points, in [0, 1]
  double renewal_share = 0;       ///< of the particles that start anew from a sample at each step, in [0, 1]
  double still = 0;               ///< a global best that gains less than this share of the saving has not moved
  std::size_t search_points = 0;  ///< a larger cloud is searched on this many of its points; 0: on all
  std::size_t fit_points = 0;     ///< a larger cloud is thinned to this many points until the models are known; 0: never
  double stands_for = 1;          ///< points of the whole cloud for each that is fitted to
  Deflation deflation = Deflation::residual;
  double lambda = 10;          ///< Eq. (5)
  double dead_zone_slope = 2;  ///< kappa of residual deflation: how fast caps rise beyond the dead zone
  Loss loss = Loss::truncated_l1;
  int threads = 0;              ///< that move a swarm whose samples take long; 0: as many as the machine has
  int patience = 2;             ///< swarms in a row whose best does not pay before the fit ends
  int searches = 1;             ///< of the whole, one or two, whose models the joint end chooses from
  bool refine = true;           ///< least squares on the inliers of what converged
  bool joint = true;            ///< refine all models together at the end
  bool sharpen = true;          ///< where points are few, the joint end goes all the way to the least absolute deviations
  LabelPrices prices;           ///< of the joint end; where smoothness is 0 each point goes to the nearest model
  double threshold = 0.01;      ///< tau [data unit]
  std::size_t min_inliers = 0;  ///< resolved, >= 1

  /// Do swarms search a part of so many points?
  bool searches_part(std::size_t finite_points) const noexcept { return search_points > 0 && finite_points > search_points; }
};

/// Points that minimal samples are drawn from where swarms search all of a large cloud: enough to tell surfaces apart.
inline constexpr std::size_t kSampledFrom = 8192;

/// Columns of a point that the options ask for.
int columns_of(const FitOptions& options);

/// `finite_points`: of the whole cloud; `threshold` in the data's unit. `min_inliers` counts points of the thinned cloud where it is
/// thinned.
Settings resolve(const FitOptions& options, std::size_t finite_points, double threshold);

}  // namespace swarmfit::swarm
