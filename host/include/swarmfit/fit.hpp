// Find all models of a kind, or of several, in data full of outliers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/backend.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/model.hpp>
#include <swarmfit/own_model.hpp>
#include <swarmfit/points.hpp>
#include <swarmfit/trace.hpp>

namespace swarmfit {

enum class Preset {
  fast,   ///< what measures best
  paper,  ///< Zhou et al. 2010, and what docs/method.md says where that leaves a choice
};
enum class Deflation {
  residual,    ///< each point's cap sinks with what has been explained of it
  parametric,  ///< Eq. (5): fitness lessened around the parameters of found models
};
/// What a point costs at a distance d: min(d, cap), or the same squared.
enum class Loss { truncated_l1, truncated_l2 };

/// How far off a point may be by its sensor's noise. Each point's own threshold follows.
enum class Noise {
  none,   ///< the same for all points
  depth,  ///< grows with the square of the depth |z|: depth cameras, stereo; of points in the camera's frame
};

/// Only planes whose normal is within `max_angle` of `axis` (n and -n are one plane), or lines whose normal is, or cylinders whose axis is.
struct DirectionPrior {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< need not be a unit vector; not zero
  double max_angle = 0.2;                           ///< [rad], in (0, pi/2]
};

struct FitOptions {
  ModelType model = ModelType::plane;
  std::vector<ModelType> rivals;  ///< further kinds that compete with `model` for the same points; all of 2 or all of 3 columns, each once
  std::optional<OwnModel> own;    ///< with `model` = own, and only then: what is fitted; no rivals, and residual deflation
  std::optional<double> threshold;  ///< tau [data unit], in [1e-30, 1e30]; none: the kind's default (plane, sphere, cylinder 0.01;
                                    ///< homography 6 px, fundamental 2.5 px; line2d, circle2d, own, and any with noise, estimate it)
  bool estimate_threshold = false;  ///< tau from the data's own noise, whatever `threshold` says
  Noise noise = Noise::none;        ///< depth: of 3 columns only; tau is for the near end, beyond three tenths of the points
                                    ///< it grows with the square of the depth
  Preset preset = Preset::fast;     ///< decides every option below that is left empty
  std::optional<int> particles;     ///< M, in [2, 1000000]; all of them fly. None: the fittest of many samples
  std::optional<int> iterations;    ///< most steps of one swarm, >= 1
  std::optional<int> stall;         ///< s: converged when the global best has not moved for s steps, >= 1
  std::optional<Deflation> deflation;
  std::optional<double> lambda;  ///< Eq. (5), > 0
  std::optional<Loss> loss;
  std::size_t min_inliers = 0;  ///< 0: decided from the data
  std::size_t max_models = 0;   ///< at most 65534; 0: no bound
  double time_budget_ms = 0;    ///< >= 0; 0: none; what is found by then is valid
  std::optional<DirectionPrior> prior;
  std::uint64_t seed = 1;
  std::string backend = "auto";  ///< auto, cpu, vulkan, reference, or part of a device's name
  int threads = 0;               ///< of the CPU back end, in [0, 4096]; 0 takes all
  std::string pipeline_cache;    ///< folder for compiled Vulkan pipelines; empty keeps none

  /// `model` and its rivals.
  SWARMFIT_API std::vector<ModelType> kinds() const;
  /// Fails with invalid_option, naming the field, its value and its bound.
  SWARMFIT_API Expected<> validate() const;
};

/// Told of each model the moment it is found; `stop` ends the fit with what there is. The end refines all of them together, and where
/// points are shared out (homographies, fundamental matrices) it may replace, join and drop them: it tells of those it made, the result
/// holds those that stay. Of a cloud that was thinned, inliers and cost are
/// those of the thinned cloud scaled to the whole; the result has the exact ones. Called in the thread of the fit's caller, to whom what it
/// throws comes back, and the fit ends.
enum class Verdict { go_on, stop };
using ModelCallback = std::function<Verdict(const Model&)>;

struct FitResult {
  std::vector<Model> models;
  std::vector<std::uint16_t> labels;  ///< one a point, in input order: 0 none, k the k-th model
  BackendInfo backend;
  std::uint64_t seed = 0;
  double threshold = 0;  ///< tau used [data unit]
  std::string stop_reason = "not called";
  std::size_t finite_points = 0;
  std::size_t iterations = 0;
  std::size_t evaluations = 0;
  double points_touched = 1;
  double total_ms = 0;

  /// One line a person can read.
  SWARMFIT_API std::string brief() const;
};

/// Holds a back end; reuse it over frames. Not thread-safe; one a thread.
class SWARMFIT_API Fitter {
 public:
  /// Fails with invalid_option, backend_unavailable or out_of_memory. An own model's GLSL that does not compile is an invalid_option with
  /// the compiler's words, where the back end is a Vulkan device.
  static Expected<Fitter> create(const FitOptions& options);
  ~Fitter();
  Fitter(Fitter&&) noexcept;
  Fitter& operator=(Fitter&&) noexcept;

  /// Has the first fit take hardly longer than later ones: fits a few made-up points of the first kind, a millisecond or two on a CPU, so
  /// that code and memory have been touched and most of a device's pipelines compiled. Results are the same with or without it. Does nothing
  /// for an own model.
  void prepare() noexcept;

  /// `warm_start`: models of an earlier fit that seed the swarm. Fails with bad_input (too few finite points, wrong dimension,
  /// a coordinate beyond 1e18, an own model's function that threw) or out_of_memory; what `on_model` throws comes back as it is.
  Expected<FitResult> fit(const PointsView& points, const ModelCallback& on_model = {}, std::stop_token stop = {},
                          const std::vector<Model>& warm_start = {});

  /// Told of each step of the swarms, also of those that look for models to estimate the threshold from; empty: nobody is.
  void observe(SwarmObserver observer);

  const FitOptions& options() const noexcept;
  /// Options of the fits to come, on the same back end. Fails with invalid_option, also where backend, threads or pipeline_cache differ.
  /// To or from an own model the back end is made anew, and what create() fails with is possible.
  Expected<> set_options(const FitOptions& options);
  BackendInfo backend() const;

 private:
  friend struct FitterParts;
  struct State;
  explicit Fitter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One call for one cloud. Fails as Fitter::create() and Fitter::fit() do.
SWARMFIT_API Expected<FitResult> fit(const PointsView& points, const FitOptions& options = {}, const ModelCallback& on_model = {});

}  // namespace swarmfit
