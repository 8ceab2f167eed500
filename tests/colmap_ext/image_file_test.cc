#include "colmap_ext/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "colmap_ext/mask_file.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::InputErrorOf;
using test_support::ReadBytes;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::HasSubstr;

phi::GrayImage Gradient(int width, int height) {
  phi::GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<std::uint8_t>(x + 2 * y);
  }
  return image;
}

// 925 bytes may announce 16384 x 12288 pixels: who expects others must be able to say so before they are decoded.
TEST(ImageSize, IsToldBeforeAnythingIsDecoded) {
  const TemporaryFolder folder;
  struct Refused {};
  for (const char* name : {"a.png", "a.jpg"}) {
    WriteGrayImage(folder / name, Gradient(37, 21));
    std::string bytes = ReadBytes(folder / name);
    constexpr std::size_t kScanHeader = 10, kPngHeader = 33;
    const std::size_t data = std::string(name) == "a.jpg" ? bytes.find("\xFF\xDA") + kScanHeader : kPngHeader;
    WriteBytes(folder / name, bytes.replace(data, std::string::npos, bytes.size() - data, '\0'));  // nothing to decode
    std::size_t width = 0, height = 0;
    EXPECT_THROW(ReadGrayImage(folder / name,
                               [&](std::size_t w, std::size_t h) {
                                 width = w, height = h;
                                 throw Refused();
                               }),
                 Refused)
        << name;
    EXPECT_EQ(width, 37u) << name;
    EXPECT_EQ(height, 21u) << name;
  }
}

bool IsPhoto(std::string_view bytes) { return HasPhotoFormat({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}); }

void ExpectReadAsPhoto(const std::filesystem::path& path) {
  WriteGrayImage(path, Gradient(37, 21));
  EXPECT_TRUE(IsPhoto(ReadBytes(path))) << path;
  EXPECT_EQ(ReadGrayImage(path).width(), 37) << path;
}

// Decoders of other formats are not asked: DICOM's, which OpenCV may hold, ends the process on these 151 bytes.
TEST(ImageFile, OtherFormatsThanPhotosAreRefused) {
  const TemporaryFolder folder;
  std::string dicom(151, '\xFF');
  dicom.replace(128, 23, std::string("DICM\0\x01\0\0OB\0\xFF\xFF\xFF\xFF\xFF\xFFIC\x02\xFF\xFF\xFF", 23));
  WriteBytes(folder / "scan.jpg", dicom);
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadGrayImage(folder / "scan.jpg"); }), HasSubstr("unknown format"));
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.bmp", "a.pgm"}) ExpectReadAsPhoto(folder / name);
  EXPECT_TRUE(IsPhoto(std::string("RIFF\x1A\0\0\0WEBPVP8 ", 16)));
  EXPECT_FALSE(IsPhoto(std::string("RIFF\x1A\0\0\0WAVEfmt ", 16)));
  EXPECT_FALSE(HasPhotoFormat({}));
}

TEST(ImageFile, WebPIsReadWhereOpenCVHasIt) {
  if (!cv::haveImageWriter("a.webp")) GTEST_SKIP() << "this OpenCV has no WebP, as that of scripts/static_opencv";
  const TemporaryFolder folder;
  ExpectReadAsPhoto(folder / "a.webp");
}

// A thumbnail and a comment within the header, as cameras write them; both hold an end marker. Orientation 6 asks
// viewers to turn the picture by 90 degrees.
std::string WithExifOrientation(const std::string& jpeg) {
  std::string exif = std::string("Exif\0\0", 6) + "II" + std::string("\x2A\0\x08\0\0\0", 6);
  exif +=
      std::string("\x01\0", 2) + std::string("\x12\x01\x03\0\x01\0\0\0\x06\0\0\0", 12) + std::string(4, '\0');
  exif += std::string(300, 'm');  // a maker's note: the segment's length takes both bytes
  exif += "\xFF\xD8thumbnail\xFF\xD9";
  const std::size_t length = exif.size() + 2;
  const std::string segment =
      std::string("\xFF\xE1") + static_cast<char>(length >> 8) + static_cast<char>(length & 0xFF) + exif;
  return jpeg.substr(0, 2) + segment + jpeg.substr(2);
}

