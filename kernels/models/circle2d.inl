// circle2d: |x - centre| = radius. GLSL twin: shaders/models/circle2d.glsl. Included by models.inl only.
struct Circle2d : Ball<2> {
  static constexpr ModelKind kind = ModelKind::circle2d;
  static constexpr ModelTraits traits{"circle2d", 2, 3, Ball<2>::coefficient_count, 11 + 2 * kSlowOperation, false, true};
};
