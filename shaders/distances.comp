// |dist| of every point to one model, four points an invocation.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(set = 0, binding = kBindPartials, std430) writeonly buffer Distances { vec4 distances[]; };

void main() {
  const uint q = gl_GlobalInvocationID.x;
  if (q >= push.column_stride / kQuad) return;
  vec4 x[kMaxColumns];
  float k[kCoefficientStride];
  load_quad(q, x);
  load_model(0, k);
  // What overflows to no number is out of any reach.
  distances[q] = uintBitsToFloat(min(floatBitsToUint(residuals(kModel, x, k)) & 0x7FFFFFFFu, kInfinityBits));
}
