// Before a pruned swarm's costs: a lower bound of each, by the balls that hold the chunks. One group a model; the first one also empties
// the list that select.comp is about to fill.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "bounds.glsl"

layout(constant_id = kSpecLoss) const uint kLoss = 0;

layout(set = 0, binding = kBindWork, std430) writeonly buffer Work { uint work[]; };

shared float sums[gl_WorkGroupSize.x];

void main() {
  const uint group = gl_WorkGroupSize.x;
  const uint lane = gl_LocalInvocationID.x;
  const uint model = gl_WorkGroupID.x;
  float k[kCoefficientStride];
  load_model(model, k);
  if (model == 0) {
    for (uint i = lane; i < kWorkHead; i += group) work[i] = i == 2 ? 1 : 0;  // 0 x 0 x 1 groups, and no tile
  }

  float sum = 0.0;
  for (uint quad = lane; quad < push.bound_stride / kQuad; quad += group) {
    const vec4 most = four_bounds(kBoundMostCap, quad);
    // min(|d|, c) is at least c times nearest / most, as c is at most `most`.
    vec4 share = clamp(nearest_of(quad, k) / max(most, vec4(1e-30)), 0.0, 1.0);
    if (kLoss == kLossL2) share *= share;
    const vec4 four = share * four_bounds(kBoundCapSum + (kLoss == kLossL2 ? 1 : 0), quad);
    sum += (four.x + four.y) + (four.z + four.w);
  }
  sums[lane] = sum;
  barrier();
  for (uint half_width = group / 2; half_width > 0; half_width /= 2) {
    if (lane < half_width) sums[lane] += sums[lane + half_width];
    barrier();
  }
  // Less than rounding may have added here and to the sums that it is compared with.
  if (lane == 0) lower[model] = sums[0] * (1.0 - 5e-4);
}
