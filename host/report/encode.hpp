// Numbers as the page reads them: bytes, little-endian, in base64. report/src/data.js is the other half.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <swarmfit/cloud.hpp>

namespace swarmfit::report {

using Bytes = std::vector<std::uint8_t>;

std::string base64(std::span<const std::uint8_t> bytes);

/// Seven bits a byte, the lowest first; the high bit says that more follow.
void append_varint(Bytes& bytes, std::uint64_t value);

/// Labels as runs: value and length, each a varint.
Bytes runs(std::span<const std::uint16_t> labels);

/// The points that a page shows.
struct Shown {
  std::vector<std::uint32_t> index;  ///< of the input, ascending; all finite
  int every = 1;                     ///< of an organised cloud every so many-th row and column, of another every so many-th finite point
};

/// All finite points, or evenly spread ones where there are more than `most`.
Shown choose_points(const Cloud& cloud, std::size_t most);

/// Positions of points, 16 bits a coordinate between the least and the largest of its column.
struct Quantised {
  std::array<double, 4> low{}, high{};  ///< of each column; where equal all are there
  Bytes bytes;
};
Quantised quantise(const Cloud& cloud, std::span<const std::uint32_t> index);

/// Ascending numbers by their differences, each a varint.
Bytes differences(std::span<const std::uint32_t> ascending);

/// values[index[k]], 0 where there are none.
std::vector<std::uint16_t> gather(std::span<const std::uint16_t> values, std::span<const std::uint32_t> index);

}  // namespace swarmfit::report
