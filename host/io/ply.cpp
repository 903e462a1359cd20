// PLY: ascii, binary little and big endian. The element `vertex` is taken: x, y, z and red, green, blue; lists are stepped over.
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "host/io/clouds.hpp"
#include "host/io/columns.hpp"
#include "host/io/ply_header.hpp"
#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

/// Which property of `vertex` holds what; -1 for none.
struct WantedProperties {
  std::array<int, 3> xyz{-1, -1, -1};
  std::array<int, 3> rgb{-1, -1, -1};
  bool coloured() const noexcept { return rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0; }
};

Expected<WantedProperties> wanted_properties(const std::filesystem::path& file, const PlyElement& vertex) {
  const auto index_of = [&](std::string_view name) {
    const PlyProperty* p = vertex.find(name);
    return p && !p->list_count ? static_cast<int>(p - vertex.properties.data()) : -1;
  };
  WantedProperties wanted{{index_of("x"), index_of("y"), index_of("z")}, {index_of("red"), index_of("green"), index_of("blue")}};
  for (std::size_t d = 0; d < 3; ++d) {
    if (wanted.xyz[d] < 0) return bad_input(file, "element 'vertex' has no property {}", "xyz"[d]);
  }
  return wanted;
}

std::optional<std::uint64_t> list_length(const char* at, Scalar type, bool swapped) {
  unsigned char raw[8] = {};
  const std::size_t n = size_of(type);
  for (std::size_t i = 0; i < n; ++i) raw[i] = static_cast<unsigned char>(at[swapped ? n - 1 - i : i]);
  std::uint64_t length = 0;
  std::memcpy(&length, raw, sizeof length);
  const bool is_signed = type == Scalar::i8 || type == Scalar::i16 || type == Scalar::i32;
  if (is_signed && (length >> (8 * n - 1)) != 0) return std::nullopt;
  return length;
}

/// Steps over one item of an element, noting where each property starts. Nothing where the data ends first or a length is negative.
const char* step_over(const PlyElement& element, const char* at, const char* end, bool swapped, std::vector<const char*>* starts) {
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    std::uint64_t bytes = size_of(property.type);
    if (starts) (*starts)[p] = at;
    if (property.list_count) {
      const std::size_t head = size_of(*property.list_count);
      if (static_cast<std::size_t>(end - at) < head) return nullptr;
      const auto length = list_length(at, *property.list_count, swapped);
      if (!length) return nullptr;
      at += head;
      bytes *= *length;  // below 2^32 times 8
    }
    if (static_cast<std::uint64_t>(end - at) < bytes) return nullptr;
    at += bytes;
  }
  return at;
}

const char* step_over_all(const PlyElement& element, const char* at, const char* end, bool swapped) {
  if (!element.has_lists()) {
    const std::uint64_t bytes = element.count * element.least_bytes();  // checked against the file with the header
    return static_cast<std::uint64_t>(end - at) < bytes ? nullptr : at + bytes;
  }
  for (std::uint64_t i = 0; i < element.count && at; ++i) at = step_over(element, at, end, swapped, nullptr);
  return at;
}

/// Vertices with lists have no fixed size: their wanted properties are copied out first.
Expected<> gather_with_lists(const std::filesystem::path& file, const PlyElement& vertex, const WantedProperties& wanted,
                             std::string_view payload, bool swapped, Cloud& cloud) {
  std::vector<const char*> starts(vertex.properties.size());
  const char* at = payload.data();
  const char* end = at + payload.size();
  constexpr std::size_t kSlot = 8;  // the widest scalar
  std::vector<char> table(vertex.count * 6 * kSlot);
  for (std::uint64_t i = 0; i < vertex.count; ++i) {
    at = step_over(vertex, at, end, swapped, &starts);
    if (!at) return bad_input(file, "element 'vertex' counts {}, but the data ends in item {}", vertex.count, i + 1);
    for (std::size_t k = 0; k < 6; ++k) {
      const int p = k < 3 ? wanted.xyz[k] : wanted.rgb[k - 3];
      if (p < 0) continue;
      const auto index = static_cast<std::size_t>(p);
      std::memcpy(&table[(i * 6 + k) * kSlot], starts[index], size_of(vertex.properties[index].type));
    }
  }
  const auto column = [&](std::size_t k, int p) {
    return Column{table.data() + k * kSlot, 6 * kSlot, vertex.properties[static_cast<std::size_t>(p)].type, swapped};
  };
  const std::array<Column, 3> xyz = {column(0, wanted.xyz[0]), column(1, wanted.xyz[1]), column(2, wanted.xyz[2])};
  std::optional<ColourColumns> colour;
  if (wanted.coloured()) colour = ColourColumns{{}, column(3, wanted.rgb[0]), column(4, wanted.rgb[1]), column(5, wanted.rgb[2])};
  gather(xyz, colour, vertex.count, cloud);
  return {};
}

void gather_fixed(const PlyElement& vertex, const WantedProperties& wanted, const char* data, bool swapped, Cloud& cloud) {
  const auto column = [&](int p) {
    std::size_t offset = 0;
    for (int i = 0; i < p; ++i) offset += size_of(vertex.properties[static_cast<std::size_t>(i)].type);
    return Column{data + offset, vertex.least_bytes(), vertex.properties[static_cast<std::size_t>(p)].type, swapped};
  };
  const std::array<Column, 3> xyz = {column(wanted.xyz[0]), column(wanted.xyz[1]), column(wanted.xyz[2])};
  std::optional<ColourColumns> colour;
  if (wanted.coloured()) colour = ColourColumns{{}, column(wanted.rgb[0]), column(wanted.rgb[1]), column(wanted.rgb[2])};
  gather(xyz, colour, vertex.count, cloud);
}

