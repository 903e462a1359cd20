// Input that cannot be used: one line, exit code 3, no file left behind.
#include <string>

#include <sys/stat.h>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli_runner.hpp"

namespace {

using swarmfit::tests::contents;
using swarmfit::tests::expect_refusal;
using swarmfit::tests::raw;
using swarmfit::tests::run_shell;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

std::string pcd(const std::string& width, const std::string& points, const std::string& data) {
  return "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + width + "\nHEIGHT 1\nPOINTS " + points +
         "\nDATA binary\n" + data;
}

TEST(CliInput, FilesThatCannotBeRead) {
  const TemporaryFolder folder;
  const std::string point = raw(1.0F) + raw(2.0F) + raw(3.0F);
  folder.put("empty.pcd", "");
  folder.put("cut.pcd", pcd("4", "4", point + point));
  folder.put("lying.pcd", pcd("2", "4", point + point));
  folder.put("huge.pcd", pcd("18446744073709551615", "18446744073709551615", point));
  folder.put("huge.ply",
             "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000000000000\nproperty double x\nproperty double y\nproperty "
             "double z\nend_header\n12345678");
  folder.put("text.xyz", "1 2 three\n");
  folder.put("ragged.csv", "1,2\n3\n");
  std::filesystem::create_directory(folder / "folder.pcd");
  for (const char* command : {"fit", "perceive"}) {
    const auto refuse = [&](const std::string& file, const std::string& what) {
      std::vector<std::string> arguments = {command};
      if (arguments[0] == "fit") arguments.push_back("plane");
      arguments.insert(arguments.end(), {file, "--out", "out", "--json", "r.json", "--labels", "l.txt"});
      expect_refusal(folder, arguments, 3, what);
    };
    refuse("missing.pcd", "missing.pcd");
    refuse("empty.pcd", "empty");
    refuse("cut.pcd", "POINTS 4");
    refuse("lying.pcd", "POINTS 4");
    refuse("huge.pcd", "WIDTH");
    refuse("huge.ply", "4000000000000000000");
    refuse("text.xyz", "'three'");
    refuse("ragged.csv", "line 2");
    refuse("folder.pcd", "folder");
  }
}

TEST(CliInput, CloudsThatHoldNoModel) {
  const TemporaryFolder folder;
  std::string nothing;
  for (int i = 0; i < 100; ++i) nothing += "nan nan nan\n";
  folder.put("nan.xyz", nothing);
  folder.put("two.xyz", "0 0 1\n1 0 1\n");
  folder.put("xy.csv", "x,y\n1,2\n3,4\n5,6\n7,8\n");
  for (const char* command : {"fit", "perceive"}) {
    for (const char* file : {"nan.xyz", "two.xyz", "xy.csv"}) {
      std::vector<std::string> arguments = {command};
      if (arguments[0] == "fit") arguments.push_back("plane");
      arguments.insert(arguments.end(), {file, "--out", "out", "--json", "r.json"});
      expect_refusal(folder, arguments, 3, "");
    }
  }
  expect_refusal(folder, {"fit", "line2d", "two.xyz", "--json", "r.json"}, 3, "");
}

TEST(CliInput, CoordinatesBeyondNumbers) {
  const TemporaryFolder folder;
  // Enough points that they are sorted, and enough for every kind.
  for (const char* far : {"1e200", "-3e38", "1.1e18"}) {
    std::string points;
    for (int i = 0; i < 900; ++i) points += std::to_string(i % 30) + "," + (i % 7 == 2 ? far : std::to_string(i / 30)) + ",0\n";
    folder.put("far.csv", points);
    const std::string what = "point 3, column 2: ", bound = ", must be in -1e+18..1e+18";
    for (const char* kind : {"plane", "sphere", "plane,sphere,cylinder"}) {
      expect_refusal(folder, {"fit", kind, "far.csv"}, 3, what);
      expect_refusal(folder, {"fit", kind, "far.csv"}, 3, bound);
    }
    expect_refusal(folder, {"perceive", "far.csv"}, 3, what);
    expect_refusal(folder, {"perceive", "far.csv", "--gravity", "0,0,-1"}, 3, bound);
    expect_refusal(folder, {"bench", "--points", "far.csv", "--model", "plane", "--backend", "cpu"}, 3, what);
  }
}

TEST(CliInput, AGalleryOfWhatIsNoFile) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  std::filesystem::create_directory(folder / "things");
  ASSERT_EQ(::mkfifo((folder / "things/mug.png").c_str(), 0600), 0);
  expect_refusal(folder, {"perceive", "c.xyz", "--gallery", "things"}, 3, "regular");
  std::filesystem::remove(folder / "things/mug.png");
  folder.put("things/mug.png", "");
  expect_refusal(folder, {"perceive", "c.xyz", "--gallery", "things"}, 3, "mug.png: is empty");
}

