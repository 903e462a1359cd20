// From a coloured depth frame to supporting planes, the things on them and their outlines.
#include <swarmfit/swarmfit.hpp>

#include <algorithm>
#include <cstdio>
#include <map>

namespace {

// How much of a true object the proto-object that covers it best shares with it, intersection over union.
double best_overlap(const swarmfit::Scene& scene, const swarmfit::PerceiveResult& result, std::size_t object) {
  std::size_t truth = 0;
  std::map<std::uint16_t, std::size_t> found, common;
  for (std::size_t i = 0; i < result.objects.size(); ++i) {
    const bool inside = scene.truth.object_labels[i] == object;
    truth += inside;
    ++found[result.objects[i]];
    if (inside) ++common[result.objects[i]];
  }
  double best = 0;
  for (const auto& [label, shared] : common) {
    if (label == 0 || label == swarmfit::kUncertain) continue;
    best = std::max(best, static_cast<double>(shared) / static_cast<double>(truth + found[label] - shared));
  }
  return best;
}

}  // namespace

int main() {
  const swarmfit::Scene scene = swarmfit::make_room_scene();  // or read_cloud, read_rgbd, read_stereo
  swarmfit::PerceiveOptions options;
  auto perceiver = swarmfit::Perceiver::create(options);
  if (!perceiver) {
    std::fprintf(stderr, "%s\n", perceiver.error().message.c_str());
    return 1;
  }
  const auto result = perceiver->perceive(scene.cloud);  // call it again for the next frame
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }

  std::size_t supporting = 0;
  for (const swarmfit::Model& plane : result->fit.models) supporting += plane.supporting;
  std::printf("vertical from %s; %zu supporting planes of %zu; %zu spaces of interest for %zu objects\n", result->vertical_source.c_str(),
              supporting, scene.truth.planes.size(), result->sois.size(), scene.truth.objects);

  std::size_t outlined = 0;
  for (std::size_t object = 1; object <= scene.truth.objects; ++object) {
    const double overlap = best_overlap(scene, *result, object);
    std::printf("object %zu: overlap %.2f\n", object, overlap);
    outlined += overlap > 0.6;
  }
  const bool most_planes = 2 * supporting > scene.truth.planes.size();
  const bool most_objects = 2 * outlined > scene.truth.objects;
  return most_planes && most_objects ? 0 : 1;
}
