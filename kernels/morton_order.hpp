// Points in an order in which neighbours in the list are neighbours in space.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace swarmfit::kernels {

/// Positions in Morton order. A stable parallel radix sort over cells; points far from where most are share the outermost cells. Works in
/// the caller's crew.
class MortonOrder {
 public:
  /// To `order`. `columns` hold `count` finite coordinates each, 2 or 3 of them.
  void sort(std::span<const float* const> columns, std::size_t count, std::vector<std::uint32_t>& order);

 private:
  /// With four times the list's memory beside it, which is kept for the next one.
  template <class Key>
  void sort_at_once(const Key& key, std::span<std::uint32_t> order);
  /// With half of the list's memory beside it; finds each key twice.
  template <class Key>
  void sort_in_buckets(const Key& key, std::span<std::uint32_t> order);

  std::vector<std::uint64_t> entries_, scratch_;  ///< key in the upper half, position in the lower
  std::vector<std::uint32_t> histogram_;
};

}  // namespace swarmfit::kernels
