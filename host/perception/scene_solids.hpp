// Solids of a synthetic scene and the rays that meet them. World frame: x right, y away from the camera, z up [m].
//
// Everything here and in scene.cpp keeps to +, -, *, / and square roots, which IEEE 754 fixes to the last bit, so that a seed gives the
// same scene on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace swarmfit::perception {

using Colour = Eigen::Vector3d;  ///< red, green, blue in [0, 1], as displayed

/// How a surface looks.
struct Material {
  enum class Pattern {
    plain,   ///< one colour, a little uneven
    wood,    ///< grain along the surface's first axis
    planks,  ///< a floor of boards
    print,   ///< a packaging's front: bands, a roundel, lines of glyphs
  };
  Pattern pattern = Pattern::plain;
  Colour base = Colour::Constant(0.5);
  Colour second = Colour::Constant(0.2);
  Colour third = Colour::Constant(0.9);
  std::uint64_t seed = 0;
};

struct Solid {
  enum class Shape { box, cylinder, sphere };
  Shape shape = Shape::box;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< box: half sizes; cylinder: radius, radius, half height; sphere: radius thrice
  double cosine = 1, sine = 0;                     ///< of the box's turn about z
  Material material;
  std::uint16_t object = 0;   ///< truth: 0, or the k-th object
  std::uint16_t support = 0;  ///< truth of its upper face: 0, or the k-th supporting surface
};

struct Ray {
  Eigen::Vector3d origin, direction;  ///< the direction need not be a unit vector
};

struct Hit {
  double distance = 0;     ///< along the ray, in lengths of its direction
  Eigen::Vector3d normal;  ///< unit, world frame
  Eigen::Vector2d where;   ///< on the surface [m]
  Eigen::Vector2d extent;  ///< of that surface [m]; `where` is in [0, extent]
};

std::optional<Hit> meet(const Solid& solid, const Ray& ray);

/// Colour of the material at a place on a surface, unlit.
Colour paint(const Material& material, const Eigen::Vector2d& where, const Eigen::Vector2d& extent);

/// 32 random bits for a key and two counters (Philox 4x32-10): the same on every machine and in every order.
std::array<std::uint32_t, 4> random_bits(std::uint64_t key, std::uint64_t a, std::uint64_t b);
/// Uniform in [0, 1).
double uniform(std::uint64_t key, std::uint64_t a, std::uint64_t b);

}  // namespace swarmfit::perception
