// The whole chain: vertical, supporting planes, pop-out, objects, outlines, names.
#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/perception.hpp>

#include "host/perception/grid.hpp"
#include "host/perception/objects.hpp"
#include "host/perception/popout.hpp"
#include "host/perception/recognition.hpp"
#include "host/perception/segmentation.hpp"
#include "host/perception/surface.hpp"
#include "host/perception/vertical.hpp"

namespace swarmfit {
namespace {

using perception::PointGrid;
using perception::Surface;

constexpr std::size_t kPlanesOfFirstView = 6;  // enough to see which direction the room's planes share
constexpr double kExtentMargin = 0.02;         // [m] things stand a little over the edge of what is seen of a table
constexpr double kFullFrame = 640.0 * 480.0;   // min_soi_points is for a frame of this size

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double, std::milli>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Smaller pieces than this are debris: the option holds for a full frame and shrinks or grows with the number of points.
std::size_t scaled_min_points(const PointGrid& grid, std::size_t min_soi_points) {
  const double share = static_cast<double>(grid.size()) / kFullFrame;
  return std::max<std::size_t>(1, static_cast<std::size_t>(share * static_cast<double>(min_soi_points)));
}

/// Normals towards up. The covariance of -p is that of p.
void turn_up(std::vector<Model>& models, const Eigen::Vector3d& up) {
  for (auto& model : models)
    if (model.normal().dot(up) < 0) model.parameters = -model.parameters;
}

perception::LocalPlane to_local(const Model& model, const PointGrid& grid) {
  return {model.normal().cast<float>(), static_cast<float>(model.offset() + model.normal().dot(grid.origin))};
}

/// A plane keeps the points of its surfaces, but for what belongs to things that stand on it.
void settle_labels(const PointGrid& grid, const std::vector<Surface>& supports, const std::vector<std::uint16_t>& objects, FitResult& fit) {
  std::vector<const Surface*> support_of(fit.models.size() + 1, nullptr);
  for (const auto& surface : supports) support_of[static_cast<std::size_t>(surface.model)] = &surface;
  for (auto& model : fit.models) model.inliers = 0;
  for (std::size_t i = 0; i < fit.labels.size(); ++i) {
    auto& label = fit.labels[i];
    if (label == 0) continue;
    if (const Surface* surface = support_of[label]; surface != nullptr) {
      const int cell = surface->cell_of(grid.points[i]);
      if (objects[i] != 0 || cell < 0 || surface->component[static_cast<std::size_t>(cell)] == 0) label = 0;
    }
    if (label != 0) ++fit.models[label - 1u].inliers;
  }
}

}  // namespace

struct Perceiver::State {
  PerceiveOptions options;
  std::optional<perception::Vertical> vertical;
  std::optional<Fitter> free_fitter;     ///< any plane, until the vertical is known
  std::optional<Fitter> support_fitter;  ///< horizontal planes
  std::optional<perception::Gallery> gallery;

  Expected<> make_support_fitter();
  Expected<> find_vertical(const Cloud& frame, const PointGrid& grid, const std::stop_token& stop, PerceiveResult& result);
  Expected<> fit_supports(const Cloud& frame, const PointGrid& grid, const ModelCallback& on_plane, const std::stop_token& stop,
                          PerceiveResult& result);
  std::vector<Surface> supporting_surfaces(const PointGrid& grid, FitResult& fit) const;
  void find_objects(const PointGrid& grid, const std::vector<Surface>& supports, PerceiveResult& result) const;
};

Expected<> Perceiver::State::make_support_fitter() {
  FitOptions fit = options.fit;
  fit.prior = DirectionPrior{vertical->up, options.horizontal_angle};
  auto made = Fitter::create(fit);
  if (!made) return tl::unexpected(made.error());
  support_fitter.emplace(std::move(*made));
  return {};
}

Expected<> Perceiver::State::find_vertical(const Cloud& frame, const PointGrid& grid, const std::stop_token& stop, PerceiveResult& result) {
  if (vertical) return {};
  auto planes = free_fitter->fit(frame.points(), {}, stop);
  if (!planes) return tl::unexpected(planes.error());
  vertical = perception::vertical_from_planes(grid, planes->models, options.horizontal_angle);
  if (vertical) {
    free_fitter.reset();
    return make_support_fitter();
  }
  // Nothing flat in this view; the next one may have it.
  planes->models.clear();
  planes->labels.assign(frame.size(), 0);
  result.fit = std::move(*planes);
  return {};
}

Expected<> Perceiver::State::fit_supports(const Cloud& frame, const PointGrid& grid, const ModelCallback& on_plane,
                                          const std::stop_token& stop, PerceiveResult& result) {
  const double reasonable = options.min_plane_share * static_cast<double>(grid.finite);
  bool too_small = false;
  const auto on_model = [&](const Model& model) {
    too_small = static_cast<double>(model.inliers) < reasonable;
    if (too_small) return Verdict::stop;
    return on_plane ? on_plane(model) : Verdict::go_on;
  };
  auto fitted = support_fitter->fit(frame.points(), on_model, stop);
  if (!fitted) return tl::unexpected(fitted.error());
  result.fit = std::move(*fitted);
  if (!too_small) return {};
  const auto last = result.fit.models.size();
  result.fit.models.pop_back();
  for (auto& label : result.fit.labels)
    if (label == last) label = 0;
  result.fit.stop_reason = "no plane of reasonable size is left";
  return {};
}

std::vector<Surface> Perceiver::State::supporting_surfaces(const PointGrid& grid, FitResult& fit) const {
  std::vector<Surface> surfaces, supports;
  for (std::size_t k = 0; k < fit.models.size(); ++k)
    surfaces.push_back(perception::make_surface(grid, fit.labels, static_cast<int>(k + 1), to_local(fit.models[k], grid), kExtentMargin));
  const auto supporting = perception::choose_supporting(surfaces, options.max_height);
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    fit.models[k].supporting = supporting[k];
    if (supporting[k]) supports.push_back(std::move(surfaces[k]));
  }
  return supports;
}

