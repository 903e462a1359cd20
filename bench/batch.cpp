// Small problems a second: three lines of 60 points each, with noise, and 120 points anywhere in the unit square.
//   steps  one swarm's costs of each problem, a call a problem and all in one call, on every back end;
//   fits   one after another, and as a batch: on the processor with one thread, two, and so on up to all there are, on Vulkan in step.
// Prints a table; ends with 1 where a batch's answer is not that of each by itself.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <Eigen/Geometry>
#include <swarmfit/batch.hpp>

#include "host/models/working_points.hpp"
#include "kernels/batch_evaluator.hpp"

namespace {

using namespace swarmfit;

constexpr int kLines = 3, kOnLine = 60, kPoints = 300, kRuns = 5;
constexpr std::size_t kInStep = 128;  // problems of a batch, as many as fit_batch has under way
constexpr std::size_t kAlone = 100;   // fits one after another on a device
constexpr double kNoise = 0.005;

Eigen::Matrix2Xf problem(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(0, 1);
  std::normal_distribution<float> noise(0, static_cast<float>(kNoise));
  Eigen::Matrix2Xf points(2, kPoints);
  Eigen::Vector2f a = Eigen::Vector2f::Zero(), b = Eigen::Vector2f::Zero();
  for (int i = 0; i < kPoints; ++i) {
    if (i < kLines * kOnLine && i % kOnLine == 0) {
      do {
        a << anywhere(random), anywhere(random);
        b << anywhere(random), anywhere(random);
      } while ((b - a).norm() < 0.5F);
    }
    points.col(i) << anywhere(random), anywhere(random);
    if (i < kLines * kOnLine) points.col(i) = a + anywhere(random) * (b - a) + (b - a).unitOrthogonal() * noise(random);
  }
  return points;
}

template <class Work>
double median_seconds(Work&& work) {
  std::vector<double> seconds;
  for (int run = 0; run < kRuns; ++run) {
    const auto start = std::chrono::steady_clock::now();
    work();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + kRuns / 2, seconds.end());
  return seconds[kRuns / 2];
}

/// Swarms of lines anywhere, the same for every problem.
std::vector<double> swarm_of(std::size_t particles) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(0, 3.14159265358979), anywhere(0, 1);
  std::vector<double> rows;
  for (std::size_t j = 0; j < particles; ++j) {
    const double a = angle(random), x = anywhere(random), y = anywhere(random);
    for (const double value : {std::cos(a), std::sin(a), -(std::cos(a) * x + std::sin(a) * y)}) rows.push_back(value);
  }
  return rows;
}

/// Problems' steps a second on one back end; false where a batch's costs are not those of each problem by itself.
bool bench_steps(const std::string& backend, const std::vector<PointsView>& views, std::size_t particles) {
  const std::size_t count = std::min(views.size(), kInStep);
  auto batch = kernels::make_batch_evaluator(backend, {}, count);
  auto alone = kernels::make_evaluator(backend, {});
  if (!batch || !alone) {
    std::printf("%-7s steps: left out, %s\n", backend.c_str(), (batch ? alone.error() : batch.error()).message.c_str());
    return true;
  }
  const std::vector<double> swarm = swarm_of(particles);
  const kernels::SwarmView view{kernels::ModelKind::line2d, particles, swarm};
  std::vector<std::vector<float>> costs(count, std::vector<float>(particles));
  const std::vector<float> caps(kPoints, static_cast<float>(2.5 * kNoise));
  std::vector<kernels::BatchItem> items;
  for (std::size_t k = 0; k < count; ++k) {
    if (!(*batch)->set_points(k, models::to_kernel(views[k])) || !(*batch)->set_caps(k, caps)) return false;
    items.push_back({k, view, kernels::Loss::truncated_l1, {}, costs[k]});
  }
  if (!(*batch)->evaluate(items)) return false;
  // A problem by itself keeps its points, too: the time is that of its evaluation alone.
  constexpr std::size_t kChecked = 16;
  double single = 0;
  std::vector<float> one(particles);
  for (std::size_t k = 0; k < std::min(count, kChecked); ++k) {
    if (!alone->evaluator->set_points(models::to_kernel(views[k])) || !alone->evaluator->set_caps(caps)) return false;
    const auto ask = [&] { return static_cast<bool>(alone->evaluator->evaluate(view, kernels::Loss::truncated_l1, {}, one)); };
    if (!ask() || one != costs[k]) return false;
    single += median_seconds(ask);
  }
  single /= static_cast<double>(std::min(count, kChecked));
  const double together = median_seconds([&] { (void)(*batch)->evaluate(items); }) / static_cast<double>(count);
  std::printf("%-7s %4d points x %4zu particles x %4zu problems: a call each %9.0f steps/s, in one call %9.0f steps/s\n", backend.c_str(),
              kPoints, particles, count, 1 / single, 1 / together);
  return true;
}

