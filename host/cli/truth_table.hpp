// The built-in scene's truth beside what was found.
#pragma once

#include <string>

#include <swarmfit/perception.hpp>
#include <swarmfit/scene.hpp>

namespace swarmfit::cli {

std::string truth_table(const Scene& scene, const PerceiveResult& result);

}  // namespace swarmfit::cli
