// Names by SIFT: found where they are, not where they are not, and never outside a proto-object.
#include "host/perception/recognition.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <swarmfit/scene.hpp>

#include "host/perception/scene_solids.hpp"
#include "tests/io_files.hpp"

namespace swarmfit::perception {
namespace {

namespace fs = std::filesystem;

/// A gallery's folder of its own for each test.
class RecognitionTest : public testing::Test {
 protected:
  void store(const std::string& name, const cv::Mat& image) const {
    fs::create_directories((folder_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), image));
  }
  Gallery gallery() const {
    auto loaded = Gallery::load(folder_);
    EXPECT_TRUE(loaded) << loaded.error().message;
    return std::move(*loaded);
  }

 private:
  const tests::TemporaryFolder temporary_;

 protected:
  const fs::path folder_ = temporary_.path();
};

/// A printed surface of its own: blocks and discs in random greys.
cv::Mat3b print(std::uint64_t seed, int width = 160, int height = 200) {
  cv::Mat3b image(height, width, cv::Vec3b(200, 200, 200));
  for (std::uint64_t i = 0; i < 120; ++i) {
    const auto bits = random_bits(seed, 99, i);
    const cv::Point at(static_cast<int>(bits[0] % static_cast<unsigned>(width)), static_cast<int>(bits[1] % static_cast<unsigned>(height)));
    const int size = 4 + static_cast<int>(bits[2] % 14);
    const cv::Scalar colour(bits[3] & 255U, (bits[3] >> 8) & 255U, (bits[3] >> 16) & 255U);
    if (i % 2 == 0) {
      cv::rectangle(image, cv::Rect(at, cv::Size(size, size + 5)), colour, cv::FILLED);
    } else {
      cv::circle(image, at, size / 2, colour, cv::FILLED, cv::LINE_AA);
    }
  }
  return image;
}

/// A frame in which pictures can be hung.
struct Wall {
  cv::Mat3b image = cv::Mat3b(480, 640, cv::Vec3b(120, 130, 140));
  cv::Mat1w objects = cv::Mat1w::zeros(480, 640);

