// The whole chain: vertical, supporting planes, pop-out, objects, outlines, names.
#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/perception.hpp>

#include "host/common/thrown.hpp"
#include "host/models/working_points.hpp"
#include "host/perception/grid.hpp"
#include "host/perception/objects.hpp"
#include "host/perception/overview.hpp"
#include "host/perception/plane_search.hpp"
#include "host/perception/popout.hpp"
#include "host/perception/recognition.hpp"
#include "host/perception/runs.hpp"
#include "host/perception/segmentation.hpp"
#include "host/perception/surface.hpp"
#include "host/perception/tracking.hpp"
#include "host/perception/vertical.hpp"
#include "host/swarm/landscape.hpp"
#include "kernels/colour_costs.hpp"

namespace swarmfit {
namespace {

using perception::PointGrid;
using perception::Surface;

constexpr std::size_t kPlanesOfFirstView = 6;  // enough to see which direction the room's planes share
constexpr int kStall = 5;                      // still steps that end a swarm
constexpr double kStereoThreshold = 0.015;     // [m] unless one is given: matching is coarser than a depth camera
constexpr double kStereoAngle = 0.01;          // [rad] from the first view's ground
constexpr double kStereoAngleFromWall = 0.06;  // [rad] the vertical is less sure then
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

/// By label: 1 where the model supports.
std::vector<std::uint8_t> supporting_labels(const FitResult& fit) {
  std::vector<std::uint8_t> supporting(1, 0);
  for (const Model& model : fit.models) supporting.push_back(model.supporting ? 1 : 0);
  return supporting;
}

/// A supporting plane does not keep what belongs to things that stand on it.
void give_to_objects(const std::vector<std::uint16_t>& objects, FitResult& fit) {
  const auto supporting = supporting_labels(fit);
  perception::for_each_run(objects, 0, fit.labels.size(), [&](std::size_t first, std::size_t last, std::uint16_t) {
    for (std::size_t i = first; i < last; ++i) {
      auto& label = fit.labels[i];
      if (supporting[label] == 0) continue;
      --fit.models[label - 1u].inliers;
      label = 0;
    }
  });
}

/// An observer of planes in the grid's frame, told by one of planes in the data's.
SwarmObserver in_data_frame(const SwarmObserver& observer, const Eigen::Vector3d& origin) {
  if (!observer) return {};
  return [&observer, origin](const SwarmStep& step) {
    SwarmStep moved = step;
    moved.positions.row(3) -= origin.transpose() * moved.positions.topRows<3>();
    moved.best[3] -= origin.dot(moved.best.head<3>());
    observer(moved);
  };
}

/// A fitter that is observed until the end of a block.
class Watching {
 public:
  Watching(Fitter& fitter, SwarmObserver observer) : fitter_(fitter) { fitter_.observe(std::move(observer)); }
  ~Watching() { fitter_.observe({}); }
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;

 private:
  Fitter& fitter_;
};

}  // namespace

struct Perceiver::State {
  PerceiveOptions options;
  bool stereo = false;
  std::optional<perception::Vertical> vertical;
  std::optional<Fitter> fitter;  ///< of any plane until the vertical is known, then of horizontal ones
  std::optional<perception::Gallery> gallery;
  perception::Tracker tracker;
  SwarmObserver observer;
  std::unique_ptr<kernels::ColourCosts> colours;  ///< where the fitter works; made for the first frame with a picture

