// What truncation and least absolute deviations cost in variance beside plain least squares, under Gaussian noise.
#pragma once

namespace swarmfit::swarm {

/// Deviation of a Gaussian whose values beyond +-`cut` are not seen, from the root mean square of those that are. Where these fill the cut
/// almost evenly no Gaussian is told from a background, and the largest that would be is given.
double untruncated_deviation(double rms, double cut);

/// Asymptotic variance of an M-estimate (Huber 1964) over that of least squares on all values, for the influence function that is z up to
/// `corner`, constant from there to `cut` and zero beyond; both in deviations of the noise, > 0. corner >= cut: truncated least squares;
/// corner -> 0: truncated least absolute deviations, pi / 2 where nothing is cut off.
double variance_beside_least_squares(double corner, double cut);

}  // namespace swarmfit::swarm
