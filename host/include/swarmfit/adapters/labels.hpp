// Labels as lists of indices, which is what most libraries select points by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmfit::adapters {

/// Indices of the points labelled k, the k-th model's for k >= 1; k = 0: of those no model explains.
template <class Index = int>
std::vector<Index> indices(const std::vector<std::uint16_t>& labels, std::size_t k) {
  std::vector<Index> all;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == k) all.push_back(static_cast<Index>(i));
  }
  return all;
}

/// One list a model: the k-th model's at k - 1.
template <class Index = int>
std::vector<std::vector<Index>> indices_of_all(const std::vector<std::uint16_t>& labels, std::size_t models) {
  std::vector<std::vector<Index>> all(models);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= 1 && labels[i] <= models) all[labels[i] - 1U].push_back(static_cast<Index>(i));
  }
  return all;
}

}  // namespace swarmfit::adapters
