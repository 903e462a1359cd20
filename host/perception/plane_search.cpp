#include "host/perception/plane_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/common/parallel.hpp"
#include "host/perception/stereo_planes.hpp"

namespace swarmfit::perception {
namespace {

constexpr double kThreshold = 0.01;               // [m] of planes, unless one is given
constexpr double kNormalSlack = 0.35;             // [rad] normals of cells are noisy
constexpr float kAlong = 0.9f;                    // cosine: a cell whose normal is farther off does not lie in the plane
constexpr double kAgreement = 0.5;                // share of a plane's cells that lie along it; less is clutter cut by a slab
constexpr double kContrast = 2;                   // of the density in a surface to that around it
constexpr std::size_t kCellsForDirection = 4096;  // at most, that planes of any direction are fitted to: the vertical needs no more
constexpr std::size_t kCellsForSurfaces = 8192;   // and level ones, which are refined on all points afterwards
constexpr std::size_t kFewCells = 10;             // fewer flat cells hold no surface
constexpr float kFringeOfPlane = 0.06f;           // [m] a surface reaches this far beyond the cells that tell its direction
constexpr float kFringeInStereo = 0.12f;          // [m] where few cells tell it
constexpr float kNoise = 0.0045f;                 // [1 / m] three deviations of a depth, over the range squared
constexpr int kPointsAtOnce = 16384;              // of a range that one thread works on
constexpr double kExtentMargin = 0.02;            // [m] things stand a little over the edge of what is seen of a table

/// The cells as a cloud for the fitter; `most` of them, evenly drawn, where there are more and their normals keep clutter away. Stereo's
/// small supports need every cell whose direction is known, and a share of the others.
std::vector<float> gather(const Overview& overview, const std::vector<std::uint32_t>& chosen, std::size_t most) {
  const std::size_t count = overview.has_normals() && !overview.stereo() ? std::min(chosen.size(), most) : chosen.size();
  std::vector<float> values;
  values.reserve(3 * count);
  std::size_t unknown = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto cell = chosen[k * chosen.size() / count];
    if (overview.stereo() && !overview.knows_normal(cell) && ++unknown % kWeightOfKnown != 0) continue;
    const Eigen::Vector3f& p = overview.cells.points[cell];
    values.insert(values.end(), p.data(), p.data() + 3);
  }
  return values;
}

LocalPlane to_local(const Model& model) { return {model.normal().cast<float>(), static_cast<float>(model.offset())}; }

/// Normal towards up, and from the grid's local frame to the data's.
void to_data_frame(Model& model, const Eigen::Vector3d& origin, const Eigen::Vector3d& up) {
  if (model.normal().dot(up) < 0) model.parameters = -model.parameters;
  model.parameters[3] -= model.normal().dot(origin);
  if (model.covariance.rows() != 4) return;
  Eigen::Matrix4d shift = Eigen::Matrix4d::Identity();
  shift.row(3).head<3>() = -origin.transpose();
  model.covariance = shift * model.covariance * shift.transpose();
}

struct Membership {
  std::size_t within = 0, along = 0;  // cells within tau that are flat, and those of them that lie along the plane
};

Membership count_members(const Overview& overview, const std::vector<std::uint32_t>& flat, const LocalPlane& plane, float tau) {
  Membership count;
  for (const auto i : flat) {
    // Of stereo's cells only those of known direction tell.
    if (std::abs(plane.height(overview.cells.points[i])) > tau || (overview.stereo() && !overview.knows_normal(i))) continue;
    ++count.within;
    count.along += overview.agrees(i, plane.normal, kAlong) ? 1 : 0;
  }
  return count;
}

bool is_clutter(const Membership& count) { return static_cast<double>(count.along) < kAgreement * static_cast<double>(count.within); }

/// Of a plane; none where it is a slab through clutter.
std::size_t cells_of(const Membership& count) { return is_clutter(count) ? 0 : count.along; }

bool lies_in(const Overview& overview, std::uint32_t cell, const LocalPlane& plane, float tau) {
  return std::abs(plane.height(overview.cells.points[cell])) <= tau && overview.agrees(cell, plane.normal, kAlong);
}

/// A fit with no model in it, for a frame in which there is nothing to fit to.
FitResult nothing(const Fitter& fitter, std::size_t points) {
  FitResult fit;
  fit.labels.assign(points, 0);
  fit.backend = fitter.backend();
  fit.seed = fitter.options().seed;
  fit.threshold = fitter.options().threshold.value_or(kThreshold);
  fit.stop_reason = "nothing flat to look at";
  return fit;
}

/// Labels of the cells: the nearest of the planes, where the cell lies along it.
std::vector<std::uint16_t> label_cells(const Overview& overview, const std::vector<std::uint32_t>& flat,
                                       const std::vector<LocalPlane>& planes, float tau) {
  std::vector<std::uint16_t> labels(overview.cells.size(), 0);
  for (const auto i : flat) {
    float nearest = tau;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      const float distance = std::abs(planes[k].height(overview.cells.points[i]));
      if (distance > nearest || !overview.agrees(i, planes[k].normal, kAlong)) continue;
      nearest = distance;
      labels[i] = static_cast<std::uint16_t>(k + 1);
    }
  }
  return labels;
}

