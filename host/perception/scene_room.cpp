#include "host/perception/scene_room.hpp"

#include <utility>

namespace swarmfit::perception {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

/// Draws numbers one after another from its own stream of the seed. No call takes two draws as arguments: their order is the compiler's.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t stream) : key_(seed), stream_(stream) {}
  double between(double low, double high) { return low + (high - low) * uniform(key_, stream_, next_++); }
  std::uint32_t below(std::uint32_t n) { return random_bits(key_, stream_, next_++)[0] % n; }
  std::uint64_t seed() {
    const auto bits = random_bits(key_, stream_, next_++);
    return (std::uint64_t{bits[0]} << 32) | bits[1];
  }

 private:
  std::uint64_t key_, stream_, next_ = 0;
};

Colour vivid(Dice& dice) {
  static const Colour colours[] = {{0.72, 0.12, 0.10}, {0.13, 0.28, 0.62}, {0.10, 0.45, 0.22}, {0.85, 0.62, 0.10},
                                   {0.45, 0.16, 0.45}, {0.88, 0.42, 0.12}, {0.10, 0.50, 0.55}, {0.20, 0.20, 0.22}};
  return colours[dice.below(8)] * dice.between(0.85, 1.1);
}

Colour pale(Dice& dice) {
  static const Colour colours[] = {{0.92, 0.90, 0.84}, {0.93, 0.83, 0.45}, {0.78, 0.88, 0.93}, {0.90, 0.93, 0.80}};
  return colours[dice.below(4)];
}

class Furnisher {
 public:
  explicit Furnisher(std::uint64_t seed) : dice_(seed, 100) {}

  Room furnish() {
    build_walls();
    load_table();
    load_boards();
    return std::move(room_);
  }

 private:
  Solid box(const Vector3d& centre, const Vector3d& half, Material material, std::uint16_t support = 0) {
    Solid s;
    s.centre = centre;
    s.half = half;
    s.material = std::move(material);
    s.support = support;
    return s;
  }

  Material surface(Pattern pattern, const Colour& base) {
    Material material;
    material.pattern = pattern;
    material.base = base;
    material.seed = dice_.seed();
    return material;
  }

  Material print(const Colour& base, const Colour& second, const Colour& third) {
    Material material = surface(Pattern::print, base);
    material.second = second;
    material.third = third;
    return material;
  }

  std::uint16_t add_support(double height) {
    room_.support_heights.push_back(height);
    return static_cast<std::uint16_t>(room_.support_heights.size());
  }

  void build_walls() {
    const std::uint16_t floor = add_support(0);
    room_.solids.push_back(box({0, 1, -0.05}, {4, 4, 0.05}, surface(Pattern::planks, {0.46, 0.33, 0.22}), floor));
    const double shade = dice_.between(0.78, 0.9);
    room_.solids.push_back(box({0, 1.75, 1.5}, {4, 0.05, 2}, surface(Pattern::plain, {shade, shade * 0.98, shade * 0.92})));
  }

  void load_table() {
    const double height = dice_.between(0.68, 0.74), left = 0.04, right = 0.86, front = 0.72, back = 1.40;
    const Material wood = surface(Pattern::wood, Colour(0.78, 0.62, 0.43) * dice_.between(0.85, 1.1));
    const std::uint16_t support = add_support(height);
    room_.solids.push_back(
        box({(left + right) / 2, (front + back) / 2, height - 0.0125}, {(right - left) / 2, (back - front) / 2, 0.0125}, wood, support));
    room_.solids.push_back(box({(left + right) / 2, back - 0.03, (height - 0.03) / 2}, {0.05, 0.02, (height - 0.03) / 2}, wood));
    // Five things on a grid of six places, tall ones behind.
    static constexpr int kinds_behind[] = {2, 1, 3}, kinds_before[] = {0, 4, 5, 6};
    const std::uint32_t empty = dice_.below(3), turn = dice_.below(3);
    for (std::uint32_t i = 0; i < 3; ++i) {
      const double x = left + 0.14 + 0.27 * i;
      place(kinds_behind[(i + turn) % 3], {x, back - 0.17, height});
      if (i != empty) place(kinds_before[(i + dice_.below(2)) % 4], {x, front + 0.17, height});
    }
  }

  void load_boards() {
    const double left = -0.86, right = -0.10, front = 1.28, back = 1.68;
    const Material wood = surface(Pattern::wood, Colour(0.86, 0.84, 0.80) * dice_.between(0.9, 1.05));
    for (int layer = 0; layer < 3; ++layer) {
      const double height = 1.12 - 0.31 * layer;
      const std::uint16_t support = add_support(height);
      room_.solids.push_back(
          box({(left + right) / 2, (front + back) / 2, height - 0.01}, {(right - left) / 2, (back - front) / 2, 0.01}, wood, support));
      const std::uint32_t empty = dice_.below(4);
      for (std::uint32_t i = 0; i < 3; ++i) {
        if (i == empty) continue;
        static constexpr int kinds[] = {1, 2, 0, 4, 3, 6};
        place(kinds[(i + 2 * static_cast<std::uint32_t>(layer) + dice_.below(2)) % 6],
              {left + 0.14 + 0.24 * i, (front + back) / 2 - 0.04, height});
      }
    }
  }

