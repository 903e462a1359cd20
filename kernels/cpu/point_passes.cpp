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

std::size_t strip_count(const PointsView& points) { return (points.count + kStripPoints - 1) / kStripPoints; }

/// Consecutive strips make a task, and have sums of their own: one where strips are few, so that there is enough to share.
std::size_t run_strips(const PointsView& points) {
  constexpr std::size_t kMost = 4, kTasks = 16;
  return std::clamp(strip_count(points) / kTasks, std::size_t{1}, kMost);
}

std::size_t run_count(const PointsView& points) {
  const std::size_t each = run_strips(points);
  return (strip_count(points) + each - 1) / each;
}

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

/// A place among the strip's points: the median, a column, of three of them, so that a stray does not cost the others their precision.
/// False if none of the rows looked at is finite.
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

constexpr std::size_t kWordBits = 64, kStripWords = kStripPoints / kWordBits;

/// Rows of a strip that follow each other and are in it.
struct Piece {
  std::size_t row, at, count;  ///< first row and its place, counted from the strip's first
};

/// What a task needs to work on one strip after another.
struct Bench {
  Strip strip;
  Pivot pivot;
  std::array<std::uint64_t, kStripWords> finite;
  std::array<float, kStripPoints * kMaxDimension> rows;
  std::array<double, kStripPoints * kMaxDimension> wide;
  std::size_t first = 0, count = 0;
  std::array<Piece, kStripWords> pieces;
  std::size_t piece_count = 0;

  /// Strip number `index` of the points; those that are finite get `limit`, or their cap where there are any. False if none is finite.
  /// Words without a finite row are left out where the points tell of them.
  bool load(const CpuKernels& kernels, const PointsView& points, std::size_t index, float limit, std::span<const float> caps = {}) {
    first = index * kStripPoints;
    count = std::min(kStripPoints, points.count - first);
    cut(points);
    if (!caps.empty()) caps = caps.subspan(first, count);
    fetch_probes(points, first + kStripPoints);
    if (piece_count == 0) return false;
    return points.scalar == Scalar::float32 ? load_as<float>(kernels, points, limit, caps) : load_as<double>(kernels, points, limit, caps);
  }

  /// Strip number `index` of the points, of which it is not known yet what is finite; false if none is.
  bool survey(const CpuKernels& kernels, CpuKernels::Look look, const PointsView& points, std::size_t index, StripSums& sums) {
    first = index * kStripPoints;
    count = std::min(kStripPoints, points.count - first);
    cut(points);
    fetch_probes(points, first + kStripPoints);
    return points.scalar == Scalar::float32 ? survey_as<float>(kernels, look, points, sums)
                                            : survey_as<double>(kernels, look, points, sums);
  }