/// Least squares over the cells with either label, the normal on the first one's side.
LocalPlane fit_both(const Overview& overview, const std::vector<std::uint16_t>& labels, std::size_t one, std::size_t other,
                    const LocalPlane& old) {
  std::vector<std::uint32_t> members;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == one || labels[i] == other) members.push_back(static_cast<std::uint32_t>(i));
  }
  return fit_plane(overview.cells.points, members, old.normal.cast<double>()).plane();
}

/// What joins two planes, where they are alike: most cells of the smaller lie within tau, or the sensor's noise at their range, of the
/// larger, and together they have more cells within tau than the larger alone.
std::optional<LocalPlane> common_plane(const Overview& overview, float tau, const std::vector<std::uint16_t>& labels,
                                       const std::vector<LocalPlane>& planes, std::size_t small, std::size_t large) {
  std::size_t cells = 0, near = 0, of_large = 0, of_both = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    of_large += labels[i] == large + 1 ? 1 : 0;
    if (labels[i] != small + 1) continue;
    const auto& p = overview.cells.points[i];
    ++cells;
    near += std::abs(planes[large].height(p)) <= std::max(tau, kNoise * p.squaredNorm()) ? 1 : 0;
  }
  if (2 * near <= cells) return std::nullopt;
  const LocalPlane both = fit_both(overview, labels, large + 1, small + 1, planes[large]);
  for (std::size_t i = 0; i < labels.size(); ++i)
    of_both += (labels[i] == small + 1 || labels[i] == large + 1) && std::abs(both.height(overview.cells.points[i])) <= tau ? 1 : 0;
  return of_both > of_large ? std::optional(both) : std::nullopt;
}

/// Far off a wavy depth gives one floor two planes: the larger takes the smaller.
void join_alike(const Overview& overview, float tau, std::vector<std::uint16_t>& labels, std::vector<LocalPlane>& planes,
                std::vector<Model>& models) {
  for (std::size_t large = 0; large < planes.size(); ++large)
    for (std::size_t small = 0; small < planes.size(); ++small) {
      if (small == large || models[small].inliers > models[large].inliers) continue;
      const auto both = common_plane(overview, tau, labels, planes, small, large);
      if (!both) continue;
      planes[large] = *both;
      models[large].parameters << both->normal.cast<double>(), static_cast<double>(both->offset);
      models[large].inliers += models[small].inliers;
      for (auto& label : labels) {
        if (label == small + 1) label = static_cast<std::uint16_t>(large + 1);
        if (label > small + 1) --label;
      }
      planes.erase(planes.begin() + static_cast<std::ptrdiff_t>(small));
      models.erase(models.begin() + static_cast<std::ptrdiff_t>(small));
      return join_alike(overview, tau, labels, planes, models);
    }
}

