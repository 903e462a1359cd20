#include "host/perception/assignment.hpp"

#include <algorithm>
#include <limits>

namespace swarmfit::perception {

std::vector<int> assign(const std::vector<double>& costs, std::size_t columns, double limit) {
  const std::size_t rows = columns == 0 ? 0 : costs.size() / columns;
  std::vector<int> chosen(rows, -1);
  // Beside the columns that are there, each row has one of its own at `limit`: to be left alone. Row and column 0 stand for none.
  const std::size_t width = columns + rows;
  const double forbidden = limit * static_cast<double>(width + rows + 1);
  const auto cost = [&](std::size_t row, std::size_t column) {
    if (column > columns) return column - columns == row ? limit : forbidden;
    const double c = costs[(row - 1) * columns + column - 1];
    return c < limit ? c : forbidden;
  };
  std::vector<double> row_price(rows + 1, 0), column_price(width + 1, 0);
  std::vector<std::size_t> taken_by(width + 1, 0), came_from(width + 1, 0);
  for (std::size_t row = 1; row <= rows; ++row) {
    std::vector<double> least(width + 1, std::numeric_limits<double>::infinity());
    std::vector<bool> reached(width + 1, false);
    std::size_t at = 0;
    taken_by[0] = row;
    do {  // the cheapest way from the new row to a free column
      reached[at] = true;
      const std::size_t from = taken_by[at];
      std::size_t next = 0;
      for (std::size_t column = 1; column <= width; ++column) {
        if (reached[column]) continue;
        const double reduced = cost(from, column) - row_price[from] - column_price[column];
        if (reduced < least[column]) {
          least[column] = reduced;
          came_from[column] = at;
        }
        if (next == 0 || least[column] < least[next]) next = column;
      }
      const double step = least[next];
      for (std::size_t column = 0; column <= width; ++column) {
        if (reached[column]) {
          row_price[taken_by[column]] += step;
          column_price[column] -= step;
        } else {
          least[column] -= step;
        }
      }
      at = next;
    } while (taken_by[at] != 0);
    for (; at != 0; at = came_from[at]) taken_by[at] = taken_by[came_from[at]];
  }
  for (std::size_t column = 1; column <= columns; ++column)
    if (taken_by[column] != 0) chosen[taken_by[column] - 1] = static_cast<int>(column - 1);
  return chosen;
}

}  // namespace swarmfit::perception
