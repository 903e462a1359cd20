// Over frames of the built-in scene: is what has one id one thing?
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>

#include <swarmfit/perception.hpp>
#include <swarmfit/scene.hpp>

namespace swarmfit::cli {

class IdentityCheck {
 public:
  void add(const SceneTruth& truth, const PerceiveResult& result);
  /// A few lines for a person.
  std::string report() const;

 private:
  struct Things {
    std::map<std::size_t, std::uint64_t> last;  ///< true number to the id it was seen by last
    std::set<std::uint64_t> ids;
    std::size_t views = 0, found = 0, changes = 0;

    void see(std::size_t number, std::uint64_t id);
    std::string tell(const char* what) const;
  };
  Things objects_, surfaces_;
};

}  // namespace swarmfit::cli
