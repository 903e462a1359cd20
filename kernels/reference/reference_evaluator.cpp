// The oracle: double precision, one point after another, never optimised.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/checks.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/models/scalar_math.hpp"

#define SWARMFIT_INLINE inline

namespace swarmfit::kernels {
namespace {

#include "kernels/models/models.inl"

class ReferenceEvaluator final : public FitnessEvaluator {
 public:
  const Identity& identity() const noexcept override { return identity_; }
  Support supports(const Workload&) const override { return {}; }

  Result<> set_points(const PointsView& points) override {
    if (auto ok = check_points(points); !ok) return ok;
    extent_ = measure(points);
    dimension_ = points.dimension;
    caps_.assign(points.count, 0.0F);
    effort_ = {};
    centred_.resize(points.count * static_cast<std::size_t>(dimension_));
    for (std::size_t i = 0; i < points.count; ++i) {
      for (int d = 0; d < dimension_; ++d) row(i)[d] = points.at(i, d) - extent_.centre[d];
    }
    return {};
  }

  Result<> set_caps(std::span<const float> caps) override {
    if (auto ok = check_caps(caps, extent_.finite); !ok) return ok;
    caps_.assign(caps.begin(), caps.end());
    return {};
  }

  Result<> evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) override {
    if (auto ok = check_swarm(swarm, dimension_, cutoffs, costs); !ok) return ok;
    const auto width = static_cast<std::size_t>(traits(swarm.kind).parameter_count);
    for (std::size_t j = 0; j < swarm.count; ++j) {
      costs[j] = static_cast<float>(cost({swarm.kind, swarm.parameters.subspan(j * width, width)}, loss));
    }
    effort_.evaluations += swarm.count;
    effort_.point_models += swarm.count * extent_.finite_count;
    effort_.touched += swarm.count * extent_.finite_count;
    return {};
  }

  Result<> distances(const ModelView& model, std::span<float> distances) override {
    if (auto ok = check_model(model, dimension_); !ok) return ok;
    if (auto ok = check_size("distances.size()", distances.size(), extent_.finite.size()); !ok) return ok;
    double k[kMaxCoefficients];
    const bool finite = centred_coefficients(model.kind, model.parameters.data(), extent_.centre, k);
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (!extent_.finite[i]) {
        distances[i] = std::numeric_limits<float>::quiet_NaN();
      } else {
        distances[i] = finite ? static_cast<float>(distance(model.kind, i, k)) : std::numeric_limits<float>::infinity();
      }
    }
    return {};
  }

  Result<> assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) override {
    if (auto ok = check_assign(models, dimension_, extent_.finite.size(), tolerance, labels); !ok) return ok;
    std::fill(labels.begin(), labels.end(), std::uint16_t{0});
    std::vector<double> nearest(labels.size(), std::numeric_limits<double>::infinity());
    for (std::size_t m = 0; m < models.size(); ++m) {
      double k[kMaxCoefficients];
      if (!centred_coefficients(models[m].kind, models[m].parameters.data(), extent_.centre, k)) continue;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        if (!extent_.finite[i]) continue;
        const double d = distance(models[m].kind, i, k);
        if (d <= tolerance[tolerance.size() == 1 ? 0 : i] && d < nearest[i]) {
          nearest[i] = d;
          labels[i] = static_cast<std::uint16_t>(m + 1);
        }
      }
    }
    return {};
  }

  Effort effort() const noexcept override { return effort_; }

  Result<> survey(const PointsView& points, Survey& survey) override {
    if (auto ok = check_points(points); !ok) return ok;
    survey_points(points, survey);
    return {};
  }

  Result<> weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                 std::span<Evidence> evidence) override {
    if (auto ok = check_weigh(points, how, models, distances, evidence); !ok) return ok;
    weigh_points(points, how, models, distances, evidence);
    return {};
  }

  Result<> claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                 std::span<std::uint16_t> labels, std::span<Evidence> evidence) override {
    if (auto ok = check_claim(points, tolerance, models, labels, evidence); !ok) return ok;
    claim_points(points, tolerance, models, labels, evidence);
    return {};
  }

 private:
  double* row(std::size_t i) { return centred_.data() + i * static_cast<std::size_t>(dimension_); }

  /// What overflows to no number is out of any reach.
  double distance(ModelKind kind, std::size_t i, const double* k) {
    const double d = visit_model(kind, [&]<class M>() { return std::abs(M::residual(ScalarMath{}, row(i), k)); });
    return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
  }

  double cost(const ModelView& model, Loss loss) {
    double k[kMaxCoefficients];
    if (!centred_coefficients(model.kind, model.parameters.data(), extent_.centre, k)) {
      return std::numeric_limits<double>::infinity();
    }
    double sum = 0;
    for (std::size_t i = 0; i < extent_.finite.size(); ++i) {
      if (!extent_.finite[i]) continue;
      const double r = std::min(distance(model.kind, i, k), static_cast<double>(caps_[i]));
      sum += loss == Loss::truncated_l1 ? r : r * r;
    }
    return sum;
  }

  Identity identity_{"reference", "double precision, serial"};
  Extent extent_;
  int dimension_ = 0;
  std::vector<double> centred_;
  std::vector<float> caps_;
  Effort effort_;
};

}  // namespace

Result<std::unique_ptr<FitnessEvaluator>> make_reference_evaluator() { return std::make_unique<ReferenceEvaluator>(); }

}  // namespace swarmfit::kernels
