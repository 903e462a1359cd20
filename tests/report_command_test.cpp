// --report of the command: a page, or one clear line and no file.
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <swarmfit/report.hpp>

#include "tests/cli_runner.hpp"

namespace {

using swarmfit::tests::contents;
using swarmfit::tests::expect_refusal;
using swarmfit::tests::Outcome;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

/// A line of 200 points and 100 anywhere.
std::string a_line() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0, 1);
  std::string text = "x,y\n";
  for (int i = 0; i < 300; ++i) {
    const double x = place(random);
    text += std::to_string(x) + "," + std::to_string(i < 200 ? 0.2 + 0.5 * x : place(random)) + "\n";
  }
  return text;
}

TEST(ReportCommand, WritesAPageBesideTheOtherOutputs) {
  const TemporaryFolder folder;
  folder.put("it's a line.csv", a_line());
  const std::vector<std::string> call = {"fit", "line2d", "it's a line.csv", "--report", "page.html", "--json", "r.json", "--seed", "3"};
  if (!swarmfit::check_report()) {
    expect_refusal(folder, call, 3, swarmfit::check_report().error().message);
    return;
  }
  const Outcome outcome = run_swarmfit(folder, call);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const std::string page = contents(folder / "page.html");
  EXPECT_TRUE(page.starts_with("<!doctype html>"));
  EXPECT_NE(page.find(R"("command":"swarmfit fit line2d 'it'\\''s a line.csv' --report page.html --json r.json --seed 3")"),
            std::string::npos);
  EXPECT_NE(page.find(R"({"given":true,"name":"--seed","value":"3"})"), std::string::npos);
  EXPECT_NE(page.find(R"({"given":false,"name":"--preset","value":"fast"})"), std::string::npos);
  EXPECT_EQ(page.find(R"("name":"--json")"), std::string::npos) << "where results go is no setting";
  EXPECT_FALSE(contents(folder / "r.json").empty());
}

TEST(ReportCommand, APathThatCannotBeWrittenIsSaidBeforeAnyWork) {
  if (!swarmfit::check_report()) GTEST_SKIP() << swarmfit::check_report().error().message;
  const TemporaryFolder folder;
  folder.put("c.csv", a_line());
  expect_refusal(folder, {"fit", "line2d", "c.csv", "--report", "nowhere/page.html", "--json", "r.json"}, 3, "nowhere/page.html");
  std::filesystem::create_directory(folder / "page.html");
  expect_refusal(folder, {"fit", "line2d", "c.csv", "--report", "page.html", "--json", "r.json"}, 3, "page.html");
}

TEST(ReportCommand, NothingIsWrittenOfAnInputThatCannotBeUsed) {
  if (!swarmfit::check_report()) GTEST_SKIP() << swarmfit::check_report().error().message;
  const TemporaryFolder folder;
  folder.put("c.csv", "x,y\n1,1\n1,1\n");
  expect_refusal(folder, {"fit", "line2d", "c.csv", "--report", "page.html"}, 3, "coincide");
}

TEST(ReportCommand, IsOfOneFrame) {
  if (!swarmfit::check_report()) GTEST_SKIP() << swarmfit::check_report().error().message;
  const TemporaryFolder folder;
  folder.put("a.xyz", "0 0 1\n");
  folder.put("b.xyz", "0 0 1\n");
  expect_refusal(folder, {"perceive", "a.xyz", "b.xyz", "--report", "page.html"}, 2, "--report: is of one frame");
  expect_refusal(folder, {"demo", "--frames", "3", "--report", "page.html"}, 2, "--report: is of one frame");
}

}  // namespace
