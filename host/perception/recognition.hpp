// Names by SIFT, looked for only inside proto-objects.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include <swarmfit/perception.hpp>

namespace swarmfit::perception {

/// Descriptors of every named object, read once.
class Gallery {
 public:
  /// `folder` holds one image, or a folder of images, a name. Fails with bad_input: no folder, no image, an image that cannot be read.
  static Expected<Gallery> load(const std::filesystem::path& folder);
  ~Gallery();
  Gallery(Gallery&&) noexcept;
  Gallery& operator=(Gallery&&) noexcept;

  /// For each SOI, the names whose matches inside the SOI's proto-object survive the ratio test and agree geometrically, best first.
  /// Uncertain pixels count as background.
  std::vector<std::vector<Recognition>> recognise(const Cloud& frame, std::span<const std::uint16_t> objects, std::size_t soi_count) const;

 private:
  struct State;
  explicit Gallery(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace swarmfit::perception
