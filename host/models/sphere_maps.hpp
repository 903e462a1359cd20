// Unit vectors as points of a sphere: the shortest way from one to another, and where a way leads. A swarm asks for both at every step of
// every particle, so short ways go by series instead of by angles.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace swarmfit::models {

/// The tangent vector at unit `n` that leads to unit `m` along the great circle: its length is the angle [rad]. The logarithm map.
template <class Vector>
Vector way_between(const Vector& n, const Vector& m) {
  const double cosine = n.dot(m);
  const Vector across = m - cosine * n;
  const double square = across.squaredNorm();
  if (cosine > 0.99) {  // asin(s) / s to the 12th power of s < 0.15: nothing is lost
    const double x = square;
    return across *
           (1 + x * (1.0 / 6 + x * (3.0 / 40 + x * (15.0 / 336 + x * (105.0 / 3456 + x * (945.0 / 42240 + x * (10395.0 / 599040)))))));
  }
  const double sine = std::sqrt(square);
  if (!(sine > 1e-300)) return Vector::Zero();
  return across * (std::atan2(sine, cosine) / sine);
}

/// Moves unit `n` along tangent `v`, a quarter turn at most: the exponential map. `v`, first made tangent, is carried along: it keeps its
/// length and its angle to the way.
template <class Vector>
void follow(Vector& n, Vector& v) {
  constexpr double kQuarterTurn = 1.5707963267948966;
  v -= n.dot(v) * n;
  double square = v.squaredNorm();
  if (square > kQuarterTurn * kQuarterTurn) {
    v *= kQuarterTurn / std::sqrt(square);
    square = kQuarterTurn * kQuarterTurn;
  }
  double cosine, sine_per_angle;
  if (square < 0.02) {
    const double x = square;
    cosine = 1 - x * (1.0 / 2 - x * (1.0 / 24 - x * (1.0 / 720 - x * (1.0 / 40320 - x * (1.0 / 3628800)))));
    sine_per_angle = 1 - x * (1.0 / 6 - x * (1.0 / 120 - x * (1.0 / 5040 - x * (1.0 / 362880))));
  } else {
    const double angle = std::sqrt(square);
    cosine = std::cos(angle);
    sine_per_angle = std::sin(angle) / angle;
  }
  const Vector before = n;
  n = cosine * before + sine_per_angle * v;
  n *= 1.5 - 0.5 * n.squaredNorm();  // rounding must not add up
  v = cosine * v - (square * sine_per_angle) * before;
}

}  // namespace swarmfit::models
