#include "host/cli/identity_check.hpp"

#include <fmt/format.h>

#include "host/cli/overlap.hpp"

namespace swarmfit::cli {
namespace {

constexpr double kLeast = 0.5;  // of their union that a true thing and a found one must share to be one

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
  const auto soi = match_labels(truth.object_labels, truth.objects, result.objects, result.sois.size());
  for (std::size_t k = 1; k <= truth.objects; ++k)
    objects_.see(truth.object_ids[k - 1], soi[k].iou > kLeast ? result.sois[soi[k].label - 1].id : 0);
  const auto plane = match_labels(truth.plane_labels, truth.planes.size(), result.fit.labels, result.fit.models.size());
  for (std::size_t k = 1; k <= truth.planes.size(); ++k)
    surfaces_.see(k, plane[k].iou > kLeast ? result.fit.models[plane[k].label - 1].id : 0);
}

std::string IdentityCheck::report() const { return objects_.tell("true objects") + surfaces_.tell("true surfaces"); }

}  // namespace swarmfit::cli
