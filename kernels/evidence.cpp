#include "kernels/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/fitness_evaluator.hpp"
#include "kernels/models/scalar_math.hpp"

#define SWARMFIT_INLINE inline

namespace swarmfit::kernels {
namespace {

#include "kernels/models/models.inl"

/// A model's residual about a centre; infinite where a coefficient is not finite.
class Residual {
 public:
  Residual(const ModelView& model, const double* centre) : kind_(model.kind), centre_(centre) {
    usable_ = centred_coefficients(kind_, model.parameters.data(), centre, coefficients_.data());
  }

  double operator()(const PointsView& points, std::size_t row) const {
    if (!usable_) return std::numeric_limits<double>::infinity();
    std::array<double, kMaxDimension> x{};
    for (int d = 0; d < points.dimension; ++d) x[static_cast<std::size_t>(d)] = points.at(row, d) - centre_[d];
    return visit_model(kind_, [&]<class M>() { return std::abs(M::residual(ScalarMath{}, x.data(), coefficients_.data())); });
  }

 private:
  ModelKind kind_;
  const double* centre_;
  bool usable_;
  std::array<double, kMaxCoefficients> coefficients_{};
};

Moments of_point(const PointsView& points, std::size_t row, double weight) {
  Moments moments;
  moments.weight = weight;
  for (int d = 0; d < points.dimension; ++d) moments.mean[static_cast<std::size_t>(d)] = points.at(row, d);
  return moments;
}

void speak(const PointsView& points, std::size_t row, double distance, double weight, Evidence& evidence) {
  ++evidence.count;
  evidence.square += distance * distance;
  evidence.moments.add(of_point(points, row, weight));
}

std::vector<Residual> residuals(std::span<const ModelView> models, const double* centre) {
  std::vector<Residual> all;
  all.reserve(models.size());
  for (const ModelView& model : models) all.emplace_back(model, centre);
  return all;
}

std::array<double, kMaxDimension> middle(const PointsView& points) {
  Survey survey;
  survey_points(points, survey);
  return survey.moments.mean;
}

}  // namespace

void Moments::add(const Moments& other) noexcept {
  if (!(other.weight > 0)) return;
  const double all = weight + other.weight;
  const double share = other.weight / all;
  std::array<double, kMaxDimension> step;
  for (std::size_t d = 0; d < kMaxDimension; ++d) step[d] = other.mean[d] - mean[d];
  for (std::size_t d = 0; d < kMaxDimension; ++d) {
    for (std::size_t e = 0; e < kMaxDimension; ++e) scatter[d][e] += other.scatter[d][e] + weight * share * step[d] * step[e];
    mean[d] += share * step[d];
  }
  weight = all;
}

void survey_points(const PointsView& points, Survey& survey) {
  survey.finite_count = 0;
  survey.finite.assign((points.count + 63) / 64, 0);
  survey.moments = {};
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!points.finite(i)) continue;
    ++survey.finite_count;
    survey.finite[i / 64] |= std::uint64_t{1} << (i % 64);
    survey.moments.add(of_point(points, i, 1));
  }
}

void weigh_points(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                  std::span<Evidence> evidence) {
  const std::array<double, kMaxDimension> centre = middle(points);
  const std::vector<Residual> residual = residuals(models, centre.data());
  const auto tolerance = static_cast<double>(how.tolerance);
  for (std::size_t m = 0; m < models.size(); ++m) {
    Evidence unasked, &told = evidence.empty() ? unasked : evidence[m];
    told = {};
    for (std::size_t i = 0; i < points.count; ++i) {
      const bool finite = points.finite(i);
      const double d = finite ? residual[m](points, i) : std::numeric_limits<double>::quiet_NaN();
      if (!distances.empty()) distances[m * points.count + i] = static_cast<float>(d);
      if (!finite) continue;
      const double limit = how.caps.empty() ? tolerance : static_cast<double>(how.caps[i]);
      told.cost += std::min(d, limit);
      if (d <= tolerance && d <= limit) speak(points, i, d, 1 / std::max(d / tolerance, static_cast<double>(how.corner)), told);
    }
  }
}

void claim_points(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                  std::span<std::uint16_t> labels, std::span<Evidence> evidence) {
  const std::array<double, kMaxDimension> centre = middle(points);
  const std::vector<Residual> residual = residuals(models, centre.data());
  std::fill(labels.begin(), labels.end(), std::uint16_t{0});
  std::fill(evidence.begin(), evidence.end(), Evidence{});
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!points.finite(i)) continue;
    const auto widest = static_cast<double>(tolerance[tolerance.size() > 1 ? i : 0]);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t m = 0; m < models.size(); ++m) {
      const double d = residual[m](points, i);
      evidence[m].cost += std::min(d, widest);
      if (d > widest || d >= nearest) continue;
      nearest = d;
      labels[i] = static_cast<std::uint16_t>(m + 1);
    }
    if (labels[i] > 0) speak(points, i, nearest, 1, evidence[labels[i] - 1U]);
  }
}

}  // namespace swarmfit::kernels
