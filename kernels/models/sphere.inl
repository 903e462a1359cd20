// sphere: |x - centre| = radius. GLSL twin: shaders/models/sphere.glsl. Included by models.inl only.
struct Sphere : Ball<3> {
  static constexpr ModelKind kind = ModelKind::sphere;
  static constexpr ModelTraits traits{"sphere", 3, 4, Ball<3>::coefficient_count, 16 + 2 * kSlowOperation, false, true};
};
