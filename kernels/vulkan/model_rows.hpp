// A model as the shaders read it: a row of kCoefficientStride floats.
#pragma once

#include <span>

#include "kernels/models/models.hpp"

namespace swarmfit::kernels::vulkan {

/// Writes `coefficients`, in the frame of the stored points, or zeros where they are not `finite`; returns that.
bool write_row(ModelKind kind, std::span<const double> coefficients, bool finite, std::span<float> row);
/// The same of a built-in kind's parameters, in the data's frame, about a centre.
bool write_row(ModelKind kind, const double* parameters, const double* centre, std::span<float> row);

}  // namespace swarmfit::kernels::vulkan
