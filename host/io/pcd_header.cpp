#include "host/io/pcd_header.hpp"

#include <limits>
#include <map>
#include <optional>
#include <system_error>

#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

/// Every entry's values, as text.
using Entries = std::map<std::string, std::vector<std::string_view>, std::less<>>;

bool known(std::string_view key) {
  for (const char* k : {"VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}) {
    if (key == k) return true;
  }
  return false;
}

/// Reads lines up to and with DATA.
Expected<Entries> read_entries(const std::filesystem::path& file, const FileBytes& bytes, PcdHeader& header) {
  Entries entries;
  TextCursor cursor(bytes.text());
  while (cursor.next_line()) {
    std::string key(cursor.token());
    if (!known(key)) return bad_input(file, "line {}: header entry {} is not one of PCD's", cursor.line_number(), excerpt(key));
    if (key == "COLUMNS") key = "FIELDS";
    if (entries.contains(key)) return bad_input(file, "line {}: header entry {} occurs twice", cursor.line_number(), key);
    auto& values = entries[key];
    for (auto token = cursor.token(); !token.empty(); token = cursor.token()) values.push_back(token);
    if (values.empty()) return bad_input(file, "header entry {} has no value", key);
    if (key == "DATA") {
      header.size = bytes.size() - cursor.rest().size();
      header.lines = cursor.line_number();
      return entries;
    }
  }
  return bad_input(file, "header ends without a DATA entry");
}

Expected<std::uint64_t> whole_number(const std::filesystem::path& file, std::string_view key, std::string_view token) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (error == std::errc::result_out_of_range) return bad_input(file, "{} {} is too large", key, excerpt(token));
  if (error != std::errc() || end != token.data() + token.size())
    return bad_input(file, "{} {} must be a whole number >= 0", key, excerpt(token));
  return value;
}

/// The one value of an entry; nothing where the entry is missing.
Expected<std::optional<std::uint64_t>> single(const std::filesystem::path& file, const Entries& entries, std::string_view key) {
  const auto entry = entries.find(key);
  if (entry == entries.end()) return std::optional<std::uint64_t>();
  if (entry->second.size() != 1) return bad_input(file, "{} has {} values, must have 1", key, entry->second.size());
  auto value = whole_number(file, key, entry->second[0]);
  if (!value) return tl::unexpected(std::move(value.error()));
  return std::optional<std::uint64_t>(*value);
}

Expected<Scalar> scalar_type(const std::filesystem::path& file, std::string_view name, std::string_view type, std::string_view size) {
  if (type == "F" && size == "4") return Scalar::f32;
  if (type == "F" && size == "8") return Scalar::f64;
  if (type == "I" && size == "1") return Scalar::i8;
  if (type == "I" && size == "2") return Scalar::i16;
  if (type == "I" && size == "4") return Scalar::i32;
  if (type == "I" && size == "8") return Scalar::i64;
  if (type == "U" && size == "1") return Scalar::u8;
  if (type == "U" && size == "2") return Scalar::u16;
  if (type == "U" && size == "4") return Scalar::u32;
  if (type == "U" && size == "8") return Scalar::u64;
  return bad_input(file, "field {}: TYPE {} with SIZE {}, must be F with 4 or 8, or I or U with 1, 2, 4 or 8", excerpt(name), excerpt(type),
                   excerpt(size));
}

