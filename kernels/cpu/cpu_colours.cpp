#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "kernels/colour_costs.hpp"
#include "kernels/cpu/colour_kernels.hpp"

namespace swarmfit::kernels {
namespace {

/// On the caller's thread: a frame's spaces of interest are many, and its threads share them.
class CpuColourCosts final : public ColourCosts {
 public:
  explicit CpuColourCosts(const cpu::ColourKernels& kernels) : kernels_(kernels), identity_{"cpu", kernels.name} {}
  const Identity& identity() const noexcept override { return identity_; }

  Result<> evaluate(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<float> costs) const override {
    if (auto ok = check_colours(sample, neighbours, colours, costs); !ok) return ok;
    if (sample.size() == 0)
      std::fill(costs.begin(), costs.end(), 1.0f);
    else
      kernels_.costs(sample, std::min(sample.size(), static_cast<std::size_t>(neighbours)), colours, costs.data());
    return {};
  }

 private:
  const cpu::ColourKernels& kernels_;
  Identity identity_;
};

}  // namespace

std::vector<std::string> colour_cost_targets() {
  std::vector<std::string> names;
  for (const cpu::ColourKernels* kernels : cpu::available_colour_kernels()) names.emplace_back(kernels->name);
  return names;
}

Result<std::unique_ptr<ColourCosts>> make_cpu_colour_costs(std::string_view simd) {
  for (const cpu::ColourKernels* kernels : cpu::available_colour_kernels()) {
    if (simd.empty() || simd == kernels->name) return std::make_unique<CpuColourCosts>(*kernels);
  }
  return fail(Failure::Kind::unavailable, fmt::format("simd is '{}', must be one of: {}", simd, fmt::join(colour_cost_targets(), ", ")));
}

}  // namespace swarmfit::kernels
