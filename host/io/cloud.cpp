// What a cloud's lists must agree about.
#include <fmt/format.h>

#include <swarmfit/cloud.hpp>

namespace swarmfit {

Expected<> Cloud::validate() const {
  const auto complain = [](const char* field, auto value, const std::string& bound) {
    return fail(Error::Kind::bad_input, fmt::format("cloud.{} is {}, must be {}", field, value, bound));
  };
  if (dimension < 2 || dimension > 4) return complain("dimension", dimension, "2, 3 or 4");
  if (!values32.empty() && !values64.empty()) return complain("values64.size()", values64.size(), "0 where values32 is filled");
  const std::size_t values = values32.size() + values64.size(), columns = static_cast<std::size_t>(dimension);
  if (values % columns != 0) return complain("values", values, fmt::format("a multiple of its dimension, {}", dimension));
  if (!rgb.empty() && rgb.size() != 3 * size()) return complain("rgb.size()", rgb.size(), fmt::format("0 or {}, 3 a point", 3 * size()));
  if (!organised()) return {};
  const bool whole = width >= 1 && static_cast<std::size_t>(width) * static_cast<std::size_t>(height) == size();
  return whole ? Expected<>() : complain("width", width, fmt::format("its {} points over its height, {}", size(), height));
}

}  // namespace swarmfit