  Solid& add(std::uint16_t object, Solid::Shape shape, const Vector3d& centre, const Vector3d& half, Material material) {
    Solid s = box(centre, half, std::move(material));
    s.shape = shape;
    s.object = object;
    room_.solids.push_back(s);
    return room_.solids.back();
  }

  /// Turned by up to about +-20 degrees; the sine and cosine come from the half angle's tangent.
  void turn(Solid& s) {
    const double t = dice_.between(-0.18, 0.18);
    s.cosine = (1 - t * t) / (1 + t * t);
    s.sine = 2 * t / (1 + t * t);
  }

  /// Puts a thing more or less where it is told.
  void place(int kind, const Vector3d& where) {
    const double x = where.x() + dice_.between(-0.025, 0.025), y = where.y() + dice_.between(-0.025, 0.025), z = where.z();
    static constexpr const char* names[] = {"mug", "can", "carton", "ball", "box", "book", "cup"};
    room_.object_names.emplace_back(names[kind]);
    room_.object_supports.push_back(static_cast<std::uint16_t>(room_.support_heights.size()));  // the last one built
    const auto id = static_cast<std::uint16_t>(room_.object_names.size());
    switch (kind) {
      case 0:
      case 6: place_mug(id, x, y, z, kind == 0); break;
      case 1: place_can(id, x, y, z); break;
      case 3: {
        const double r = dice_.between(0.045, 0.06);
        add(id, Solid::Shape::sphere, {x, y, z + r}, Vector3d::Constant(r), surface(Pattern::plain, vivid(dice_)));
        break;
      }
      default: place_box(id, kind, x, y, z);
    }
  }

  void place_mug(std::uint16_t id, double x, double y, double z, bool handle) {
    const double r = dice_.between(0.038, 0.045), h = dice_.between(0.045, 0.055);
    const Material glaze = surface(Pattern::plain, vivid(dice_));
    add(id, Solid::Shape::cylinder, {x, y, z + h}, {r, r, h}, glaze);
    // What is in it: a darker lid just above the rim's inside.
    add(id, Solid::Shape::cylinder, {x, y, z + 2 * h}, {r - 0.004, r - 0.004, 0.0005}, surface(Pattern::plain, {0.16, 0.10, 0.07}));
    if (!handle) return;
    const double side = dice_.below(2) == 0 ? -1 : 1;
    for (const double up : {0.55, 1.45}) add(id, Solid::Shape::box, {x + side * (r + 0.012), y, z + up * h}, {0.015, 0.006, 0.006}, glaze);
    add(id, Solid::Shape::box, {x + side * (r + 0.027), y, z + h}, {0.006, 0.006, 0.45 * h + 0.006}, glaze);
  }

  void place_can(std::uint16_t id, double x, double y, double z) {
    const double r = dice_.between(0.033, 0.042), h = dice_.between(0.055, 0.075);
    const Colour base = vivid(dice_), second = pale(dice_), third = vivid(dice_);
    add(id, Solid::Shape::cylinder, {x, y, z + h}, {r, r, h}, print(base, second, third));
    add(id, Solid::Shape::cylinder, {x, y, z + 2 * h}, {r - 0.002, r - 0.002, 0.001}, surface(Pattern::plain, {0.68, 0.69, 0.70}));
  }

  void place_box(std::uint16_t id, int kind, double x, double y, double z) {
    Vector3d half{dice_.between(0.05, 0.065), dice_.between(0.03, 0.04), dice_.between(0.085, 0.1)};  // a carton
    if (kind == 4) half = {dice_.between(0.05, 0.07), dice_.between(0.04, 0.06), dice_.between(0.035, 0.055)};
    if (kind == 5) half = {dice_.between(0.08, 0.095), dice_.between(0.055, 0.065), dice_.between(0.015, 0.022)};
    Material material = surface(Pattern::plain, vivid(dice_));
    if (kind != 4) {
      const Colour base = pale(dice_), second = vivid(dice_), third = vivid(dice_);
      material = print(base, second, third);
    }
    Solid& s = add(id, Solid::Shape::box, {x, y, z + half.z()}, half, material);
    turn(s);
    if (kind == 2) room_.picture_solids.push_back(room_.solids.size() - 1);
  }

  Dice dice_;
  Room room_;
};

}  // namespace

Room furnish_room(std::uint64_t seed) { return Furnisher(seed).furnish(); }

}  // namespace swarmfit::perception
