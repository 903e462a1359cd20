// Clouds and swarms for the conformance tests, of every kind. Made in a unit frame, a cube of half width 1 about the origin, then moved.
#include <algorithm>
#include <array>

#include "conformance.hpp"
#include "kernels/checks.hpp"

namespace swarmfit::kernels::conformance {
namespace {

using Parameters = std::array<double, kMaxParameters>;
using Point = std::array<double, kMaxDimension>;
using Matrix = std::array<double, 9>;

std::size_t parameter_count(ModelKind kind) { return static_cast<std::size_t>(traits(kind).parameter_count); }
std::size_t dimension_of(ModelKind kind) { return static_cast<std::size_t>(traits(kind).dimension); }

/// The model that most points of make_cloud follow, in the unit frame.
Parameters true_model(ModelKind kind) {
  switch (kind) {
    case ModelKind::line2d: return {0.6, 0.8, 0};
    case ModelKind::plane: return {2.0 / 7, 3.0 / 7, 6.0 / 7, 0};
    case ModelKind::circle2d: return {0.1, -0.2, 0.6};
    case ModelKind::sphere: return {0.1, -0.2, 0.15, 0.6};
    case ModelKind::cylinder: return {0.1, -0.2, 0.15, 2.0 / 7, 3.0 / 7, 6.0 / 7, 0.5};
    case ModelKind::homography: return {1.02, 0.05, 0.1, -0.04, 0.97, -0.05, 0.05, -0.03, 1};
    case ModelKind::own:
    case ModelKind::fundamental: break;
  }
  return {0.02, -0.3, 0.2, 0.28, 0.03, -1, -0.19, 0.98, 0.05};  // epipoles well outside the images
}

/// The first and the number of those parameters that are a unit vector.
std::pair<std::size_t, std::size_t> unit_vector(ModelKind kind) {
  if (kind == ModelKind::line2d) return {0, 2};
  if (kind == ModelKind::plane) return {0, 3};
  if (kind == ModelKind::cylinder) return {3, 3};
  return {0, 0};
}

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 9; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[i] += a[i / 3 * 3 + j] * b[3 * j + i % 3];
  }
  return out;
}

/// From the unit frame to the data's.
void to_data(ModelKind kind, double middle, double size, Parameters& p) {
  const std::size_t last = parameter_count(kind) - 1;
  const std::size_t width = dimension_of(kind);
  if (kind == ModelKind::line2d || kind == ModelKind::plane) {
    p[last] *= size;
    for (std::size_t d = 0; d < width; ++d) p[last] -= p[d] * middle;
  } else if (width <= 3) {
    for (std::size_t d = 0; d < width; ++d) p[d] = middle + size * p[d];
    p[last] *= size;
  } else {
    const Matrix there{size, 0, middle, 0, size, middle, 0, 0, 1}, back{1 / size, 0, -middle / size, 0, 1 / size, -middle / size, 0, 0, 1};
    const Matrix back_transposed{1 / size, 0, 0, 0, 1 / size, 0, -middle / size, -middle / size, 1};
    p = product(product(kind == ModelKind::homography ? there : back_transposed, p), back);
  }
}

