#include "bench/sampling_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include <swarmfit/fit.hpp>

namespace swarmfit::peers {
namespace {

constexpr std::size_t kSearchPoints = 8192;  // no fewer than Swarmfit's own search looks at
constexpr int kRefinements = 3;
constexpr int kPatience = 2;
constexpr float kDeadZone = 2;  // in thresholds: what a plane explains reaches so far, or its noise is found again

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

template <class T>
T take(kernels::Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}
void take(kernels::Result<> result) {
  if (!result) throw std::runtime_error(result.error().message);
}

std::optional<Plane> flattest(const Vector3& mean, const Matrix3& scatter) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(scatter);
  const Vector3 normal = axes.eigenvectors().col(0);
  if (axes.info() != Eigen::Success || !normal.allFinite()) return std::nullopt;
  return Plane{{normal.x(), normal.y(), normal.z()}, -normal.dot(mean)};
}

Vector3 at(std::span<const float> points, std::uint32_t i) {
  return Eigen::Map<const Eigen::Vector3f>(points.data() + std::size_t{3} * i).cast<double>();
}

std::array<double, 4> parameters(const Plane& plane) { return {plane.normal[0], plane.normal[1], plane.normal[2], plane.offset}; }

kernels::PointsView view(std::span<const float> points) {
  return {points.data(), kernels::Scalar::float32, 3, points.size() / 3, 3 * sizeof(float)};
}

/// The planes of one run, and what they have explained.
class Run {
 public:
  Run(kernels::FitnessEvaluator& evaluator, const Scene& scene, const Task& task, std::uint64_t seed)
      : evaluator_(evaluator), all_(scene.points), task_(task), tau_(static_cast<float>(task.threshold)), random_(seed) {
    const std::size_t count = all_.size() / 3, size = std::min(count, kSearchPoints);
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t first = k * count / size, last = (k + 1) * count / size;
      const std::size_t i = first + random_() % (last - first);
      part_.insert(part_.end(), {all_[3 * i], all_[3 * i + 1], all_[3 * i + 2]});
    }
    caps_.assign(size, tau_);
    all_caps_.assign(count, tau_);
    take(evaluator_.set_points(view(part_)));
  }

  /// Whether a plane was found that holds enough points.
  bool next(const Search& search, std::size_t budget) {
    take(evaluator_.set_caps(caps_));
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < caps_.size(); ++i) {
      if (caps_[i] > 0) open.push_back(i);
    }
    Hypotheses hypotheses(evaluator_, part_, open, caps_, tau_, budget, random_);
    search(hypotheses);
    spent_ += hypotheses.spent();
    const auto refined = hypotheses.best() ? refine(*hypotheses.best()) : std::nullopt;
    if (!refined) return false;
    planes_.push_back(*refined);
    explain(*refined);
    return true;
  }

  Found found() && {
    Found found;
    found.planes = planes_;
    found.evaluations = spent_;
    found.labels.assign(all_.size() / 3, 0);
    std::vector<std::array<double, 4>> rows;
    for (const Plane& plane : planes_) rows.push_back(parameters(plane));
    std::vector<kernels::ModelView> models;
    for (const auto& row : rows) models.push_back({kernels::ModelKind::plane, row});
    std::vector<kernels::Evidence> evidence(models.size());
    if (!models.empty()) take(evaluator_.claim(view(all_), {&tau_, 1}, models, found.labels, evidence));
    return found;
  }

  std::size_t planes() const noexcept { return planes_.size(); }

 private:
  /// Least squares on the open points of the whole cloud, again and again; none where these are too few.
  std::optional<Plane> refine(Plane plane) {
    for (int round = 0; round <= kRefinements; ++round) {
      const auto row = parameters(plane);
      const kernels::ModelView model{kernels::ModelKind::plane, row};
      std::array<kernels::Evidence, 1> evidence;
      take(evaluator_.weigh(view(all_), {.tolerance = tau_, .corner = 1, .caps = all_caps_}, {&model, 1}, {}, evidence));
      if (evidence[0].count < task_.min_inliers) return std::nullopt;
      if (round == kRefinements) break;
      Matrix3 scatter;
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) scatter(a, b) = evidence[0].moments.scatter[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
      }
      const auto& mean = evidence[0].moments.mean;
      const auto better = flattest({mean[0], mean[1], mean[2]}, scatter);
      if (!better) return std::nullopt;
      plane = *better;
    }
    return plane;
  }

  void explain(const Plane& plane) {
    const auto lower = [&](std::span<const float> points, std::vector<float>& caps) {
      for (std::uint32_t i = 0; i < caps.size(); ++i) {
        const double d =
            std::abs(plane.normal[0] * static_cast<double>(points[3 * i]) + plane.normal[1] * static_cast<double>(points[3 * i + 1]) +
                     plane.normal[2] * static_cast<double>(points[3 * i + 2]) + plane.offset);
        if (d <= static_cast<double>(kDeadZone * tau_)) caps[i] = 0;
      }
    };
    lower(part_, caps_);
    lower(all_, all_caps_);
  }

  kernels::FitnessEvaluator& evaluator_;
  std::span<const float> all_;
  const Task& task_;
  float tau_;
  std::mt19937_64 random_;
  std::vector<float> part_, caps_, all_caps_;
  std::vector<Plane> planes_;
  std::size_t spent_ = 0;
};