  /// What was found for the strip's rows to where the caller has a place for each of his; `nothing` for those that are not in it.
  template <class T, class Give>
  void hand_back(T nothing, std::span<T> all, Give&& give) const {
    T* const to = all.data() + first;
    std::size_t row = 0;
    for (const Piece& piece : std::span(pieces).first(piece_count)) {
      std::fill(to + row, to + piece.row, nothing);
      give(piece.at, piece.count, to + piece.row);
      row = piece.row + piece.count;
    }
    std::fill(to + row, to + count, nothing);
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
    for (std::size_t i = 0; i < strip.count; ++i) {
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
  /// The rows to be in the strip: all, or the words of them that hold a finite one.
  void cut(const PointsView& points) {
    strip.count = 0;
    pivot = {};
    piece_count = 0;
    if (points.finite_rows == nullptr) {
      pieces[piece_count++] = {0, 0, count};
      return;
    }
    const std::uint64_t* const words = points.finite_rows + first / kWordBits;
    std::size_t at = 0;
    for (std::size_t row = 0; row < count; row += kWordBits) {
      if (words[row / kWordBits] == 0) continue;
      const std::size_t here = std::min(kWordBits, count - row);
      if (piece_count > 0 && pieces[piece_count - 1].row + pieces[piece_count - 1].count == row) {
        pieces[piece_count - 1].count += here;
      } else {
        pieces[piece_count++] = {row, at, here};
      }
      at += here;
    }
  }

  /// look(), which takes the pivot for the origin and tells which rows of the pieces are finite; once more about one that is where none had
  /// been found before. False if none is.
  template <class S, class Look>
  bool look_about_pivot(const PointsView& points, Look&& look) {
    const bool chosen = choose_pivot<S>(points, first, count, pivot);
    look();
    const Piece& last = pieces[piece_count - 1];
    const auto end = finite.begin() + static_cast<std::ptrdiff_t>((last.at + last.count + kWordBits - 1) / kWordBits);
    const auto word = std::find_if(finite.begin(), end, [](std::uint64_t bits) { return bits != 0; });
    if (word == end) return false;
    if (!chosen) {
      const std::size_t place = static_cast<std::size_t>(word - finite.begin()) * kWordBits;
      read_row<S>(points, first + row_at(place) + static_cast<std::size_t>(std::countr_zero(*word)), pivot);
      look();
    }
    return true;
  }

  template <class S>
  bool survey_as(const CpuKernels& kernels, CpuKernels::Look look, const PointsView& points, StripSums& sums) {
    return look_about_pivot<S>(points, [&] {
      look(tight_rows<S>(kernels, points, pieces[0]), static_cast<std::size_t>(points.dimension), count, origin<S>(points).data(), sums,
           finite.data());
    });
  }

  template <class S>
  bool load_as(const CpuKernels& kernels, const PointsView& points, float limit, std::span<const float> caps) {
    return look_about_pivot<S>(points, [&] { split<S>(kernels, points, limit, caps); });
  }

  /// What kernels take off rows: nothing where it was taken off while they were narrowed.
  template <class S>
  std::array<float, kMaxDimension> origin(const PointsView& points) const {
    std::array<float, kMaxDimension> origin{};
    if constexpr (!std::is_same_v<S, float>) return origin;
    for (std::size_t d = 0; d < static_cast<std::size_t>(points.dimension); ++d) origin[d] = static_cast<float>(pivot[d]);
    return origin;
  }

  std::size_t row_at(std::size_t place) const {
    std::size_t k = 0;
    while (place >= pieces[k].at + pieces[k].count) ++k;
    return pieces[k].row + place - pieces[k].at;
  }

  template <class S>
  void split(const CpuKernels& kernels, const PointsView& points, float limit, std::span<const float> caps) {
    const std::array<float, kMaxDimension> off = origin<S>(points);
    for (const Piece& piece : std::span(pieces).first(piece_count)) {
      kernels.split(tight_rows<S>(kernels, points, piece), static_cast<std::size_t>(points.dimension), piece.count, off.data(), limit,
                    caps.empty() ? nullptr : caps.data() + piece.row, piece.at, strip, finite.data() + piece.at / kWordBits);
    }
  }

  /// The caller's own memory where rows lie there one beside the other, else a copy.
  template <class S>
  const float* tight_rows(const CpuKernels& kernels, const PointsView& points, const Piece& piece) {
    const auto width = static_cast<std::size_t>(points.dimension);
    const char* from = static_cast<const char*>(points.data) + (first + piece.row) * points.stride;
    if constexpr (std::is_same_v<S, float>) {
      if (points.stride == width * sizeof(float) && reinterpret_cast<std::uintptr_t>(from) % alignof(float) == 0) {
        return reinterpret_cast<const float*>(from);
      }
      for (std::size_t i = 0; i < piece.count; ++i, from += points.stride)
        std::memcpy(rows.data() + i * width, from, width * sizeof(float));
    } else {
      const double* tight = reinterpret_cast<const double*>(from);
      if (points.stride != width * sizeof(double) || reinterpret_cast<std::uintptr_t>(from) % alignof(double) != 0) {
        for (std::size_t i = 0; i < piece.count; ++i, from += points.stride)
          std::memcpy(wide.data() + i * width, from, width * sizeof(double));
        tight = wide.data();
      }
      kernels.narrow(tight, width, piece.count, pivot.data(), rows.data());
    }
    return rows.data();
  }
};

/// Have points so much extent in every direction that sums in float tell it? By the pivots of Gaussian elimination, none of which is less
/// than the least spread of all directions.
bool clearly_solid(int dimension, const Moments& moments) {
  constexpr double kThin = 1e-4;  // of the largest; sums of a strip are off by some 1e-6 of its spread
  auto a = moments.scatter;
  const auto size = static_cast<std::size_t>(dimension);
  double largest = 0;
  for (std::size_t d = 0; d < size; ++d) largest = std::max(largest, a[d][d]);
  for (std::size_t d = 0; d < size; ++d) {
    if (!(a[d][d] > kThin * largest)) return false;
    for (std::size_t r = d + 1; r < size; ++r) {
      for (std::size_t c = d + 1; c < size; ++c) a[r][c] -= a[r][d] * a[d][c] / a[d][d];
    }
  }
  return true;
}

/// body(bench, run, strip) for each strip, a task for each run of them.
template <class Body>
void for_strips(const PointsView& points, Body&& body) {
  const std::size_t strips = strip_count(points), each = run_strips(points);
  for_each_task(run_count(points), [&](std::size_t run) {
    Bench bench;
    for (std::size_t strip = run * each; strip < std::min(strips, (run + 1) * each); ++strip) body(bench, run, strip);
  });
}

}  // namespace

void PointPasses::survey(const PointsView& points, Survey& survey) {
  survey.finite.resize((points.count + 63) / 64);
  survey_with(kernels_.survey, points, survey);
  if (survey.finite_count > 0 && !clearly_solid(points.dimension, survey.moments)) survey_with(kernels_.survey_exactly, points, survey);
}

void PointPasses::survey_with(CpuKernels::Look look, const PointsView& points, Survey& survey) {
  evidence_.assign(run_count(points), {});
  PointsView unknown = points;
  unknown.finite_rows = nullptr;
  for_strips(unknown, [&](Bench& bench, std::size_t run, std::size_t strip) {
    StripSums sums;
    if (bench.survey(kernels_, look, unknown, strip, sums)) bench.add(sums, evidence_[run]);
    std::copy_n(bench.finite.begin(), (bench.count + 63) / 64, survey.finite.begin() + static_cast<std::ptrdiff_t>(strip * kStripWords));
  });
  std::array<Evidence, 1> all;
  add_up(evidence_.size(), all);
  survey.finite_count = all[0].count;
  survey.moments = all[0].moments;
}

void PointPasses::weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                        std::span<Evidence> evidence) {
  const std::size_t runs = run_count(points), sums_of = evidence.size();
  evidence_.assign(runs * sums_of, {});
  for_strips(points, [&](Bench& bench, std::size_t run, std::size_t strip) {
    const bool any = bench.load(kernels_, points, strip, how.tolerance, how.caps);
    if (!any && distances.empty()) return;
    for (std::size_t m = 0; m < models.size(); ++m) {
      std::array<float, kMaxCoefficients> coefficients{};
      alignas(64) std::array<float, kStripPoints> told;
      StripSums sums;
      if (!bench.centre(models[m], coefficients.data())) {
        sums.cost = bench.be_nowhere(told);
      } else if (sums_of == 0) {
        kernels_.tell(models[m].kind, bench.strip, coefficients.data(), told.data());
      } else {
        kernels_.weigh(models[m].kind, bench.strip, coefficients.data(), how.tolerance, how.corner, sums,
                       distances.empty() ? nullptr : told.data());
      }
      if (sums_of > 0) bench.add(sums, evidence_[run * sums_of + m]);
      if (!distances.empty()) {
        bench.hand_back(std::numeric_limits<float>::quiet_NaN(), distances.subspan(m * points.count, points.count),
                        [&](std::size_t at, std::size_t count, float* to) { std::copy_n(told.data() + at, count, to); });
      }
    }
  });
  add_up(runs, evidence);
}

