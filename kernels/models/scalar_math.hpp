// What models.inl computes with, one point at a time in double precision.
#pragma once

#include <cmath>
#include <limits>

namespace swarmfit::kernels {

struct ScalarMath {
  double add(double a, double b) const { return a + b; }
  double sub(double a, double b) const { return a - b; }
  double mul(double a, double b) const { return a * b; }
  double div(double a, double b) const { return a / b; }
  double sqrt(double a) const { return std::sqrt(a); }
  double mul_add(double a, double b, double c) const { return a * b + c; }
  double neg_mul_add(double a, double b, double c) const { return c - a * b; }
  double ratio(double a, double b) const { return b > 0 ? a / b : std::numeric_limits<double>::infinity(); }
};

}  // namespace swarmfit::kernels
