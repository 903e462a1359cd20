#include "kernels/cpu/point_passes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include <hwy/cache_control.h>

#include "kernels/cpu/tasks.hpp"

namespace swarmfit::kernels::cpu {
namespace {

constexpr std::size_t kRunStrips = 8;
constexpr std::size_t kRunPoints = kRunStrips * kStripPoints;

std::size_t run_count(const PointsView& points) { return (points.count + kRunPoints - 1) / kRunPoints; }

using Pivot = std::array<double, kMaxDimension>;

/// Columns of a row as double; false if one is not finite.
template <class S>
bool read_row(const PointsView& points, std::size_t row, Pivot& x) {
  const char* from = static_cast<const char*>(points.data) + row * points.stride;
  S probe = 0;
  for (std::size_t d = 0; d < static_cast<std::size_t>(points.dimension); ++d, from += sizeof(S)) {
    S value;
    std::memcpy(&value, from, sizeof value);
    probe += value * S{0};  // stays 0 unless a column is NaN or infinite
    x[d] = static_cast<double>(value);
  }
  return probe == 0;
}

/// A place among the strip's points: the median, a column, of three of them, so that a stray does not cost the others their precision. False
/// if none of the rows looked at is finite.
template <class S>
bool choose_pivot(const PointsView& points, std::size_t first, std::size_t count, Pivot& pivot) {
  constexpr std::size_t kAsked = 3, kProbes = 16;
  std::array<Pivot, kAsked> found{};
  std::size_t known = 0;
  for (std::size_t probe = 0; probe < kProbes && known < kAsked; ++probe) {
    // First, middle and last of the strip, and places in between while these are not finite.
    const std::size_t row = probe < kAsked ? probe * (count - 1) / (kAsked - 1) : probe * count / kProbes;
    known += read_row<S>(points, first + row, found[known]) ? 1 : 0;
  }
  pivot = known > 0 ? found[0] : Pivot{};
  for (std::size_t d = 0; known == kAsked && d < kMaxDimension; ++d) {
    pivot[d] = std::max(std::min(found[0][d], found[1][d]), std::min(std::max(found[0][d], found[1][d]), found[2][d]));
  }
  return known > 0;
}

/// Where the next strip's pivot will be looked for: single rows far apart, which would each be waited for.
void fetch_probes(const PointsView& points, std::size_t first) {
  for (const std::size_t row : {first, first + kStripPoints / 2, first + kStripPoints - 1}) {
    if (row < points.count) hwy::Prefetch(static_cast<const char*>(points.data) + row * points.stride);
  }
}

/// What a task needs to work on one strip after another.
struct Bench {
  Strip strip;
  Pivot pivot;
  std::array<std::uint64_t, kStripPoints / 64> finite;
  std::array<float, kStripPoints * kMaxDimension> rows;
  std::size_t first = 0, count = 0;
  std::vector<std::size_t> claimants;  ///< models that some point was given to

  /// Strip number `index` of the points; those that are finite get `limit`, or their cap where there are any. False if none is finite.
  bool load(const CpuKernels& kernels, const PointsView& points, std::size_t index, float limit, std::span<const float> caps = {}) {
    first = index * kStripPoints;
    count = std::min(kStripPoints, points.count - first);
    if (!caps.empty()) caps = caps.subspan(first, count);
    fetch_probes(points, first + kStripPoints);
    return points.scalar == Scalar::float32 ? load_as<float>(kernels, points, limit, caps) : load_as<double>(kernels, points, limit, caps);
  }

  /// The sums' moments in the points' frame.
  Moments moments(const StripSums& sums) const {
    Moments m;
    m.weight = sums.weight;
    if (!(sums.weight > 0)) return m;
    for (std::size_t a = 0; a < kMaxDimension; ++a) m.mean[a] = sums.first[a] / sums.weight;
    for (std::size_t a = 0; a < kMaxDimension; ++a) {
      for (std::size_t b = a; b < kMaxDimension; ++b) {
        m.scatter[a][b] = m.scatter[b][a] = sums.second[a][b] - sums.weight * m.mean[a] * m.mean[b];
      }
    }
    for (std::size_t a = 0; a < kMaxDimension; ++a) m.mean[a] += pivot[a];
    return m;
  }

