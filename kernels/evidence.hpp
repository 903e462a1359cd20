// What points say of models, gathered in one pass over them where they lie in the caller's memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/models/models.hpp"
#include "kernels/points_view.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::kernels {

/// First and second moments of weighted points, in the points' own frame.
struct Moments {
  double weight = 0;                                                       ///< sum of w
  std::array<double, kMaxDimension> mean{};                                ///< sum of w x / weight
  std::array<std::array<double, kMaxDimension>, kMaxDimension> scatter{};  ///< sum of w (x - mean) (x - mean)^T

  /// Those of both sets of points together.
  void add(const Moments& other) noexcept;
};

/// Which points of a cloud are finite, and how these lie.
struct Survey {
  std::size_t finite_count = 0;
  Reused<std::uint64_t> finite;  ///< a bit a point: bit i % 64 of word i / 64
  Moments moments;               ///< of the finite points, each of weight 1
};

/// Which points speak for a model, and with what weight: those within `tolerance` of it and, where there are caps, within their cap;
/// w = 1 / max(d / tolerance, corner).
struct Weighing {
  float tolerance = 0;          ///< > 0 [data unit]
  float corner = 1;             ///< in (0, 1]; 1: every weight is 1
  std::span<const float> caps;  ///< empty, or one a point, >= 0
};

/// What is known of a model after a pass.
struct Evidence {
  std::uint64_t count = 0;  ///< points that speak for it
  double square = 0;        ///< sum of their squared distances
  double cost = 0;          ///< sum over all finite points of min(d, cap), or min(d, tolerance) without caps
  Moments moments;          ///< of the points that speak for it
};

// The same passes, point after point in double precision: the oracle.
void survey_points(const PointsView& points, Survey& survey);
void weigh_points(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                  std::span<Evidence> evidence);
void claim_points(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                  std::span<std::uint16_t> labels, std::span<Evidence> evidence);

}  // namespace swarmfit::kernels
