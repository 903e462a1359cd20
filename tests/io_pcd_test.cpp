#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <lzf.h>

#include <swarmfit/cloud.hpp>

#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using tests::raw;
using tests::TemporaryFolder;

std::string header(const std::string& fields, const std::string& sizes, const std::string& types, const std::string& counts,
                   std::size_t width, std::size_t height, const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types + "\nCOUNT " +
         counts + "\nWIDTH " + std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS " +
         std::to_string(width * height) + "\nDATA " + data + "\n";
}

std::string compressed(const std::string& columns) {
  std::string packed(2 * columns.size() + 64, '\0');
  const auto size =
      lzf_compress(columns.data(), static_cast<unsigned>(columns.size()), packed.data(), static_cast<unsigned>(packed.size()));
  EXPECT_GT(size, 0U);
  return raw(static_cast<std::uint32_t>(size)) + raw(static_cast<std::uint32_t>(columns.size())) + packed.substr(0, size);
}

/// The message of a read that must fail as bad input, with the file named and on one line.
std::string complaint(const std::filesystem::path& file) {
  const auto cloud = read_cloud(file);
  if (cloud) return "was read";
  EXPECT_EQ(cloud.error().kind, Error::Kind::bad_input);
  EXPECT_NE(cloud.error().message.find(file.filename().string()), std::string::npos) << cloud.error().message;
  EXPECT_EQ(cloud.error().message.find('\n'), std::string::npos) << cloud.error().message;
  return cloud.error().message;
}

#define EXPECT_COMPLAINT(file, what)                             \
  do {                                                           \
    const std::string message = complaint(file);                 \
    EXPECT_NE(message.find(what), std::string::npos) << message; \
  } while (false)

TEST(Pcd, AsciiKeepsEveryDigitAndStepsOverOtherFields) {
  const TemporaryFolder folder;
  const auto file = folder.put("a.pcd", header("normal z rgb y x", "4 8 4 8 8", "F F U F F", "3 1 1 1 1", 2, 1, "ascii") +
                                            "0 0 1 3.5 16711680 5400000.125 500000.0625\n# a comment\n0 1 0 nan 255 +2 -1e3\n");
  const auto cloud = read_cloud(file);
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->size(), 2U);
  EXPECT_EQ(cloud->values64[0], 500000.0625);
  EXPECT_EQ(cloud->values64[1], 5400000.125);
  EXPECT_EQ(cloud->values64[2], 3.5);
  EXPECT_TRUE(std::isnan(cloud->values64[5]));
  EXPECT_EQ(cloud->values64[4], 2);
  EXPECT_EQ(cloud->values64[3], -1000);
  EXPECT_EQ(cloud->rgb, (std::vector<std::uint8_t>{255, 0, 0, 0, 0, 255}));
  EXPECT_FALSE(cloud->organised());
}

TEST(Pcd, AsciiColourAsAFloatsBits) {
  const TemporaryFolder folder;
  const auto file = folder.put("a.pcd", header("x y z rgb", "4 4 4 4", "F F F F", "1 1 1 1", 1, 1, "ascii") + "1 2 3 4.2108e+06\n");
  const auto cloud = read_cloud(file);
  ASSERT_TRUE(cloud) << cloud.error().message;
  const auto bits = std::bit_cast<std::uint32_t>(4.2108e+06F);
  EXPECT_EQ(cloud->rgb[0], bits >> 16 & 255);
  EXPECT_EQ(cloud->rgb[1], bits >> 8 & 255);
  EXPECT_EQ(cloud->rgb[2], bits & 255);
}

TEST(Pcd, BinaryFloatStaysFloat) {
  const TemporaryFolder folder;
  std::string data;
  for (int i = 0; i < 6; ++i) {
    data += raw(static_cast<std::uint8_t>(7)) + raw(0.1F * static_cast<float>(i)) + raw(2.0F) + raw(3.0F) + raw(std::uint32_t{0xff010203});
  }
  const auto cloud =
      read_cloud(folder.put("b.PCD", header("tag x y z rgba", "1 4 4 4 4", "U F F F U", "1 1 1 1 1", 3, 2, "binary") + data));
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_TRUE(cloud->values64.empty());
  ASSERT_EQ(cloud->size(), 6U);
  EXPECT_EQ(cloud->values32[15], 0.1F * 5);
  EXPECT_EQ(cloud->values32[17], 3.0F);
  EXPECT_EQ(cloud->rgb[15], 1);
  EXPECT_EQ(cloud->rgb[17], 3);
  EXPECT_TRUE(cloud->organised());
  EXPECT_EQ(cloud->width, 3);
  EXPECT_EQ(cloud->height, 2);
}

