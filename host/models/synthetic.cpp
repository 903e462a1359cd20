#include "host/models/synthetic.hpp"

#include <cmath>
#include <random>

#include <Eigen/Dense>

namespace swarmfit::models {
namespace {

/// Uniform numbers in [-1, 1], the same on every standard library.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-52 - 1.0; }
  /// Irwin-Hall: three uniform numbers make a bell.
  double bell() { return (*this)() + (*this)() + (*this)(); }
  Eigen::VectorXd direction(int dimension) {
    Eigen::VectorXd d(dimension);
    for (double& v : d) v = (*this)();
    return d.norm() > 0.1 ? Eigen::VectorXd(d.normalized()) : Eigen::VectorXd(Eigen::VectorXd::Unit(dimension, 0));
  }

 private:
  std::mt19937_64 engine_;
};

/// Moves a uniform point onto one of some planes or lines.
class Flats {
 public:
  Flats(int dimension, std::size_t count, Numbers& number) {
    for (std::size_t k = 0; k < count; ++k) normals_.push_back(number.direction(dimension));
  }
  void place(std::size_t k, Numbers&, Eigen::VectorXd& x) const { x += (0.2 * static_cast<double>(k) - normals_[k].dot(x)) * normals_[k]; }

 private:
  std::vector<Eigen::VectorXd> normals_;
};

/// Onto one of some circles, spheres or, where there is an axis, cylinders.
class Rounds {
 public:
  Rounds(int dimension, bool axes, std::size_t count, Numbers& number) {
    for (std::size_t k = 0; k < count; ++k) {
      centres_.push_back(0.6 * number.direction(dimension));
      axes_.push_back(axes ? number.direction(dimension) : Eigen::VectorXd(Eigen::VectorXd::Zero(dimension)));
    }
  }
  void place(std::size_t k, Numbers&, Eigen::VectorXd& x) const {
    const Eigen::VectorXd arm = x - centres_[k], across = arm - axes_[k].dot(arm) * axes_[k];
    if (across.norm() > 0) x += across * (0.1 * static_cast<double>(k + 2) / across.norm() - 1);
  }

 private:
  std::vector<Eigen::VectorXd> centres_, axes_;
};

/// The second view of a point: of a plane in space, or of a body that has moved and whose points lie at any depth.
class Views {
 public:
  Views(bool planes, std::size_t count, Numbers& number) : planes_(planes) {
    for (std::size_t k = 0; k < count; ++k) {
      const double angle = 0.2 * number();
      turns_.emplace_back(Eigen::AngleAxisd(angle, Eigen::Vector3d(number.direction(3))).toRotationMatrix());
      shifts_.emplace_back(0.3 * Eigen::Vector3d(number.direction(3)));
    }
  }
  void place(std::size_t k, Numbers& number, Eigen::VectorXd& x) const {
    const double depth = planes_ ? 1 / (0.3 + 0.05 * (x[0] + x[1])) : 3 + number();
    const Eigen::Vector3d there = turns_[k] * (depth * Eigen::Vector3d(x[0], x[1], 1)) + shifts_[k];
    x[2] = there[0] / there[2];
    x[3] = there[1] / there[2];
  }

 private:
  bool planes_;
  std::vector<Eigen::Matrix3d> turns_;
  std::vector<Eigen::Vector3d> shifts_;
};

template <class Models>
std::vector<float> cloud(const Models& models, const SyntheticMix& mix, int dimension, std::size_t count, Numbers& number) {
  const auto width = static_cast<std::size_t>(dimension);
  std::vector<float> values(count * width);
  Eigen::VectorXd x(dimension);
  for (std::size_t i = 0; i < count; ++i) {
    for (double& v : x) v = number();
    const bool on_model = i % 10 < mix.tenths;
    if (on_model) models.place(i % mix.models, number, x);
    for (std::size_t c = 0; c < width; ++c) {
      values[i * width + c] = static_cast<float>(x[static_cast<Eigen::Index>(c)] + (on_model ? kSyntheticSpread * number.bell() : 0.0));
    }
  }
  return values;
}

}  // namespace

std::vector<float> synthetic_points(ModelType type, std::size_t count, std::uint64_t seed, const SyntheticMix& mix) {
  Numbers number(seed);
  const int columns = dimension(type);
  switch (type) {
    case ModelType::line2d:
    case ModelType::plane: return cloud(Flats(columns, mix.models, number), mix, columns, count, number);
    case ModelType::circle2d:
    case ModelType::sphere: return cloud(Rounds(columns, false, mix.models, number), mix, columns, count, number);
    case ModelType::cylinder: return cloud(Rounds(columns, true, mix.models, number), mix, columns, count, number);
    case ModelType::own: return {};
    case ModelType::homography:
    case ModelType::fundamental: break;
  }
  return cloud(Views(type == ModelType::homography, mix.models, number), mix, columns, count, number);
}

}  // namespace swarmfit::models
