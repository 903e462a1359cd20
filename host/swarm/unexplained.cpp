#include "host/swarm/unexplained.hpp"

#include "host/swarm/landscape.hpp"

namespace swarmfit::swarm {

void Unexplained::restore() { cap_all(problem_.ground, caps_); }

Expected<> Unexplained::show(std::span<const float> caps) {
  problem_.part.gather(caps, part_caps_);
  if (auto done = problem_.evaluator.set_caps(problem_.part_searched ? part_caps_ : caps); !done)
    return tl::unexpected(to_error(done.error()));
  return {};
}

std::size_t Unexplained::count() const noexcept {
  std::size_t left = 0;
  for (std::size_t i = 0; i < caps_.size(); ++i) left += caps_[i] >= kUnexplained * problem_.ground.allowed_at(i) ? 1 : 0;
  return left;
}

}  // namespace swarmfit::swarm
