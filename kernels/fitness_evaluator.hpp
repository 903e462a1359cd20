// The seam between the algorithms and the devices: points in once, a swarm's costs out many times.
//
// Every back end answers the same question with the same answer. For M models and N points,
//
//   cost_j = sum over finite points i of loss(|dist(x_i, theta_j)|, c_i)
//   loss   = min(|d|, c)    truncated L1, Eqs. (3), (4) of Zhou et al. 2010
//          = min(d^2, c^2)  truncated L2
//
// with a cap c_i >= 0 for each point. A cost agrees with the reference back end's within `kCostTolerance`, relative to
// the sum of the caps' losses (the cost of a model that explains nothing). Of fewer than 16 point pairs, within three times that: their
// distances take more operations, and few of them do not even out how each is rounded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "kernels/evidence.hpp"
#include "kernels/models/models.hpp"
#include "kernels/points_view.hpp"
#include "kernels/status.hpp"

namespace swarmfit::kernels {

/// Largest allowed |cost - reference cost| / cost of a model that explains nothing.
inline constexpr double kCostTolerance = 1e-5;

enum class Loss : std::uint32_t { truncated_l1 = 0, truncated_l2 = 1 };

/// M models of one kind, row after row: parameters[j * parameter_count(kind) + k], in the data's own frame and unit.
struct SwarmView {
  ModelKind kind = ModelKind::plane;
  std::size_t count = 0;
  std::span<const double> parameters;
};

struct Workload {
  ModelKind kind = ModelKind::plane;
  std::size_t points = 0;
  std::size_t particles = 0;
};

/// Whether a workload can be done here and, where not, why not: the limit and the value that breaks it.
struct Support {
  bool supported = true;
  std::string reason;
  explicit operator bool() const noexcept { return supported; }
};

/// Who does the work.
struct Identity {
  std::string backend;  ///< "reference", "cpu", "vulkan"
  std::string device;   ///< "AVX2, 2 threads", "NVIDIA H200", ...
};

/// Work done since set_points.
struct Effort {
  std::uint64_t evaluations = 0;   ///< models asked for
  std::uint64_t point_models = 0;  ///< finite points x models asked for
  std::uint64_t touched = 0;       ///< of these, how many residuals were really computed
};

/// Not thread-safe: one thread at a time may call. All spans belong to the caller and are read or written only within the call.
/// After a failure the evaluator may be used again from set_points on.
class FitnessEvaluator {
 public:
  virtual ~FitnessEvaluator() = default;
  FitnessEvaluator() = default;
  FitnessEvaluator(const FitnessEvaluator&) = delete;
  FitnessEvaluator& operator=(const FitnessEvaluator&) = delete;

  virtual const Identity& identity() const noexcept = 0;
  virtual Support supports(const Workload& workload) const = 0;

  /// Copies the points to where they are worked on, centred in double before they become float, and sets all caps to 0.
  /// Fails with `invalid` if the dimension is not 2, 3 or 4 or the count exceeds 2^31 - 1. No points, or none finite, is allowed.
  virtual Result<> set_points(const PointsView& points) = 0;

  /// One cap a point, in input order; size must equal the count of points. Each must be finite and >= 0 for finite points.
  virtual Result<> set_caps(std::span<const float> caps) = 0;

  /// costs.size() == swarm.count. `cutoffs` is empty or one a model: where a model's cost is below its cutoff the cost is exact,
  /// else any value that is >= the cutoff and <= the true cost may be returned. A model with a non-finite parameter costs +inf.
  virtual Result<> evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) = 0;

  /// |dist| of every point to one model, in input order; NaN for points that are not finite. distances.size() == count of points.
  virtual Result<> distances(const ModelView& model, std::span<float> distances) = 0;

  /// labels[i] = k for the nearest model k = 1, 2, ... among those with |dist| <= tolerance, 0 if none; ties go to the lower k.
  /// `tolerance` holds one value for all points, or one a point. labels.size() == count of points; at most 65534 models.
  virtual Result<> assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) = 0;

  virtual Effort effort() const noexcept = 0;

  // Passes over points where they lie in the caller's memory, whatever set_points was given. They are bound by that memory, so a back end
  // that has nothing better leaves them to the processor's cores. Distances are as exact as those above; sums are taken in a fixed order.

  /// Which points are finite, and their moments.
  virtual Result<> survey(const PointsView& points, Survey& survey);

  /// What the points within the tolerance of each model say of it. `distances` is empty, or gets |dist| of every point to the first model,
  /// then to the second, and so on; NaN for points that are not finite. `evidence` is one a model, or empty where distances are all that is
  /// asked. A model with a non-finite parameter has no point.
  virtual Result<> weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                         std::span<Evidence> evidence);

  /// Labels as `assign` gives them, by one tolerance or one a point, and what each model's own points say of it, each with weight 1.
  virtual Result<> claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                         std::span<std::uint16_t> labels, std::span<Evidence> evidence);

  // Work of the caller's own.

  /// Are swarms of so many models shared between threads, which are then awake between them?
  virtual bool shares(std::size_t models) const noexcept;

  /// body(task) for each task, in any order, on the threads that share the evaluator's work.
  virtual void share_out(std::size_t tasks, const std::function<void(std::size_t)>& body);
};

}  // namespace swarmfit::kernels
