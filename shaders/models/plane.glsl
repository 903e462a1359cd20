// plane: normal . x + offset = 0. C++ twin: kernels/models/plane.inl.
vec4 plane(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  return x[0] * k[0] + (x[1] * k[1] + (x[2] * k[2] + k[3]));
}