  /// A model's coefficients about the pivot; false if one is not finite.
  bool centre(const ModelView& model, float* coefficients) const {
    char usable = 0;
    centred_coefficients(model.kind, 1, model.parameters.data(), pivot.data(), coefficients, &usable);
    return usable != 0;
  }

  /// For a model that cannot be evaluated: every distance is infinite. Returns its cost.
  double be_nowhere(std::array<float, kStripPoints>& distances) const {
    double cost = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const bool there = strip.limit[i] >= 0;
      distances[i] = there ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
      cost += there ? static_cast<double>(strip.limit[i]) : 0.0;
    }
    return cost;
  }

  void add(const StripSums& sums, Evidence& evidence) const {
    evidence.cost += sums.cost;
    if (!(sums.weight > 0)) return;
    evidence.count += static_cast<std::uint64_t>(sums.count);
    evidence.square += sums.square;
    evidence.moments.add(moments(sums));
  }

 private:
  template <class S>
  bool load_as(const CpuKernels& kernels, const PointsView& points, float limit, std::span<const float> caps) {
    const bool chosen = choose_pivot<S>(points, first, count, pivot);
    split<S>(kernels, points, limit, caps);
    const auto word = std::find_if(finite.begin(), finite.end(), [](std::uint64_t bits) { return bits != 0; });
    if (word == finite.end()) return false;
    if (!chosen) {
      read_row<S>(points, first + static_cast<std::size_t>(word - finite.begin()) * 64 + static_cast<std::size_t>(std::countr_zero(*word)),
                  pivot);
      split<S>(kernels, points, limit, caps);
    }
    return true;
  }

  template <class S>
  void split(const CpuKernels& kernels, const PointsView& points, float limit, std::span<const float> caps) {
    const auto width = static_cast<std::size_t>(points.dimension);
    const char* from = static_cast<const char*>(points.data) + first * points.stride;
    std::array<float, kMaxDimension> origin{};
    const float* tight = rows.data();
    if constexpr (std::is_same_v<S, float>) {
      for (std::size_t d = 0; d < width; ++d) origin[d] = static_cast<float>(pivot[d]);
      if (points.stride == width * sizeof(float) && reinterpret_cast<std::uintptr_t>(from) % alignof(float) == 0) {
        tight = reinterpret_cast<const float*>(from);
      } else {
        for (std::size_t i = 0; i < count; ++i, from += points.stride) std::memcpy(rows.data() + i * width, from, width * sizeof(float));
      }
    } else {
      if (width == 2) narrow_rows<2>(from, points.stride);
      if (width == 3) narrow_rows<3>(from, points.stride);
      if (width == 4) narrow_rows<4>(from, points.stride);
    }
    kernels.split(tight, width, count, origin.data(), limit, caps.empty() ? nullptr : caps.data(), strip, finite.data());
  }

  /// Doubles about the pivot as floats: finite stays finite, anything else becomes NaN.
  template <std::size_t Width>
  void narrow_rows(const char* from, std::size_t stride) {
    constexpr double kMost = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < count; ++i, from += stride) {
      double row[Width];
      std::memcpy(row, from, sizeof row);
      for (std::size_t d = 0; d < Width; ++d) {
        const double v = row[d] - pivot[d];
        const double low = v < kMost ? v : kMost, both = low > -kMost ? low : -kMost;
        rows[i * Width + d] = static_cast<float>(both + (v - v));  // v - v is 0 for what is finite
      }
    }
  }
};

/// body(bench, run, strip) for each strip, a task for each run of them.
template <class Body>
void for_strips(const PointsView& points, Body&& body) {
  const std::size_t strips = (points.count + kStripPoints - 1) / kStripPoints;
  for_each_task(run_count(points), [&](std::size_t run) {
    Bench bench;
    for (std::size_t strip = run * kRunStrips; strip < std::min(strips, (run + 1) * kRunStrips); ++strip) body(bench, run, strip);
  });
}

}  // namespace

