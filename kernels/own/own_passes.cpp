#include "kernels/own/own_passes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/checks.hpp"
#include "kernels/cpu/tasks.hpp"

namespace swarmfit::kernels {
namespace {

constexpr std::size_t kRunPoints = 2048;

/// The finite points of a run, about the centre.
struct Run {
  std::size_t first, count;
  std::vector<std::size_t> finite;  // rows of the caller
  std::vector<double> rows, distances;

  Run(const PointsView& points, std::size_t run, const double* centre)
      : first(run * kRunPoints), count(std::min(kRunPoints, points.count - first)) {
    rows.reserve(count * static_cast<std::size_t>(points.dimension));
    finite.reserve(count);
    for (std::size_t i = first; i < first + count; ++i) {
      if (!points.finite(i)) continue;
      finite.push_back(i);
      for (int d = 0; d < points.dimension; ++d) rows.push_back(points.at(i, d) - centre[d]);
    }
    distances.resize(finite.size());
  }
};

void speak(const PointsView& points, std::size_t row, double distance, double weight, Evidence& evidence) {
  Moments moments;
  moments.weight = weight;
  for (int d = 0; d < points.dimension; ++d) moments.mean[static_cast<std::size_t>(d)] = points.at(row, d);
  ++evidence.count;
  evidence.square += distance * distance;
  evidence.moments.add(moments);
}

void add_up(std::span<const Evidence> parts, std::span<Evidence> evidence) {
  std::fill(evidence.begin(), evidence.end(), Evidence{});
  for (std::size_t k = 0; k < parts.size(); ++k) {
    Evidence& sum = evidence[k % evidence.size()];
    sum.count += parts[k].count;
    sum.square += parts[k].square;
    sum.cost += parts[k].cost;
    sum.moments.add(parts[k].moments);
  }
}

/// What is measured, and about which centre.
struct Measures {
  double centre[kMaxDimension] = {};
  std::vector<OwnDistances> all;

  Measures(const OwnModel& own, const PointsView& points, std::span<const ModelView> models) {
    if (own.recentre) std::copy_n(measure(points).centre, kMaxDimension, centre);
    all.reserve(models.size());
    for (const ModelView& model : models) all.emplace_back(own, model.parameters, centre);
  }
};

/// body(run, evidence of that run, one a model) for each run of points.
template <class Body>
void for_runs(const Measures& measures, const PointsView& points, std::span<Evidence> evidence, Sharing sharing, Body&& body) {
  const std::size_t runs = (points.count + kRunPoints - 1) / kRunPoints, models = evidence.size();
  std::vector<Evidence> parts(runs * models);
  const auto task = [&](std::size_t index) {
    Run run(points, index, measures.centre);
    body(run, std::span(parts).subspan(index * models, models));
  };
  if (sharing == Sharing::threads) {
    cpu::for_each_task(runs, task);
  } else {
    for (std::size_t index = 0; index < runs; ++index) task(index);
  }
  add_up(parts, evidence);
}

}  // namespace

void weigh_own(const OwnModel& own, const PointsView& points, const Weighing& how, std::span<const ModelView> models,
               std::span<float> distances, std::span<Evidence> evidence, Sharing sharing) {
  const auto tolerance = static_cast<double>(how.tolerance), corner = static_cast<double>(how.corner);
  const Measures measures(own, points, models);
  for_runs(measures, points, evidence, sharing, [&](Run& run, std::span<Evidence> parts) {
    for (std::size_t m = 0; m < measures.all.size(); ++m) {
      measures.all[m](run.rows, run.distances);
      if (!distances.empty()) {
        const std::span<float> told = distances.subspan(m * points.count);
        std::fill_n(told.begin() + static_cast<std::ptrdiff_t>(run.first), run.count, std::numeric_limits<float>::quiet_NaN());
        for (std::size_t k = 0; k < run.finite.size(); ++k) told[run.finite[k]] = static_cast<float>(run.distances[k]);
      }
      for (std::size_t k = 0; k < run.finite.size() && !parts.empty(); ++k) {
        const double d = run.distances[k], limit = how.caps.empty() ? tolerance : static_cast<double>(how.caps[run.finite[k]]);
        parts[m].cost += std::min(d, limit);
        if (d <= tolerance && d <= limit) speak(points, run.finite[k], d, 1 / std::max(d / tolerance, corner), parts[m]);
      }
    }
  });
}

void claim_own(const OwnModel& own, const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
               std::span<std::uint16_t> labels, std::span<Evidence> evidence, Sharing sharing) {
  const Measures measures(own, points, models);
  std::fill(labels.begin(), labels.end(), std::uint16_t{0});
  for_runs(measures, points, evidence, sharing, [&](Run& run, std::span<Evidence> parts) {
    std::vector<double> nearest(run.finite.size(), std::numeric_limits<double>::infinity());
    for (std::size_t m = 0; m < measures.all.size(); ++m) {
      measures.all[m](run.rows, run.distances);
      for (std::size_t k = 0; k < run.finite.size(); ++k) {
        const double d = run.distances[k], widest = static_cast<double>(tolerance[tolerance.size() > 1 ? run.finite[k] : 0]);
        parts[m].cost += std::min(d, widest);
        if (d > widest || d >= nearest[k]) continue;
        nearest[k] = d;
        labels[run.finite[k]] = static_cast<std::uint16_t>(m + 1);
      }
    }
    for (std::size_t k = 0; k < run.finite.size(); ++k) {
      const std::uint16_t label = labels[run.finite[k]];
      if (label > 0) speak(points, run.finite[k], nearest[k], 1, parts[label - 1U]);
    }
  });
}

}  // namespace swarmfit::kernels
