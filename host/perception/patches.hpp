// Smooth patches of the things that pop out, on a coarser grid: the pieces that objects are put together from.
#pragma once

#include <cstdint>
#include <vector>

#include "host/perception/grid.hpp"
#include "host/perception/popout.hpp"

namespace swarmfit::perception {

/// One cell a block of stride x stride pixels; cells without a group hold NaN and group 0.
struct CoarseGrid {
  int stride = 1, width = 0, height = 0;
  std::vector<Eigen::Vector3f> points;   ///< mean of the block's points of one group
  std::vector<Eigen::Vector3f> normals;  ///< unit, towards the camera; zero where there are too few neighbours
  std::vector<float> variation;          ///< least eigenvalue over the sum, of the neighbourhood
  std::vector<std::uint16_t> group;      ///< pop-out group
  float unsteady = 0;                    ///< how far normals are to be distrusted, 0 to 1: by what those of neighbours on a face differ
  float footprint(std::size_t at, float pitch) const { return static_cast<float>(stride) * pitch * points[at].norm(); }
};

struct Patch {
  std::uint16_t group = 0;
  std::size_t cells = 0;
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();  ///< in the image [cells]
};

struct Patches {
  std::vector<std::uint16_t> label;  ///< one a cell: 0, or k for the k-th patch
  std::vector<Patch> list;
};

CoarseGrid make_coarse_grid(const PointGrid& grid, const Popout& popout, int threads = 0);
/// `steady` where normals are, `unsteady` where they are not, and what lies between for what lies between.
inline double by_steadiness(const CoarseGrid& coarse, double steady, double unsteady) {
  return steady + static_cast<double>(coarse.unsteady) * (unsteady - steady);
}

Patches grow_patches(const CoarseGrid& coarse, float pitch);

}  // namespace swarmfit::perception
