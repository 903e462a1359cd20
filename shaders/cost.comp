// First pass of a swarm's costs: each group sums the loss of kTile particles over one chunk of points,
// kSpecGroup x kWork quads. Coefficients and sums stay in registers; every sum is taken in a fixed order.
// Pruned, the tiles are those that select.comp has left, whichever group takes them. In a batch, each problem has its own.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(constant_id = kSpecLoss) const uint kLoss = 0;
layout(constant_id = kSpecTile) const uint kTile = 8;
layout(constant_id = kSpecWork) const uint kWork = 8;
#ifdef SWARMFIT_PRUNED
layout(set = 0, binding = kBindWork, std430) readonly buffer Work { uint work[]; };
#define ROW(at) work[min(at, end - 1)]
#define SUMS(at) (work[at] * push.partials)
#elif defined(SWARMFIT_BATCH)
#define ROW(at) (own.row + min(at, end - 1))
#define SUMS(at) (own.sums + (at)*own.partials)
#else
#define ROW(at) (at)
#define SUMS(at) ((at)*push.partials)
#endif

layout(set = 0, binding = kBindPartials, std430) writeonly buffer Partials { float partials[]; };

#ifndef SWARMFIT_TEXELS
shared float sums[kTile * gl_WorkGroupSize.x];
#endif

// Eqs. (3), (4) of Zhou et al. for four points.
#ifdef SWARMFIT_TEXELS
// Of numbers >= 0 the smaller has the smaller bits. A software device compares these at once; a float min it would guard against NaN.
vec4 loss(vec4 residuals, vec4 cap) {
  if (kLoss == kLossL2) return uintBitsToFloat(min(floatBitsToUint(residuals * residuals), floatBitsToUint(cap * cap)));
  return uintBitsToFloat(min(floatBitsToUint(residuals) & 0x7FFFFFFFu, floatBitsToUint(cap)));
}
#else
vec4 loss(vec4 residuals, vec4 cap) {
  if (kLoss == kLossL2) return min(residuals * residuals, cap * cap);
  return min(abs(residuals), cap);
}
#endif

// Sums of the particles from `first` on over the group's chunk, a tile of them or as many as there are before `end`.
void add_up(uint chunk, uint first, uint end) {
  const uint group = gl_WorkGroupSize.x;
  const uint lane = gl_LocalInvocationID.x;
  float k[kTile * kCoefficientStride];
  float sum[kTile];
  [[unroll]] for (uint t = 0; t < kTile; ++t) {
    float one[kCoefficientStride];
    load_model(ROW(first + t), one);
    [[unroll]] for (uint i = 0; i < kCoefficientStride; ++i) k[t * kCoefficientStride + i] = one[i];
    sum[t] = 0.0;
  }

  for (uint w = 0; w < kWork; ++w) {
    const uint q = (chunk * kWork + w) * group + lane;
    vec4 x[kMaxColumns];
    load_quad(q, x);
    const vec4 cap = load_caps(q);
    [[unroll]] for (uint t = 0; t < kTile; ++t) {
      float one[kCoefficientStride];
      [[unroll]] for (uint i = 0; i < kCoefficientStride; ++i) one[i] = k[t * kCoefficientStride + i];
      const vec4 four = loss(residuals(kModel, x, one), cap);
      sum[t] += (four.x + four.y) + (four.z + four.w);
    }
  }

#ifdef SWARMFIT_TEXELS
  // Where an exchange between invocations is dearer than a few more partial sums, each leaves its own.
  [[unroll]] for (uint t = 0; t < kTile; ++t) {
    if (first + t < end) partials[SUMS(first + t) + chunk * group + lane] = sum[t];
  }
#else
  [[unroll]] for (uint t = 0; t < kTile; ++t) sums[t * group + lane] = sum[t];
  barrier();
  for (uint half_width = group / 2; half_width > 0; half_width /= 2) {
    for (uint i = lane; i < kTile * half_width; i += group) {
      const uint at = (i / half_width) * group + i % half_width;
      sums[at] += sums[at + half_width];
    }
    barrier();
  }
  for (uint t = lane; t < kTile && first + t < end; t += group) partials[SUMS(first + t) + chunk] = sums[t * group];
#endif
}

#ifdef SWARMFIT_PRUNED
void main() {
  const uint tile = gl_WorkGroupID.y * kTilesAcross + gl_WorkGroupID.x;
  if (tile >= work[kWorkTiles]) return;
  const uint at = kWorkHead + push.chunks * push.models + 2 * tile;
  const uint chunk = work[at];
  const uint first = kWorkHead + chunk * push.models + (work[at + 1] >> kTileBits);
  add_up(chunk, first, first + (work[at + 1] & ((1u << kTileBits) - 1u)));
}
#elif defined(SWARMFIT_BATCH)
void main() {
  take_item();
  const uint tiles = (own.models + kTile - 1) / kTile;
  if (gl_WorkGroupID.x >= own.chunks * tiles) return;
  add_up(gl_WorkGroupID.x / tiles, gl_WorkGroupID.x % tiles * kTile, own.models);
}
#else
void main() {
  const uint first = gl_WorkGroupID.y * kTile;
  add_up(gl_WorkGroupID.x, first, first + kTile);
}
#endif
