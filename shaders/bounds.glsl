// What is known of a chunk of points before one is looked at. A distance is at most `steep` times as far from that at the ball's centre as
// the point is.
layout(set = 0, binding = kBindBounds, std430) readonly buffer Bounds { vec4 bounds[]; };
layout(set = 0, binding = kBindLower, std430) buffer Lower {
  uint looked_into;
  uint unused[3];
  float lower[];
};

const uint kLine = 0, kPlane = 1;  // ModelKind of those whose residual is n . x + offset

vec4 four_bounds(uint column, uint quad) { return bounds[column * (push.bound_stride / kQuad) + quad]; }

// The least |dist| of the points of the chunks in a quad.
vec4 nearest_of(uint quad, const float k[kCoefficientStride]) {
  vec4 x[kMaxColumns];
  [[unroll]] for (uint c = 0; c < kDimension; ++c) x[c] = four_bounds(c, quad);
  vec4 reach = k[kSteepSlot] * four_bounds(kBoundRadius, quad);
  if (kModel == kLine || kModel == kPlane) {
    // A distance that is the same way along an edge everywhere: the box tells more than the ball.
    vec4 box = vec4(0.0);
    [[unroll]] for (uint e = 0; e < kDimension; ++e) {
      vec4 along = vec4(0.0);
      [[unroll]] for (uint c = 0; c < kDimension; ++c) along += k[c] * four_bounds(kBoundAxes + kDimension * e + c, quad);
      box += abs(along);
    }
    reach = min(reach, box);
  }
  return max(abs(residuals(kModel, x, k)) - (reach + vec4(k[kSlackSlot])), vec4(0.0));
}
