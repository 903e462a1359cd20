// The same check for every contender: does a plane hold the points it claims, is it a surface, and who else has it?
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/contender.hpp"

namespace swarmfit::peers {

/// A plane counts when it claims enough points, when enough of these are within the threshold of it, and when it is a surface: when at
/// most of those the cloud, looked at closely, lies as the plane does.
inline constexpr double kLeastHeld = 0.8;       ///< share of the claimed points within the threshold of the plane
inline constexpr double kLeastLevel = 0.5;      ///< share of the held points whose neighbourhood's normal agrees
inline constexpr double kLevelCosine = 0.9063;  ///< within 25 degrees
/// Two planes are one when most of the points of each are near the other.
inline constexpr double kMatchThresholds = 2;  ///< how near, in thresholds
inline constexpr double kMatchShare = 0.5;     ///< how many

struct Judged {
  Plane plane;
  std::size_t claimed = 0, held = 0;
  double level = 0;  ///< share of the held points whose neighbourhood lies as the plane does
  bool counts = false;
  std::vector<std::uint32_t> samples;  ///< those of the judge's samples that it holds
};

struct Verdict {
  std::vector<Judged> planes;
  std::size_t counted = 0;
  std::size_t inliers = 0;  ///< points held by planes that count
};

/// A plane that some contender found and that counts.
struct Surface {
  Judged seen;  ///< as it was first found
  std::string by;
  std::map<std::string, int> runs;  ///< in how many runs each contender had it
};

class Judge {
 public:
  Judge(const Scene& scene, const Task& task);

  Verdict judge(const Found& found, bool organised) const;
  /// Whether one of the planes that count has this one, too.
  bool has(const Verdict& verdict, const Judged& plane) const;
  /// Adds what is new of a verdict to the surfaces.
  void collect(const Verdict& verdict, const std::string& by, std::vector<Surface>& surfaces) const;

 private:
  bool covers(const Plane& plane, const std::vector<std::uint32_t>& samples) const;
  void estimate_normals();

  const Scene& scene_;
  Task task_;
  std::vector<std::uint32_t> samples_;         ///< points whose neighbourhoods are known
  std::vector<std::array<float, 3>> normals_;  ///< one a sample
};

}  // namespace swarmfit::peers
