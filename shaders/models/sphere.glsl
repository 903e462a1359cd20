// sphere: |x - centre| = radius. C++ twin: kernels/models/sphere.inl.
vec4 sphere(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  const vec4 power = (x[0] - k[0]) * (x[0] - k[3]) + (x[1] - k[1]) * (x[1] - k[4]) + (x[2] - k[2]) * (x[2] - k[5]);
  const vec4 u = x[0] - k[6], v = x[1] - k[7], w = x[2] - k[8];
  return power / (sqrt(u * u + v * v + w * w) + k[9]);
}
