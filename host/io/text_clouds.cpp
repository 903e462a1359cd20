// XYZ (blanks between values) and CSV (commas). Text keeps its digits: values are doubles.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "host/io/clouds.hpp"
#include "host/io/columns.hpp"
#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

Expected<> finish(const std::filesystem::path& file, Cloud& cloud) {
  if (cloud.size() == 0) return bad_input(file, "holds no points");
  if (cloud.size() > std::size_t{std::numeric_limits<int>::max()}) {
    return bad_input(file, "holds {} points, must be at most {}", cloud.size(), std::numeric_limits<int>::max());
  }
  cloud.width = static_cast<int>(cloud.size());
  cloud.height = 1;
  return {};
}

/// Are three more columns normals? No colour is below zero, and no normal longer than one.
bool are_normals(const std::vector<double>& values) {
  constexpr double kLongest = 1.001;  // rounded
  return std::any_of(values.begin(), values.end(), [](double v) { return v < 0; }) &&
         std::none_of(values.begin(), values.end(), [](double v) { return std::abs(v) > kLongest; });
}

/// Colours are whole numbers in 0..255, or all in 0..1.
Expected<> set_colours(const std::filesystem::path& file, const std::vector<double>& values, Cloud& cloud) {
  const double largest = *std::max_element(values.begin(), values.end());
  const bool unit = largest <= 1 && std::any_of(values.begin(), values.end(), [](double v) { return v > 0 && v < 1; });
  cloud.rgb.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= 0 && values[i] <= 255)) {
      return bad_input(file, "point {}, colour {}: {}, must be in 0..255", i / 3 + 1, "rgb"[i % 3], values[i]);
    }
    cloud.rgb[i] = channel(values[i], unit ? Scalar::f64 : Scalar::u8);
  }
  return {};
}

/// What the columns of a CSV mean.
struct CsvColumns {
  std::vector<int> coordinate;  ///< one a column: which coordinate, -1 for none
  int dimension = 0;
  bool header = false;
};

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> out;
  for (std::size_t start = 0;;) {
    const std::size_t comma = line.find(',', start);
    std::string_view field = trimmed(line.substr(start, comma == std::string_view::npos ? comma : comma - start));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"') field = trimmed(field.substr(1, field.size() - 2));
    out.push_back(field);
    if (comma == std::string_view::npos) return out;
    start = comma + 1;
  }
}

constexpr const char* kLayouts = "must be x,y or x,y,z or x1,y1,x2,y2, and perhaps label";