/// Fits a second of a batch; false where an answer is not that of its problem by itself.
bool bench_fits(const std::vector<PointsView>& views, const FitOptions& options, const std::vector<FitResult>& alone,
                const std::string& title) {
  std::vector<Expected<FitResult>> together;
  const auto first = fit_batch(views, options);
  if (!first) {
    std::printf("batch, %-14s left out, %s\n", title.c_str(), first.error().message.c_str());
    return true;
  }
  const double seconds = median_seconds([&] { together = *fit_batch(views, options); });
  std::printf("batch, %-14s %8.0f problems/s\n", title.c_str(), static_cast<double>(views.size()) / seconds);
  for (std::size_t k = 0; k < alone.size(); ++k) {
    if (!together[k] || together[k]->labels != alone[k].labels) return false;
  }
  return true;
}

/// One after another, into `results`; seconds.
double fit_each(const std::vector<PointsView>& views, const FitOptions& options, std::vector<FitResult>& results) {
  auto fitter = Fitter::create(options);
  if (!fitter) return 0;
  return median_seconds([&] {
    for (std::size_t k = 0; k < results.size(); ++k) results[k] = *fitter->fit(views[k]);
  });
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 2000;
  if (count < 1 || argc > 2) {
    std::fprintf(stderr, "usage: swarmfit_batch [problems, >= 1; 2000]\n");
    return 2;
  }
  std::vector<Eigen::Matrix2Xf> clouds;
  for (int k = 0; k < count; ++k) clouds.push_back(problem(static_cast<unsigned>(k) + 1));
  std::vector<PointsView> views;
  for (const auto& cloud : clouds) views.emplace_back(cloud);
  bool same = true;
  for (const std::size_t particles : {16, 100}) {
    for (const char* backend : {"cpu", "vulkan"}) same = bench_steps(backend, views, particles) && same;
  }

  FitOptions options;
  options.model = ModelType::line2d;
  options.threshold = 2.5 * kNoise;
  options.backend = "cpu";
  options.threads = 1;
  std::vector<FitResult> alone(views.size());
  const double serial = fit_each(views, options, alone);
  if (serial <= 0) return 1;
  std::size_t right = 0;
  for (const auto& result : alone) right += result.models.size() == kLines ? 1 : 0;
  std::printf("%d problems of %d points, three lines: %.1f %% with three models\n", count, kPoints,
              100.0 * static_cast<double>(right) / count);
  std::printf("cpu, one after another %7.0f problems/s\n", count / serial);
  const int most = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (int threads = 1; threads <= most; threads = threads < most ? std::min(2 * threads, most) : most + 1) {
    options.threads = threads;
    same = bench_fits(views, options, alone, "cpu, " + std::to_string(threads) + (threads == 1 ? " thread" : " threads")) && same;
  }
  options.backend = "vulkan";
  options.threads = 0;
  std::vector<FitResult> some(std::min(views.size(), kAlone));
  if (const double seconds = fit_each(views, options, some); seconds > 0) {
    std::printf("vulkan, one after another %4.0f problems/s\n", static_cast<double>(some.size()) / seconds);
  }
  same = bench_fits(views, options, some, "vulkan") && same;
  if (!same) std::fprintf(stderr, "a batch's answer is not that of each problem by itself\n");
  return same ? 0 : 1;
}
