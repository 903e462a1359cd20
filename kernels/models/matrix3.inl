// What homography and fundamental share: 3x3 matrices, row after row. Included by models.inl only.
struct Matrix3 {
  /// To points centred at (x, y) on the right: each row's last element takes in the translation.
  static void recentre_right(double* a, double x, double y) {
    for (int r = 0; r < 3; ++r) a[3 * r + 2] += a[3 * r] * x + a[3 * r + 1] * y;
  }

  static double largest(const double* values, int count) {
    double most = 0;
    for (int i = 0; i < count; ++i) most = std::max(most, std::abs(values[i]));
    return most;
  }

  /// Divides all nine by `by`, or leaves them where that is 0.
  static void divide(double* a, double by) {
    for (int i = 0; by > 0 && i < 9; ++i) a[i] /= by;
  }

  /// The adjugate, det(a) a^-1. Returns false, and zeros, if `a` is singular but for rounding.
  static bool adjugate(const double* a, double* out) {
    constexpr double kRounding = 1e-13;
    double determinant = 0, size = 0;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
        const double plus = a[3 * r1 + c1] * a[3 * r2 + c2], minus = a[3 * r1 + c2] * a[3 * r2 + c1];
        out[3 * r + c] = plus - minus;
        if (c == 0) {
          determinant += a[r] * (plus - minus);
          size += std::abs(a[r]) * (std::abs(plus) + std::abs(minus));
        }
      }
    }
    const bool regular = std::abs(determinant) > kRounding * size;
    for (int i = 0; !regular && i < 9; ++i) out[i] = 0;
    return regular;
  }
};
