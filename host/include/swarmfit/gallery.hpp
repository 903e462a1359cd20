// What a recogniser knows: a folder on disk with a folder of views a name, and an index of their features beside them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit {

/// A view that was added.
struct LearntView {
  std::filesystem::path file;  ///< the picture in the gallery, transparent where it is not the object
  std::size_t features = 0;    ///< SIFT features on the object
  std::size_t views = 0;       ///< of this name, this one included
  std::size_t names = 0;       ///< in the gallery
};

/// Adds an image as a view of `name`; where it has transparency, only what is opaque belongs to the object. The gallery's folder is made if
/// need be. Fails with invalid_option: a name that is no folder's name; bad_input: an image that cannot be read, or too few features to
/// be told by; cannot_write. Then the gallery is as it was.
SWARMFIT_API Expected<LearntView> learn_image(const std::filesystem::path& gallery, const std::string& name,
                                              const std::filesystem::path& image);

/// Adds a proto-object of a perceived frame: `object` is its number in result.objects, 0 the largest. Fails as learn_image does, with
/// invalid_option where there is no such object, and with bad_input for a frame without colour or image grid, or without any object.
SWARMFIT_API Expected<LearntView> learn_object(const std::filesystem::path& gallery, const std::string& name, const Cloud& frame,
                                               const PerceiveResult& result, std::size_t object = 0);

}  // namespace swarmfit