/// Moves a point along the straightest way to where it is `off` away from a surface, or a pair's second point off its partner's image.
void pull(ModelKind kind, const Parameters& p, double off, Point& x) {
  const std::size_t width = dimension_of(kind);
  if (kind == ModelKind::homography) {
    const double w = p[6] * x[0] + p[7] * x[1] + p[8];
    x[2] = (p[0] * x[0] + p[1] * x[1] + p[2]) / w + off;
    x[3] = (p[3] * x[0] + p[4] * x[1] + p[5]) / w - off;
    return;
  }
  Point away{};  // unit, from the model to x
  double distance = -off;
  if (kind == ModelKind::fundamental) {
    for (std::size_t r = 0; r < 2; ++r) away[2 + r] = p[3 * r] * x[0] + p[3 * r + 1] * x[1] + p[3 * r + 2];
    const double length = std::hypot(away[2], away[3]);
    for (std::size_t r = 2; r < 4; ++r) distance += (away[r] /= length) * x[r];
    distance += (p[6] * x[0] + p[7] * x[1] + p[8]) / length;
  } else if (kind == ModelKind::line2d || kind == ModelKind::plane) {
    for (std::size_t d = 0; d < width; ++d) distance += (away[d] = p[d]) * x[d];
    distance += p[width];
  } else {
    double along = 0, length = 0;
    for (std::size_t d = 0; d < width; ++d) away[d] = x[d] - p[d];
    for (std::size_t d = 0; kind == ModelKind::cylinder && d < 3; ++d) along += away[d] * p[3 + d];
    for (std::size_t d = 0; kind == ModelKind::cylinder && d < 3; ++d) away[d] -= along * p[3 + d];
    for (std::size_t d = 0; d < width; ++d) length = std::hypot(length, away[d]);
    for (std::size_t d = 0; d < width; ++d) away[d] /= length;
    distance += length - p[parameter_count(kind) - 1];
  }
  for (std::size_t d = 0; d < width; ++d) x[d] -= distance * away[d];
}

}  // namespace

PointsView Cloud::view() const {
  const auto columns = static_cast<std::size_t>(dimension);
  if (!narrow.empty()) return {narrow.data(), Scalar::float32, dimension, count(), columns * sizeof(float)};
  return {wide.data(), Scalar::float64, dimension, count(), columns * sizeof(double)};
}

double Cloud::worst_loss(Loss loss) const {
  double sum = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    const double cap = caps[i];
    if (view().finite(i)) sum += loss == Loss::truncated_l1 ? cap : cap * cap;
  }
  return sum;
}

double Cloud::radius() const {
  const Extent extent = measure(view());
  double radius = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    for (int d = 0; extent.finite[i] && d < dimension; ++d) radius = std::max(radius, std::abs(view().at(i, d) - extent.centre[d]));
  }
  return radius;
}

double Random::operator()() {  // splitmix64
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

Cloud make_cloud(ModelKind kind, std::size_t count, double middle, double size, bool float32) {
  Random random(count + 17);
  const Parameters model = true_model(kind);
  Cloud cloud;
  cloud.dimension = traits(kind).dimension;
  for (std::size_t i = 0; i < count; ++i) {
    Point x{};
    for (std::size_t d = 0; d < dimension_of(kind); ++d) x[d] = random.between(-1, 1);
    const bool inlier = random() < 0.6;
    const double off = random.between(-0.004, 0.004);
    if (inlier) pull(kind, model, off, x);
    for (std::size_t d = 0; d < dimension_of(kind); ++d) {
      const double value = middle + size * x[d];
      if (float32) {
        cloud.narrow.push_back(static_cast<float>(value));
      } else {
        cloud.wide.push_back(value);
      }
    }
    cloud.caps.push_back(static_cast<float>(random.between(0.005, 0.02) * size));
  }
  return cloud;
}

std::vector<std::size_t> sizes(ModelKind kind) {
  if (!traits(kind).affine) return {1, 2, 17, 128, 20011};
  return {1, 2, 3, 15, 16, 17, 127, 128, 129, 65535, 65537, 307200};
}

std::vector<double> make_swarm(ModelKind kind, std::size_t count, double middle, double size) {
  Random random(count + 99);
  std::vector<double> swarm;
  for (std::size_t j = 0; j < count; ++j) {
    Parameters p = true_model(kind);
    const double spread = j % 2 == 0 ? 0.01 : 2.0;
    for (std::size_t i = 0; i < parameter_count(kind); ++i) p[i] += random.between(-spread, spread);
    const auto [first, length] = unit_vector(kind);
    double norm = 0;
    for (std::size_t i = first; i < first + length; ++i) norm = std::hypot(norm, p[i]);
    for (std::size_t i = first; i < first + length; ++i) p[i] /= norm;
    to_data(kind, middle, size, p);
    swarm.insert(swarm.end(), p.begin(), p.begin() + static_cast<std::ptrdiff_t>(parameter_count(kind)));
  }
  return swarm;
}

}  // namespace swarmfit::kernels::conformance