void PointPasses::claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                        std::span<std::uint16_t> labels, std::span<Evidence> evidence) {
  const std::size_t runs = run_count(points);
  const std::span<const float> each = tolerance.size() > 1 ? tolerance : std::span<const float>();
  evidence_.assign(runs * models.size(), {});
  claimed_.resize(runs * models.size());
  for_strips(points, [&](Bench& bench, std::size_t run, std::size_t strip) {
    if (!bench.load(kernels_, points, strip, tolerance[0], each)) {
      std::fill_n(labels.begin() + static_cast<std::ptrdiff_t>(bench.first), bench.count, std::uint16_t{0});
      return;
    }
    alignas(64) std::array<float, kStripPoints> nearest, told;
    alignas(64) std::array<std::int32_t, kStripPoints> label;
    kernels_.begin_claim(bench.strip, nearest.data(), label.data());
    const auto width = static_cast<std::size_t>(points.dimension);
    Evidence* const of_run = evidence_.data() + run * models.size();
    std::uint8_t* const claimed = claimed_.data() + run * models.size();
    for (std::size_t m = 0; m < models.size(); ++m) {
      std::array<float, kMaxCoefficients> coefficients{};
      const bool usable = bench.centre(models[m], coefficients.data());
      if (!usable) of_run[m].cost += bench.be_nowhere(told);
      claimed[m] = usable && kernels_.claim(models[m].kind, bench.strip, coefficients.data(), static_cast<std::int32_t>(m + 1),
                                            nearest.data(), label.data(), of_run[m].cost);
    }
    bench.hand_back(std::uint16_t{0}, labels,
                    [&](std::size_t at, std::size_t count, std::uint16_t* to) { kernels_.end_claim(label.data() + at, count, to); });
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (claimed[m] == 0) continue;
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
