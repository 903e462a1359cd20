#include "host/cli/overlap.hpp"

#include <algorithm>

namespace swarmfit::cli {

std::vector<Match> match_labels(std::span<const std::uint16_t> truth, std::size_t true_count, std::span<const std::uint16_t> found,
                                std::size_t found_count, const std::vector<bool>& counts) {
  const std::size_t width = found_count + 1;
  std::vector<std::size_t> common((true_count + 1) * width), true_size(true_count + 1), found_size(width);
  for (std::size_t i = 0; i < std::min(truth.size(), found.size()); ++i) {
    if (!counts.empty() && !counts[i]) continue;
    const std::size_t t = truth[i] <= true_count ? truth[i] : 0, f = found[i] <= found_count ? found[i] : 0;
    ++common[t * width + f];
    ++true_size[t];
    ++found_size[f];
  }
  std::vector<Match> best(true_count + 1);
  for (std::size_t t = 1; t <= true_count; ++t)
    for (std::size_t f = 1; f <= found_count; ++f) {
      const std::size_t both = common[t * width + f], either = true_size[t] + found_size[f] - both;
      const double iou = static_cast<double>(both) / static_cast<double>(std::max<std::size_t>(1, either));
      if (iou > best[t].iou) best[t] = {f, iou};
    }
  return best;
}

}  // namespace swarmfit::cli
