// cylinder: |x - the line through point along axis| = radius. GLSL twin: shaders/models/cylinder.glsl. Included by models.inl only.
struct Cylinder {
  static constexpr ModelKind kind = ModelKind::cylinder;
  static constexpr ModelTraits traits{"cylinder", 3, 7, 10, 13 + 2 * kSlowOperation, false};

  /// Two unit vectors across the axis, the first towards it from the origin; then along the first: the near wall, the far wall and the
  /// axis; the radius. In that section the cylinder is a circle, taken as in ball.inl. An axis of length 0 gives NaN.
  static void centre(const double* p, const double* c, double* k) {
    constexpr double kFar = 1e15, kPoint = 1e-30, kOnAxis = 1e-14;
    const double length = std::hypot(p[3], p[4], p[5]);
    const double axis[3] = {p[3] / length, p[4] / length, p[5] / length};
    const double point[3] = {p[0] - c[0], p[1] - c[1], p[2] - c[2]};
    double foot[3] = {point[0], point[1], point[2]};
    for (int pass = 0; pass < 2; ++pass) reject(axis, foot);  // the second pass takes out what the first one rounded
    double offset = std::hypot(foot[0], foot[1], foot[2]);
    if (offset <= kOnAxis * std::hypot(point[0], point[1], point[2])) {
      offset = 0;
      const double size[3] = {std::abs(axis[0]), std::abs(axis[1]), std::abs(axis[2])};
      const int least = size[0] <= size[1] && size[0] <= size[2] ? 0 : size[1] <= size[2] ? 1 : 2;
      for (int d = 0; d < 3; ++d) foot[d] = d == least ? 1.0 : 0.0;
      reject(axis, foot);
    }
    const double foot_length = std::hypot(foot[0], foot[1], foot[2]);
    for (int d = 0; d < 3; ++d) k[d] = foot[d] / foot_length;
    for (int d = 0; d < 3; ++d) k[3 + d] = axis[(d + 1) % 3] * k[(d + 2) % 3] - axis[(d + 2) % 3] * k[(d + 1) % 3];
    const double near = std::clamp(offset - std::abs(p[6]), -kFar, kFar);
    const double radius = std::clamp(std::abs(p[6]), kPoint, kFar);
    k[6] = near;
    k[7] = near + 2 * radius;
    k[8] = near + radius;
    k[9] = radius;
  }

  /// Signed orthogonal distance, negative inside. 13 multiply-adds, a square root and a division.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    const V u = m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], m.mul(x[2], k[2])));
    const V v = m.mul_add(x[0], k[3], m.mul_add(x[1], k[4], m.mul(x[2], k[5])));
    const V across = m.mul(v, v);
    const V power = m.mul_add(m.sub(u, k[6]), m.sub(u, k[7]), across);
    const V from_axis = m.sub(u, k[8]);
    return m.div(power, m.add(m.sqrt(m.mul_add(from_axis, from_axis, across)), k[9]));
  }

 private:
  /// Takes the part along a unit vector out of v.
  static void reject(const double* unit, double* v) {
    const double along = v[0] * unit[0] + v[1] * unit[1] + v[2] * unit[2];
    for (int d = 0; d < 3; ++d) v[d] -= along * unit[d];
  }
};
