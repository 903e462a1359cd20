#include "host/swarm/landscape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::swarm {

Error to_error(const kernels::Failure& failure) {
  switch (failure.kind) {
    case kernels::Failure::Kind::unavailable: return {Error::Kind::backend_unavailable, failure.message};
    case kernels::Failure::Kind::out_of_memory: return {Error::Kind::out_of_memory, failure.message};
    case kernels::Failure::Kind::device: return {Error::Kind::backend_unavailable, failure.message};
    case kernels::Failure::Kind::invalid: break;
  }
  return {Error::Kind::bad_input, failure.message};
}

double Landscape::deflation(const models::Position& theta) const {
  double product = 1;
  for (const models::Position& optimum : optima_) {
    product *= settings_.lambda * std::exp(-settings_.lambda * space_.distance(theta, optimum)) + 1;  // Eq. (5)
  }
  return product;
}

Expected<> Landscape::fitness(std::span<const models::Position> positions, std::span<const double> bests, std::span<double> fitness) {
  const auto width = static_cast<std::size_t>(space_.parameter_count());
  const bool parametric = settings_.deflation == Deflation::parametric;
  parameters_.resize(positions.size() * width);
  factor_.assign(positions.size(), 1.0);
  by_chance_.assign(positions.size(), 0.0);
  cutoffs_.resize(positions.size());
  costs_.resize(positions.size());
  for (std::size_t j = 0; j < positions.size(); ++j) {
    const models::Position data = space_.to_data(positions[j], frame_);
    std::copy(data.begin(), data.end(), parameters_.begin() + static_cast<std::ptrdiff_t>(j * width));
    if (parametric) factor_[j] = deflation(positions[j]);
    if (background_.per_length > 0) {
      by_chance_[j] = background_.per_length * space_.length_within(positions[j], background_.low, background_.high);
    }
    // Rounded up, so that a fitness just below the best is still told exactly.
    cutoffs_[j] = std::nextafter(static_cast<float>((bests[j] - by_chance_[j]) / factor_[j]), std::numeric_limits<float>::infinity());
  }
  const kernels::Loss loss = settings_.loss == Loss::truncated_l1 ? kernels::Loss::truncated_l1 : kernels::Loss::truncated_l2;
  if (auto done = evaluator_.evaluate({space_.kind(), positions.size(), parameters_}, loss, cutoffs_, costs_); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  for (std::size_t j = 0; j < positions.size(); ++j) fitness[j] = static_cast<double>(costs_[j]) * factor_[j] + by_chance_[j];
  return {};
}

Expected<double> Landscape::loss(const models::Position& theta) {
  const models::Position data = space_.to_data(theta, frame_);
  float cost = 0;
  const kernels::Loss kind = settings_.loss == Loss::truncated_l1 ? kernels::Loss::truncated_l1 : kernels::Loss::truncated_l2;
  const kernels::SwarmView one{space_.kind(), 1, std::span<const double>(data.data(), static_cast<std::size_t>(data.size()))};
  if (auto done = evaluator_.evaluate(one, kind, {}, std::span<float>(&cost, 1)); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  return static_cast<double>(cost);
}

}  // namespace swarmfit::swarm
