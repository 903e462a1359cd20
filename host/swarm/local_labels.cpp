#include "host/swarm/local_labels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr float kSlabs = 6;            // each tau wide, on each side of a model: what lies within is along it
constexpr std::size_t kNear = 16;      // points along the model that tell the densities about one of them
constexpr double kLeastPrior = 4;      // points' worth of what is known of the model as a whole, where the densities along it differ
constexpr double kMostPrior = 64;      // and where they do not
constexpr double kLeastBeside = 0.5;   // no place is so empty that an outlier could not be there
constexpr double kLeft = 0.5;          // what a point within tau that its model was denied still counts for it
constexpr double kSigmasPerTau = 2.5;  // 98.8 % of a Gaussian lie within tau
constexpr int kPasses = 2;             // the second knows which points the first denied

/// The points along one model, in the order of the coordinate in which they spread most.
class Along {
 public:
  Along(const models::WorkingPoints& points, std::span<const float> distances, std::span<const std::uint16_t> nearest, std::uint16_t label,
        float tau)
      : dimension_(points.dimension()) {
    for (std::uint32_t i = 0; i < distances.size(); ++i) {
      if (!(distances[i] <= kSlabs * tau) || (nearest[i] != 0 && nearest[i] != label)) continue;
      all_.push_back({{}, i});
      for (int d = 0; d < points.dimension(); ++d) all_.back().at[static_cast<std::size_t>(d)] = points.at(i, d);
    }
    const std::size_t axis = widest();
    for (One& one : all_) std::swap(one.at[0], one.at[axis]);
    std::sort(all_.begin(), all_.end(),
              [](const One& a, const One& b) { return a.at[0] < b.at[0] || (a.at[0] == b.at[0] && a.point < b.point); });
  }

  std::size_t size() const noexcept { return all_.size(); }
  std::uint32_t point(std::size_t place) const noexcept { return all_[place].point; }

  /// Places of the points nearest to that at a place, itself left out; where two are as near, the one that comes first on the walk
  /// outwards.
  std::size_t near(std::size_t place, std::array<std::uint32_t, kNear>& nearest) const {
    if (dimension_ == 2) return near_in<2>(place, nearest);
    if (dimension_ == 3) return near_in<3>(place, nearest);
    return near_in<models::kMaxDimension>(place, nearest);
  }

 private:
  static constexpr double kNothing = std::numeric_limits<double>::infinity();
  struct One {
    std::array<double, models::kMaxDimension> at;
    std::uint32_t point;
  };

  template <std::size_t D>
  std::size_t near_in(std::size_t place, std::array<std::uint32_t, kNear>& nearest) const {
    std::array<double, kNear> square{};
    std::size_t count = 0, below = place, above = place + 1;
    for (;;) {
      const double down = below > 0 ? all_[place].at[0] - all_[below - 1].at[0] : kNothing;
      const double up = above < all_.size() ? all_[above].at[0] - all_[place].at[0] : kNothing;
      const double step = std::min(down, up);
      if (step == kNothing || (count == kNear && step * step >= square[kNear - 1])) return count;
      const std::size_t other = down <= up ? --below : above++;
      const double far = apart<D>(place, other);
      if (count == kNear && far >= square[kNear - 1]) continue;
      std::size_t slot = count < kNear ? count++ : kNear - 1;
      for (; slot > 0 && square[slot - 1] > far; --slot) {
        square[slot] = square[slot - 1];
        nearest[slot] = nearest[slot - 1];
      }
      square[slot] = far;
      nearest[slot] = static_cast<std::uint32_t>(other);
    }
  }

  std::size_t widest() const {
    std::size_t widest = 0;
    double most = -1;
    for (std::size_t d = 0; d < models::kMaxDimension; ++d) {
      double low = kNothing, high = -kNothing;
      for (const One& one : all_) {
        low = std::min(low, one.at[d]);
        high = std::max(high, one.at[d]);
      }
      if (!(high - low > most)) continue;
      most = high - low;
      widest = d;
    }
    return widest;
  }

  template <std::size_t D>
  double apart(std::size_t a, std::size_t b) const {
    double sum = 0;
    for (std::size_t d = 0; d < D; ++d) sum += (all_[a].at[d] - all_[b].at[d]) * (all_[a].at[d] - all_[b].at[d]);
    return sum;
  }

  int dimension_;
  kernels::Reused<One> all_;
};

/// How many times likelier a point at distance d of tau is the model's than an outlier, where `own` points near it are the model's
/// so far and `beside` are not.
double odds(double own, double beside, double d) {
  constexpr double kPeak = 2 * kSigmasPerTau / 2.5066282746310002;  // of half a Gaussian, a slab being 1
  const double outliers = (beside + kLeastBeside) / static_cast<double>(kSlabs - 1);
  const double peak = std::max(0.0, own - outliers) * kPeak;
  return peak * std::exp(-0.5 * kSigmasPerTau * kSigmasPerTau * d * d) / outliers;
}