void PointPasses::survey(const PointsView& points, Survey& survey) {
  constexpr std::size_t kWords = kStripPoints / 64;
  survey.finite.resize((points.count + 63) / 64);
  evidence_.assign(run_count(points), {});
  for_strips(points, [&](Bench& bench, std::size_t run, std::size_t strip) {
    if (bench.load(kernels_, points, strip, 0)) {
      StripSums sums;
      kernels_.sum_all(bench.strip, static_cast<std::size_t>(points.dimension), sums);
      bench.add(sums, evidence_[run]);
    }
    std::copy_n(bench.finite.begin(), (bench.count + 63) / 64, survey.finite.begin() + static_cast<std::ptrdiff_t>(strip * kWords));
  });
  std::array<Evidence, 1> all;
  add_up(evidence_.size(), all);
  survey.finite_count = all[0].count;
  survey.moments = all[0].moments;
}

void PointPasses::weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                        std::span<Evidence> evidence) {
  const std::size_t runs = run_count(points);
  evidence_.assign(runs * models.size(), {});
  for_strips(points, [&](Bench& bench, std::size_t run, std::size_t strip) {
    const bool any = bench.load(kernels_, points, strip, how.tolerance, how.caps);
    if (!any && distances.empty()) return;
    for (std::size_t m = 0; m < models.size(); ++m) {
      std::array<float, kMaxCoefficients> coefficients{};
      alignas(64) std::array<float, kStripPoints> told;
      StripSums sums;
      if (bench.centre(models[m], coefficients.data())) {
        kernels_.weigh(models[m].kind, bench.strip, coefficients.data(), how.tolerance, how.corner, sums,
                       distances.empty() ? nullptr : told.data());
      } else {
        sums.cost = bench.be_nowhere(told);
      }
      bench.add(sums, evidence_[run * models.size() + m]);
      if (!distances.empty())
        std::copy_n(told.begin(), bench.count, distances.begin() + static_cast<std::ptrdiff_t>(m * points.count + bench.first));
    }
  });
  add_up(runs, evidence);
}

void PointPasses::claim(const PointsView& points, float tolerance, std::span<const ModelView> models, std::span<std::uint16_t> labels,
                        std::span<Evidence> evidence) {
  const std::size_t runs = run_count(points);
  const float beyond = std::nextafter(tolerance, std::numeric_limits<float>::infinity());
  evidence_.assign(runs * models.size(), {});
  for_strips(points, [&](Bench& bench, std::size_t run, std::size_t strip) {
    if (!bench.load(kernels_, points, strip, tolerance)) {
      std::fill_n(labels.begin() + static_cast<std::ptrdiff_t>(bench.first), bench.count, std::uint16_t{0});
      return;
    }
    alignas(64) std::array<float, kStripPoints> nearest, told;
    alignas(64) std::array<std::int32_t, kStripPoints> label;
    kernels_.begin_claim(bench.strip, beyond, nearest.data(), label.data());
    bench.claimants.clear();
    const auto width = static_cast<std::size_t>(points.dimension);
    Evidence* const of_run = evidence_.data() + run * models.size();
    for (std::size_t m = 0; m < models.size(); ++m) {
      std::array<float, kMaxCoefficients> coefficients{};
      if (!bench.centre(models[m], coefficients.data())) {
        of_run[m].cost += bench.be_nowhere(told);
        continue;
      }
      const bool claimed = kernels_.claim(models[m].kind, bench.strip, coefficients.data(), static_cast<std::int32_t>(m + 1),
                                          nearest.data(), label.data(), of_run[m].cost);
      if (claimed) bench.claimants.push_back(m);
    }
    kernels_.end_claim(label.data(), bench.count, labels.data() + bench.first);
    for (const std::size_t m : bench.claimants) {
      StripSums sums;
      kernels_.sum_labelled(bench.strip, width, static_cast<std::int32_t>(m + 1), nearest.data(), label.data(), sums);
      bench.add(sums, of_run[m]);
    }
  });
  add_up(runs, evidence);
}

void PointPasses::add_up(std::size_t runs, std::span<Evidence> evidence) const {
  std::fill(evidence.begin(), evidence.end(), Evidence{});
  for (std::size_t run = 0; run < runs; ++run) {
    for (std::size_t m = 0; m < evidence.size(); ++m) {
      const Evidence& part = evidence_[run * evidence.size() + m];
      evidence[m].count += part.count;
      evidence[m].square += part.square;
      evidence[m].cost += part.cost;
      evidence[m].moments.add(part.moments);
    }
  }
}

}  // namespace swarmfit::kernels::cpu
