// The summary a person reads.
#pragma once

#include <string>
#include <vector>

#include <swarmfit/cloud.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit::cli {

/// Rows of cells, printed with columns lined up; numbers to the right.
std::string table(const std::vector<std::vector<std::string>>& rows);

std::string summary(const FitResult& result, const Cloud& input, double load_ms);
std::string summary(const PerceiveResult& result, const Cloud& input);

}  // namespace swarmfit::cli
