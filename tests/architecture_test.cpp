// Reads the source tree and holds the rules of docs/architecture.md: dependencies point one way, the library keeps quiet, files can be
// read in one sitting.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const fs::path root = SWARMFIT_SOURCE_DIR;

struct SourceFile {
  std::string path;  // from the root, with slashes
  std::string text;
  std::vector<std::string> includes;  // as written between <> or ""
};

std::string read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> includes_of(const std::string& text) {
  static const std::regex directive(R"((?:^|\n)[ \t]*#[ \t]*include[ \t]*[<"]([^>"\n]+)[>"])");
  std::vector<std::string> all;
  for (std::sregex_iterator it(text.begin(), text.end(), directive), end; it != end; ++it) all.push_back((*it)[1]);
  return all;
}

// Comments and string literals blanked, so that only code is looked at.
std::string code_of(const std::string& text) {
  static const std::regex not_code(R"(//[^\n]*|/\*[^*]*\*+(?:[^/*][^*]*\*+)*/|"(?:[^"\\\n]|\\.)*")");
  return std::regex_replace(text, not_code, " ");
}

bool starts_with_any(std::string_view text, const std::vector<std::string_view>& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](std::string_view prefix) { return text.starts_with(prefix); });
}

bool is_standard(std::string_view include) { return include.find_first_of("/.") == std::string_view::npos; }

const std::vector<SourceFile>& sources() {
  static const std::vector<SourceFile> all = [] {
    std::vector<SourceFile> found;
    for (const char* room : {"shaders", "kernels", "host", "tests", "bench", "samples", "python"}) {
      if (!fs::exists(root / room)) continue;
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room)) {
        static const std::vector<std::string> kinds = {".cpp", ".hpp", ".h", ".inl", ".glsl", ".comp"};
        if (!entry.is_regular_file() || std::find(kinds.begin(), kinds.end(), entry.path().extension()) == kinds.end()) continue;
        SourceFile file{fs::relative(entry.path(), root).generic_string(), read(entry.path()), {}};
        file.includes = includes_of(file.text);
        found.push_back(std::move(file));
      }
    }
    return found;
  }();
  return all;
}

using Allowed = std::function<bool(std::string_view include)>;

void expect_includes(const std::vector<std::string_view>& folders, const std::vector<std::string_view>& except, const Allowed& allowed) {
  std::size_t seen = 0;
  for (const SourceFile& file : sources()) {
    if (!starts_with_any(file.path, folders) || starts_with_any(file.path, except)) continue;
    ++seen;
    for (const std::string& include : file.includes) EXPECT_TRUE(allowed(include)) << file.path << " includes " << include;
  }
  EXPECT_GT(seen, 0U) << "no source file in " << folders.front();
}

void expect_absent(const std::vector<std::string_view>& folders, const std::vector<std::string_view>& except, const std::string& pattern) {
  const std::regex unwanted(pattern);
  std::size_t seen = 0;
  for (const SourceFile& file : sources()) {
    if (!starts_with_any(file.path, folders) || starts_with_any(file.path, except)) continue;
    ++seen;
    const std::string code = code_of(file.text);
    std::smatch match;
    EXPECT_FALSE(std::regex_search(code, match, unwanted)) << file.path << " has " << match.str();
  }
  EXPECT_GT(seen, 0U) << "no source file in " << folders.front();
}

/// What prints, ends the process, or reads or changes what belongs to it as a whole.
constexpr const char* kLoud =
    R"(\bstd::w?(cout|cerr|clog)\b|\b(stdout|stderr|environ|STDOUT_FILENO|STDERR_FILENO)\b|)"
    R"(\b(v?f?printf|puts|fputs|putchar|perror|fmt::print|std::print(ln)?|(secure_)?getenv|setenv|putenv|setlocale|)"
    R"(abort|exit|_exit|_Exit|quick_exit|terminate|system)\s*\()";

TEST(Architecture, TheReaderOfSourcesSeesWhatIsThere) {
  for (const char* loud : {"std::cout << 1;", "auto& out = std::cerr;", "std::fprintf(file, x)", "fwrite(p, 1, n, stdout)", "std::exit (1)",
                           "secure_getenv(name)", "std::terminate()", "std::abort()", "fmt::print(x)", "setlocale(LC_ALL, x)"}) {
    EXPECT_TRUE(std::regex_search(code_of(loud), std::regex(kLoud))) << loud;
  }
  for (const char* quiet :
       {"snprintf(buffer, n, x)", "on_exit(1)", "fmt::format(x)", "// printf(", "file_system(x)", "terminated = exits"}) {
    EXPECT_FALSE(std::regex_search(code_of(quiet), std::regex(kLoud))) << quiet;
  }
  EXPECT_EQ(includes_of("#pragma once\n#include <a/b.hpp>\n  # include \"c.h\"\n// #include <no>\n"),
            (std::vector<std::string>{"a/b.hpp", "c.h"}));
  EXPECT_EQ(code_of("a; // printf(\nb = \"printf(\"; /* printf( */ c;"), "a;  \nb =  ;   c;");
  const auto fit =
      std::find_if(sources().begin(), sources().end(), [](const SourceFile& f) { return f.path == "host/include/swarmfit/fit.hpp"; });
  ASSERT_NE(fit, sources().end());
  EXPECT_NE(std::find(fit->includes.begin(), fit->includes.end(), "swarmfit/model.hpp"), fit->includes.end());
}