/// The surface from the cells that tell its direction, widened by the cells around them that lie in it.
Surface grow_surface(const Overview& overview, const std::vector<std::uint16_t>& labels, int model, const LocalPlane& plane, float tau) {
  const auto& points = overview.cells.points;
  Surface surface = lay_axes(plane, model);
  std::vector<Eigen::Vector2f> places, around;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (labels[i] == model && (!overview.stereo() || overview.knows_normal(i)))
      places.push_back(surface.place_of(points[i]));
    else if (std::abs(plane.height(points[i])) <= tau)  // nor where nothing was seen
      around.push_back(surface.place_of(points[i]));
  }
  if (!places.empty() && overview.has_normals()) {
    const float fringe = overview.stereo() ? kFringeInStereo : kFringeOfPlane;
    fill_surface(places, kExtentMargin + static_cast<double>(fringe), surface);
    const auto beside = surface.near_component(fringe);
    for (const auto& place : around)
      if (const int at = surface.cell_at(place); at >= 0 && beside[static_cast<std::size_t>(at)] != 0) places.push_back(place);
  }
  fill_surface(places, kExtentMargin, surface);
  return surface;
}

/// A surface is thin: there is more in it than above and below it. A slab through clutter or across a wall is not.
bool stands_out(const Overview& overview, const std::vector<std::uint32_t>& cells, const Surface& surface, float tau) {
  std::size_t within = 0, around = 0;
  for (const auto i : cells) {
    const auto& p = overview.cells.points[i];
    const float distance = std::abs(surface.plane.height(p));
    if (distance > 3 * tau || !surface.on_component(p)) continue;
    ++(distance <= tau ? within : around);
  }
  // The two bands around are twice as thick as the surface.
  return static_cast<double>(within) > kContrast * static_cast<double>(around) / 2;
}

/// Where normals are good at every cell they have kept clutter away; elsewhere it is told by what lies along the surface and around it.
bool is_surface(const Overview& overview, const std::vector<std::uint32_t>& cells, const Surface& surface, float tau) {
  if (overview.has_normals() && !overview.stereo()) return true;
  return stands_out(overview, cells, surface, tau) && (!overview.stereo() || lies_along(overview, surface, tau));
}

/// What a range of points adds to one plane.
struct Settled {
  std::size_t inliers = 0;
  double square = 0, saved = 0;  // of inliers' distances; of tau, by all points within it
};

std::vector<Settled> settle_range(const PointGrid& grid, const std::vector<Surface>& surfaces, float tau, std::size_t first,
                                  std::size_t last, std::vector<std::uint16_t>& labels) {
  std::vector<Settled> settled(surfaces.size());
  for (std::size_t i = first; i < last; ++i) {
    const auto& p = grid.points[i];
    float nearest = tau;
    std::uint16_t label = 0;
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      const float distance = std::abs(surfaces[k].plane.height(p));
      if (!(distance <= tau)) continue;  // nor where nothing was seen
      settled[k].saved += static_cast<double>(tau - distance);
      if (distance > nearest || !surfaces[k].on_component(p)) continue;
      nearest = distance;
      label = static_cast<std::uint16_t>(k + 1);
    }
    labels[i] = label;
    if (label == 0) continue;
    ++settled[label - 1u].inliers;
    settled[label - 1u].square += static_cast<double>(nearest) * static_cast<double>(nearest);
  }
  return settled;
}

/// Labels, inliers, cost and rms over all points of the frame.
void settle(const PointGrid& grid, const std::vector<Surface>& surfaces, int threads, FitResult& fit) {
  const auto tau = static_cast<float>(fit.threshold);
  const int count = static_cast<int>(grid.size());
  fit.labels.assign(grid.size(), 0);
  std::vector<std::vector<Settled>> parts(static_cast<std::size_t>((count + kPointsAtOnce - 1) / kPointsAtOnce));
  common::in_parallel(count, kPointsAtOnce, threads, [&](int first, int last) {
    parts[static_cast<std::size_t>(first / kPointsAtOnce)] =
        settle_range(grid, surfaces, tau, static_cast<std::size_t>(first), static_cast<std::size_t>(last), fit.labels);
  });
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    Settled sum;
    for (const auto& part : parts) {
      sum.inliers += part[k].inliers;
      sum.square += part[k].square;
      sum.saved += part[k].saved;
    }
    auto& model = fit.models[k];
    model.inliers = sum.inliers;
    model.cost = static_cast<double>(tau) * static_cast<double>(grid.finite) - sum.saved;
    model.rms = model.inliers == 0 ? 0 : std::sqrt(sum.square / static_cast<double>(model.inliers));
  }
}

