#include "host/common/parallel.hpp"

#include <algorithm>
#include <atomic>

#include <opencv2/core/utility.hpp>

namespace swarmfit::common {

void in_parallel(int count, int grain, int threads, const std::function<void(int, int)>& body) {
  if (count <= 0) return;
  const int ranges = (count + grain - 1) / grain;
  const int workers = std::min(ranges, threads > 0 ? threads : std::max(1, cv::getNumThreads()));
  std::atomic<int> next = 0;
  const auto work = [&](const cv::Range&) {
    for (int k = next++; k < ranges; k = next++) body(k * grain, std::min(count, (k + 1) * grain));
  };
  if (workers == 1)
    work({});
  else
    cv::parallel_for_(cv::Range(0, workers), work, workers);
}

}  // namespace swarmfit::common
