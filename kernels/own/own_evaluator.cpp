// Own models on the processor: the user's function in double precision, which makes the reference and, on several threads, the CPU back
// end.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "kernels/checks.hpp"
#include "kernels/cpu/processor.hpp"
#include "kernels/cpu/tasks.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/own/own_passes.hpp"

namespace swarmfit::kernels {
namespace {

constexpr std::size_t kChunkPoints = 512;  // residuals asked for in one call of the user's function

class OwnEvaluator final : public FitnessEvaluator {
 public:
  /// `threads`: none is the reference.
  OwnEvaluator(std::shared_ptr<const OwnModel> own, Identity identity, std::optional<int> threads)
      : own_(std::move(own)), identity_(std::move(identity)) {
    if (threads) crew_.emplace(*threads);
  }

  const Identity& identity() const noexcept override { return identity_; }
  Support supports(const Workload&) const override { return {}; }

  Result<> set_points(const PointsView& points) override {
    effort_ = {};
    if (auto ok = check_points(points); !ok) return ok;
    return cpu::guarded(points.count, [&] {
      extent_ = measure(points);
      if (!own_->recentre) std::fill_n(extent_.centre, kMaxDimension, 0.0);
      dimension_ = points.dimension;
      input_.clear();
      rows_.clear();
      for (std::size_t i = 0; i < points.count; ++i) {
        if (extent_.finite[i] == 0) continue;
        input_.push_back(i);
        for (int d = 0; d < dimension_; ++d) rows_.push_back(points.at(i, d) - extent_.centre[d]);
      }
      caps_.assign(input_.size(), 0.0);
    });
  }

  Result<> set_caps(std::span<const float> caps) override {
    if (auto ok = check_caps(caps, extent_.finite); !ok) return ok;
    for (std::size_t k = 0; k < input_.size(); ++k) caps_[k] = static_cast<double>(caps[input_[k]]);
    return {};
  }

  Result<> evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) override {
    if (auto ok = check_swarm(swarm, dimension_, cutoffs, costs, own_.get()); !ok) return ok;
    return cpu::guarded(input_.size(), [&] {
      const auto width = static_cast<std::size_t>(own_->parameter_count);
      std::vector<std::uint64_t> touched(swarm.count);
      each(swarm.count, cpu::worth_sharing(input_.size() * swarm.count), [&](std::size_t j) {
        const OwnDistances measure(*own_, swarm.parameters.subspan(j * width, width), extent_.centre);
        costs[j] = cost(measure, loss, cutoffs.empty() ? std::numeric_limits<float>::infinity() : cutoffs[j], touched[j]);
      });
      effort_.evaluations += swarm.count;
      effort_.point_models += swarm.count * input_.size();
      effort_.touched += std::accumulate(touched.begin(), touched.end(), std::uint64_t{0});
    });
  }

  Result<> distances(const ModelView& model, std::span<float> distances) override {
    if (auto ok = check_model(model, dimension_, own_.get()); !ok) return ok;
    if (auto ok = check_size("distances.size()", distances.size(), extent_.finite.size()); !ok) return ok;
    return cpu::guarded(input_.size(), [&] {
      std::fill(distances.begin(), distances.end(), std::numeric_limits<float>::quiet_NaN());
      const OwnDistances measure(*own_, model.parameters, extent_.centre);
      for_chunks([&](std::size_t first, std::span<const double> rows, std::span<double> near) {
        measure(rows, near);
        for (std::size_t k = 0; k < near.size(); ++k) distances[input_[first + k]] = static_cast<float>(near[k]);
      });
    });
  }

  Result<> assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) override {
    if (auto ok = check_assign(models, dimension_, extent_.finite.size(), tolerance, labels, own_.get()); !ok) return ok;
    return cpu::guarded(input_.size(), [&] {
      std::fill(labels.begin(), labels.end(), std::uint16_t{0});
      std::vector<OwnDistances> measures;
      for (const ModelView& model : models) measures.emplace_back(*own_, model.parameters, extent_.centre);
      for_chunks([&](std::size_t first, std::span<const double> rows, std::span<double> near) {
        std::vector<double> nearest(near.size(), std::numeric_limits<double>::infinity());
        for (std::size_t m = 0; m < measures.size(); ++m) {
          measures[m](rows, near);
          for (std::size_t k = 0; k < near.size(); ++k) {
            const std::size_t row = input_[first + k];
            if (near[k] > static_cast<double>(tolerance[tolerance.size() == 1 ? 0 : row]) || near[k] >= nearest[k]) continue;
            nearest[k] = near[k];
            labels[row] = static_cast<std::uint16_t>(m + 1);
          }
        }
      });
    });
  }