Expected<> read_binary(const std::filesystem::path& file, std::string_view payload, const PlyHeader& header, std::size_t vertex_index,
                       const WantedProperties& wanted, Cloud& cloud) {
  static_assert(std::endian::native == std::endian::little, "big endian machines would swap the other way round");
  const bool swapped = header.format == PlyHeader::Format::big_endian;
  const char* at = payload.data();
  const char* end = at + payload.size();
  for (std::size_t e = 0; e < header.elements.size(); ++e) {
    const PlyElement& element = header.elements[e];
    const char* next = step_over_all(element, at, end, swapped);
    if (!next)
      return bad_input(file, "element {} counts {} items, but the data ends before the last", excerpt(element.name), element.count);
    if (e == vertex_index) {
      if (element.has_lists()) {
        const std::string_view items(at, static_cast<std::size_t>(next - at));
        if (auto ok = gather_with_lists(file, element, wanted, items, swapped, cloud); !ok) return ok;
      } else {
        gather_fixed(element, wanted, at, swapped, cloud);
      }
    }
    at = next;
  }
  const std::string_view surplus(at, static_cast<std::size_t>(end - at));
  if (surplus.find_first_not_of(std::string_view("\0 \t\r\n", 5)) != std::string_view::npos) {
    return bad_input(file, "{} more bytes follow the last element; the header's counts do not match the data", surplus.size());
  }
  return {};
}

/// Reads the tokens of one vertex.
Expected<> read_ascii_vertex(const std::filesystem::path& file, TextCursor& cursor, const PlyElement& vertex, const std::vector<int>& slots,
                             std::size_t point, Cloud& cloud) {
  for (std::size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    std::string_view token = cursor.token();
    if (token.empty()) return bad_input(file, "line {}: no value for property {}", cursor.line_number(), excerpt(property.name));
    double value = 0;
    bool good = true;
    if (property.list_count) {
      std::uint64_t length = 0;
      good = parse_number(token, length);
      for (std::uint64_t i = 0; good && i < length; ++i) {
        if (cursor.token().empty())
          return bad_input(file, "line {}: list {} is shorter than its length {}", cursor.line_number(), excerpt(property.name), length);
      }
    } else if (slots[p] >= 0) {
      good = parse_number(token, value);
    }
    if (!good)
      return bad_input(file, "line {}, property {}: {} is not a number in range", cursor.line_number(), excerpt(property.name),
                       excerpt(token));
    const auto slot = static_cast<std::size_t>(slots[p]);
    if (slots[p] >= 3) {
      cloud.rgb[3 * point + slot - 3] = channel(value, property.type);
    } else if (slots[p] >= 0) {
      cloud.values64[3 * point + slot] = value;
    }
  }
  if (!cursor.token().empty())
    return bad_input(file, "line {}: more values than the {} properties of 'vertex'", cursor.line_number(), vertex.properties.size());
  return {};
}

Expected<> read_ascii(const std::filesystem::path& file, std::string_view payload, const PlyHeader& header, std::size_t vertex_index,
                      const WantedProperties& wanted, Cloud& cloud) {
  const PlyElement& vertex = header.elements[vertex_index];
  std::vector<int> slots(vertex.properties.size(), -1);
  for (std::size_t d = 0; d < 3; ++d) {
    slots[static_cast<std::size_t>(wanted.xyz[d])] = static_cast<int>(d);
    if (wanted.coloured()) slots[static_cast<std::size_t>(wanted.rgb[d])] = static_cast<int>(3 + d);
  }
  cloud.values64.resize(3 * vertex.count);
  if (wanted.coloured()) cloud.rgb.resize(3 * vertex.count);

  TextCursor cursor(payload, header.lines);
  for (std::size_t e = 0; e < header.elements.size(); ++e) {
    const PlyElement& element = header.elements[e];
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!cursor.next_line())
        return bad_input(file, "element {} counts {} items, but the data ends after {}", excerpt(element.name), element.count, i);
      if (e != vertex_index) continue;
      if (auto ok = read_ascii_vertex(file, cursor, vertex, slots, i, cloud); !ok) return ok;
    }
  }
  if (cursor.next_line())
    return bad_input(file, "line {} follows the last element; the header's counts do not match the data", cursor.line_number());
  return {};
}

}  // namespace

Expected<Cloud> read_ply(const std::filesystem::path& file, const FileBytes& bytes) {
  const auto header = read_ply_header(file, bytes);
  if (!header) return tl::unexpected(header.error());
  std::size_t vertex_index = 0;
  while (vertex_index < header->elements.size() && header->elements[vertex_index].name != "vertex") ++vertex_index;
  if (vertex_index == header->elements.size()) return bad_input(file, "header has no element 'vertex'");
  const PlyElement& vertex = header->elements[vertex_index];
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  if (vertex.count < 1 || vertex.count > kMost) return bad_input(file, "element 'vertex' counts {}, must be in 1..{}", vertex.count, kMost);
  const auto wanted = wanted_properties(file, vertex);
  if (!wanted) return tl::unexpected(wanted.error());

  Cloud cloud;
  cloud.width = static_cast<int>(vertex.count);
  cloud.height = 1;
  const std::string_view payload = bytes.text().substr(header->size);
  const auto done = header->format == PlyHeader::Format::ascii ? read_ascii(file, payload, *header, vertex_index, *wanted, cloud)
                                                               : read_binary(file, payload, *header, vertex_index, *wanted, cloud);
  if (!done) return tl::unexpected(done.error());
  return cloud;
}

}  // namespace swarmfit::io
