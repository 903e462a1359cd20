// PCL's SACSegmentation by its names, with the swarm inside: `swarmfit::SACSegmentation<pcl::PointXYZ> seg;` for
// `pcl::SACSegmentation<pcl::PointXYZ> seg;`, and the program goes on as it was. No header of PCL's is needed here.
#pragma once

#include <algorithm>
#include <any>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/adapters/pcl.hpp>
#include <swarmfit/fit.hpp>

namespace swarmfit {

/// What differs from PCL: the coefficients are always optimised; the method, the number of iterations and the probability are taken and
/// have no effect, for a swarm knows by itself when it is done; a cylinder needs no normals; nothing is printed: error() says why inliers
/// and coefficients came back empty. A seed gives the same answer each time. Not thread-safe; one a thread.
template <class PointT>
class SACSegmentation {
 public:
  /// pcl::SacModel's numbers of the models there are here.
  enum SacModel : int { kPlane = 0, kCircle2d = 2, kSphere = 4, kCylinder = 5, kPerpendicularPlane = 9 };

  /// A shared pointer to pcl::PointCloud<PointT>; kept until the next.
  template <class CloudPtr>
  void setInputCloud(const CloudPtr& cloud) {
    using PointCloud = std::remove_cvref_t<decltype(*cloud)>;
    static_assert(adapters::PclCloud<PointCloud> && std::same_as<typename PointCloud::PointType, PointT>,
                  "a cloud of another type of point");
    input_ = [cloud](int dimension, const std::vector<int>* chosen, std::vector<float>& copy) {
      if (!chosen) return adapters::view(*cloud, dimension);
      copy = adapters::gather(*cloud, *chosen);
      return PointsView(copy.data(), PointsView::Scalar::float32, dimension, chosen->size(), 3 * sizeof(float));
    };
    header_ = {};
    if constexpr (requires { cloud->header; }) {
      header_ = [cloud] { return std::any(cloud->header); };
    }
  }
  /// A shared pointer to pcl::Indices or to pcl::PointIndices: only these points are looked at. Copied; none: all of them.
  template <class IndicesPtr>
  void setIndices(const IndicesPtr& chosen) {
    if (!chosen) {
      chosen_.reset();
    } else if constexpr (requires { chosen->indices; }) {
      chosen_.emplace(chosen->indices.begin(), chosen->indices.end());
    } else {
      chosen_.emplace(chosen->begin(), chosen->end());
    }
  }

  void setModelType(int model) { model_ = model; }
  int getModelType() const { return model_; }
  void setMethodType(int method) { method_ = method; }
  int getMethodType() const { return method_; }
  /// [data unit]
  void setDistanceThreshold(double threshold) { options_.threshold = threshold; }
  double getDistanceThreshold() const { return options_.threshold.value_or(0); }
  void setMaxIterations(int iterations) { iterations_ = iterations; }
  int getMaxIterations() const { return iterations_; }
  void setProbability(double probability) { probability_ = probability; }
  double getProbability() const { return probability_; }
  void setOptimizeCoefficients(bool optimize) { optimize_ = optimize; }
  bool getOptimizeCoefficients() const { return optimize_; }
  void setNumberOfThreads(unsigned threads) {
    options_.threads = static_cast<int>(std::min(threads, 4096U));
    fitter_.reset();
  }
  /// Of spheres, cylinders and circles [data unit].
  void setRadiusLimits(double least, double most) { least_radius_ = least, most_radius_ = most; }
  void getRadiusLimits(double& least, double& most) const { least = least_radius_, most = most_radius_; }
  /// A perpendicular plane's normal, a cylinder's axis, is within the angle [rad] of this; an angle of 0: any.
  void setAxis(const Eigen::Vector3f& axis) { axis_ = axis; }
  Eigen::Vector3f getAxis() const { return axis_; }
  void setEpsAngle(double angle) { angle_ = angle; }
  double getEpsAngle() const { return angle_; }

  /// Beyond PCL: the same seed gives the same answer; a back end or device by name.
  void setSeed(std::uint64_t seed) { options_.seed = seed; }
  void setBackend(std::string backend) {
    options_.backend = std::move(backend);
    fitter_.reset();
  }
  /// Why the last segment() came back empty; empty itself if it did not.
  const std::string& error() const { return error_; }

