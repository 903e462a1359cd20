#include "host/io/ply_header.hpp"

#include <array>
#include <utility>

#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

std::optional<Scalar> scalar_type(std::string_view name) {
  constexpr std::pair<std::string_view, Scalar> kNames[] = {
      {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
      {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
      {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
      {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64},
  };
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

std::vector<std::string_view> words(TextCursor& cursor) {
  std::vector<std::string_view> out;
  for (auto token = cursor.token(); !token.empty(); token = cursor.token()) out.push_back(token);
  return out;
}

Expected<PlyHeader::Format> format_of(const std::filesystem::path& file, std::string_view name) {
  if (name == "ascii") return PlyHeader::Format::ascii;
  if (name == "binary_little_endian") return PlyHeader::Format::little_endian;
  if (name == "binary_big_endian") return PlyHeader::Format::big_endian;
  return bad_input(file, "format {}, must be ascii, binary_little_endian or binary_big_endian", excerpt(name));
}

Expected<PlyProperty> property_of(const std::filesystem::path& file, std::size_t line, const std::vector<std::string_view>& w) {
  const bool list = w.size() == 5 && w[1] == "list";
  if (!list && w.size() != 3) return bad_input(file, "line {}: a property is 'property TYPE NAME' or 'property list TYPE TYPE NAME'", line);
  PlyProperty property;
  property.name = w.back();
  for (std::size_t i = list ? 2 : 1; i + 1 < w.size(); ++i) {
    const auto type = scalar_type(w[i]);
    if (!type) return bad_input(file, "line {}: property {} has type {}, which PLY does not know", line, excerpt(w.back()), excerpt(w[i]));
    if (list && i == 2) {
      if (*type == Scalar::f32 || *type == Scalar::f64) return bad_input(file, "line {}: a list's length must be a whole number", line);
      property.list_count = *type;
    } else {
      property.type = *type;
    }
  }
  return property;
}

Expected<PlyElement> element_of(const std::filesystem::path& file, std::size_t line, const std::vector<std::string_view>& w) {
  if (w.size() != 3) return bad_input(file, "line {}: an element is 'element NAME COUNT'", line);
  PlyElement element;
  element.name = w[1];
  if (!parse_number(w[2], element.count)) {
    return bad_input(file, "line {}: element {} counts {}, must be a whole number in 0..2^64-1", line, excerpt(w[1]), excerpt(w[2]));
  }
  return element;
}

/// No more items than bytes could hold, so that no loop or allocation follows a lying count.
Expected<> check_counts(const std::filesystem::path& file, const PlyHeader& header, std::size_t payload) {
  std::uint64_t total = 0;
  for (const PlyElement& element : header.elements) {
    // In ascii each number takes two bytes, but for the file's last.
    const std::uint64_t item = header.format == PlyHeader::Format::ascii ? 2 * element.properties.size() : element.least_bytes();
    std::uint64_t bytes = 0;
    if (__builtin_mul_overflow(element.count, item, &bytes) || __builtin_add_overflow(total, bytes, &total) || total > payload + 1 ||
        (item == 0 && element.count > payload)) {
      return bad_input(file, "element {} counts {} items of at least {} bytes, but only {} bytes follow the header", excerpt(element.name),
                       element.count, item, payload);
    }
  }
  return {};
}

}  // namespace

std::uint64_t PlyElement::least_bytes() const noexcept {
  std::uint64_t bytes = 0;
  for (const auto& property : properties) bytes += size_of(property.list_count.value_or(property.type));
  return bytes;
}

bool PlyElement::has_lists() const noexcept {
  for (const auto& property : properties) {
    if (property.list_count) return true;
  }
  return false;
}

const PlyProperty* PlyElement::find(std::string_view property) const noexcept {
  for (const auto& p : properties) {
    if (p.name == property) return &p;
  }
  return nullptr;
}

Expected<PlyHeader> read_ply_header(const std::filesystem::path& file, const FileBytes& bytes) {
  TextCursor cursor(bytes.text());
  if (!cursor.next_raw_line() || trimmed(cursor.rest_of_line()) != "ply") return bad_input(file, "does not start with 'ply'");
  PlyHeader header;
  bool has_format = false;
  while (cursor.next_raw_line()) {
    const std::size_t line = cursor.line_number();
    const auto w = words(cursor);
    if (w.empty() || w[0] == "comment" || w[0] == "obj_info") continue;
    if (w[0] == "format" && w.size() == 3) {
      const auto format = format_of(file, w[1]);
      if (!format) return tl::unexpected(format.error());
      header.format = *format;
      has_format = true;
    } else if (w[0] == "element") {
      auto element = element_of(file, line, w);
      if (!element) return tl::unexpected(element.error());
      header.elements.push_back(std::move(*element));
    } else if (w[0] == "property") {
      if (header.elements.empty()) return bad_input(file, "line {}: a property before the first element", line);
      auto property = property_of(file, line, w);
      if (!property) return tl::unexpected(property.error());
      header.elements.back().properties.push_back(std::move(*property));
    } else if (w[0] == "end_header") {
      if (!has_format) return bad_input(file, "header has no format");
      header.size = bytes.size() - cursor.rest().size();
      header.lines = line;
      if (auto ok = check_counts(file, header, cursor.rest().size()); !ok) return tl::unexpected(ok.error());
      return header;
    } else {
      return bad_input(file, "line {}: header entry {} is not one of PLY's", line, excerpt(w[0]));
    }
  }
  return bad_input(file, "header ends without end_header");
}

}  // namespace swarmfit::io
