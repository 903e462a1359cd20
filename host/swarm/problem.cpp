#include "host/swarm/problem.hpp"

#include <algorithm>
#include <limits>

#include "host/swarm/noise_model.hpp"

namespace swarmfit::swarm {
namespace {

constexpr int kFullRounds = 1;                             // of refinement on all points, where it was done on a part of them before
constexpr std::size_t kMostListed = std::size_t{1} << 20;  // points, of which distances are kept

Box box_of(const models::WorkingPoints& points) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  Box box{{kLargest, kLargest}, {-kLargest, -kLargest}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points.finite(i)) continue;
    const Eigen::Vector2d p = points.point<2>(i);
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box;
}

}  // namespace

Problem::Problem(kernels::FitnessEvaluator& of, std::span<const Kind> looked_for, const models::WorkingPoints& all, const Part& close,
                 std::uint64_t seed, std::span<const float> spread)
    : evaluator(of),
      kinds(looked_for),
      asked(static_cast<std::size_t>(std::count_if(kinds.begin(), kinds.end(), [](const Kind& kind) { return !kind.hidden; }))),
      points(all),
      settings(kinds.front().settings),
      random(seed),
      part(close.points),
      neighbours(close.neighbours),
      part_searched(settings.searches_part(points.finite_count())),
      tau(static_cast<float>(settings.threshold)),
      allowed(allowed_by(spread, tau)),
      ground{.evaluator = evaluator, .space = *kinds.front().space, .points = points, .tau = tau, .allowed = allowed},
      part_ground{.evaluator = evaluator, .space = *kinds.front().space, .points = points, .tau = tau, .part = &part} {
  if (!allowed.empty()) part.gather(allowed, part_allowed);
  part_ground.allow(part_allowed);
  if (points.dimension() == 2) box = box_of(points);
}

double Problem::strewn_along(std::size_t kind, const models::Position& theta) const {
  if (points.dimension() != 2 || !allowed.empty() || !(box.area() > 0)) return 0;
  const double slab = 2 * static_cast<double>(tau) / points.frame().scale;  // [working frame]
  // A line crosses a square as spread as they are once; of a curve what lies in the box counts.
  const double across = even_side(points.dimension()), within = space(kind).length_within(theta, box.low, box.high);
  return std::min(1.0, space(kind).closed_form() ? slab / across : slab * within / box.area());
}

std::span<const float> Problem::levelled(std::span<const float> values, std::vector<float>& room) const {
  return levelled(values, room, allowed);
}

std::span<const float> Problem::levelled(std::span<const float> values, std::vector<float>& room, std::span<const float> of_those) const {
  if (of_those.empty()) return values;
  room.resize(values.size());
  for (std::size_t i = 0; i < room.size(); ++i) room[i] = values[i] * (tau / of_those[i]);
  return room;
}

bool Problem::lists_distances() const noexcept { return points.size() <= kMostListed || kinds.size() > 1 || !allowed.empty(); }

int Problem::full_rounds() const noexcept { return part_searched ? kFullRounds : kMostRounds; }

bool Problem::may_share(std::size_t kind) const noexcept {
  if (!allowed.empty()) return false;
  return kinds.size() == 1 ? part_searched : points.dimension() == 3 && is_curved(space(kind).type());
}

std::size_t Problem::flat_kind(std::size_t curved) const noexcept {
  if (!is_curved(space(curved).type())) return kinds.size();
  if (hides_flat()) return kinds.size() - 1;
  const ModelType flat = flat_of(space(curved).type());
  const auto at = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.space->type() == flat; });
  return static_cast<std::size_t>(at - kinds.begin());
}

bool Problem::sharpens(const models::ModelSpace& of) const noexcept {
  const bool wanted = settings.joint && settings.sharpen && !is_curved(of.type()) && settings.loss == Loss::truncated_l1;
  const bool few = points.finite_count() <= kFewPoints;
  return wanted && few && !part_searched && !shares_out() && of.freedom() == of.minimal_sample();
}

float Problem::corner(const models::ModelSpace& of) const noexcept {
  if (shares_out()) return 1;
  return sharpens(of) ? 0 : ground.corner;
}

}  // namespace swarmfit::swarm
