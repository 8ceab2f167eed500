#include "colmap_ext/jpeg_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <jpeglib.h>

#include "tests/support/error_message.h"

namespace colmap_ext {
namespace {

using test_support::InputErrorOf;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

struct Kind {
  const char* name;
  J_COLOR_SPACE pixels = JCS_RGB, stored = JCS_YCbCr;
  int sampling = 1;  // of luma, along both axes: 2 is 4:2:0
  bool is_progressive = false;
  unsigned restart = 0;  // MCUs between restart markers
};

constexpr Kind kKinds[] = {{"4:4:4"},
                           {.name = "4:2:0", .sampling = 2},
                           {.name = "progressive", .sampling = 2, .is_progressive = true},
                           {.name = "restarts", .sampling = 2, .restart = 3},
                           {"gray", JCS_GRAYSCALE, JCS_GRAYSCALE},
                           {"RGB", JCS_RGB, JCS_RGB},
                           {"CMYK", JCS_CMYK, JCS_CMYK},
                           {"YCCK", JCS_CMYK, JCS_YCCK}};

constexpr int kWidth = 133, kHeight = 101;

// Waves of brightness and colour.
PhotoFile Encode(const Kind& kind) {
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &buffer, &size);
  info.image_width = kWidth;
  info.image_height = kHeight;
  info.in_color_space = kind.pixels;
  info.input_components = kind.pixels == JCS_CMYK ? 4 : kind.pixels == JCS_RGB ? 3 : 1;
  jpeg_set_defaults(&info);
  jpeg_set_colorspace(&info, kind.stored);
  jpeg_set_quality(&info, 90, TRUE);
  info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = kind.sampling;
  info.restart_interval = kind.restart;
  if (kind.is_progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < kHeight; ++y) {
    Bytes row;
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < info.input_components; ++c)
        row.push_back(static_cast<std::uint8_t>((x * (3 + c) + y * (7 - c) + x * y / 9) % 256));
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&info, &pointer, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  PhotoFile photo{kind.name, Bytes(buffer, buffer + size)};
  std::free(buffer);
  return photo;
}

// The place of the marker's first byte.
std::size_t FindMarker(const PhotoFile& photo, std::uint8_t marker) {
  const std::uint8_t wanted[] = {0xFF, marker};
  const auto begin = photo.bytes.begin();
  return static_cast<std::size_t>(std::search(begin, photo.bytes.end(), std::begin(wanted), std::end(wanted)) - begin);
}

constexpr std::uint8_t kFrame = 0xC0, kScan = 0xDA, kQuantization = 0xDB;

PhotoFile Insert(PhotoFile photo, std::size_t place, std::string_view bytes) {
  photo.bytes.insert(photo.bytes.begin() + static_cast<std::ptrdiff_t>(place), bytes.begin(), bytes.end());
  return photo;
}

PhotoFile Overwrite(PhotoFile photo, std::size_t place, std::string_view bytes) {
  std::copy(bytes.begin(), bytes.end(), photo.bytes.begin() + static_cast<std::ptrdiff_t>(place));
  return photo;
}

TEST(JpegDecoder, GivesTheBytesThatOpenCvGives) {
  for (const Kind& kind : kKinds) {
    const PhotoFile photo = Encode(kind);
    const cv::Mat gray = cv::imdecode(photo.bytes, cv::IMREAD_GRAYSCALE);
    const phi::GrayImage own_gray = DecodeJpegGray(photo, {});
    ASSERT_EQ(gray.total(), own_gray.size()) << kind.name;
    EXPECT_TRUE(std::equal(own_gray.begin(), own_gray.end(), gray.data)) << kind.name;
    const std::pair<int, int> sides[] = {
        {0, cv::IMREAD_COLOR}, {60, cv::IMREAD_REDUCED_COLOR_2}, {30, cv::IMREAD_REDUCED_COLOR_4}, {9, cv::IMREAD_REDUCED_COLOR_8}};
    for (const auto& [side, flags] : sides) {
      cv::Mat color = cv::imdecode(photo.bytes, flags);
      cv::cvtColor(color, color, cv::COLOR_BGR2RGB);
      const ColorImage own = DecodeJpegColor(photo, {}, side);
      ASSERT_EQ(color.total(), own.size()) << kind.name << " " << side;
      EXPECT_TRUE(std::equal(own.begin(), own.end(), reinterpret_cast<const Rgb*>(color.data))) << kind.name << " " << side;
    }
  }
}

// The decoder filled up with gray, and a line without a name on stderr was all that told of it.
TEST(JpegDecoder, DamagedDataIsAnErrorThatNamesTheFile) {
  for (const Kind& kind : kKinds) {
    const PhotoFile photo = Encode(kind);
    const std::size_t place = (FindMarker(photo, kScan) + photo.bytes.size()) / 2;
    const PhotoFile damaged = Overwrite(photo, place, std::string(200, '\xF1').replace(100, 1, "\xFF"));
    testing::internal::CaptureStderr();
    const std::string told = std::string(kind.name) + ": this JPEG is damaged (Corrupt JPEG data: ";
    EXPECT_THAT(InputErrorOf([&] { DecodeJpegGray(damaged, {}); }), HasSubstr(told));
    EXPECT_THAT(InputErrorOf([&] { DecodeJpegColor(damaged, {}); }), HasSubstr(told));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << kind.name;
  }
}

TEST(JpegDecoder, WhatIsLeftOverBeforeMoreDataIsDamage) {
  const PhotoFile photo = Encode({.name = "a.jpg", .restart = 3});
  const PhotoFile longer = Insert(photo, FindMarker(photo, JPEG_RST0), "rest");
  EXPECT_THAT(InputErrorOf([&] { DecodeJpegGray(longer, {}); }), HasSubstr("a.jpg: this JPEG is damaged"));
}

// As cameras and old programs write them. All pixels are there.
TEST(JpegDecoder, OddFilesAreTakenInSilence) {
  const PhotoFile photo = Encode({.name = "a.jpg"});
  const phi::GrayImage expected = DecodeJpegGray(photo, {});
  constexpr std::size_t kVersion = 11, kLastCoefficient = 12;
  const PhotoFile odd[] = {Insert(photo, FindMarker(photo, JPEG_EOI), "\x7Fjunk"), Insert(photo, FindMarker(photo, kQuantization), "junk"),
                           Overwrite(photo, kVersion, "\x09"), Overwrite(photo, FindMarker(photo, kScan) + kLastCoefficient, "\x3E")};
  for (const PhotoFile& file : odd) {
    ASSERT_NE(file.bytes, photo.bytes);
    testing::internal::CaptureStderr();
    const phi::GrayImage image = DecodeJpegGray(file, {});
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), image.begin())) << &file - odd;
  }
}

TEST(JpegDecoder, KindsThatNobodyDecodesAreErrorsThatSaySo) {
  const PhotoFile photo = Encode({.name = "a.jpg"});
  constexpr std::size_t kBits = 4;
  const PhotoFile deep = Overwrite(photo, FindMarker(photo, kFrame) + kBits, "\x0C");
  EXPECT_THAT(InputErrorOf([&] { DecodeJpegGray(deep, {}); }),
              HasSubstr("a.jpg: this JPEG cannot be decoded (Unsupported JPEG data precision 12)"));
}

}  // namespace
}  // namespace colmap_ext