  Effort effort() const noexcept override { return effort_; }

  Result<> survey(const PointsView& points, Survey& survey) override {
    if (auto ok = check_points(points); !ok) return ok;
    return cpu::guarded(points.count, [&] { survey_points(points, survey); });
  }

  Result<> weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                 std::span<Evidence> evidence) override {
    if (auto ok = check_weigh(points, how, models, distances, evidence, own_.get()); !ok) return ok;
    return cpu::guarded(points.count, [&] {
      run(points.count, [&](Sharing sharing) { weigh_own(*own_, points, how, models, distances, evidence, sharing); });
    });
  }

  Result<> claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                 std::span<std::uint16_t> labels, std::span<Evidence> evidence) override {
    if (auto ok = check_claim(points, tolerance, models, labels, evidence, own_.get()); !ok) return ok;
    return cpu::guarded(points.count, [&] {
      run(points.count, [&](Sharing sharing) { claim_own(*own_, points, tolerance, models, labels, evidence, sharing); });
    });
  }

 private:
  /// work(sharing) where that is to be done.
  template <class Work>
  void run(std::size_t points, Work&& work) {
    if (crew_ && cpu::worth_sharing(points)) {
      cpu::run_in(*crew_, true, [&] { work(Sharing::threads); });
    } else {
      work(Sharing::serial);
    }
  }

  /// body(task) for each task, one after another or on the crew's threads.
  template <class Body>
  void each(std::size_t tasks, bool shared, Body&& body) {
    if (crew_ && shared) {
      cpu::run_in(*crew_, true, [&] { cpu::for_each_task(tasks, body); });
    } else {
      for (std::size_t task = 0; task < tasks; ++task) body(task);
    }
  }

  std::span<const double> rows(std::size_t first, std::size_t count) const {
    const auto width = static_cast<std::size_t>(dimension_);
    return std::span(rows_).subspan(first * width, count * width);
  }

  /// body(first, rows, room for a distance each) for each chunk of the stored points.
  template <class Body>
  void for_chunks(Body&& body) {
    each((input_.size() + kChunkPoints - 1) / kChunkPoints, cpu::worth_sharing(input_.size()), [&](std::size_t chunk) {
      const std::size_t first = chunk * kChunkPoints, count = std::min(kChunkPoints, input_.size() - first);
      std::vector<double> near(count);
      body(first, rows(first, count), std::span(near));
    });
  }

  /// Chunk after chunk, until the sum has reached the cutoff.
  float cost(const OwnDistances& measure, Loss loss, float cutoff, std::uint64_t& touched) const {
    if (!measure.usable()) return std::numeric_limits<float>::infinity();
    std::vector<double> near(std::min(kChunkPoints, input_.size()));
    double sum = 0;
    for (std::size_t first = 0; first < input_.size() && !(sum >= static_cast<double>(cutoff)); first += kChunkPoints) {
      const std::size_t count = std::min(kChunkPoints, input_.size() - first);
      measure(rows(first, count), std::span(near).first(count));
      for (std::size_t k = 0; k < count; ++k) {
        const double d = std::min(near[k], caps_[first + k]);
        sum += loss == Loss::truncated_l1 ? d : d * d;
      }
      touched += count;
    }
    return static_cast<float>(sum);
  }

  std::shared_ptr<const OwnModel> own_;
  Identity identity_;
  std::optional<cpu::Crew> crew_;
  Extent extent_;
  int dimension_ = 0;
  std::vector<std::size_t> input_;  // of each stored point, which are the finite ones, its row
  std::vector<double> rows_, caps_;
  Effort effort_;
};

}  // namespace

Result<std::unique_ptr<FitnessEvaluator>> make_own_evaluator(std::string_view backend, const EvaluatorOptions& options) {
  const auto threads = cpu::choose_threads(options.threads);
  if (!threads) return tl::unexpected(threads.error());
  if (backend == "reference") {
    return std::make_unique<OwnEvaluator>(options.own, Identity{"reference", "double precision, serial"}, std::nullopt);
  }
  return std::make_unique<OwnEvaluator>(options.own, Identity{"cpu", "CPU, double precision"}, *threads);
}

}  // namespace swarmfit::kernels
