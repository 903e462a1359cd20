// The door to the readers: by extension.
#include <algorithm>
#include <string>

#include <swarmfit/cloud.hpp>

#include "host/io/clouds.hpp"
#include "host/io/file.hpp"

namespace swarmfit {

Expected<Cloud> read_cloud(const std::filesystem::path& file) {
  return io::guarded(file, Error::Kind::bad_input, [&]() -> Expected<Cloud> {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
    using Reader = Expected<Cloud> (*)(const std::filesystem::path&, const io::FileBytes&);
    Reader reader = nullptr;
    if (extension == ".pcd") reader = io::read_pcd;
    if (extension == ".ply") reader = io::read_ply;
    if (extension == ".xyz") reader = io::read_xyz;
    if (extension == ".csv") reader = io::read_csv;

    auto bytes = io::read_file(file);
    if (!bytes) return tl::unexpected(std::move(bytes.error()));
    if (!reader) return io::bad_input(file, "extension {} is not known, must be .pcd, .ply, .xyz or .csv", io::excerpt(extension));
    return reader(file, *bytes);
  });
}

}  // namespace swarmfit