  FitOptions fit_options() const { return fit_options(vertical); }
  FitOptions fit_options(const std::optional<perception::Vertical>& with) const;
  Expected<> suit_sensor(const Cloud& frame);
  Expected<> find_vertical(const Cloud& frame, const PointGrid& grid, const perception::Overview& overview, const std::stop_token& stop,
                           PerceiveResult& result);
  std::vector<Model> last_planes(const PointGrid& grid) const;
  void find_objects(const PointGrid& grid, const std::vector<Surface>& supports, PerceiveResult& result) const;
  Expected<> find_outlines(const Cloud& frame, PerceiveResult& result);
};

FitOptions Perceiver::State::fit_options(const std::optional<perception::Vertical>& with) const {
  FitOptions fit = options.fit;
  // Surfaces are refined on all points afterwards: a swarm need not settle.
  if (fit.preset == Preset::fast && !fit.stall) fit.stall = kStall;
  if (!with) {
    fit.prior.reset();
    fit.max_models = kPlanesOfFirstView;
    return fit;
  }
  // What is level in one room is level to each other; and without normals there is little else to tell a surface from clutter.
  const bool narrow = stereo && !options.gravity && !options.camera_tilt;
  const double angle = with->source == perception::kFromDominantPlane ? kStereoAngle : kStereoAngleFromWall;
  fit.prior = DirectionPrior{with->up, narrow ? std::min(options.horizontal_angle, angle) : options.horizontal_angle};
  return fit;
}

Expected<> Perceiver::State::suit_sensor(const Cloud& frame) {
  stereo = frame.passive_stereo;
  if (!frame.passive_stereo || options.fit.threshold || options.fit.estimate_threshold) return {};
  FitOptions fit = fit_options();
  fit.threshold = kStereoThreshold;
  if (auto ok = fitter->set_options(fit); !ok) return ok;
  options.fit.threshold = kStereoThreshold;
  return {};
}

Expected<> Perceiver::State::find_vertical(const Cloud& frame, const PointGrid& grid, const perception::Overview& overview,
                                           const std::stop_token& stop, PerceiveResult& result) {
  if (vertical) return {};
  // Stereo's planes bend, and many of them are slabs through clutter: they are told best by all that there are, and not alone.
  const auto suffice = [&](std::span<const Model> planes, std::size_t left) {
    return !stereo && perception::is_vertical_decided(grid, planes, left, options.horizontal_angle);
  };
  auto planes = perception::find_any_planes(*fitter, overview, suffice, stop);
  if (!planes) return tl::unexpected(planes.error());
  const auto edges = stereo ? perception::find_edges(frame, grid) : perception::ImageEdges{};
  auto seen = perception::vertical_from_planes(grid, planes->models, edges, overview.normals, options.horizontal_angle);
  if (seen) {
    if (auto ok = fitter->set_options(fit_options(seen)); !ok) return ok;
    vertical = std::move(seen);
    return {};
  }
  // Nothing flat in this view; the next one may have it.
  planes->models.clear();
  planes->labels.assign(grid.size(), 0);
  planes->finite_points = grid.finite;
  result.fit = std::move(*planes);
  return {};
}

/// In the grid's frame.
std::vector<Model> Perceiver::State::last_planes(const PointGrid& grid) const {
  if (!options.track) return {};
  auto planes = tracker.planes();
  for (Model& plane : planes) plane.parameters[3] += plane.normal().dot(grid.origin);
  return planes;
}

void Perceiver::State::find_objects(const PointGrid& grid, const std::vector<Surface>& supports, PerceiveResult& result) const {
  const auto min_points = scaled_min_points(grid, options.min_soi_points);
  // Debris beside a larger thing is part of it, a handle for example; so small groups are dropped after the grouping.
  const auto least_group = grid.organised() ? std::max<std::size_t>(1, min_points / 10) : min_points;
  auto popout =
      perception::pop_out(grid, supports, {options.min_height, options.max_height, options.flood_step, least_group, options.fit.threads});
  perception::ObjectLabels objects;
  if (!grid.organised()) {
    objects = {std::move(popout.group), std::move(popout.support)};
  } else {
    double noise = 0;
    for (const auto& surface : supports) noise = std::max(noise, surface.noise);
    objects = perception::separate(grid, std::move(popout), {options.flood_step, noise, result.up.cast<float>(), options.fit.threads});
    perception::fill_basins(grid, result.fit.labels, supporting_labels(result.fit), options.fit.threads, objects);
  }
  std::vector<int> models;
  for (const auto& surface : supports) models.push_back(surface.model);
  result.sois = perception::make_spaces(grid, models, min_points, options.soi_margin, options.fit.threads, objects);
  result.popout = std::move(objects.of_point);
}

Expected<> Perceiver::State::find_outlines(const Cloud& frame, PerceiveResult& result) {
  if (!colours) {
    const BackendInfo where = fitter->backend();
    kernels::EvaluatorOptions how;
    how.pipeline_cache = options.fit.pipeline_cache;
    auto made = kernels::make_colour_costs({where.name, where.device}, options.fit.backend == "auto", how);
    if (!made) return tl::unexpected(swarm::to_error(made.error()));
    colours = std::move(*made);
  }
  perception::ColourWork work(*colours);
  result.objects = perception::segment_objects({frame, result.fit.labels, result.popout, result.sois, &work}, options);
  if (work.failure()) return tl::unexpected(swarm::to_error(*work.failure()));
  return {};
}

Perceiver::Perceiver(std::unique_ptr<State> state) : state_(std::move(state)) {}
Perceiver::~Perceiver() = default;
Perceiver::Perceiver(Perceiver&&) noexcept = default;
Perceiver& Perceiver::operator=(Perceiver&&) noexcept = default;

Expected<Perceiver> Perceiver::create(const PerceiveOptions& options) try {
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  auto state = std::make_unique<State>();
  state->options = options;
  if (options.gravity) state->vertical = perception::vertical_from_gravity(*options.gravity);
  if (options.camera_tilt) state->vertical = perception::vertical_from_tilt(*options.camera_tilt);
  auto fitter = Fitter::create(state->fit_options());
  if (!fitter) return tl::unexpected(fitter.error());
  state->fitter.emplace(std::move(*fitter));
  if (!options.gallery.empty()) {
    auto loaded = perception::Gallery::load(options.gallery);
    if (!loaded) return tl::unexpected(loaded.error());
    state->gallery.emplace(std::move(*loaded));
  }
  return Perceiver(std::move(state));
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [] { return std::string("no memory for what perception holds"); });
}

