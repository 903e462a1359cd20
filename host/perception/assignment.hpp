// Who goes with whom at the least cost in all.
#pragma once

#include <cstddef>
#include <vector>

namespace swarmfit::perception {

/// costs[row * columns + column]. For each row its column, or -1: pairs that cost `limit` or more are not made. The sum of the costs of
/// the pairs made, plus `limit` for each row left alone, is the least there is. Kuhn and Munkres' algorithm, O(rows^2 (rows + columns)).
std::vector<int> assign(const std::vector<double>& costs, std::size_t columns, double limit);

}  // namespace swarmfit::perception
