// A search as the page replays it.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <swarmfit/report.hpp>

#include "host/report/encode.hpp"

namespace swarmfit::report {

/// What is told of each step, and in `particles` float32 numbers: a step after another, of each the particles' parameters, one particle
/// after another. Parameters are about `centre`, so that float32 holds them. Kinds of point pairs have no parameters here.
struct Replay {
  nlohmann::json steps;
  Bytes particles;
};

/// `models`: those of the result, by which found models are known again.
Replay replay(const SearchRecord& search, const std::vector<Model>& models, const Eigen::Vector3d& centre);

}  // namespace swarmfit::report