void Perceiver::observe(SwarmObserver observer) { state_->observer = std::move(observer); }

Expected<PerceiveResult> Perceiver::perceive(const Cloud& frame, const ModelCallback& on_plane, std::stop_token stop) try {
  if (auto ok = frame.validate(); !ok) return tl::unexpected(ok.error());
  if (frame.dimension != 3)
    return fail(Error::Kind::bad_input, fmt::format("the cloud has {} columns, must have 3 to perceive", frame.dimension));
  Stopwatch whole, stage;
  PerceiveResult result;
  if (auto ok = state_->suit_sensor(frame); !ok) return tl::unexpected(ok.error());
  const auto grid = perception::make_grid(frame, state_->options.fit.threads);
  if (grid.finite < 3)
    return fail(Error::Kind::bad_input, fmt::format("finite points is {} of {}, must be >= 3 to perceive", grid.finite, frame.size()));
  if (grid.stray) {
    if (const auto stray = models::find_stray(models::to_kernel(frame.points()))) {
      return fail(Error::Kind::bad_input, models::text_of(*stray));
    }
  }
  const auto overview = perception::make_overview(grid, frame, state_->options.fit.threads);
  if (auto ok = state_->find_vertical(frame, grid, overview, stop, result); !ok) return tl::unexpected(ok.error());
  result.vertical_source = state_->vertical ? state_->vertical->source : "dominant plane";
  result.popout.assign(frame.size(), 0);
  std::vector<Surface> supports;
  if (state_->vertical) {
    result.up = state_->vertical->up;
    const ModelCallback told = common::going_by(on_plane);
    const SwarmObserver observer = common::going_by(state_->observer);
    const Watching watching(*state_->fitter, in_data_frame(observer, grid.origin));
    auto search =
        perception::find_supports(*state_->fitter, grid, overview, result.up, state_->options, told, stop, state_->last_planes(grid));
    if (!search) return tl::unexpected(search.error());
    result.fit = std::move(search->fit);
    supports = std::move(search->supports);
  }
  result.timing_ms.fit = stage.lap();
  if (!supports.empty() && !stop.stop_requested()) state_->find_objects(grid, supports, result);
  give_to_objects(result.popout, result.fit);
  result.timing_ms.popout = stage.lap();
  if (frame.organised() && frame.coloured() && !stop.stop_requested()) {
    if (auto ok = state_->find_outlines(frame, result); !ok) return tl::unexpected(ok.error());
    result.timing_ms.segment = stage.lap();
    if (state_->gallery) {
      const auto names = state_->gallery->recognise(frame, result.objects, result.sois.size());
      for (std::size_t k = 0; k < result.sois.size() && k < names.size(); ++k) result.sois[k].recognised = names[k];
      result.timing_ms.recognise = stage.lap();
    }
  } else if (frame.organised()) {
    result.objects = result.popout;
  }
  if (state_->options.track && !stop.stop_requested()) state_->tracker.follow(result);
  result.timing_ms.total = whole.lap();
  return result;
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [&] { return fmt::format("no memory for {} points", frame.size()); });
}

}  // namespace swarmfit
