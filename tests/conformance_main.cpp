// gtest's main, and one flag: --require-backend NAME turns the skipping of that back end into a failure.
#include <cstdio>
#include <cstring>

#include "conformance.hpp"

using namespace swarmfit::kernels::conformance;

namespace {

class Summary : public testing::Environment {
 public:
  void TearDown() override {
    validation_messages().clear();
    release_evaluators();
    for (const std::string& message : validation_messages()) ADD_FAILURE() << "validation, at the end: " << message;
    print_summary();
  }
};

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--require-backend") != 0 || i + 1 >= argc || contenders(argv[i + 1]).empty()) {
      std::fprintf(stderr, "usage: %s [--require-backend reference|cpu|vulkan] [gtest's flags]; got '%s'\n", argv[0], argv[i]);
      return 2;
    }
    required_backends().insert(argv[++i]);
  }
  testing::AddGlobalTestEnvironment(new Summary);
  return RUN_ALL_TESTS();
}
