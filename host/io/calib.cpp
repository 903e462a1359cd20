#include "host/io/calib.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "host/io/file.hpp"
#include "host/io/text_cursor.hpp"

namespace swarmfit::io {
namespace {

using Fields = std::map<std::string, std::string, std::less<>>;

Expected<Fields> read_fields(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  Fields fields;
  TextCursor cursor(bytes->text());
  while (cursor.next_line()) {
    const std::string_view line = cursor.rest_of_line();
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos)
      return bad_input(file, "line {}: {} is not of the form key=value", cursor.line_number(), excerpt(trimmed(line)));
    fields[std::string(trimmed(line.substr(0, equals)))] = trimmed(line.substr(equals + 1));
  }
  return fields;
}

Expected<double> number(const std::filesystem::path& file, const Fields& fields, std::string_view key) {
  const auto field = fields.find(key);
  if (field == fields.end()) return bad_input(file, "field {} is missing", key);
  double value = 0;
  if (!parse_number(field->second, value) || !std::isfinite(value))
    return bad_input(file, "field {}: {} is not a number", key, excerpt(field->second));
  return value;
}

/// [f 0 cx; 0 f cy; 0 0 1]
Expected<Intrinsics> camera(const std::filesystem::path& file, const Fields& fields, std::string_view key) {
  const auto field = fields.find(key);
  if (field == fields.end()) return bad_input(file, "field {} is missing", key);
  std::string text = field->second;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '[' || c == ']' || c == ';' || c == ','; }, ' ');
  std::array<double, 9> m{};
  std::size_t n = 0;
  TextCursor cursor(text);
  cursor.next_raw_line();
  for (auto token = cursor.token(); !token.empty(); token = cursor.token(), ++n) {
    if (n == 9 || !parse_number(token, m[n]) || !std::isfinite(m[n]))
      return bad_input(file, "field {}: {} must be 9 numbers, [f 0 cx; 0 f cy; 0 0 1]", key, excerpt(field->second));
  }
  if (n != 9) return bad_input(file, "field {}: {} must be 9 numbers, [f 0 cx; 0 f cy; 0 0 1]", key, excerpt(field->second));
  if (!(m[0] > 0) || !(m[4] > 0)) return bad_input(file, "field {}: focal length {}, must be > 0 [px]", key, std::min(m[0], m[4]));
  return Intrinsics{m[0], m[4], m[2], m[5]};
}

}  // namespace

Expected<StereoCalibration> read_calibration(const std::filesystem::path& file) {
  const auto fields = read_fields(file);
  if (!fields) return tl::unexpected(fields.error());
  const auto left = camera(file, *fields, "cam0");
  if (!left) return tl::unexpected(left.error());
  StereoCalibration calibration;
  calibration.left = *left;
  const auto doffs = number(file, *fields, "doffs"), baseline = number(file, *fields, "baseline"), ndisp = number(file, *fields, "ndisp");
  for (const auto* value : {&doffs, &baseline, &ndisp}) {
    if (!*value) return tl::unexpected(value->error());
  }
  if (!(*baseline > 0)) return bad_input(file, "field baseline: {}, must be > 0 [mm]", *baseline);
  constexpr int kMostDisparities = 4096;
  if (!(*ndisp >= 1 && *ndisp <= kMostDisparities))
    return bad_input(file, "field ndisp: {}, must be in 1..{} [px]", *ndisp, kMostDisparities);
  calibration.doffs = *doffs;
  calibration.baseline = *baseline * 1e-3;
  calibration.disparities = static_cast<int>(std::ceil(*ndisp));
  for (const auto& [key, size] : {std::pair{"width", &calibration.width}, std::pair{"height", &calibration.height}}) {
    if (!fields->contains(std::string_view(key))) continue;
    const auto value = number(file, *fields, key);
    if (!value) return tl::unexpected(value.error());
    if (!(*value >= 1 && *value <= 1e6)) return bad_input(file, "field {}: {}, must be in 1..1000000 [px]", key, *value);
    *size = static_cast<int>(*value);
  }
  return calibration;
}

}  // namespace swarmfit::io