TEST(Pcd, BinaryOfEverySizeAndType) {
  const TemporaryFolder folder;
  const auto check = [&](const char* size, const char* type, auto x, auto y, auto z) {
    const std::string s = std::string(size) + " " + size + " " + size, t = std::string(type) + " " + type + " " + type;
    const auto cloud = read_cloud(folder.put("t.pcd", header("x y z", s, t, "1 1 1", 1, 1, "binary") + raw(x) + raw(y) + raw(z)));
    ASSERT_TRUE(cloud) << cloud.error().message;
    const bool narrow = cloud->values64.empty();
    for (int d = 0; d < 3; ++d) {
      const auto k = static_cast<std::size_t>(d);
      EXPECT_EQ(narrow ? static_cast<double>(cloud->values32[k]) : cloud->values64[k], static_cast<double>(d == 0   ? x
                                                                                                           : d == 1 ? y
                                                                                                                    : z))
          << type << size;
    }
  };
  check("1", "I", std::int8_t{-5}, std::int8_t{6}, std::int8_t{7});
  check("1", "U", std::uint8_t{250}, std::uint8_t{6}, std::uint8_t{7});
  check("2", "I", std::int16_t{-500}, std::int16_t{6}, std::int16_t{7});
  check("2", "U", std::uint16_t{65000}, std::uint16_t{6}, std::uint16_t{7});
  check("4", "I", std::int32_t{-2000000001}, std::int32_t{6}, std::int32_t{7});
  check("4", "U", std::uint32_t{4000000001}, std::uint32_t{6}, std::uint32_t{7});
  check("8", "I", std::int64_t{-1} << 40, std::int64_t{6}, std::int64_t{7});
  check("8", "U", std::uint64_t{1} << 40, std::uint64_t{6}, std::uint64_t{7});
  check("4", "F", 0.25F, 1e30F, -7.5F);
  check("8", "F", 5400000.123456, 1e300, -7.5);
}

TEST(Pcd, CompressedHoldsFieldAfterField) {
  const TemporaryFolder folder;
  constexpr std::size_t kPoints = 5000;
  std::string columns;
  for (std::size_t i = 0; i < kPoints; ++i) columns += raw(static_cast<float>(i)) + raw(0.0F);  // a field of COUNT 2
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kPoints; ++i) columns += raw(static_cast<float>(i) + 0.25F * static_cast<float>(axis));
  }
  for (std::size_t i = 0; i < kPoints; ++i) columns += raw(std::bit_cast<float>(std::uint32_t{0x102030}));
  const auto cloud = read_cloud(folder.put(
      "c.pcd", header("w z y x rgb", "4 4 4 4 4", "F F F F F", "2 1 1 1 1", kPoints, 1, "binary_compressed") + compressed(columns)));
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->size(), kPoints);
  EXPECT_EQ(cloud->values32[3 * 4321 + 0], 4321.5F);
  EXPECT_EQ(cloud->values32[3 * 4321 + 1], 4321.25F);
  EXPECT_EQ(cloud->values32[3 * 4321 + 2], 4321.0F);
  EXPECT_EQ(cloud->rgb[3 * 4999 + 0], 0x10);
  EXPECT_EQ(cloud->rgb[3 * 4999 + 2], 0x30);
}

TEST(Pcd, LyingCountsAreNamed) {
  const TemporaryFolder folder;
  const std::string point = raw(1.0F) + raw(2.0F) + raw(3.0F);
  const auto xyz = [&](std::size_t width, std::size_t height, const char* data) {
    return header("x y z", "4 4 4", "F F F", "1 1 1", width, height, data);
  };
  EXPECT_COMPLAINT(folder.put("more.pcd", xyz(3, 1, "binary") + point + point), "POINTS 3");
  EXPECT_COMPLAINT(folder.put("fewer.pcd", xyz(1, 1, "binary") + point + point), "POINTS 1");
  EXPECT_COMPLAINT(folder.put("ascii-more.pcd", xyz(3, 1, "ascii") + "1 2 3\n4 5 6                          \n"), "ends after 2 points");
  EXPECT_COMPLAINT(folder.put("ascii-fewer.pcd", xyz(1, 1, "ascii") + "1 2 3\n4 5 6\n"), "POINTS 1");
  EXPECT_COMPLAINT(folder.put("huge-ascii.pcd", xyz(2000000000, 1, "ascii") + "1 2 3\n"), "POINTS 2000000000");
  EXPECT_COMPLAINT(folder.put("huge.pcd", xyz(2000000000, 2000000000, "binary") + point), "POINTS 4000000000000000000");
  EXPECT_COMPLAINT(folder.put("huge-packed.pcd", xyz(2000000000, 2000000000, "binary_compressed") + point), "POINTS");

  std::string lying = xyz(1, 1, "binary") + point;
  lying.replace(lying.find("POINTS 1"), 8, "POINTS 2");
  EXPECT_COMPLAINT(folder.put("product.pcd", lying), "WIDTH x HEIGHT");
  for (const char* count : {"99999999999999999999999", "-4", "3.5", "many"}) {
    std::string bad = xyz(1, 1, "binary") + point;
    bad.replace(bad.find("WIDTH 1"), 7, std::string("WIDTH ") + count);
    EXPECT_COMPLAINT(folder.put("width.pcd", bad), count);
  }
  EXPECT_COMPLAINT(folder.put("zero.pcd", xyz(0, 1, "binary")), "WIDTH 0");
  EXPECT_COMPLAINT(folder.put("count.pcd", header("x y z w", "4 4 4 8", "F F F F", "1 1 1 4294967295", 4000000, 1, "binary") + point),
                   "POINTS 4000000");
  EXPECT_COMPLAINT(folder.put("count0.pcd", header("x y z w", "4 4 4 8", "F F F F", "1 1 1 0", 1, 1, "binary") + point), "COUNT 0");
  EXPECT_COMPLAINT(folder.put("xcount.pcd", header("x y z", "4 4 4", "F F F", "2 1 1", 1, 1, "binary") + point + raw(1.0F)), "COUNT 2");
}

