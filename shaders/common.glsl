// What every shader here reads: the cloud, four points at a time, and the models' coefficients.
#extension GL_EXT_control_flow_attributes : require
#include "layout.h"

layout(local_size_x_id = kSpecGroup) in;
layout(constant_id = kSpecModel) const uint kModel = 0;
layout(constant_id = kSpecDimension) const uint kDimension = 3;

layout(push_constant) uniform PushBlock { Push push; };

#include "fetch.glsl"
#include "models.glsl"
