// circle2d: |x - centre| = radius. C++ twin: kernels/models/circle2d.inl.
vec4 circle2d(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  const vec4 power = (x[0] - k[0]) * (x[0] - k[2]) + (x[1] - k[1]) * (x[1] - k[3]);
  const vec4 u = x[0] - k[4], v = x[1] - k[5];
  return power / (sqrt(u * u + v * v) + k[6]);
}
