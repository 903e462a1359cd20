// What every shader here reads: the cloud, four points at a time, and the models' coefficients.
#extension GL_EXT_control_flow_attributes : require
#include "layout.h"

layout(local_size_x_id = kSpecGroup) in;
layout(constant_id = kSpecModel) const uint kModel = 0;
layout(constant_id = kSpecDimension) const uint kDimension = 3;

layout(push_constant) uniform PushBlock { Push push; };

const uint kInfinityBits = 0x7F800000u;

// a / b for a >= 0, infinite where b is not above 0.
vec4 ratio(vec4 a, vec4 b) { return mix(vec4(uintBitsToFloat(kInfinityBits)), a / b, greaterThan(b, vec4(0.0))); }

#ifdef SWARMFIT_BATCH
#include "batch.glsl"
#endif
#include "fetch.glsl"
#include "models.glsl"
