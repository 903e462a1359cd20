// line2d: a x + b y + offset = 0. C++ twin: kernels/models/line2d.inl.
vec4 line2d(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  return x[0] * k[0] + (x[1] * k[1] + k[2]);
}
