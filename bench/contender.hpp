// What each contender for the whole job, "all planes with a label a point", must offer. One file a contender, one factory a file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace swarmfit::peers {

/// A cloud in both of the forms that contenders take.
struct Scene {
  std::string name;
  int width = 0, height = 1;          ///< height > 1: an image grid
  std::vector<float> grid;            ///< xyz of every point, NaN where there is none [data unit]
  std::vector<float> points;          ///< xyz of the finite ones, in the same order
  std::vector<std::uint32_t> source;  ///< where in the grid each of `points` stands

  bool organised() const noexcept { return height > 1; }
  std::size_t size() const noexcept { return source.size(); }
};

/// The same for every contender.
struct Task {
  double threshold = 0.01;      ///< tau [data unit]
  std::size_t min_inliers = 0;  ///< a smaller plane is none
  int threads = 1;
};

/// normal . x + offset = 0, |normal| = 1. Plain numbers: contenders are compiled with their library's own flags.
struct Plane {
  std::array<double, 3> normal{};
  double offset = 0;
};

struct Found {
  std::vector<Plane> planes;
  std::vector<std::uint16_t> labels;  ///< one a point as it was given: 0 none, k the k-th plane
  double normals_ms = 0;              ///< of the run's time, what the points' normals took
  std::size_t evaluations = 0;        ///< hypotheses scored, where the contender tells
};

class Contender {
 public:
  virtual ~Contender() = default;
  virtual std::string name() const = 0;
  /// Its settings, in a line.
  virtual std::string how() const = 0;
  /// Whether it is given the scene's grid instead of its finite points.
  virtual bool organised() const { return false; }
  /// Copies the points to where its library wants them, untimed. Throws std::exception with the reason where it cannot take them.
  virtual void take(const Scene& scene, const Task& task) = 0;
  /// The whole job, timed. Throws std::exception where it fails.
  virtual Found run(std::uint64_t seed) = 0;
};

#define SWARMFIT_CONTENDER(factory) \
  extern "C++" __attribute__((visibility("default"))) std::unique_ptr<::swarmfit::peers::Contender> factory()

}  // namespace swarmfit::peers
