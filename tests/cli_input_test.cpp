// Input that cannot be used: one line, exit code 3, no file left behind.
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli_runner.hpp"

namespace {

using swarmfit::tests::expect_refusal;
using swarmfit::tests::raw;
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

TEST(CliInput, ABackEndThatIsNotThere) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--backend", "abacus", "--json", "r.json"}, 4, "abacus");
  expect_refusal(folder, {"perceive", "c.xyz", "--backend", "abacus", "--out", "out"}, 4, "abacus");
  expect_refusal(folder, {"demo", "--backend", "abacus", "--out", "out"}, 4, "abacus");
  expect_refusal(folder, {"bench", "--backend", "abacus"}, 4, "abacus");
}

}  // namespace
