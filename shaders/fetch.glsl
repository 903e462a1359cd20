// Reading points, caps and coefficients, in two ways that give the same values.
#ifdef SWARMFIT_TEXELS
// A software device reads a storage buffer one invocation after another, with a branch each; a texel of four floats it
// fetches for all of them at once.
layout(set = 0, binding = kBindPointTexels) uniform samplerBuffer points;
layout(set = 0, binding = kBindCapTexels) uniform samplerBuffer caps;
layout(set = 0, binding = kBindCoefficientTexels) uniform samplerBuffer coefficients;

#define FOUR_POINTS(i) texelFetch(points, int(i))
#define FOUR_CAPS(i) texelFetch(caps, int(i))
#define FOUR_COEFFICIENTS(i) texelFetch(coefficients, int(i))
#else
layout(set = 0, binding = kBindPoints, std430) readonly buffer Points { vec4 points[]; };
layout(set = 0, binding = kBindCaps, std430) readonly buffer Caps { vec4 caps[]; };
layout(set = 0, binding = kBindCoefficients, std430) readonly buffer Coefficients { vec4 coefficients[]; };
#define FOUR_POINTS(i) points[i]
#define FOUR_CAPS(i) caps[i]
#define FOUR_COEFFICIENTS(i) coefficients[i]
#endif

#ifdef SWARMFIT_BATCH
#define COLUMN(c) (own.points + (c)*own.column)
#define CAPS own.caps
#else
#define COLUMN(c) ((c) * (push.column_stride / kQuad))
#define CAPS 0
#endif

// Quad q of the cloud: x[c] is column c of its four points.
void load_quad(uint q, out vec4 x[kMaxColumns]) {
  [[unroll]] for (uint c = 0; c < kDimension; ++c) x[c] = FOUR_POINTS(COLUMN(c) + q);
}

vec4 load_caps(uint q) { return FOUR_CAPS(CAPS + q); }

void load_model(uint model, out float k[kCoefficientStride]) {
  [[unroll]] for (uint v = 0; v < kCoefficientStride / 4; ++v) {
    const vec4 four = FOUR_COEFFICIENTS(model * (kCoefficientStride / 4) + v);
    [[unroll]] for (uint i = 0; i < 4; ++i) k[4 * v + i] = four[i];
  }
}
