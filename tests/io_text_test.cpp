#include <cmath>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include <swarmfit/cloud.hpp>

#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using tests::TemporaryFolder;

void expect_complaint(const std::filesystem::path& file, const char* what) {
  const auto cloud = read_cloud(file);
  ASSERT_FALSE(cloud) << what;
  EXPECT_EQ(cloud.error().kind, Error::Kind::bad_input);
  EXPECT_NE(cloud.error().message.find(what), std::string::npos) << cloud.error().message;
  EXPECT_EQ(cloud.error().message.find('\n'), std::string::npos);
}

TEST(Xyz, PlainAndColoured) {
  const TemporaryFolder folder;
  const auto plain = read_cloud(folder.put("a.xyz", "# x y z\n 500000.0625\t5400000.5  1e-3\r\n\n1 2 nan"));
  ASSERT_TRUE(plain) << plain.error().message;
  ASSERT_EQ(plain->size(), 2U);
  EXPECT_EQ(plain->values64[0], 500000.0625);
  EXPECT_EQ(plain->values64[2], 1e-3);
  EXPECT_TRUE(std::isnan(plain->values64[5]));
  EXPECT_FALSE(plain->coloured());
  const auto whole = read_cloud(folder.put("b.xyz", "0 0 1 255 128 1\n0 0 2 0 0 0\n"));
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->rgb, (std::vector<std::uint8_t>{255, 128, 1, 0, 0, 0}));
  const auto unit = read_cloud(folder.put("c.xyz", "0 0 1 1.0 0.5 0\n"));
  ASSERT_TRUE(unit) << unit.error().message;
  EXPECT_EQ(unit->rgb, (std::vector<std::uint8_t>{255, 128, 0}));
}

TEST(Xyz, NormalsAreNoColours) {
  const TemporaryFolder folder;
  const auto cloud = read_cloud(folder.put("a.xyz", "0 0 1 0 0 1\n0 1 1 0.6 0 -0.8\n1 0 1 nan nan nan\n"));
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->values64, (std::vector<double>{0, 0, 1, 0, 1, 1, 1, 0, 1}));
  EXPECT_FALSE(cloud->coloured());
  expect_complaint(folder.put("b.xyz", "0 0 1 0 0 -1\n0 0 2 0 0 2\n"), "colour b: -1, must be in 0..255");
}

TEST(Xyz, Faults) {
  const TemporaryFolder folder;
  expect_complaint(folder.put("a.xyz", "1 2\n"), "2 columns");
  expect_complaint(folder.put("b.xyz", "1 2 3\n1 2 3 4 5 6\n"), "line 2");
  expect_complaint(folder.put("c.xyz", "1 2 3 4 5 6 7\n"), "more than 6");
  expect_complaint(folder.put("d.xyz", "1 2 three\n"), "'three'");
  expect_complaint(folder.put("e.xyz", "1 2 1e999\n"), "'1e999'");
  expect_complaint(folder.put("f.xyz", "1 2 3 0 0 256\n"), "256");
  expect_complaint(folder.put("g.xyz", "\n# nothing\n"), "no points");
  expect_complaint(folder.put("h.xyz", ""), "empty");
}

TEST(Csv, ColumnsByNameAndByCount) {
  const TemporaryFolder folder;
  const auto read = [&](const char* text) {
    auto cloud = read_cloud(folder.put("a.csv", text));
    EXPECT_TRUE(cloud) << cloud.error().message;
    return cloud ? *cloud : Cloud{};
  };
  const Cloud line = read("x,y,label\n0.5,1,3\n2,3,0\n");
  EXPECT_EQ(line.dimension, 2);
  EXPECT_EQ(line.values64, (std::vector<double>{0.5, 1, 2, 3}));
  EXPECT_EQ(read("\xEF\xBB\xBF\"X\" , \"Y\",Z\r\n1, 2 ,\"3\"\r\n").values64, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(read("label,y2,x2,y1,x1\n9,4,3,2,1\n").values64, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(read("1,2\n3,4\n").dimension, 2);
  EXPECT_EQ(read("1,2,3\n3,4,5\n").dimension, 3);
  EXPECT_EQ(read("1,2,3,4\n").dimension, 4);
  EXPECT_EQ(read("label,x,y\nouter,1,2\n").values64, (std::vector<double>{1, 2}));
}

TEST(Csv, Faults) {
  const TemporaryFolder folder;
  expect_complaint(folder.put("a.csv", "x,y\n1,2\n3\n"), "line 3");
  expect_complaint(folder.put("b.csv", "1,2\n3,4,5\n"), "line 2");
  expect_complaint(folder.put("c.csv", "x,y\n1,b\n"), "'b'");
  expect_complaint(folder.put("d.csv", "x,y\n1,\n"), "column 2");
  expect_complaint(folder.put("e.csv", "x,y,weight\n1,2,3\n"), "x,y,weight");
  expect_complaint(folder.put("f.csv", "x,x,y\n1,2,3\n"), "x,x,y");
  expect_complaint(folder.put("g.csv", "1,2,3,4,5\n"), "5 columns");
  expect_complaint(folder.put("h.csv", "1\n"), "1 columns");
  expect_complaint(folder.put("i.csv", "x,y\n"), "no points");
  expect_complaint(folder.put("j.csv", "\n\n"), "no points");
  expect_complaint(folder.put("k.csv", std::string("x,y\n1,\0\n", 8)), "line 2");
}

}  // namespace
}  // namespace swarmfit