TEST(Pcd, TruncatedAtAnyByteIsAnError) {
  const TemporaryFolder folder;
  std::string columns;
  for (int i = 0; i < 300; ++i) columns += raw(static_cast<float>(i % 17));
  const std::string head = header("x y z", "4 4 4", "F F F", "1 1 1", 100, 1, "binary_compressed");
  const std::string whole = head + compressed(columns);
  ASSERT_TRUE(read_cloud(folder.put("whole.pcd", whole)));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(read_cloud(folder.put("cut.pcd", whole.substr(0, size)))) << size << " of " << whole.size();
  }
}

TEST(Pcd, DamagedCompressedData) {
  const TemporaryFolder folder;
  const std::string head = header("x y z", "4 4 4", "F F F", "1 1 1", 4, 1, "binary_compressed");
  const std::string good = compressed(std::string(48, 'a'));
  EXPECT_COMPLAINT(folder.put("sizes.pcd", head + raw(std::uint32_t{4}) + raw(std::uint32_t{4000000000U}) + "abcd"),
                   "must be POINTS x 12 = 48");
  EXPECT_COMPLAINT(folder.put("long.pcd", head + raw(std::uint32_t{4000}) + raw(std::uint32_t{48}) + "abcd"), "4000");
  EXPECT_COMPLAINT(folder.put("noise.pcd", head + raw(std::uint32_t{8}) + raw(std::uint32_t{48}) + "\xff\xff\xff\xff\xff\xff\xff\xff"),
                   "damaged");
}

TEST(Pcd, HeaderFaults) {
  const TemporaryFolder folder;
  const std::string good = header("x y z", "4 4 4", "F F F", "1 1 1", 1, 1, "ascii") + "1 2 3\n";
  ASSERT_TRUE(read_cloud(folder.put("good.pcd", good)));
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return folder.put("changed.pcd", text);
  };
  EXPECT_COMPLAINT(changed("FIELDS x y z\n", ""), "FIELDS");
  EXPECT_COMPLAINT(changed("FIELDS x y z", "FIELDS x y w"), "no z");
  EXPECT_COMPLAINT(changed("SIZE 4 4 4", "SIZE 4 4"), "SIZE");
  EXPECT_COMPLAINT(changed("SIZE 4 4 4", "SIZE 4 4 3"), "SIZE '3'");
  EXPECT_COMPLAINT(changed("TYPE F F F", "TYPE F F Q"), "TYPE 'Q'");
  EXPECT_COMPLAINT(changed("TYPE F F F", "TYPE F F"), "TYPE");
  EXPECT_COMPLAINT(changed("COUNT 1 1 1", "COUNT 1 1"), "COUNT");
  EXPECT_COMPLAINT(changed("DATA ascii", "DATA morse"), "morse");
  EXPECT_COMPLAINT(changed("DATA ascii\n1 2 3\n", ""), "DATA");
  EXPECT_COMPLAINT(changed("VERSION 0.7", "HELLO 0.7"), "HELLO");
  EXPECT_COMPLAINT(changed("1 2 3\n", "1 two 3\n"), "'two'");
  EXPECT_COMPLAINT(changed("1 2 3\n", "1 20 \n"), "fewer");
  EXPECT_COMPLAINT(changed("1 2 3\n", "1 2 3 4\n"), "more");
  EXPECT_COMPLAINT(folder.put("empty.pcd", ""), "empty");
  EXPECT_COMPLAINT(folder / "missing.pcd", "No such file");
  std::filesystem::create_directory(folder / "folder.pcd");
  EXPECT_COMPLAINT(folder / "folder.pcd", "folder");
  EXPECT_COMPLAINT(folder.put("cloud.xls", "1 2 3\n"), ".xls");
}

}  // namespace
}  // namespace swarmfit
