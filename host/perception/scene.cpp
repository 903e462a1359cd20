// The synthetic room seen by a depth camera.
#include <swarmfit/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "host/common/parallel.hpp"
#include "host/perception/scene_room.hpp"

namespace swarmfit {
namespace {

using Eigen::Vector3d;
using perception::Colour;
using perception::Hit;
using perception::Ray;
using perception::Room;
using perception::Solid;

// The tangent of 15 degrees: the camera looks down by 30.
constexpr double kHalfTilt = 0.2679491924311227;
constexpr double kCosTilt = (1 - kHalfTilt * kHalfTilt) / (1 + kHalfTilt * kHalfTilt);
constexpr double kSinTilt = 2 * kHalfTilt / (1 + kHalfTilt * kHalfTilt);
const Vector3d kLamp(-0.9, 0.1, 2.7);
constexpr int kRowsAtOnce = 8;            // that one thread looks at
constexpr double kBaseline = 0.075;       // [m] between the depth camera's projector and its eye
constexpr double kDisparityStep = 0.125;  // [px at 640 columns] what the sensor can tell apart

// Streams of random numbers.
enum : std::uint64_t { kDepthNoise = 1, kColourNoise, kHoles, kPatches };

struct Pixel {
  double depth = std::numeric_limits<double>::infinity();  ///< true z in the camera's frame [m]
  double slant = 0;                                        ///< cosine between ray and normal
  Colour colour = Colour::Zero();
  std::uint16_t object = 0, plane = 0;
};

class Camera {
 public:
  Camera(const Room& room, std::uint64_t seed, int width, int height, const SceneCamera& place)
      : room_(room),
        seed_(seed),
        noise_seed_(seed ^ (place.exposure * 0x9E3779B97F4A7C15ULL)),
        width_(width),
        height_(height),
        eye_(place.eye),
        cos_pan_((1 - place.pan * place.pan) / (1 + place.pan * place.pan)),
        sin_pan_(2 * place.pan / (1 + place.pan * place.pan)) {
    intrinsics_ = {525.0 * width / 640, 525.0 * width / 640, (width - 1) / 2.0, (height - 1) / 2.0};
  }

  Scene shoot() {
    trace();
    Scene scene;
    scene.cloud.width = width_;
    scene.cloud.height = height_;
    scene.cloud.intrinsics = intrinsics_;
    const std::vector<std::uint16_t> number = write_truth(scene.truth);
    write_colours(scene.cloud);
    write_points(scene.cloud);
    for (std::size_t k = 0; k < room_.picture_solids.size(); ++k) {
      scene.pictures.push_back(take_picture(k));
      scene.pictures.back().object = number[scene.pictures.back().object];
    }
    return scene;
  }

 private:
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }
  Vector3d bearing(double u, double v) const { return {(u - intrinsics_.cx) / intrinsics_.fx, (v - intrinsics_.cy) / intrinsics_.fy, 1}; }

  /// Camera (x right, y down, z forward) to world.
  Vector3d to_world(const Vector3d& v) const {
    const Vector3d w(v.x(), kCosTilt * v.z() - kSinTilt * v.y(), -kCosTilt * v.y() - kSinTilt * v.z());
    return {cos_pan_ * w.x() - sin_pan_ * w.y(), sin_pan_ * w.x() + cos_pan_ * w.y(), w.z()};
  }

  void trace() {
    pixels_.resize(index(0, height_));
    common::in_parallel(height_, kRowsAtOnce, 0, [this](int first, int last) {
      for (int v = first; v < last; ++v)
        for (int u = 0; u < width_; ++u) pixels_[index(u, v)] = look(u, v);
    });
  }

  Pixel look(int u, int v) const {
    const Ray ray{eye_, to_world(bearing(u, v))};
    Pixel pixel;
    const Solid* nearest = nullptr;
    Hit hit;
    for (const Solid& solid : room_.solids)
      if (const auto h = meet(solid, ray); h && h->distance < pixel.depth) {
        nearest = &solid;
        hit = *h;
        pixel.depth = h->distance;
      }
    if (nearest == nullptr) return pixel;
    pixel.object = nearest->object;
    pixel.plane = hit.normal.z() > 0.99 ? nearest->support : std::uint16_t{0};
    pixel.slant = -hit.normal.dot(ray.direction) / ray.direction.norm();
    pixel.colour = surface_colour(*nearest, hit, u, v) * light(hit, ray.origin + hit.distance * ray.direction, nearest);
    return pixel;
  }

