// Small fits a second: three lines of 60 points each, with noise, and 120 points anywhere in the unit square; one after another, and as a
// batch on one thread, two, and so on up to all there are. Prints a table; ends with 1 where a batch's answer is not that of each by itself.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>
#include <vector>

#include <Eigen/Geometry>
#include <swarmfit/batch.hpp>

namespace {

constexpr int kLines = 3, kOnLine = 60, kPoints = 300, kRuns = 5;
constexpr double kNoise = 0.005;

Eigen::Matrix2Xf problem(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(0, 1);
  std::normal_distribution<float> noise(0, static_cast<float>(kNoise));
  Eigen::Matrix2Xf points(2, kPoints);
  Eigen::Vector2f a, b;
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

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 2000;
  if (count < 1 || argc > 2) {
    std::fprintf(stderr, "usage: swarmfit_batch [problems, >= 1; 2000]\n");
    return 2;
  }
  std::vector<Eigen::Matrix2Xf> clouds;
  for (int k = 0; k < count; ++k) clouds.push_back(problem(static_cast<unsigned>(k) + 1));
  std::vector<swarmfit::PointsView> views;
  for (const auto& cloud : clouds) views.emplace_back(cloud);
  swarmfit::FitOptions options;
  options.model = swarmfit::ModelType::line2d;
  options.threshold = 2.5 * kNoise;
  options.backend = "cpu";
  options.threads = 1;

  std::vector<swarmfit::FitResult> alone(views.size());
  auto fitter = swarmfit::Fitter::create(options);
  if (!fitter) return 1;
  const double serial = median_seconds([&] {
    for (std::size_t k = 0; k < views.size(); ++k) alone[k] = *fitter->fit(views[k]);
  });
  std::size_t right = 0;
  for (const auto& result : alone) right += result.models.size() == kLines ? 1 : 0;
  std::printf("%d problems of %d points, three lines: %.1f %% with three models\n", count, kPoints,
              100.0 * static_cast<double>(right) / count);
  std::printf("one after another      %8.0f problems/s\n", count / serial);
  const int most = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  bool same = true;
  for (int threads = 1; threads <= most; threads = threads < most ? std::min(2 * threads, most) : most + 1) {
    options.threads = threads;
    std::vector<swarmfit::Expected<swarmfit::FitResult>> together;
    const double seconds = median_seconds([&] { together = *swarmfit::fit_batch(views, options); });
    for (std::size_t k = 0; k < views.size(); ++k) same = same && together[k] && together[k]->labels == alone[k].labels;
    std::printf("batch, %2d thread%s      %8.0f problems/s\n", threads, threads == 1 ? " " : "s", count / seconds);
  }
  if (!same) std::fprintf(stderr, "a batch's answer is not that of each problem by itself\n");
  return same ? 0 : 1;
}
