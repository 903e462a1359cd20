// See what can evaluate here, take one by name, and be told when a name means nothing.
#include <swarmfit/swarmfit.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace {

std::vector<float> tilted_plane() {
  std::vector<float> xyz;
  for (int i = 0; i < 2500; ++i) {
    const float x = 0.02f * static_cast<float>(i % 50), y = 0.02f * static_cast<float>(i / 50);
    xyz.insert(xyz.end(), {x, y, 1 + 0.5f * x});
  }
  return xyz;
}

}  // namespace

int main() {
  for (const swarmfit::Device& device : swarmfit::devices()) {
    std::printf("%-10s %-40s %-15s %s\n", device.backend.c_str(), device.name.c_str(), device.kind.c_str(),
                device.usable ? "usable" : device.reason.c_str());
  }

  const std::vector<float> xyz = tilted_plane();
  swarmfit::FitOptions options;
  for (const std::string backend : {"auto", "cpu", "reference"}) {
    options.backend = backend;
    auto fitter = swarmfit::Fitter::create(options);
    if (!fitter) {
      std::fprintf(stderr, "%s\n", fitter.error().message.c_str());
      return 1;
    }
    const auto result = fitter->fit(swarmfit::PointsView(xyz, 3));
    if (!result || result->models.size() != 1) return 1;
    if (backend != "auto" && result->backend.name != backend) return 1;
    std::printf("%s: ran on %s, %s (%s)\n", backend.c_str(), result->backend.name.c_str(), result->backend.device.c_str(),
                result->backend.reason.c_str());
  }

  // A name that means nothing is an error, never a silent change.
  options.backend = "abacus";
  const auto unknown = swarmfit::Fitter::create(options);
  if (unknown) return 1;
  std::printf("abacus: %s\n", unknown.error().message.c_str());
  return unknown.error().kind == swarmfit::Error::Kind::backend_unavailable ? 0 : 1;
}
