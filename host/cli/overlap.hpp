// Which found label is which true one: by the pixels they share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace swarmfit::cli {

struct Match {
  std::size_t label = 0;  ///< the found label that covers the true one best; 0: none
  double iou = 0;         ///< intersection over union
};

/// For each true label, of which there are `true_count` from 1 on, its match among `found_count` found ones; the first, for label 0, is
/// empty. Only pixels that count count, all where `counts` is empty.
std::vector<Match> match_labels(std::span<const std::uint16_t> truth, std::size_t true_count, std::span<const std::uint16_t> found,
                                std::size_t found_count, const std::vector<bool>& counts = {});

}  // namespace swarmfit::cli
