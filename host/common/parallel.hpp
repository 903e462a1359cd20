// Work on parts of the image side by side.
#pragma once

#include <functional>

namespace swarmfit::common {

/// Calls body(first, last) for ranges of `grain` that make up [0, count); the first are begun first. `threads`: how many are worked on at
/// once at most, 0 as many as the machine has. What the body writes must not depend on where ranges begin or which comes before which.
void in_parallel(int count, int grain, int threads, const std::function<void(int, int)>& body);

}  // namespace swarmfit::common
