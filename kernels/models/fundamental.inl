// fundamental: x2^T F x1 = 0 for points x1, y1, x2, y2. GLSL twin: shaders/models/fundamental.glsl. Included by models.inl only.
struct Fundamental {
  static constexpr ModelKind kind = ModelKind::fundamental;
  static constexpr ModelTraits traits{"fundamental", 4, 9, 9, 17 + 2 * kSlowOperation, false};

  /// F between the centred images, of unit Frobenius norm.
  static void centre(const double* p, const double* c, double* k) {
    std::copy(p, p + 9, k);
    Matrix3::divide(k, Matrix3::largest(k, 9));
    Matrix3::recentre_right(k, c[0], c[1]);
    for (int i = 0; i < 3; ++i) k[6 + i] += c[2] * k[i] + c[3] * k[3 + i];
    double square = 0;
    for (int i = 0; i < 9; ++i) square += k[i] * k[i];
    Matrix3::divide(k, std::sqrt(square));
  }

  /// Sampson distance |x2^T F x1| / |((F x1)_0, (F x1)_1, (F^T x2)_0, (F^T x2)_1)|; infinite where both points are epipoles. 17
  /// multiply-adds, a square root and a division.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    const V a = m.mul_add(x[0], k[0], m.mul_add(x[1], k[1], k[2]));
    const V b = m.mul_add(x[0], k[3], m.mul_add(x[1], k[4], k[5]));
    const V c = m.mul_add(x[0], k[6], m.mul_add(x[1], k[7], k[8]));
    const V s = m.mul_add(x[2], k[0], m.mul_add(x[3], k[3], k[6]));
    const V t = m.mul_add(x[2], k[1], m.mul_add(x[3], k[4], k[7]));
    const V e = m.mul_add(x[2], a, m.mul_add(x[3], b, c));
    const V gradient = m.mul_add(a, a, m.mul_add(b, b, m.mul_add(s, s, m.mul(t, t))));
    return m.sqrt(m.ratio(m.mul(e, e), gradient));
  }
};
