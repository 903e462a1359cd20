// cylinder: |x - the line through point along axis| = radius. C++ twin: kernels/models/cylinder.inl.
vec4 cylinder(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  const vec4 u = x[0] * k[0] + (x[1] * k[1] + x[2] * k[2]);
  const vec4 v = x[0] * k[3] + (x[1] * k[4] + x[2] * k[5]);
  const vec4 from_axis = u - k[8];
  return ((u - k[6]) * (u - k[7]) + v * v) / (sqrt(from_axis * from_axis + v * v) + k[9]);
}
