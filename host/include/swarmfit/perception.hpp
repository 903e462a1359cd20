// From a frame to named objects: supporting planes, what pops out of them, its outline, its name.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/fit.hpp>

namespace swarmfit {

/// How outlines are found in the image.
enum class Segmentation {
  graphcut,  ///< labels for pixels: object, background, uncertain; as FitOptions::preset has it
  fixation   ///< a closed contour around each space of interest's centre, after Mishra, Aloimonos and Cheong 2009
};

struct PerceiveOptions {
  FitOptions fit;                          ///< how planes are found; model is plane, without rivals and noise; prior is set by perception
  std::optional<Eigen::Vector3d> gravity;  ///< direction of gravity in the cloud's frame; length does not matter, not zero
  std::optional<double>
      camera_tilt;  ///< [rad] the camera looks down by this much below the horizon, in [-pi/2, pi/2]; x right, y down, z forward
  double horizontal_angle = 0.20;    ///< [rad] a supporting plane's normal is within this of the vertical, in (0, pi/2)
  double min_plane_share = 0.005;    ///< of the finite points a plane of reasonable size holds, in (0, 1)
  double min_height = 0.008;         ///< [m] a point sticks out when it is at least this far above its plane
  double max_height = 1.0;           ///< [m] and at most this far
  double flood_step = 0.02;          ///< [m] neighbours in the flood fill are at most this far apart
  std::size_t min_soi_points = 300;  ///< smaller groups are debris (for a 640 x 480 frame; scaled by the image's size)
  double soi_margin = 1.15;          ///< the bounding sphere is larger than the group by this factor, >= 1
  Segmentation segmentation = Segmentation::graphcut;
  int colour_neighbours = 0;      ///< K of the colour cost, >= 0; 0 takes it from the sample's size
  double uncertain_cost = 0;      ///< fixed cost of the third label, in (0, 1); 0: the default of the preset
  double smoothness = 0;          ///< weight of the boundary term, > 0; 0: the default of the preset
  std::filesystem::path gallery;  ///< folder: one image, or a folder of images, a name; empty: no recognition
  bool track = false;             ///< frames follow each other: the last one's planes seed the search, planes and SOIs keep their ids

  /// Fails with invalid_option, naming the field, its value and its bound.
  SWARMFIT_API Expected<> validate() const;
};

struct Recognition {
  std::string name;
  std::size_t inliers = 0;  ///< matches that agree with one homography or similarity
  double score = 0;         ///< in [0, 1]
};

/// A space of interest: a group of points above a supporting plane and the sphere around it.
struct SpaceOfInterest {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m]
  double radius = 0;                                 ///< [m], slightly larger than the group
  std::size_t points = 0;
  int plane = 0;                        ///< 1-based index into models
  std::array<int, 4> bbox{};            ///< x, y, width, height [px]; zeros without an image grid
  std::vector<Recognition> recognised;  ///< best first
  std::uint64_t id = 0;                 ///< with PerceiveOptions::track: 1, 2 ..., the same thing over frames, never given twice; else 0
};

/// Label in `objects` for pixels where neither object nor background is likely.
inline constexpr std::uint16_t kUncertain = 65535;

struct PerceiveResult {
  FitResult fit;                                 ///< models (planes) and labels; supporting ones are marked
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< the vertical used, against gravity
  std::string vertical_source;                   ///< "gravity", "camera tilt", "dominant plane"
  std::vector<SpaceOfInterest> sois;
  std::vector<std::uint16_t> popout;   ///< one a point: 0, or k for the k-th SOI
  std::vector<std::uint16_t> objects;  ///< one a pixel: 0 background, k the k-th proto-object, kUncertain; empty without an image grid
  struct Timing {
    double total = 0, load = 0, fit = 0, popout = 0, segment = 0, recognise = 0;
  } timing_ms;  ///< total leaves out loading and writing files
};

/// Holds the back end, the gallery and the vertical of the first view, and with PerceiveOptions::track what was seen; reuse it over frames.
class SWARMFIT_API Perceiver {
 public:
  /// Fails with invalid_option, backend_unavailable, bad_input (a gallery that cannot be read) or out_of_memory.
  static Expected<Perceiver> create(const PerceiveOptions& options);
  ~Perceiver();
  Perceiver(Perceiver&&) noexcept;
  Perceiver& operator=(Perceiver&&) noexcept;

  /// An organised coloured cloud goes through the whole chain; without colour or grid the stages that need them are left
  /// out. `on_plane` is told of planes as they are found; the result has them refined on all points, joined and chosen. Fails with
  /// bad_input (Cloud::validate(), another dimension than 3, fewer than 3 finite points, a coordinate beyond 1e18), backend_unavailable or
  /// out_of_memory.
  Expected<PerceiveResult> perceive(const Cloud& frame, const ModelCallback& on_plane = {}, std::stop_token stop = {});

  /// Told of each step of the swarms that look for level planes; empty: nobody is.
  void observe(SwarmObserver observer);

 private:
  struct State;
  explicit Perceiver(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace swarmfit
