// The summary a person reads, on lines of 80 columns.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <swarmfit/cloud.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit::cli {

/// "1 plane", "2 planes".
std::string count(std::size_t n, const char* thing);

/// Rows of cells, printed with columns lined up; numbers to the right. Cells are wrapped so that a line has 80 columns, if words allow it.
std::string table(const std::vector<std::vector<std::string>>& rows);

std::string summary(const FitResult& result, const Cloud& input, double load_ms);
std::string summary(const PerceiveResult& result, const Cloud& input);

/// What was decided on the way, a line a decision: for --verbose.
std::vector<std::string> explanation(const FitResult& result, const Cloud& input);
std::string stages(const std::vector<std::pair<const char*, double>>& times_ms);

}  // namespace swarmfit::cli
