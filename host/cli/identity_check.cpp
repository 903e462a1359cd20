#include "host/cli/identity_check.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace swarmfit::cli {
namespace {

using Labels = std::span<const std::uint16_t>;

/// For each true label the found one that overlaps it by more than `least` of their union; 0: none does.
std::vector<std::size_t> counterparts(Labels truth, std::size_t true_count, Labels found, std::size_t found_count, double least) {
  std::vector<std::size_t> common((true_count + 1) * (found_count + 1)), true_size(true_count + 1), found_size(found_count + 1);
  for (std::size_t i = 0; i < std::min(truth.size(), found.size()); ++i) {
    const std::size_t t = truth[i] <= true_count ? truth[i] : 0, f = found[i] <= found_count ? found[i] : 0;
    ++common[t * (found_count + 1) + f];
    ++true_size[t];
    ++found_size[f];
  }
  std::vector<std::size_t> best(true_count + 1);
  for (std::size_t t = 1; t <= true_count; ++t)
    for (std::size_t f = 1; f <= found_count; ++f) {
      const std::size_t both = common[t * (found_count + 1) + f];
      if (static_cast<double>(both) > least * static_cast<double>(true_size[t] + found_size[f] - both)) best[t] = f;
    }
  return best;
}

}  // namespace

void IdentityCheck::Things::see(std::size_t number, std::uint64_t id) {
  ++views;
  if (id == 0) return;
  ++found;
  ids.insert(id);
  const auto [at, first] = last.try_emplace(number, id);
  changes += !first && at->second != id;
  at->second = id;
}

std::string IdentityCheck::Things::tell(const char* what) const {
  return fmt::format("{} {} in {} views, {} of them found; {} ids, {} changes of id\n", last.size(), what, views, found, ids.size(),
                     changes);
}

void IdentityCheck::add(const SceneTruth& truth, const PerceiveResult& result) {
  const auto soi = counterparts(truth.object_labels, truth.objects, result.objects, result.sois.size(), 0.5);
  for (std::size_t k = 1; k <= truth.objects; ++k) objects_.see(truth.object_ids[k - 1], soi[k] == 0 ? 0 : result.sois[soi[k] - 1].id);
  const auto plane = counterparts(truth.plane_labels, truth.planes.size(), result.fit.labels, result.fit.models.size(), 0.5);
  for (std::size_t k = 1; k <= truth.planes.size(); ++k) surfaces_.see(k, plane[k] == 0 ? 0 : result.fit.models[plane[k] - 1].id);
}

std::string IdentityCheck::report() const { return objects_.tell("true objects") + surfaces_.tell("true surfaces"); }

}  // namespace swarmfit::cli
