// What a batch asks: several small problems in one dispatch, an item each; see layout.h.
struct Item {
  uint points;    // where its points begin, in quads
  uint column;    // quads in a column of them
  uint caps;      // where its caps begin, in quads
  uint chunks;    // of its points
  uint partials;  // partial sums of a model
  uint sums;      // where the first of them is
  uint row;       // of its first model; costs have the same
  uint models;
};
layout(set = 0, binding = kBindWork, std430) readonly buffer Asked {
  uvec4 heads[kBatchHeads];
  Item items[];
};

Item own;  // that of this group of invocations

// Of dispatch push.models, the item along y.
void take_item() { own = items[heads[push.models * kBatchHead].w + gl_WorkGroupID.y]; }
