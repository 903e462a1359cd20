// Before a pruned swarm's costs, after their bounds: which models must be evaluated over which chunks. A group looks at four chunks and
// kSpan models. Where all of a chunk's points are beyond a model's reach the partial sums are those of the caps; of a model that cannot
// come below its cutoff nobody asks; the others are packed into tiles for cost.comp. Which place a chunk's tiles get depends on who comes
// first, but every partial sum has a place of its own, so that no cost does.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "bounds.glsl"

layout(constant_id = kSpecLoss) const uint kLoss = 0;
layout(constant_id = kSpecTile) const uint kTile = 8;
layout(constant_id = kSpecSpan) const uint kSpan = 64;
const uint kWords = kSpan / 32;

layout(set = 0, binding = kBindPartials, std430) writeonly buffer Partials { float partials[]; };
layout(set = 0, binding = kBindWork, std430) buffer Work { uint work[]; };

shared uint is_open[kQuad * kWords];

// The partial sums that the chunk's caps leave, as cost.comp would.
void add_caps(uint chunk, uint model) {
  const uint own = push.partials / push.chunks;  // partial sums of a chunk
  const uint first = kBoundColumns * push.bound_stride + (kLoss == kLossL2 ? push.partials : 0) + chunk * own;
  for (uint i = first; i < first + own; ++i) partials[model * push.partials + chunk * own + (i - first)] = bounds[i / 4][i % 4];
}

// Tiles for so many open models of a chunk, the first of them at `place` in its row.
void add_tiles(uint chunk, uint place, uint count) {
  const uint tiles = (count + kTile - 1) / kTile;
  const uint first = atomicAdd(work[kWorkTiles], tiles);
  atomicMax(work[0], min(first + tiles, kTilesAcross));
  atomicMax(work[1], (first + tiles + kTilesAcross - 1) / kTilesAcross);
  atomicAdd(looked_into, count);
  for (uint t = 0; t < tiles; ++t) {
    const uint at = kWorkHead + push.chunks * push.models + 2 * (first + t);
    work[at] = chunk;
    work[at + 1] = (place + t * kTile) << kTileBits | min(kTile, count - t * kTile);
  }
}

void main() {
  const uint group = gl_WorkGroupSize.x;
  const uint lane = gl_LocalInvocationID.x;
  const uint quad = gl_WorkGroupID.x;
  const uint first = gl_WorkGroupID.y * kSpan;
  const uint chunks = min(kQuad, push.chunks - quad * kQuad);
  for (uint i = lane; i < kQuad * kWords; i += group) is_open[i] = 0;
  barrier();
  const vec4 most = four_bounds(kBoundMostCap, quad);
  for (uint i = lane; i < kSpan; i += group) {
    const uint model = first + i;
    if (model >= push.models) break;
    float k[kCoefficientStride];
    load_model(model, k);
    if (lower[model] >= k[kCutoffSlot]) continue;
    const vec4 nearest = nearest_of(quad, k);
    for (uint c = 0; c < chunks; ++c) {
      if (most[c] == 0.0 || nearest[c] > most[c]) {
        add_caps(quad * kQuad + c, model);
      } else {
        atomicOr(is_open[c * kWords + i / 32], 1u << (i % 32));
      }
    }
  }
  barrier();
  for (uint c = 0; c < chunks; ++c) {
    const uint row = kWorkHead + (quad * kQuad + c) * push.models + first;
    uint count = 0;
    for (uint w = 0; w < kWords; ++w) {
      // In their order, whoever came first.
      const uint bits = is_open[c * kWords + w];
      for (uint bit = lane; bit < 32; bit += group) {
        if ((bits >> bit & 1u) != 0) work[row + count + bitCount(bits & ((1u << bit) - 1u))] = first + w * 32 + bit;
      }
      count += bitCount(bits);
    }
    if (lane == c % group && count > 0) add_tiles(quad * kQuad + c, first, count);
  }
}
