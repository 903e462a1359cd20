// The mean distance of a colour to the K nearest of a sample, one colour an invocation. Eqs. (6), (7) of Zhou et al. 2010.
#version 450

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kNeighbours = 1;

// Hue, lightness, saturation: three columns of so many floats as there are colours.
layout(set = 0, binding = 0, std430) readonly buffer Sample { float known[]; };
layout(set = 0, binding = 1, std430) readonly buffer Colours { float colours[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Costs { float costs[]; };
layout(push_constant) uniform Push {
  uint sample_size;
  uint colour_count;
} push;

float hue_distance(float a, float b) {
  const float around = 0.5 - abs(0.5 - abs(a - b));
  return min(4.0 * around, 1.0);
}

float colour_distance(vec3 a, vec3 b) {
  const float ds = abs(a.z - b.z), mean_s = 0.5 * (a.z + b.z);
  const float dhl = mean_s * hue_distance(a.x, b.x) + (1.0 - mean_s) * abs(a.y - b.y);
  return ds * ds + (1.0 - ds) * dhl;
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.colour_count) return;
  const vec3 colour = vec3(colours[i], colours[push.colour_count + i], colours[2 * push.colour_count + i]);
  float nearest[kNeighbours];  // ascending
  for (uint k = 0; k < kNeighbours; ++k) nearest[k] = 2.0;
  for (uint j = 0; j < push.sample_size; ++j) {
    float far = colour_distance(colour, vec3(known[j], known[push.sample_size + j], known[2 * push.sample_size + j]));
    if (far >= nearest[kNeighbours - 1]) continue;
    for (uint k = 0; k < kNeighbours; ++k) {
      const float held = nearest[k];
      nearest[k] = min(held, far);
      far = max(held, far);
    }
  }
  float sum = 0.0;
  for (uint k = 0; k < kNeighbours; ++k) sum += nearest[k];
  costs[i] = sum / float(kNeighbours);
}
