// Second pass: one group a particle adds up its partial sums, each invocation with compensation (Knuth's two-sum), then a tree.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "layout.h"

layout(local_size_x_id = kSpecGroup) in;
#ifdef SWARMFIT_TEXELS
layout(set = 0, binding = kBindPartialTexels) uniform samplerBuffer partials;
#define Sum vec4
#define PARTIAL(i) texelFetch(partials, int(i))
const uint kWidth = 4;
float total(vec4 four) { return (four.x + four.y) + (four.z + four.w); }
#else
layout(set = 0, binding = kBindPartials, std430) readonly buffer Partials { float partials[]; };
#define Sum float
#define PARTIAL(i) partials[i]
const uint kWidth = 1;
float total(float one) { return one; }
#endif
layout(set = 0, binding = kBindCosts, std430) writeonly buffer Costs { float costs[]; };
#ifdef SWARMFIT_PRUNED
layout(set = 0, binding = kBindCoefficients, std430) readonly buffer Coefficients { float coefficients[]; };
layout(set = 0, binding = kBindLower, std430) readonly buffer Lower { float lower[]; };  // after four words, see bounds.glsl
#endif
layout(push_constant) uniform PushBlock { Push push; };
#ifdef SWARMFIT_BATCH
#include "batch.glsl"
#endif

shared float sums[gl_WorkGroupSize.x];

void main() {
  const uint group = gl_WorkGroupSize.x;
  const uint lane = gl_LocalInvocationID.x;
  const uint particle = gl_WorkGroupID.x;

#ifdef SWARMFIT_PRUNED
  if (lower[4 + particle] >= coefficients[particle * kCoefficientStride + kCutoffSlot]) {
    if (lane == 0) costs[particle] = lower[4 + particle];
    return;
  }
#endif
#ifdef SWARMFIT_BATCH
  take_item();
  if (particle >= own.models) return;
  const uint row = own.partials / kWidth;
  const uint first = own.sums / kWidth + particle * row;
  const uint place = own.row + particle;
#else
  const uint row = push.partials / kWidth;
  const uint first = particle * row;
  const uint place = particle;
#endif
  precise Sum sum = Sum(0.0);
  precise Sum lost = Sum(0.0);  // what the additions rounded away
  for (uint i = lane; i < row; i += group) {
    const Sum value = PARTIAL(first + i);
    precise Sum next = sum + value;
    precise Sum added = next - sum;
    precise Sum error = (sum - (next - added)) + (value - added);
    lost += error;
    sum = next;
  }
  sums[lane] = total(sum + lost);
  barrier();
  for (uint half_width = group / 2; half_width > 0; half_width /= 2) {
    if (lane < half_width) sums[lane] += sums[lane + half_width];
    barrier();
  }
  if (lane == 0) costs[place] = sums[0];
}
