// What the swarm needs to know of a kind of model: where positions come from, how they differ and move, and how they are refined.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include <swarmfit/fit.hpp>
#include <swarmfit/model.hpp>

#include "host/models/working_points.hpp"
#include "kernels/evidence.hpp"
#include "kernels/models/models.hpp"

namespace swarmfit::models {

/// A position: the model's parameters in the working frame. A velocity has the same number of entries. Short enough to lie in place: a
/// swarm moves thousands of them.
using Position = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kernels::kMaxParameters, 1>;
/// Of a position's entries; as that, it needs no memory but its own.
using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kernels::kMaxParameters, kernels::kMaxParameters>;

/// Points and weights of a least-squares problem.
struct Weighted {
  std::span<const std::uint32_t> index;
  std::span<const double> weight;
};

class ModelSpace {
 public:
  virtual ~ModelSpace() = default;

  virtual ModelType type() const noexcept = 0;
  virtual kernels::ModelKind kind() const noexcept = 0;
  /// What messages call it.
  virtual std::string_view title() const noexcept { return name(type()); }
  /// Independent components of a point's residual: 1 for a surface, 2 where a point must land on a point.
  virtual int residual_components() const noexcept { return 1; }
  /// Points that determine a model.
  virtual int minimal_sample() const noexcept = 0;
  /// Entries of a position.
  virtual int parameter_count() const noexcept = 0;
  /// Dimension of the smallest flat that points must span to determine a model.
  virtual int least_rank() const noexcept = 0;
  /// Whether from_sample looks at the points' normals.
  virtual bool needs_normals() const noexcept { return false; }
  /// Whether a point's normal tells if it may be the model's.
  virtual bool agrees_by_normals() const noexcept { return needs_normals(); }
  /// Whether from_sample takes so long, a microsecond or more, that a swarm's samples are worth spreading over threads.
  virtual bool costly_samples() const noexcept { return false; }
  /// Length of a curve inside a box of the plane [working frame], by which chance has more points near it; 0 where it does not matter.
  virtual double length_within(const Position&, const Eigen::Vector2d& /*low*/, const Eigen::Vector2d& /*high*/) const { return 0; }
  /// Entries of the unit normal that a position begins with, where an offset is all that follows and no prior binds either; else 0.
  virtual int free_normal() const noexcept { return 0; }
  /// Degrees of freedom: rank of the covariance.
  virtual int freedom() const noexcept = 0;

  /// The model through a minimal sample; false if the sample is degenerate (coincident or collinear points).
  virtual bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const = 0;
  /// The same of several samples, one after another in `samples`; found[k] is 1 where the k-th determines a model, else 0.
  virtual void from_samples(const WorkingPoints& points, std::span<const std::uint32_t> samples, std::span<Position> thetas,
                            std::span<std::uint8_t> found) const;
  /// How many samples at a time take hardly longer than one.
  virtual std::size_t samples_at_once() const noexcept { return 1; }
  /// The velocity at `from` that leads to `to` in one step: the logarithm map.
  virtual void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const = 0;
  /// theta moves by velocity (the exponential map) and the velocity is carried along, to stay tangent.
  virtual void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const = 0;
  /// D(a, b) of Eq. (5): length of the shortest way, angles in rad, lengths in units of the working frame.
  virtual double distance(const Position& a, const Position& b) const = 0;
  /// The weighted least-squares model; false if the points do not determine one.
  virtual bool refine(const WorkingPoints& points, const Weighted& support, Position& theta) const = 0;
  /// Covariance of a least-squares position given unit residual variance, in the working frame.
  virtual Covariance unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const = 0;

  /// Whether least squares needs to know no more of its points than their moments. Then the two below serve as well as the two above, and
  /// nobody has to list the points.
  virtual bool closed_form() const noexcept { return false; }
  virtual bool refine_by_moments(const kernels::Moments&, const Frame&, Position&) const { return false; }
  virtual Covariance covariance_by_moments(const kernels::Moments&, const Frame&, const Position&) const { return {}; }

  /// Variance of one residual component about a least-squares position; `squares` is the sum of squared distances [working frame]. Of kinds
  /// in closed form `support` is not looked at beyond its size.
  virtual double noise_variance(const WorkingPoints& points, const Weighted& support, const Position& theta, double squares) const;

  /// Signed components of a point's residual, residual_components() of them, whitened; false where there are none or nobody asks for them.
  virtual bool residual(const WorkingPoints&, std::uint32_t /*index*/, const Position&, std::span<double> /*components*/) const {
    return false;
  }

  /// Of a surface in space: where its normal points at what is near this point, not of unit length. Zero of other kinds.
  virtual Eigen::Vector3d outward(const Position&, const Eigen::Vector3d&) const { return Eigen::Vector3d::Zero(); }

  /// Parameters in the data's frame and unit, as results and kernels take them, and back.
  virtual Position to_data(const Position& theta, const Frame& frame) const = 0;
  virtual Position from_data(const Position& parameters, const Frame& frame) const = 0;
  /// Covariance of the data-frame parameters from that of the position.
  virtual Covariance covariance_to_data(const Covariance& covariance, const Position& theta, const Frame& frame) const = 0;

  /// Pulls a position back inside the prior, if there is one; false where that cannot be done.
  virtual bool admit(Position& theta) const = 0;
};

/// A model of one of several kinds.
struct Placed {
  const ModelSpace* space = nullptr;  ///< never null but in an empty place
  Position theta;
};

/// The space of a built-in kind, with an optional prior on its direction.
std::unique_ptr<ModelSpace> make_space(ModelType type, const std::optional<DirectionPrior>& prior);
/// What ModelSpace::minimal_sample() of a kind that is built in says.
int minimal_sample(ModelType type);
std::unique_ptr<ModelSpace> make_own_space(const OwnModel& own);

/// The kernels' name of a kind.
kernels::ModelKind to_kernel(ModelType type) noexcept;

// One factory a kind, each in its own file.
std::unique_ptr<ModelSpace> make_line2d_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_plane_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_circle2d_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_sphere_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_cylinder_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_homography_space(const std::optional<DirectionPrior>& prior);
std::unique_ptr<ModelSpace> make_fundamental_space(const std::optional<DirectionPrior>& prior);

}  // namespace swarmfit::models