  /// Prints are finer than a pixel: the mean of four looks within it, where they meet the same solid.
  Colour surface_colour(const Solid& solid, const Hit& hit, int u, int v) const {
    const Colour centre = paint(solid.material, hit.where, hit.extent);
    if (solid.material.pattern == perception::Material::Pattern::plain) return centre;
    Colour sum = Colour::Zero();
    for (const double du : {-0.25, 0.25})
      for (const double dv : {-0.25, 0.25}) {
        const auto h = meet(solid, {eye_, to_world(bearing(u + du, v + dv))});
        sum += h ? paint(solid.material, h->where, h->extent) : centre;
      }
    return sum / 4;
  }

  /// Ambient light, a lamp, and the shadow that something between throws.
  double light(const Hit& hit, const Vector3d& at, const Solid* self) const {
    const Vector3d to_lamp = kLamp - at;
    double lamp = 0.62 * std::max(0.0, hit.normal.dot(to_lamp) / to_lamp.norm());
    const Ray ray{at + 0.002 * hit.normal, to_lamp};
    for (const Solid& solid : room_.solids)
      if (&solid != self)
        if (const auto h = meet(solid, ray); h && h->distance < 1) {
          lamp *= 0.45;
          break;
        }
    // What faces the camera's window is never black.
    return 0.42 + 0.12 * std::max(0.0, -hit.normal.y()) + lamp;
  }

  /// Returns each thing's number in the truth, 0 for what can hardly be seen.
  std::vector<std::uint16_t> write_truth(SceneTruth& truth) const {
    for (const double z : room_.support_heights) {
      // World z is -cos tilt * y - sin tilt * z of the camera, plus the eye's height.
      truth.planes.emplace_back(0, -kCosTilt, -kSinTilt, eye_.z() - z);
    }
    std::vector<std::size_t> seen(room_.object_names.size() + 1);
    for (const Pixel& p : pixels_) ++seen[p.object];
    std::vector<std::uint16_t> number(seen.size());
    for (std::size_t k = 1; k < seen.size(); ++k) {
      if (seen[k] * 1500 < pixels_.size()) continue;
      truth.object_names.push_back(room_.object_names[k - 1]);
      truth.object_planes.push_back(room_.object_supports[k - 1]);
      truth.object_ids.push_back(static_cast<std::uint16_t>(k));
      number[k] = static_cast<std::uint16_t>(truth.object_names.size());
    }
    truth.objects = truth.object_names.size();
    truth.plane_labels.reserve(pixels_.size());
    truth.object_labels.reserve(pixels_.size());
    for (const Pixel& p : pixels_) {
      truth.plane_labels.push_back(p.plane);
      truth.object_labels.push_back(number[p.object]);
    }
    return number;
  }

  /// The lens blurs a little (1 2 1 both ways), the sensor adds noise.
  void write_colours(Cloud& cloud) const {
    cloud.rgb.resize(3 * pixels_.size());
    const int reach[] = {-1, 0, 1};
    const double weight[] = {0.15, 0.7, 0.15};
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u) {
        Colour sum = Colour::Zero();
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            sum += weight[i] * weight[j] *
                   pixels_[index(std::clamp(u + reach[i], 0, width_ - 1), std::clamp(v + reach[j], 0, height_ - 1))].colour;
        const auto bits = perception::random_bits(noise_seed_, kColourNoise, index(u, v));
        for (int c = 0; c < 3; ++c) {
          const std::uint32_t word = bits[static_cast<std::size_t>(c)];
          const double noise = ((word & 0xFFFF) + (word >> 16)) * 0x1p-16 - 1;  // triangular
          cloud.rgb[3 * index(u, v) + static_cast<std::size_t>(c)] =
              static_cast<std::uint8_t>(std::clamp(255 * sum[c] + 5 * noise + 0.5, 0.0, 255.0));
        }
      }
  }

  /// Near to normal, of variance 1: eight uniforms, each 16 bits of one draw.
  double gauss(std::size_t i) const {
    double sum = -4;
    for (const std::uint32_t word : perception::random_bits(noise_seed_, kDepthNoise, i)) sum += ((word & 0xFFFF) + (word >> 16)) * 0x1p-16;
    return sum * 1.224744871391589;  // sqrt(12 / 8)
  }

  void write_points(Cloud& cloud) const {
    cloud.values32.assign(3 * pixels_.size(), std::numeric_limits<float>::quiet_NaN());
    const std::vector<bool> blind = blind_patches();
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u) {
        const std::size_t i = index(u, v);
        const Pixel& p = pixels_[i];
        if (blind[i] || !(p.depth < 4) || hidden(u, v)) continue;
        const double noisy = p.depth + (0.0012 + 0.0019 * (p.depth - 0.4) * (p.depth - 0.4)) * gauss(i);
        const double z = quantise(noisy);
        const Vector3d point = z * bearing(u, v);
        for (int c = 0; c < 3; ++c) cloud.values32[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(point[c]);
      }
  }