Expected<> read_fields(const std::filesystem::path& file, const Entries& entries, PcdHeader& header) {
  for (const char* key : {"FIELDS", "SIZE", "TYPE"}) {
    if (!entries.contains(key)) return bad_input(file, "header entry {} is missing", key);
  }
  const auto& names = entries.find("FIELDS")->second;
  const auto& sizes = entries.find("SIZE")->second;
  const auto& types = entries.find("TYPE")->second;
  const auto counts = entries.find("COUNT");
  if (sizes.size() != names.size()) return bad_input(file, "SIZE has {} values for {} FIELDS", sizes.size(), names.size());
  if (types.size() != names.size()) return bad_input(file, "TYPE has {} values for {} FIELDS", types.size(), names.size());
  if (counts != entries.end() && counts->second.size() != names.size()) {
    return bad_input(file, "COUNT has {} values for {} FIELDS", counts->second.size(), names.size());
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    PcdField field;
    field.name = names[i];
    const auto type = scalar_type(file, field.name, types[i], sizes[i]);
    if (!type) return tl::unexpected(type.error());
    field.type = *type;
    if (counts != entries.end()) {
      const auto count = whole_number(file, "COUNT", counts->second[i]);
      if (!count) return tl::unexpected(count.error());
      // No point is larger than the largest file there can be.
      if (*count < 1 || *count > std::numeric_limits<std::uint32_t>::max()) {
        return bad_input(file, "field {}: COUNT {}, must be in 1..{}", excerpt(field.name), *count,
                         std::numeric_limits<std::uint32_t>::max());
      }
      field.count = *count;
    }
    field.offset = header.point_bytes;
    header.point_bytes += field.bytes();
    header.fields.push_back(field);
  }
  return {};
}

Expected<> read_counts(const std::filesystem::path& file, const Entries& entries, PcdHeader& header) {
  const auto width = single(file, entries, "WIDTH"), height = single(file, entries, "HEIGHT"), points = single(file, entries, "POINTS");
  for (const auto* value : {&width, &height, &points}) {
    if (!*value) return tl::unexpected(value->error());
  }
  if (!*width && !*points) return bad_input(file, "header entries WIDTH and POINTS are missing");
  header.width = width->value_or(points->value_or(0));
  header.height = height->value_or(1);
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  if (header.width < 1 || header.width > kMost) return bad_input(file, "WIDTH {}, must be in 1..{}", header.width, kMost);
  if (header.height < 1 || header.height > kMost) return bad_input(file, "HEIGHT {}, must be in 1..{}", header.height, kMost);
  header.points = header.width * header.height;
  if (points->value_or(header.points) != header.points) {
    return bad_input(file, "POINTS {}, must be WIDTH x HEIGHT = {} x {} = {}", **points, header.width, header.height, header.points);
  }
  return {};
}

Expected<> read_data(const std::filesystem::path& file, const Entries& entries, std::size_t payload, PcdHeader& header) {
  const std::string_view data = entries.find("DATA")->second[0];
  if (data == "ascii") {
    header.data = PcdHeader::Data::ascii;
  } else if (data == "binary") {
    header.data = PcdHeader::Data::binary;
  } else if (data == "binary_compressed") {
    header.data = PcdHeader::Data::binary_compressed;
  } else {
    return bad_input(file, "DATA {}, must be ascii, binary or binary_compressed", excerpt(data));
  }
  // LZF's longest match is 264 bytes out of 3; ascii spends two bytes a value, but for the last.
  const std::uint64_t most =
      header.data == PcdHeader::Data::binary_compressed ? std::uint64_t{payload} * 88 : std::uint64_t{payload} * 4 + 8;
  std::uint64_t need = 0;
  if (__builtin_mul_overflow(header.points, header.point_bytes, &need) ||
      (header.data == PcdHeader::Data::binary ? need > payload : need > most)) {
    return bad_input(file, "POINTS {} of {} bytes each, but only {} bytes of {} data follow the header", header.points, header.point_bytes,
                     payload, data);
  }
  return {};
}

}  // namespace

const PcdField* PcdHeader::find(std::string_view name) const noexcept {
  for (const auto& field : fields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

Expected<PcdHeader> read_pcd_header(const std::filesystem::path& file, const FileBytes& bytes) {
  PcdHeader header;
  const auto entries = read_entries(file, bytes, header);
  if (!entries) return tl::unexpected(entries.error());
  if (auto ok = read_fields(file, *entries, header); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_counts(file, *entries, header); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_data(file, *entries, bytes.size() - header.size, header); !ok) return tl::unexpected(ok.error());
  return header;
}

}  // namespace swarmfit::io