void erase_models(FitResult& fit, std::vector<Surface>& surfaces, std::size_t least) {
  least = std::max<std::size_t>(least, 1);
  std::vector<std::uint16_t> number(fit.models.size() + 1, 0);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < fit.models.size(); ++k) {
    if (fit.models[k].inliers < least) continue;
    if (kept != k) {
      fit.models[kept] = std::move(fit.models[k]);
      surfaces[kept] = std::move(surfaces[k]);
    }
    ++kept;
    surfaces[kept - 1].model = static_cast<int>(kept);
    number[k + 1] = static_cast<std::uint16_t>(kept);
  }
  fit.models.resize(kept);
  surfaces.resize(kept);
  for (auto& label : fit.labels) label = number[label];
}

/// Those that are no clutter, upright; the others leave the result.
std::vector<LocalPlane> keep_planes(const std::vector<bool>& clutter, const Eigen::Vector3d& up, FitResult& fit) {
  std::vector<Model> models;
  std::vector<LocalPlane> planes;
  for (std::size_t k = 0; k < fit.models.size(); ++k) {
    if (clutter[k]) continue;
    if (fit.models[k].normal().dot(up) < 0) fit.models[k].parameters = -fit.models[k].parameters;
    planes.push_back(to_local(fit.models[k]));
    models.push_back(std::move(fit.models[k]));
  }
  fit.models = std::move(models);
  return planes;
}

/// All of them, by cells whose direction is known.
void refine_all_on_known(const Overview& overview, const std::vector<std::uint32_t>& flat, float tau, const Eigen::Vector3d& up,
                         double most_angle, std::vector<LocalPlane>& planes, FitResult& fit) {
  for (std::size_t k = 0; k < planes.size(); ++k) {
    planes[k] = refine_on_known(overview, flat, planes[k], tau, up, most_angle);
    fit.models[k].parameters << planes[k].normal.cast<double>(), static_cast<double>(planes[k].offset);
  }
}

/// What each plane holds, once those that are one surface are joined.
std::vector<Surface> surfaces_of(const Overview& overview, const std::vector<std::uint32_t>& flat, std::vector<LocalPlane> planes,
                                 int threads, FitResult& fit) {
  const auto tau = static_cast<float>(fit.threshold);
  auto labels = label_cells(overview, flat, planes, tau);
  if (overview.has_normals()) join_alike(overview, tau, labels, planes, fit.models);
  std::vector<Surface> surfaces(planes.size());
  common::in_parallel(static_cast<int>(planes.size()), 1, threads, [&](int first, int last) {
    for (int k = first; k < last; ++k) {
      surfaces[static_cast<std::size_t>(k)] = grow_surface(overview, labels, k + 1, planes[static_cast<std::size_t>(k)], tau);
    }
  });
  return surfaces;
}

}  // namespace

Expected<FitResult> find_any_planes(Fitter& fitter, const Overview& overview, const PlanesSuffice& suffice, const std::stop_token& stop) {
  const auto flat = flat_cells(overview);
  if (overview.has_normals() && flat.size() < kFewCells) return nothing(fitter, overview.cells.size());
  const auto values = gather(overview, flat, kCellsForDirection);
  const auto tau = static_cast<float>(fitter.options().threshold.value_or(kThreshold));
  std::vector<Model> counted;
  auto left = flat;
  const auto on_model = [&](const Model& model) {
    const auto plane = to_local(model);
    counted.push_back(model);
    counted.back().inliers = cells_of(count_members(overview, flat, plane, tau));
    std::erase_if(left, [&](std::uint32_t i) { return lies_in(overview, i, plane, tau); });
    return suffice(counted, left.size()) ? Verdict::stop : Verdict::go_on;
  };
  auto fitted = fitter.fit(PointsView(std::span<const float>(values), 3), on_model, stop);
  if (!fitted) return tl::unexpected(fitted.error());
  for (auto& model : fitted->models)
    model.inliers = cells_of(count_members(overview, flat, to_local(model), static_cast<float>(fitted->threshold)));
  std::erase_if(fitted->models, [](const Model& model) { return model.inliers == 0; });
  return fitted;
}

