// Stretches of equal labels, in frames of which most pixels have none.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>

namespace swarmfit::perception {

/// Calls body(first, last, label) for each stretch [first, last) of one label other than 0 within [begin, end) of `labels`, in order.
template <class Body>
void for_each_run(std::span<const std::uint16_t> labels, std::size_t begin, std::size_t end, Body&& body) {
  for (std::size_t i = begin; i < end;) {
    // Four at a time where there is nothing.
    for (std::uint64_t four = 0; i + 4 <= end; i += 4) {
      std::memcpy(&four, &labels[i], sizeof four);
      if (four != 0) break;
    }
    while (i < end && labels[i] == 0) ++i;
    if (i == end) return;
    const std::size_t first = i;
    const std::uint16_t label = labels[i];
    while (i < end && labels[i] == label) ++i;
    body(first, i, label);
  }
}

}  // namespace swarmfit::perception