TEST(Architecture, KernelsKnowNothingOfTheHost) {
  expect_includes({"kernels/"}, {}, [](std::string_view include) { return !starts_with_any(include, {"host/", "swarmfit/"}); });
}

TEST(Architecture, ShadersIncludeOnlyShaders) {
  expect_includes({"shaders/"}, {}, [](std::string_view include) {
    return is_standard(include) || include == "stdint.h" || fs::exists(root / "shaders" / include) ||
           include == "models.glsl";  // written by the build, see shaders/CMakeLists.txt
  });
}

TEST(Architecture, OnlyKernelsKnowDevices) {
  expect_includes({"host/", "samples/"}, {}, [](std::string_view include) {
    return !starts_with_any(include,
                            {"vulkan", "glslang", "SPIRV", "spirv", "tbb/", "oneapi/", "hwy/", "immintrin", "x86intrin", "arm_neon"});
  });
}

TEST(Architecture, TheHostSpeaksToTheSeam) {
  expect_includes({"host/"}, {}, [](std::string_view include) {
    return !starts_with_any(include, {"kernels/cpu/", "kernels/vulkan/", "kernels/reference/", "shaders/"});
  });
}

TEST(Architecture, FittingKnowsNothingOfPerception) {
  expect_includes({"host/common/", "host/models/", "host/swarm/"}, {}, [](std::string_view include) {
    return !starts_with_any(include, {"host/perception/", "host/cli/", "host/io/"});
  });
  expect_includes({"host/common/"}, {}, [](std::string_view include) {
    return !starts_with_any(include, {"host/models/", "host/swarm/"});
  });
}

TEST(Architecture, InstalledHeadersNeedOnlyEigenAndExpected) {
  const auto allowed = [](std::string_view include) {
    return is_standard(include) || starts_with_any(include, {"swarmfit/", "Eigen/"}) || include == "tl/expected.hpp";
  };
  expect_includes({"host/include/"}, {"host/include/swarmfit/adapters/opencv.hpp"}, allowed);
  // cv::Mat is no template: its adapter alone names the library it is for.
  expect_includes({"host/include/swarmfit/adapters/opencv.hpp"}, {},
                  [&](std::string_view include) { return allowed(include) || include == "opencv2/core.hpp"; });
}

TEST(Architecture, AdaptersCostNothingUnlessAskedFor) {
  expect_includes({"kernels/", "host/", "python/"}, {"host/include/swarmfit/adapters/"},
                  [](std::string_view include) { return !include.starts_with("swarmfit/adapters/"); });
}

TEST(Architecture, TheCommandUsesInstalledHeaders) {
  expect_includes({"host/cli/"}, {}, [](std::string_view include) {
    // A terminal, signals, and the process itself.
    const bool posix = include == "unistd.h" || include == "fcntl.h" || include == "dlfcn.h" || include == "malloc.h" ||
                       include == "pthread.h" || include.starts_with("sys/");
    return is_standard(include) || posix || starts_with_any(include, {"swarmfit/", "host/cli/", "Eigen/", "CLI/", "fmt/", "nlohmann/"});
  });
}

TEST(Architecture, ThePythonPackageUsesInstalledHeaders) {
  expect_includes({"python/"}, {}, [](std::string_view include) {
    return is_standard(include) || starts_with_any(include, {"swarmfit/", "python/", "Eigen/", "nanobind/"});
  });
}

TEST(Architecture, SamplesUseInstalledHeaders) {
  expect_includes({"samples/"}, {"samples/pcl_"}, [](std::string_view include) {
    return is_standard(include) || starts_with_any(include, {"swarmfit/", "Eigen/"});
  });
  expect_includes({"samples/pcl_"}, {}, [](std::string_view include) {
    return is_standard(include) || starts_with_any(include, {"swarmfit/", "Eigen/", "pcl/"});
  });
}

TEST(Architecture, OnlyTestsAndBenchesKnowTheirFrameworks) {
  expect_includes({""}, {"tests/", "bench/"}, [](std::string_view include) {
    return !starts_with_any(include, {"gtest/", "gmock/", "benchmark/", "tests/", "bench/"});
  });
}

TEST(Architecture, NothingBelowTheCommandPrintsExitsOrReadsTheEnvironment) {
  expect_absent({"kernels/", "host/"}, {"host/cli/"}, kLoud);
  expect_includes({"kernels/", "host/"}, {"host/cli/"}, [](std::string_view include) { return include != "iostream"; });
}