  /// The model with the most support: pcl::PointIndices of the cloud and pcl::ModelCoefficients, both empty if there is none.
  template <class PointIndices, class ModelCoefficients>
  void segment(PointIndices& inliers, ModelCoefficients& coefficients) {
    inliers.indices.clear();
    coefficients.values.clear();
    error_.clear();
    if constexpr (requires { inliers.header = coefficients.header; }) {
      using Header = std::remove_cvref_t<decltype(inliers.header)>;
      const std::any header = header_ ? header_() : std::any();
      if (const auto* known = std::any_cast<Header>(&header)) inliers.header = coefficients.header = *known;
    }
    const auto found = best();
    if (!found) {
      error_ = found.error().message;
      return;
    }
    adapters::to_coefficients(found->model, coefficients);
    inliers.indices.reserve(found->model.inliers);
    for (std::size_t i = 0; i < found->labels.size(); ++i) {
      if (found->labels[i] == found->label) inliers.indices.push_back(chosen_ ? (*chosen_)[i] : static_cast<int>(i));
    }
  }

 private:
  struct Found {
    Model model;
    std::vector<std::uint16_t> labels;
    std::uint16_t label = 0;
  };

  static tl::unexpected<Error> invalid(std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); }

  Expected<ModelType> kind() const {
    switch (model_) {
      case kPlane:
      case kPerpendicularPlane: return ModelType::plane;
      case kCircle2d: return ModelType::circle2d;
      case kSphere: return ModelType::sphere;
      case kCylinder: return ModelType::cylinder;
      default:
        return invalid("model type is " + std::to_string(model_) +
                       ", must be SACMODEL_PLANE, _CIRCLE2D, _SPHERE, _CYLINDER or _PERPENDICULAR_PLANE");
    }
  }

  bool round() const { return model_ == kCircle2d || model_ == kSphere || model_ == kCylinder; }

  Expected<Found> best() {
    if (!input_) return invalid("no input cloud: setInputCloud comes first");
    const auto type = kind();
    if (!type) return tl::unexpected(type.error());
    const bool limited = round() && (least_radius_ > 0 || most_radius_ < std::numeric_limits<double>::max());
    options_.model = *type;
    options_.max_models = limited ? 0 : 1;
    options_.prior.reset();
    if ((model_ == kPerpendicularPlane || model_ == kCylinder) && angle_ > 0) options_.prior = {axis_.cast<double>(), angle_};

    if (!fitter_) {
      auto made = Fitter::create(options_);
      if (!made) return tl::unexpected(made.error());
      fitter_.emplace(std::move(*made));
    } else if (auto ok = fitter_->set_options(options_); !ok) {
      return tl::unexpected(ok.error());
    }
    std::vector<float> copy;
    auto result = fitter_->fit(input_(dimension(*type), chosen_ ? &*chosen_ : nullptr, copy));
    if (!result) return tl::unexpected(result.error());
    Found found;
    for (std::size_t k = 0; k < result->models.size(); ++k) {
      const Model& model = result->models[k];
      const double radius = model.parameters[model.parameters.size() - 1];
      if (limited && !(radius >= least_radius_ && radius <= most_radius_)) continue;
      if (found.label != 0 && model.inliers <= found.model.inliers) continue;
      found.model = model;
      found.label = static_cast<std::uint16_t>(k + 1);
    }
    if (found.label == 0) return fail(Error::Kind::bad_input, "no model pays for itself: " + result->brief());
    found.labels = std::move(result->labels);
    return found;
  }

  std::function<PointsView(int, const std::vector<int>*, std::vector<float>&)> input_;
  std::function<std::any()> header_;
  std::optional<std::vector<int>> chosen_;
  std::optional<Fitter> fitter_;
  FitOptions options_;
  std::string error_;
  Eigen::Vector3f axis_ = Eigen::Vector3f::Zero();
  double angle_ = 0, probability_ = 0.99, least_radius_ = -std::numeric_limits<double>::max(),
         most_radius_ = std::numeric_limits<double>::max();
  int model_ = -1, method_ = 0, iterations_ = 50;
  bool optimize_ = true;
};

}  // namespace swarmfit
