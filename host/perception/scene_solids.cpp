#include "host/perception/scene_solids.hpp"

#include <algorithm>
#include <cmath>

#include <Random123/philox.h>

namespace swarmfit::perception {
namespace {

/// World to the box's own frame: a turn about z.
Eigen::Vector3d turn(const Eigen::Vector3d& v, double cosine, double sine) {
  return {cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x(), v.z()};
}

std::optional<Hit> meet_box(const Solid& solid, const Ray& ray) {
  const Eigen::Vector3d o = turn(ray.origin - solid.centre, solid.cosine, solid.sine);
  const Eigen::Vector3d d = turn(ray.direction, solid.cosine, solid.sine);
  double enter = 0, leave = 1e9;
  int face = -1;
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0) {
      if (std::abs(o[i]) > solid.half[i]) return std::nullopt;
      continue;
    }
    double first = (-solid.half[i] - o[i]) / d[i], second = (solid.half[i] - o[i]) / d[i];
    if (first > second) std::swap(first, second);
    if (first > enter) {
      enter = first;
      face = i;
    }
    leave = std::min(leave, second);
    if (enter > leave) return std::nullopt;
  }
  if (face < 0) return std::nullopt;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[face] = d[face] > 0 ? -1 : 1;
  const Eigen::Vector3d at = o + enter * d;
  // Sides are painted upright: the second coordinate runs along z.
  const int u = face == 0 ? 1 : 0, v = face == 2 ? 1 : 2;
  return Hit{enter,
             turn(normal, solid.cosine, -solid.sine),
             {at[u] + solid.half[u], at[v] + solid.half[v]},
             {2 * solid.half[u], 2 * solid.half[v]}};
}

/// A stand-in for the angle of (x, y) in [0, 4) that needs no trigonometry.
double diamond_angle(double x, double y) {
  const double p = y / (std::abs(x) + std::abs(y));
  return x < 0 ? 2 - p : (y < 0 ? 4 + p : p);
}

std::optional<Hit> meet_cylinder(const Solid& solid, const Ray& ray) {
  const Eigen::Vector3d o = ray.origin - solid.centre;
  const Eigen::Vector3d& d = ray.direction;
  const double radius = solid.half.x(), height = solid.half.z();
  if (d.z() < 0) {  // the lid, seen from above
    const double t = (height - o.z()) / d.z();
    const Eigen::Vector3d at = o + t * d;
    if (t > 0 && at.x() * at.x() + at.y() * at.y() <= radius * radius)
      return Hit{t, Eigen::Vector3d::UnitZ(), {at.x() + radius, at.y() + radius}, {2 * radius, 2 * radius}};
  }
  const double a = d.x() * d.x() + d.y() * d.y(), b = o.x() * d.x() + o.y() * d.y();
  const double root = b * b - a * (o.x() * o.x() + o.y() * o.y() - radius * radius);
  if (root < 0 || a == 0) return std::nullopt;
  const double t = (-b - std::sqrt(root)) / a;
  const Eigen::Vector3d at = o + t * d;
  if (t <= 0 || std::abs(at.z()) > height) return std::nullopt;
  const double around = 6.283185307179586 * radius;
  return Hit{t, {at.x() / radius, at.y() / radius, 0}, {diamond_angle(at.x(), at.y()) / 4 * around, at.z() + height}, {around, 2 * height}};
}

std::optional<Hit> meet_sphere(const Solid& solid, const Ray& ray) {
  const Eigen::Vector3d o = ray.origin - solid.centre;
  const double radius = solid.half.x(), a = ray.direction.squaredNorm(), b = o.dot(ray.direction);
  const double root = b * b - a * (o.squaredNorm() - radius * radius);
  if (root < 0) return std::nullopt;
  const double t = (-b - std::sqrt(root)) / a;
  if (t <= 0) return std::nullopt;
  const Eigen::Vector3d at = o + t * ray.direction;
  const double around = 6.283185307179586 * radius;
  return Hit{t, at / radius, {diamond_angle(at.x(), at.y()) / 4 * around, at.z() + radius}, {around, 2 * radius}};
}

/// Whole cells are handed to random_bits as unsigned counters.
std::uint64_t cell(double x) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x))); }

/// Smooth random field in [-1, 1], cells of size 1.
double value_noise(std::uint64_t key, double x, double y) {
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const double sx = fx * fx * (3 - 2 * fx), sy = fy * fy * (3 - 2 * fy);
  const auto corner = [&](int i, int j) {
    return uniform(key, cell(x) + static_cast<std::uint64_t>(i), cell(y) + static_cast<std::uint64_t>(j));
  };
  const double low = corner(0, 0) + sx * (corner(1, 0) - corner(0, 0)), high = corner(0, 1) + sx * (corner(1, 1) - corner(0, 1));
  return 2 * (low + sy * (high - low)) - 1;
}

