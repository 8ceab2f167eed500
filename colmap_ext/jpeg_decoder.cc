#include "colmap_ext/jpeg_decoder.h"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <string>

#include <jpeglib.h>  // needs size_t and FILE before it

#include <jerror.h>

#include "colmap_ext/refused_photo.h"

namespace colmap_ext {
namespace {

using Inks = std::array<std::uint8_t, 4>;  // cyan, magenta, yellow, black; 255: none, as Adobe's programs store them

constexpr char kFormat[] = "JPEG";

struct ErrorManager : jpeg_error_mgr {
  std::jmp_buf way_out;
  bool in_data = false;  // between the header and the last pixel

  // Whether pixels are lost or wrong after the last warning: the data end before the image does, or hold what no encoder writes.
  // After others all pixels are there, and nothing is said: cameras and old programs leave bytes in the header and behind the last
  // pixel (JWRN_EXTRANEOUS_DATA), and write a scan's parameters (JWRN_NOT_SEQUENTIAL), a version (JWRN_JFIF_MAJOR) or a colour code
  // (JWRN_ADOBE_XFORM) that libjpeg finds odd.
  bool IsDamage() const {
    switch (msg_code) {
      case JWRN_JPEG_EOF:           // the file ends before its end marker
      case JWRN_HIT_MARKER:         // a marker within the data of a scan
      case JWRN_MUST_RESYNC:        // another restart marker than the next one
      case JWRN_HUFF_BAD_CODE:      // bits that stand for nothing
      case JWRN_ARITH_BAD_CODE:     // the same of the other coding
      case JWRN_BOGUS_PROGRESSION:  // a scan refines what none before it gave
        return true;
      case JWRN_EXTRANEOUS_DATA:  // of a part that others follow
        return in_data && msg_parm.i[1] != JPEG_EOI;
      default:
        return false;
    }
  }
};

ErrorManager& ManagerOf(j_common_ptr info) { return *static_cast<ErrorManager*>(info->err); }

[[noreturn]] void Leave(j_common_ptr info) { std::longjmp(ManagerOf(info).way_out, 1); }

void LeaveAtDamage(j_common_ptr info, int level) {
  if (level < 0 && ManagerOf(info).IsDamage()) Leave(info);
}

// libjpeg leaves at an error by longjmp, which passes destructors by: nothing in the functions that call it has one.
class Session {
 public:
  Session() {
    info_.err = jpeg_std_error(&errors_);
    errors_.error_exit = Leave;
    errors_.emit_message = LeaveAtDamage;
  }
  ~Session() { jpeg_destroy_decompress(&info_); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  bool ReadHeader(const PhotoFile& photo) {
    if (setjmp(errors_.way_out) != 0) return false;
    jpeg_create_decompress(&info_);
    jpeg_mem_src(&info_, photo.bytes.data(), photo.bytes.size());
    jpeg_read_header(&info_, TRUE);
    return true;
  }

  // The rows of the whole image, one after the other, and what lies behind it.
  bool ReadRows(std::uint8_t* pixels) {
    if (setjmp(errors_.way_out) != 0) return false;
    errors_.in_data = true;
    jpeg_start_decompress(&info_);
    const std::size_t row_bytes = std::size_t{info_.output_width} * info_.output_components;
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = pixels + info_.output_scanline * row_bytes;
      jpeg_read_scanlines(&info_, &row, 1);
    }
    errors_.in_data = false;
    jpeg_finish_decompress(&info_);
    return true;
  }

  // What ended the last call.
  std::string Problem() {
    char text[JMSG_LENGTH_MAX];
    errors_.format_message(reinterpret_cast<j_common_ptr>(&info_), text);
    if (errors_.msg_code == JWRN_JPEG_EOF) return "is cut short";
    return (errors_.IsDamage() ? "is damaged (" : "cannot be decoded (") + std::string(text) + ")";
  }

  jpeg_decompress_struct& info() { return info_; }

 private:
  ErrorManager errors_ = {};
  jpeg_decompress_struct info_ = {};
};

void Open(const PhotoFile& photo, const CheckSize& check_size, Session* session) {
  if (!session->ReadHeader(photo)) RefusePhoto(photo, kFormat, session->Problem());
  const std::size_t width = session->info().image_width, height = session->info().image_height;
  if (check_size) check_size(width, height);
  RefuseTooManyPixels(photo, kFormat, width, height);
}

template <typename Pixel>
phi::Array2D<Pixel> ReadPixels(const PhotoFile& photo, J_COLOR_SPACE colors, Session* session) {
  jpeg_decompress_struct& info = session->info();
  info.out_color_space = colors;
  jpeg_calc_output_dimensions(&info);
  auto image = phi::Array2D<Pixel>::Uninitialized(static_cast<int>(info.output_width), static_cast<int>(info.output_height));
  if (!session->ReadRows(reinterpret_cast<std::uint8_t*>(image.data()))) RefusePhoto(photo, kFormat, session->Problem());
  return image;
}

// As OpenCV mixes them.
Rgb Mix(const Inks& inks) {
  const int black = inks[3];
  const auto light = [&](int ink) { return static_cast<std::uint8_t>(black - ((255 - ink) * black >> 8)); };
  return {light(inks[0]), light(inks[1]), light(inks[2])};
}

// Luma weights 0.299, 0.587 and 0.114 in fixed point, as OpenCV has them.
std::uint8_t Luma(const Rgb& rgb) {
  constexpr int kBits = 14, kRed = 4899, kGreen = 9617, kBlue = (1 << kBits) - kRed - kGreen;
  return static_cast<std::uint8_t>((kRed * rgb[0] + kGreen * rgb[1] + kBlue * rgb[2] + (1 << (kBits - 1))) >> kBits);
}

template <typename Pixel, typename FromInks>
phi::Array2D<Pixel> Decode(const PhotoFile& photo, J_COLOR_SPACE colors, const FromInks& from_inks, Session* session) {
  if (session->info().num_components != 4) return ReadPixels<Pixel>(photo, colors, session);
  const auto printed = ReadPixels<Inks>(photo, JCS_CMYK, session);
  auto image = phi::Array2D<Pixel>::Uninitialized(printed.width(), printed.height());
  std::transform(printed.begin(), printed.end(), image.begin(), from_inks);
  return image;
}

}  // namespace

bool IsJpeg(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF;
}

phi::GrayImage DecodeJpegGray(const PhotoFile& photo, const CheckSize& check_size) {
  Session session;
  Open(photo, check_size, &session);
  return Decode<std::uint8_t>(photo, JCS_GRAYSCALE, [](const Inks& inks) { return Luma(Mix(inks)); }, &session);
}

ColorImage DecodeJpegColor(const PhotoFile& photo, const CheckSize& check_size, int longest_side) {
  Session session;
  Open(photo, check_size, &session);
  jpeg_decompress_struct& info = session.info();
  const std::size_t longest = std::max(info.image_width, info.image_height), wanted = static_cast<std::size_t>(longest_side);
  info.scale_num = info.scale_denom = 1;
  while (wanted > 0 && info.scale_denom < 8 && longest >= 2 * info.scale_denom * wanted) info.scale_denom *= 2;
  return Decode<Rgb>(photo, JCS_RGB, Mix, &session);
}

}  // namespace colmap_ext
