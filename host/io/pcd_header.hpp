// The header of a PCD file, version 0.7 and those before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/io/columns.hpp"
#include "host/io/file.hpp"

namespace swarmfit::io {

struct PcdField {
  std::string name;
  Scalar type = Scalar::f32;
  std::uint64_t count = 1;   ///< values a point
  std::uint64_t offset = 0;  ///< bytes from the start of a point, uncompressed
  std::uint64_t bytes() const noexcept { return size_of(type) * count; }
};

struct PcdHeader {
  enum class Data { ascii, binary, binary_compressed };
  std::vector<PcdField> fields;
  std::uint64_t width = 0, height = 1, points = 0;
  std::uint64_t point_bytes = 0;  ///< of all fields together
  Data data = Data::ascii;
  std::size_t size = 0;  ///< bytes of the header
  std::size_t lines = 0;

  /// Nothing where there is no such field.
  const PcdField* find(std::string_view name) const noexcept;
};

/// Fails with bad_input; what it gives is consistent with itself, and `points` with the file's size where the data is not ascii.
Expected<PcdHeader> read_pcd_header(const std::filesystem::path& file, const FileBytes& bytes);

}  // namespace swarmfit::io
