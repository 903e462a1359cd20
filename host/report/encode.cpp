#include "host/report/encode.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::report {
namespace {

double at(const Cloud& cloud, std::size_t i, int column) {
  const std::size_t k = i * static_cast<std::size_t>(cloud.dimension) + static_cast<std::size_t>(column);
  return cloud.values64.empty() ? static_cast<double>(cloud.values32[k]) : cloud.values64[k];
}

bool finite(const Cloud& cloud, std::size_t i) {
  for (int d = 0; d < cloud.dimension; ++d) {
    if (!std::isfinite(at(cloud, i, d))) return false;
  }
  return true;
}

std::vector<std::uint32_t> on_grid(const Cloud& cloud, int every) {
  std::vector<std::uint32_t> index;
  for (int v = 0; v < cloud.height; v += every) {
    for (int u = 0; u < cloud.width; u += every) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(u);
      if (finite(cloud, i)) index.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return index;
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = (word << 8) | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[(word >> (18 - 6 * k)) & 63U] : '=';
  }
  return text;
}

void append_varint(Bytes& bytes, std::uint64_t value) {
  for (; value >= 128; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 128U));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

Bytes runs(std::span<const std::uint16_t> labels) {
  Bytes bytes;
  for (std::size_t first = 0; first < labels.size();) {
    std::size_t last = first;
    while (last < labels.size() && labels[last] == labels[first]) ++last;
    append_varint(bytes, labels[first]);
    append_varint(bytes, last - first);
    first = last;
  }
  return bytes;
}

Shown choose_points(const Cloud& cloud, std::size_t most) {
  Shown shown;
  if (cloud.organised()) {
    shown.index = on_grid(cloud, shown.every);
    while (shown.index.size() > most) shown.index = on_grid(cloud, ++shown.every);
    return shown;
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (finite(cloud, i)) shown.index.push_back(static_cast<std::uint32_t>(i));
  }
  if (shown.index.size() <= most) return shown;
  const std::size_t every = (shown.index.size() + most - 1) / most;
  for (std::size_t k = 0; k * every < shown.index.size(); ++k) shown.index[k] = shown.index[k * every];
  shown.index.resize((shown.index.size() + every - 1) / every);
  shown.every = static_cast<int>(every);
  return shown;
}

Quantised quantise(const Cloud& cloud, std::span<const std::uint32_t> index) {
  constexpr double kLevels = 65535;
  Quantised q;
  const auto columns = static_cast<std::size_t>(cloud.dimension);
  for (std::size_t d = 0; d < columns && !index.empty(); ++d) {
    q.low[d] = std::numeric_limits<double>::infinity();
    q.high[d] = -q.low[d];
    for (const std::uint32_t i : index) {
      q.low[d] = std::min(q.low[d], at(cloud, i, static_cast<int>(d)));
      q.high[d] = std::max(q.high[d], at(cloud, i, static_cast<int>(d)));
    }
  }
  q.bytes.reserve(index.size() * columns * 2);
  for (const std::uint32_t i : index) {
    for (std::size_t d = 0; d < columns; ++d) {
      // Halves, so that the span of the largest doubles is one, too.
      const double span = q.high[d] / 2 - q.low[d] / 2;
      const double share = span > 0 ? (at(cloud, i, static_cast<int>(d)) / 2 - q.low[d] / 2) / span : 0;
      const auto level = static_cast<std::uint32_t>(std::lround(share * kLevels));
      q.bytes.push_back(static_cast<std::uint8_t>(level));
      q.bytes.push_back(static_cast<std::uint8_t>(level >> 8));
    }
  }
  return q;
}

Bytes differences(std::span<const std::uint32_t> ascending) {
  Bytes bytes;
  std::uint32_t before = 0;
  for (const std::uint32_t value : ascending) {
    append_varint(bytes, value - before);
    before = value;
  }
  return bytes;
}

std::vector<std::uint16_t> gather(std::span<const std::uint16_t> values, std::span<const std::uint32_t> index) {
  std::vector<std::uint16_t> gathered(index.size(), 0);
  for (std::size_t k = 0; k < index.size(); ++k) {
    if (index[k] < values.size()) gathered[k] = values[index[k]];
  }
  return gathered;
}

}  // namespace swarmfit::report