  void hang(const cv::Mat3b& picture, std::uint16_t label, const cv::Point2f& centre, double scale, double degrees) {
    cv::Mat turn = cv::getRotationMatrix2D({picture.cols / 2.0f, picture.rows / 2.0f}, degrees, scale);
    turn.at<double>(0, 2) += centre.x - picture.cols / 2.0;
    turn.at<double>(1, 2) += centre.y - picture.rows / 2.0;
    cv::Mat3b moved;
    cv::Mat1b where;
    cv::warpAffine(picture, moved, turn, image.size(), cv::INTER_AREA);
    cv::warpAffine(cv::Mat1b(picture.size(), 255), where, turn, image.size(), cv::INTER_NEAREST);
    moved.copyTo(image, where);
    objects.setTo(label, where);
  }
  Cloud frame() const {
    Cloud cloud;
    cloud.width = image.cols;
    cloud.height = image.rows;
    cloud.values32.assign(3 * image.total(), 1);
    cv::Mat3b rgb;
    cv::cvtColor(image, rgb, cv::COLOR_BGR2RGB);
    cloud.rgb.assign(rgb.datastart, rgb.dataend);
    return cloud;
  }
  std::span<const std::uint16_t> labels() const { return {objects.ptr<std::uint16_t>(), objects.total()}; }
};

using Names = std::vector<std::vector<Recognition>>;

TEST_F(RecognitionTest, NamesEachObjectByItsOwnPicture) {
  for (const int k : {1, 2, 3}) store("thing" + std::to_string(k) + ".png", print(static_cast<std::uint64_t>(k)));
  Wall wall;
  wall.hang(print(2), 1, {140, 160}, 0.8, 25);
  wall.hang(print(1), 2, {330, 300}, 0.6, -70);
  wall.hang(print(9), 3, {520, 160}, 0.9, 0);  // in no gallery
  const Names names = gallery().recognise(wall.frame(), wall.labels(), 3);
  ASSERT_EQ(names.size(), 3U);
  ASSERT_EQ(names[0].size(), 1U);
  EXPECT_EQ(names[0][0].name, "thing2");
  EXPECT_GE(names[0][0].inliers, 15U);
  EXPECT_GT(names[0][0].score, 0.5);
  EXPECT_LE(names[0][0].score, 1);
  ASSERT_EQ(names[1].size(), 1U);
  EXPECT_EQ(names[1][0].name, "thing1");
  EXPECT_TRUE(names[2].empty()) << names[2][0].name << " with " << names[2][0].inliers;
}

TEST_F(RecognitionTest, ReadsOnlyInsideProtoObjects) {
  store("thing.png", print(1));
  Wall wall;
  wall.hang(print(1), 1, {300, 240}, 1, 10);
  const Gallery known = gallery();
  EXPECT_EQ(known.recognise(wall.frame(), wall.labels(), 1)[0].size(), 1U);
  Wall unsure = wall;
  unsure.objects.setTo(kUncertain, wall.objects == 1);
  EXPECT_TRUE(known.recognise(unsure.frame(), unsure.labels(), 1)[0].empty()) << "uncertain counts as background";
  Wall beside = wall;
  beside.objects.setTo(0);
  beside.objects(cv::Rect(0, 0, 120, 120)).setTo(1);
  EXPECT_TRUE(known.recognise(beside.frame(), beside.labels(), 1)[0].empty()) << "the print hangs beside the proto-object";
}

TEST_F(RecognitionTest, SeveralInstancesAndSeveralNamesInOneProtoObject) {
  store("a.png", print(1));
  store("b.png", print(2));
  Wall wall;
  wall.hang(print(1), 1, {120, 240}, 0.8, 0);
  wall.hang(print(1), 1, {300, 240}, 0.8, 15);
  wall.hang(print(2), 1, {480, 240}, 0.8, -15);
  const Names names = gallery().recognise(wall.frame(), wall.labels(), 1);
  std::multiset<std::string> found;
  for (const auto& name : names[0]) found.insert(name.name);
  EXPECT_EQ(found, (std::multiset<std::string>{"a", "a", "b"}));
  for (std::size_t i = 1; i < names[0].size(); ++i) EXPECT_GE(names[0][i - 1].inliers, names[0][i].inliers) << "best first";
}

TEST_F(RecognitionTest, AFolderOfImagesIsOneName) {
  store("box/front.png", print(1));
  store("box/side.png", print(2));
  std::ofstream(folder_ / "notes.txt") << "not an image";
  Wall wall;
  wall.hang(print(1), 1, {160, 240}, 0.8, 0);
  wall.hang(print(2), 2, {450, 240}, 0.8, 0);
  const Names names = gallery().recognise(wall.frame(), wall.labels(), 2);
  for (const auto& name : names) {
    ASSERT_EQ(name.size(), 1U);
    EXPECT_EQ(name[0].name, "box");
  }
}

TEST_F(RecognitionTest, MirroredPrintIsAnotherThing) {
  store("thing.png", print(1));
  cv::Mat3b mirrored;
  cv::flip(print(1), mirrored, 1);
  Wall wall;
  wall.hang(mirrored, 1, {300, 240}, 1, 0);
  EXPECT_TRUE(gallery().recognise(wall.frame(), wall.labels(), 1)[0].empty());
}

TEST_F(RecognitionTest, PlainObjectsAndEmptyFramesHaveNoName) {
  store("thing.png", print(1));
  store("plain.png", cv::Mat3b(80, 80, cv::Vec3b(10, 20, 30)));  // a picture without a feature is no obstacle
  const Gallery known = gallery();
  Wall wall;
  wall.objects(cv::Rect(100, 100, 200, 200)).setTo(1);
  EXPECT_TRUE(known.recognise(wall.frame(), wall.labels(), 2)[0].empty());
  Cloud colourless = wall.frame();
  colourless.rgb.clear();
  EXPECT_EQ(known.recognise(colourless, wall.labels(), 2).size(), 2U);
  EXPECT_TRUE(known.recognise(wall.frame(), {}, 0).empty());
}

TEST_F(RecognitionTest, RepeatsItself) {
  store("thing.png", print(1));
  Wall wall;
  wall.hang(print(1), 1, {300, 240}, 0.7, 33);
  const Gallery known = gallery();
  const auto once = known.recognise(wall.frame(), wall.labels(), 1), again = known.recognise(wall.frame(), wall.labels(), 1);
  ASSERT_EQ(once[0].size(), 1U);
  EXPECT_EQ(once[0][0].inliers, again[0][0].inliers);
  EXPECT_EQ(once[0][0].score, again[0][0].score);
}

TEST_F(RecognitionTest, CartonsOfTheSyntheticRoomAreNamedAndNothingElseIs) {
  constexpr std::uint64_t kSeeds = 4;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    for (const ScenePicture& picture : make_room_scene(seed, 64, 48).pictures) {
      const cv::Mat rgb(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.rgb.data()));
      cv::Mat3b bgr;
      cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
      store(std::to_string(seed) + "-" + picture.name + ".png", bgr);
    }
  const Gallery known = gallery();
  std::size_t cartons = 0, named = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene = make_room_scene(seed);
    const Names names = known.recognise(scene.cloud, scene.truth.object_labels, scene.truth.objects);
    cartons += scene.pictures.size();
    for (std::size_t k = 0; k < names.size(); ++k)
      for (const Recognition& name : names[k]) {
        bool right = false;
        for (const ScenePicture& picture : scene.pictures)
          right |= picture.object == k + 1 && name.name == std::to_string(seed) + "-" + picture.name;
        EXPECT_TRUE(right) << "seed " << seed << ": " << name.name << " for " << scene.truth.object_names[k];
        ++named;
      }
  }
  EXPECT_GE(named * 5, cartons * 4) << named << " of " << cartons << " cartons";
}