Expected<PlaneSearch> find_supports(Fitter& fitter, const PointGrid& grid, const Overview& overview, const Eigen::Vector3d& up,
                                    const PerceiveOptions& options, const ModelCallback& on_plane, const std::stop_token& stop,
                                    const std::vector<Model>& warm_start) {
  const auto least_cosine = static_cast<float>(std::cos(std::min(1.4, options.horizontal_angle + kNormalSlack)));
  const auto flat = flat_cells(overview, up.cast<float>(), least_cosine);
  PlaneSearch search;
  if (overview.has_normals() && flat.size() < kFewCells) {
    search.fit = nothing(fitter, grid.size());
    search.fit.finite_points = grid.finite;
    return search;
  }
  const auto values = gather(overview, flat, kCellsForSurfaces);
  const double block = static_cast<double>(overview.stride) * static_cast<double>(overview.stride) * static_cast<double>(flat.size()) /
                       static_cast<double>(std::max<std::size_t>(1, values.size() / 3));
  // A plane's border has no normals; so cells are given the benefit of the doubt here, and points are counted in the end.
  const double reasonable = 0.5 * options.min_plane_share * static_cast<double>(grid.finite) / block;
  const double tau = fitter.options().threshold.value_or(kThreshold);
  std::vector<bool> clutter;
  bool too_small = false;
  const auto on_model = [&](const Model& model) {
    too_small = static_cast<double>(model.inliers) < reasonable;
    if (too_small) return Verdict::stop;
    clutter.push_back(is_clutter(count_members(overview, flat, to_local(model), static_cast<float>(tau))));
    if (clutter.back() || !on_plane) return Verdict::go_on;
    Model told = model;
    to_data_frame(told, grid.origin, up);
    told.inliers = static_cast<std::size_t>(block * static_cast<double>(model.inliers));
    return on_plane(told);
  };
  auto fitted = fitter.fit(PointsView(std::span<const float>(values), 3), on_model, stop, warm_start);
  if (!fitted) return tl::unexpected(fitted.error());
  search.fit = std::move(*fitted);
  auto& fit = search.fit;
  fit.finite_points = grid.finite;
  clutter.resize(fit.models.size(), true);  // the one that was too small

  std::vector<LocalPlane> planes = keep_planes(clutter, up, fit);
  if (too_small) fit.stop_reason = "no plane of reasonable size is left";
  if (overview.stereo()) refine_all_on_known(overview, flat, static_cast<float>(tau), up, fitter.options().prior->max_angle, planes, fit);
  std::vector<Surface> surfaces = surfaces_of(overview, flat, std::move(planes), options.fit.threads, fit);
  settle(grid, surfaces, options.fit.threads, fit);
  const auto seen = overview.stereo() ? flat_cells(overview) : flat;  // also what lies across
  for (std::size_t k = 0; k < surfaces.size(); ++k)
    if (!is_surface(overview, seen, surfaces[k], static_cast<float>(fit.threshold))) fit.models[k].inliers = 0;
  erase_models(fit, surfaces, static_cast<std::size_t>(options.min_plane_share * static_cast<double>(grid.finite)));
  const auto supporting = choose_supporting(grid, surfaces, options.max_height);
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    to_data_frame(fit.models[k], grid.origin, up);
    fit.models[k].supporting = supporting[k];
    if (!supporting[k]) continue;
    surfaces[k].noise = measure_noise(grid, fit.labels, surfaces[k]);
    search.supports.push_back(std::move(surfaces[k]));
  }
  return search;
}

}  // namespace swarmfit::perception
