// Features of a gallery's pictures, kept on disk so that they are found once.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include <swarmfit/error.hpp>

#include "host/perception/recognition_match.hpp"

namespace swarmfit::perception {

/// The features of a picture by its bytes: a picture that was changed is another one.
class GalleryIndex {
 public:
  static constexpr const char* kFileName = "features.index";

  /// An index that is missing, damaged or of another version is an empty one: it only saves time.
  static GalleryIndex read(const std::filesystem::path& folder);
  /// Whole or not at all; what was not asked for or put since it was read is left out. Fails with cannot_write.
  Expected<> write(const std::filesystem::path& folder) const;

  /// Nothing where the picture is not known.
  const Features* find(std::string_view picture);
  const Features& put(std::string_view picture, Features features);

 private:
  struct Entry {
    Features features;
    bool used = false;
  };
  std::map<std::pair<std::uint64_t, std::uint64_t>, Entry> entries_;  // by size and hash
};

}  // namespace swarmfit::perception
