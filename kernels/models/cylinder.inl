// cylinder: |x - the line through point along axis| = radius. GLSL twin: shaders/models/cylinder.glsl. Included by models.inl only.
struct Cylinder {
  static constexpr ModelKind kind = ModelKind::cylinder;
  static constexpr ModelTraits traits{"cylinder", 3, 7, 10, 13 + 2 * kSlowOperation, false, true};

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

  /// Size of the numbers that a residual adds up, twice, as more operations round them than a plane's.
  static float magnitude(const float* k, const float* reach) { return 2 * (std::abs(k[6]) + 2 * (reach[0] + reach[1] + reach[2])); }

  /// Signed orthogonal distance, negative inside. 13 multiply-adds, a square root and a division.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    const V u = m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], m.mul(x[2], k[2])));
    const V v = m.mul_add(x[0], k[3], m.mul_add(x[1], k[4], m.mul(x[2], k[5])));
    const V from_axis = m.sub(u, k[8]);
    return signed_distance(m, u, v, k, m.sqrt(m.mul_add(from_axis, from_axis, m.mul(v, v))));
  }

  /// The same with its gradient and its bend: s away, it is above the tangent plane by at most bend s^2 / 2, and never below.
  template <class Math, class V>
  static SWARMFIT_INLINE V expand(const Math m, const V* x, const V* k, V* gradient, V& bend) {
    const V u = m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], m.mul(x[2], k[2])));
    const V v = m.mul_add(x[0], k[3], m.mul_add(x[1], k[4], m.mul(x[2], k[5])));
    const V from_axis = m.sub(u, k[8]);
    const V length = m.max(m.sqrt(m.mul_add(from_axis, from_axis, m.mul(v, v))), m.set(1e-30));
    bend = m.div(m.set(1.0), length);
    for (int d = 0; d < 3; ++d) gradient[d] = m.mul(m.mul_add(from_axis, k[d], m.mul(v, k[3 + d])), bend);
    return signed_distance(m, u, v, k, length);
  }

 private:
  template <class Math, class V>
  static SWARMFIT_INLINE V signed_distance(const Math m, V u, V v, const V* k, V length) {
    return m.div(m.mul_add(m.sub(u, k[6]), m.sub(u, k[7]), m.mul(v, v)), m.add(length, k[9]));
  }

  /// Takes the part along a unit vector out of v.
  static void reject(const double* unit, double* v) {
    const double along = v[0] * unit[0] + v[1] * unit[1] + v[2] * unit[2];
    for (int d = 0; d < 3; ++d) v[d] -= along * unit[d];
  }
};
