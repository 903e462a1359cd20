// The oracle of the colour cost: double precision, one pair after another.
#include <algorithm>
#include <numeric>
#include <vector>

#include "kernels/colour_costs.hpp"

namespace swarmfit::kernels {
namespace {

class ReferenceColourCosts final : public ColourCosts {
 public:
  const Identity& identity() const noexcept override { return identity_; }

  Result<> evaluate(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<float> costs) const override {
    if (auto ok = check_colours(sample, neighbours, colours, costs); !ok) return ok;
    const std::size_t nearest = std::min(sample.size(), static_cast<std::size_t>(neighbours));
    std::vector<double> distances(sample.size());
    for (std::size_t i = 0; i < colours.size(); ++i) {
      for (std::size_t j = 0; j < sample.size(); ++j)
        distances[j] = colour_distance<double>(colours.hue[i], colours.lightness[i], colours.saturation[i], sample.hue[j],
                                               sample.lightness[j], sample.saturation[j]);
      std::sort(distances.begin(), distances.end());
      const double sum = std::accumulate(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(nearest), 0.0);
      costs[i] = sample.size() == 0 ? 1 : static_cast<float>(sum / static_cast<double>(nearest));
    }
    return {};
  }

 private:
  Identity identity_{"reference", "reference"};
};

}  // namespace

std::unique_ptr<ColourCosts> make_reference_colour_costs() { return std::make_unique<ReferenceColourCosts>(); }

}  // namespace swarmfit::kernels
