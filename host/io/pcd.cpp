// PCD: ascii, binary, binary_compressed. Fields in any order; x, y, z and a colour are taken, the rest is stepped over.
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include <lzf.h>

#include "host/io/clouds.hpp"
#include "host/io/columns.hpp"
#include "host/io/pcd_header.hpp"
#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

static_assert(std::endian::native == std::endian::little, "PCD's binary data is little endian");

/// The fields that make a cloud.
struct WantedFields {
  std::array<const PcdField*, 3> xyz{};
  const PcdField* packed = nullptr;           ///< rgb or rgba
  std::array<const PcdField*, 3> channels{};  ///< r, g, b; all or none
  bool coloured() const noexcept { return packed || channels[0]; }
};

Expected<WantedFields> wanted_fields(const std::filesystem::path& file, const PcdHeader& header) {
  WantedFields wanted;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::string_view name = std::array<std::string_view, 3>{"x", "y", "z"}[d];
    wanted.xyz[d] = header.find(name);
    if (!wanted.xyz[d]) return bad_input(file, "FIELDS has no {}", name);
    if (wanted.xyz[d]->count != 1) return bad_input(file, "field '{}': COUNT {}, must be 1", name, wanted.xyz[d]->count);
  }
  for (const char* name : {"rgb", "rgba"}) {
    const PcdField* field = header.find(name);
    if (!field) continue;
    if (size_of(field->type) != 4 || field->count != 1) return bad_input(file, "field '{}': must be one value of SIZE 4", name);
    wanted.packed = field;
  }
  if (!wanted.packed && header.find("r") && header.find("g") && header.find("b")) {
    wanted.channels = {header.find("r"), header.find("g"), header.find("b")};
    for (const PcdField* field : wanted.channels) {
      if (field->count != 1) return bad_input(file, "field '{}': COUNT {}, must be 1", field->name, field->count);
    }
  }
  return wanted;
}

/// Padding after the data is fine; anything else means that the header's count is wrong.
Expected<> check_surplus(const std::filesystem::path& file, std::string_view surplus, std::uint64_t points) {
  const bool padding = surplus.find_first_not_of(std::string_view("\0 \t\r\n", 5)) == std::string_view::npos;
  if (!padding) return bad_input(file, "POINTS {}, but {} more bytes of data follow the last point", points, surplus.size());
  return {};
}

/// Where a field's values lie: within each point, or (compressed) one field after another.
Column column_of(const PcdField& field, const PcdHeader& header, const char* data, bool field_by_field) {
  Column column;
  column.type = field.type;
  column.first = data + (field_by_field ? field.offset * header.points : field.offset);
  column.stride = field_by_field ? field.bytes() : header.point_bytes;
  return column;
}

void gather_fields(const PcdHeader& header, const WantedFields& wanted, const char* data, bool field_by_field, Cloud& cloud) {
  const auto column = [&](const PcdField* field) { return column_of(*field, header, data, field_by_field); };
  const std::array<Column, 3> xyz = {column(wanted.xyz[0]), column(wanted.xyz[1]), column(wanted.xyz[2])};
  std::optional<ColourColumns> colour;
  if (wanted.packed) colour = ColourColumns{column(wanted.packed), {}, {}, {}};
  if (wanted.channels[0]) colour = ColourColumns{{}, column(wanted.channels[0]), column(wanted.channels[1]), column(wanted.channels[2])};
  gather(xyz, colour, header.points, cloud);
}

Expected<> read_binary(const std::filesystem::path& file, std::string_view payload, const PcdHeader& header, const WantedFields& wanted,
                       Cloud& cloud) {
  if (auto ok = check_surplus(file, payload.substr(header.points * header.point_bytes), header.points); !ok) return ok;
  gather_fields(header, wanted, payload.data(), false, cloud);
  return {};
}

Expected<> read_compressed(const std::filesystem::path& file, std::string_view payload, const PcdHeader& header, const WantedFields& wanted,
                           Cloud& cloud) {
  std::array<std::uint32_t, 2> sizes{};  // compressed, uncompressed
  if (payload.size() < sizeof sizes) return bad_input(file, "ends before the sizes of the compressed data");
  std::memcpy(sizes.data(), payload.data(), sizeof sizes);
  payload.remove_prefix(sizeof sizes);
  const std::uint64_t need = header.points * header.point_bytes;
  if (sizes[1] != need) {
    return bad_input(file, "compressed data says it holds {} bytes, must be POINTS x {} = {}", sizes[1], header.point_bytes, need);
  }
  if (sizes[0] > payload.size())
    return bad_input(file, "compressed data says it takes {} bytes, but only {} follow", sizes[0], payload.size());
  if (auto ok = check_surplus(file, payload.substr(sizes[0]), header.points); !ok) return ok;

  const auto data = std::make_unique_for_overwrite<char[]>(need);
  const auto got = lzf_decompress(payload.data(), sizes[0], data.get(), sizes[1]);
  if (got != sizes[1]) return bad_input(file, "compressed data is damaged: it does not unpack to {} bytes", sizes[1]);
  gather_fields(header, wanted, data.get(), true, cloud);
  return {};
}

