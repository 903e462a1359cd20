#include <cmath>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include <swarmfit/cloud.hpp>

#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using tests::raw;
using tests::TemporaryFolder;

std::string complaint(const std::filesystem::path& file) {
  const auto cloud = read_cloud(file);
  if (cloud) return "was read";
  EXPECT_EQ(cloud.error().kind, Error::Kind::bad_input);
  EXPECT_EQ(cloud.error().message.find('\n'), std::string::npos);
  return cloud.error().message;
}

TEST(Ply, AsciiWithListsCommentsAndFaces) {
  const TemporaryFolder folder;
  const auto cloud = read_cloud(
      folder.put("a.ply",
                 "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info none\r\nelement camera 1\nproperty list uchar float view\n"
                 "element vertex 2\nproperty list uchar int seen\nproperty double y\nproperty double x\nproperty float z\n"
                 "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n"
                 "end_header\n2 0.5 0.5\n3 7 8 9 5400000.0625 500000.5 1 10 20 30\n0 2 1 nan 40 50 60\n2 0 1\n"));
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->size(), 2U);
  EXPECT_EQ(cloud->values64[0], 500000.5);
  EXPECT_EQ(cloud->values64[1], 5400000.0625);
  EXPECT_TRUE(std::isnan(cloud->values64[5]));
  EXPECT_EQ(cloud->rgb, (std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60}));
}

class PlyBinary : public testing::TestWithParam<bool> {};

TEST_P(PlyBinary, FloatsStayFloatsInEitherOrderOfBytes) {
  const bool big = GetParam();
  const TemporaryFolder folder;
  std::string text = std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
                     " 1.0\nelement before 2\nproperty list ushort short values\nelement vertex 300\nproperty ushort tag\nproperty float "
                     "x\nproperty float y\n"
                     "property float z\nproperty uchar blue\nproperty uchar green\nproperty uchar red\nelement face 1\nproperty list uchar "
                     "int32 vertex_indices\nend_header\n";
  text += raw(std::uint16_t{3}, big) + std::string(6, 'l') + raw(std::uint16_t{0}, big);
  for (int i = 0; i < 300; ++i) {
    const auto f = static_cast<float>(i);
    text += raw(std::uint16_t{9}, big) + raw(f + 0.5F, big) + raw(-f, big) + raw(2 * f, big) + raw(std::uint8_t{3}) + raw(std::uint8_t{2}) +
            raw(static_cast<std::uint8_t>(i % 256));
  }
  text += raw(std::uint8_t{1}) + raw(std::int32_t{0}, big);
  const auto cloud = read_cloud(folder.put("b.ply", text));
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->size(), 300U);
  EXPECT_TRUE(cloud->values64.empty());
  for (std::size_t i = 0; i < 300; ++i) {
    EXPECT_EQ(cloud->values32[3 * i], static_cast<float>(i) + 0.5F);
    EXPECT_EQ(cloud->values32[3 * i + 1], -static_cast<float>(i));
    EXPECT_EQ(cloud->values32[3 * i + 2], 2 * static_cast<float>(i));
    EXPECT_EQ(cloud->rgb[3 * i], i % 256);
    EXPECT_EQ(cloud->rgb[3 * i + 2], 3);
  }
}

TEST_P(PlyBinary, DoublesAndAListWithinTheVertex) {
  const bool big = GetParam();
  const TemporaryFolder folder;
  std::string text =
      std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
      " 1.0\nelement vertex 2\nproperty double x\nproperty list uchar double extra\nproperty double y\nproperty int z\nend_header\n";
  text += raw(500000.0625, big) + raw(std::uint8_t{2}) + raw(1.0, big) + raw(2.0, big) + raw(5400000.5, big) + raw(std::int32_t{-3}, big);
  text += raw(7.0, big) + raw(std::uint8_t{0}) + raw(8.0, big) + raw(std::int32_t{9}, big);
  const auto whole = read_cloud(folder.put("l.ply", text));
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->values64, (std::vector<double>{500000.0625, 5400000.5, -3, 7, 8, 9}));
  EXPECT_FALSE(whole->coloured());
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_FALSE(read_cloud(folder.put("cut.ply", text.substr(0, size)))) << size << " of " << text.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Order, PlyBinary, testing::Bool(), [](const auto& order) { return order.param ? "big" : "little"; });

TEST(Ply, FaultsAreNamed) {
  const TemporaryFolder folder;
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const auto ply = [&](const std::string& format, const std::string& count, const std::string& properties, const std::string& data) {
    return folder.put("f.ply", "ply\nformat " + format + " 1.0\nelement vertex " + count + "\n" + properties + "end_header\n" + data);
  };
  const std::string point(12, 'p');
  const auto expect = [](const std::filesystem::path& file, const char* what) {
    const std::string message = complaint(file);
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  expect(ply("binary_little_endian", "2", xyz, point), "counts 2");
  expect(ply("binary_little_endian", "1", xyz, point + point), "12 more bytes");
  expect(ply("binary_little_endian", "1537228672809129302", xyz, point), "1537228672809129302");
  expect(ply("binary_little_endian", "99999999999999999999", xyz, point), "99999999999999999999");
  expect(ply("binary_little_endian", "-1", xyz, point), "-1");
  expect(ply("binary_little_endian", "0", xyz, ""), "counts 0");
  expect(ply("ascii", "3", xyz, "1 2 3\n4 5 6          \n"), "ends after 2");
  expect(ply("ascii", "1", xyz, "1 2 3\n4 5 6\n"), "do not match");
  expect(ply("ascii", "1", xyz, "1 2 x\n"), "'x'");
  expect(ply("ascii", "1", xyz, "1 2    \n"), "'z'");
  expect(ply("ascii", "1", xyz, "1 2 3 4\n"), "more values");
  expect(ply("ascii", "1", "property float x\nproperty float y\n", "1 2\n"), "no property z");
  expect(ply("ascii", "1", "property quad x\n", "1 2\n"), "'quad'");
  expect(ply("ascii", "1", "property list float int x\n", "1 2\n"), "whole number");
  expect(ply("roman", "1", xyz, "1 2 3\n"), "roman");
  expect(folder.put("n.ply", "plyish\n"), "'ply'");
  expect(folder.put("h.ply", "ply\nformat ascii 1.0\nelement vertex 1\n"), "end_header");
  expect(folder.put("v.ply", "ply\nformat ascii 1.0\nelement face 0\nproperty int a\nend_header\n"), "'vertex'");
  expect(folder.put("p.ply", "ply\nformat ascii 1.0\nproperty int a\nend_header\n"), "before the first element");
  expect(folder.put("e.ply", "ply\nelement vertex 1\n" + xyz + "end_header\n1 2 3\n"), "no format");
}

}  // namespace
}  // namespace swarmfit
