// The nearest model within tolerance of every point, four points an invocation; ties go to the model listed first.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(set = 0, binding = kBindPartials, std430) writeonly buffer Labels { uvec4 labels[]; };

void main() {
  const uint q = gl_GlobalInvocationID.x;
  if (q >= push.column_stride / kQuad) return;
  vec4 x[kMaxColumns];
  load_quad(q, x);
  vec4 tolerance = vec4(push.tolerance);
  if (push.tolerance < 0.0) tolerance = load_caps(q);

  uvec4 label = uvec4(0);
  vec4 nearest = vec4(0);
  for (uint m = 0; m < push.models; ++m) {
    float k[kCoefficientStride];
    load_model(m, k);
    const uint kind = kModel == kAnyModel ? uint(k[kKindSlot]) : kModel;
    const uint number = uint(k[kNumberSlot]);
    const vec4 distance = abs(residuals(kind, x, k));
    [[unroll]] for (uint j = 0; j < kQuad; ++j) {
      if (distance[j] <= tolerance[j] && (label[j] == 0 || distance[j] < nearest[j])) {
        label[j] = number;
        nearest[j] = distance[j];
      }
    }
  }
  labels[q] = label;
}
