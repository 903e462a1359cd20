// A model of your own: what the library needs to know of it to fit it as it fits those that are built in. See docs/own_models.md.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

/// residuals[i] = distance of points[i D .. i D + D) to the model, of any sign [data unit]. Sizes: N D, P, N. NaN: out of any reach.
using OwnResidual = std::function<void(std::span<const double> points, std::span<const double> parameters, std::span<double> residuals)>;

/// Fitted in place of the built-in kinds with FitOptions::model = ModelType::own. D is `dimension`, P `parameter_count`; points lie row
/// after row, D numbers each. Functions may be called from several threads at a time and must give the same answer each time. One that
/// throws makes the fit fail with bad_input and what it said; with out_of_memory where that is a std::bad_alloc.
struct OwnModel {
  std::string name = "own";  ///< for messages; not empty
  int dimension = 2;         ///< D: columns of a point; 2, 3 or 4
  int parameter_count = 0;   ///< P, in [1, 9]
  int minimal_sample = 0;    ///< points that determine a model, in [1, 8]
  int freedom = 0;           ///< degrees of freedom, in [1, P]; 0: P. Fewer where, say, a x + b y + c = 0 has a length to spare

  /// Required. each_point() makes one of a function of a single point.
  OwnResidual residual;
  /// Required: the model through minimal_sample points (minimal_sample D numbers); false if these determine none. Parameters hold zeros
  /// before and P finite numbers after.
  std::function<bool(std::span<const double> points, std::span<double> parameters)> solve;

  /// The same residual for the Vulkan back end, compiled when a Fitter is created. Must define `float residual(vec2 x, float p[P])`, with
  /// vec3 or vec4 for D = 3 or 4, and may define more beside it. Computed in float. Empty: the model is for the processor alone.
  std::string glsl;

  /// Optional: brings parameters into the form that stands for all that mean the same (unit length, sign, order of axes); false where they
  /// are no model (a negative radius). Must leave parameters in that form as they are.
  std::function<bool(std::span<double> parameters)> normalise;
  /// Optional: the weighted least-squares model near `parameters`; false if the points determine none. Sizes: N D, N, P. Without it the
  /// library takes damped Gauss-Newton steps with numerical derivatives of the residual.
  std::function<bool(std::span<const double> points, std::span<const double> weights, std::span<double> parameters)> refine;
  /// Optional: turns parameters into those of the same model for points from which `centre` (D numbers) is taken away. With it every
  /// function above sees points near the origin only, which keeps float and squares exact far from it; results are in the data's frame all
  /// the same. Without it points are seen as they come.
  std::function<void(std::span<const double> centre, std::span<double> parameters)> recentre;

  /// Fails with invalid_option, naming the field, its value and its bound. GLSL is looked at by Fitter::create.
  SWARMFIT_API Expected<> validate() const;
};

/// A residual of many points from one of a single point: one(x, p) with D and P numbers gives the distance.
template <class One>
OwnResidual each_point(One one) {
  return [one = std::move(one)](std::span<const double> points, std::span<const double> parameters, std::span<double> residuals) {
    if (residuals.empty()) return;
    const std::size_t width = points.size() / residuals.size();
    for (std::size_t i = 0; i < residuals.size(); ++i) residuals[i] = one(points.subspan(i * width, width), parameters);
  };
}

}  // namespace swarmfit