Expected<CsvColumns> named_columns(const std::filesystem::path& file, const std::vector<std::string_view>& names) {
  static const std::array<std::vector<std::string_view>, 3> layouts = {{{"x", "y"}, {"x", "y", "z"}, {"x1", "y1", "x2", "y2"}}};
  std::vector<std::string> lower(names.begin(), names.end());
  for (auto& name : lower) {
    std::transform(name.begin(), name.end(), name.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  }
  for (const auto& layout : layouts) {
    CsvColumns columns{{}, static_cast<int>(layout.size()), true};
    std::size_t matched = 0, ignored = 0;
    for (const auto& name : lower) {
      const auto at = std::find(layout.begin(), layout.end(), name);
      columns.coordinate.push_back(at == layout.end() ? -1 : static_cast<int>(at - layout.begin()));
      matched += at != layout.end();
      ignored += name == "label";
    }
    const bool each_once =
        std::all_of(layout.begin(), layout.end(), [&](auto name) { return std::count(lower.begin(), lower.end(), name) == 1; });
    if (each_once && matched + ignored == lower.size()) return columns;
  }
  std::string given;
  for (const auto& name : names) {
    if (!given.empty()) given += ',';
    given += name;
  }
  return bad_input(file, "columns {}, {}", excerpt(given), kLayouts);
}

Expected<CsvColumns> csv_columns(const std::filesystem::path& file, std::string_view first_line) {
  const auto fields = split(first_line);
  double value = 0;
  if (!parse_number(fields[0], value)) return named_columns(file, fields);
  CsvColumns columns;
  columns.dimension = static_cast<int>(fields.size());
  if (fields.size() < 2 || fields.size() > 4) return bad_input(file, "{} columns without a header, {}", fields.size(), kLayouts);
  for (int d = 0; d < columns.dimension; ++d) columns.coordinate.push_back(d);
  return columns;
}

/// One row into the end of `values`; the fields are walked, not listed, as this is the inner loop.
Expected<> read_csv_row(const std::filesystem::path& file, std::size_t line_number, std::string_view line, const CsvColumns& columns,
                        std::vector<double>& values) {
  const std::size_t base = values.size();
  values.resize(base + static_cast<std::size_t>(columns.dimension));
  std::size_t column = 0;
  for (;; ++column) {
    const std::size_t comma = line.find(',');
    if (column < columns.coordinate.size() && columns.coordinate[column] >= 0) {
      std::string_view field = trimmed(line.substr(0, comma));
      if (field.size() >= 2 && field.front() == '"' && field.back() == '"') field = trimmed(field.substr(1, field.size() - 2));
      if (!parse_number(field, values[base + static_cast<std::size_t>(columns.coordinate[column])])) {
        return bad_input(file, "line {}, column {}: {} is not a number in range", line_number, column + 1, excerpt(field));
      }
    }
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  if (column + 1 != columns.coordinate.size()) {
    return bad_input(file, "line {}: {} columns, must be {} as in the first line", line_number, column + 1, columns.coordinate.size());
  }
  return {};
}

}  // namespace

Expected<Cloud> read_xyz(const std::filesystem::path& file, const FileBytes& bytes) {
  static constexpr const char* kRows = "must be x y z, and perhaps r g b or a normal";
  Cloud cloud;
  std::vector<double> colours;  // or normals
  std::size_t width = 0;
  TextCursor cursor(bytes.text());
  while (cursor.next_line()) {
    double row[6] = {};
    std::size_t n = 0;
    for (auto token = cursor.token(); !token.empty(); token = cursor.token(), ++n) {
      if (n == 6) return bad_input(file, "line {}: more than 6 columns, {}", cursor.line_number(), kRows);
      if (!parse_number(token, row[n])) {
        return bad_input(file, "line {}, column {}: {} is not a number in range", cursor.line_number(), n + 1, excerpt(token));
      }
    }
    if (width == 0) {
      if (n != 3 && n != 6) return bad_input(file, "line {}: {} columns, {}", cursor.line_number(), n, kRows);
      width = n;
    }
    if (n != width) return bad_input(file, "line {}: {} columns, must be {} as in the first line", cursor.line_number(), n, width);
    cloud.values64.insert(cloud.values64.end(), row, row + 3);
    if (n == 6) colours.insert(colours.end(), row + 3, row + 6);
  }
  if (auto ok = finish(file, cloud); !ok) return tl::unexpected(ok.error());
  if (!colours.empty() && !are_normals(colours)) {
    if (auto ok = set_colours(file, colours, cloud); !ok) return tl::unexpected(ok.error());
  }
  return cloud;
}

Expected<Cloud> read_csv(const std::filesystem::path& file, const FileBytes& bytes) {
  std::string_view text = bytes.text();
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  TextCursor cursor(text);
  if (!cursor.next_line()) return bad_input(file, "holds no points");
  const auto columns = csv_columns(file, cursor.rest_of_line());
  if (!columns) return tl::unexpected(columns.error());

  Cloud cloud;
  cloud.dimension = columns->dimension;
  bool more = columns->header ? cursor.next_line() : true;
  for (; more; more = cursor.next_line()) {
    if (auto ok = read_csv_row(file, cursor.line_number(), cursor.rest_of_line(), *columns, cloud.values64); !ok)
      return tl::unexpected(ok.error());
  }
  if (auto ok = finish(file, cloud); !ok) return tl::unexpected(ok.error());
  return cloud;
}

}  // namespace swarmfit::io
