#include "bench/judge.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <nanoflann.hpp>

namespace swarmfit::peers {
namespace {

constexpr std::size_t kSamples = 20000;
// A neighbourhood is 40 of at most so many points, spread evenly: wide enough to see a surface through a depth camera's noise.
constexpr std::size_t kLookedAt = 40000, kNeighbours = 40;

/// What nanoflann asks of points.
struct Points {
  const std::vector<float>& xyz;
  std::size_t kdtree_get_point_count() const { return xyz.size() / 3; }
  float kdtree_get_pt(std::size_t i, std::size_t column) const { return xyz[3 * i + column]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>, Points, 3, std::uint32_t>;

double distance(const Plane& plane, const float* x) {
  return std::abs(plane.normal[0] * static_cast<double>(x[0]) + plane.normal[1] * static_cast<double>(x[1]) +
                  plane.normal[2] * static_cast<double>(x[2]) + plane.offset);
}

}  // namespace

Judge::Judge(const Scene& scene, const Task& task) : scene_(scene), task_(task) {
  const std::size_t count = scene.size(), size = std::min(count, kSamples);
  for (std::size_t k = 0; k < size; ++k) samples_.push_back(static_cast<std::uint32_t>(k * count / size));
  estimate_normals();
}

void Judge::estimate_normals() {
  std::vector<float> spread;
  const std::size_t count = scene_.size(), looked_at = std::min(count, kLookedAt);
  for (std::size_t k = 0; k < looked_at; ++k) {
    const float* x = scene_.points.data() + 3 * (k * count / looked_at);
    spread.insert(spread.end(), x, x + 3);
  }
  const Points points{spread};
  Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();
  std::vector<std::uint32_t> near(kNeighbours);
  std::vector<float> squares(kNeighbours);
  for (const std::uint32_t sample : samples_) {
    const std::size_t found = tree.knnSearch(scene_.points.data() + std::size_t{3} * sample, kNeighbours, near.data(), squares.data());
    Eigen::Matrix3Xd around(3, static_cast<Eigen::Index>(found));
    for (std::size_t k = 0; k < found; ++k) {
      around.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::Vector3f>(spread.data() + std::size_t{3} * near[k]).cast<double>();
    }
    around.colwise() -= around.rowwise().mean().eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(around * around.transpose());
    const Eigen::Vector3f normal = axes.eigenvectors().col(0).cast<float>();
    normals_.push_back({normal.x(), normal.y(), normal.z()});
  }
}

Verdict Judge::judge(const Found& found, bool organised) const {
  Verdict verdict;
  for (const Plane& plane : found.planes) verdict.planes.push_back({plane, 0, 0, 0, false, {}});
  const auto claimed_by = [&](std::size_t i) { return static_cast<std::size_t>(found.labels[organised ? scene_.source[i] : i]); };
  for (std::size_t i = 0; i < scene_.size(); ++i) {
    const std::size_t label = claimed_by(i);
    if (label == 0 || label > verdict.planes.size()) continue;
    Judged& judged = verdict.planes[label - 1];
    ++judged.claimed;
    if (distance(judged.plane, scene_.points.data() + 3 * i) <= task_.threshold) ++judged.held;
  }
  std::vector<std::size_t> level(verdict.planes.size(), 0);
  for (std::uint32_t s = 0; s < samples_.size(); ++s) {
    const std::size_t label = claimed_by(samples_[s]);
    if (label == 0 || label > verdict.planes.size()) continue;
    Judged& judged = verdict.planes[label - 1];
    if (distance(judged.plane, scene_.points.data() + std::size_t{3} * samples_[s]) > task_.threshold) continue;
    judged.samples.push_back(s);
    double cosine = 0;
    for (std::size_t c = 0; c < 3; ++c) cosine += judged.plane.normal[c] * static_cast<double>(normals_[s][c]);
    if (std::abs(cosine) >= kLevelCosine) ++level[label - 1];
  }
  for (std::size_t k = 0; k < verdict.planes.size(); ++k) {
    Judged& judged = verdict.planes[k];
    if (!judged.samples.empty()) judged.level = static_cast<double>(level[k]) / static_cast<double>(judged.samples.size());
    judged.counts = judged.claimed >= task_.min_inliers && judged.claimed > 0 &&
                    static_cast<double>(judged.held) >= kLeastHeld * static_cast<double>(judged.claimed) && judged.level >= kLeastLevel;
    if (!judged.counts) continue;
    ++verdict.counted;
    verdict.inliers += judged.held;
  }
  return verdict;
}

bool Judge::covers(const Plane& plane, const std::vector<std::uint32_t>& samples) const {
  std::size_t near = 0;
  for (const std::uint32_t s : samples) {
    if (distance(plane, scene_.points.data() + std::size_t{3} * samples_[s]) <= kMatchThresholds * task_.threshold) ++near;
  }
  return static_cast<double>(near) >= kMatchShare * static_cast<double>(samples.size());
}

bool Judge::has(const Verdict& verdict, const Judged& plane) const {
  return std::any_of(verdict.planes.begin(), verdict.planes.end(),
                     [&](const Judged& other) { return other.counts && covers(other.plane, plane.samples); });
}

void Judge::collect(const Verdict& verdict, const std::string& by, std::vector<Surface>& surfaces) const {
  for (const Judged& judged : verdict.planes) {
    if (!judged.counts) continue;
    const bool known = std::any_of(surfaces.begin(), surfaces.end(), [&](const Surface& surface) {
      return covers(surface.seen.plane, judged.samples) && covers(judged.plane, surface.seen.samples);
    });
    if (!known) surfaces.push_back({judged, by, {}});
  }
}

}  // namespace swarmfit::peers
