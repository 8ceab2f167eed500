#include "phi/texture_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "phi/base/error.h"
#include "tests/support/error_message.h"

namespace phi {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// As of a GPU that reads 131072x65000 pixels.
constexpr TextureLimits kLimits = {131072, 65000};

TEST(TextureLimits, ImagesUpToTheLimitsPass) {
  for (const auto& [width, height] : {std::pair{1, 1}, {131072, 65000}, {131072, 1}, {1, 65000}}) {
    EXPECT_NO_THROW(RequireTextureSize(width, height, kLimits, "task")) << width << "x" << height;
  }
}

TEST(TextureLimits, OnePixelMoreOfEitherSideIsTheImagesFault) {
  for (const auto& [width, height] : {std::pair{131073, 1}, {1, 65001}, {65001, 65001}}) {
    EXPECT_THROW(RequireTextureSize(width, height, kLimits, "task"), InputError) << width << "x" << height;
  }
}

// The size that --PatchMatchStereo.max_image_size limits is the longer side, which must fit either way round.
TEST(TextureLimits, TheMessageNamesTaskSizesAndWhatToDo) {
  const Message message = test_support::WholeMessageOf<InputError>(
      [] { RequireTextureSize(40000, 70000, kLimits, "stage 'estimation' of image '" + AboutImage("a.jpg") + "'"); });
  EXPECT_EQ(message.image, "a.jpg");
  EXPECT_THAT(message.text, AllOf(HasSubstr("stage 'estimation' of image 'a.jpg': "), HasSubstr("40000x70000"),
                             HasSubstr("131072x65000"), HasSubstr("max_image_size to 65000"),
                             HasSubstr("--PhiStereo.backend cpu")));
}

}  // namespace
}  // namespace phi
