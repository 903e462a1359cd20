// homography: x2 ~ H x1 for points x1, y1, x2, y2. GLSL twin: shaders/models/homography.glsl. Included by models.inl only.
struct Homography {
  static constexpr ModelKind kind = ModelKind::homography;
  static constexpr ModelTraits traits{"homography", 4, 9, 18, 26 + 2 * kSlowOperation, false};

  /// H and its inverse between the centred images, each with 1 the largest of its last row. The inverse of a singular H is 0: it maps
  /// every point to infinity.
  static void centre(const double* p, const double* c, double* k) {
    double *forward = k, *backward = k + 9;
    std::copy(p, p + 9, forward);
    Matrix3::divide(forward, Matrix3::largest(forward, 9));
    Matrix3::recentre_right(forward, c[0], c[1]);
    for (int i = 0; i < 3; ++i) {
      forward[i] -= c[2] * forward[6 + i];
      forward[3 + i] -= c[3] * forward[6 + i];
    }
    Matrix3::adjugate(forward, backward);
    for (double* matrix : {forward, backward}) Matrix3::divide(matrix, Matrix3::largest(matrix + 6, 3));
  }

  /// Symmetric transfer distance sqrt((|x2 - H x1|^2 + |x1 - H^-1 x2|^2) / 2); infinite where a point maps to infinity. 26 multiply-adds, a
  /// square root and a division.
  template <class Math, class V>
  static SWARMFIT_INLINE V residual(const Math m, const V* x, const V* k) {
    V square[2], weight[2];
    for (int way = 0; way < 2; ++way) {
      const V *h = k + 9 * way, *from = x + 2 * way, *to = x + 2 - 2 * way;
      const V w = m.mul_add(from[0], h[6], m.mul_add(from[1], h[7], h[8]));
      const V u = m.neg_mul_add(to[0], w, m.mul_add(from[0], h[0], m.mul_add(from[1], h[1], h[2])));
      const V v = m.neg_mul_add(to[1], w, m.mul_add(from[0], h[3], m.mul_add(from[1], h[4], h[5])));
      square[way] = m.mul_add(u, u, m.mul(v, v));
      weight[way] = m.mul(w, w);
    }
    const V both = m.mul_add(square[0], weight[1], m.mul(square[1], weight[0]));
    return m.sqrt(m.ratio(both, m.mul(m.add(weight[0], weight[0]), weight[1])));
  }
};
