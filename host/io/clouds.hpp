// One reader a file format. Every count is checked against the file's size before memory is taken for it.
#pragma once

#include <filesystem>

#include <swarmfit/cloud.hpp>

#include "host/io/file.hpp"

namespace swarmfit::io {

Expected<Cloud> read_pcd(const std::filesystem::path& file, const FileBytes& bytes);
Expected<Cloud> read_ply(const std::filesystem::path& file, const FileBytes& bytes);
Expected<Cloud> read_xyz(const std::filesystem::path& file, const FileBytes& bytes);
Expected<Cloud> read_csv(const std::filesystem::path& file, const FileBytes& bytes);

}  // namespace swarmfit::io