void Perceiver::State::find_objects(const PointGrid& grid, const std::vector<Surface>& supports, PerceiveResult& result) const {
  const auto min_points = scaled_min_points(grid, options.min_soi_points);
  // Debris beside a larger thing is part of it, a handle for example; so small groups are dropped after the grouping.
  const auto least_group = grid.organised() ? std::max<std::size_t>(1, min_points / 10) : min_points;
  const auto popout = perception::pop_out(grid, supports, {options.min_height, options.max_height, options.flood_step, least_group});
  perception::ObjectLabels objects{popout.group, popout.support};
  if (grid.organised()) {
    double noise = 0;
    for (const auto& surface : supports) noise = std::max(noise, surface.noise);
    objects = perception::separate(grid, popout, {options.flood_step, noise, result.up.cast<float>()});
    std::vector<std::uint8_t> on_support(grid.size(), 0);
    for (std::size_t i = 0; i < grid.size(); ++i)
      on_support[i] = result.fit.labels[i] != 0 && result.fit.models[result.fit.labels[i] - 1u].supporting;
    perception::fill_basins(grid, on_support, objects);
  }
  std::vector<int> models;
  for (const auto& surface : supports) models.push_back(surface.model);
  result.sois = perception::make_spaces(grid, models, min_points, options.soi_margin, objects);
  result.popout = std::move(objects.of_point);
}

Perceiver::Perceiver(std::unique_ptr<State> state) : state_(std::move(state)) {}
Perceiver::~Perceiver() = default;
Perceiver::Perceiver(Perceiver&&) noexcept = default;
Perceiver& Perceiver::operator=(Perceiver&&) noexcept = default;

Expected<Perceiver> Perceiver::create(const PerceiveOptions& options) {
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  auto state = std::make_unique<State>();
  state->options = options;
  if (options.gravity) state->vertical = perception::vertical_from_gravity(*options.gravity);
  if (options.camera_tilt) state->vertical = perception::vertical_from_tilt(*options.camera_tilt);
  if (state->vertical) {
    if (auto ok = state->make_support_fitter(); !ok) return tl::unexpected(ok.error());
  } else {
    FitOptions fit = options.fit;
    fit.prior.reset();
    fit.max_models = kPlanesOfFirstView;
    auto made = Fitter::create(fit);
    if (!made) return tl::unexpected(made.error());
    state->free_fitter.emplace(std::move(*made));
  }
  if (!options.gallery.empty()) {
    auto loaded = perception::Gallery::load(options.gallery);
    if (!loaded) return tl::unexpected(loaded.error());
    state->gallery.emplace(std::move(*loaded));
  }
  return Perceiver(std::move(state));
}

Expected<PerceiveResult> Perceiver::perceive(const Cloud& frame, const ModelCallback& on_plane, std::stop_token stop) try {
  if (frame.dimension != 3)
    return fail(Error::Kind::bad_input, fmt::format("the cloud has {} columns, must have 3 to perceive", frame.dimension));
  Stopwatch whole, stage;
  PerceiveResult result;
  const auto grid = perception::make_grid(frame);
  if (auto ok = state_->find_vertical(frame, grid, stop, result); !ok) return tl::unexpected(ok.error());
  result.vertical_source = state_->vertical ? state_->vertical->source : "dominant plane";
  result.popout.assign(frame.size(), 0);
  std::vector<Surface> supports;
  if (state_->vertical) {
    result.up = state_->vertical->up;
    if (auto ok = state_->fit_supports(frame, grid, on_plane, stop, result); !ok) return tl::unexpected(ok.error());
    turn_up(result.fit.models, result.up);
    supports = state_->supporting_surfaces(grid, result.fit);
  }
  result.timing_ms.fit = stage.lap();
  if (!supports.empty() && !stop.stop_requested()) state_->find_objects(grid, supports, result);
  settle_labels(grid, supports, result.popout, result.fit);
  result.timing_ms.popout = stage.lap();
  if (frame.organised() && frame.coloured() && !stop.stop_requested()) {
    result.objects = perception::segment_objects({frame, result.fit.labels, result.popout, result.sois}, state_->options);
    result.timing_ms.segment = stage.lap();
    if (state_->gallery) {
      const auto names = state_->gallery->recognise(frame, result.objects, result.sois.size());
      for (std::size_t k = 0; k < result.sois.size() && k < names.size(); ++k) result.sois[k].recognised = names[k];
      result.timing_ms.recognise = stage.lap();
    }
  } else if (frame.organised()) {
    result.objects = result.popout;
  }
  result.timing_ms.total = whole.lap();
  return result;
} catch (const std::bad_alloc&) {
  return fail(Error::Kind::out_of_memory, fmt::format("no memory for {} points", frame.size()));
}

}  // namespace swarmfit
