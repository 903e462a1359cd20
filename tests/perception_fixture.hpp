// A small camera over a table with boxes and bowls: organised clouds with a known truth, in the camera's frame (x right, y down, z
// forward).
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <swarmfit/cloud.hpp>
#include <swarmfit/model.hpp>

#include "host/perception/grid.hpp"
#include "host/perception/surface.hpp"

namespace swarmfit::test {

/// normal . x + offset = 0 with so many inliers.
inline Model plane_model(const Eigen::Vector3d& normal, double offset, std::size_t inliers) {
  Model model;
  model.parameters.resize(4);
  model.parameters << normal.normalized(), offset;
  model.inliers = inliers;
  return model;
}

struct Box {
  Eigen::Vector3d centre, half;  // world: z up, the table at z = 0
  double yaw = 0;
};

struct Rendering {
  Cloud cloud;
  std::vector<std::uint16_t> truth;  // 0 nothing, 1 table, 2 + k the k-th box
  Eigen::Vector3d up;                // in the camera's frame
  double height = 0;                 // of the camera above the table

  perception::LocalPlane table() const { return {up.cast<float>(), static_cast<float>(height)}; }
  std::vector<std::uint16_t> table_labels() const {
    std::vector<std::uint16_t> labels(truth.size(), 0);
    for (std::size_t i = 0; i < truth.size(); ++i) labels[i] = truth[i] == 1;
    return labels;
  }
};

/// Distance along the ray to the box, or infinity.
inline double hit_box(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray, const Box& box) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(-box.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d o = turn * (eye - box.centre), d = turn * ray;
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (std::abs(d[k]) < 1e-12) {
      if (std::abs(o[k]) > box.half[k]) return std::numeric_limits<double>::infinity();
      continue;
    }
    const double a = (-box.half[k] - o[k]) / d[k], b = (box.half[k] - o[k]) / d[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave && enter > 0 ? enter : std::numeric_limits<double>::infinity();
}

/// The camera stands at (0, -1, 0.9) and looks 42 degrees down, over a table of 1.6 x 1.2 m around the world's origin.
inline Rendering render_table(const std::vector<Box>& boxes, double noise = 0.0015, int width = 320, int height = 240) {
  constexpr double kTilt = 0.733;
  const Eigen::Vector3d eye(0, -1, 0.9), forward(0, std::cos(kTilt), -std::sin(kTilt)), right(1, 0, 0), down = forward.cross(right);
  Rendering out;
  out.up = Eigen::Vector3d(right.z(), down.z(), forward.z());
  out.height = eye.z();
  out.cloud.width = width;
  out.cloud.height = height;
  std::mt19937 random(7);
  std::normal_distribution<double> jitter(0, noise);
  const double focal = 525.0 * width / 640;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const double x = (u + 0.5 - width / 2.0) / focal, y = (v + 0.5 - height / 2.0) / focal;
      const Eigen::Vector3d ray = forward + x * right + y * down;
      double nearest = -eye.z() / ray.z();
      const Eigen::Vector3d foot = eye + nearest * ray;
      std::uint16_t what = 1;
      if (nearest <= 0 || std::abs(foot.x()) > 0.8 || std::abs(foot.y()) > 0.6) {
        nearest = std::numeric_limits<double>::infinity();
        what = 0;
      }
      for (std::size_t k = 0; k < boxes.size(); ++k)
        if (const double t = hit_box(eye, ray, boxes[k]); t < nearest) {
          nearest = t;
          what = static_cast<std::uint16_t>(2 + k);
        }
      const double z = nearest + jitter(random) * nearest * nearest;
      out.truth.push_back(what);
      for (const double value : {x * z, y * z, z})
        out.cloud.values32.push_back(what == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value));
    }
  return out;
}

/// Share of the true object's points that the label most frequent among them holds, and that label.
struct Agreement {
  std::uint16_t label = 0;
  double recall = 0, precision = 0;
};
inline Agreement agreement(const std::vector<std::uint16_t>& truth, std::uint16_t what, const std::vector<std::uint16_t>& found) {
  std::vector<double> hits(65536, 0), size(65536, 0);
  double total = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    size[found[i]] += 1;
    if (truth[i] != what) continue;
    hits[found[i]] += 1;
    total += 1;
  }
  Agreement best;
  double most = 0;
  for (std::size_t k = 1; k < hits.size(); ++k)
    if (hits[k] > most) {
      most = hits[k];
      best = {static_cast<std::uint16_t>(k), hits[k] / total, hits[k] / size[k]};
    }
  return best;
}

}  // namespace swarmfit::test
