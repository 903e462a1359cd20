// Shared by C++ and GLSL: where buffers are bound, which specialisation constant is which, and what is pushed.
#ifndef SWARMFIT_SHADERS_LAYOUT_H
#define SWARMFIT_SHADERS_LAYOUT_H

#ifdef __cplusplus
#include <cstdint>
#define SWARMFIT_CONST inline constexpr std::uint32_t
namespace swarmfit::kernels::layout {
using uint = std::uint32_t;
#else
#define SWARMFIT_CONST const uint
#endif

// One descriptor set for all shaders.
SWARMFIT_CONST kBindPoints = 0;        // column after column, `column_stride` floats each, read four points at a time
SWARMFIT_CONST kBindCaps = 1;          // one a point; assign.comp reads tolerances here
SWARMFIT_CONST kBindCoefficients = 2;  // kCoefficientStride floats a model
SWARMFIT_CONST kBindPartials = 3;      // [model][partial sum]; distances and labels are written here
SWARMFIT_CONST kBindCosts = 4;         // [model]
SWARMFIT_CONST kBindBounds = 5;        // of chunks: columns of push.bound_stride floats, then partial sums of the caps, L1 and L2
SWARMFIT_CONST kBindLower = 6;         // pairs of a chunk and a model that were looked into; then a lower bound of each model's cost
SWARMFIT_CONST kBindWork = 7;          // pruned: what is left to compute; batch: what is asked; see below
SWARMFIT_CONST kStorageBindings = 8;
// The first four once more, as texel buffers, four floats a texel: see fetch.glsl.
SWARMFIT_CONST kBindPointTexels = 8;
SWARMFIT_CONST kBindCapTexels = 9;
SWARMFIT_CONST kBindCoefficientTexels = 10;
SWARMFIT_CONST kBindPartialTexels = 11;
SWARMFIT_CONST kBindingCount = 12;

// Specialisation constants.
SWARMFIT_CONST kSpecGroup = 0;      // invocations in a group: the subgroup's size or a multiple of it
SWARMFIT_CONST kSpecModel = 1;      // a ModelKind; assign: kAnyModel where there are several
SWARMFIT_CONST kSpecLoss = 2;       // a Loss
SWARMFIT_CONST kSpecDimension = 3;  // columns of a point
SWARMFIT_CONST kSpecTile = 4;       // particles held by an invocation
SWARMFIT_CONST kSpecWork = 5;       // quads (four points) an invocation goes through
SWARMFIT_CONST kSpecSpan = 6;       // select: models that a group of invocations looks at; a multiple of 32
SWARMFIT_CONST kSpecCount = 7;

SWARMFIT_CONST kAnyModel = 0xFFFFFFFFu;
SWARMFIT_CONST kLossL1 = 0;
SWARMFIT_CONST kLossL2 = 1;

SWARMFIT_CONST kMaxColumns = 4;
SWARMFIT_CONST kCoefficientStride = 20;  // floats from one model to the next: kMaxCoefficients coefficients, then
SWARMFIT_CONST kSlackSlot = 15;          // pruned: what rounding may do to a distance
SWARMFIT_CONST kSteepSlot = 16;          // pruned: how much a distance changes, at most, from one point to another as far apart as 1
SWARMFIT_CONST kCutoffSlot = 17;         // pruned: what its cost is compared with
SWARMFIT_CONST kKindSlot = 18;           // assign: its ModelKind
SWARMFIT_CONST kNumberSlot = 19;         // assign: its label
SWARMFIT_CONST kQuad = 4;

// Columns of a chunk's bounds: the mean of its points, one a column of theirs, and then
SWARMFIT_CONST kBoundRadius = 4;   // of a ball about the mean that holds them
SWARMFIT_CONST kBoundMostCap = 5;  // of its caps
SWARMFIT_CONST kBoundCapSum = 6;   // sum of its caps; then of their squares
SWARMFIT_CONST kBoundAxes = 8;     // of a box about the mean: half an edge after the other, as many columns each as a point has
SWARMFIT_CONST kBoundColumns = 17;

// What a pruned swarm leaves to compute, in words: the arguments of an indirect dispatch, how many tiles it has, then a row a chunk of the
// models that are open there, push.models wide, then two words a tile: its chunk, and (place in the row << kTileBits | models in it).
SWARMFIT_CONST kWorkTiles = 3;
SWARMFIT_CONST kWorkHead = 4;
SWARMFIT_CONST kTileBits = 8;
SWARMFIT_CONST kTilesAcross = 32768;  // groups along x; more tiles go on along y

// What a batch asks: for each of its dispatches, in vec4s of words, the arguments of an indirect dispatch of costs and the number of its
// first item, and the arguments of the reduction; then the items, as batch.glsl has them. An item is a problem and its swarm.
SWARMFIT_CONST kBatchHead = 2;         // vec4s a dispatch
SWARMFIT_CONST kBatchDispatches = 32;  // at most
SWARMFIT_CONST kBatchHeads = 64;       // vec4s of all
SWARMFIT_CONST kItemWords = 8;

struct Push {
  uint column_stride;  // points in a column, padding included; a multiple of kQuad
  uint partials;       // partial sums of a particle: one a chunk of points, or one an invocation of a chunk
  uint models;         // assign, pruned: how many; batch: the number of the dispatch
  float tolerance;     // assign: for all points; negative where each has its own
  uint bound_stride;   // chunks, padded to a multiple of kQuad
  uint chunks;         // pruned: of the points
};

#ifdef __cplusplus
}  // namespace swarmfit::kernels::layout
#endif
#undef SWARMFIT_CONST
#endif