TEST_F(RecognitionTest, BadGalleriesAreNamedInTheError) {
  const auto message = [](const fs::path& folder) {
    const auto loaded = Gallery::load(folder);
    EXPECT_FALSE(loaded);
    if (loaded) return std::string();
    EXPECT_EQ(loaded.error().kind, Error::Kind::bad_input);
    return loaded.error().message;
  };
  EXPECT_NE(message(folder_ / "absent").find("absent"), std::string::npos);
  EXPECT_NE(message(folder_).find("no image"), std::string::npos) << "an empty folder";
  std::ofstream(folder_ / "broken.png") << "this is no PNG";
  EXPECT_NE(message(folder_).find("broken.png"), std::string::npos);
  EXPECT_NE(message(folder_ / "broken.png").find("broken.png"), std::string::npos) << "a file is no folder";
  fs::remove(folder_ / "broken.png");
  store("good.png", print(1));
  fs::create_directories(folder_ / "hollow");
  EXPECT_NE(message(folder_).find("hollow"), std::string::npos);
}

/// An image as a frame that is one proto-object all over: what the attention would spare, and the hardest test for false names.
Names look_at(const Gallery& known, const cv::Mat& bgr) {
  Wall wall;
  wall.image = bgr;
  wall.objects = cv::Mat1w::ones(bgr.size());
  return known.recognise(wall.frame(), wall.labels(), 1);
}

TEST_F(RecognitionTest, FindsOpenCvsBoxInItsScene) {
  cv::Mat box, scene;
  for (const fs::path folder :
       {"/usr/share/doc/opencv-doc/examples/data", "/usr/share/doc/opencv-doc/examples/samples/data", "/usr/share/opencv4/samples/data"}) {
    if (!fs::exists(folder / "box.png") || !fs::exists(folder / "box_in_scene.png")) continue;
    box = cv::imread((folder / "box.png").string());
    scene = cv::imread((folder / "box_in_scene.png").string());
  }
  if (box.empty() || scene.empty()) GTEST_SKIP() << "box.png and box_in_scene.png (Debian's opencv-doc) are not installed";
  store("box.png", box);
  const Names names = look_at(gallery(), scene);
  ASSERT_EQ(names[0].size(), 1U);
  EXPECT_GE(names[0][0].inliers, 20U);
}

TEST_F(RecognitionTest, AnObjectOfOneFrameIsFoundInTheOthersAndNowhereElse) {
  const char* data = std::getenv("SWARMFIT_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set";
  const auto frame = [&](int i) { return cv::imread((fs::path(data) / "rgbd" / (std::to_string(i) + ".color.png")).string()); };
  if (frame(2).empty()) GTEST_SKIP() << "no rgbd/2.color.png in SWARMFIT_DATA_DIR";
  store("crackers.png", frame(2)(cv::Rect(202, 0, 116, 143)));
  store("spam.png", frame(2)(cv::Rect(103, 214, 98, 84)));
  const Gallery known = gallery();
  const auto count = [&](int i, const std::string& name) {
    std::size_t found = 0;
    const Names names = look_at(known, frame(i));
    for (const auto& r : names[0]) found += r.name == name;
    return found;
  };
  for (const int i : {0, 1, 2, 3}) EXPECT_GE(count(i, "crackers"), 1U) << "frame " << i;
  EXPECT_EQ(count(3, "spam"), 1U);
  for (const int i : {4, 5}) EXPECT_TRUE(look_at(known, frame(i))[0].empty()) << "frame " << i;
}

}  // namespace
}  // namespace swarmfit::perception