TEST(Architecture, NothingIsLeftForLater) {
  for (const SourceFile& file : sources()) {
    if (file.path == "tests/architecture_test.cpp") continue;
    for (const char* word : {"TODO", "FIXME", "XXX"}) EXPECT_EQ(file.text.find(word), std::string::npos) << file.path << " says " << word;
  }
}

TEST(Architecture, AFileCanBeReadInOneSitting) {
  for (const SourceFile& file : sources()) {
    const auto lines = std::count(file.text.begin(), file.text.end(), '\n');
    EXPECT_LE(lines, 600) << file.path;
  }
}

TEST(Architecture, HeadersAreReadOnce) {
  for (const SourceFile& file : sources()) {
    // Highway reads *-inl.hpp once for each instruction set.
    if (!file.path.ends_with(".hpp") || file.path.ends_with("-inl.hpp")) continue;
    EXPECT_NE(file.text.find("#pragma once\n"), std::string::npos) << file.path;
  }
}

TEST(Architecture, NoBuildFileAsksForThisMachineOnly) {
  std::size_t seen = 0;
  const auto check = [&](const fs::path& file) {
    ++seen;
    EXPECT_EQ(read(file).find("march=native"), std::string::npos) << file;
  };
  check(root / "CMakeLists.txt");
  check(root / "CMakePresets.json");
  for (const char* room : {"cmake", "shaders", "kernels", "host", "tests", "samples", "python", "tools"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room)) {
      const fs::path& path = entry.path();
      if (path.filename() == "CMakeLists.txt" || path.extension() == ".cmake" || path.extension() == ".sh") check(path);
    }
  }
  EXPECT_GT(seen, 10U);
}

// The picture in docs/architecture.md: every room it shows exists, and every room there is, it shows.
TEST(Architecture, TheDocumentedRoomsAreTheRoomsThereAre) {
  const std::string document = read(root / "docs/architecture.md");
  static const std::regex room_line(R"(\n( *)([a-z0-9_]+)/ )");
  const std::size_t begin = document.find("```\n"), end = document.find("\n```", begin + 1);
  ASSERT_NE(end, std::string::npos) << "no picture in docs/architecture.md";
  const std::string picture = document.substr(begin, end - begin);

  std::vector<std::string> shown;
  std::string parent;
  for (std::sregex_iterator it(picture.begin(), picture.end(), room_line), last; it != last; ++it) {
    const std::string name = (*it)[2];
    if ((*it)[1].length() == 0) parent = name;
    shown.push_back((*it)[1].length() == 0 ? name : parent + "/" + name);
    EXPECT_TRUE(fs::is_directory(root / shown.back())) << "docs/architecture.md shows " << shown.back();
  }
  for (const char* parent_room : {"kernels", "host", "shaders"}) {
    for (const fs::directory_entry& entry : fs::directory_iterator(root / parent_room)) {
      if (!entry.is_directory() || entry.path().filename() == "__pycache__") continue;
      const std::string room = fs::relative(entry.path(), root).generic_string();
      EXPECT_NE(std::find(shown.begin(), shown.end(), room), shown.end()) << "docs/architecture.md does not show " << room;
    }
  }
}

TEST(Readme, ShowsTheProgramThatIsCompiledAndRun) {
  const std::string readme = read(root / "README.md"), program = read(root / "samples/readme.cpp");
  ASSERT_FALSE(program.empty());
  EXPECT_NE(readme.find("```cpp\n" + program + "```"), std::string::npos) << "README.md must hold samples/readme.cpp word for word";
}

TEST(OwnModels, AreDocumentedByTheSampleThatIsCompiledAndRun) {
  const std::string page = read(root / "docs/own_models.md"), sample = read(root / "samples/own_ellipse.cpp");
  const std::size_t begin = page.find("```cpp\n") + 7, end = page.find("```", begin);
  ASSERT_NE(end, std::string::npos);
  EXPECT_NE(sample.find(page.substr(begin, end - begin)), std::string::npos)
      << "docs/own_models.md must show lines of samples/own_ellipse.cpp";
}

TEST(Readme, EveryFileItPointsToExists) {
  static const std::regex link(R"(\]\(([^)#:]+)\))");
  for (const char* page : {"README.md", "CONTRIBUTING.md", "docs/architecture.md", "docs/embedding.md", "docs/fitting.md", "docs/method.md",
                           "docs/own_models.md", "docs/performance.md", "docs/report.md"}) {
    const std::string text = read(root / page);
    ASSERT_FALSE(text.empty()) << page;
    for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
      EXPECT_TRUE(fs::exists((root / page).parent_path() / (*it)[1].str())) << page << " points to " << (*it)[1];
    }
  }
}

}  // namespace