/// What becomes of a token of an ascii row.
struct Role {
  enum class Kind { skip, coordinate, packed_float, packed_integer, channel } kind = Kind::skip;
  std::size_t index = 0;
  Scalar type = Scalar::f32;
  const PcdField* field = nullptr;
};

std::vector<Role> roles(const PcdHeader& header, const WantedFields& wanted) {
  std::vector<Role> out;
  for (const PcdField& field : header.fields) {
    Role role{Role::Kind::skip, 0, field.type, &field};
    for (std::size_t d = 0; d < 3; ++d) {
      if (wanted.xyz[d] == &field) role = {Role::Kind::coordinate, d, field.type, &field};
      if (wanted.channels[d] == &field) role = {Role::Kind::channel, d, field.type, &field};
    }
    if (wanted.packed == &field) role.kind = field.type == Scalar::f32 ? Role::Kind::packed_float : Role::Kind::packed_integer;
    out.insert(out.end(), field.count, role);
  }
  return out;
}

bool take(const Role& role, std::string_view token, std::size_t point, Cloud& cloud) {
  double value = 0;
  switch (role.kind) {
    case Role::Kind::skip: return true;
    case Role::Kind::coordinate: return parse_number(token, cloud.values64[3 * point + role.index]);
    case Role::Kind::packed_float: {
      float bits = 0;
      if (!parse_number(token, bits)) return false;
      unpack_rgb(std::bit_cast<std::uint32_t>(bits), &cloud.rgb[3 * point]);
      return true;
    }
    case Role::Kind::packed_integer: {
      std::int64_t bits = 0;
      if (!parse_number(token, bits)) return false;
      unpack_rgb(static_cast<std::uint32_t>(bits), &cloud.rgb[3 * point]);
      return true;
    }
    case Role::Kind::channel:
      if (!parse_number(token, value)) return false;
      cloud.rgb[3 * point + role.index] = channel(value, role.type);
      return true;
  }
  return false;
}

Expected<> read_ascii(const std::filesystem::path& file, std::string_view payload, const PcdHeader& header, const WantedFields& wanted,
                      Cloud& cloud) {
  std::uint64_t tokens = 0;
  for (const auto& field : header.fields) tokens += field.count;
  // A value and what parts it from the next take two bytes at the least.
  if (tokens > payload.size() || header.points > (payload.size() + 1) / (2 * tokens)) {
    return bad_input(file, "POINTS {} of {} values each, but only {} bytes of data follow the header", header.points, tokens,
                     payload.size());
  }
  const std::vector<Role> row = roles(header, wanted);
  cloud.values64.resize(3 * header.points);
  if (wanted.coloured()) cloud.rgb.resize(3 * header.points);
  TextCursor cursor(payload, header.lines);
  for (std::size_t point = 0; point < header.points; ++point) {
    if (!cursor.next_line()) return bad_input(file, "POINTS {}, but the data ends after {} points", header.points, point);
    for (const Role& role : row) {
      const std::string_view token = cursor.token();
      if (token.empty()) return bad_input(file, "line {}: fewer than {} values", cursor.line_number(), tokens);
      if (!take(role, token, point, cloud)) {
        return bad_input(file, "line {}, field '{}': {} is not a number in range", cursor.line_number(), role.field->name, excerpt(token));
      }
    }
    if (!cursor.token().empty()) return bad_input(file, "line {}: more than {} values", cursor.line_number(), tokens);
  }
  if (cursor.next_line()) return bad_input(file, "POINTS {}, but line {} holds another", header.points, cursor.line_number());
  return {};
}

}  // namespace

Expected<Cloud> read_pcd(const std::filesystem::path& file, const FileBytes& bytes) {
  const auto header = read_pcd_header(file, bytes);
  if (!header) return tl::unexpected(header.error());
  const auto wanted = wanted_fields(file, *header);
  if (!wanted) return tl::unexpected(wanted.error());

  Cloud cloud;
  cloud.width = static_cast<int>(header->width);
  cloud.height = static_cast<int>(header->height);
  const std::string_view payload = bytes.text().substr(header->size);
  Expected<> done;
  switch (header->data) {
    case PcdHeader::Data::ascii: done = read_ascii(file, payload, *header, *wanted, cloud); break;
    case PcdHeader::Data::binary: done = read_binary(file, payload, *header, *wanted, cloud); break;
    case PcdHeader::Data::binary_compressed: done = read_compressed(file, payload, *header, *wanted, cloud); break;
  }
  if (!done) return tl::unexpected(done.error());
  return cloud;
}

}  // namespace swarmfit::io
