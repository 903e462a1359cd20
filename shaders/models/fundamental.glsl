// fundamental: x2^T F x1 = 0. C++ twin: kernels/models/fundamental.inl.
vec4 fundamental(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  const vec4 a = x[0] * k[0] + (x[1] * k[1] + k[2]);
  const vec4 b = x[0] * k[3] + (x[1] * k[4] + k[5]);
  const vec4 c = x[0] * k[6] + (x[1] * k[7] + k[8]);
  const vec4 s = x[2] * k[0] + (x[3] * k[3] + k[6]);
  const vec4 t = x[2] * k[1] + (x[3] * k[4] + k[7]);
  const vec4 e = x[2] * a + (x[3] * b + c);
  return sqrt(ratio(e * e, a * a + (b * b + (s * s + t * t))));
}
