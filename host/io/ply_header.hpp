// The header of a PLY file: elements and their properties.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/io/columns.hpp"
#include "host/io/file.hpp"

namespace swarmfit::io {

struct PlyProperty {
  std::string name;
  Scalar type = Scalar::f32;
  std::optional<Scalar> list_count;  ///< a list: the type of its length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Bytes an item takes at the least: lists may be empty.
  std::uint64_t least_bytes() const noexcept;
  bool has_lists() const noexcept;
  const PlyProperty* find(std::string_view property) const noexcept;
};

struct PlyHeader {
  enum class Format { ascii, little_endian, big_endian };
  Format format = Format::ascii;
  std::vector<PlyElement> elements;
  std::size_t size = 0;  ///< bytes of the header
  std::size_t lines = 0;
};

/// Fails with bad_input; no element counts more items than the file's size could hold.
Expected<PlyHeader> read_ply_header(const std::filesystem::path& file, const FileBytes& bytes);

}  // namespace swarmfit::io
