// The inner loop of hyperplanes' flight, one function for each instruction set the build knows (flight_kernels.cpp).
#pragma once

#include <vector>

#include "kernels/hyperplane_flight.hpp"

namespace swarmfit::kernels::cpu {

struct FlightKernels {
  const char* name;
  void (*step)(HyperplaneFlight& flight, double inertia);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const FlightKernels*>& available_flight_kernels();

}  // namespace swarmfit::kernels::cpu