// 3 x 2 gray pixels 10, 20, ... 60, uncompressed, in either byte order.
std::string MakeTiff(bool big_endian, int orientation) {
  std::string file = big_endian ? "MM" : "II";
  const auto append = [&](int value, int num_bytes) {
    for (int i = 0; i < num_bytes; ++i) {
      file += static_cast<char>(value >> 8 * (big_endian ? num_bytes - 1 - i : i));
    }
  };
  constexpr int kPixelsBegin = 8, kDirectory = kPixelsBegin + 6;
  append(42, 2);
  append(kDirectory, 4);
  for (int value = 10; value <= 60; value += 10) append(value, 1);
  // Width, height, bits, no compression, black is 0, where the pixels are, orientation, samples, rows, bytes.
  const int tags[][2] = {{256, 3},           {257, 2}, {258, 8}, {259, 1}, {262, 1}, {273, kPixelsBegin},
                         {274, orientation}, {277, 1}, {278, 2}, {279, 6}};
  append(static_cast<int>(std::size(tags)), 2);
  for (const auto& [tag, value] : tags) {
    append(tag, 2);
    append(3, 2);  // a number of two bytes
    append(1, 4);
    append(value, 2);
    append(0, 2);
  }
  append(0, 4);
  return file;
}

class ImageFileTest : public ::testing::Test {
 protected:
  fs::path Save(const char* name, const cv::Mat& pixels) {
    cv::imwrite((folder_ / name).string(), pixels);
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

TEST_F(ImageFileTest, GrayAndColourSurvivePng) {
  const phi::GrayImage gray = Gradient(17, 9);
  WriteGrayImage(folder_ / "sub/gray é.png", gray);
  const phi::GrayImage read = ReadGrayImage(folder_ / "sub/gray é.png");
  ASSERT_EQ(read.width(), 17);
  ASSERT_EQ(read.height(), 9);
  EXPECT_TRUE(std::equal(gray.begin(), gray.end(), read.begin()));

  ColorImage color(2, 1);
  color(0, 0) = {255, 10, 20};
  color(1, 0) = {1, 2, 3};
  WriteColorImage(folder_ / "color.png", color);
  EXPECT_EQ(ReadColorImage(folder_ / "color.png")(0, 0), (Rgb{255, 10, 20}));
  EXPECT_EQ(ReadColorImage(folder_ / "color.png")(1, 0), (Rgb{1, 2, 3}));
  EXPECT_EQ(ReadColorImage(folder_ / "sub/gray é.png")(3, 4), (Rgb{11, 11, 11}));
}

// workspace_checker asks all photos: where the header tells that there are fewer bits, none is decoded.
TEST_F(ImageFileTest, TheBrightestValueIsSoughtIn16BitsAlone) {
  cv::Mat deep(4, 6, CV_16UC1, cv::Scalar(7));
  deep.at<std::uint16_t>(2, 3) = 4095;
  for (const char* name : {"deep.png", "deep.tif"}) EXPECT_EQ(Brightest16Bit(ReadPhotoFile(Save(name, deep))), 4095) << name;
  EXPECT_EQ(Brightest16Bit(ReadPhotoFile(Save("flat.tif", cv::Mat(4, 6, CV_8UC1, cv::Scalar(7))))), std::nullopt);
  const std::string flat = ReadBytes(Save("flat.png", cv::Mat(4, 6, CV_8UC1, cv::Scalar(7))));
  WriteBytes(folder_ / "cut.png", flat.substr(0, 25));
  EXPECT_EQ(Brightest16Bit(ReadPhotoFile(folder_ / "cut.png")), std::nullopt);
}

// 16-bit values keep their upper byte.
TEST_F(ImageFileTest, SixteenBitsBecomeEight) {
  const cv::Mat gray(4, 6, CV_16UC1, cv::Scalar(0x4523));
  const cv::Mat color(4, 6, CV_16UC3, cv::Scalar(0x1023, 0x2023, 0x3023));  // blue, green, red
  for (const char* extension : {"png", "tif"}) {
    EXPECT_EQ(ReadGrayImage(Save((std::string("gray.") + extension).c_str(), gray))(5, 3), 0x45) << extension;
    const Rgb rgb = ReadColorImage(Save((std::string("color.") + extension).c_str(), color))(5, 3);
    EXPECT_EQ(rgb, (Rgb{0x30, 0x20, 0x10})) << extension;
    // Luma weights 0.299, 0.587, 0.114: 0.299 * 48 + 0.587 * 32 + 0.114 * 16 = 34.96.
    EXPECT_NEAR(ReadGrayImage(folder_ / (std::string("color.") + extension))(0, 0), 35, 1) << extension;
  }
}

// Numbers of things in 16 bits: they became 0, which leaves everything out.
TEST_F(ImageFileTest, MasksKeepWhateverIsNotZero) {
  cv::Mat deep(2, 3, CV_16UC1, cv::Scalar(0)), gray(2, 3, CV_8UC1, cv::Scalar(0)), clear(2, 3, CV_8UC4, cv::Scalar(0, 0, 0, 255));
  deep.at<std::uint16_t>(0, 1) = 1;
  gray.at<std::uint8_t>(0, 1) = 1;
  clear.at<cv::Vec4b>(0, 1) = {9, 9, 9, 0};
  for (const auto& [name, mask] : {std::pair{"deep.png", deep}, {"gray.png", gray}, {"clear.png", clear}, {"deep.tif", deep}}) {
    const phi::GrayImage read = ReadImageMaskFile(Save(name, mask));
    EXPECT_THAT(std::vector<int>(read.begin(), read.end()), testing::ElementsAre(0, 255, 0, 0, 0, 0)) << name;
  }
}

TEST_F(ImageFileTest, AlphaIsIgnored) {
  const cv::Mat pixels(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 0));
  const fs::path path = Save("alpha.png", pixels);
  EXPECT_EQ(ReadColorImage(path)(2, 2), (Rgb{30, 20, 10}));
  EXPECT_NEAR(ReadGrayImage(path)(2, 2), 0.299 * 30 + 0.587 * 20 + 0.114 * 10, 1);
}

TEST_F(ImageFileTest, OrientationTagIsIgnored) {
  WriteGrayImage(folder_ / "plain.jpg", Gradient(40, 24));
  WriteBytes(folder_ / "turned.jpg", WithExifOrientation(ReadBytes(folder_ / "plain.jpg")));
  const cv::Mat turned = cv::imread((folder_ / "turned.jpg").string());
  ASSERT_EQ(turned.cols, 24) << "the test's tag has no effect";
  EXPECT_EQ(ReadGrayImage(folder_ / "turned.jpg").width(), 40);
  EXPECT_EQ(ReadColorImage(folder_ / "turned.jpg").width(), 40);
}

// COLMAP's cameras fit the rows as they are stored, whatever way up a viewer shows them.
TEST_F(ImageFileTest, OrientationTagOfTiffIsIgnored) {
  for (const bool big_endian : {false, true}) {
    for (int orientation = 1; orientation <= 8; ++orientation) {
      WriteBytes(folder_ / "turned.tif", MakeTiff(big_endian, orientation));
      const phi::GrayImage image = ReadGrayImage(folder_ / "turned.tif");
      ASSERT_EQ(image.width(), 3) << orientation;
      ASSERT_EQ(image.height(), 2) << orientation;
      EXPECT_THAT(std::vector<int>(image.begin(), image.end()), testing::ElementsAre(10, 20, 30, 40, 50, 60))
          << orientation;
    }
  }
}

// Whatever a damaged file says, nothing beyond its end is touched.
TEST_F(ImageFileTest, DamagedTiffsAreErrors) {
  const std::string whole = MakeTiff(false, 6);
  for (std::size_t size = 1; size < whole.size() - 4; ++size) {
    WriteBytes(folder_ / "cut.tif", whole.substr(0, size));
    EXPECT_THAT(InputErrorOf([&] { ReadGrayImage(folder_ / "cut.tif"); }), HasSubstr("cut.tif")) << size;
  }
}

TEST_F(ImageFileTest, TruncatedImagesAreErrorsThatNameTheFile) {
  WriteGrayImage(folder_ / "whole.png", Gradient(64, 48));
  WriteGrayImage(folder_ / "plain.jpg", Gradient(64, 48));
  WriteBytes(folder_ / "whole.jpg", WithExifOrientation(ReadBytes(folder_ / "plain.jpg")));
  for (const char* name : {"whole.jpg", "whole.png"}) {
    const std::string whole = ReadBytes(folder_ / name);
    const fs::path cut = folder_ / (std::string("cut ") + name);
    // The last chunk of a PNG holds no pixels.
    const std::size_t end = whole.size() - (std::string(name) == "whole.png" ? 12 : 0);
    for (std::size_t length = 0; length < end; length += 1 + length / 8) {
      WriteBytes(cut, whole.substr(0, length));
      EXPECT_THAT(InputErrorOf([&] { ReadGrayImage(cut); }), HasSubstr(cut.string())) << length;
    }
    WriteBytes(cut, whole.substr(0, end - 1));
    EXPECT_THAT(InputErrorOf([&] { ReadColorImage(cut); }), HasSubstr(cut.string()));
  }
}

TEST_F(ImageFileTest, BytesAfterTheEndOfAJpegDoNotMatter) {
  WriteGrayImage(folder_ / "image.jpg", Gradient(64, 48));
  WriteBytes(folder_ / "image.jpg", ReadBytes(folder_ / "image.jpg") + "a phone's trailer");
  EXPECT_EQ(ReadGrayImage(folder_ / "image.jpg").width(), 64);
}

TEST_F(ImageFileTest, MissingAndForeignFilesAreErrorsThatNameTheFile) {
  WriteBytes(folder_ / "text.png", "this is no image");
  WriteBytes(folder_ / "empty.png", "");
  fs::create_directory(folder_ / "folder.png");
  for (const char* name : {"none.png", "text.png", "empty.png", "folder.png"}) {
    EXPECT_THAT(InputErrorOf([&] { ReadGrayImage(folder_ / name); }), HasSubstr(name));
  }
  EXPECT_THAT(InputErrorOf([&] { WriteGrayImage(folder_ / "image.what", Gradient(2, 2)); }),
              HasSubstr("image.what"));
}

TEST_F(ImageFileTest, ShrinkingAveragesAreas) {
  phi::GrayImage image(4, 2);
  const std::uint8_t values[] = {10, 20, 100, 100, 30, 40, 100, 200};
  std::copy(std::begin(values), std::end(values), image.begin());
  const phi::GrayImage half = Resize(image, 2, 1);
  EXPECT_EQ(half(0, 0), 25);
  EXPECT_EQ(half(1, 0), 125);
  EXPECT_EQ(Resize(image, 4, 2)(3, 1), 200);
  EXPECT_EQ(Resize(image, 8, 4).width(), 8);
}

// Left half red, right half blue; 403 x 202 pixels.
TEST_F(ImageFileTest, JpegsAreReducedWhileTheyStayLargeEnough) {
  ColorImage image(403, 202, {200, 0, 0});
  for (int y = 0; y < 202; ++y) {
    for (int x = 200; x < 403; ++x) image(x, y) = {0, 0, 200};
  }
  WriteColorImage(folder_ / "a.jpg", image);
  WriteColorImage(folder_ / "a.png", image);
  const PhotoFile jpeg = ReadPhotoFile(folder_ / "a.jpg"), png = ReadPhotoFile(folder_ / "a.png");
  const std::pair<int, int> kWidthsForSides[] = {{500, 403}, {202, 403}, {201, 202}, {101, 202}, {100, 101}, {50, 51}, {9, 51}};
  for (const auto& [side, width] : kWidthsForSides) {
    const ColorImage reduced = DecodeReducedColor(jpeg, side);
    EXPECT_EQ(reduced.width(), width) << side;
    const Rgb left = reduced(width / 4, reduced.height() / 2), right = reduced(width - width / 4, reduced.height() / 2);
    EXPECT_NEAR(left[0], 200, 8) << side;
    EXPECT_NEAR(left[2], 0, 8) << side;
    EXPECT_NEAR(right[0], 0, 8) << side;
    EXPECT_NEAR(right[2], 200, 8) << side;
    EXPECT_EQ(DecodeReducedColor(png, side).width(), 403);
  }
}

TEST_F(ImageFileTest, MaskIsAnEightBitGrayPng) {
  phi::Mask mask(300, 2, 0);
  mask(1, 0) = 255;
  mask(299, 1) = 255;
  WriteMask(folder_ / "mask.png", mask);
  // Signature, then the header chunk: width 300, height 2, 8 bits, gray, no interlacing.
  const std::string head("\x89PNG\r\n\x1A\n\0\0\0\x0DIHDR\0\0\x01\x2C\0\0\0\x02\x08\0\0\0\0", 29);
  EXPECT_EQ(ReadBytes(folder_ / "mask.png").substr(0, head.size()), head);
  const phi::Mask read = ReadMask(folder_ / "mask.png");
  EXPECT_TRUE(std::equal(mask.begin(), mask.end(), read.begin()));
  WriteGrayImage(folder_ / "gray.png", Gradient(4, 4));
  EXPECT_THAT(InputErrorOf([&] { ReadMask(folder_ / "gray.png"); }), HasSubstr("0, 128 and 255"));
}

}  // namespace
}  // namespace colmap_ext
