// plane: normal . x + offset = 0, |normal| = 1. GLSL twin: shaders/models/plane.glsl. Included by models.inl only.
struct Plane {
  static constexpr ModelKind kind = ModelKind::plane;
  static constexpr ModelTraits traits{"plane", 3, 4, 4, 3, true};

  static void centre(const double* p, const double* c, double* k) {
    k[0] = p[0];
    k[1] = p[1];
    k[2] = p[2];
    k[3] = p[3] + p[0] * c[0] + p[1] * c[1] + p[2] * c[2];
  }

  /// Size of the numbers that a residual adds up.
  static float magnitude(const float* k, const float* reach) {
    float size = std::abs(k[3]);
    for (int d = 0; d < 3; ++d) size += std::abs(k[d]) * reach[d];
    return size;
  }

  /// Signed orthogonal distance.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    return m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], m.mul_add(x[2], k[2], k[3])));
  }
};