/// One line of glyphs: 3 x 5 dots each, drawn at random, with a gap to the next.
bool glyph(std::uint64_t key, std::uint64_t line, double x, double y, double dot) {
  const double column = x / (4 * dot);
  const auto letter = random_bits(key, line, cell(column))[0];
  if (letter % 8 == 0) return false;  // a space between words
  const int i = static_cast<int>((column - std::floor(column)) * 4), j = static_cast<int>(y / dot);
  return i < 3 && j >= 0 && j < 5 && ((letter >> (3 + 3 * j + i)) & 1U) != 0;
}

Colour paint_print(const Material& m, const Eigen::Vector2d& where, const Eigen::Vector2d& extent) {
  const double x = where.x(), y = where.y(), w = extent.x(), h = extent.y();
  const double band = h * (0.25 + 0.15 * uniform(m.seed, 1, 0)), slope = 0.6 * uniform(m.seed, 2, 0) - 0.3;
  Colour colour = y < band + slope * (x - w / 2) ? m.second : m.base;
  const double size = std::min(w, h) * (0.22 + 0.08 * uniform(m.seed, 3, 0));
  const Eigen::Vector2d centre(w * (0.35 + 0.3 * uniform(m.seed, 4, 0)), h * (0.52 + 0.1 * uniform(m.seed, 5, 0)));
  const Eigen::Vector2d from = where - centre;
  if (from.squaredNorm() < size * size) {
    colour = m.third;
    // Four quarters of the roundel, some dark: a strong corner at every scale.
    if ((from.x() < 0) != (from.y() < 0)) colour = from.squaredNorm() < size * size * 0.55 ? m.second : m.third;
  }
  const auto line = [&](std::uint64_t k, double bottom, double dot, const Colour& ink) {
    if (x > 0.06 * w && x < 0.94 * w && y >= bottom && y < bottom + 5 * dot && glyph(m.seed, k, x, y - bottom, dot)) colour = ink;
  };
  line(10, 0.80 * h, h * 0.028, m.second);  // the name, large
  line(11, 0.05 * h, h * 0.013, m.base);    // small print
  line(12, 0.15 * h, h * 0.013, m.third);
  line(13, 0.28 * h, h * 0.018, m.third);
  return colour;
}

}  // namespace

std::array<std::uint32_t, 4> random_bits(std::uint64_t key, std::uint64_t a, std::uint64_t b) {
  const r123::Philox4x32::ctr_type counter{{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a >> 32),
                                            static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(b >> 32)}};
  const r123::Philox4x32::key_type k{{static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)}};
  const auto out = r123::Philox4x32()(counter, k);
  return {out[0], out[1], out[2], out[3]};
}

double uniform(std::uint64_t key, std::uint64_t a, std::uint64_t b) { return random_bits(key, a, b)[0] * 0x1p-32; }

std::optional<Hit> meet(const Solid& solid, const Ray& ray) {
  // A cheap ball around the solid settles most rays.
  const Eigen::Vector3d o = ray.origin - solid.centre;
  const double b = o.dot(ray.direction), c = o.squaredNorm() - solid.half.squaredNorm();
  if (c > 0 && b * b < ray.direction.squaredNorm() * c) return std::nullopt;
  switch (solid.shape) {
    case Solid::Shape::box: return meet_box(solid, ray);
    case Solid::Shape::cylinder: return meet_cylinder(solid, ray);
    case Solid::Shape::sphere: return meet_sphere(solid, ray);
  }
  return std::nullopt;
}

Colour paint(const Material& material, const Eigen::Vector2d& where, const Eigen::Vector2d& extent) {
  const Eigen::Vector2d cm = 100 * where;
  switch (material.pattern) {
    case Material::Pattern::plain: return material.base * (1 + 0.03 * value_noise(material.seed, cm.x() / 2, cm.y() / 2));
    case Material::Pattern::wood: {
      const double grain =
          value_noise(material.seed, cm.x() / 12, cm.y() / 0.7) + 0.6 * value_noise(material.seed + 1, cm.x() / 30, cm.y() / 2.5);
      return material.base * (1 + 0.07 * grain);
    }
    case Material::Pattern::planks: {
      const double row = cm.y() / 9, column = cm.x() / 70 + uniform(material.seed, cell(row), 7);
      const bool gap = (row - std::floor(row)) < 0.03 || (column - std::floor(column)) < 0.005;
      const double tone =
          0.16 * (uniform(material.seed, cell(row), cell(column)) - 0.5) + 0.08 * value_noise(material.seed, cm.x() / 15, cm.y() / 0.9);
      return material.base * (gap ? 0.55 : 1 + tone);
    }
    case Material::Pattern::print: return paint_print(material, where, extent);
  }
  return material.base;
}

}  // namespace swarmfit::perception
