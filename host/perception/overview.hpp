// The whole frame on a coarser grid with the direction of the surface at each cell: what planes are looked for in.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "host/perception/grid.hpp"

namespace swarmfit::perception {

/// `cells` is itself a grid, of block means; unorganised: the points themselves, and no normals.
struct Overview {
  int stride = 1;  ///< [px] a cell is a block of stride x stride
  PointGrid cells;
  std::vector<Eigen::Vector3f> normals;  ///< unit, towards the camera; zero where the surface bends, ends or is unknown; empty: none known

  std::vector<std::uint8_t> textured;  ///< passive stereo: 1 where there was something to match; empty: the depth is good everywhere

  bool stereo() const noexcept { return !textured.empty(); }
  bool has_normals() const noexcept { return !normals.empty(); }
  bool knows_normal(std::size_t cell) const noexcept { return has_normals() && normals[cell].squaredNorm() > 0; }
  /// Whether the surface at a cell may belong to a plane with this normal (n and -n are one). True where nothing is known at all: stereo's
  /// cells get the benefit of the doubt, since on small surfaces few normals are known.
  bool agrees(std::size_t cell, const Eigen::Vector3f& normal, float least_cosine) const noexcept {
    return !has_normals() || (stereo() && !knows_normal(cell)) || std::abs(normals[cell].dot(normal)) >= least_cosine;
  }
};

/// `frame` is what `grid` was made from. Between textures passive stereo guesses: normals are taken from textured cells alone then.
Overview make_overview(const PointGrid& grid, const Cloud& frame, int threads = 0);

/// Cells on flat surfaces, or with texture where that is what counts; with `normal` only those that agree with it (least_cosine > 0).
std::vector<std::uint32_t> flat_cells(const Overview& overview);
std::vector<std::uint32_t> flat_cells(const Overview& overview, const Eigen::Vector3f& normal, float least_cosine);

}  // namespace swarmfit::perception
