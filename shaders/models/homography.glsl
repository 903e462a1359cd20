// homography: x2 ~ H x1, with H in k[0..8] and its inverse in k[9..17]. C++ twin: kernels/models/homography.inl.

// Of the matrix that starts at k[first]: the squares of the transfer error times w, and of w, the third coordinate of the image.
void transfer(vec4 x, vec4 y, vec4 to_x, vec4 to_y, const float k[kCoefficientStride], uint first, out vec4 error, out vec4 weight) {
  const vec4 w = x * k[first + 6] + (y * k[first + 7] + k[first + 8]);
  const vec4 u = x * k[first] + (y * k[first + 1] + k[first + 2]) - to_x * w;
  const vec4 v = x * k[first + 3] + (y * k[first + 4] + k[first + 5]) - to_y * w;
  error = u * u + v * v;
  weight = w * w;
}

vec4 homography(const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  vec4 there, back, there_weight, back_weight;
  transfer(x[0], x[1], x[2], x[3], k, 0, there, there_weight);
  transfer(x[2], x[3], x[0], x[1], k, 9, back, back_weight);
  return sqrt(ratio(there * back_weight + back * there_weight, 2.0 * there_weight * back_weight));
}
