// What circle2d and sphere share: a centre and a radius in D dimensions. Included by models.inl only.
//
// Let a and b be the ends of the diameter that points at the origin. By Thales, (x - a) . (x - b) = |x - c|^2 - r^2, so the distance is
// that over |x - c| + r. Unlike |x - c| - r it subtracts nothing large: floats hold it for spheres of any size, flat ones as well.
template <int D>
struct Ball {
  /// a, b, c, r. A radius counts by its size; what is farther off or flatter than float can tell is kept where squares do not overflow.
  static constexpr int coefficient_count = 3 * D + 1;

  static void centre(const double* p, const double* c, double* k) {
    constexpr double kFar = 1e15, kPoint = 1e-30;
    double offset[D], square = 0;
    for (int d = 0; d < D; ++d) {
      offset[d] = p[d] - c[d];
      square += offset[d] * offset[d];
    }
    // hypot costs as much as a block of residuals; it is for what squares cannot hold.
    constexpr double kLeastSquare = 1e-200, kMostSquare = 1e200;
    double length = std::sqrt(square);
    if (!(square > kLeastSquare && square < kMostSquare)) {
      length = 0;
      for (int d = 0; d < D; ++d) length = std::hypot(length, offset[d]);
    }
    const double near = std::clamp(length - std::abs(p[D]), -kFar, kFar);
    const double radius = std::clamp(std::abs(p[D]), kPoint, kFar);
    for (int d = 0; d < D; ++d) {
      const double direction = length > 0 ? offset[d] / length : (d == 0 ? 1.0 : 0.0);
      k[d] = near * direction;
      k[D + d] = (near + 2 * radius) * direction;
      k[2 * D + d] = (near + radius) * direction;
    }
    k[3 * D] = radius;
  }

  /// Size of the numbers that a residual adds up, twice, as more operations round them than a plane's.
  static float magnitude(const float* k, const float* reach) {
    float size = 0;
    for (int d = 0; d < D; ++d) size += 2 * (std::abs(k[d]) + reach[d]);
    return size;
  }

  /// Signed orthogonal distance, negative inside. 5 D + 1 multiply-adds, a square root and a division.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    V out[D];
    return signed_distance(m, x, k, outward(m, x, k, out));
  }

  /// The same with its gradient and its bend: s away, it is above the tangent plane by at most bend s^2 / 2, and never below.
  template <class Math, class V>
  static SWARMFIT_INLINE V expand(const Math m, const V* x, const V* k, V* gradient, V& bend) {
    const V length = m.max(outward(m, x, k, gradient), m.set(1e-30));
    bend = m.div(m.set(1.0), length);
    for (int d = 0; d < D; ++d) gradient[d] = m.mul(gradient[d], bend);
    return signed_distance(m, x, k, length);
  }

 private:
  /// x - c, and its length.
  template <class Math, class V>
  static SWARMFIT_INLINE V outward(const Math m, const V* x, const V* k, V* out) {
    out[0] = m.sub(x[0], k[2 * D]);
    V square = m.mul(out[0], out[0]);
    for (int d = 1; d < D; ++d) {
      out[d] = m.sub(x[d], k[2 * D + d]);
      square = m.mul_add(out[d], out[d], square);
    }
    return m.sqrt(square);
  }

  template <class Math, class V>
  static SWARMFIT_INLINE V signed_distance(const Math m, const V* x, const V* k, V length) {
    V power = m.mul(m.sub(x[0], k[0]), m.sub(x[0], k[D]));
    for (int d = 1; d < D; ++d) power = m.mul_add(m.sub(x[d], k[d]), m.sub(x[d], k[D + d]), power);
    return m.div(power, m.add(length, k[3 * D]));
  }
};