TEST(CliInput, ImagesThatDoNotGoTogether) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "c.png").string(), cv::Mat(30, 40, CV_8UC3, cv::Scalar::all(9)));
  cv::imwrite((folder / "d.png").string(), cv::Mat(30, 41, CV_16U, cv::Scalar::all(9)));
  folder.put("calib.txt", "cam0=[100 0 20; 0 100 15; 0 0 1]\nbaseline=100\nndisp=16\n");
  const std::vector<std::string> camera = {"--intrinsics", "100,100,20,15"};
  expect_refusal(folder, {"perceive", "--color", "c.png", "--depth", "d.png", "--intrinsics", "100,100,20,15"}, 3, "40 x 30");
  expect_refusal(folder, {"perceive", "--color", "c.png", "--depth", "c.png", "--intrinsics", "100,100,20,15"}, 3, "16 bits");
  expect_refusal(folder, {"fit", "plane", "c.png", "--intrinsics", "100,100,20,15"}, 3, "16 bits");
  expect_refusal(folder, {"perceive", "--left", "c.png", "--right", "c.png", "--calib", "calib.txt"}, 3, "doffs is missing");
  expect_refusal(folder, {"perceive", "--left", "c.png", "--right", "none.png", "--calib", "calib.txt"}, 3, "");
  expect_refusal(folder, {"demo", "--motorcycle", "nowhere", "--out", "out"}, 3, "python3-skimage");
}

TEST(CliInput, OutputThatCannotBeWritten) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  folder.put("blocker", "");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--json", "blocker/r.json"}, 3, "blocker/r.json");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--labels", "none/l.txt"}, 3, "none/l.txt");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--out", "blocker/out"}, 3, "blocker");
  expect_refusal(folder, {"perceive", "c.xyz", "--out", "blocker"}, 3, "blocker");
  expect_refusal(folder, {"demo", "--out", "blocker"}, 3, "blocker");
  expect_refusal(folder, {"bench", "--json", "none/b.json"}, 3, "none/b.json");
}

TEST(CliInput, WhatIsPrintedGetsOutOrIsMissed) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  for (const char* call : {"--version", "--help", "fit plane c.xyz", "fit plane c.xyz --quiet --json /dev/stdout", "perceive c.xyz c.xyz",
                           "devices", "doctor", "man", "completion bash"}) {
    const auto outcome = run_shell(folder, "\"$0\" " + std::string(call) + " > /dev/full");
    EXPECT_EQ(outcome.code, 3) << call;
    EXPECT_NE(outcome.err.find(": cannot be written: No space left on device\n"), std::string::npos) << call << "\n" << outcome.err;
  }
  EXPECT_EQ(run_shell(folder, "\"$0\" fit plane c.xyz --quiet > /dev/full").code, 0);
  // Where nobody can be told, the exit code still says it.
  EXPECT_EQ(run_shell(folder, "\"$0\" fit plane none.xyz 2> /dev/full").code, 3);
  EXPECT_EQ(run_shell(folder, "\"$0\" fit plane c.xyz --verbose --quiet 2> /dev/full").code, 0);
  EXPECT_EQ(run_shell(folder, "\"$0\" perceive c.xyz c.xyz 2> /dev/full").code, 0);
}

TEST(CliInput, AHyphenIsStandardOutputAlone) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n0.5 0.5 0\n1.5 0.5 0\n");
  const auto json = run_shell(folder, "\"$0\" fit plane c.xyz --json -");
  EXPECT_EQ(json.code, 0) << json.err;
  EXPECT_EQ(json.out.front(), '{');
  EXPECT_EQ(json.out.substr(json.out.size() - 2), "}\n");
  const auto labels = run_shell(folder, "\"$0\" fit plane c.xyz --labels -");
  EXPECT_EQ(labels.code, 0) << labels.err;
  EXPECT_EQ(labels.out, "1\n1\n1\n1\n1\n1\n1\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "-"));
}

TEST(CliInput, NoFileTakesThePlaceOfAStreamThatIsClosed) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  const std::string fit = "\"$0\" fit plane c.xyz --backend cpu --verbose --labels ";
  EXPECT_EQ(run_shell(folder, fit + "none.txt --quiet 2> .told").code, 0);
  EXPECT_EQ(run_shell(folder, fit + "out.txt >&- 2> .told").code, 3);
  EXPECT_EQ(run_shell(folder, fit + "all.txt <&- >&- 2>&-").code, 3);
  EXPECT_EQ(contents(folder / "out.txt"), contents(folder / "none.txt"));
  EXPECT_EQ(contents(folder / "all.txt"), contents(folder / "none.txt"));
}

TEST(CliInput, APipeIsOpenedOnce) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  // Who reads it is done when whoever writes closes it.
  const auto outcome =
      run_shell(folder, "mkfifo pipe && { cat pipe > copy.txt & timeout 60 \"$0\" fit plane c.xyz --quiet --labels pipe && wait; }");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(contents(folder / "copy.txt"), "0\n0\n0\n0\n0\n");
}

TEST(CliInput, ABackEndThatIsNotThere) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--backend", "abacus", "--json", "r.json"}, 4, "abacus");
  expect_refusal(folder, {"perceive", "c.xyz", "--backend", "abacus", "--out", "out"}, 4, "abacus");
  expect_refusal(folder, {"demo", "--backend", "abacus", "--out", "out"}, 4, "abacus");
  expect_refusal(folder, {"bench", "--backend", "abacus"}, 4, "abacus");
}

}  // namespace
