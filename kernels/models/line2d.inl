// line2d: a x + b y + offset = 0, a^2 + b^2 = 1. GLSL twin: shaders/models/line2d.glsl. Included by models.inl only.
struct Line2d {
  static constexpr ModelKind kind = ModelKind::line2d;
  static constexpr ModelTraits traits{"line2d", 2, 3, 3, 2, true};

  static void centre(const double* p, const double* c, double* k) {
    k[0] = p[0];
    k[1] = p[1];
    k[2] = p[2] + p[0] * c[0] + p[1] * c[1];
  }

  /// Size of the numbers that a residual adds up.
  static float magnitude(const float* k, const float* reach) {
    float size = std::abs(k[2]);
    for (int d = 0; d < 2; ++d) size += std::abs(k[d]) * reach[d];
    return size;
  }

  /// Signed orthogonal distance.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    return m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], k[2]));
  }
};
