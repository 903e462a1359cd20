#include "kernels/colour_costs.hpp"

#include <utility>

#include <fmt/format.h>

#include "kernels/checks.hpp"

namespace swarmfit::kernels {
namespace {

/// Pairs of colours from which on a GPU is asked: two cores go through so many in about the millisecond that a submission may take.
constexpr std::size_t kWorthAsking = std::size_t{1} << 22;

class ChosenBySize final : public ColourCosts {
 public:
  ChosenBySize(std::unique_ptr<ColourCosts> device, std::unique_ptr<ColourCosts> cores)
      : device_(std::move(device)), cores_(std::move(cores)) {}
  const Identity& identity() const noexcept override { return device_->identity(); }
  Result<> evaluate(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<float> costs) const override {
    const ColourCosts& by = sample.size() * colours.size() < kWorthAsking ? *cores_ : *device_;
    return by.evaluate(sample, neighbours, colours, costs);
  }

 private:
  std::unique_ptr<ColourCosts> device_, cores_;
};

}  // namespace

Result<> check_colours(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<const float> costs) {
  for (const auto& [name, view] : {std::pair{"sample", &sample}, std::pair{"colours", &colours}}) {
    if (view->lightness.size() != view->size() || view->saturation.size() != view->size())
      return fail(Failure::Kind::invalid, fmt::format("{} has {} hues, {} lightnesses and {} saturations, must be as many of each", name,
                                                      view->size(), view->lightness.size(), view->saturation.size()));
  }
  if (neighbours < 1 || neighbours > kMostNeighbours)
    return fail(Failure::Kind::invalid, fmt::format("neighbours is {}, must be in [1, {}]", neighbours, kMostNeighbours));
  return check_size("costs.size()", costs.size(), colours.size());
}

Result<std::unique_ptr<ColourCosts>> make_colour_costs(const Identity& where, bool choose, const EvaluatorOptions& options) {
  if (where.backend == "reference") return make_reference_colour_costs();
  if (where.backend == "cpu") return make_cpu_colour_costs(options.simd);
  auto device = make_vulkan_colour_costs(options, where.device);
  if (!device || !choose) return device;
  auto cores = make_cpu_colour_costs(options.simd);
  if (!cores) return cores;
  return std::make_unique<ChosenBySize>(std::move(*device), std::move(*cores));
}

#ifndef SWARMFIT_HAVE_VULKAN
Result<std::unique_ptr<ColourCosts>> make_vulkan_colour_costs(const EvaluatorOptions&, std::string_view) {
  return fail(Failure::Kind::unavailable, "backend is 'vulkan', but this build has no Vulkan (SWARMFIT_VULKAN=OFF)");
}
#endif

}  // namespace swarmfit::kernels