kernels::Reused<std::uint16_t> nearest_of(std::span<const kernels::Reused<float>> distances, float tau, std::size_t points) {
  kernels::Reused<std::uint16_t> labels(points, 0);
  for (std::size_t i = 0; i < points; ++i) {
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t m = 0; m < distances.size(); ++m) {
      if (!(distances[m][i] <= tau) || !(distances[m][i] < least)) continue;
      least = distances[m][i];
      labels[i] = static_cast<std::uint16_t>(m + 1);
    }
  }
  return labels;
}

/// Which points of a model have more of its own about them than of others', by what each point counts for it.
class Reach {
 public:
  Reach(const models::WorkingPoints& points, std::span<const float> distances, std::span<const std::uint16_t> nearest, std::uint16_t label,
        float tau)
      : along_(points, distances, nearest, label, tau), distances_(distances), label_(label), tau_(tau), counts_(along_.size(), 0.0) {
    for (std::size_t k = 0; k < along_.size(); ++k) {
      counts_[k] = nearest[along_.point(k)] == label ? 1 : 0;
      if (distances[along_.point(k)] <= tau) asked_.push_back({static_cast<std::uint32_t>(k), {}, 0});
    }
    for (Asked& one : asked_) one.count = along_.near(one.place, one.near);
  }

  /// Keeps the nearer of two models where both have a claim.
  void claim(std::span<float> least, std::span<std::uint16_t> labels) const {
    double all = 0;
    for (const double one : counts_) all += one;
    const double share = along_.size() > 0 ? all / static_cast<double>(along_.size()) : 0.0;
    const double prior = worth_of_whole(share);
    for (const Asked& one : asked_) {
      const double own = prior * share + own_near(one);
      const std::uint32_t point = along_.point(one.place);
      const double beside = prior + static_cast<double>(one.count) - own;
      if (!(odds(own, beside, static_cast<double>(distances_[point] / tau_)) > 1) || !(distances_[point] < least[point])) continue;
      least[point] = distances_[point];
      labels[point] = label_;
    }
  }

  void learn(std::span<const std::uint16_t> nearest, std::span<const std::uint16_t> labels) {
    for (std::size_t k = 0; k < along_.size(); ++k) {
      const std::uint32_t point = along_.point(k);
      const double denied = nearest[point] == label_ ? kLeft : 0.0;
      counts_[k] = labels[point] == label_ ? 1.0 : denied;
    }
  }

 private:
  struct Asked {
    std::uint32_t place;
    std::array<std::uint32_t, kNear> near;
    std::size_t count;
  };

  double own_near(const Asked& asked) const {
    double own = 0;
    for (std::size_t k = 0; k < asked.count; ++k) own += counts_[asked.near[k]];
    return own;
  }

  /// How many points' worth the model's share as a whole is beside what is near a point: the more, the less the shares along the model
  /// differ beyond what chance makes of so few neighbours. They are taken to be beta distributed, and their variance tells (method of
  /// moments).
  double worth_of_whole(double share) const {
    double differs = 0, by_chance = 0;
    for (const Asked& one : asked_) {
      if (one.count == 0) continue;
      const auto n = static_cast<double>(one.count);
      const double off = own_near(one) / n - share;
      differs += off * off;
      by_chance += share * (1 - share) / n;
    }
    const double beyond = differs - by_chance, all = share * (1 - share) * static_cast<double>(asked_.size());
    return beyond * kMostPrior > all ? std::max(kLeastPrior, all / beyond) : kMostPrior;
  }

  Along along_;
  std::span<const float> distances_;
  std::uint16_t label_;
  float tau_;
  kernels::Reused<double> counts_;  // of the points along the model: 1 for one that is its own
  kernels::Reused<Asked> asked_;    // those within tau
};

}  // namespace

kernels::Reused<std::uint16_t> label_locally(const models::WorkingPoints& points, std::span<const kernels::Reused<float>> distances,
                                             float tau) {
  const kernels::Reused<std::uint16_t> nearest = nearest_of(distances, tau, points.size());
  kernels::Reused<Reach> reaches;
  reaches.reserve(distances.size());
  for (std::size_t m = 0; m < distances.size(); ++m)
    reaches.emplace_back(points, distances[m], nearest, static_cast<std::uint16_t>(m + 1), tau);
  kernels::Reused<std::uint16_t> labels;
  kernels::Reused<float> least;
  for (int pass = 0; pass < kPasses; ++pass) {
    if (pass > 0) {
      for (Reach& reach : reaches) reach.learn(nearest, labels);
    }
    labels.assign(points.size(), 0);
    least.assign(points.size(), std::numeric_limits<float>::infinity());
    for (const Reach& reach : reaches) reach.claim(least, labels);
  }
  return labels;
}

}  // namespace swarmfit::swarm
