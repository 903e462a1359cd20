// Second pass: one group a particle sums its chunks, each invocation with compensation (Neumaier), then a tree.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "layout.h"

layout(local_size_x_id = kSpecGroup) in;
layout(set = 0, binding = kBindPartials, std430) readonly buffer Partials { float partials[]; };
layout(set = 0, binding = kBindCosts, std430) writeonly buffer Costs { float costs[]; };
layout(push_constant) uniform PushBlock { Push push; };

shared float sums[gl_WorkGroupSize.x];

void main() {
  const uint group = gl_WorkGroupSize.x;
  const uint lane = gl_LocalInvocationID.x;
  const uint particle = gl_WorkGroupID.x;

  precise float sum = 0.0;
  precise float lost = 0.0;  // what the additions rounded away
  for (uint chunk = lane; chunk < push.chunks; chunk += group) {
    const float value = partials[particle * push.chunks + chunk];
    precise float next = sum + value;
    precise float error = sum >= value ? (sum - next) + value : (value - next) + sum;
    lost += error;
    sum = next;
  }
  sums[lane] = sum + lost;
  barrier();
  for (uint half_width = group / 2; half_width > 0; half_width /= 2) {
    if (lane < half_width) sums[lane] += sums[lane + half_width];
    barrier();
  }
  if (lane == 0) costs[particle] = sums[0];
}