  static double quantise(double z) {
    const double scale = 525 * kBaseline / kDisparityStep;
    return scale / std::floor(scale / z + 0.5);
  }

  /// No depth in a near thing's shadow from the projector, at edges, on what is seen too flat, and now and then.
  bool hidden(int u, int v) const {
    const double here = pixels_[index(u, v)].depth;
    const auto depth_at = [&](int x, int y) { return pixels_[index(std::clamp(x, 0, width_ - 1), std::clamp(y, 0, height_ - 1))].depth; };
    const double shift = intrinsics_.fx * kBaseline;
    for (int k = 1; k * 640 <= 20 * width_; ++k)
      if (shift * (1 / depth_at(u + k, v) - 1 / here) > k) return true;
    double jump = 0;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
      jump = std::max(jump, std::abs(depth_at(u + dx, v + dy) - here));
    const double slant = pixels_[index(u, v)].slant;
    const double chance = jump > 0.03 ? 0.6 : (slant < 0.12 ? 0.5 : 0.002);
    return perception::uniform(noise_seed_, kHoles, index(u, v)) < chance;
  }

  /// Gloss: a few blobs of the image return nothing.
  std::vector<bool> blind_patches() const {
    std::vector<bool> blind(pixels_.size());
    for (std::uint64_t k = 0; k < 6; ++k) {
      const auto bits = perception::random_bits(seed_, kPatches, k);
      const double cu = width_ * (bits[0] * 0x1p-32), cv = height_ * (0.1 + 0.85 * (bits[1] * 0x1p-32));
      const double ru = width_ * (0.008 + 0.022 * (bits[2] * 0x1p-32)), rv = width_ * (0.006 + 0.014 * (bits[3] * 0x1p-32));
      for (int v = std::max(0, static_cast<int>(cv - rv)); v < std::min<double>(height_, cv + rv); ++v)
        for (int u = std::max(0, static_cast<int>(cu - ru)); u < std::min<double>(width_, cu + ru); ++u) {
          const double x = (u - cu) / ru, y = (v - cv) / rv;
          if (x * x + y * y < 1) blind[index(u, v)] = true;
        }
    }
    return blind;
  }

  /// The print of a carton seen straight on, two pixels a millimetre.
  ScenePicture take_picture(std::size_t k) const {
    const Solid& solid = room_.solids[room_.picture_solids[k]];
    ScenePicture picture;
    picture.name = "carton" + std::to_string(k + 1);
    picture.object = solid.object;
    picture.width = static_cast<int>(4000 * solid.half.x());
    picture.height = static_cast<int>(4000 * solid.half.z());
    const Eigen::Vector2d extent(2 * solid.half.x(), 2 * solid.half.z());
    for (int v = 0; v < picture.height; ++v)
      for (int u = 0; u < picture.width; ++u) {
        const Colour colour = paint(
            solid.material, {(u + 0.5) / picture.width * extent.x(), (picture.height - v - 0.5) / picture.height * extent.y()}, extent);
        for (int c = 0; c < 3; ++c) picture.rgb.push_back(static_cast<std::uint8_t>(std::clamp(230 * colour[c] + 0.5, 0.0, 255.0)));
      }
    return picture;
  }

  const Room& room_;
  std::uint64_t seed_, noise_seed_;
  int width_, height_;
  Vector3d eye_;
  double cos_pan_, sin_pan_;
  Intrinsics intrinsics_;
  std::vector<Pixel> pixels_;
};

}  // namespace

Scene make_room_scene(std::uint64_t seed, int width, int height) { return make_room_scene(seed, width, height, SceneCamera{}); }

Scene make_room_scene(std::uint64_t seed, int width, int height, const SceneCamera& camera) {
  const Room room = perception::furnish_room(seed);
  return Camera(room, seed, std::max(width, 1), std::max(height, 1), camera).shoot();
}

SceneCamera walk_in_room(std::size_t k, std::size_t frames) {
  // A sine's shape from parabolas, of period 1.
  const auto wave = [](double t) {
    t -= std::floor(t);
    return t < 0.5 ? 16 * t * (0.5 - t) : -16 * (t - 0.5) * (1 - t);
  };
  const double t = static_cast<double>(k) / static_cast<double>(std::max<std::size_t>(frames, 1));
  SceneCamera camera;
  camera.eye = {0.22 * wave(t), 0.08 * wave(2 * t), 1.5 + 0.04 * wave(3 * t)};
  camera.pan = 0.05 * wave(t);
  camera.exposure = k;
  return camera;
}

}  // namespace swarmfit