class SamplingFit final : public Contender {
 public:
  SamplingFit(std::string name, std::string how, Search search)
      : name_(std::move(name)), how_(std::move(how)), search_(std::move(search)) {}

  std::string name() const override { return name_; }
  std::string how() const override { return how_ + "; Swarmfit's evaluator, and its count of evaluations shared out over its planes"; }

  void take(const Scene& scene, const Task& task) override {
    scene_ = &scene;
    task_ = task;
    kernels::EvaluatorOptions options;
    options.threads = task.threads;
    evaluator_ = peers::take(kernels::make_cpu_evaluator(options));
    // What the swarm spends here, the median of a few seeds.
    std::vector<std::size_t> shares;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      FitOptions fit;
      fit.threshold = task.threshold;
      fit.min_inliers = task.min_inliers;
      fit.threads = task.threads;
      fit.backend = "cpu";
      fit.seed = seed;
      const auto result = swarmfit::fit(PointsView(std::span<const float>(scene.points), 3), fit);
      if (!result) throw std::runtime_error(result.error().message);
      shares.push_back(result->evaluations / (result->models.size() + kPatience));
    }
    std::sort(shares.begin(), shares.end());
    budget_ = shares[shares.size() / 2];
  }

  Found run(std::uint64_t seed) override {
    Run run(*evaluator_, *scene_, task_, seed);
    for (int failures = 0; failures < kPatience && run.planes() < 1000;) {
      if (!run.next(search_, budget_)) ++failures;
    }
    return std::move(run).found();
  }

 private:
  std::string name_, how_;
  Search search_;
  const Scene* scene_ = nullptr;
  Task task_;
  std::unique_ptr<kernels::FitnessEvaluator> evaluator_;
  std::size_t budget_ = 0;
};

}  // namespace

Hypotheses::Hypotheses(kernels::FitnessEvaluator& evaluator, std::span<const float> points, std::span<const std::uint32_t> open,
                       std::span<const float> caps, float threshold, std::size_t budget, std::mt19937_64& random)
    : evaluator_(evaluator),
      points_(points),
      open_(open),
      caps_(caps),
      threshold_(threshold),
      budget_(budget),
      random_(random),
      best_cost_(std::numeric_limits<float>::infinity()) {}

std::optional<Plane> Hypotheses::minimal_sample() {
  if (open_.size() < 3) return std::nullopt;
  const auto any = [&] { return at(points_, open_[random_() % open_.size()]); };
  const Vector3 origin = any(), normal = (any() - origin).cross(any() - origin);
  const double length = normal.norm();
  if (!(length > 1e-12)) return std::nullopt;
  const Vector3 unit = normal / length;
  return Plane{{unit.x(), unit.y(), unit.z()}, -unit.dot(origin)};
}

std::optional<bool> Hypotheses::score_batch() {
  std::vector<Plane> batch;
  for (std::size_t tries = 0; tries < 10 * kBatch && batch.size() < kBatch; ++tries) {
    if (const auto plane = minimal_sample()) batch.push_back(*plane);
  }
  if (batch.empty()) return std::nullopt;
  return score(batch);
}

std::optional<Plane> Hypotheses::least_squares(std::span<const std::uint32_t> from, std::size_t count) {
  if (from.size() < 3 || count < 3) return std::nullopt;
  const bool all = count >= from.size();
  std::vector<Vector3> chosen;
  for (std::size_t k = 0; k < std::min(count, from.size()); ++k) chosen.push_back(at(points_, from[all ? k : random_() % from.size()]));
  Vector3 mean = Vector3::Zero();
  for (const Vector3& x : chosen) mean += x / static_cast<double>(chosen.size());
  Matrix3 scatter = Matrix3::Zero();
  for (const Vector3& x : chosen) scatter += (x - mean) * (x - mean).transpose();
  return flattest(mean, scatter);
}

std::vector<std::uint32_t> Hypotheses::near(const Plane& plane, float tolerance) const {
  const Vector3 normal(plane.normal.data());
  std::vector<std::uint32_t> found;
  for (const std::uint32_t i : open_) {
    if (std::abs(normal.dot(at(points_, i)) + plane.offset) <= static_cast<double>(tolerance)) found.push_back(i);
  }
  return found;
}

bool Hypotheses::score(std::span<const Plane> planes) {
  planes = planes.first(std::min(planes.size(), budget_ - std::min(budget_, spent_)));
  if (planes.empty()) return false;
  parameters_.clear();
  for (const Plane& plane : planes) {
    const auto row = parameters(plane);
    parameters_.insert(parameters_.end(), row.begin(), row.end());
  }
  cutoffs_.assign(planes.size(), best_cost_);
  costs_.resize(planes.size());
  take(evaluator_.evaluate({kernels::ModelKind::plane, planes.size(), parameters_}, kernels::Loss::truncated_l1, cutoffs_, costs_));
  spent_ += planes.size();
  const auto least = std::min_element(costs_.begin(), costs_.end());
  if (!(*least < best_cost_)) return false;
  best_cost_ = *least;
  best_ = planes[static_cast<std::size_t>(least - costs_.begin())];
  return true;
}

std::unique_ptr<Contender> make_sampling_fit(std::string name, std::string how, Search search) {
  return std::make_unique<SamplingFit>(std::move(name), std::move(how), std::move(search));
}

}  // namespace swarmfit::peers
